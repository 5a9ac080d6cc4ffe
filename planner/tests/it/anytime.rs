//! The planner of schedules step by step, in a world in which nobody moves.

use planner::{Planner, PlannerInput};
use scene::{Event, Method, Scene, Settings, UserOrder};
use shm_types::{Activity, Counters, Grip, PlannerReport, Schedule, WorldSnapshot, zeroed};

use crate::room::{checked, draft, scene_of, shipped, start};

const MUCH: u64 = u64::MAX;
/// How long nobody may move before the plan is taken for one that cannot be followed.
const DOUBT_NS: u64 = 2_000_000_000;

struct Run {
    scene: Scene,
    settings: Settings,
    world: Box<WorldSnapshot>,
    planner: Planner,
    /// The newest.
    schedule: Box<Schedule>,
    report: PlannerReport,
}

impl Run {
    fn of(scene: Scene) -> Self {
        let settings = Settings {
            method: Method::Anytime,
            ..Settings::default()
        };
        let mut world = start(&scene);
        for robot in &mut world.robots {
            robot.activity = Activity::Waiting.code();
        }
        Self {
            world,
            planner: Planner::new(&scene, settings.clone()),
            settings,
            scene,
            schedule: zeroed(),
            report: PlannerReport::default(),
        }
    }

    /// One step; whether there is a new schedule, which is in force from then on.
    fn step(&mut self, units: u64) -> bool {
        let snapshot = checked(&self.scene, &self.world);
        let input = PlannerInput {
            snapshot,
            requests: &[],
        };
        let output = self.planner.step(&self.scene, input, units);
        let in_force = self.world.header.schedule_version;
        let new = output.schedule.filter(|new| new.version > in_force);
        if let Some(new) = new {
            self.schedule.copy_from(new);
            self.world.header.schedule_version = new.version;
        }
        let is_new = new.is_some();
        self.report = output.report;
        self.world.header.tick += 1;
        is_new
    }

    /// Steps of `units` until the first plan is out; how many.
    fn plan(&mut self, units: u64) -> u64 {
        (1..=100_000)
            .find(|_| self.step(units))
            .expect("there is a plan in the end")
    }

    /// Steps until all of the plan is listed, while no time passes.
    fn settle(&mut self) {
        let is_over = |this: &mut Self| !this.step(MUCH) && this.report.busy == 0;
        let steps = (0..10_000).position(|_| is_over(self));
        steps.expect("it comes to an end");
    }
}

#[test]
fn what_is_done_at_once_is_paid_for_step_by_step() {
    let mut whole = Run::of(shipped("swap"));
    whole.plan(MUCH);
    let units = whole.report.counters.units;
    let slice = units / 100;
    let mut sliced = Run::of(shipped("swap"));
    let steps = sliced.plan(slice);
    // Nothing is published before it is paid for.
    assert!((90..=110).contains(&steps), "{steps}");
    let listed = |run: &Run| {
        let part = |robot| format!("{:?}", run.schedule.actions_of(robot));
        run.scene
            .homes
            .iter()
            .enumerate()
            .map(|(robot, _)| part(robot))
            .collect::<Vec<_>>()
    };
    assert_eq!(listed(&whole), listed(&sliced));
}

#[test]
fn without_work_units_nothing_is_done() {
    let mut run = Run::of(shipped("swap"));
    for _ in 0..10 {
        assert!(!run.step(0));
    }
    assert_eq!(
        (run.report.counters, run.report.busy),
        (Counters::default(), 1)
    );
}

#[test]
fn better_plans_are_looked_for_while_robots_follow_the_first() {
    let mut run = Run::of(shipped("paper-17a"));
    run.plan(MUCH);
    let first = run.report.counters.units;
    run.settle();
    // There are enough orders of five objects to try for more than a round of a quarter second.
    let spent = run.report.counters.units - first;
    assert!(spent > run.settings.units_per_second / 4, "{spent}");
}

/// Robots that have a plan and stand still for too long are stopped, and planned for anew.
#[test]
fn a_plan_that_nobody_follows_is_doubted_in_time_and_not_before() {
    let mut run = Run::of(shipped("swap"));
    run.settle();
    assert!(run.schedule.action_count > 0);
    run.world.header.time_ns += DOUBT_NS / 2;
    assert!(!run.step(MUCH));
    run.world.header.time_ns += DOUBT_NS / 2;
    assert!(run.step(MUCH));
    assert_eq!(run.schedule.action_count, 0);
    // It counts from the newest change on.
    let mut run = Run::of(shipped("swap"));
    run.settle();
    run.world.header.time_ns += DOUBT_NS / 2;
    run.world.header.change += 1;
    assert!(!run.step(MUCH));
    run.world.header.time_ns += DOUBT_NS / 2;
    assert!(!run.step(MUCH));
}

