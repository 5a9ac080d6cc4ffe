//! Distance fields against path search.

use std::task::Poll;

use planner::{DistanceField, PathSearch};
use proptest::prelude::*;
use scene::{Budget, Scene, Vec2};
use shm_types::Counters;

use crate::room::room;
use crate::search::run;

fn flood(field: &mut DistanceField, scene: &Scene, from: Vec2, units: u64) -> Counters {
    field.begin(scene, from);
    let mut counters = Counters::default();
    while field.advance(&mut Budget::new(units), &mut counters) == Poll::Pending {}
    counters
}

fn narrow() -> Scene {
    let walls = [
        [1.5, 0.0, 1.7, 2.4],
        [3.0, 1.0, 3.2, 3.4],
        [4.0, 0.0, 4.6, 1.0],
    ];
    room([0.0, 0.0, 5.0, 3.4], &walls, &[[0.4, 0.4], [4.4, 2.4]], &[])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn distances_are_lengths_of_paths(
        ends in [(0.25..4.75, 0.25..3.15), (0.25..4.75, 0.25..3.15)],
        units in 1_u64..500,
    ) {
        let scene = narrow();
        let [from, to] = ends.map(|(x, y)| Vec2::new(x, y));
        let mut search = PathSearch::new(&scene);
        let mut counters = Counters::default();
        let (length, _) = run(&mut search, &scene, from, to, u64::MAX, &mut counters);
        let mut field = DistanceField::new(&scene);
        let whole = flood(&mut field, &scene, from, u64::MAX);
        let distance = field.distance(&scene, to);
        prop_assert_eq!(length.is_some(), distance.is_some());
        if let (Some(length), Some(distance)) = (length, distance) {
            let tolerance = 3e-6 * length + 3e-3 * scene.lattice.pitch_m;
            prop_assert!((length - distance).abs() <= tolerance, "{length} {distance}");
        }
        let sliced = flood(&mut field, &scene, from, units);
        prop_assert_eq!(field.distance(&scene, to), distance);
        prop_assert_eq!(sliced, whole);
    }
}

#[test]
fn walls_part_a_room() {
    let scene = room(
        [0.0, 0.0, 5.0, 3.4],
        &[[2.4, 0.0, 2.6, 3.4]],
        &[[0.4, 0.4], [4.4, 2.4]],
        &[],
    );
    let mut field = DistanceField::new(&scene);
    flood(&mut field, &scene, scene.homes[0], u64::MAX);
    assert_eq!(field.distance(&scene, scene.homes[1]), None);
    let near = field.distance(&scene, scene.homes[0] + Vec2::new(0.3, 0.0));
    assert!((near.unwrap() - 0.3).abs() < 1e-9, "{near:?}");
}
