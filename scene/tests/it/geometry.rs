//! Overlap against other ways of finding it: sampled directions, sampled motion, closed forms.

use proptest::prelude::*;
use scene::{CONTACT_M, Shape, ShapeOutline, Vec2, overlap, swept_overlap, swept_regions_overlap};

/// A convex polygon: corners on an ellipse, at least a tenth of a turn apart.
fn polygon() -> impl Strategy<Value = Shape> {
    (
        prop::collection::vec(0.0..1.0f64, 3..8),
        0.1..0.6f64,
        0.1..0.6f64,
    )
        .prop_filter_map("no polygon", |(steps, a, b)| {
            let total: f64 = steps.iter().map(|s| s + 0.2).sum();
            let mut angle = 0.0;
            let corners: Vec<_> = steps
                .iter()
                .map(|step| {
                    angle += (step + 0.2) / total * std::f64::consts::TAU;
                    Vec2::new(a * angle.cos(), b * angle.sin())
                })
                .collect();
            Shape::polygon(&corners).ok()
        })
}

fn rectangle() -> impl Strategy<Value = Shape> {
    (0.05..1.0f64, 0.05..1.0f64).prop_map(|(x, y)| Shape::rectangle(Vec2::new(x, y)).unwrap())
}

fn circle() -> impl Strategy<Value = Shape> {
    (0.05..0.6f64).prop_map(|r| Shape::circle(r).unwrap())
}

/// Any shape.
pub(crate) fn shape() -> impl Strategy<Value = Shape> {
    prop_oneof![rectangle(), circle(), polygon()]
}

fn place() -> impl Strategy<Value = Vec2> {
    (-1.5..1.5f64, -1.5..1.5f64).prop_map(|(x, y)| Vec2::new(x, y))
}

/// Largest extent along a direction, from the outline alone.
fn support(shape: &Shape, direction: Vec2) -> f64 {
    match shape.outline() {
        ShapeOutline::Box { half } => half[0] * direction.x.abs() + half[1] * direction.y.abs(),
        ShapeOutline::Circle { radius } => radius,
        ShapeOutline::Polygon { points } => points
            .iter()
            .map(|p| p[0] * direction.x + p[1] * direction.y)
            .fold(f64::NEG_INFINITY, f64::max),
    }
}

