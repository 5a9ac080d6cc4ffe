//! Whole runs in one thread: every small scenario and random rooms, every number of robots, every
//! method. Each run is traced and checked by a checker that shares no planning code (rule 26).

use std::ops::ControlFlow;

use scene::builtin::BUILTIN;
use scene::{Compute, Connectivity, GenerateOptions, Method, Scene, Settings, ShapeDraft};
use shm_types::{Activity, Checked, EventKind, MotionBatch, Outcome, WorldSnapshot};
use sim::{SimReport, Simulation};
use trace::{Ending, SceneRecord, Writer};

const NS_PER_S: u64 = 1_000_000_000;

fn parse(name: &str, text: &str) -> Scene {
    scene::parse(text, name).unwrap_or_else(|e| panic!("{e:?}"))
}

fn shipped(name: &str) -> Scene {
    parse(name, scene::builtin(name).unwrap().text)
}

fn with(method: Method) -> Settings {
    Settings {
        method,
        ..Settings::default()
    }
}

/// Runs to the end; checks what must hold of every run.
fn run(scene: &Scene, settings: &Settings) -> SimReport {
    let who = format!(
        "{} × {} × {}",
        scene.name,
        scene.homes.len(),
        settings.method
    );
    let record = SceneRecord::new(scene, settings, 1);
    let mut writer = Writer::new(Vec::new(), &record, NS_PER_S).unwrap();
    let (mut tick, mut epoch) = (0, 0);
    let mut watch = |snapshot: &WorldSnapshot, motion: &MotionBatch| {
        let header = &snapshot.header;
        assert_eq!((header.tick, motion.tick), (tick + 1, tick + 1), "{who}");
        assert!(
            epoch == 0 || header.epoch == epoch || header.epoch == epoch + 1,
            "{who}"
        );
        (tick, epoch) = (header.tick, header.epoch);
        writer.batch(motion).unwrap();
        writer
            .snapshot(Checked::new(snapshot, scene.counts()).unwrap())
            .unwrap();
        ControlFlow::Continue(())
    };
    let report = Simulation::new(scene, settings, 1).run(&mut watch);
    let ending = Ending {
        outcome: report.outcome.into(),
        reason: report.reason.clone(),
        makespan_ns: report.time_ns,
        options: serde_json::Value::Null,
    };
    let checked = trace::check(writer.finish(ending).unwrap().as_slice()).unwrap();
    assert!(checked.complete, "{who}");
    assert_eq!(checked.violations, [], "{who}");
    check(&report, &who);
    report
}

fn check(report: &SimReport, who: &str) {
    assert_eq!(report.world.violations, 0, "{who}: {:?}", report.reason);
    assert_eq!(
        report.world.selection_conflicts, 0,
        "{who}: robots select differently"
    );
    assert_eq!(report.world.invalid_claims, 0, "{who}");
    assert_eq!(report.world.invalid_requests, 0, "{who}");
    assert_eq!(report.world.stale_commands, 0, "{who}");
    for robot in &report.robots {
        assert_eq!(robot.times.total(), report.ticks, "{who}");
    }
    match report.outcome {
        Outcome::Solved => assert_eq!(report.reason, None, "{who}"),
        Outcome::Stuck => assert!(report.reason.is_some(), "{who}"),
        other => panic!("{who}: {other:?} after {} s", report.time_ns / NS_PER_S),
    }
}

/// The scene with its first robot, its first two, and so on.
fn with_each_number_of_robots(scene: &Scene) -> impl Iterator<Item = Scene> {
    (1..=scene.homes.len()).map(|robots| scene.with_robots(robots).unwrap())
}

#[test]
fn every_small_run_ends_solved_or_stuck_for_a_reason() {
    let small = BUILTIN
        .iter()
        .filter(|scenario| !scenario.name.starts_with("paper-"));
    for scenario in small {
        for scene in with_each_number_of_robots(&parse(scenario.name, scenario.text)) {
            for method in Method::PAPERS {
                run(&scene, &with(method));
            }
        }
    }
}

