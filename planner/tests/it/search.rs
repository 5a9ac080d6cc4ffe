//! Path search against a plain Dijkstra over the same steps.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::task::Poll;

use planner::PathSearch;
use proptest::prelude::*;
use scene::{Budget, Connectivity, Occupancy, ROBOT_ALONE, Scene, Shape, Vec2};
use shm_types::Counters;

use crate::room::{draft, room, scene_of};

/// Runs a search to its end in slices of `units`; also the slices it took.
pub(crate) fn run(
    search: &mut PathSearch,
    scene: &Scene,
    from: Vec2,
    to: Vec2,
    units: u64,
    counters: &mut Counters,
) -> (Option<f64>, u64) {
    search.begin(scene, from, to);
    let mut slices = 1;
    loop {
        let mut budget = Budget::new(units);
        if let Poll::Ready(length) = search.advance(scene, &mut budget, counters) {
            return (length, slices);
        }
        assert!(
            budget.is_spent(),
            "a search that is not done uses all it is given"
        );
        slices += 1;
    }
}

/// Configurations an off-lattice one is joined to, with the length of the piece, m.
fn joints(scene: &Scene, space: &Occupancy, at: Vec2) -> Vec<(u32, f64)> {
    let lattice = &scene.lattice;
    if let Some(cell) = lattice.cell(at) {
        return if space.is_free(cell) {
            vec![(cell, 0.0)]
        } else {
            Vec::new()
        };
    }
    (lattice.around(at))
        .filter(|&cell| space.straight_is_free(scene, at, lattice.at(cell)))
        .map(|cell| (cell, (lattice.at(cell) - at).norm()))
        .collect()
}

/// Length of the shortest path by definition, m.
pub(crate) fn reference(scene: &Scene, space: &Occupancy, from: Vec2, to: Vec2) -> Option<f64> {
    let mut least = vec![f64::INFINITY; scene.lattice.len()];
    let mut open = BinaryHeap::new();
    for (cell, length) in joints(scene, space, from) {
        open.push(Reverse((length.to_bits(), cell)));
    }
    while let Some(Reverse((bits, cell))) = open.pop() {
        let length = f64::from_bits(bits);
        if length < least[cell as usize] {
            least[cell as usize] = length;
            space.for_each_step(cell, |next, step| {
                open.push(Reverse(((length + step).to_bits(), next)));
            });
        }
    }
    let over_lattice = joints(scene, space, to)
        .into_iter()
        .map(|(cell, length)| least[cell as usize] + length);
    let on_lattice = scene.lattice.cell(from).is_some() && scene.lattice.cell(to).is_some();
    let close = !on_lattice && (to - from).amax() <= 2.0 * scene.lattice.pitch_m;
    let straight = ((close || from == to) && space.straight_is_free(scene, from, to))
        .then(|| (to - from).norm());
    over_lattice
        .chain(straight)
        .reduce(f64::min)
        .filter(|length| length.is_finite())
}

fn assert_is_path(scene: &Scene, space: &Occupancy, path: &[Vec2], ends: [Vec2; 2], length: f64) {
    assert_eq!(path.first(), Some(&ends[0]));
    assert_eq!(path.last(), Some(&ends[1]));
    let mut sum = 0.0;
    for piece in path.windows(2) {
        assert!(
            space.straight_is_free(scene, piece[0], piece[1]),
            "{piece:?} is not free"
        );
        sum += (piece[1] - piece[0]).norm();
    }
    assert!(
        (sum - length).abs() < 1e-9,
        "{sum} m of path, said to be {length} m"
    );
    for corner in path.windows(3) {
        let (a, b) = (corner[1] - corner[0], corner[2] - corner[1]);
        assert!(
            a.perp(&b).abs() > 1e-12 || a.dot(&b) < 0.0,
            "{corner:?} does not bend"
        );
    }
}

/// A paper-sized room with obstacles strewn over it.
#[derive(Clone, Debug)]
struct Strewn {
    four: bool,
    resolution: f64,
    obstacles: Vec<(f64, f64, f64, f64, bool)>,
    ends: [(f64, f64); 2],
    on_lattice: bool,
}

fn strewn() -> impl Strategy<Value = Strewn> {
    let obstacle = (0.0..5.0, 0.0..3.4, 0.02..1.2, 0.02..1.2, any::<bool>());
    let end = || (0.25..4.75, 0.25..3.15);
    (
        any::<bool>(),
        prop_oneof![Just(0.1), Just(0.07)],
        proptest::collection::vec(obstacle, 0..14),
        [end(), end()],
        any::<bool>(),
    )
        .prop_map(|(four, resolution, obstacles, ends, on_lattice)| Strewn {
            four,
            resolution,
            obstacles,
            ends,
            on_lattice,
        })
}

impl Strewn {
    fn scene(&self) -> Scene {
        // A home that is no multiple of a micrometre: no exact lattice.
        let mut draft = draft([0.0, 0.0, 5.0, 3.4], &[], &[[0.400_000_3, 0.4]], &[]);
        draft.resolution_m = self.resolution;
        draft.connectivity = if self.four {
            Connectivity::Four
        } else {
            Connectivity::Eight
        };
        scene_of(draft)
    }