#[test]
fn what_the_user_wants_grasped_first_is_waited_for() {
    let homes = [[0.5, 0.5], [7.5, 0.5]];
    let trips = [
        ([1.0, 2.0], Some([1.0, 2.8])),
        ([7.0, 2.0], Some([7.0, 2.8])),
    ];
    for (first, then) in [(0, 1), (1, 0)] {
        let mut draft = draft([0.0, 0.0, 8.0, 3.4], &[], &homes, &trips);
        draft.before = vec![UserOrder {
            first: (first, Event::Grasp),
            then: (then, Event::Grasp),
        }];
        let mut run = Run::of(scene_of(draft));
        run.settle();
        let actions = |robot| run.schedule.actions_of(robot);
        let grasp_of = |object: usize| {
            let is_it = |action: &shm_types::Action| {
                action.grip == Grip::Grasp.code() && action.object as usize == object
            };
            let at = |robot| actions(robot).iter().position(is_it);
            (0..2).find_map(|robot| Some((robot, at(robot)?))).unwrap()
        };
        let ((one, grasp), (other, later)) = (grasp_of(first), grasp_of(then));
        // Each is next to its own, and nothing else keeps them apart.
        assert_ne!(one, other);
        let mut before = actions(other)[..=later].iter();
        let waits = |action: &shm_types::Action| {
            let waits = run.schedule.waits_of(action).iter();
            waits
                .into_iter()
                .any(|wait| wait.robot as usize == one && wait.actions as usize > grasp)
        };
        assert!(before.any(waits), "{then} after {first}");
    }
}

/// A robot that stands beside the lattice is given a step more room, unless there is no plan then:
/// the goal here is right beside a robot in its dead end.
#[test]
fn where_there_is_no_plan_with_room_to_spare_there_is_one_without() {
    let homes = [[0.25, 0.25], [2.75, 0.25]];
    let trips = [([2.25, 0.25], Some([0.75, 0.25]))];
    let mut draft = draft([0.0, 0.0, 3.0, 0.5], &[], &homes, &trips);
    draft.objects[0].grasp = [0.0, 0.0];
    draft.objects[0].pass_under = true;
    let mut run = Run::of(scene_of(draft));
    let beside = &mut run.world.robots[1].position;
    beside.x -= 0.01;
    let lattice = &run.scene.lattice;
    assert!(lattice.exact && lattice.cell(scene::vec(*beside)).is_none());
    run.settle();
    let actions = (0..2).flat_map(|robot| run.schedule.actions_of(robot));
    let grips = actions.map(|action| action.grip);
    let grips: Vec<_> = grips.filter(|grip| *grip != Grip::Keep.code()).collect();
    assert_eq!(grips, [Grip::Grasp.code(), Grip::Release.code()]);
}

/// A planner that takes long while robots go on: each plan keeps what was listed of the one before.
#[test]
fn of_a_plan_that_keeps_what_was_listed_every_action_moves_or_grips() {
    let mut better = 0;
    for seed in 0..3 {
        let options = scene::GenerateOptions {
            seed,
            objects: 8,
            area_m2: 30.0,
            ..scene::GenerateOptions::default()
        };
        let mut run = Run::of(scene::generate(&options).unwrap().scene);
        let before = 7;
        for robot in &mut run.world.robots[..run.scene.homes.len()] {
            robot.actions = before;
        }
        run.plan(MUCH);
        for _ in 0..200 {
            run.world.header.time_ns += 500_000_000;
            run.world.header.change += 1;
            let is_new = run.step(run.settings.units_per_second / 10);
            better += u32::from(is_new && run.schedule.robots[0].kept != u32::MAX);
        }
        assert_whole(&run, before);
    }
    assert!(better > 2, "{better}");
}

/// All of the plan is listed, from the action on that was granted last, and does something.
fn assert_whole(run: &Run, before: u32) {
    for (robot, home) in run.scene.homes.iter().enumerate() {
        let part = run.schedule.part(robot).unwrap();
        assert_eq!((part.first, part.complete), (before - 1, 1));
        let mut at = scene::point(*home);
        for (number, action) in run.schedule.actions_of(robot).iter().enumerate().skip(1) {
            let is_still = action.to == at && action.grip == Grip::Keep.code();
            assert!(!is_still, "robot {robot} does nothing in {number}");
            at = action.to;
        }
        let left_m = (scene::vec(at) - home).norm();
        assert!(left_m <= scene::CONTACT_M, "robot {robot} ends elsewhere");
    }
}

/// One robot of many carries so much that its actions do not all fit into its share of a schedule.
fn long_plan() -> Scene {
    let mut homes = vec![[0.5, 0.5]];
    let idle = (0..63).map(|i| (f64::from(i % 8), f64::from(i / 8)));
    homes.extend(idle.map(|(column, row)| [10.5 + 0.75 * column, 0.5 + 0.9 * row]));
    let place = |i: u32| [1.0 + f64::from(i % 7), 2.0 + 3.0 * f64::from(i / 7)];
    let trips: Vec<_> = (0..14)
        .map(place)
        .map(|[x, y]| ([x, y], Some([x, y + 0.8])))
        .collect();
    let wall = [9.2, 0.0, 9.5, 8.0];
    scene_of(draft([0.0, 0.0, 17.0, 8.0], &[wall], &homes, &trips))
}

#[test]
fn no_more_is_listed_of_a_plan_for_a_scene_that_is_past() {
    let mut run = Run::of(long_plan());
    run.settle();
    let part = run.schedule.robots[0];
    assert_eq!((run.schedule.scene_version, part.complete), (0, 0));
    run.world.robots[0].actions = part.first + part.count;
    run.world.header.scene_version = 1;
    assert!(run.step(MUCH));
    assert_eq!(run.schedule.scene_version, 1);
    assert_eq!(run.schedule.action_count, 0);
}
