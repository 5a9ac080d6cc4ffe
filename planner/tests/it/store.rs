//! The store of explained constraints, on rooms that are each about one and on random ones.

use planner::{
    Constraint, Event, Floods, Kind, Leg, Placement, Places, Precedence, Reason, Store, Ways,
};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use scene::Scene;
use shm_types::ConstraintKind;

use crate::random::rooms;
use crate::room::{draft, room, scene_of, shipped};

use Event::{Finish, Grasp};

const PLENTY: u64 = 1_000_000;

fn store(scene: &Scene) -> Store {
    let store = Store::of(scene, PLENTY);
    assert!(store.is_complete());
    store
}

fn found(scene: &Scene) -> Vec<(Reason, String)> {
    let demand = |constraint: &Constraint| {
        let any_of = constraint.any_of.iter().map(ToString::to_string);
        any_of.collect::<Vec<_>>().join(" or ")
    };
    let store = store(scene);
    let constraints = store.constraints().iter();
    constraints
        .map(|found| (found.reason, demand(found)))
        .collect()
}

#[test]
fn each_shipped_room_about_one_constraint_has_that_one() {
    let cases = [
        ("e1", Reason::E1, "g0 < g1"),
        ("e2", Reason::E2, "g1 < f0"),
        ("e3", Reason::E3, "g0 < f1"),
        ("e4", Reason::E4, "f1 < f0"),
        ("h1", Reason::H1, "g0 < f1"),
        ("h2", Reason::H2, "g1 < f0"),
        ("blocked-approach", Reason::Approach, "g0 < g1"),
        ("blocked-return", Reason::Return, "f1 < f0"),
        ("joint-blockers", Reason::H1, "g0 < f2 or g1 < f2"),
    ];
    for (name, reason, demand) in cases {
        let found = found(&shipped(name));
        assert!(
            found.contains(&(reason, demand.to_owned())),
            "{name}: {found:?}"
        );
    }
}

#[test]
fn rooms_that_isolate_an_easy_constraint_have_no_hard_one_beside_it() {
    for name in ["e1", "e2", "e3", "e4", "h1", "h2", "joint-blockers"] {
        assert_eq!(
            found(&shipped(name)).len(),
            1,
            "{name}: {:?}",
            found(&shipped(name))
        );
    }
}

#[test]
fn a_leg_without_a_way_is_no_constraint() {
    let store = store(&shipped("unreachable-goal"));
    assert!(!store.impossible().is_empty());
    assert!(
        store
            .constraints()
            .iter()
            .all(|found| !found.blockers.is_empty())
    );
}

#[test]
fn clutter_has_to_be_taken_away_first() {
    // Clutter in the doorway between start and goal.
    let walls = [[2.0, 0.0, 2.2, 1.0], [2.0, 2.0, 2.2, 3.0]];
    let trips = [([1.0, 2.0], Some([3.5, 2.0])), ([2.1, 1.5], None)];
    let scene = room([0.0, 0.0, 4.5, 3.0], &walls, &[[0.5, 0.5]], &trips);
    assert_eq!(found(&scene), [(Reason::H1, "g1 < f0".to_owned())]);
}

#[test]
fn the_users_order_is_one_of_the_reasons() {
    let trips = [
        ([1.0, 2.0], Some([1.0, 3.0])),
        ([3.0, 2.0], Some([3.0, 3.0])),
    ];
    let mut draft = draft([0.0, 0.0, 4.0, 4.0], &[], &[[0.5, 0.5]], &trips);
    let order = |first, then| scene::UserOrder { first, then };
    draft.before = vec![
        order((0, scene::Event::Finish), (1, scene::Event::Start)),
        order((0, scene::Event::Start), (1, scene::Event::Finish)),
    ];
    assert_eq!(
        found(&scene_of(draft)),
        [(Reason::User, "f0 < g1".to_owned())]
    );
}

#[test]
fn what_assumed_a_change_is_forgotten() {
    let scene = shipped("blocked-approach");
    let whole = store(&scene);
    let mut moved = whole.clone();
    moved.forget_object(0);
    assert_eq!(
        (whole.constraints().len(), moved.constraints().len()),
        (1, 0)
    );
    let mut rehomed = whole.clone();
    rehomed.forget_homes();
    assert!(rehomed.constraints().is_empty());
    let mut kept = store(&shipped("h1"));
    kept.forget_homes();
    assert_eq!(kept.constraints().len(), 1);
}

#[test]
fn a_failure_teaches_the_part_of_it_that_matters() {
    let scene = shipped("joint-blockers");
    let at = |object, at_goal| Placement { object, at_goal };
    let mut store = store(&scene);
    let before = store.constraints().len();
    let mut ways = Ways::new(&scene, PLENTY);
    let start = [at(0, false), at(1, false)];
    assert_eq!(
        store.learn(&scene, &mut ways, Leg::Transfer(2), &start),
        None
    );
    assert_eq!(
        store.learn(&scene, &mut ways, Leg::Transfer(2), &start[..1]),
        None
    );
    assert_eq!(store.constraints().len(), before);
    // It is news to one that has not searched.
    let mut empty = Store::of(&scene, 0);
    let news = empty.learn(&scene, &mut ways, Leg::Transfer(2), &start);
    let (known, of_three) = (&store.constraints()[0], |found: &Constraint| {
        found.task == 2
    });
    assert!(of_three(known) && news == Some(known));
    assert_eq!(empty.constraints(), store.constraints());
    let removal = ways.removal(&scene, Leg::Transfer(2), &start).unwrap();
    assert_eq!(removal.placements, [at(1, false)]);
}