    fn block(&self, scene: &Scene, space: &mut Occupancy) {
        space.reset(scene, ROBOT_ALONE);
        for &(x, y, width, height, round) in &self.obstacles {
            let shape = if round {
                Shape::circle(width / 2.0)
            } else {
                Shape::polygon(&[
                    Vec2::new(-width / 2.0, -height / 2.0),
                    Vec2::new(width / 2.0, 0.0),
                    Vec2::new(-width / 2.0, height / 2.0),
                ])
            };
            space.block(scene, &shape.unwrap(), Vec2::new(x, y), true);
        }
    }

    fn ends(&self, scene: &Scene) -> [Vec2; 2] {
        self.ends.map(|(x, y)| {
            let at = Vec2::new(x, y);
            match scene.lattice.around(at).next() {
                Some(cell) if self.on_lattice => scene.lattice.at(cell),
                _ => at,
            }
        })
    }
}

/// By how much a path may be longer for being compared with another one in whole units of cost, of
/// which a step is 408: a piece from an end beside the lattice is half a unit off at most, and so is
/// the other path's.
fn rounding(scene: &Scene, ends: &[Vec2]) -> f64 {
    let beside = ends.iter().filter(|at| scene.lattice.cell(**at).is_none());
    scene.lattice.pitch_m * (1e-4 + beside.count() as f64 / 408.0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(192))]

    #[test]
    fn paths_are_as_short_as_the_shortest(strewn in strewn(), units in 1_u64..200) {
        let scene = strewn.scene();
        let mut search = PathSearch::new(&scene);
        strewn.block(&scene, search.occupancy());
        let [from, to] = strewn.ends(&scene);
        let mut whole = Counters::default();
        let (length, _) = run(&mut search, &scene, from, to, u64::MAX, &mut whole);
        let expected = reference(&scene, search.occupancy(), from, to);
        prop_assert_eq!(length.is_some(), expected.is_some(), "{:?} {:?}", length, expected);
        let path = search.path().to_vec();
        match (length, expected) {
            (Some(length), Some(expected)) => {
                let error = (length - expected).abs();
                prop_assert!(error <= 2e-6 * expected + rounding(&scene, &[from, to]), "{}", error);
                assert_is_path(&scene, search.occupancy(), &path, [from, to], length);
            }
            _ => prop_assert!(path.is_empty()),
        }

        // The same in slices, with buffers that have been used.
        let mut sliced = Counters::default();
        let (again, slices) = run(&mut search, &scene, from, to, units, &mut sliced);
        prop_assert_eq!(again.map(f64::to_bits), length.map(f64::to_bits));
        prop_assert_eq!(search.path(), &path[..]);
        prop_assert_eq!(sliced, whole);
        prop_assert!(slices >= whole.cells_expanded / units);
        prop_assert_eq!(whole.path_plans, 1);
    }
}

#[test]
fn a_body_passes_a_gap_it_just_fits() {
    let walls = [[2.0, 0.0, 2.2, 1.5], [2.0, 2.0, 2.2, 3.4]];
    let scene = room([0.0, 0.0, 5.0, 3.4], &walls, &[[0.4, 0.4], [4.4, 0.4]], &[]);
    assert!(scene.lattice.exact);
    let mut search = PathSearch::new(&scene);
    let (from, to) = (scene.homes[0], scene.homes[1]);
    let mut counters = Counters::default();
    assert!(
        run(&mut search, &scene, from, to, u64::MAX, &mut counters)
            .0
            .is_some()
    );
    let stopper = Shape::rectangle(Vec2::new(0.01, 0.01)).unwrap();
    search
        .occupancy()
        .block(&scene, &stopper, Vec2::new(2.1, 1.504), true);
    assert_eq!(
        run(&mut search, &scene, from, to, u64::MAX, &mut counters).0,
        None
    );
    assert!(search.path().is_empty());
}

#[test]
fn from_a_place_to_itself_is_a_path_of_one_point() {
    let scene = room([0.0, 0.0, 5.0, 3.4], &[], &[[0.4, 0.4]], &[]);
    let mut search = PathSearch::new(&scene);
    let mut counters = Counters::default();
    for at in [scene.homes[0], Vec2::new(1.234_567, 0.765_432)] {
        assert_eq!(
            run(&mut search, &scene, at, at, 1, &mut counters).0,
            Some(0.0)
        );
        assert_eq!(search.path(), [at]);
    }
    let shape = Shape::circle(0.3).unwrap();
    search
        .occupancy()
        .block(&scene, &shape, scene.homes[0], true);
    let (at, mut counters) = (scene.homes[0], Counters::default());
    assert_eq!(run(&mut search, &scene, at, at, 1, &mut counters).0, None);
}

#[test]
fn what_is_owed_for_obstacles_is_paid_first() {
    let scene = room([0.0, 0.0, 5.0, 3.4], &[], &[[0.4, 0.4]], &[]);
    let mut search = PathSearch::new(&scene);
    search.charge(10);
    search.begin(&scene, scene.homes[0], Vec2::new(4.0, 3.0));
    let mut counters = Counters::default();
    let mut budget = Budget::new(4);
    for _ in 0..2 {
        budget = Budget::new(5);
        assert_eq!(
            search.advance(&scene, &mut budget, &mut counters),
            Poll::Pending
        );
        assert_eq!(counters.cells_expanded, 0);
    }
    assert!(budget.is_spent());
    budget = Budget::new(5);
    assert_eq!(
        search.advance(&scene, &mut budget, &mut counters),
        Poll::Pending
    );
    assert_eq!(counters.cells_expanded, 5);
}
