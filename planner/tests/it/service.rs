//! The planner service, step by step.

use planner::{Planner, PlannerInput};
use scene::{Draft, HardMode, Method, ObjectDraft, Scene, Settings, ShapeDraft, WallDraft};
use shm_types::capacity::MAX_CONSTRAINTS;
use shm_types::{
    Activity, Constraint, ConstraintKind, ConstraintTable, HardAnswer, HardRequest, PlannerReport,
    Schedule, WorldSnapshot, zeroed,
};

use crate::room::{checked, put, scene_of, shipped, start};

const MUCH: u64 = u64::MAX;

/// A planner with its world, and what others see of it.
struct Service {
    scene: Scene,
    world: Box<WorldSnapshot>,
    planner: Planner,
    table: Box<ConstraintTable>,
    tables: u32,
    report: PlannerReport,
}

impl Service {
    fn new(name: &str, method: Method, hard: HardMode) -> Self {
        Self::of(shipped(name), method, hard)
    }

    fn of(scene: Scene, method: Method, hard: HardMode) -> Self {
        Self {
            world: start(&scene),
            planner: Planner::new(
                &scene,
                Settings {
                    method,
                    hard,
                    ..Settings::default()
                },
            ),
            scene,
            table: zeroed(),
            tables: 0,
            report: PlannerReport::default(),
        }
    }

    /// One step; its answers.
    fn step(&mut self, requests: &[HardRequest], units: u64) -> Vec<HardAnswer> {
        let snapshot = checked(&self.scene, &self.world);
        let output = self
            .planner
            .step(&self.scene, PlannerInput { snapshot, requests }, units);
        if let Some(table) = output.table {
            assert_eq!(table.effect_tick, self.world.header.tick + 1);
            self.table.copy_from(table);
            self.tables += 1;
        }
        self.report = output.report;
        assert_eq!(self.report.tick, self.world.header.tick);
        assert_eq!(self.report.constraints_version, self.table.version);
        let answers = output.answers.to_vec();
        self.world.header.tick += 1;
        self.world.header.constraints_version = self.table.version;
        answers
    }

    /// Steps of `units` until nothing is left to do; all answers.
    fn settle(&mut self, requests: &[HardRequest], units: u64) -> Vec<HardAnswer> {
        let mut answers = self.step(requests, units);
        while self.report.busy == 1 {
            answers.extend(self.step(&[], units));
        }
        answers
    }

    fn complete(&mut self, task: usize) {
        let goal = self.world.objects[task].goal;
        put(&mut self.world.objects[task], goal);
        self.world.header.events += 1;
    }
}

fn request(robot: u32, failure: u32, task: u32) -> HardRequest {
    HardRequest {
        robot,
        incarnation: 1,
        failure,
        task,
        tick: 0,
        epoch: 1,
    }
}

fn edge(before: u32, after: u32, kind: ConstraintKind) -> Constraint {
    Constraint {
        before,
        after,
        kind: kind.code(),
    }
}

#[test]
fn a_failure_is_answered_once_worked_out_and_repeated_at_no_cost() {
    let mut service = Service::new("h1", Method::GraspingAndRestricted, HardMode::Literal);
    assert!(service.step(&[], MUCH).is_empty());
    assert_eq!((service.report.busy, service.report.counters.units), (0, 0));

    let asked = request(1, 1, 1);
    let mut waited = 0;
    let mut answers = service.step(&[asked], 50);
    while answers.is_empty() {
        assert_eq!((service.report.busy, service.tables), (1, 0));
        waited += 1;
        // Asked again meanwhile: nothing is begun anew.
        answers = service.step(&[asked], 50);
    }
    assert!(waited > 10);
    let [answer] = answers[..] else {
        panic!("{answers:?}")
    };
    assert_eq!((answer.robot, answer.failure, answer.task), (1, 1, 1));
    assert_eq!(
        (answer.found, answer.infeasible, answer.constraints_version),
        (1, 0, 1)
    );
    assert_eq!(answer.tick, service.world.header.tick - 1);
    assert_eq!(
        service.table.constraints(),
        [edge(0, 1, ConstraintKind::H1)]
    );
    assert_eq!((service.tables, service.report.busy), (1, 0));
    let counters = service.report.counters;
    assert_eq!(
        counters.units,
        counters.cells_expanded + charged_besides(&service)
    );

    let again = service.step(&[asked], MUCH);
    assert_eq!((again, service.report.counters), (vec![answer], counters));
    assert_eq!(service.tables, 1);

    // Another failure of the same task is a new one; it finds nothing new.
    let answers = service.settle(&[request(1, 2, 1)], MUCH);
    assert_eq!((answers[0].found, answers[0].constraints_version), (0, 1));
    assert!(
        service.report.counters.path_plans > counters.path_plans,
        "literal"
    );
    assert_eq!(service.tables, 1);
}

