//! The configuration space against direct exact tests, and the lattice's choice.

use proptest::prelude::*;
use scene::{
    CONTACT_M, ClassId, Connectivity, Draft, Lattice, ObjectDraft, Occupancy, Scene, ShapeDraft,
    Vec2, WallDraft,
};

use crate::geometry::shape;

/// Directions in the order of [`Occupancy::steps`].
const STEPS: [(i32, i32); 8] = [
    (1, 0),
    (0, 1),
    (-1, 0),
    (0, -1),
    (1, 1),
    (-1, 1),
    (-1, -1),
    (1, -1),
];

fn robot_shape() -> impl Strategy<Value = ShapeDraft> {
    prop_oneof![
        3 => (2..12i32, 2..12i32).prop_map(|(x, y)| ShapeDraft::Box([f64::from(x) * 0.05, f64::from(y) * 0.05])),
        1 => (0.1..0.3f64).prop_map(ShapeDraft::Circle),
        1 => (0.1..0.3f64).prop_map(|r| ShapeDraft::Polygon(vec![[r, 0.0], [0.0, 2.0 * r], [-r, 0.0], [0.0, -r]])),
    ]
}

fn coordinate(low: i32, high: i32) -> impl Strategy<Value = f64> {
    (low..high).prop_map(|i| f64::from(i) * 0.05)
}

fn wall() -> impl Strategy<Value = WallDraft> {
    let corner = || (coordinate(0, 80), coordinate(0, 50));
    prop_oneof![
        3 => (corner(), coordinate(1, 20), coordinate(1, 20))
            .prop_map(|((x, y), w, h)| WallDraft::Box([x, y, x + w, y + h])),
        1 => (corner(), 0.1..0.8f64, 0.1..0.8f64)
            .prop_map(|((x, y), w, h)| WallDraft::Polygon(vec![[x, y], [x + w, y + h / 2.0], [x + w / 2.0, y + h]])),
    ]
}

/// A room with random walls; one robot in a bay of its own, where it is never blocked.
fn scene() -> impl Strategy<Value = Scene> {
    (
        robot_shape(),
        prop::collection::vec(wall(), 0..5),
        prop_oneof![Just(0.0), Just(0.05), 0.0..0.1f64],
        prop_oneof![Just(Connectivity::Four), Just(Connectivity::Eight)],
    )
        .prop_filter_map("not a scene", |(shape, walls, clearance, connectivity)| {
            let mut draft = Draft::room("random", [0.0, 0.0, 6.0, 3.0]);
            draft.robot.shape = shape;
            draft.robot.clearance_m = clearance;
            draft.connectivity = connectivity;
            draft.walls = walls;
            draft.homes = vec![[5.4, 0.9]];
            draft.objects = vec![ObjectDraft {
                shape: ShapeDraft::Box([0.3, 0.2]),
                grasp: [0.1, -0.45],
                ..ObjectDraft::paper([5.4, 2.4], None)
            }];
            Scene::new(draft).ok()
        })
}

/// Which cell to look at: any, one at the edge of the lattice, one beside an obstacle.
#[derive(Clone, Copy, Debug)]
enum Look {
    Anywhere,
    AtTheEdge(usize),
    Beside(prop::sample::Index),
}

fn look() -> impl Strategy<Value = Look> {
    prop_oneof![
        Just(Look::Anywhere),
        (0..4usize).prop_map(Look::AtTheEdge),
        any::<prop::sample::Index>().prop_map(Look::Beside),
    ]
}

