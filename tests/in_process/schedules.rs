//! Schedules as they are executed: robots follow plans written by hand, in one thread. Each run is
//! traced and checked by a checker that shares no planning code (rule 26).

use crate::plans::{CORRIDOR, corridor, go, schedule};
use planner::{Planner, PlannerInput};
use robot::{Robot, RobotInput};
use scene::{Method, Scene, Settings};
use shm_types::{
    Activity, Checked, Command, ConstraintTable, ControlKind, ControlRequest, EventKind,
    MotionBatch, Outcome, PlannerReport, RoleKind, Schedule, WorldSnapshot, zeroed,
};
use sim::{SimReport, Simulation};
use trace::{Ending, SceneRecord, Writer};
use world::{FIRST_INCARNATION, World, WorldInput};

/// Robots 0.5 m square at 0.5 m/s that grasp objects 0.4 m square from the −y side, in a room of
/// 6 m by 3 m.
const ROOM: &str = r#"
    name = "room"
    [robot]
    shape = { box = [0.5, 0.5] }
    speed = 0.5
    [object]
    shape = { box = [0.4, 0.4] }
    grasp = [0.0, -0.45]
    [workspace]
    bounds = [0.0, 0.0, 6.0, 3.0]
"#;

fn parse(text: &str) -> Scene {
    scene::parse(text, "room").unwrap_or_else(|e| panic!("{e:?}"))
}

fn room(more: &str) -> Scene {
    parse(&format!("{ROOM}{more}"))
}

fn settings() -> Settings {
    Settings {
        method: Method::Anytime,
        time_limit_ns: 200_000_000_000,
        ..Settings::default()
    }
}

fn simulation(scene: &Scene, plan: Box<Schedule>) -> Simulation<'_> {
    let planner = Planner::with_schedule(scene, settings(), plan);
    Simulation::new(scene, &settings(), 1).with_planner(planner)
}

/// A trace of a run under way.
struct Tracer<'s> {
    scene: &'s Scene,
    writer: Writer<Vec<u8>>,
    /// Tasks in the order in which they were completed.
    completed: Vec<u32>,
}

impl<'s> Tracer<'s> {
    fn new(scene: &'s Scene) -> Self {
        let record = SceneRecord::new(scene, &settings(), 1);
        Self {
            scene,
            writer: Writer::new(Vec::new(), &record, 1_000_000_000).unwrap(),
            completed: Vec::new(),
        }
    }

    fn tick(&mut self, snapshot: &WorldSnapshot, motion: &MotionBatch) {
        self.writer.batch(motion).unwrap();
        let snapshot = Checked::new(snapshot, self.scene.counts()).unwrap();
        self.writer.snapshot(snapshot).unwrap();
        let completed = EventKind::Completed.code();
        let events = motion.events[..motion.event_count as usize].iter();
        self.completed
            .extend(events.filter(|e| e.kind == completed).map(|e| e.task));
    }

    fn check(self, outcome: Outcome, time_ns: u64) -> Vec<u32> {
        let ending = Ending {
            outcome: outcome.into(),
            reason: None,
            makespan_ns: time_ns,
            options: serde_json::Value::Null,
        };
        let checked = trace::check(self.writer.finish(ending).unwrap().as_slice()).unwrap();
        assert!(checked.complete);
        assert_eq!(checked.violations, []);
        self.completed
    }
}

/// Runs to the end; the report, and the order of completions.
fn run(scene: &Scene, plan: Box<Schedule>) -> (SimReport, Vec<u32>) {
    let mut simulation = simulation(scene, plan);
    let mut tracer = Tracer::new(scene);
    while simulation.outcome() == Outcome::Running {
        simulation.tick();
        tracer.tick(simulation.snapshot(), simulation.motion());
    }
    let report = simulation.report();
    assert_eq!(report.world.invalid_claims, 0);
    assert_eq!(report.world.selection_conflicts, 0);
    let completed = tracer.check(report.outcome, report.time_ns);
    (report, completed)
}

fn solve(scene: &Scene, plan: Box<Schedule>) -> (SimReport, Vec<u32>) {
    let (report, completed) = run(scene, plan);
    assert_eq!(report.outcome, Outcome::Solved, "{:?}", report.reason);
    assert_eq!(report.world.invalid_requests, 0);
    assert_eq!(report.world.schedules_refused, 0);
    (report, completed)
}

