//! Runs that something happens to: a goal, an object, a corridor or a robot is not as it was. Each
//! is traced and checked by a checker that shares no code with what planned and moved.

use scene::{Change, Method, Scene, Settings};
use shm_types::{Checked, ControlKind, Outcome};
use sim::{SimReport, Simulation};
use trace::{Ending, SceneRecord, Writer};
use world::{Blocked, NotMade};

const ROOMS: &str = include_str!("../rooms/two-rooms.toml");

fn rooms() -> Scene {
    scene::parse(ROOMS, "two-rooms").unwrap()
}

fn settings(method: Method) -> Settings {
    Settings {
        method,
        time_limit_ns: 300_000_000_000,
        ..Settings::default()
    }
}

/// What happens.
enum What {
    Change(Vec<Change>),
    Lose(usize),
    Back(usize),
}

struct Finished {
    report: SimReport,
    scene: Scene,
    /// Where objects stand at the end, m.
    objects: Vec<[f64; 2]>,
    /// How many robots a viewer shows at the beginning, and at the end.
    shown: [usize; 2],
}

/// Tells a run of something; false while a robot is in the way of it.
fn tell(simulation: &mut Simulation<'_>, what: &What) -> bool {
    let tick = simulation.snapshot().header.tick;
    let told = match what {
        What::Change(changes) => match simulation.change(changes) {
            Ok(told) => told,
            Err(NotMade::Wall { by } | NotMade::Object { by, .. } | NotMade::Robot { by, .. }) => {
                assert!(matches!(by, Blocked::Robot(_) | Blocked::Grant(_)), "{by}");
                return false;
            }
            Err(NotMade::Gripped { .. }) => return false,
            Err(other) => panic!("{other}"),
        },
        What::Lose(robot) => simulation.take_part(ControlKind::Down, *robot).unwrap(),
        What::Back(robot) => simulation.take_part(ControlKind::Up, *robot).unwrap(),
    };
    assert_eq!(told, tick + 1);
    true
}

/// Runs a scene to its end, with what happens in between; the checker finds nothing wrong.
fn run(scene: &Scene, method: Method, events: &[(u64, What)]) -> Finished {
    let settings = settings(method);
    let mut simulation = Simulation::new(scene, &settings, 1);
    let record = |scene: &Scene| SceneRecord::new(scene, &settings, 1);
    let mut writer = Writer::new(Vec::new(), &record(scene), 100_000_000).unwrap();
    let mut version = 0;
    let mut open: Vec<&(u64, What)> = events.iter().collect();
    while simulation.outcome() == Outcome::Running {
        let tick = simulation.snapshot().header.tick;
        open.retain(|(at, what)| *at > tick || !tell(&mut simulation, what));
        simulation.tick();
        let now = simulation.snapshot().header.scene_version;
        if now != version {
            version = now;
            writer.change(&record(simulation.scene())).unwrap();
        }
        writer.batch(simulation.motion()).unwrap();
        let snapshot = Checked::new(simulation.snapshot(), simulation.scene().counts()).unwrap();
        writer.snapshot(snapshot).unwrap();
    }
    let report = simulation.report();
    let ending = Ending {
        outcome: report.outcome.into(),
        reason: None,
        makespan_ns: report.time_ns,
        options: serde_json::Value::Null,
    };
    let trace = writer.finish(ending).unwrap();
    let checked = trace::check(trace.as_slice()).unwrap();
    assert!(checked.complete);
    assert_eq!(checked.violations, []);
    let changes = events
        .iter()
        .filter(|(_, what)| matches!(what, What::Change(_)));
    assert_eq!(report.scene_version as usize, changes.count());
    // What a viewer makes of it.
    let story = trace::Story::read(trace::Reader::new(trace.as_slice()).unwrap()).unwrap();
    assert!(trace::page(&story, 0.0).contains("versions"));
    let shown = [0.0, story.until_s()].map(|time_s| trace::standing(&story, time_s).len());
    let scene = simulation.scene().clone();
    let states = &simulation.snapshot().objects[..scene.objects.len()];
    let objects = states
        .iter()
        .map(|o| [o.position.x, o.position.y])
        .collect();
    Finished {
        report,
        scene,
        objects,
        shown,
    }
}

fn solve(scene: &Scene, method: Method, events: &[(u64, What)]) -> Finished {
    let finished = run(scene, method, events);
    let report = &finished.report;
    assert_eq!(report.outcome, Outcome::Solved, "{:?}", report.reason);
    for (spec, at) in finished.scene.objects.iter().zip(&finished.objects) {
        if let Some(goal) = spec.goal {
            assert!((goal.x - at[0]).hypot(goal.y - at[1]) < 1e-6, "{at:?}");
        }
    }
    finished
}