/// Units that are no cells: polygon tests, obstacles, resets.
fn charged_besides(service: &Service) -> u64 {
    let counters = service.report.counters;
    // Rule 10 resets three times and enters the object twice; the tests each reset and enter
    // one object. Here object 0 blocks one test: its mover had to be looked at alone, and was.
    let tests = counters.path_plans - 3;
    (3 + tests) * scene::UNITS_PER_RESET
        + (2 + tests) * scene::UNITS_PER_OBSTACLE
        + counters.polygon_tests * scene::UNITS_PER_POLYGON_TEST
}

#[test]
fn cached_does_no_test_twice() {
    let mut service = Service::new("h2", Method::Restricted, HardMode::Cached);
    service.settle(&[request(0, 1, 0), request(1, 1, 1)], 1000);
    assert_eq!(
        service.table.constraints(),
        [edge(1, 0, ConstraintKind::H2)]
    );
    let counters = service.report.counters;
    let answers = service.settle(&[request(0, 2, 0), request(1, 2, 1)], MUCH);
    assert_eq!(answers.iter().map(|answer| answer.found).sum::<u32>(), 0);
    assert_eq!(
        service.report.counters.cells_expanded,
        counters.cells_expanded
    );
}

#[test]
fn slices_change_no_answer_and_no_sum() {
    let outcome = |units| {
        let mut service = Service::new("h2", Method::Restricted, HardMode::Cached);
        let answers = service.settle(&[request(0, 1, 0), request(1, 1, 1)], units);
        let found: Vec<_> = answers
            .iter()
            .map(|answer| (answer.robot, answer.found, answer.infeasible))
            .collect();
        (
            found,
            service.table.constraints().to_vec(),
            service.report.counters,
        )
    };
    let whole = outcome(MUCH);
    for units in [1, 13, 400] {
        assert_eq!(outcome(units), whole);
    }
}

#[test]
fn an_infeasible_task_is_said_to_be_so() {
    let mut service = Service::new("unreachable-goal", Method::Restricted, HardMode::Cached);
    let answers: Vec<_> = (0..service.scene.counts().objects)
        .flat_map(|task| service.settle(&[request(0, task + 1, task)], MUCH))
        .collect();
    assert!(
        answers.iter().any(|answer| answer.infeasible == 1),
        "{answers:?}"
    );
}

#[test]
fn all_is_complete_for_every_event() {
    let mut service = Service::new("h1", Method::All, HardMode::Cached);
    service.step(&[], 100);
    assert_eq!((service.report.busy, service.tables), (1, 0));
    service.settle(&[], 100);
    assert_eq!(
        (service.table.version, service.table.complete_for_events),
        (1, 0)
    );
    assert_eq!(
        service.table.constraints(),
        [edge(0, 1, ConstraintKind::H1)]
    );
    let plans = service.report.counters.path_plans;

    service.complete(0);
    service.settle(&[], 100);
    assert_eq!(
        (service.table.version, service.table.complete_for_events),
        (2, 1)
    );
    assert_eq!(
        service.table.constraints(),
        [],
        "a finished task has no edges"
    );
    assert_eq!(
        service.report.counters.path_plans, plans,
        "nothing is computed twice"
    );

    // A failure brings nothing to light that is not known.
    let answers = service.settle(&[request(0, 1, 1)], 1);
    assert_eq!((answers[0].found, answers[0].constraints_version), (0, 2));
    service.world.header.events += 1;
    service.settle(&[], 1);
    assert_eq!(service.table.complete_for_events, 2);
}

