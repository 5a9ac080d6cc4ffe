//! What is said of a run when it is over.

use scene::{Method, Settings};
use shm_types::{Counters, Outcome};
use sim::Simulation;

#[test]
fn the_work_of_all_is_the_sum_of_what_each_has_done() {
    let options = scene::GenerateOptions {
        robots: 2,
        objects: 3,
        ..scene::GenerateOptions::default()
    };
    let scene = scene::generate(&options).unwrap().scene;
    let settings = Settings {
        method: Method::All,
        ..Settings::default()
    };
    let mut run = Simulation::new(&scene, &settings, 1);
    while run.outcome() == Outcome::Running {
        run.tick();
    }
    let report = run.report();
    let sum = |of: fn(&Counters) -> u64| -> u64 {
        let robots = report.robots.iter().map(|robot| of(&robot.counters));
        robots.sum::<u64>() + of(&report.planner)
    };
    let all = report.counters();
    for of in [
        |it: &Counters| it.polygon_tests,
        |it: &Counters| it.path_plans,
        |it: &Counters| it.cells_expanded,
        |it: &Counters| it.selections,
        |it: &Counters| it.easy_constraints,
        |it: &Counters| it.units,
    ] {
        assert_eq!(of(&all), sum(of));
    }
    assert!(all.selections > 2 && all.units > 0, "{all:?}");
}
