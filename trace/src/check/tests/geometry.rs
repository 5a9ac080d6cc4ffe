//! The checker's geometry against the scene's, which was written apart from it and works
//! otherwise: separating axes and iterations there, closed form in time here.

use proptest::prelude::*;
use scene::{Shape, Vec2};

use crate::check::geometry::{Meeting, Solid};
use crate::check::rules::OVERLAP_M;

/// What the two may differ by, m: the shapes' corners are rounded differently.
const DIFFERENCE_M: f64 = 1e-7;

fn shapes() -> impl Strategy<Value = Shape> {
    let width = 0.05..1.0_f64;
    let tenths = 1..8_i32;
    let on_lattice = (tenths.clone(), tenths).prop_map(|(x, y)| {
        Shape::rectangle(Vec2::new(0.1 * f64::from(x), 0.1 * f64::from(y))).unwrap()
    });
    prop_oneof![
        on_lattice,
        (width.clone(), width.clone())
            .prop_map(|(x, y)| Shape::rectangle(Vec2::new(x, y)).unwrap()),
        width
            .clone()
            .prop_map(|radius| Shape::circle(radius).unwrap()),
        polygons(width),
    ]
}

/// Corners at unequal angles on an ellipse.
fn polygons(width: impl Strategy<Value = f64> + Clone) -> impl Strategy<Value = Shape> {
    (
        3..9_usize,
        width.clone(),
        width,
        proptest::collection::vec(0.0..0.7_f64, 9),
    )
        .prop_map(|(corners, x, y, shifts)| {
            let corner = |i: usize| {
                let angle = (i as f64 + shifts[i]) * std::f64::consts::TAU / corners as f64;
                Vec2::new(x * angle.cos(), y * angle.sin())
            };
            let corners: Vec<Vec2> = (0..corners).map(corner).collect();
            Shape::polygon(&corners).unwrap()
        })
}

fn places() -> impl Strategy<Value = Vec2> {
    // On a lattice as well, where bodies just touch and slide along each other.
    let free = (-2.0..2.0_f64, -2.0..2.0_f64).prop_map(|(x, y)| Vec2::new(x, y));
    let lattice = (-20..=20_i32, -20..=20_i32)
        .prop_map(|(x, y)| Vec2::new(f64::from(x) * 0.05, f64::from(y) * 0.05));
    prop_oneof![free, lattice]
}

fn meeting(moving: &Shape, standing: &Shape) -> Meeting {
    let solid = |shape: &Shape| Solid::from(&shape.outline().into());
    Meeting::of(&solid(moving), &solid(standing))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4_000))]

    #[test]
    fn sweeps_meet_where_the_scene_says_so(
        moving in shapes(), standing in shapes(), from in places(), to in places(), at in places(),
    ) {
        let meeting = meeting(&moving, &standing);
        let surely = meeting.nearer_than(-OVERLAP_M - DIFFERENCE_M, from - at, to - at).is_some();
        let perhaps = meeting.nearer_than(-OVERLAP_M + DIFFERENCE_M, from - at, to - at).is_some();
        let scene = scene::swept_overlap(&moving, from, to, &standing, at);
        prop_assert!(!surely || scene, "only the checker sees them meet");
        prop_assert!(!scene || perhaps, "only the scene sees them meet");
    }

    #[test]
    fn they_meet_at_the_times_at_which_the_scene_has_them_overlap(
        moving in shapes(), standing in shapes(), from in places(), to in places(),
        part in 0.0..=1.0_f64,
    ) {
        let meeting = meeting(&moving, &standing);
        let then = from + (to - from) * part;
        let inside = |depth_m: f64| {
            meeting.nearer_than(-depth_m, from, to).is_some_and(|(start, end)| (start..=end).contains(&part))
        };
        let scene = scene::overlap(&moving, then, &standing, Vec2::zeros());
        prop_assert!(!inside(OVERLAP_M + DIFFERENCE_M) || scene);
        prop_assert!(!scene || inside(OVERLAP_M - DIFFERENCE_M));
    }

    #[test]
    fn distances_are_those_of_discs_around(
        moving in shapes(), standing in shapes(), from in places(), to in places(),
        distance_m in 0.01..0.5_f64, angle in 0.0..std::f64::consts::TAU,
    ) {
        // Nearer than a distance: some shift by less than that makes them overlap.
        let meeting = meeting(&moving, &standing);
        let shift = Vec2::new(angle.cos(), angle.sin()) * (distance_m - 1e-5);
        let shifted = scene::swept_overlap(&moving, from + shift, to + shift, &standing, Vec2::zeros());
        prop_assert!(!shifted || meeting.nearer_than(distance_m, from, to).is_some());
        // And not nearer where growing by it keeps them apart: grown shapes hold the disc.
        let grown = scene::swept_overlap(&moving.grown(distance_m), from, to, &standing, Vec2::zeros());
        prop_assert!(grown || meeting.nearer_than(distance_m - 1e-5, from, to).is_none());
    }
}

/// A motion along a side, just touching, is at no distance all the way, and overlaps nowhere.
#[test]
fn sliding_along_a_side_is_touching() {
    let half = Vec2::new(0.25, 0.25);
    let robot = Shape::rectangle(half * 2.0).unwrap();
    let object = Shape::rectangle(Vec2::new(0.4, 0.4)).unwrap();
    let meeting = meeting(&robot, &object);
    let at = Vec2::new(6.1, 0.9);
    let (from, to) = (Vec2::new(6.1, 0.45) - at, Vec2::new(7.4, 0.45) - at);
    let (start, end) = meeting.nearer_than(0.05, from, to).unwrap();
    assert!(
        start == 0.0 && (end - 0.5 / 1.3).abs() < 1e-12,
        "{start} to {end}"
    );
    assert_eq!(meeting.nearer_than(-OVERLAP_M, from, to), None);
}

#[test]
fn times_are_exact() {
    let square = Shape::rectangle(Vec2::new(0.5, 0.5)).unwrap();
    let meeting = meeting(&square, &square);
    let (from, to) = (Vec2::new(-2.0, 0.0), Vec2::new(2.0, 0.0));
    let (start, end) = meeting.nearer_than(-0.1, from, to).unwrap();
    assert!((start - 1.6 / 4.0).abs() < 1e-12 && (end - 2.4 / 4.0).abs() < 1e-12);
    let disc = Shape::circle(0.5).unwrap();
    let meeting = self::meeting(&disc, &disc);
    let (start, end) = meeting.nearer_than(0.2, from, to).unwrap();
    assert!((start - 0.8 / 4.0).abs() < 1e-12 && (end - 3.2 / 4.0).abs() < 1e-12);
    assert_eq!(
        meeting.nearer_than(0.2, Vec2::new(-2.0, 1.2001), Vec2::new(2.0, 1.2001)),
        None
    );
}