#[test]
fn a_robot_moves_an_object_and_loses_no_tick_to_grips() {
    let scene =
        room("[[robots]]\nhome = [0.5, 0.5]\n[[objects]]\nstart = [2.0, 1.5]\ngoal = [4.0, 1.5]\n");
    let plan = schedule(&[vec![
        go(2.0, 0.5),
        go(2.0, 1.05).grasp(0, 0),
        go(4.0, 1.05).release(0),
        go(4.0, 0.5),
        go(0.5, 0.5),
    ]]);
    let (report, completed) = solve(&scene, plan);
    assert_eq!(completed, [0]);
    let times = report.robots[0].times;
    // 8.1 m at 5 mm a tick.
    assert_eq!(times.ticks(Activity::Moving), 300 + 110 + 400 + 110 + 700);
    assert_eq!(times.ticks(Activity::Gripping), 0);
    // One for the schedule to come, one for it to come into force.
    assert!(times.ticks(Activity::Computing) <= 2);
    assert!(report.ticks <= 1_620 + 2, "{}", report.ticks);
}

#[test]
fn waits_say_who_goes_first() {
    let scene = parse(CORRIDOR);
    let (report, completed) = solve(&scene, corridor());
    assert_eq!(completed, [0, 1]);
    let waited = |robot: usize| report.robots[robot].times.ticks(Activity::Waiting);
    assert!(waited(1) > 500, "{}", waited(1));
}

/// Each driver of its own: a robot that is slow answers only some snapshots, one that is restarted
/// knows nothing but the snapshot.
fn run_by_hand(
    scene: &Scene,
    plan: Box<Schedule>,
    answers: impl Fn(usize, u64) -> bool,
    restarts: impl Fn(usize, u64) -> bool,
) -> Vec<u32> {
    let (counts, settings) = (scene.counts(), settings());
    let units = settings.units_per_tick(0);
    let mut world = World::new(scene, settings.clone(), 1);
    let mut planner = Planner::with_schedule(scene, settings.clone(), plan);
    let robot = |id, incarnation| Robot::new(scene, settings.clone(), id, incarnation);
    let mut robots: Vec<Robot> = (0..scene.homes.len())
        .map(|id| robot(id, FIRST_INCARNATION))
        .collect();
    let mut commands = vec![Command::default(); robots.len()];
    for (id, command) in commands.iter_mut().enumerate() {
        (command.robot, command.incarnation) = (id as u32, FIRST_INCARNATION);
    }
    let table = ConstraintTable::none();
    let mut published: Option<Box<Schedule>> = None;
    let mut snapshot: Box<WorldSnapshot> = zeroed();
    let mut motion: Box<MotionBatch> = zeroed();
    let mut tracer = Tracer::new(scene);
    while world.outcome() == Outcome::Running {
        world.snapshot_into(&mut snapshot);
        let tick = snapshot.header.tick;
        let mut control = Vec::new();
        for (id, command) in commands.iter_mut().enumerate() {
            if restarts(id, tick) {
                *command = Command {
                    robot: id as u32,
                    incarnation: command.incarnation + 1,
                    ..Command::default()
                };
                robots[id] = robot(id, command.incarnation);
                control.push(ControlRequest {
                    id: tick,
                    kind: ControlKind::Up.code(),
                    role: RoleKind::Robot.code(),
                    index: id as u32,
                    incarnation: command.incarnation,
                    ..ControlRequest::default()
                });
            } else if answers(id, tick) {
                let in_force = snapshot.header.schedule_version;
                let schedule = published.as_deref().filter(|s| s.version == in_force);
                let input = RobotInput {
                    snapshot: Checked::new(&*snapshot, counts).unwrap(),
                    table: Checked::new(&*table, counts).unwrap(),
                    schedule: schedule.map(|schedule| Checked::new(schedule, counts).unwrap()),
                    answer: None,
                };
                let asked = robots[id].step(scene, input, units, command);
                assert_eq!(asked, None);
            }
        }
        let input = PlannerInput {
            snapshot: Checked::new(&*snapshot, counts).unwrap(),
            requests: &[],
        };
        let output = planner.step(scene, input, units);
        if let Some(schedule) = output.schedule {
            published.get_or_insert_with(zeroed).copy_from(schedule);
        }
        let report: PlannerReport = output.report;
        let commands: Vec<_> = commands
            .iter()
            .map(|command| Some(Checked::new(command, counts).unwrap()))
            .collect();
        let schedule = published.as_deref();
        let input = WorldInput {
            commands: &commands,
            planner: Some(Checked::new(&report, counts).unwrap()),
            table: None,
            schedule: schedule.map(|s| (s.version, Checked::new(s, counts).ok())),
            control: &control,
            change: None,
        };
        world.step(scene, input, &mut motion);
        world.snapshot_into(&mut snapshot);
        tracer.tick(&snapshot, &motion);
    }
    assert_eq!(
        world.outcome(),
        Outcome::Solved,
        "{:?}",
        world.reason(scene)
    );
    assert_eq!(world.counters().invalid_requests, 0);
    tracer.check(world.outcome(), snapshot.header.time_ns)
}

