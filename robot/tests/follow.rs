//! One robot that follows a schedule, against hand-made snapshots: what it asks for, claims and
//! grips, and when.
#![expect(clippy::unwrap_used, reason = "a test may fail")]

use robot::{Robot, RobotInput};
use scene::{Method, Scene, Settings, point};
use shm_types::{
    Action, Activity, Checked, Command, ConstraintTable, Grip, NONE, Phase, Point, RobotSchedule,
    Schedule, SnapshotHeader, TaskStatus, Wait, WorldSnapshot, zeroed,
};

const ROOM: &str = r#"
    name = "room"
    [robot]
    shape = { box = [0.5, 0.5] }
    speed = 0.5
    [object]
    shape = { box = [0.4, 0.4] }
    grasp = [0.0, -0.45]
    [workspace]
    bounds = [0.0, 0.0, 4.0, 3.0]
    [[robots]]
    home = [0.5, 0.5]
    [[robots]]
    home = [3.5, 0.5]
    [[objects]]
    start = [1.0, 2.0]
    goal = [3.0, 2.0]
"#;

const GRASP: Point = Point::new(1.0, 1.55);
const GOAL: Point = Point::new(3.0, 1.55);
const HOME: Point = Point::new(0.5, 0.5);

/// Robot 0 and the snapshot it is shown. Its plan: to the grasp by a corner, to the goal, aside,
/// home; the way aside after robot 1's third action.
struct Bench {
    scene: Scene,
    robot: Robot,
    snapshot: Box<WorldSnapshot>,
    schedule: Option<Box<Schedule>>,
    command: Command,
}

fn plan() -> Box<Schedule> {
    let mut plan: Box<Schedule> = zeroed();
    (
        plan.version,
        plan.robot_count,
        plan.action_count,
        plan.wait_count,
    ) = (1, 2, 5, 1);
    plan.robots[0] = RobotSchedule {
        first: 0,
        count: 5,
        offset: 0,
        complete: 1,
        kept: u32::MAX,
    };
    let actions = [
        (Point::new(1.0, 0.5), Grip::Keep),
        (GRASP, Grip::Grasp),
        (GOAL, Grip::Release),
        (Point::new(3.0, 0.5), Grip::Keep),
        (HOME, Grip::Keep),
    ];
    for (action, (to, grip)) in plan.actions.iter_mut().zip(actions) {
        *action = Action {
            to,
            grip: grip.code(),
            object: if grip == Grip::Keep { NONE } else { 0 },
            turn: 0,
            first_wait: 0,
            waits: 0,
            reserved: 0,
        };
    }
    plan.actions[3].waits = 1;
    plan.waits[0] = Wait {
        robot: 1,
        actions: 3,
    };
    plan
}

impl Bench {
    fn new() -> Self {
        let scene = scene::parse(ROOM, "room").unwrap();
        let mut snapshot: Box<WorldSnapshot> = zeroed();
        snapshot.header = SnapshotHeader {
            epoch: 1,
            change: 7,
            schedule_version: 1,
            robot_count: 2,
            object_count: 1,
            ..SnapshotHeader::default()
        };
        for (robot, home) in snapshot.robots.iter_mut().zip(&scene.homes) {
            robot.position = point(*home);
            (robot.task, robot.holding, robot.live, robot.incarnation) = (NONE, NONE, 1, 1);
        }
        let object = &mut snapshot.objects[0];
        object.position = point(scene.objects[0].start);
        (object.holder, object.claimed_by) = (NONE, NONE);
        object.status = TaskStatus::Waiting.code();
        Self {
            robot: Self::robot(&scene),
            scene,
            snapshot,
            schedule: Some(plan()),
            command: Command::default(),
        }
    }

    fn robot(scene: &Scene) -> Robot {
        let settings = Settings {
            method: Method::Anytime,
            ..Settings::default()
        };
        Robot::new(scene, settings, 0, 1)
    }

