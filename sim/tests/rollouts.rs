//! What the default method owes to runs of the paper's methods that it carries out beforehand.

#![expect(clippy::unwrap_used, reason = "tests")]

use planner::Planner;
use scene::{GenerateOptions, Method, Scene, Settings};
use shm_types::Outcome;
use sim::{Simulation, rollout};

/// Rooms, by seed, area, objects, robots, walls and crowding, in which first plans are poor, and
/// others.
const ROOMS: [(u64, f64, usize, usize, usize, f64); 6] = [
    (1, 12.0, 3, 2, 2, 0.8),
    (2, 20.0, 4, 3, 3, 0.5),
    (3, 32.0, 4, 2, 4, 0.2),
    (1172, 13.6, 4, 4, 2, 0.8),
    (1975, 35.0, 7, 4, 4, 0.5),
    (2215, 35.0, 7, 4, 4, 0.5),
];

fn rooms() -> impl Iterator<Item = (u64, Scene)> {
    ROOMS.into_iter().map(|room| {
        let (seed, area_m2, objects, robots, walls, crowding) = room;
        let options = GenerateOptions {
            seed,
            area_m2,
            objects,
            robots,
            walls,
            crowding,
            extra_moves: 2,
        };
        (seed, scene::generate(&options).unwrap().scene)
    })
}

/// How long a run takes, s; none if it does not end solved.
fn run(mut simulation: Simulation<'_>) -> Option<f64> {
    let report = simulation.run(&mut |_: &_, _: &_| std::ops::ControlFlow::Continue(()));
    (report.outcome == Outcome::Solved).then_some(report.time_ns as f64 * 1e-9)
}

#[test]
fn no_run_takes_a_twentieth_longer_than_one_of_the_papers() {
    let (mut compared, mut longer_without) = (0, 0);
    for (seed, scene) in rooms() {
        let of = |method| Simulation::new(&scene, &settings(method), 0);
        let papers = Method::PAPERS
            .into_iter()
            .filter_map(|method| run(of(method)));
        let Some(best_s) = papers.min_by(f64::total_cmp) else {
            continue;
        };
        let taken_s = run(of(Method::Anytime)).unwrap();
        assert!(taken_s <= 1.05 * best_s, "{seed}: {taken_s} and {best_s} s");
        let planner = Planner::new(&scene, settings(Method::Anytime));
        let without_s = run(of(Method::Anytime).with_planner(planner)).unwrap();
        compared += 1;
        longer_without += usize::from(without_s > 1.05 * best_s);
    }
    assert!(compared >= ROOMS.len() / 2, "{compared} rooms");
    assert!(longer_without > 0, "it would be so without");
}

#[test]
fn a_rollout_is_the_run_and_says_who_grasped_what() {
    let mut solved = 0;
    for (seed, scene) in rooms() {
        for method in Method::PAPERS {
            let settings = settings(method);
            let mut rollout = rollout(&scene, &settings);
            let mut units = 0;
            let outcome = loop {
                let outcome = rollout.tick();
                assert!(rollout.work().units > units, "every tick costs something");
                units = rollout.work().units;
                if outcome != Outcome::Running {
                    break outcome;
                }
            };
            let taken_s = run(Simulation::new(&scene, &settings, 0));
            assert_eq!(taken_s.is_some(), outcome == Outcome::Solved);
            if let Some(taken_s) = taken_s {
                solved += 1;
                assert_eq!(taken_s, rollout.time_ns() as f64 * 1e-9);
                let made = rollout.transfers().iter().map(|made| made.object as usize);
                let mut objects: Vec<usize> = made.collect();
                objects.sort_unstable();
                let has_to_move = |&object: &usize| {
                    let spec = &scene.objects[object];
                    spec.goal.is_some_and(|goal| goal != spec.start)
                };
                let movable = (0..scene.objects.len()).filter(has_to_move);
                assert!(objects.into_iter().eq(movable), "{seed}, {method:?}");
            }
        }
    }
    assert!(solved > 0);
}

fn settings(method: Method) -> Settings {
    Settings {
        method,
        ..Settings::default()
    }
}
