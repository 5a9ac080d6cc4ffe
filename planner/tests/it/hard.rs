//! Hard constraints on rooms that isolate each of them.

use planner::{Found, HardConstraints, Places};
use scene::{Budget, HardMode, Method, Scene, Settings};
use shm_types::{Constraint, ConstraintKind, Counters, WorldSnapshot};

use crate::room::{put, room, shipped, start};

const H1: u32 = ConstraintKind::H1.code();
const H2: u32 = ConstraintKind::H2.code();

fn settings(method: Method, hard: HardMode) -> Settings {
    Settings {
        method,
        hard,
        ..Settings::default()
    }
}

/// What the tests of one task, or of all, find; in slices of `units`.
fn work(
    hard: &mut HardConstraints,
    scene: &Scene,
    world: &WorldSnapshot,
    task: Option<usize>,
    units: u64,
) -> (Found, Counters) {
    let objects = &world.objects[..scene.objects.len()];
    hard.update(
        objects
            .iter()
            .map(|object| Places::of(object, object.status)),
    );
    match task {
        Some(task) => hard.begin_task(scene, task),
        None => hard.begin_all(),
    }
    let mut counters = Counters::default();
    loop {
        let mut budget = Budget::new(units);
        let outcome = hard.advance(scene, &mut budget, &mut counters);
        counters.units += budget.spent();
        if let std::task::Poll::Ready(found) = outcome {
            return (found, counters);
        }
    }
}

fn listed(hard: &HardConstraints) -> Vec<(u32, u32, u32)> {
    let mut list = Vec::new();
    hard.for_each(
        |Constraint {
             before,
             after,
             kind,
         }| list.push((before, after, kind)),
    );
    assert!(list.is_sorted());
    list
}

#[test]
fn each_hard_constraint_alone() {
    for (name, expected) in [("h1", (0, 1, H1)), ("h2", (1, 0, H2))] {
        let scene = shipped(name);
        let world = start(&scene);
        for method in [Method::Restricted, Method::GraspingAndRestricted] {
            for task in [Some(0), Some(1), None] {
                let mut hard = HardConstraints::new(&scene, &settings(method, HardMode::Cached));
                let (found, _) = work(&mut hard, &scene, &world, task, u64::MAX);
                assert_eq!(
                    found,
                    Found {
                        new: 1,
                        infeasible: false
                    },
                    "{name}"
                );
                assert_eq!(listed(&hard), [expected], "{name}");
            }
        }
    }
}

#[test]
fn what_is_blocked_only_jointly_or_on_the_way_in_is_not_seen() {
    for name in ["joint-blockers", "blocked-approach", "blocked-return"] {
        let scene = shipped(name);
        let mut hard = HardConstraints::new(&scene, &settings(Method::All, HardMode::Cached));
        let (found, _) = work(&mut hard, &scene, &start(&scene), None, u64::MAX);
        assert_eq!((found.new, listed(&hard)), (0, Vec::new()), "{name}");
    }
}

#[test]
fn easy_constraints_are_hard_ones_too_but_spare_the_plan() {
    for (name, kind, edge) in [
        ("e1", H1, (0, 1)),
        ("e2", H2, (1, 0)),
        ("e3", H1, (0, 1)),
        ("e4", H2, (1, 0)),
    ] {
        let scene = shipped(name);
        let world = start(&scene);
        let mut restricted =
            HardConstraints::new(&scene, &settings(Method::Restricted, HardMode::Cached));
        let (_, plans) = work(&mut restricted, &scene, &world, None, u64::MAX);
        assert_eq!(listed(&restricted), [(edge.0, edge.1, kind)], "{name}");
        assert_eq!(plans.polygon_tests, 0);

        let mut all = HardConstraints::new(&scene, &settings(Method::All, HardMode::Cached));
        let (found, counters) = work(&mut all, &scene, &world, None, u64::MAX);
        assert_eq!((found.new, listed(&all)), (0, Vec::new()), "{name}");
        // One of four tests is decided; that it held took a look at rule 10 as well.
        assert_eq!(
            (plans.path_plans, counters.path_plans),
            (4 + 3, 3),
            "{name}"
        );
        assert!((4..=8).contains(&counters.polygon_tests), "{counters:?}");
    }
}

#[test]
fn a_task_that_cannot_be_done_alone_gives_no_constraint() {
    let scene = shipped("unreachable-goal");
    let world = start(&scene);
    let infeasible = match scene::certificate(&scene) {
        Some(scene::Infeasible::Transfer { object, .. }) => object,
        other => panic!("{other:?}"),
    };
    for method in [Method::Restricted, Method::GraspingAndRestricted] {
        let mut hard = HardConstraints::new(&scene, &settings(method, HardMode::Cached));
        let (found, _) = work(&mut hard, &scene, &world, Some(infeasible), u64::MAX);
        assert_eq!(
            found,
            Found {
                new: 0,
                infeasible: true
            }
        );
        let (found, counters) = work(&mut hard, &scene, &world, Some(infeasible), u64::MAX);
        assert_eq!(
            (found.infeasible, counters.path_plans),
            (true, 0),
            "known by now"
        );
        work(&mut hard, &scene, &world, None, u64::MAX);
        assert!(listed(&hard).iter().all(|(before, after, kind)| {
            let mover = if *kind == H1 { *after } else { *before };
            mover != infeasible as u32
        }));
    }
}