    fn step(&mut self) -> (Phase, Activity) {
        let counts = self.scene.counts();
        let table = ConstraintTable::none();
        let schedule = self.schedule.as_deref();
        let input = RobotInput {
            snapshot: Checked::new(&*self.snapshot, counts).unwrap(),
            table: Checked::new(&*table, counts).unwrap(),
            schedule: schedule.map(|schedule| Checked::new(schedule, counts).unwrap()),
            answer: None,
        };
        let asked = self.robot.step(&self.scene, input, 0, &mut self.command);
        assert_eq!(asked, None, "it needs no constraints");
        Checked::new(&self.command, counts).unwrap();
        (
            Phase::decode(self.command.phase).unwrap(),
            Activity::decode(self.command.activity).unwrap(),
        )
    }

    /// The next snapshot: what is asked for is granted and, as if in no time, driven.
    fn drive(&mut self) {
        let header = &mut self.snapshot.header;
        header.tick += 1;
        header.time_ns += 10_000_000;
        let (me, path) = (&mut self.snapshot.robots[0], &self.command.path);
        me.acknowledged = self.command.sequence;
        if path.id > me.request {
            (me.request, me.actions) = (path.id, path.actions);
            me.position = *path.points().last().unwrap();
        }
    }

    /// The robot stands at `place`, with `actions` granted.
    fn stand(&mut self, place: Point, actions: u32) {
        let me = &mut self.snapshot.robots[0];
        (me.position, me.actions) = (place, actions);
    }

    fn hold(&mut self, holds: bool) {
        let (me, object) = (&mut self.snapshot.robots[0], &mut self.snapshot.objects[0]);
        (me.holding, object.holder) = if holds { (0, 0) } else { (NONE, NONE) };
        object.put_downs += u32::from(!holds);
    }

    fn grip(&self) -> Grip {
        Grip::decode(self.command.grip).unwrap()
    }

    /// What its command asks for: corners after the first, and actions granted with them.
    fn asked(&self) -> (usize, u32) {
        let path = &self.command.path;
        (path.points().len().saturating_sub(1), path.actions)
    }
}

#[test]
fn a_task_from_the_first_action_to_the_last() {
    let mut bench = Bench::new();
    assert_eq!(bench.step(), (Phase::Transit, Activity::Waiting));
    assert_eq!(bench.asked(), (2, 2), "up to the grip, not across it");
    assert_eq!(bench.command.path.schedule_version, 1);
    assert_eq!(
        (bench.command.claim.task, bench.command.claim.epoch),
        (0, 1)
    );
    bench.drive();
    assert_eq!(bench.step(), (Phase::Grasping, Activity::Gripping));
    assert_eq!((bench.grip(), bench.command.go), (Grip::Grasp, 1));
    assert_eq!(
        bench.asked(),
        (1, 3),
        "along with the grip, what comes after"
    );
    bench.hold(true);
    assert_eq!(bench.step(), (Phase::Transfer, Activity::Waiting));
    assert_eq!((bench.grip(), bench.asked()), (Grip::Keep, (1, 3)));
    bench.drive();
    assert_eq!(bench.step(), (Phase::Releasing, Activity::Gripping));
    assert_eq!(bench.grip(), Grip::Release);
    bench.hold(false);
    assert_eq!(bench.step(), (Phase::GoingHome, Activity::Waiting));
    assert_eq!(bench.asked(), (1, 3), "robot 1 goes first");
    assert_eq!(bench.command.claim.task, NONE);
    assert_eq!(bench.command.settled_at_change, u64::MAX);
    bench.snapshot.robots[1].actions = 3;
    bench.step();
    assert_eq!(bench.asked(), (2, 5));
    bench.drive();
    assert_eq!(bench.step(), (Phase::Idle, Activity::Idle));
    assert_eq!(bench.command.settled_at_change, 7);
}

#[test]
fn along_with_a_grip_nothing_is_asked_for_that_waits_or_goes_nowhere() {
    let mut bench = Bench::new();
    bench.schedule.as_deref_mut().unwrap().actions[3].to = GOAL;
    for others in [0, 3] {
        bench.snapshot.robots[1].actions = others;
        bench.hold(true);
        bench.stand(GOAL, 3);
        bench.step();
        assert_eq!(bench.grip(), Grip::Release);
        assert_eq!(bench.asked(), (0, 0), "{others} actions of robot 1");
        bench.hold(false);
    }
    bench.step();
    assert_eq!(bench.asked(), (0, 4), "once the grip is made");
}