/// Ticks at which something is on its way in the rooms above.
const TICKS: [u64; 6] = [0, 150, 400, 700, 1_000, 1_400];

#[test]
fn a_goal_may_change_while_robots_move() {
    let goal = |object, to| Change::Goal { object, to };
    for tick in TICKS {
        let changes = vec![goal(0, Some([2.0, 3.4])), goal(1, None)];
        solve(&rooms(), Method::Anytime, &[(tick, What::Change(changes))]);
    }
    // Two objects change their goals: neither could by itself.
    let changes = vec![goal(0, Some([1.0, 3.0])), goal(1, Some([5.0, 1.5]))];
    solve(&rooms(), Method::Anytime, &[(500, What::Change(changes))]);
}

#[test]
fn a_corridor_found_closed_is_gone_around() {
    for tick in TICKS {
        let wall = Change::Close {
            corners: [3.0, 2.4, 3.2, 3.6],
        };
        solve(
            &rooms(),
            Method::Anytime,
            &[(tick, What::Change(vec![wall]))],
        );
    }
}

#[test]
fn objects_come_and_are_moved_by_somebody_else() {
    for tick in TICKS {
        let add = Change::AddObject {
            at: [2.0, 3.0],
            goal: Some([5.6, 2.2]),
            like: 0,
        };
        solve(
            &rooms(),
            Method::Anytime,
            &[(tick, What::Change(vec![add]))],
        );
    }
    let moved = Change::Move {
        object: 1,
        to: [5.6, 2.2],
    };
    solve(
        &rooms(),
        Method::Anytime,
        &[(50, What::Change(vec![moved]))],
    );
}

#[test]
fn a_robot_that_is_lost_is_gone_around_and_may_come_back() {
    for tick in TICKS {
        // It comes back later: all is done in the end, by both.
        let events = [(tick, What::Lose(0)), (tick + 900, What::Back(0))];
        solve(&rooms(), Method::Anytime, &events);
    }
    // Before it has left home, the other one does all.
    let finished = solve(&rooms(), Method::Anytime, &[(0, What::Lose(0))]);
    let moved = |robot: usize| {
        finished.report.robots[robot]
            .times
            .ticks(shm_types::Activity::Moving)
    };
    assert_eq!(moved(0), 0);
    assert!(moved(1) > 0);
}

fn add_robot(at: [f64; 2]) -> What {
    What::Change(vec![Change::AddRobot { at }])
}

#[test]
fn a_robot_that_is_added_works_with_the_others() {
    for method in [Method::Anytime, Method::GraspingAndRestricted, Method::All] {
        for tick in TICKS {
            let finished = solve(&rooms(), method, &[(tick, add_robot([2.0, 0.4]))]);
            let report = &finished.report;
            assert_eq!(report.robots.len(), 3);
            assert_eq!(finished.shown, [if tick > 0 { 2 } else { 3 }, 3]);
            for robot in &report.robots {
                assert_eq!(robot.times.total(), report.ticks);
            }
        }
    }
}

#[test]
fn a_robot_that_is_added_does_what_those_that_are_lost_would_have() {
    for method in [Method::Anytime, Method::GraspingAndRestricted] {
        let events = [
            (0, What::Lose(0)),
            (0, What::Lose(1)),
            (200, add_robot([2.0, 0.4])),
        ];
        let finished = solve(&rooms(), method, &events);
        let moved = finished.report.robots.iter().map(|robot| {
            let ticks = robot.times.ticks(shm_types::Activity::Moving);
            ticks > 0
        });
        assert_eq!(moved.collect::<Vec<_>>(), [false, false, true]);
    }
    // In one that was about to end: it stays at home.
    let late = [(0, add_robot([2.0, 0.4])), (300, add_robot([4.2, 0.4]))];
    let finished = solve(&rooms(), Method::Anytime, &late);
    assert_eq!(finished.report.robots.len(), 4);
}

#[test]
fn robots_that_select_their_tasks_follow_changes_too() {
    for tick in TICKS {
        let changes = vec![
            Change::Goal {
                object: 0,
                to: Some([2.0, 3.4]),
            },
            Change::Close {
                corners: [3.0, 2.4, 3.2, 3.6],
            },
        ];
        let events = [(tick, What::Change(changes))];
        solve(&rooms(), Method::GraspingAndRestricted, &events);
    }
}