#[test]
fn who_is_slow_changes_when_things_happen_and_not_in_which_order() {
    let scene = parse(CORRIDOR);
    let never = |_: usize, _: u64| false;
    for slow in 0..2 {
        for pause in [7, 50, 331] {
            // A command counts for a few ticks; then the robot is held until it answers again.
            let answers = |robot, tick: u64| robot != slow || tick.is_multiple_of(pause);
            let completed = run_by_hand(&scene, corridor(), answers, never);
            assert_eq!(completed, [0, 1], "robot {slow}, every {pause} ticks");
        }
    }
    // Asleep for long, once.
    let answers = |robot, tick: u64| robot != 0 || !(400..4_000).contains(&tick);
    assert_eq!(run_by_hand(&scene, corridor(), answers, never), [0, 1]);
}

#[test]
fn a_robot_that_is_restarted_goes_on_where_it_was() {
    let scene = parse(CORRIDOR);
    for every in [13, 61, 333] {
        let restarts = |robot, tick: u64| {
            let turn = (tick / every) as usize % 2;
            tick > 0 && tick.is_multiple_of(every) && turn == robot
        };
        let completed = run_by_hand(&scene, corridor(), |_, _| true, restarts);
        assert_eq!(completed, [0, 1], "every {every} ticks");
    }
}

#[test]
fn an_object_changes_hands_at_an_intermediate_place() {
    let scene = room(
        "[[robots]]\nhome = [0.5, 0.5]\n[[robots]]\nhome = [5.5, 0.5]\n\
         [[objects]]\nstart = [1.0, 2.0]\ngoal = [5.0, 2.0]\n",
    );
    let bring = vec![
        go(0.5, 1.55),
        go(1.0, 1.55).grasp(0, 0),
        go(3.0, 1.55).release(0),
        go(3.0, 1.0),
        go(0.5, 1.0),
        go(0.5, 0.5),
    ];
    let fetch = vec![
        go(4.0, 0.5),
        // Leaves at once, and waits beside the place until it is free.
        go(4.0, 1.55),
        go(3.0, 1.55).grasp(0, 1).after(0, 4),
        go(5.0, 1.55).release(0),
        go(5.0, 0.5),
        go(5.5, 0.5),
    ];
    let (report, completed) = solve(&scene, schedule(&[bring, fetch]));
    assert_eq!(completed, [0]);
    for robot in &report.robots {
        assert_eq!(robot.times.ticks(Activity::Gripping), 0, "motion follows");
    }
}

#[test]
fn an_object_at_its_goal_is_moved_aside_and_back() {
    // Object 1 stands where it belongs, in the corridor.
    let text = CORRIDOR
        .replace("start = [6.0, 0.5]", "start = [4.0, 1.5]")
        .replace("goal = [2.0, 0.5]", "goal = [4.0, 1.5]");
    let scene = parse(&text).with_robots(1).unwrap();
    let plan = schedule(&[vec![
        go(4.0, 1.5).grasp(1, 0),
        go(6.0, 1.5),
        go(6.0, 0.5).release(1),
        go(6.0, 1.5),
        go(2.0, 1.5),
        go(2.0, 2.5).grasp(0, 0),
        go(2.0, 1.5),
        go(6.0, 1.5),
        go(6.0, 2.5).release(0),
        go(6.0, 0.5).grasp(1, 1),
        go(6.0, 1.5),
        go(4.0, 1.5).release(1),
        go(1.0, 1.5),
    ]]);
    let (_, completed) = solve(&scene, plan);
    assert_eq!(completed, [0, 1]);
}

