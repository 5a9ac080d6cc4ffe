//! Proofs of infeasibility.

use planner::certificate;
use scene::{CycleKind, Infeasible, Scene};

use crate::room::{Trip, draft, scene_of, shipped};

fn ring(kind: CycleKind, objects: &[usize]) -> Option<Infeasible> {
    Some(Infeasible::Cycle {
        kind,
        objects: objects.to_vec(),
    })
}

#[test]
fn shipped_rings_are_found() {
    let starts = certificate(&shipped("infeasible-e1-cycle"));
    assert_eq!(starts, ring(CycleKind::Starts, &[0, 1]));
    let goals = certificate(&shipped("infeasible-e4-cycle"));
    assert_eq!(goals, ring(CycleKind::Goals, &[0, 1]));
    let unreachable = certificate(&shipped("unreachable-goal"));
    assert!(
        matches!(unreachable, Some(Infeasible::Transfer { .. })),
        "{unreachable:?}"
    );
}

#[test]
fn nothing_is_claimed_of_what_can_be_solved() {
    for name in [
        "e1",
        "e2",
        "e3",
        "e4",
        "h1",
        "h2",
        "swap",
        "joint-blockers",
        "lift-from-below",
    ] {
        assert_eq!(certificate(&shipped(name)), None, "{name}");
    }
}

/// Two objects in each other's grasp, one above the other, that stay or have to move; then
/// others. The lower one is grasped from above.
fn facing(moves: bool, others: &[Trip]) -> Scene {
    let x = if moves { 4.0 } else { 2.0 };
    let mut trips = vec![([2.0, 2.0], Some([x, 2.0])), ([2.0, 1.4], Some([x, 0.8]))];
    if !moves {
        trips[1].1 = Some([2.0, 1.4]);
    }
    trips.extend_from_slice(others);
    let mut draft = draft([0.0, 0.0, 6.0, 3.4], &[], &[[0.4, 0.4]], &trips);
    draft.objects[1].grasp = [0.0, 0.45];
    scene_of(draft)
}

#[test]
fn a_ring_that_nobody_has_to_move_proves_nothing() {
    assert_eq!(
        certificate(&facing(true, &[])),
        ring(CycleKind::Starts, &[0, 1])
    );
    assert_eq!(certificate(&facing(false, &[])), None);
    let elsewhere = ([3.5, 2.5], Some([3.5, 1.5]));
    assert_eq!(certificate(&facing(false, &[elsewhere])), None);
}

#[test]
fn a_ring_at_its_goal_condemns_what_waits_for_it() {
    // Object 2 can be grasped only once object 0 is gone.
    let waits = ([2.0, 2.6], Some([5.0, 2.6]));
    assert_eq!(
        certificate(&facing(false, &[waits])),
        ring(CycleKind::Starts, &[0, 1])
    );
}

#[test]
fn clutter_in_a_ring_counts() {
    let mut draft = facing(true, &[]).draft().clone();
    draft.objects[0].goal = None;
    assert_eq!(
        certificate(&scene_of(draft)),
        ring(CycleKind::Starts, &[0, 1])
    );
}

/// Two kinds, one of each object of the ring: every goal is filled already, by another one of its
/// kind, which is to go to where that one stands.
#[test]
fn what_may_be_exchanged_proves_nothing() {
    let mut draft = shipped("infeasible-e4-cycle").draft().clone();
    let mates: Vec<_> = (draft.objects.iter_mut().zip(["one", "other"]))
        .map(|(object, kind)| {
            object.kind = Some(kind.to_owned());
            let mut mate = object.clone();
            mate.start = object.goal.unwrap();
            mate.goal = Some(object.start);
            mate
        })
        .collect();
    draft.objects.extend(mates);
    assert_eq!(certificate(&scene_of(draft)), None);
}