#[test]
fn random_rooms_end_solved_or_stuck_for_a_reason() {
    let mut solved = 0;
    for seed in 0..10 {
        let options = GenerateOptions {
            seed,
            ..GenerateOptions::default()
        };
        let room = scene::generate(&options).unwrap().scene;
        for scene in with_each_number_of_robots(&room) {
            for method in Method::PAPERS {
                let report = run(&scene, &with(method));
                solved += u32::from(report.outcome == Outcome::Solved);
            }
        }
    }
    assert!(solved > 20, "{solved}");
}

/// Grips that take time, round robots that fit between the lattice's points, four directions, a
/// slow computer that all share: the same promises.
#[test]
fn random_rooms_with_everything_else_changed_keep_the_same_promises() {
    let mut solved = 0;
    for seed in 0..4 {
        let options = GenerateOptions {
            seed,
            ..GenerateOptions::default()
        };
        let mut draft = scene::generate(&options).unwrap().scene.draft().clone();
        draft.connectivity = Connectivity::Four;
        draft.robot.shape = ShapeDraft::Circle(0.2);
        (draft.robot.grasp_s, draft.robot.release_s) = (0.5, 0.255);
        let room = Scene::new(draft).unwrap();
        assert!(!room.lattice.exact);
        for method in Method::PAPERS {
            let settings = Settings {
                units_per_second: 200_000,
                compute: Compute::Shared,
                look_ahead_m: 0.3,
                ..with(method)
            };
            let report = run(&room, &settings);
            solved += u32::from(report.outcome == Outcome::Solved);
        }
    }
    assert!(solved > 0);
}

/// What each method can see, it finishes, and what it cannot see it gets stuck on, with one robot
/// and with two.
#[test]
fn methods_finish_what_they_can_see() {
    use Method::{All, GraspingAndRestricted, NoAction, Restricted};
    let every: &[Method] = &[GraspingAndRestricted, Restricted, All, NoAction];
    let easy: &[Method] = &[GraspingAndRestricted, All];
    let finished_by = [
        ("e1", every),
        ("e2", easy),
        ("e3", every),
        ("e4", easy),
        ("h1", every),
        ("h2", &[All]),
        ("blocked-approach", every),
        ("joint-blockers", every),
        ("head-on-corridor", every),
        ("lift-from-below", every),
        ("blocked-return", &[]),
        ("swap", &[]),
    ];
    for (name, methods) in finished_by {
        for scene in with_each_number_of_robots(&shipped(name)) {
            for method in Method::PAPERS {
                let outcome = run(&scene, &with(method)).outcome;
                let expected = methods.contains(&method);
                let robots = scene.homes.len();
                assert_eq!(
                    outcome == Outcome::Solved,
                    expected,
                    "{name} × {robots} × {method}"
                );
            }
        }
    }
}

/// The six rooms of the paper's sizes: its method finishes each with any number of robots, and
/// without constraints every one of them sees a task fail.
#[test]
fn the_papers_method_finishes_the_papers_rooms() {
    let rooms: Vec<_> = BUILTIN
        .iter()
        .filter(|scenario| scenario.name.starts_with("paper-"))
        .collect();
    assert_eq!(rooms.len(), 6);
    for room in rooms {
        for scene in with_each_number_of_robots(&parse(room.name, room.text)) {
            let who = format!("{} × {}", room.name, scene.homes.len());
            let papers = run(&scene, &with(Method::GraspingAndRestricted));
            assert_eq!(
                papers.outcome,
                Outcome::Solved,
                "{who}: {:?}",
                papers.reason
            );
            let none = run(&scene, &with(Method::NoAction));
            assert!(none.world.task_failures > 0, "{who}");
        }
    }
}