/// Least overlap along many directions: never less than the penetration, and hardly more.
fn sampled_penetration(a: &Shape, at: Vec2, b: &Shape, bt: Vec2) -> f64 {
    const DIRECTIONS: usize = 4_000;
    (0..DIRECTIONS)
        .map(|i| {
            let angle = i as f64 / DIRECTIONS as f64 * std::f64::consts::TAU;
            let direction = Vec2::new(angle.cos(), angle.sin());
            support(a, direction) + support(b, -direction) + (at - bt).dot(&direction)
        })
        .fold(f64::INFINITY, f64::min)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn standing_shapes_overlap_as_all_directions_say(a in shape(), b in shape(), at in place(), bt in place()) {
        let depth = sampled_penetration(&a, at, &b, bt);
        // Between two directions the least overlap lies at most this much lower.
        let between = 4.0 * std::f64::consts::TAU / 4_000.0;
        prop_assume!(depth < CONTACT_M || depth > between);
        prop_assert_eq!(overlap(&a, at, &b, bt), depth > CONTACT_M, "{}", depth);
        prop_assert_eq!(overlap(&b, bt, &a, at), depth > CONTACT_M, "{}", depth);
    }

    #[test]
    fn a_swept_shape_overlaps_where_it_does_on_its_way(a in shape(), b in shape(), from in place(), to in place(), at in place()) {
        const SAMPLES: usize = 500;
        let swept = swept_overlap(&a, from, to, &b, at);
        let on_the_way = |shape: &Shape| (0..=SAMPLES).any(|i| {
            overlap(shape, from + (to - from) * (i as f64 / SAMPLES as f64), &b, at)
        });
        if on_the_way(&a) {
            prop_assert!(swept);
        }
        if swept {
            let half_step = (to - from).norm() / SAMPLES as f64 / 2.0;
            prop_assert!(on_the_way(&a.grown(half_step + CONTACT_M)));
        }
    }

    #[test]
    fn two_swept_shapes_overlap_where_one_meets_the_other_somewhere(
        a in shape(), b in shape(), a_from in place(), a_to in place(), b_from in place(), b_to in place()
    ) {
        const SAMPLES: usize = 200;
        let swept = swept_regions_overlap(&a, a_from, a_to, &b, b_from, b_to);
        let somewhere = |shape: &Shape| (0..=SAMPLES).any(|i| {
            swept_overlap(shape, a_from, a_to, &b, b_from + (b_to - b_from) * (i as f64 / SAMPLES as f64))
        });
        if somewhere(&a) {
            prop_assert!(swept);
        }
        if swept {
            let half_step = (b_to - b_from).norm() / SAMPLES as f64 / 2.0;
            prop_assert!(somewhere(&a.grown(half_step + CONTACT_M)));
        }
    }

    #[test]
    fn boxes_overlap_as_their_coordinates_say(a in (1..20i32, 1..20i32), b in (1..20i32, 1..20i32), apart in (-20..20i32, -20..20i32)) {
        // Twentieths of a metre: touching is frequent, and never overlap.
        let unit = 0.05;
        let full = |v: (i32, i32)| Vec2::new(f64::from(v.0), f64::from(v.1)) * unit;
        let (first, second) = (Shape::rectangle(full(a)).unwrap(), Shape::rectangle(full(b)).unwrap());
        let expected = 2 * apart.0.abs() < a.0 + b.0 && 2 * apart.1.abs() < a.1 + b.1;
        let at = Vec2::new(0.35, 17.15);
        prop_assert_eq!(overlap(&first, at + full(apart), &second, at), expected);
    }

    #[test]
    fn a_box_as_polygon_is_the_same_box(full in (0.1..1.0f64, 0.1..1.0f64), other in shape(), from in place(), to in place(), at in place()) {
        let (x, y) = (full.0 / 2.0, full.1 / 2.0);
        let rectangle = Shape::rectangle(Vec2::new(full.0, full.1)).unwrap();
        let polygon = Shape::polygon(&[
            Vec2::new(-x, -y), Vec2::new(x, -y), Vec2::new(x, y), Vec2::new(-x, y),
        ]).unwrap();
        prop_assert_eq!(
            swept_overlap(&rectangle, from, to, &other, at),
            swept_overlap(&polygon, from, to, &other, at)
        );
    }

    #[test]
    fn circles_overlap_by_their_distance(radii in (0.05..1.0f64, 0.05..1.0f64), angle in 0.0..std::f64::consts::TAU, depth in prop_oneof![Just(0.0), Just(5e-7), Just(1.5e-6), -0.1..0.1f64]) {
        prop_assume!((depth - CONTACT_M).abs() > 1e-7);
        let (a, b) = (Shape::circle(radii.0).unwrap(), Shape::circle(radii.1).unwrap());
        let apart = Vec2::new(angle.cos(), angle.sin()) * (radii.0 + radii.1 - depth);
        prop_assert_eq!(overlap(&a, apart, &b, Vec2::zeros()), depth > CONTACT_M);
    }

    #[test]
    fn a_grown_shape_keeps_its_distance_from_every_side(shape in shape(), m in 0.0..0.3f64, angle in 0.0..std::f64::consts::TAU) {
        let direction = Vec2::new(angle.cos(), angle.sin());
        prop_assert!(support(&shape.grown(m), direction) >= support(&shape, direction) + m - 1e-12);
        let (low, high) = shape.grown(m).extent();
        let (bare_low, bare_high) = shape.extent();
        prop_assert!((low - bare_low).max() <= -m + 1e-12 && (high - bare_high).min() >= m - 1e-12);
    }
}

#[test]
fn a_micrometre_divides_touching_from_overlap_in_every_direction() {
    let body = Shape::rectangle(Vec2::new(0.5, 0.5)).unwrap();
    let disc = Shape::circle(0.25).unwrap();
    let tilted = Shape::polygon(&[
        Vec2::new(0.5, 0.0),
        Vec2::new(0.0, 0.5),
        Vec2::new(-0.5, 0.0),
        Vec2::new(0.0, -0.5),
    ])
    .unwrap();
    let diagonal = Vec2::new(1.0, 1.0).normalize();
    for (a, b, direction, reach) in [
        (&body, &body, Vec2::x(), 0.5),
        (&body, &disc, Vec2::y(), 0.5),
        (&disc, &disc, diagonal, 0.5),
        (&tilted, &tilted, diagonal, 1.0 / 2.0f64.sqrt()),
        (
            &tilted,
            &body,
            diagonal,
            0.5 / 2.0f64.sqrt() + 0.25 * 2.0f64.sqrt(),
        ),
        (&tilted, &disc, diagonal, 0.5 / 2.0f64.sqrt() + 0.25),
    ] {
        for (depth, expected) in [
            (-1e-9, false),
            (0.0, false),
            (0.9e-6, false),
            (1.1e-6, true),
        ] {
            let at = direction * (reach - depth);
            assert_eq!(
                overlap(a, at, b, Vec2::zeros()),
                expected,
                "{a:?} {b:?} {depth}"
            );
            // Sliding along the touching side changes nothing.
            let along = Vec2::new(-direction.y, direction.x) * 0.01;
            let swept = swept_overlap(a, at - along, at + along, b, Vec2::zeros());
            assert_eq!(swept, expected, "{a:?} {b:?} {depth} swept");
        }
    }
}