#[test]
fn all_taken_literally_pays_at_every_event() {
    let mut service = Service::new("h1", Method::All, HardMode::Literal);
    service.settle(&[], MUCH);
    let plans = service.report.counters.path_plans;
    service.world.header.events += 1;
    // An event while it computes makes it start over.
    service.step(&[], 10);
    service.world.header.events += 1;
    service.settle(&[], MUCH);
    assert_eq!(service.table.complete_for_events, 2);
    assert_eq!(service.table.version, 2);
    assert!(service.report.counters.path_plans >= 2 * plans - 3);
}

#[test]
fn no_action_and_foreign_requests_cost_nothing() {
    let mut service = Service::new("h1", Method::NoAction, HardMode::Cached);
    let nonsense = [request(7, 1, 0), request(0, 1, 9)];
    assert!(service.settle(&nonsense, MUCH).is_empty());
    let answers = service.settle(&[request(1, 1, 1)], MUCH);
    assert_eq!((answers[0].found, answers[0].constraints_version), (0, 0));
    assert_eq!((service.report.counters.units, service.tables), (0, 0));
}

#[test]
fn a_new_life_of_a_robot_asks_anew() {
    let mut service = Service::new("h1", Method::Restricted, HardMode::Cached);
    service.step(&[request(1, 1, 1)], 10);
    let reborn = HardRequest {
        incarnation: 2,
        ..request(1, 1, 0)
    };
    let answers = service.settle(&[reborn], MUCH);
    let lives: Vec<_> = answers
        .iter()
        .map(|answer| (answer.incarnation, answer.task))
        .collect();
    assert_eq!(lives, [(1, 1), (2, 0)]);
    assert_eq!(service.step(&[reborn], MUCH), answers[1..]);
}

#[test]
fn constraints_of_an_object_put_down_elsewhere_are_withdrawn() {
    let mut service = Service::new("h1", Method::Restricted, HardMode::Cached);
    service.settle(&[request(1, 1, 1)], MUCH);
    assert_eq!(service.table.count, 1);
    put(
        &mut service.world.objects[0],
        shm_types::Point::new(6.0, 2.0),
    );
    service.step(&[], MUCH);
    assert_eq!((service.table.version, service.table.count), (2, 0));
}

#[test]
fn versions_go_on_after_a_restart() {
    let mut service = Service::new("h1", Method::Restricted, HardMode::Cached);
    service.world.header.constraints_version = 7;
    service.table.version = 7;
    service.settle(&[request(1, 1, 1)], MUCH);
    assert_eq!(service.table.version, 8);
}

#[test]
fn whoever_waits_for_a_table_gets_one_after_a_restart() {
    let mut service = Service::new("h1", Method::Restricted, HardMode::Cached);
    service.world.header.constraints_version = 7;
    service.table.version = 7;
    // Nothing has failed, so nothing is looked for again.
    service.step(&[], MUCH);
    assert_eq!(
        (service.tables, service.table.version, service.table.count),
        (1, 8, 0)
    );
}

#[test]
fn the_hash_tells_states_apart() {
    let hashes = |task: u32, units: u64| {
        let mut service = Service::new("h1", Method::Restricted, HardMode::Cached);
        let mut hashes = Vec::new();
        for tick in 0..40 {
            let asked = [request(0, 1, task)];
            service.step(if tick == 1 { &asked } else { &[] }, units);
            hashes.push(service.report.state_hash);
        }
        hashes
    };
    let first = hashes(0, 40);
    assert_eq!(first, hashes(0, 40));
    let other = hashes(1, 40);
    assert_eq!(first[0], other[0]);
    assert!((1..40).all(|tick| first[tick] != other[tick]));
    assert!(
        (1..40).all(|tick| first[tick] != first[tick - 1]),
        "work shows every tick"
    );
}

/// 200 objects one behind the other in a dead end as wide as they are, each grasped from the
/// side of the exit: each of them blocks all that are behind it.
fn dead_end() -> Scene {
    let mut draft = Draft::room("dead end", [0.0, 0.0, 114.5, 10.0]);
    draft.walls = vec![
        WallDraft::Box([12.0, 0.0, 114.5, 4.5]),
        WallDraft::Box([12.0, 5.0, 114.5, 10.0]),
    ];
    draft.homes = vec![[11.25, 0.25]];
    for i in 0..200_u32 {
        let (column, row) = (f64::from(i % 10), f64::from(i / 10));
        let start = [14.25 + 0.5 * f64::from(i), 4.75];
        let goal = [1.25 + column, 0.25 + 0.5 * row];
        let mut object = ObjectDraft::paper(start, Some(goal));
        object.shape = ShapeDraft::Box([0.5, 0.5]);
        object.grasp = [-0.5, 0.0];
        draft.objects.push(object);
    }
    scene_of(draft)
}

