//! One robot against hand-made snapshots: what it says, tick by tick, when it is blocked, has
//! failed, is called, carries or is started again (rules 19–22, 24).
#![expect(clippy::unwrap_used, reason = "a test may fail")]

#[path = "phases/queued.rs"]
mod queued;

use robot::{Robot, RobotInput};
use scene::{Method, Scene, Settings, point, vec};
use shm_types::{
    Activity, Checked, Command, ConstraintTable, FailureCause, Grip, HardAnswer, HardRequest, NONE,
    Phase, Point, SnapshotHeader, TaskStatus, WorldSnapshot, zeroed,
};

const SECOND_NS: u64 = 1_000_000_000;
const DOORWAY: Point = Point::new(2.1, 1.3);
const MUCH: u64 = 10_000_000;
/// Plans of the first selection: the transfer, and the transit to it (rule 16).
const SELECTION: u64 = 2;

/// Two rooms and a doorway. Object 0 has to go from the right one to the left, object 1 may stand
/// anywhere. Robot 1 takes no part in selection: it only stands about.
const ROOMS: &str = r#"
    name = "two rooms"
    [robot]
    shape = { box = [0.5, 0.5] }
    speed = 0.5
    [object]
    shape = { box = [0.4, 0.4] }
    grasp = [0.0, -0.45]
    [workspace]
    bounds = [0.0, 0.0, 4.0, 3.0]
    walls = [{ box = [2.0, 0.0, 2.2, 0.8] }, { box = [2.0, 1.8, 2.2, 3.0] }]
    [[robots]]
    home = [0.5, 0.5]
    [[robots]]
    home = [3.5, 0.5]
    [[objects]]
    start = [3.0, 2.0]
    goal = [1.0, 2.0]
    [[objects]]
    start = [0.5, 2.7]
"#;

/// Robot 0, and a world that does nothing by itself but acknowledge.
struct Bench {
    scene: Scene,
    settings: Settings,
    robot: Robot,
    snapshot: Box<WorldSnapshot>,
    table: Box<ConstraintTable>,
    command: Command,
    answer: Option<HardAnswer>,
    units: u64,
    /// Whether what is asked for is granted; else it is in the queue.
    grants: bool,
}

impl Bench {
    fn new(method: Method) -> Self {
        Self::of(scene::parse(ROOMS, "rooms").unwrap(), method)
    }

    fn of(scene: Scene, method: Method) -> Self {
        let settings = Settings {
            method,
            ..Settings::default()
        };
        let mut snapshot: Box<WorldSnapshot> = zeroed();
        snapshot.header = SnapshotHeader {
            epoch: 1,
            robot_count: scene.counts().robots,
            object_count: scene.counts().objects,
            ..SnapshotHeader::default()
        };
        for (robot, home) in snapshot.robots.iter_mut().zip(&scene.homes) {
            robot.position = point(*home);
            robot.epoch_position = robot.position;
            (robot.task, robot.holding, robot.live, robot.incarnation) = (NONE, NONE, 1, 1);
        }
        snapshot.robots[0].epoch_free = 1;
        for (object, spec) in snapshot.objects.iter_mut().zip(&scene.objects) {
            (object.position, object.rest) = (point(spec.start), point(spec.start));
            (object.holder, object.claimed_by) = (NONE, NONE);
            object.goal = spec.goal.map_or(Point::default(), point);
            object.has_goal = u32::from(spec.goal.is_some());
            let done = if spec.goal.is_some() {
                TaskStatus::Waiting
            } else {
                TaskStatus::Done
            };
            (object.status, object.epoch_status) = (done.code(), done.code());
        }
        Self {
            robot: Robot::new(&scene, settings.clone(), 0, 1),
            scene,
            settings,
            snapshot,
            table: ConstraintTable::none(),
            command: Command::default(),
            answer: None,
            units: MUCH,
            grants: true,
        }
    }

    /// Lets the robot answer the present snapshot.
    fn step(&mut self) -> Option<HardRequest> {
        let counts = self.scene.counts();
        let input = RobotInput {
            snapshot: Checked::new(&*self.snapshot, counts).unwrap(),
            table: Checked::new(&*self.table, counts).unwrap(),
            schedule: None,
            answer: self.answer,
        };
        let asked = self
            .robot
            .step(&self.scene, input, self.units, &mut self.command);
        Checked::new(&self.command, counts).unwrap();
        asked
    }

