//! All hard constraints at once, against one path plan a test.

use planner::{FloodWork, Floods, HardConstraints, Places};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use scene::{Budget, HardMode, Method, Scene, Settings};
use shm_types::{Constraint, ConstraintKind, Counters};

use crate::random::rooms;
use crate::room::shipped;

fn places(scene: &Scene) -> impl Iterator<Item = Option<Places>> + '_ {
    scene.objects.iter().map(|object| {
        Some(Places {
            initial: object.start,
            goal: object.goal?,
        })
    })
}

/// One plan a test.
fn plain(scene: &Scene, method: Method) -> Vec<Constraint> {
    let settings = Settings {
        method,
        hard: HardMode::Cached,
        ..Settings::default()
    };
    let mut hard = HardConstraints::new(scene, &settings);
    hard.update(places(scene));
    hard.begin_all();
    let mut counters = Counters::default();
    while hard
        .advance(scene, &mut Budget::new(u64::MAX), &mut counters)
        .is_pending()
    {}
    let mut found = Vec::new();
    hard.for_each(|constraint| found.push(constraint));
    found
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, max_global_rejects: 20_000, ..Default::default() })]

    #[test]
    fn floods_find_what_plans_find(scene in rooms(6)) {
        let floods = Floods::of(&scene, places(&scene));
        prop_assert_eq!(floods.constraints(), plain(&scene, Method::Restricted));
    }
}

/// Otherwise the test above would compare little with nothing.
#[test]
fn random_rooms_have_constraints_of_both_kinds_and_ask_for_floods() {
    let mut runner = TestRunner::deterministic();
    let (mut kinds, mut exact, mut work) = ([0, 0], 0, FloodWork::default());
    for _ in 0..100 {
        let scene = rooms(6).new_tree(&mut runner).unwrap().current();
        let found = Floods::of(&scene, places(&scene));
        for constraint in found.constraints() {
            kinds[usize::from(constraint.kind == ConstraintKind::H2.code())] += 1;
        }
        exact += u32::from(scene.lattice.exact);
        work.placements += found.work().placements;
        work.floods += found.work().floods;
    }
    assert!(kinds.iter().all(|count| *count >= 20), "{kinds:?}");
    assert!((20..80).contains(&exact), "{exact}");
    assert!(
        work.floods >= 50 && work.placements >= 2 * work.floods,
        "{work:?}"
    );
}

#[test]
fn what_easy_constraints_say_already_is_among_them() {
    for name in [
        "paper-17a",
        "paper-41a",
        "paper-68b",
        "h1",
        "h2",
        "e1",
        "e2",
        "unreachable-goal",
    ] {
        let scene = shipped(name);
        let all = Floods::of(&scene, places(&scene));
        assert_eq!(
            all.constraints(),
            plain(&scene, Method::Restricted),
            "{name}"
        );
        let beyond_easy = plain(&scene, Method::All);
        let has = |constraint| all.constraints().contains(constraint);
        assert!(beyond_easy.iter().all(has), "{name}");
    }
}

#[test]
fn finished_tasks_take_no_part() {
    let scene = shipped("h1");
    let open = Floods::of(&scene, places(&scene));
    assert_eq!((open.constraints().len(), open.work().tests), (1, 4));
    let one_done = Floods::of(&scene, [None].into_iter().chain(places(&scene).skip(1)));
    assert_eq!(
        (one_done.constraints().len(), one_done.work().tests),
        (0, 0)
    );
}
