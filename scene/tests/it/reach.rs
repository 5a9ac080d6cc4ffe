//! What walls alone make impossible (rule 10), and in which words.

use scene::{CycleKind, Draft, Infeasible, ObjectDraft, Scene, WallDraft, certificate};

/// Two rooms side by side without a doorway: 0 to 3 m and 3.2 to 6 m.
fn cut_in_two(start: [f64; 2], goal: [f64; 2]) -> Draft {
    let mut draft = Draft::room("two", [0.0, 0.0, 6.0, 3.0]);
    draft.walls = vec![WallDraft::Box([3.0, 0.0, 3.2, 3.0])];
    draft.homes = vec![[0.5, 0.5]];
    draft.objects = vec![ObjectDraft::paper(start, Some(goal))];
    draft
}

fn found(draft: Draft) -> Option<Infeasible> {
    certificate(&Scene::new(draft).unwrap())
}

#[test]
fn a_task_out_of_reach_is_proved_infeasible_in_each_way() {
    let (object, exact) = (0, true);
    let near = [1.5, 2.0];
    let far = [4.5, 2.0];
    assert_eq!(found(cut_in_two(near, [2.0, 2.0])), None);
    assert_eq!(
        found(cut_in_two(far, near)),
        Some(Infeasible::Approach { object, exact })
    );
    assert_eq!(
        found(cut_in_two(near, far)),
        Some(Infeasible::Transfer { object, exact })
    );
    // The object closes the doorway it is carried through, with its robot on the wrong side.
    let mut draft = cut_in_two(near, [4.5, 2.0]);
    draft.bounds = [0.0, 0.0, 3.0, 4.0];
    draft.walls = vec![
        WallDraft::Box([0.0, 2.0, 1.0, 2.2]),
        WallDraft::Box([1.5, 2.0, 3.0, 2.2]),
    ];
    draft.homes = vec![[0.5, 3.5]];
    draft.objects = vec![ObjectDraft::paper([1.25, 3.2], Some([1.25, 2.1]))];
    assert_eq!(found(draft), Some(Infeasible::Return { object, exact }));
}

#[test]
fn one_robot_that_can_is_enough_and_objects_at_their_goals_need_none() {
    let far = [4.5, 2.0];
    let mut draft = cut_in_two(far, [5.0, 1.5]);
    draft.homes.push([5.5, 0.5]);
    assert_eq!(found(draft), None);
    assert_eq!(found(cut_in_two(far, far)), None);
    let mut draft = cut_in_two(far, far);
    draft.objects[0].goal = None;
    assert_eq!(found(draft), None);
}

#[test]
fn an_object_in_the_way_of_its_own_grasp_is_seen_unless_lifted_from_below() {
    // A dead end just wide enough for the object, which must be grasped from its inner side.
    let mut draft = Draft::room("dead end", [0.0, 0.0, 6.0, 3.0]);
    draft.walls = vec![
        WallDraft::Box([2.0, 0.0, 6.0, 1.0]),
        WallDraft::Box([2.0, 1.5, 6.0, 3.0]),
    ];
    draft.homes = vec![[0.5, 0.5]];
    let goal = Some([1.0, 2.0]);
    draft.objects = vec![ObjectDraft {
        grasp: [0.45, 0.0],
        ..ObjectDraft::paper([3.0, 1.25], goal)
    }];
    let approach = Infeasible::Approach {
        object: 0,
        exact: true,
    };
    assert_eq!(found(draft.clone()), Some(approach));
    draft.objects[0].grasp = [0.0, 0.0];
    assert_eq!(found(draft), None);
}

#[test]
fn off_an_exact_lattice_the_words_are_more_careful() {
    let mut draft = cut_in_two([1.5, 2.0], [4.5, 2.0]);
    draft.homes = vec![[0.503, 0.5]];
    let said = found(draft).unwrap().to_string();
    assert!(said.ends_with("at this resolution"), "{said}");
}

#[test]
fn a_cycle_is_told_as_a_ring() {
    let objects = vec![3, 1, 2];
    let kind = CycleKind::Starts;
    let said = Infeasible::Cycle { kind, objects }.to_string();
    assert!(
        said.ends_with("stands in the way of grasping the next: 3 → 1 → 2 → 3"),
        "{said}"
    );
}