    /// The next tick: the command is taken, what is asked for is granted, and nothing moves.
    fn tick(&mut self) {
        let header = &mut self.snapshot.header;
        header.tick += 1;
        header.time_ns += self.settings.tick_ns;
        let (me, command) = (&mut self.snapshot.robots[0], &self.command);
        me.acknowledged = command.sequence;
        me.task = command.claim.task;
        me.activity = command.activity;
        if command.path.id > me.request {
            me.request = command.path.id;
            if !self.grants {
                me.request_open = 1;
                return;
            }
            let ahead = command.path.points().get(1..).unwrap_or_default();
            me.grant_count = ahead.len() as u32;
            me.grant[..ahead.len()].copy_from_slice(ahead);
        }
    }

    /// Steps and ticks until `time_s` of virtual time; what was asked of the planner meanwhile.
    fn run_until(&mut self, time_s: u64) -> Vec<HardRequest> {
        let mut asked = Vec::new();
        while self.snapshot.header.time_ns < time_s * SECOND_NS {
            asked.extend(self.step());
            self.tick();
        }
        asked
    }

    fn put_object_1(&mut self, at: Point) {
        (
            self.snapshot.objects[1].position,
            self.snapshot.objects[1].rest,
        ) = (at, at);
    }

    /// The robot holds object 0 where it was grasped.
    fn let_it_hold(&mut self) {
        let grasp = point(vec(self.snapshot.objects[0].position) + self.scene.objects[0].grasp);
        let object = &mut self.snapshot.objects[0];
        (object.holder, object.claimed_by) = (0, 0);
        object.status = TaskStatus::Held.code();
        object.epoch_status = object.status;
        let me = &mut self.snapshot.robots[0];
        (me.position, me.epoch_position) = (grasp, grasp);
        (me.holding, me.task, me.epoch_free) = (0, 0, 0);
    }

    fn open_epoch(&mut self) {
        self.snapshot.header.epoch += 1;
        self.snapshot.header.change += 1;
    }

    fn plans(&self) -> u64 {
        self.command.counters.path_plans
    }

    fn phase(&self) -> Phase {
        Phase::decode(self.command.phase).unwrap()
    }

    fn activity(&self) -> Activity {
        Activity::decode(self.command.activity).unwrap()
    }
}

#[test]
fn it_claims_looks_and_asks_for_a_tenth_of_a_metre_in_its_first_step() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    assert_eq!(bench.step(), None);
    assert!(bench.robot.cycle().is_empty(), "one task is in no ring");
    assert_eq!(
        (bench.command.claim.task, bench.command.claim.epoch),
        (0, 1)
    );
    assert_eq!((bench.phase(), bench.command.go), (Phase::Transit, 1));
    assert_eq!(bench.plans(), SELECTION + 2, "approach and transfer");
    let path = bench.command.path.points();
    assert_eq!(path[0], point(bench.scene.homes[0]));
    let length_m: f64 = path
        .windows(2)
        .map(|p| (vec(p[1]) - vec(p[0])).norm())
        .sum();
    assert!((0.1 - 1e-9..0.1 + 0.08).contains(&length_m), "{length_m}");
    assert_eq!(bench.command.settled_at_change, u64::MAX);
    assert_eq!(
        bench.command.valid_until_tick,
        bench.settings.command_valid_ticks
    );
}

#[test]
fn while_it_computes_it_stands_still() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    bench.units = 100;
    bench.step();
    let mut steps = 1;
    while bench.phase() == Phase::Selecting || bench.activity() == Activity::Computing {
        assert_eq!((bench.command.go, bench.command.path.id), (0, 0));
        assert_eq!(bench.command.settled_at_change, u64::MAX);
        bench.tick();
        bench.step();
        steps += 1;
    }
    assert!(steps > 10, "{steps}");
    assert_eq!((bench.command.go, bench.command.path.id), (1, 1));
    let units = bench.command.counters.units;
    assert!(
        (100 * (steps - 1) + 1..=100 * steps).contains(&units),
        "{units}"
    );
}

