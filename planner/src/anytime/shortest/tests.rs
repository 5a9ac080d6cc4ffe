//! Shortest plans of rooms small enough to count in.

use scene::Settings;

use super::*;
use crate::anytime::situation::Situation;
use crate::anytime::solver::testing::cells;

/// The number of steps of a shortest plan with fewer than `most`; none if there is none.
fn least(rows: &[&'static str], most: u32) -> Option<usize> {
    let scene = cells(rows);
    let ground = Ground::new(&scene, &Settings::default(), Vec::new());
    let start = Start::new(&scene, &ground, &Situation::at_start(&scene)).unwrap();
    let goals: Vec<_> = (scene.objects.iter().enumerate())
        .map(|(object, spec)| Some(Place::of(&scene, &ground, object, spec.goal?)))
        .collect();
    let homes: Vec<u32> = start.robots.iter().map(|track| track.start).collect();
    let known = most * duration(0);
    let mut shortest = Shortest::new(&scene, &ground, &start, &homes, &goals, known).unwrap();
    loop {
        match shortest.advance(&ground, 100) {
            Least::Open => {}
            Least::Plan(steps) => return Some(steps.len()),
            Least::NoneShorter => return None,
            Least::TooMany => panic!("there are few configurations"),
        }
    }
}

#[test]
fn as_many_steps_are_taken_as_have_to_be() {
    for (rows, steps) in [
        // Two there, two with the object, four back, two grips.
        (&["A.a.1"][..], 10),
        // Two there, one with the object, three back, two grips, by both at once.
        (&["A.a1.2b.B"], 8),
        // The nearer robot does it, on the way round the wall: one there, two and two past the
        // wall, and three back.
        (&["Aa#1", "....", "...B"], 1 + 1 + 4 + 1 + 5),
    ] {
        assert_eq!(least(rows, steps + 1), Some(steps as usize), "{rows:?}");
        assert_eq!(least(rows, steps), None, "{rows:?}");
    }
}
