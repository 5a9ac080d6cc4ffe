//! Bounds of whole scenes.

use planner::{BoundLimits, Bounds, Yardstick};

use crate::room::{draft, room, scene_of, shipped};

fn bounds(scene: &scene::Scene) -> Bounds {
    Bounds::of(scene, BoundLimits::default()).unwrap()
}

#[test]
fn one_task_in_a_straight_line_is_bounded_exactly() {
    let trips = [([1.0, 2.45], Some([1.0, 4.45]))];
    let mut draft = draft([0.0, 0.0, 2.0, 6.0], &[], &[[1.0, 1.0]], &trips);
    draft.robot.grasp_s = 1.0;
    draft.robot.release_s = 0.5;
    let bounds = bounds(&scene_of(draft));
    // 1 m to the grasp, 2 m of transfer, 3 m home at 0.5 m/s, 1.5 s of gripping.
    let exact_s = 6.0 / 0.5 + 1.5;
    for bound_s in [
        bounds.longest_task_s,
        bounds.critical_path_s,
        bounds.best_s(),
        bounds.r_s().unwrap(),
    ] {
        assert!((bound_s - exact_s).abs() < 1e-3, "{bounds:?}");
    }
    // To (b) the robot may stay at home, and the way from the release be back to the grasp.
    let shared_s = 4.0 / 0.5 + 1.5;
    assert!((bounds.shared_s - shared_s).abs() < 1e-3, "{bounds:?}");
}

#[test]
fn a_swap_of_two_objects_has_bounds_but_takes_two_robots_to_move_each_once() {
    let two = bounds(&shipped("swap"));
    assert!(two.r_s().is_some_and(|r_s| r_s >= two.best_s()));
    let one = bounds(&shipped("swap").with_robots(1).unwrap());
    assert_eq!(one.yardstick, Yardstick::Impossible);
    assert!(one.best_s() >= two.best_s());
}

#[test]
fn chains_of_constraints_make_a_path_longer_than_any_task() {
    // Goals one above the other, so close that the robot stands on the goal below (E4): the
    // uppermost object comes first, and each release takes a second.
    let trips = [
        ([0.8, 1.0], Some([2.0, 2.1])),
        ([2.0, 1.0], Some([2.0, 2.55])),
        ([3.2, 1.0], Some([2.0, 3.0])),
    ];
    let mut draft = draft([0.0, 0.0, 4.0, 4.0], &[], &[[2.0, 0.25]], &trips);
    draft.robot.release_s = 1.0;
    let bounds = bounds(&scene_of(draft));
    // Object 2 takes longest; objects 1 and 0 are released after it, and the way home from the
    // release of 0 is 0.9 m shorter than from that of 2.
    let after_s = 2.0 - 0.9 / 0.5;
    assert!(
        (bounds.critical_path_s - bounds.longest_task_s - after_s).abs() < 1e-3,
        "{bounds:?}"
    );
}

#[test]
fn where_there_is_nothing_to_bound_there_are_none() {
    let nothing = room(
        [0.0, 0.0, 2.0, 2.0],
        &[],
        &[[0.5, 0.5]],
        &[([1.0, 1.5], None)],
    );
    let too_small = BoundLimits {
        points: 1,
        ..BoundLimits::default()
    };
    assert_eq!(Bounds::of(&nothing, BoundLimits::default()), None);
    assert_eq!(Bounds::of(&shipped("e1"), too_small), None);
    for name in [
        "unreachable-goal",
        "infeasible-e1-cycle",
        "infeasible-e4-cycle",
    ] {
        assert_eq!(
            Bounds::of(&shipped(name), BoundLimits::default()),
            None,
            "{name}"
        );
    }
}

/// From each home, and from each grasp to what follows: three floods for each way of holding.
#[test]
fn where_objects_can_be_held_in_several_ways_each_of_them_is_paid_for() {
    let trips = [
        ([1.0, 1.5], Some([3.0, 1.5])),
        ([1.0, 3.0], Some([3.0, 3.0])),
    ];
    let mut draft = draft([0.0, 0.0, 4.0, 4.0], &[], &[[2.0, 0.5]], &trips);
    for object in &mut draft.objects {
        object.other_grasps = vec![[0.45, 0.0]];
    }
    let scene = scene_of(draft);
    let limited = |floods: usize| {
        let points = floods * scene.lattice.len();
        Bounds::of(
            &scene,
            BoundLimits {
                points,
                ..BoundLimits::default()
            },
        )
    };
    let floods = 1 + 3 * (2 + 2);
    assert!(limited(floods).is_some());
    assert_eq!(limited(floods - 1), None);
}