#[test]
fn a_robot_in_the_way_is_waited_for_and_then_reported_without_asking_the_planner() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    bench.snapshot.robots[1].position = DOORWAY;
    bench.step();
    assert_eq!(
        (bench.phase(), bench.activity()),
        (Phase::Transit, Activity::Waiting)
    );
    assert_eq!(bench.plans(), SELECTION + 2, "with robots, and without");
    assert_eq!(bench.run_until(4), []);
    assert_eq!(bench.plans(), SELECTION + 2, "nothing has changed");
    assert_eq!(
        bench.command.settled_at_change,
        u64::MAX,
        "it may still fail"
    );
    assert_eq!(bench.command.failure.id, 0);
    assert_eq!(bench.run_until(6), []);
    let failure = bench.command.failure;
    assert_eq!((failure.id, failure.task, failure.epoch), (1, 0, 1));
    assert_eq!(
        (failure.cause, failure.blocker),
        (FailureCause::Robots.code(), 1)
    );
    assert_eq!(failure.answered, 1);
}

#[test]
fn it_looks_again_every_second_while_things_change() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    bench.snapshot.robots[1].position = DOORWAY;
    while bench.snapshot.header.time_ns <= 4 * SECOND_NS {
        bench.step();
        bench.tick();
        bench.snapshot.header.change += 1;
    }
    assert_eq!(bench.plans(), SELECTION + 2 * 5, "at 0, 1, 2, 3 and 4 s");
    bench.snapshot.robots[1].position = point(bench.scene.homes[1]);
    bench.run_until(6);
    assert_eq!(
        (bench.command.failure.id, bench.command.path.id),
        (0, 1),
        "the way is free"
    );
}

#[test]
fn objects_in_the_way_fail_the_task_at_once_and_the_planner_is_asked() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    bench.put_object_1(DOORWAY);
    let asked = bench.step().unwrap();
    assert_eq!(
        (asked.robot, asked.task, asked.failure, asked.epoch),
        (0, 0, 1, 1)
    );
    assert_eq!(
        (bench.phase(), bench.activity()),
        (Phase::Failing, Activity::Computing)
    );
    assert_eq!((bench.command.failure.answered, bench.command.go), (0, 0));
    assert_eq!(bench.command.failure.cause, FailureCause::Objects.code());
    assert_eq!(bench.command.failure.blocker, NONE);
    bench.tick();
    assert_eq!(bench.step(), None, "it does not ask every tick");
    assert_eq!(
        bench.command.claim.task, 0,
        "nobody else takes it meanwhile"
    );

    let answer = HardAnswer {
        robot: 0,
        incarnation: 1,
        failure: 1,
        task: 0,
        tick: 1,
        constraints_version: 0,
        found: 0,
        infeasible: 0,
        reserved: 0,
    };
    // Answers to another robot, to a process before it, to another failure.
    for (robot, incarnation, failure) in [(1, 1, 1), (0, 2, 1), (0, 1, 2)] {
        bench.answer = Some(HardAnswer {
            robot,
            incarnation,
            failure,
            ..answer
        });
        bench.tick();
        bench.step();
        assert_eq!(bench.command.failure.answered, 0);
    }
    bench.answer = Some(answer);
    bench.tick();
    bench.step();
    assert_eq!(bench.command.failure.answered, 1);
    assert_eq!(bench.phase(), Phase::Failing, "not counted yet");

    bench.tick();
    bench.open_epoch();
    bench.snapshot.objects[0].epoch_barred[0] = 1;
    bench.step();
    assert_eq!(
        (bench.phase(), bench.activity()),
        (Phase::Idle, Activity::Idle)
    );
    assert_eq!(bench.command.claim.task, NONE);
    assert_eq!(
        bench.command.settled_at_change,
        bench.snapshot.header.change
    );
}

/// The planner knows a failure by its number, and has answered that of the version before.
#[test]
fn failures_are_numbered_on_in_another_version_of_the_scene() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    bench.put_object_1(DOORWAY);
    assert_eq!(bench.step().unwrap().failure, 1);
    bench.robot.enter(&bench.scene);
    bench.tick();
    bench.open_epoch();
    assert_eq!(bench.step().map(|asked| asked.failure), Some(2));
}