#[test]
fn a_swap_is_a_cycle_of_tasks_and_the_reason_says_so() {
    let report = run(&shipped("swap"), &with(Method::GraspingAndRestricted));
    assert_eq!(report.outcome, Outcome::Stuck);
    let reason = report.reason.unwrap();
    assert!(reason.contains("cycle: 0 → 1 → 0"), "{reason}");
}

#[test]
fn a_run_is_the_same_every_time_at_every_tick() {
    let scene = shipped("h1");
    for method in Method::PAPERS {
        let settings = with(method);
        let mut one = Simulation::new(&scene, &settings, 1);
        let mut other = Simulation::new(&scene, &settings, 1);
        while one.outcome() == Outcome::Running {
            let (a, b) = (one.tick().header.state_hash, other.tick().header.state_hash);
            assert_eq!(a, b, "{method}, tick {}", one.snapshot().header.tick);
        }
        assert_eq!(other.outcome(), one.outcome());
    }
}

#[test]
fn slow_computers_find_the_same_and_stand_still_for_it() {
    let scene = shipped("h1");
    for method in Method::PAPERS {
        let fast = run(&scene, &with(method));
        let slow = run(
            &scene,
            &Settings {
                units_per_second: 5_000,
                ..with(method)
            },
        );
        assert_eq!(slow.outcome, Outcome::Solved, "{method}");
        let computing = |report: &SimReport| -> u64 {
            report
                .robots
                .iter()
                .map(|robot| robot.times.ticks(Activity::Computing))
                .sum()
        };
        assert!(computing(&slow) > 100 * computing(&fast).max(1), "{method}");
        assert!(slow.time_ns > fast.time_ns, "{method}");
    }
}

#[test]
fn one_computer_for_all_is_slower_than_one_each() {
    let scene = shipped("h1");
    let own = Settings {
        units_per_second: 20_000,
        ..with(Method::All)
    };
    let shared = Settings {
        compute: Compute::Shared,
        ..own.clone()
    };
    assert!(run(&scene, &shared).time_ns > run(&scene, &own).time_ns);
}

/// One robot, one object, nothing in the way: it moves all the time but for the tick of each grip,
/// although it plans anew every 0.1 m.
#[test]
fn a_look_that_is_done_within_its_step_costs_no_motion() {
    let text = r#"
        name = "alone"
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
        [[objects]]
        start = [1.5, 0.95]
        goal = [3.0, 0.95]
    "#;
    let scene = parse("alone", text);
    let report = run(&scene, &with(Method::GraspingAndRestricted));
    assert_eq!(report.outcome, Outcome::Solved);
    let times = report.robots[0].times;
    // 1 m to the grasp, 1.5 m to the goal; home again round the object: at least 2.5 m.
    assert_eq!(times.ticks(Activity::Gripping), 2);
    assert_eq!(times.ticks(Activity::Waiting), 0);
    assert_eq!(times.ticks(Activity::Computing), 0);
    assert_eq!(times.ticks(Activity::Idle), 0);
    assert_eq!(times.ticks(Activity::Moving), 500 + 500);
    assert!(report.counters().path_plans > 50);
}

/// All that a robot needs to go on after a restart is in the snapshot.
#[test]
fn restarted_robots_take_up_where_they_were() {
    let scene = shipped("h1");
    for every in [7, 61, 333] {
        let settings = with(Method::GraspingAndRestricted);
        let mut simulation = Simulation::new(&scene, &settings, 1);
        while simulation.outcome() == Outcome::Running {
            let tick = simulation.tick().header.tick;
            if tick.is_multiple_of(every) && tick < 5_000 {
                simulation.restart_robot((tick / every) as usize % scene.homes.len());
            }
        }
        let report = simulation.report();
        assert_eq!(
            report.outcome,
            Outcome::Solved,
            "every {every} ticks: {:?}",
            report.reason
        );
        assert_eq!(report.world.selection_conflicts, 0);
    }
}