#[test]
fn what_is_asked_for_along_with_a_grip_is_repeated_until_the_schedule_changes() {
    let mut bench = Bench::new();
    bench.stand(GRASP, 2);
    bench.step();
    let asked = bench.command.path;
    bench.snapshot.robots[0].acknowledged = bench.command.sequence;
    bench.step();
    assert_eq!((bench.grip(), bench.asked()), (Grip::Grasp, (1, 3)));
    assert_eq!(bench.command.path.id, asked.id);
    bench.schedule.as_deref_mut().unwrap().version = 2;
    bench.step();
    let path = &bench.command.path;
    assert_eq!((path.id, path.schedule_version), (asked.id + 1, 2));
}

/// The world may have granted it by then: another one would not go on from where that ends.
#[test]
fn while_what_was_asked_for_along_with_a_grip_is_on_its_way_nothing_else_is() {
    let mut bench = Bench::new();
    // The way aside waits for nobody, the way home for robot 1.
    let plan = bench.schedule.as_deref_mut().unwrap();
    (plan.actions[3].waits, plan.actions[4].waits) = (0, 1);
    bench.hold(true);
    bench.stand(GOAL, 3);
    bench.step();
    assert_eq!((bench.grip(), bench.asked()), (Grip::Release, (1, 4)));
    let asked = bench.command.path.id;
    bench.snapshot.robots[1].actions = 3;
    bench.step();
    assert_eq!((bench.command.path.id, bench.asked()), (asked, (1, 4)));
    bench.snapshot.robots[0].acknowledged = bench.command.sequence;
    bench.step();
    assert_eq!((bench.command.path.id, bench.asked()), (asked + 1, (2, 5)));
}

#[test]
fn a_process_started_in_the_middle_does_what_the_one_before_it_did() {
    let mut bench = Bench::new();
    bench.stand(GRASP, 2);
    bench.snapshot.robots[0].request = 9;
    assert_eq!(bench.step(), (Phase::Grasping, Activity::Gripping));
    assert_eq!(bench.command.claim.task, 0);
    bench.hold(true);
    bench.robot = Bench::robot(&bench.scene);
    assert_eq!(bench.step(), (Phase::Transfer, Activity::Waiting));
    assert_eq!((bench.command.path.id, bench.asked()), (10, (1, 3)));
}

#[test]
fn it_asks_for_more_while_it_moves_but_not_past_a_grip_and_not_too_far() {
    let mut bench = Bench::new();
    let plan = bench.schedule.as_deref_mut().unwrap();
    plan.robots[0].count = 12;
    plan.action_count = 12;
    for (k, action) in plan.actions.iter_mut().enumerate().take(12) {
        action.to = Point::new(0.5 + 0.25 * (k + 1) as f64, 0.5);
        (action.grip, action.object, action.waits) = (Grip::Keep.code(), NONE, 0);
    }
    bench.step();
    assert_eq!(bench.asked(), (8, 8));
    // All of it is granted, and none of it driven.
    let me = &mut bench.snapshot.robots[0];
    (me.request, me.actions, me.grant_count) = (1, 8, 8);
    for (k, point) in me.grant[..8].iter_mut().enumerate() {
        *point = bench.command.path.points[k + 1];
    }
    bench.step();
    assert_eq!(bench.asked(), (8, 8), "eight corners are enough");
    let me = &mut bench.snapshot.robots[0];
    me.grant_count = 7;
    me.grant.copy_within(1..8, 0);
    me.position = Point::new(0.75, 0.5);
    bench.step();
    assert_eq!((bench.command.path.id, bench.asked()), (2, (4, 12)));
    assert_eq!(
        bench.command.path.points[0],
        Point::new(2.5, 0.5),
        "from the grant's end"
    );
}