#[test]
fn a_body_passes_a_gap_of_its_own_width() {
    let body = Shape::rectangle(Vec2::new(0.5, 0.5)).unwrap();
    let post = Shape::rectangle(Vec2::new(0.2, 1.0)).unwrap();
    let (from, to) = (Vec2::new(-2.0, 0.0), Vec2::new(2.0, 0.0));
    for (gap, blocked) in [(0.5, false), (0.499_997, true)] {
        let above = Vec2::new(0.1, gap / 2.0 + 0.5);
        let below = Vec2::new(0.1, -gap / 2.0 - 0.5);
        let meets = |at| swept_overlap(&body, from, to, &post, at);
        assert_eq!(meets(above) || meets(below), blocked, "gap {gap}");
    }
}

#[test]
fn what_is_no_shape_is_refused_with_its_reason() {
    use scene::ShapeError;
    let polygon = |corners: &[[f64; 2]]| {
        let corners: Vec<_> = corners.iter().map(|[x, y]| Vec2::new(*x, *y)).collect();
        Shape::polygon(&corners)
    };
    let arrow = [[-1.0, -1.0], [1.0, 0.0], [-1.0, 1.0], [-0.5, 0.0]];
    assert_eq!(polygon(&arrow), Err(ShapeError::NotConvex { corner: 3 }));
    // The same corner of the same arrow, told clockwise.
    let mut clockwise = arrow;
    clockwise.reverse();
    assert_eq!(
        polygon(&clockwise),
        Err(ShapeError::NotConvex { corner: 0 })
    );
    // Twice around, each corner convex by itself.
    let star = [
        [1.0, 0.0],
        [-0.8, 0.6],
        [0.3, -0.95],
        [0.3, 0.95],
        [-0.8, -0.6],
    ];
    assert!(matches!(polygon(&star), Err(ShapeError::NotConvex { .. })));
    let straight = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 1.0]];
    assert_eq!(polygon(&straight), Err(ShapeError::NotConvex { corner: 1 }));
    let sliver = [[0.0, 0.0], [1.0, 0.0], [0.5, 1e-4]];
    assert!(matches!(polygon(&sliver), Err(ShapeError::TooSmall { .. })));
    let circle: Vec<[f64; 2]> = (0..17)
        .map(|i| f64::from(i) / 17.0 * std::f64::consts::TAU)
        .map(|angle| [angle.cos(), angle.sin()])
        .collect();
    assert_eq!(
        polygon(&circle),
        Err(ShapeError::TooManyPoints { points: 17 })
    );
    assert!(polygon(&circle[..16]).is_ok());
    let far = Shape::rectangle(Vec2::new(1.0, 2e5));
    assert_eq!(far, Err(ShapeError::TooLarge { length_m: 2e5 }));
    assert_eq!(Shape::circle(f64::NAN), Err(ShapeError::NotFinite));
}

#[test]
fn whether_a_corner_turns_is_asked_of_its_angle_and_not_of_its_size() {
    for half in [0.05, 1.0, 1e3] {
        let house = |rise: f64| {
            let corners = [
                [-1.0, -1.0],
                [1.0, -1.0],
                [1.0, 1.0],
                [0.0, 1.0 + rise],
                [-1.0, 1.0],
            ];
            Shape::polygon(&corners.map(|[x, y]| Vec2::new(x, y) * half))
        };
        // A micro-radian is the least turn; this ridge turns by twice its rise.
        assert!(house(1e-6).is_ok(), "{half}");
        assert!(house(0.25e-6).is_err(), "{half}");
    }
}