/// The robot where it grasps object 0, in a room where grips take that long.
fn at_its_grasp(grasp_s: f64) -> Bench {
    let mut draft = scene::parse(ROOMS, "rooms").unwrap().draft().clone();
    draft.robot.grasp_s = grasp_s;
    let mut bench = Bench::of(Scene::new(draft).unwrap(), Method::GraspingAndRestricted);
    let object = &bench.scene.objects[0];
    let at = point(object.start + object.grasp);
    let me = &mut bench.snapshot.robots[0];
    (me.position, me.epoch_position) = (at, at);
    bench
}

#[test]
fn a_grip_that_takes_longer_than_it_waits_before_it_looks_again_is_left_alone() {
    let mut bench = at_its_grasp(5.0);
    bench.run_until(1);
    let plans = bench.plans();
    bench.run_until(4);
    assert_eq!((bench.phase(), bench.plans()), (Phase::Grasping, plans));
    assert_eq!(bench.command.grip, Grip::Grasp.code());
}

#[test]
fn only_a_grip_that_takes_no_time_leaves_the_way_found_before_it_good() {
    for (grasp_s, looks) in [(0.0, 0), (5.0, 1)] {
        let mut bench = at_its_grasp(grasp_s);
        bench.run_until(1);
        let plans = bench.plans();
        bench.let_it_hold();
        bench.step();
        assert_eq!(bench.phase(), Phase::Transfer);
        assert_eq!(bench.plans() - plans, looks, "{grasp_s} s");
    }
}

#[test]
fn an_unanswered_question_is_asked_again_and_given_up_at_the_deadline() {
    let mut bench = Bench::new(Method::Restricted);
    bench.put_object_1(DOORWAY);
    let asked = bench.run_until(60);
    assert!((2..20).contains(&asked.len()), "{}", asked.len());
    assert!(asked.iter().all(|request| request.failure == 1));
    assert_eq!(bench.command.failure.answered, 0);
    bench.run_until(bench.settings.answer_deadline_ns / SECOND_NS + 1);
    assert_eq!(bench.command.failure.answered, 1);
}

#[test]
fn methods_that_restrict_nothing_after_a_failure_ask_nothing() {
    let mut bench = Bench::new(Method::NoAction);
    bench.put_object_1(DOORWAY);
    assert_eq!(bench.step(), None);
    assert_eq!(
        (bench.command.failure.id, bench.command.failure.answered),
        (1, 1)
    );
}

#[test]
fn a_carrying_robot_that_is_blocked_waits_for_ever_and_looks_at_every_placement() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    bench.let_it_hold();
    bench.snapshot.robots[1].position = DOORWAY;
    assert_eq!(bench.run_until(60), []);
    assert_eq!(
        (bench.phase(), bench.activity()),
        (Phase::Transfer, Activity::Waiting)
    );
    assert_eq!((bench.command.failure.id, bench.plans()), (0, 1));
    assert_eq!(
        bench.command.settled_at_change, 0,
        "nothing to do since then"
    );
    bench.snapshot.header.change += 1;
    bench.step();
    assert_eq!((bench.plans(), bench.command.settled_at_change), (2, 1));
    bench.tick();
    bench.snapshot.header.change += 1;
    bench.step();
    assert_eq!(bench.plans(), 2, "not before a second has passed");
    assert_eq!(bench.command.settled_at_change, 1, "so it is not settled");
    bench.snapshot.header.placements += 1;
    bench.step();
    assert_eq!((bench.plans(), bench.command.settled_at_change), (3, 2));
}

#[test]
fn a_started_robot_that_holds_an_object_goes_on_with_it() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    bench.let_it_hold();
    bench.snapshot.robots[0].acknowledged = 700;
    bench.snapshot.robots[0].request = 40;
    bench.step();
    assert_eq!(
        (bench.phase(), bench.command.claim.task),
        (Phase::Transfer, 0)
    );
    assert_eq!((bench.command.path.id, bench.command.sequence), (41, 701));
    bench.snapshot.robots[0].position =
        point(vec(Point::new(1.0, 2.0)) + bench.scene.objects[0].grasp);
    bench.snapshot.objects[0].position = Point::new(1.0, 2.0);
    bench.robot = Robot::new(&bench.scene, bench.settings.clone(), 0, 1);
    bench.step();
    assert_eq!(
        (bench.phase(), bench.activity()),
        (Phase::Releasing, Activity::Gripping)
    );
    assert_eq!(bench.command.grip, Grip::Release.code());
}