#[test]
fn an_object_is_claimed_and_grasped_in_its_turn_only() {
    let mut bench = Bench::new();
    bench.schedule.as_deref_mut().unwrap().actions[1].turn = 1;
    bench.step();
    assert_eq!(
        bench.command.claim.task, NONE,
        "somebody else moves it first"
    );
    bench.stand(GRASP, 2);
    assert_eq!(bench.step(), (Phase::Grasping, Activity::Waiting));
    assert_eq!((bench.grip(), bench.command.claim.task), (Grip::Keep, NONE));
    bench.snapshot.objects[0].put_downs = 1;
    bench.snapshot.objects[0].claimed_by = 1;
    bench.step();
    assert_eq!(bench.command.claim.task, NONE, "robot 1 still claims it");
    bench.snapshot.objects[0].claimed_by = NONE;
    bench.snapshot.header.epoch = 5;
    assert_eq!(bench.step(), (Phase::Grasping, Activity::Gripping));
    assert_eq!(
        (bench.command.claim.task, bench.command.claim.epoch),
        (0, 5)
    );
}

#[test]
fn the_grip_of_an_action_that_is_not_listed_any_more_is_still_done() {
    let mut bench = Bench::new();
    bench.step();
    bench.drive();
    let plan = bench.schedule.as_deref_mut().unwrap();
    plan.version = 2;
    plan.robots[0] = RobotSchedule {
        first: 2,
        count: 3,
        offset: 2,
        complete: 1,
        kept: u32::MAX,
    };
    bench.snapshot.header.schedule_version = 2;
    assert_eq!(bench.step(), (Phase::Grasping, Activity::Gripping));
    assert_eq!(bench.command.claim.task, 0);
}

#[test]
fn an_action_that_goes_nowhere_is_asked_for_alone() {
    let mut bench = Bench::new();
    let plan = bench.schedule.as_deref_mut().unwrap();
    plan.actions[0].to = HOME;
    bench.step();
    assert_eq!(bench.asked(), (0, 1));
    assert_eq!(bench.command.path.points(), [HOME]);
    bench.drive();
    let plan = bench.schedule.as_deref_mut().unwrap();
    plan.actions[2].to = GRASP;
    bench.step();
    assert_eq!(bench.asked(), (1, 2));
}

#[test]
fn without_a_schedule_it_computes_and_is_settled_while_none_is_in_force() {
    let mut bench = Bench::new();
    bench.schedule = None;
    bench.snapshot.header.schedule_version = 0;
    assert_eq!(bench.step(), (Phase::Selecting, Activity::Computing));
    assert_eq!((bench.command.settled_at_change, bench.asked().0), (7, 0));
    // One is in force, but has not come yet.
    bench.snapshot.header.schedule_version = 1;
    assert_eq!(bench.step(), (Phase::Selecting, Activity::Computing));
    assert_eq!(bench.command.settled_at_change, u64::MAX);
    // It lists nothing more, and the planner is to go on.
    bench.schedule = Some(plan());
    bench.schedule.as_deref_mut().unwrap().robots[0] = RobotSchedule::default();
    assert_eq!(bench.step().1, Activity::Computing);
    assert_eq!(bench.command.settled_at_change, 7);
    // So it is to, but nothing is to begin before that.
    let plan = bench.schedule.as_deref_mut().unwrap();
    plan.listed_until_tick = bench.snapshot.header.tick + 1;
    assert_eq!(bench.step().1, Activity::Waiting);
    assert_eq!(bench.command.settled_at_change, u64::MAX);
}

#[test]
fn a_request_that_was_no_sound_one_is_made_again_now_and_then() {
    let mut bench = Bench::new();
    bench.step();
    bench.snapshot.robots[0].acknowledged = bench.command.sequence;
    bench.snapshot.robots[0].request = 1;
    bench.step();
    assert_eq!(bench.command.path.id, 1, "not at once");
    assert_eq!(bench.command.settled_at_change, 7);
    bench.snapshot.header.time_ns = Settings::default().look_again_ns;
    bench.step();
    assert_eq!(bench.command.path.id, 2);
    // Under another version it is another request.
    bench.snapshot.robots[0].request = 2;
    bench.snapshot.header.schedule_version = 2;
    bench.schedule.as_deref_mut().unwrap().version = 2;
    bench.step();
    assert_eq!(bench.command.path.id, 3);
}
