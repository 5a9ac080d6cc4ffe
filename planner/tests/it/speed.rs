//! What the unit of work is worth: the measurement behind `DEFAULT_UNITS_PER_SECOND` and
//! `UNITS_PER_POLYGON_TEST`. Run with
//! `cargo test --release -p planner -- --ignored --nocapture speed`.

use std::hint::black_box;

use planner::{DistanceField, EasyConstraints, Kind, PathSearch, Places, easy};
use scene::{Budget, Scene, Vec2};
use shm_types::Counters;

use crate::room::shipped;
use crate::search::run;

const ROUNDS: u32 = 200;

/// Time this thread has spent on a processor, ns: other load on the machine does not count.
fn busy_ns() -> u64 {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    stat.split_whitespace().next().unwrap().parse().unwrap()
}

fn report(what: &str, count: u64, since: u64) {
    let each_ns = (busy_ns() - since) as f64 / count as f64;
    println!(
        "{what}: {each_ns:.1} ns each, {:.1} million a second",
        1e3 / each_ns
    );
}

#[test]
#[ignore = "a measurement"]
fn speed() {
    let scene = shipped("paper-68a");
    println!(
        "{} lattice points of {} m",
        scene.lattice.len(),
        scene.lattice.pitch_m
    );
    let mut search = PathSearch::new(&scene);
    let mut counters = Counters::default();
    let since = busy_ns();
    for _ in 0..ROUNDS {
        for object in 0..scene.objects.len() {
            let from = scene.grasp_at(object, scene.objects[object].start);
            search
                .occupancy()
                .reset(&scene, scene.objects[object].class);
            let to = scene.grasp_at(object, scene.objects[object].goal.unwrap());
            black_box(run(&mut search, &scene, from, to, u64::MAX, &mut counters));
        }
    }
    report("A* cells expanded", counters.cells_expanded, since);
    report("A* plans", counters.path_plans, since);

    let mut field = DistanceField::new(&scene);
    let mut counters = Counters::default();
    let since = busy_ns();
    for _ in 0..ROUNDS {
        field.begin(&scene, scene.homes[0]);
        while field
            .advance(&mut Budget::new(1000), &mut counters)
            .is_pending()
        {}
    }
    report("flooded cells", counters.cells_expanded, since);

    polygon_tests(&scene);
    obstacles(&scene);
}

fn places(scene: &Scene) -> Vec<Places> {
    (scene.objects.iter())
        .map(|object| Places {
            initial: object.start,
            goal: object.goal.unwrap(),
        })
        .collect()
}

fn polygon_tests(scene: &Scene) {
    let places = places(scene);
    let mut easy = EasyConstraints::new(scene);
    let mut counters = Counters::default();
    let since = busy_ns();
    for round in 0..ROUNDS * 100 {
        // Each round moves every object, so that nothing is known from the last.
        let shift = Vec2::new(f64::from(round % 2) * 0.05, 0.0);
        easy.begin(places.iter().map(|p| {
            Some(Places {
                initial: p.initial + shift,
                ..*p
            })
        }));
        while easy
            .advance(scene, &mut Budget::new(u64::MAX), &mut counters)
            .is_pending()
        {}
    }
    report(
        "polygon tests, easy constraints of apart boxes",
        counters.polygon_tests,
        since,
    );

    let near = Places {
        initial: places[0].initial + Vec2::new(0.1, 0.3),
        ..places[0]
    };
    let since = busy_ns();
    let mut count = 0_u32;
    for _ in 0..ROUNDS * 5000 {
        let (one, two) = (black_box((0, places[0])), black_box((1, near)));
        count += u32::from(easy::holds(scene, Kind::E1, one, two));
    }
    report(
        "polygon tests, overlapping boxes",
        u64::from(black_box(ROUNDS * 5000)),
        since,
    );
    assert!(count > 0);
}

fn obstacles(scene: &Scene) {
    let mut search = PathSearch::new(scene);
    let class = scene.objects[0].class;
    let rounds = ROUNDS * 500;
    let since = busy_ns();
    for _ in 0..rounds {
        search.occupancy().reset(scene, class);
    }
    let resets_ns = busy_ns() - since;
    report("resets", u64::from(rounds), since);
    let since = busy_ns() + resets_ns;
    for _ in 0..rounds {
        search.occupancy().reset(scene, class);
        for object in &scene.objects {
            search
                .occupancy()
                .block(scene, &object.shape, object.start, true);
        }
    }
    report(
        "obstacles",
        u64::from(rounds) * scene.objects.len() as u64,
        since,
    );
}
