//! Proofs and repairs of whole scenes.

use planner::{Event, Proof, Repair, Store};
use scene::Scene;

use crate::room::{room, scene_of, shipped};

const PLENTY: u64 = 100_000;

fn proof(scene: &Scene) -> Option<Proof> {
    Proof::of(scene, &Store::of(scene, PLENTY))
}

#[test]
fn rooms_with_a_certificate_have_no_proof_against_them() {
    for builtin in scene::BUILTIN {
        let scene = shipped(builtin.name);
        let is_bad = builtin.name.starts_with("infeasible") || builtin.name == "unreachable-goal";
        assert_eq!(proof(&scene).is_some(), is_bad, "{}", builtin.name);
    }
    for seed in 0..40 {
        let options = scene::GenerateOptions {
            seed,
            objects: 6,
            crowding: 0.9,
            extra_moves: (seed % 2 * 6) as usize,
            ..scene::GenerateOptions::default()
        };
        let Ok(generated) = scene::generate(&options) else {
            continue;
        };
        assert_eq!(proof(&generated.scene), None, "seed {seed}");
    }
}

/// A corridor closed by object 0, with object 1 behind it, and a user who wants that one first.
#[test]
fn an_approach_and_the_users_order_make_a_ring() {
    let mut draft = crate::room::draft(
        [0.0, 0.0, 6.0, 0.5],
        &[],
        &[[0.25, 0.25]],
        &[
            ([2.0, 0.25], Some([3.0, 0.25])),
            ([4.0, 0.25], Some([5.0, 0.25])),
        ],
    );
    for object in &mut draft.objects {
        object.grasp = [-0.45, 0.0];
    }
    let scene = scene_of(draft.clone());
    assert_eq!(proof(&scene), None);
    // The user wants the one behind first.
    draft.before = vec![scene::UserOrder {
        first: (1, scene::Event::Finish),
        then: (0, scene::Event::Grasp),
    }];
    let scene = scene_of(draft);
    let ring = vec![Event::Grasp(0), Event::Grasp(1), Event::Finish(1)];
    assert_eq!(proof(&scene), Some(Proof::Ring(ring)));
    let repair = Repair::of(&scene, PLENTY).unwrap();
    assert_eq!((repair.take_away.len(), repair.deliver.len()), (1, 1));
}

#[test]
fn an_e1_ring_is_repaired_by_taking_one_away_and_by_no_giving_up_of_one() {
    let repair = Repair::of(&shipped("infeasible-e1-cycle"), PLENTY).unwrap();
    assert_eq!(repair.take_away, [0]);
    // Neither can be grasped while the other is there.
    assert_eq!(repair.deliver, [0; 0]);
    assert!(repair.is_exact);
    let goals = Repair::of(&shipped("infeasible-e4-cycle"), PLENTY).unwrap();
    assert_eq!((goals.take_away.len(), goals.deliver.len()), (1, 1));
}

#[test]
fn walls_are_no_objects_goals_can_be_given_up() {
    let scene = room(
        [0.0, 0.0, 5.0, 3.0],
        &[[2.4, 0.0, 2.6, 3.0]],
        &[[0.5, 0.5]],
        &[
            ([1.0, 2.0], Some([4.0, 2.0])),
            ([1.5, 1.0], Some([1.0, 1.5])),
        ],
    );
    let repair = Repair::of(&scene, PLENTY).unwrap();
    assert_eq!((repair.take_away, repair.deliver), (vec![0], vec![1]));
}

/// What the user says of objects is about the same ones when those before them are gone.
#[test]
fn the_users_lines_are_kept_when_other_objects_are_taken_away() {
    let trips = [
        ([1.0, 1.5], Some([4.0, 1.0])),
        ([1.0, 2.0], Some([4.0, 2.0])),
        ([2.5, 2.5], Some([4.0, 3.0])),
    ];
    let mut draft = crate::room::draft([0.0, 0.0, 5.0, 3.4], &[], &[[0.4, 0.4]], &trips);
    // Object 0 stands where a robot has to stand that grasps object 1.
    draft.before = [0, 2]
        .map(|then| scene::UserOrder {
            first: (1, scene::Event::Finish),
            then: (then, scene::Event::Grasp),
        })
        .to_vec();
    let scene = scene_of(draft);
    assert!(matches!(proof(&scene), Some(Proof::Ring(_))));
    // Without object 0 there is still a line about the other two, and no ring.
    let repair = Repair::of(&scene, PLENTY).unwrap();
    assert_eq!(repair.take_away, [0]);
}
