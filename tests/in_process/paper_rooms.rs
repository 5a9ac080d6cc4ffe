//! The six rooms of the paper's sizes: what their comments say of them holds (rule 7).

use std::io::Cursor;
use std::ops::ControlFlow;

use planner::{Kind, Places, easy};
use scene::{Method, Scene, Settings};
use shm_types::{Checked, ConstraintKind, EventKind, MotionBatch, Outcome, WorldSnapshot};
use sim::Simulation;
use trace::{CheckReport, Ending, SceneRecord, Writer};

/// Name, free floor in m², easy constraints at the start and the hard one, as (before, after).
type Room = (
    &'static str,
    f64,
    &'static [(Kind, usize, usize)],
    (ConstraintKind, u32, u32),
);

use ConstraintKind::{H1, H2};
use Kind::{E1, E2, E3, E4};

const ROOMS: [Room; 6] = [
    (
        "paper-17a",
        17.0,
        &[(E2, 3, 2), (E3, 1, 0), (E3, 3, 2), (E4, 3, 1)],
        (H1, 4, 3),
    ),
    (
        "paper-17b",
        17.0,
        &[(E2, 3, 2), (E3, 3, 2), (E3, 4, 0)],
        (H1, 2, 4),
    ),
    ("paper-41a", 41.5, &[(E2, 2, 3)], (H1, 3, 0)),
    (
        "paper-41b",
        41.5,
        &[
            (E2, 3, 1),
            (E2, 2, 4),
            (E2, 3, 4),
            (E3, 2, 4),
            (E3, 3, 1),
            (E4, 1, 4),
        ],
        (H1, 0, 2),
    ),
    ("paper-68a", 68.8, &[(E3, 1, 0), (E4, 4, 2)], (H1, 3, 4)),
    (
        "paper-68b",
        68.8,
        &[(E1, 2, 0), (E2, 2, 4), (E3, 1, 0), (E3, 2, 4)],
        (H2, 2, 1),
    ),
];

/// The world's state is not wanted in these traces, only motion and events.
const NEVER: u64 = u64::MAX;
/// Robots in the paper's simulation.
const ROBOTS: std::ops::RangeInclusive<usize> = 1..=4;

fn scene(name: &str) -> Scene {
    let text = scene::builtin(name).unwrap().text;
    scene::parse(text, name).unwrap_or_else(|e| panic!("{e:?}"))
}

/// A finished run.
struct Run {
    outcome: Outcome,
    failures: u64,
    /// Hard constraints that came into force.
    hard: Vec<(u64, u32, u32)>,
    check: CheckReport,
}

fn run(scene: &Scene, method: Method) -> Run {
    let settings = Settings {
        method,
        ..Settings::default()
    };
    let record = SceneRecord::new(scene, &settings, 0);
    let mut writer = Writer::new(Cursor::new(Vec::new()), &record, NEVER).unwrap();
    let mut hard = Vec::new();
    let mut watch = |snapshot: &WorldSnapshot, motion: &MotionBatch| {
        let snapshot = Checked::new(snapshot, scene.counts()).unwrap();
        writer.snapshot(snapshot).unwrap();
        writer.batch(motion).unwrap();
        for event in motion.events() {
            if event.kind == EventKind::Constraint.code() {
                hard.push((event.value, event.task, event.other));
            }
        }
        ControlFlow::Continue(())
    };
    let report = Simulation::new(scene, &settings, 0).run(&mut watch);
    let ending = Ending {
        outcome: report.outcome.into(),
        reason: report.reason,
        makespan_ns: report.time_ns,
        options: serde_json::Value::Null,
    };
    let trace = writer.finish(ending).unwrap().into_inner();
    Run {
        outcome: report.outcome,
        failures: report.world.task_failures,
        hard,
        check: trace::check(&*trace).unwrap(),
    }
}

#[test]
fn their_sizes_are_those_of_the_paper() {
    for (name, area_m2, _, _) in ROOMS {
        let scene = scene(name);
        let (low, high) = scene.bounds;
        let inside = |at: scene::Vec2| at > low && at < high;
        let walls: f64 = scene
            .walls
            .iter()
            .filter(|(_, at)| inside(*at))
            .map(|(shape, _)| {
                let full = 2.0 * shape.half_box().unwrap();
                full.x * full.y
            })
            .sum();
        let size = high - low;
        assert!((size.x * size.y - walls - area_m2).abs() < 1e-9, "{name}");
        assert_eq!((scene.objects.len(), scene.homes.len()), (5, 4), "{name}");
    }
}

#[test]
fn their_easy_constraints_are_those_of_their_comments() {
    for (name, _, expected, _) in ROOMS {
        let scene = scene(name);
        let places = |task: usize| {
            let object = &scene.objects[task];
            Places {
                initial: object.start,
                goal: object.goal.unwrap(),
            }
        };
        let mut found = Vec::new();
        for kind in Kind::EASY {
            for one in 0..5 {
                for two in (0..5).filter(|two| *two != one) {
                    if easy::holds(&scene, kind, (one, places(one)), (two, places(two))) {
                        let (before, after) = kind.edge(one, two);
                        found.push((kind, before, after));
                    }
                }
            }
        }
        let mut expected = expected.to_vec();
        expected.sort_unstable();
        found.sort_unstable();
        assert_eq!(found, expected, "{name}");
    }
}

#[test]
fn the_papers_method_finishes_them_by_the_hard_constraint_it_finds() {
    for (name, _, _, (kind, before, after)) in ROOMS {
        for robots in ROBOTS {
            let scene = scene(name).with_robots(robots).unwrap();
            let run = run(&scene, Method::GraspingAndRestricted);
            assert_eq!(run.outcome, Outcome::Solved, "{name} × {robots}");
            assert_eq!(run.check.violations, [], "{name} × {robots}");
            assert!(run.check.complete && run.check.swept_tests > 0);
            let found = (u64::from(kind.code()), before, after);
            assert!(
                run.hard.contains(&found),
                "{name} × {robots}: {:?}",
                run.hard
            );
        }
    }
}

#[test]
fn without_constraints_tasks_fail_in_them() {
    for (name, _, _, _) in ROOMS {
        for robots in ROBOTS {
            let scene = scene(name).with_robots(robots).unwrap();
            let run = run(&scene, Method::NoAction);
            assert!(run.failures > 0, "{name} × {robots}");
            assert_eq!(run.check.violations, [], "{name} × {robots}");
        }
    }
}
