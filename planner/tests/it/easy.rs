//! Easy constraints on rooms that isolate each of them.

use planner::{EasyConstraints, Kind, Places, easy};
use proptest::prelude::*;
use scene::{Budget, Scene};
use shm_types::{Counters, WorldSnapshot};

use crate::random::rooms;
use crate::room::{room, shipped, start};

/// All easy constraints of a world, with their edges.
pub(crate) fn easy_of(scene: &Scene, world: &WorldSnapshot) -> Vec<(Kind, usize, usize)> {
    let mut easy = EasyConstraints::new(scene);
    work(&mut easy, scene, world, u64::MAX).0
}

fn work(
    easy: &mut EasyConstraints,
    scene: &Scene,
    world: &WorldSnapshot,
    units: u64,
) -> (Vec<(Kind, usize, usize)>, Counters) {
    let mut counters = Counters::default();
    let objects = &world.objects[..scene.objects.len()];
    easy.begin(
        objects
            .iter()
            .map(|object| Places::of(object, object.status)),
    );
    while easy
        .advance(scene, &mut Budget::new(units), &mut counters)
        .is_pending()
    {
        counters.units += units;
    }
    let mut found = Vec::new();
    easy.for_each(|kind, before, after| found.push((kind, before, after)));
    (found, counters)
}

#[test]
fn each_easy_constraint_alone() {
    for (name, expected) in [
        ("e1", (Kind::E1, 0, 1)),
        ("e2", (Kind::E2, 1, 0)),
        ("e3", (Kind::E3, 0, 1)),
        ("e4", (Kind::E4, 1, 0)),
    ] {
        let scene = shipped(name);
        assert_eq!(easy_of(&scene, &start(&scene)), [expected], "{name}");
    }
    for name in ["h1", "h2", "blocked-approach", "joint-blockers"] {
        let scene = shipped(name);
        assert_eq!(easy_of(&scene, &start(&scene)), [], "{name}");
    }
}

#[test]
fn a_swap_has_both_edges_twice() {
    let scene = shipped("swap");
    let found = easy_of(&scene, &start(&scene));
    let expected = [
        (Kind::E2, 1, 0),
        (Kind::E3, 0, 1),
        (Kind::E2, 0, 1),
        (Kind::E3, 1, 0),
    ];
    assert_eq!(found, expected);
}

#[test]
fn four_tests_a_pair_are_charged_every_time() {
    let trips = [
        ([1.0, 1.5], Some([4.0, 1.0])),
        ([1.0, 2.0], Some([4.0, 2.0])),
        ([2.0, 2.0], Some([4.0, 3.0])),
        ([3.0, 3.0], None),
    ];
    let scene = room([0.0, 0.0, 5.0, 3.4], &[], &[[0.4, 0.4]], &trips);
    let mut world = start(&scene);
    let mut easy = EasyConstraints::new(&scene);
    // Three open tasks: clutter is none.
    let (first, counters) = work(&mut easy, &scene, &world, u64::MAX);
    assert_eq!(counters.polygon_tests, 4 * 3 * 2);
    assert_eq!(first, [(Kind::E1, 0, 1)]);
    let (again, counters) = work(&mut easy, &scene, &world, 1);
    assert_eq!(counters.polygon_tests, 4 * 3 * 2);
    assert_eq!(again, first);
    assert!(counters.units >= 20, "{counters:?}");
    assert!(
        (1..=24).contains(&easy.tested()),
        "no more than were charged"
    );

    // An object that has moved is looked at again, and a finished task is no node.
    let away = scene::point(scene::Vec2::new(3.0, 1.5));
    crate::room::put(&mut world.objects[0], away);
    assert_eq!(
        work(&mut easy, &scene, &world, 3).0,
        easy_of(&scene, &world)
    );
    let goal = world.objects[0].goal;
    crate::room::put(&mut world.objects[0], goal);
    let (found, counters) = work(&mut easy, &scene, &world, u64::MAX);
    assert_eq!((found, counters.polygon_tests), (Vec::new(), 8));
}

#[test]
fn clearance_counts() {
    let trips = [
        ([1.0, 1.5], Some([4.0, 1.0])),
        ([1.0, 2.45], Some([4.0, 3.0])),
    ];
    let mut draft = crate::room::draft([0.0, 0.0, 5.0, 3.4], &[], &[[0.4, 0.4]], &trips);
    // The robot under object 1 reaches down to y = 1.75, object 0 up to 1.7.
    let free = crate::room::scene_of(draft.clone());
    assert_eq!(easy_of(&free, &start(&free)), []);
    draft.robot.clearance_m = 0.05;
    let touching = crate::room::scene_of(draft.clone());
    assert_eq!(easy_of(&touching, &start(&touching)), []);
    draft.robot.clearance_m = 0.06;
    let close = crate::room::scene_of(draft);
    assert_eq!(easy_of(&close, &start(&close)), [(Kind::E1, 0, 1)]);
}

/// The paper's way: a test of each kind for every ordered pair.
fn plain(scene: &Scene, places: &[Option<Places>]) -> Vec<(Kind, usize, usize)> {
    let mut found = Vec::new();
    for (one, first) in places.iter().enumerate() {
        for (two, second) in places.iter().enumerate().filter(|(two, _)| *two != one) {
            let (Some(first), Some(second)) = (*first, *second) else {
                continue;
            };
            for kind in Kind::EASY {
                if easy::holds(scene, kind, (one, first), (two, second)) {
                    let (before, after) = kind.edge(one, two);
                    found.push((kind, before, after));
                }
            }
        }
    }
    found
}

proptest! {
    /// Whatever moved, was finished or taken up again since the last time.
    #[test]
    fn looking_only_at_what_is_near_misses_nothing(
        scene in rooms(6),
        changes in proptest::collection::vec(
            proptest::collection::vec((0_usize..6, 0_usize..3, 0.0..3.6, 0.0..2.8), 0..4),
            1..6,
        ),
    ) {
        let mut places: Vec<_> = (scene.objects.iter())
            .map(|object| Some(Places { initial: object.start, goal: object.goal? }))
            .collect();
        let mut easy = EasyConstraints::new(&scene);
        for change in changes {
            easy.begin(places.iter().copied());
            let mut counters = Counters::default();
            while easy.advance(&scene, &mut Budget::new(9), &mut counters).is_pending() {}
            let mut found = Vec::new();
            easy.for_each(|kind, before, after| found.push((kind, before, after)));
            prop_assert_eq!(found, plain(&scene, &places));
            let open = places.iter().flatten().count() as u64;
            prop_assert_eq!(counters.polygon_tests, 4 * open * open.saturating_sub(1));
            for (task, what, x, y) in change {
                let task = task % places.len();
                let at = scene::Vec2::new(x, y);
                let old = places[task].unwrap_or(Places { initial: at, goal: at });
                places[task] = match what {
                    0 => None,
                    1 => Some(Places { initial: at, ..old }),
                    _ => Some(Places { goal: at, ..old }),
                };
            }
        }
    }
}
