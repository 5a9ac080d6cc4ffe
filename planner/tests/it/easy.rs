//! Easy constraints on rooms that isolate each of them.

use planner::{EasyConstraints, Kind, Places};
use scene::{Budget, Scene};
use shm_types::{Counters, WorldSnapshot};

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