impl Look {
    /// A cell for two numbers from 0 to 1.
    fn cell(self, lattice: &Lattice, obstacles: &[Vec2], (x, y): (f64, f64)) -> u32 {
        let (width, height) = (f64::from(lattice.width), f64::from(lattice.height));
        let (mut column, mut row) = (x * width, y * height);
        match self {
            Self::AtTheEdge(0) => column = 0.0,
            Self::AtTheEdge(1) => column = width,
            Self::AtTheEdge(2) => row = 0.0,
            Self::AtTheEdge(_) => row = height,
            Self::Beside(which) if !obstacles.is_empty() => {
                let at = (*which.get(obstacles) - lattice.at(0)) / lattice.pitch_m;
                let reach = 2.0 / lattice.pitch_m;
                (column, row) = (at.x + (x - 0.5) * reach, at.y + (y - 0.5) * reach);
            }
            Self::Anywhere | Self::Beside(_) => {}
        }
        let within = |at: f64, count: f64| at.clamp(0.0, count - 1.0) as u32;
        within(row, height) * lattice.width + within(column, width)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn every_point_and_step_is_what_the_exact_test_says(
        scene in scene(),
        class in 0..2usize,
        obstacles in prop::collection::vec((shape(), 0.0..6.0f64, 0.0..3.0f64, -0.5..0.5f64, -0.5..0.5f64, any::<bool>()), 0..4),
        looks in prop::collection::vec((look(), (0.0..1.0f64, 0.0..1.0f64)), 180),
    ) {
        let lattice = &scene.lattice;
        let mut space = Occupancy::new(&scene);
        space.reset(&scene, ClassId(class));
        for (shape, x, y, along_x, along_y, moves) in &obstacles {
            let at = Vec2::new(*x, *y);
            if *moves {
                space.block_swept(&scene, shape, at, at + Vec2::new(*along_x, *along_y));
            } else {
                space.block(&scene, shape, at, *along_x > 0.0);
            }
        }
        let inside = |column: i32, row: i32| {
            (0..lattice.width as i32).contains(&column) && (0..lattice.height as i32).contains(&row)
        };
        let mut centres: Vec<Vec2> = obstacles.iter().map(|(_, x, y, ..)| Vec2::new(*x, *y)).collect();
        centres.extend(scene.walls.iter().map(|(_, at)| *at));
        for (look, at) in looks {
            let cell = look.cell(lattice, &centres, at);
            let (column, row) = ((cell % lattice.width) as i32, (cell / lattice.width) as i32);
            let at = lattice.at(cell);
            prop_assert_eq!(space.is_free(cell), space.at_is_free(&scene, at));
            let straight = |from: (i32, i32), to: (i32, i32)| {
                inside(from.0, from.1) && inside(to.0, to.1) && {
                    let point = |(c, r): (i32, i32)| lattice.at((r * lattice.width as i32 + c) as u32);
                    space.straight_is_free(&scene, point(from), point(to))
                }
            };
            let mut visited = Vec::new();
            space.for_each_step(cell, |next, length| visited.push((next, length)));
            for (direction, (x, y)) in STEPS.into_iter().enumerate() {
                let to = (column + x, row + y);
                let mut free = straight((column, row), to);
                if x != 0 && y != 0 {
                    free = free && lattice.connectivity == Connectivity::Eight
                        && straight((column, row), (to.0, row)) && straight((to.0, row), to)
                        && straight((column, row), (column, to.1)) && straight((column, to.1), to);
                }
                prop_assert_eq!(space.steps(cell) >> direction & 1 == 1, free, "cell {} direction {}", cell, direction);
                let next = (to.1 * lattice.width as i32 + to.0) as u32;
                let length = f64::from(x * x + y * y).sqrt() * lattice.pitch_m;
                let found = visited.iter().any(|(n, l)| *n == next && (l - length).abs() < 1e-12);
                prop_assert_eq!(found, free);
            }
        }
    }

    #[test]
    fn resetting_forgets_every_obstacle(scene in scene(), obstacle in shape(), x in 0.0..6.0f64, y in 0.0..3.0f64) {
        let fresh = Occupancy::new(&scene);
        let mut used = fresh.clone();
        used.block(&scene, &obstacle, Vec2::new(x, y), true);
        used.reset(&scene, ClassId(1));
        used.reset(&scene, ClassId(0));
        for cell in 0..scene.lattice.len() as u32 {
            prop_assert_eq!(used.steps(cell), fresh.steps(cell));
            prop_assert_eq!(used.is_free(cell), fresh.is_free(cell));
        }
        prop_assert!(used.at_is_free(&scene, scene.homes[0]));
    }
}

fn room(bounds: [f64; 4]) -> Draft {
    let mut draft = Draft::room("room", bounds);
    draft.homes = vec![[bounds[0] + 0.5, bounds[1] + 0.5]];
    draft
}

#[test]
fn the_papers_lengths_make_a_lattice_of_a_twentieth() {
    let mut draft = room([0.0, 0.0, 5.0, 3.4]);
    draft.objects = vec![ObjectDraft::paper([1.0, 1.0], Some([4.0, 1.0]))];
    let scene = Scene::new(draft).unwrap();
    let lattice = &scene.lattice;
    assert!(lattice.exact);
    assert!((lattice.pitch_m - 0.05).abs() < 1e-12);
    assert_eq!((lattice.width, lattice.height), (101, 69));
    // Grasps and homes are on it, as the very numbers of the file.
    for p in [scene.homes[0], scene.grasp_at(0, scene.objects[0].start)] {
        assert_eq!(lattice.at(lattice.cell(p).unwrap()), p);
    }
}

#[test]
fn whole_pitches_are_as_large_as_the_room_allows_but_no_wider_than_a_body() {
    // Only a robot of half a metre, everything a multiple of a quarter: contacts are too.
    let draft = room([0.0, 0.0, 4.0, 3.0]);
    assert_eq!(Scene::new(draft).unwrap().lattice.pitch_m, 0.25);
    // A robot a metre wide against walls a whole number of metres apart, at its width's half.
    let mut draft = room([0.0, 0.0, 6.0, 3.0]);
    draft.robot.shape = ShapeDraft::Box([1.0, 1.0]);
    assert_eq!(Scene::new(draft).unwrap().lattice.pitch_m, 1.0);
    // Far apart, yet never coarser than the body.
    let mut draft = room([0.0, 0.0, 9.5, 6.5]);
    draft.robot.shape = ShapeDraft::Box([0.5, 0.5]);
    draft.homes = vec![[0.25, 0.25]];
    assert_eq!(Scene::new(draft).unwrap().lattice.pitch_m, 0.5);
}

#[test]
fn where_lengths_share_no_measure_the_given_resolution_holds() {
    type Change = fn(&mut Draft);
    let changes: [Change; 4] = [
        |draft| draft.robot.shape = ShapeDraft::Circle(0.25),
        |draft| draft.walls = vec![WallDraft::Polygon(vec![[2.0, 2.0], [3.0, 2.0], [2.0, 3.0]])],
        |draft| draft.homes = vec![[1.0 / 3.0, 1.0]],
        |draft| draft.homes = vec![[0.503, 1.0]],
    ];
    for change in changes {
        let mut draft = room([0.0, 0.0, 4.0, 3.0]);
        change(&mut draft);
        let scene = Scene::new(draft).unwrap();
        let lattice = &scene.lattice;
        assert!(!lattice.exact);
        assert_eq!(
            (lattice.pitch_m, lattice.width, lattice.height),
            (0.1, 40, 30)
        );
        assert!((lattice.at(0) - Vec2::new(0.05, 0.05)).amax() < 1e-12);
        // What lies off it is joined to it exactly.
        let space = Occupancy::new(&scene);
        let joints: Vec<_> = scene::joints(&scene, &space, scene.homes[0]).collect();
        assert!(joints.len() > 3, "{joints:?}");
        let to_all = |cell: &u32| {
            let at = lattice.at(*cell);
            space.straight_is_free(&scene, scene.homes[0], at)
                && (at - scene.homes[0]).amax() < 0.2 + 1e-12
        };
        assert!(joints.iter().all(to_all));
    }
}

#[test]
fn a_passage_between_the_centres_of_cells_is_found() {
    // A slot as wide as the robot, its middle off every multiple of a tenth (rule 33).
    let mut draft = room([0.0, 0.0, 4.0, 3.0]);
    draft.walls = vec![
        WallDraft::Box([2.0, 0.0, 2.2, 1.15]),
        WallDraft::Box([2.0, 1.65, 2.2, 3.0]),
    ];
    draft.homes.push([3.5, 2.5]);
    let scene = Scene::new(draft).unwrap();
    let space = Occupancy::new(&scene);
    let mut flood = scene::Flood::new(&scene);
    flood.run(&scene, &space, scene.homes[0]);
    assert!(flood.reached_at(&scene, &space, scene.homes[1]));
}

#[test]
fn a_thin_wall_between_free_points_is_seen() {
    // Two millimetres of wall between lattice points that are all free of it.
    let mut draft = room([0.0, 0.0, 4.0, 3.0]);
    draft.robot.shape = ShapeDraft::Circle(0.05);
    draft.resolution_m = 0.1;
    draft.walls = vec![WallDraft::Box([1.999, -1.0, 2.001, 4.0])];
    draft.homes.push([3.5, 2.5]);
    let scene = Scene::new(draft).unwrap();
    let space = Occupancy::new(&scene);
    let mut flood = scene::Flood::new(&scene);
    flood.run(&scene, &space, scene.homes[0]);
    assert!(!flood.reached_at(&scene, &space, scene.homes[1]));
}

#[test]
fn a_point_is_on_the_lattice_within_half_a_contact_and_between_its_edges() {
    let lattice = Scene::new(room([0.0, 0.0, 5.0, 3.4])).unwrap().lattice;
    let last = lattice.len() as u32 - 1;
    for cell in [0, lattice.width - 1, lattice.width, last - 1, last] {
        let at = lattice.at(cell);
        assert_eq!(lattice.cell(at), Some(cell));
        for along in [Vec2::x(), -Vec2::x(), Vec2::y(), -Vec2::y()] {
            assert_eq!(lattice.cell(at + along * CONTACT_M * 0.4), Some(cell));
            assert_eq!(lattice.cell(at + along * CONTACT_M * 0.6), None);
        }
    }
    for along in [Vec2::x(), Vec2::y()] {
        assert_eq!(lattice.cell(lattice.at(0) - along * lattice.pitch_m), None);
        assert_eq!(
            lattice.cell(lattice.at(last) + along * lattice.pitch_m),
            None
        );
    }
}

#[test]
fn nobody_moves_in_or_out_of_the_room() {
    let scene = Scene::new(room([0.0, 0.0, 4.0, 3.0])).unwrap();
    let space = Occupancy::new(&scene);
    let home = scene.homes[0];
    for outside in [[-2.0, 0.5], [6.0, 0.5], [0.5, -2.0], [0.5, 5.0]].map(Vec2::from) {
        assert!(!space.straight_is_free(&scene, home, outside));
        assert!(!space.straight_is_free(&scene, outside, home));
        assert!(!space.at_is_free(&scene, outside));
    }
}

#[test]
fn where_an_object_was_left_makes_the_lattice_less_than_exact_but_no_coarser() {
    let mut draft = room([0.0, 0.0, 5.0, 3.4]);
    draft.objects = vec![ObjectDraft::paper([1.0, 1.5], Some([4.0, 1.5]))];
    let on_it = Scene::version(draft.clone()).unwrap().lattice;
    assert!(on_it.exact);
    draft.objects[0].start = [1.013, 1.5];
    let off_it = Scene::version(draft).unwrap().lattice;
    assert!(!off_it.exact);
    assert_eq!(off_it.pitch_m, on_it.pitch_m);
}

/// Where a body tapers, points beside a thin wall are free in row after row, and only the steps
/// between them are not.
#[test]
fn a_tip_passes_beside_a_thin_wall_and_not_through_it() {
    let mut between = 0;
    for x in [2.01, 2.03, 2.05, 2.07, 2.09] {
        let mut draft = Draft::room("tip", [0.0, 0.0, 4.0, 3.0]);
        draft.resolution_m = 0.1;
        draft.robot.shape = ShapeDraft::Polygon(vec![[-0.06, -0.5], [0.06, -0.5], [0.0, 0.5]]);
        draft.walls = vec![WallDraft::Box([x, 1.5, x + 0.01, 3.0])];
        draft.homes = vec![[1.0, 1.0]];
        draft.objects = vec![ObjectDraft::paper([3.0, 2.0], None)];
        let scene = Scene::new(draft).unwrap();
        let lattice = &scene.lattice;
        let mut space = Occupancy::new(&scene);
        space.reset(&scene, ClassId(0));
        // Steps to the right that lead through the wall, from one free point to another.
        let crosses = |cell: u32| {
            let (from, to) = (lattice.at(cell), lattice.at(cell + 1));
            space.is_free(cell)
                && space.is_free(cell + 1)
                && !space.straight_is_free(&scene, from, to)
        };
        let inner =
            (1..lattice.height - 1).flat_map(|y| (1..lattice.width - 1).map(move |x| (x, y)));
        for cell in inner
            .map(|(x, y)| y * lattice.width + x)
            .filter(|&cell| crosses(cell))
        {
            let mut steps = Vec::new();
            space.for_each_step(cell, |next, _| steps.push(next));
            assert!(!steps.contains(&(cell + 1)), "{x}: {:?}", lattice.at(cell));
            let is_first = !crosses(cell - lattice.width) && crosses(cell + lattice.width);
            between += u32::from(is_first);
        }
    }
    assert!(between > 0);
}