#[test]
fn a_table_that_is_full_says_how_much_is_missing() {
    let scene = dead_end();
    assert_eq!(scene.lattice.pitch_m, 0.5);
    let mut service = Service::of(scene, Method::Restricted, HardMode::Cached);
    for task in 0..199 {
        let answers = service.settle(&[request(0, task + 1, task)], MUCH);
        assert_eq!(answers[0].found, 199 - task);
    }
    let pairs = 200 * 199 / 2;
    assert_eq!(service.table.count as usize, MAX_CONSTRAINTS);
    assert_eq!(
        service.report.constraints_dropped as usize,
        pairs - MAX_CONSTRAINTS
    );
    assert!(service.table.constraints().is_sorted());
}

/// Version and number of actions of what a planner publishes in its first step and in the next
/// hundred, where this is in force, in the scene as it was first.
fn published_after(last: Option<&Schedule>, in_force: u32) -> (Option<(u32, u32)>, usize) {
    published_in(0, last, in_force)
}

/// The same in a version of the scene.
fn published_in(
    scene_version: u32,
    last: Option<&Schedule>,
    in_force: u32,
) -> (Option<(u32, u32)>, usize) {
    let scene = shipped("paper-68a");
    let settings = Settings {
        method: Method::Anytime,
        ..Settings::default()
    };
    let mut world = start(&scene);
    world.header.schedule_version = in_force;
    world.header.scene_version = scene_version;
    for robot in &mut world.robots[..4] {
        robot.activity = Activity::Idle.code();
    }
    let mut planner = Planner::succeeding(&scene, settings, 2, last);
    let mut step = |world: &WorldSnapshot| {
        let input = PlannerInput {
            snapshot: checked(&scene, world),
            requests: &[],
        };
        let output = planner.step(&scene, input, MUCH);
        let told = |schedule: &Schedule| (schedule.version, schedule.action_count);
        output.schedule.map(told)
    };
    let first = step(&world);
    let mut more = 0;
    for tick in 1..100 {
        world.header.tick = tick;
        (world.header.schedule_version, _) = first.unwrap_or((in_force, 0));
        more += usize::from(step(&world).is_some());
    }
    (first, more)
}

/// A schedule that lists one action of robot 0.
fn schedule_of_one_action(version: u32, complete: u32) -> Box<Schedule> {
    let mut schedule: Box<Schedule> = zeroed();
    (schedule.version, schedule.robot_count) = (version, 4);
    schedule.action_count = 1;
    for part in &mut schedule.robots[..4] {
        part.complete = 1;
    }
    (schedule.robots[0].count, schedule.robots[0].complete) = (1, complete);
    schedule
}

#[test]
fn the_next_planner_publishes_a_whole_plan_once_more_and_leaves_robots_to_it() {
    let last = schedule_of_one_action(7, 1);
    assert_eq!(published_after(Some(&last), 7), (Some((7, 1)), 0));
    assert_eq!(
        published_after(Some(&last), 0).0,
        Some((7, 1)),
        "also if the world had not got it"
    );
}

#[test]
fn the_next_planner_stops_robots_and_plans_anew_where_it_does_not_know_all_of_the_plan() {
    let part = schedule_of_one_action(7, 0);
    for last in [Some(&*part), None] {
        let (first, more) = published_after(last, 7);
        let (version, actions) = first.unwrap();
        assert!(version > 7 && actions == 0, "{version}, {actions} actions");
        assert!(more > 0, "and then plans");
    }
}

#[test]
fn the_next_planner_leaves_robots_to_a_whole_plan_for_the_scene_in_force_and_to_no_other() {
    let mut last = schedule_of_one_action(7, 1);
    last.scene_version = 2;
    assert_eq!(published_in(2, Some(&last), 7), (Some((7, 1)), 0));
    for in_force in [0, 1, 3] {
        let (first, more) = published_in(in_force, Some(&last), 7);
        let (version, actions) = first.unwrap();
        assert!(version > 7 && actions == 0, "{version}, {actions} actions");
        assert!(more > 0, "and then plans");
    }
}