#[test]
fn a_robot_that_missed_how_its_grip_closed_goes_on_with_what_it_holds() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    bench.step();
    assert_eq!(bench.phase(), Phase::Transit);
    bench.tick();
    bench.open_epoch();
    bench.let_it_hold();
    bench.step();
    assert_eq!(
        (bench.phase(), bench.command.claim.task),
        (Phase::Transfer, 0)
    );
}

#[test]
fn a_new_epoch_that_leaves_it_its_task_does_not_stop_it() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    bench.step();
    bench.tick();
    bench.open_epoch();
    bench.step();
    assert_eq!(
        (bench.command.claim.task, bench.command.claim.epoch),
        (0, 2)
    );
    assert_eq!((bench.command.path.id, bench.command.go), (1, 1));
    assert_eq!(bench.plans(), SELECTION + 2, "no new look");
}

#[test]
fn a_new_epoch_that_takes_its_task_away_sends_it_home_and_another_calls_it_back() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    bench.step();
    bench.tick();
    bench.snapshot.robots[0].position = Point::new(1.0, 1.0);
    bench.snapshot.robots[0].grant_count = 0;
    bench.open_epoch();
    bench.snapshot.objects[0].epoch_barred[0] = 1;
    bench.step();
    assert_eq!(
        (bench.phase(), bench.command.claim.task),
        (Phase::GoingHome, NONE)
    );
    assert_eq!(bench.command.path.id, 2);
    bench.tick();
    bench.open_epoch();
    bench.snapshot.objects[0].epoch_barred[0] = 0;
    bench.step();
    assert_eq!(
        (bench.phase(), bench.command.claim.task),
        (Phase::Transit, 0)
    );
    let asked = bench.command.path;
    let granted = bench.snapshot.robots[0].grant().last().unwrap();
    assert_eq!(
        (asked.id, &asked.points[0]),
        (3, granted),
        "from where it is going to be"
    );
}

#[test]
fn method_all_computes_until_the_constraints_are_complete() {
    let mut bench = Bench::new(Method::All);
    bench.step();
    assert_eq!(
        (bench.phase(), bench.activity()),
        (Phase::Selecting, Activity::Computing)
    );
    bench.tick();
    bench.table.version = 1;
    bench.table.complete_for_events = 0;
    bench.open_epoch();
    bench.step();
    assert_eq!(
        bench.phase(),
        Phase::Selecting,
        "that version is not the epoch's"
    );
    bench.tick();
    bench.snapshot.header.epoch_constraints_version = 1;
    bench.step();
    assert_eq!(
        (bench.phase(), bench.command.claim.constraints_version),
        (Phase::Transit, 1)
    );
}

#[test]
fn private_state_shows_in_the_hash() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    let mut seen = Vec::new();
    bench.units = 100;
    for _ in 0..20 {
        bench.step();
        assert!(!seen.contains(&bench.command.state_hash));
        seen.push(bench.command.state_hash);
        bench.tick();
    }
}

/// Two robots that have been told the same but for one thing, which both keep.
#[test]
fn what_phase_it_is_in_since_when_and_what_it_has_asked_for_show_in_the_hash() {
    let hash = |change: fn(&mut WorldSnapshot), at_grasp: bool| {
        let mut bench = if at_grasp {
            at_its_grasp(5.0)
        } else {
            Bench::new(Method::GraspingAndRestricted)
        };
        change(&mut bench.snapshot);
        bench.step();
        (bench.phase(), bench.command.state_hash)
    };
    let as_it_is: fn(&mut WorldSnapshot) = |_| {};
    let later: fn(&mut WorldSnapshot) = |snapshot| snapshot.header.time_ns += 10_000_000;
    let (phase, since) = hash(as_it_is, true);
    assert_eq!(phase, Phase::Grasping);
    assert_ne!(since, hash(later, true).1);
    let asked: fn(&mut WorldSnapshot) = |snapshot| snapshot.robots[0].request = 1;
    let (phase, first) = hash(as_it_is, false);
    assert_eq!(phase, Phase::Transit);
    assert_ne!(first, hash(asked, false).1);
}