#[test]
fn an_object_without_a_goal_is_moved_out_of_the_way() {
    let text = CORRIDOR
        .replace("start = [6.0, 0.5]", "start = [4.0, 1.5]")
        .replace("goal = [2.0, 0.5]", "");
    let scene = parse(&text).with_robots(1).unwrap();
    let plan = schedule(&[vec![
        go(4.0, 1.5).grasp(1, 0),
        go(6.0, 1.5),
        go(6.0, 0.5).release(1),
        go(6.0, 1.5),
        go(2.0, 1.5),
        go(2.0, 2.5).grasp(0, 0),
        go(2.0, 1.5),
        go(6.0, 1.5),
        go(6.0, 2.5).release(0),
        go(6.0, 1.5),
        go(1.0, 1.5),
    ]]);
    solve(&scene, plan);
}

#[test]
fn actions_that_go_nowhere_are_actions() {
    let scene = room(
        "[[robots]]\nhome = [2.0, 1.05]\n[[objects]]\nstart = [2.0, 1.5]\ngoal = [4.0, 1.5]\n",
    );
    // Grasps where it stands, puts down and takes up again, and stands still on the way.
    let plan = schedule(&[vec![
        go(2.0, 1.05).grasp(0, 0),
        go(2.0, 1.05).release(0),
        go(2.0, 1.05).grasp(0, 1),
        go(3.0, 1.05),
        go(3.0, 1.05),
        go(4.0, 1.05).release(0),
        go(4.0, 0.5),
        go(2.0, 0.5),
        go(2.0, 1.05),
    ]]);
    let (report, _) = solve(&scene, plan);
    // No motion comes after the first two grips.
    assert_eq!(report.robots[0].times.ticks(Activity::Gripping), 2);
}

#[test]
fn without_a_plan_a_run_is_stuck_and_says_so() {
    // A wall from side to side between the object and its goal.
    let scene = parse(
        r#"
        name = "divided"
        [robot]
        shape = { box = [0.5, 0.5] }
        speed = 0.5
        [object]
        shape = { box = [0.5, 0.5] }
        grasp = [0.0, -0.5]
        [workspace]
        bounds = [0.0, 0.0, 4.0, 2.0]
        walls = [{ box = [2.0, 0.0, 2.5, 2.0] }]
        [[robots]]
        home = [0.5, 0.5]
        [[objects]]
        start = [1.0, 1.5]
        goal = [3.0, 1.5]
        "#,
    );
    let report = Simulation::new(&scene, &settings(), 1)
        .run(&mut |_: &_, _: &_| std::ops::ControlFlow::Continue(()));
    assert_eq!(report.outcome, Outcome::Stuck);
    let reason = report.reason.unwrap();
    assert!(reason.starts_with("no plan exists"), "{reason}");
    for robot in &report.robots {
        assert_eq!(robot.times.ticks(Activity::Moving), 0);
        assert_eq!(robot.times.ticks(Activity::Computing), report.ticks);
    }
}

#[test]
fn a_schedule_with_a_gap_or_an_id_out_of_range_is_refused_whole() {
    let scene = parse(CORRIDOR);
    type Plant = fn(&mut Schedule);
    let plants: [Plant; 3] = [
        |s| s.robots[1].first = 1,
        |s| s.actions[1].object = 2,
        |s| s.waits[0].robot = 2,
    ];
    for plant in plants {
        let mut plan = corridor();
        plant(&mut plan);
        let (report, completed) = run(&scene, plan);
        assert_eq!(report.outcome, Outcome::Stuck);
        assert_eq!(report.world.schedules_refused, 1, "counted once");
        assert!(completed.is_empty());
        assert_eq!(report.robots[0].times.ticks(Activity::Moving), 0);
    }
}

#[test]
fn a_plan_through_a_wall_is_refused_where_it_gets_there_and_counted() {
    let scene = parse(CORRIDOR);
    let mut plan = corridor();
    plan.actions[2].to.y = 2.0;
    plan.actions[3].to.y = 2.0;
    let (report, _) = run(&scene, plan);
    // Robot 1 waits for robot 0, for ever.
    assert_eq!(report.outcome, Outcome::Timeout);
    assert!(
        report.world.invalid_requests > 1,
        "asked again now and then"
    );
    let second = 1_000_000_000;
    assert!(report.world.invalid_requests <= report.time_ns / second + 1);
}

#[test]
fn a_plan_that_ends_short_of_the_end_leads_to_stuck() {
    let scene = parse(CORRIDOR);
    let mut plan = corridor();
    for part in &mut plan.robots[..2] {
        (part.count, part.complete) = (2, 0);
    }
    let (report, _) = run(&scene, plan);
    assert_eq!(report.outcome, Outcome::Stuck);
    assert!(report.reason.unwrap().contains("2 objects are held"));
}
