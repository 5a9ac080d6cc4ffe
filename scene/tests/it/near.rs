//! What is near what, against a look at everything.

use proptest::prelude::*;
use scene::near::{Aabb, Near};
use scene::{Draft, Scene, Vec2};

fn point() -> impl Strategy<Value = Vec2> {
    // Beyond the room too, and often on the border between two cells.
    prop_oneof![
        (-1.0..13.0f64, -1.0..7.0f64).prop_map(|(x, y)| Vec2::new(x, y)),
        (0..13i32, 0..7i32).prop_map(|(x, y)| Vec2::new(f64::from(x), f64::from(y))),
    ]
}

proptest! {
    #[test]
    fn nothing_in_a_region_is_missed(
        cell_m in prop_oneof![Just(1.0), Just(4.0), Just(12.0), Just(50.0), 0.01..20.0f64],
        places in prop::collection::vec(point(), 1..12),
        taken in prop::collection::vec(any::<bool>(), 12),
        corners in (point(), point()),
    ) {
        let mut draft = Draft::room("room", [0.0, 0.0, 12.0, 6.0]);
        draft.homes = vec![[1.0, 1.0]];
        let scene = Scene::new(draft).unwrap();
        let mut near = Near::new(&scene, places.len(), cell_m);
        for (thing, at) in places.iter().enumerate() {
            near.put(thing, *at);
        }
        for thing in (0..places.len()).filter(|thing| taken[*thing]) {
            near.take(thing);
        }
        let region = Aabb::around(corners.0, corners.1);
        let mut named = vec![0; places.len()];
        near.find(region, |thing, at| {
            assert_eq!(at, places[thing]);
            named[thing] += 1;
            false
        });
        for (thing, at) in places.iter().enumerate() {
            let is_within = region.meets(&Aabb::around(*at, *at));
            prop_assert_eq!(near.place(thing).is_some(), !taken[thing]);
            prop_assert!(named[thing] <= usize::from(!taken[thing]));
            prop_assert!(!is_within || taken[thing] || named[thing] == 1, "{} at {}", thing, at);
        }
    }
}