/// The robot comes down a dead end before its object, which then shuts it in.
#[test]
fn a_task_after_which_nobody_gets_home_cannot_be_done() {
    let walls = [[0.0, 0.0, 0.75, 1.5], [1.25, 0.0, 2.0, 1.5]];
    let trips = [([1.0, 2.6], Some([1.0, 0.7]))];
    let homes = [[0.3, 1.8], [1.7, 1.8]];
    let scene = room([0.0, 0.0, 2.0, 3.0], &walls, &homes, &trips);
    let settings = settings(Method::Restricted, HardMode::Cached);
    let mut hard = HardConstraints::new(&scene, &settings);
    let (found, counters) = work(&mut hard, &scene, &start(&scene), Some(0), u64::MAX);
    assert_eq!((found.new, found.infeasible), (0, true));
    // From one of the homes, the transfer, and to each of them.
    assert_eq!(counters.path_plans, 1 + 1 + 2);
}

/// Five objects in two rooms with a narrow door: easy and hard constraints of all sorts.
fn crowded() -> Scene {
    let walls = [[2.4, 0.0, 2.6, 1.2], [2.4, 2.2, 2.6, 3.4]];
    let trips = [
        ([1.2, 2.4], Some([4.0, 2.8])),
        ([2.5, 1.95], Some([1.2, 2.9])),
        ([1.2, 1.6], Some([2.5, 1.9])),
        ([4.0, 1.2], Some([1.0, 2.0])),
        ([4.0, 2.3], Some([4.0, 1.0])),
    ];
    room(
        [0.0, 0.0, 5.0, 3.4],
        &walls,
        &[[0.4, 0.4], [4.4, 0.4]],
        &trips,
    )
}

#[test]
fn slices_change_nothing() {
    let scene = crowded();
    let world = start(&scene);
    for method in [Method::Restricted, Method::All] {
        let mut whole = HardConstraints::new(&scene, &settings(method, HardMode::Cached));
        let (found, counters) = work(&mut whole, &scene, &world, None, u64::MAX);
        assert!(found.new > 3, "{found:?}");
        for units in [1, 17, 1000] {
            let mut sliced = HardConstraints::new(&scene, &settings(method, HardMode::Cached));
            let outcome = work(&mut sliced, &scene, &world, None, units);
            assert_eq!(outcome, (found, counters), "{method} in slices of {units}");
            assert_eq!(listed(&sliced), listed(&whole));
        }
    }
}

#[test]
fn cached_and_literal_agree_and_literal_pays_again() {
    let scene = crowded();
    let mut world = start(&scene);
    let mut cached = HardConstraints::new(&scene, &settings(Method::All, HardMode::Cached));
    let mut literal = HardConstraints::new(&scene, &settings(Method::All, HardMode::Literal));
    let mut repeated = 0;
    for done in [None, Some(1), Some(0), Some(4)] {
        if let Some(task) = done {
            let goal = world.objects[task].goal;
            put(&mut world.objects[task], goal);
        }
        let (found, once) = work(&mut cached, &scene, &world, None, u64::MAX);
        let (again, every_time) = work(&mut literal, &scene, &world, None, u64::MAX);
        assert_eq!(found, again);
        assert_eq!(listed(&cached), listed(&literal));
        if done.is_some() {
            assert_eq!((once.path_plans, found.new), (0, 0));
            repeated += every_time.path_plans;
        }
    }
    assert!(repeated > 10, "{repeated}");
}

#[test]
fn one_task_at_a_time_finds_what_all_at_once_finds() {
    let scene = crowded();
    let world = start(&scene);
    for method in [Method::Restricted, Method::GraspingAndRestricted] {
        let mut all = HardConstraints::new(&scene, &settings(method, HardMode::Cached));
        let (found, _) = work(&mut all, &scene, &world, None, u64::MAX);
        let mut single = HardConstraints::new(&scene, &settings(method, HardMode::Cached));
        let mut new = 0;
        for task in 0..scene.objects.len() {
            new += work(&mut single, &scene, &world, Some(task), u64::MAX)
                .0
                .new;
        }
        assert_eq!((new, listed(&single)), (found.new, listed(&all)));
        // By now everything is known.
        let (found, counters) = work(&mut single, &scene, &world, Some(2), u64::MAX);
        assert_eq!((found, counters), (Found::default(), Counters::default()));
    }
}

#[test]
fn what_was_known_of_an_object_is_forgotten_when_it_moves() {
    let scene = shipped("h1");
    let mut world = start(&scene);
    let mut hard = HardConstraints::new(&scene, &settings(Method::Restricted, HardMode::Cached));
    work(&mut hard, &scene, &world, Some(1), u64::MAX);
    assert_eq!(listed(&hard), [(0, 1, H1)]);
    put(&mut world.objects[0], shm_types::Point::new(6.0, 2.0));
    let objects = &world.objects[..scene.objects.len()];
    let lost = hard.update(
        objects
            .iter()
            .map(|object| Places::of(object, object.status)),
    );
    assert!(lost);
    assert_eq!(listed(&hard), []);
}