#[test]
fn without_searches_only_overlaps_are_known_and_it_says_so() {
    let store = Store::of(&shipped("joint-blockers"), 0);
    assert!(!store.is_complete() && store.constraints().is_empty());
    assert_eq!(Store::of(&shipped("e1"), 0).constraints().len(), 1);
}

/// Which single placements hinder the transfer of which task, by its easy or its hard test.
fn hard_edges(scene: &Scene) -> Vec<(bool, usize, usize)> {
    let store = store(scene);
    let mut edges = Vec::new();
    for found in store.constraints().iter().filter(|found| !found.is_joint()) {
        let is_transfer = !matches!(
            found.reason,
            Reason::Approach | Reason::Return | Reason::User
        );
        let blocker = found.blockers[0];
        let can_do = store
            .impossible()
            .iter()
            .all(|leg| leg.task() != found.task);
        if is_transfer
            && can_do
            && Places::at_start(scene)
                .nth(blocker.object)
                .flatten()
                .unwrap()
                .is_open()
        {
            edges.push((blocker.at_goal, blocker.object, found.task));
        }
    }
    edges.sort_unstable();
    edges.dedup();
    edges
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, max_global_rejects: 20_000, ..Default::default() })]

    #[test]
    fn a_cut_cuts_and_no_part_of_it_does(scene in rooms(7)) {
        let mut ways = Ways::new(&scene, PLENTY);
        for found in store(&scene).constraints() {
            let leg = match found.reason {
                Reason::Approach => Leg::Approach(found.task),
                Reason::Return => Leg::Return(found.task),
                Reason::H1 | Reason::H2 => Leg::Transfer(found.task),
                _ => continue,
            };
            prop_assert_eq!(ways.is_open(&scene, leg, &found.blockers), Some(false));
            for left_out in 0..found.blockers.len() {
                let mut part = found.blockers.clone();
                part.remove(left_out);
                prop_assert_eq!(ways.is_open(&scene, leg, &part), Some(true), "{:?}", found);
            }
            let removal = ways.removal(&scene, leg, &found.blockers).unwrap();
            prop_assert_eq!(removal.placements.len(), 1);
        }
    }

    #[test]
    fn single_blockers_are_those_that_floods_find(scene in rooms(6)) {
        let open = |places: Option<Places>| places.filter(Places::is_open);
        let floods = Floods::of(&scene, Places::at_start(&scene).map(open));
        let mut expected: Vec<_> = floods.constraints().iter().map(|found| {
            let (before, after) = (found.before as usize, found.after as usize);
            let at_goal = found.kind == ConstraintKind::H2.code();
            let (one, two) = if at_goal { (after, before) } else { (before, after) };
            (at_goal, one, two)
        }).collect();
        expected.sort_unstable();
        prop_assert_eq!(hard_edges(&scene), expected);
    }
}

/// Otherwise the tests above would compare little with nothing.
#[test]
fn random_rooms_have_constraints_of_all_kinds() {
    let mut runner = TestRunner::deterministic();
    let mut reasons = std::collections::BTreeMap::new();
    for _ in 0..800 {
        let scene = rooms(7).new_tree(&mut runner).unwrap().current();
        for found in store(&scene).constraints() {
            *reasons.entry((found.reason, found.is_joint())).or_insert(0) += 1;
        }
    }
    use Reason::{Approach, E1, E2, E3, E4, H1, H2, Return};
    for reason in [E1, E2, E3, E4, H1, H2, Approach, Return] {
        assert!(
            reasons.contains_key(&(reason, false)),
            "{reason:?}: {reasons:?}"
        );
    }
    // Joint blockers of approach and return are too rare here.
    for reason in [H1, H2] {
        assert!(
            reasons.contains_key(&(reason, true)),
            "{reason:?}: {reasons:?}"
        );
    }
}

#[test]
fn constraints_say_the_same_as_the_papers_tables() {
    for kind in [Kind::E1, Kind::E2, Kind::E3, Kind::E4] {
        let name = format!("{kind:?}").to_lowercase();
        let constraint = &store(&shipped(&name)).constraints()[0].clone();
        let Precedence { before, after } = constraint.precedence().unwrap();
        let one = constraint.blockers[0].object;
        assert_eq!(
            kind.precedence(one, constraint.task),
            Precedence { before, after }
        );
        assert!(matches!(
            (before, after),
            (Grasp(_) | Finish(_), Grasp(_) | Finish(_))
        ));
    }
}
