//! Legs against path search, and how many floods they take.

use planner::{LegSearch, Legs, PathSearch, Places};
use proptest::prelude::*;
use scene::{Budget, ClassId, ROBOT_ALONE, Scene, Vec2};
use shm_types::Counters;

use crate::random::rooms;
use crate::room::{room, shipped};
use crate::search::run;

/// Seconds between two robot centres among the walls, by a search of its own.
fn path_s(scene: &Scene, class: ClassId, from: Vec2, to: Vec2) -> Option<f64> {
    let mut search = PathSearch::new(scene);
    search.occupancy().reset(scene, class);
    let (length_m, _) = run(
        &mut search,
        scene,
        from,
        to,
        u64::MAX,
        &mut Counters::default(),
    );
    Some(length_m? / scene.robot.speed_m_per_s)
}

fn agree(scene: &Scene, leg_s: Option<f64>, path_s: Option<f64>) -> bool {
    let pitch_s = scene.lattice.pitch_m / scene.robot.speed_m_per_s;
    match (leg_s, path_s) {
        (Some(leg_s), Some(path_s)) => (leg_s - path_s).abs() <= 3e-6 * path_s + 6e-3 * pitch_s,
        (leg_s, path_s) => leg_s == path_s,
    }
}

fn search(scene: &Scene, starts: &[Vec2], units: u64) -> (Legs, Counters) {
    let mut search = LegSearch::new(scene, Places::at_start(scene), starts);
    let mut counters = Counters::default();
    while search
        .advance(scene, &mut Budget::new(units), &mut counters)
        .is_pending()
    {}
    (search.legs().clone(), counters)
}

/// Compares every leg with a search of its own.
fn check(scene: &Scene, starts: &[Vec2], legs: &Legs) -> Result<(), String> {
    let place = |task: usize| (scene.objects[task].start, scene.objects[task].goal.unwrap());
    let grasp = |task: usize| scene.grasp_at(task, place(task).0);
    let release = |task: usize| scene.grasp_at(task, place(task).1);
    let same = |what: &str, leg_s, class, from, to| {
        let path_s = path_s(scene, class, from, to);
        let both = format!("{what}: {leg_s:?}, path {path_s:?}");
        agree(scene, leg_s, path_s).then_some(()).ok_or(both)
    };
    for &task in legs.tasks() {
        let class = scene.objects[task].class;
        same(
            "transfer",
            legs.transfer_s(task),
            class,
            grasp(task),
            release(task),
        )?;
        for (robot, &start) in starts.iter().enumerate() {
            let (alone, home) = (ROBOT_ALONE, scene.homes[robot]);
            same(
                "approach",
                legs.approach_s(robot, task),
                alone,
                start,
                grasp(task),
            )?;
            same("home", legs.home_s(task, robot), alone, release(task), home)?;
            same("between", legs.between_s(robot, robot), alone, start, home)?;
        }
        for &next in legs.tasks().iter().filter(|&&next| next != task) {
            same(
                "turn",
                legs.turn_s(task, next),
                ROBOT_ALONE,
                release(task),
                grasp(next),
            )?;
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, max_global_rejects: 20_000, ..Default::default() })]

    #[test]
    fn legs_are_lengths_of_paths(scene in rooms(4), units in 1_u64..2_000) {
        let (legs, _) = search(&scene, &scene.homes, u64::MAX);
        prop_assert_eq!(&legs, &search(&scene, &scene.homes, units).0);
        prop_assert_eq!(check(&scene, &scene.homes, &legs), Ok(()));
    }
}

#[test]
fn robots_may_start_elsewhere() {
    let scene = shipped("paper-17a");
    let mut starts = scene.homes.clone();
    starts[1] = scene.grasp_at(0, scene.objects[0].start);
    let (legs, counters) = search(&scene, &starts, u64::MAX);
    assert_eq!(check(&scene, &starts, &legs), Ok(()));
    assert_eq!(legs.approach_s(1, 0), Some(0.0));
    // Four homes, one start, five grasps, five transfers.
    assert_eq!((scene.homes.len(), counters.path_plans), (4, 15));
}

#[test]
fn what_is_no_task_has_no_legs() {
    let trips = [
        ([1.0, 2.0], Some([3.0, 2.0])),
        ([2.0, 1.0], Some([2.0, 1.0])),
        ([3.0, 1.0], None),
    ];
    let scene = room([0.0, 0.0, 5.0, 3.0], &[], &[[0.5, 0.5]], &trips);
    let (legs, counters) = search(&scene, &scene.homes, u64::MAX);
    assert_eq!(legs.tasks(), [0]);
    assert_eq!(legs.transfer_s(0), Some(4.0));
    assert_eq!((legs.transfer_s(1), legs.transfer_s(2)), (None, None));
    // One home, one grasp and one transfer.
    assert_eq!(counters.path_plans, 3);
}

#[test]
fn a_wall_across_the_room_leaves_some_legs_only() {
    let trips = [
        ([1.0, 2.0], Some([1.5, 1.0])),
        ([4.0, 2.0], Some([1.0, 1.5])),
    ];
    let walls = [[2.4, 0.0, 2.6, 3.0]];
    let scene = room([0.0, 0.0, 5.0, 3.0], &walls, &[[0.5, 0.5]], &trips);
    let legs = Legs::of(&scene);
    assert!(legs.approach_s(0, 0).is_some() && legs.approach_s(0, 1).is_none());
    assert!(legs.transfer_s(0).is_some() && legs.transfer_s(1).is_none());
    assert!(legs.turn_s(1, 0).is_some() && legs.turn_s(0, 1).is_none());
    assert_eq!(legs.least_approach_s(1), None);
}

#[test]
fn the_least_way_is_that_of_the_nearest_robot() {
    let homes = [[0.5, 0.5], [4.5, 0.5]];
    let trips = [([3.0, 2.0], Some([1.0, 2.0]))];
    let legs = Legs::of(&room([0.0, 0.0, 5.0, 3.0], &[], &homes, &trips));
    let least = |legs: [Option<f64>; 2]| legs[0].unwrap().min(legs[1].unwrap());
    let approach_s = [0, 1].map(|robot| legs.approach_s(robot, 0));
    let home_s = [0, 1].map(|robot| legs.home_s(0, robot));
    // The grasp is nearer to the one home, the release to the other.
    assert!(approach_s[1] < approach_s[0] && home_s[0] < home_s[1]);
    assert_eq!(legs.least_approach_s(0), Some(least(approach_s)));
    assert_eq!(legs.least_home_s(0), Some(least(home_s)));
}
