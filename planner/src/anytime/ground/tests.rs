//! Masks, and what a step passes.

use std::collections::BTreeSet;

use proptest::prelude::*;

use super::*;
use crate::anytime::route::sides;
use crate::anytime::solver::testing::cells;

proptest! {
    /// By what each of these sets is said to be.
    #[test]
    fn a_mask_says_what_a_step_enters_leaves_and_sweeps(
        offsets in proptest::collection::btree_set((-3..=3, -3..=3), 1..12),
    ) {
        let mask = Mask::of(offsets.iter().copied().collect());
        let everywhere = || (-9..=9).flat_map(|y| (-9..=9).map(move |x| (x, y)));
        let set = |offsets: &[Offset]| offsets.iter().copied().collect::<BTreeSet<_>>();
        let those = |is_in: &dyn Fn(Offset) -> bool| -> BTreeSet<_> {
            everywhere().filter(|&offset| is_in(offset)).collect()
        };
        prop_assert_eq!(&those(&|offset| mask.has(offset)), &offsets);
        for (direction, (sx, sy)) in DIRECTIONS.into_iter().enumerate() {
            let from_start = |(x, y): Offset| offsets.contains(&(x, y));
            let from_end = |(x, y): Offset| offsets.contains(&(x - sx, y - sy));
            // Seen from the end of the step, all is a step nearer.
            let entered = those(&|(x, y)| offsets.contains(&(x, y)) && !from_start((x + sx, y + sy)));
            prop_assert_eq!(set(&mask.entered[direction]), entered);
            let left = those(&|at| from_start(at) && !from_end(at));
            prop_assert_eq!(set(&mask.left[direction]), left);
            let beside = |(x, y): Offset| {
                offsets.contains(&(x - sx, y)) || offsets.contains(&(x, y - sy))
            };
            let swept = those(&|at| beside(at) && !from_start(at) && !from_end(at));
            let expected = if sx != 0 && sy != 0 { swept } else { BTreeSet::new() };
            prop_assert_eq!(set(&mask.swept[direction]), expected);
        }
    }
}

#[test]
fn beside_a_diagonal_step_are_the_ends_of_the_two_straight_ones_it_is_made_of() {
    let ground = Ground::new(
        &cells(&[".....", "..A..", "....."]),
        &Settings::default(),
        Vec::new(),
    );
    let middle = 7;
    for (direction, (dx, dy)) in DIRECTIONS.into_iter().enumerate() {
        let end = |by| ground.moved(ground.xy(middle), by).unwrap();
        let expected = (dx != 0 && dy != 0).then(|| [end((dx, 0)), end((0, dy))]);
        assert_eq!(sides(&ground, middle, direction), expected);
    }
}

#[test]
fn distances_that_nobody_asks_for_any_more_are_forgotten_and_those_in_use_are_not() {
    let scene = scene::generate(&scene::GenerateOptions::default())
        .unwrap()
        .scene;
    let mut ground = Ground::new(&scene, &Settings::default(), Vec::new());
    let most = MOST_DISTANCES_KEPT / ground.points();
    let held = ground.field(0, 0);
    for to in 1..2 * most as u32 {
        ground.field(0, to);
        assert!(ground.fields.len() <= most + 1);
    }
    assert!(Rc::ptr_eq(&held, &ground.field(0, 0)));
}