/// Rooms that the paper's methods cannot finish among them.
#[test]
fn planning_ahead_solves_every_shipped_room_that_can_be_solved() {
    for scenario in BUILTIN {
        let all = parse(scenario.name, scenario.text);
        if planner::certificate(&all).is_some() {
            continue;
        }
        for scene in with_each_number_of_robots(&all) {
            let report = run(&scene, &with(Method::Anytime));
            let who = format!("{} × {}", scene.name, scene.homes.len());
            assert_eq!(
                report.outcome,
                Outcome::Solved,
                "{who}: {:?}",
                report.reason
            );
        }
    }
}

#[test]
fn a_warehouse_of_a_hundred_pods_is_solved() {
    let [warehouse, _] = scene::warehouses();
    let scene = parse(warehouse.name, warehouse.text);
    let report = run(&scene, &with(Method::Anytime));
    assert_eq!(report.outcome, Outcome::Solved, "{:?}", report.reason);
}

/// Half of them need intermediate places.
#[test]
fn planning_ahead_solves_random_rooms() {
    for seed in 0..6 {
        let options = GenerateOptions {
            seed,
            crowding: 0.8,
            robots: 1 + seed as usize % 4,
            extra_moves: 2 * (seed as usize % 2),
            ..GenerateOptions::default()
        };
        let room = scene::generate(&options).unwrap().scene;
        let report = run(&room, &with(Method::Anytime));
        let why = report.reason;
        assert_eq!(report.outcome, Outcome::Solved, "{seed}: {why:?}");
    }
}

/// Planners so slow that much is left to improve when robots begin to move.
#[test]
fn planning_ahead_improves_the_plan_that_robots_follow() {
    let mut replaced = 0;
    for seed in 20..28 {
        let options = GenerateOptions {
            seed,
            objects: 8,
            area_m2: 30.0,
            ..GenerateOptions::default()
        };
        let room = scene::generate(&options).unwrap().scene;
        let settings = Settings {
            units_per_second: 2_000_000,
            ..with(Method::Anytime)
        };
        let (mut version, mut moved) = (0, false);
        let mut watch = |snapshot: &WorldSnapshot, motion: &MotionBatch| {
            replaced += u32::from(moved && snapshot.header.schedule_version > version);
            version = snapshot.header.schedule_version;
            moved |= motion.motion_count > 0;
            ControlFlow::Continue(())
        };
        let report = Simulation::new(&room, &settings, 1).run(&mut watch);
        let why = report.reason;
        assert_eq!(report.outcome, Outcome::Solved, "{seed}: {why:?}");
        assert_eq!(report.world.schedules_refused, 0, "{seed}");
    }
    assert!(replaced > 0, "no better plan came into force under way");
}

#[test]
fn planning_ahead_keeps_the_users_order() {
    let text = scene::builtin("paper-41a").unwrap().text;
    let count = parse("paper-41a", text).objects.len();
    for (first, then) in [(4, 0), (0, 4), (2, 1)] {
        assert!(first < count && then < count);
        let order = format!("\n[[before]]\nfirst = \"{first}.finish\"\nthen = \"{then}.grasp\"\n");
        let scene = parse("ordered", &format!("{text}{order}"));
        let (mut finished, mut grasped) = (u64::MAX, 0);
        let mut watch = |_: &WorldSnapshot, motion: &MotionBatch| {
            for event in motion.events() {
                let is =
                    |kind: EventKind, task: u32| event.kind == kind.code() && event.task == task;
                if is(EventKind::Completed, first as u32) {
                    finished = event.time_ns;
                }
                if is(EventKind::GraspStarted, then as u32) && grasped == 0 {
                    grasped = event.time_ns;
                }
            }
            ControlFlow::Continue(())
        };
        let report = Simulation::new(&scene, &with(Method::Anytime), 1).run(&mut watch);
        assert_eq!(report.outcome, Outcome::Solved);
        assert!(
            finished <= grasped,
            "{first} and {then}: {finished} and {grasped}"
        );
    }
}
