//! Selection: who takes what, case by case.

use planner::Selection;
use scene::{Budget, Method, Performance, Scene, Settings};
use shm_types::{Constraint, ConstraintKind, ConstraintTable, Counters, TaskStatus, WorldSnapshot};

use crate::room::{checked, no_constraints, room, scene_of, shipped, start};
use crate::rules::narrow;

pub(crate) fn settings(method: Method) -> Settings {
    Settings {
        method,
        ..Settings::default()
    }
}

/// Works a selection out in slices of `units`; the task of each robot.
pub(crate) fn select(
    selection: &mut Selection,
    scene: &Scene,
    world: &WorldSnapshot,
    table: &ConstraintTable,
    units: u64,
) -> (Vec<Option<usize>>, Counters) {
    let mut counters = Counters::default();
    selection.begin(checked(scene, world), table);
    loop {
        let mut budget = Budget::new(units);
        let outcome = selection.advance(scene, &mut budget, &mut counters);
        counters.units += budget.spent();
        if outcome.is_ready() {
            break;
        }
        assert_eq!(
            selection.task_of(0),
            None,
            "nothing is said before it is known"
        );
    }
    (
        (0..scene.homes.len())
            .map(|robot| selection.task_of(robot))
            .collect(),
        counters,
    )
}

fn select_once(scene: &Scene, world: &WorldSnapshot, settings: &Settings) -> Vec<Option<usize>> {
    let mut selection = Selection::new(scene, settings);
    select(&mut selection, scene, world, &no_constraints(), u64::MAX).0
}

pub(crate) fn table_of(edges: &[(usize, usize)]) -> Box<ConstraintTable> {
    let mut table = no_constraints();
    for (slot, (before, after)) in table.constraints.iter_mut().zip(edges) {
        *slot = Constraint {
            before: *before as u32,
            after: *after as u32,
            kind: ConstraintKind::H1.code(),
        };
    }
    table.count = edges.len() as u32;
    table
}

/// Marks a task's object as held by a robot since before the epoch.
pub(crate) fn hold(world: &mut WorldSnapshot, robot: usize, task: usize) {
    let held = TaskStatus::Held.code();
    world.objects[task].status = held;
    world.objects[task].epoch_status = held;
    world.objects[task].holder = robot as u32;
    world.robots[robot].holding = task as u32;
    world.robots[robot].epoch_free = 0;
}

#[test]
fn only_what_comes_first_is_taken() {
    for (name, first) in [("e1", 0), ("e2", 1), ("e3", 0), ("e4", 1)] {
        let scene = shipped(name);
        let world = start(&scene);
        for method in [Method::GraspingAndRestricted, Method::All] {
            let tasks = select_once(&scene, &world, &settings(method));
            let taken: Vec<_> = tasks.iter().flatten().copied().collect();
            assert_eq!(taken, [first], "{name}, {method}");
        }
        for method in [Method::Restricted, Method::NoAction] {
            let tasks = select_once(&scene, &world, &settings(method));
            assert!(
                tasks.iter().all(Option::is_some),
                "{name}, {method}: {tasks:?}"
            );
        }
    }
}

#[test]
fn hard_constraints_count_where_the_method_has_them() {
    let scene = shipped("h1");
    let world = start(&scene);
    let table = table_of(&[(0, 1)]);
    for (method, expected) in [
        (Method::GraspingAndRestricted, 1),
        (Method::Restricted, 1),
        (Method::All, 1),
        (Method::NoAction, 2),
    ] {
        let mut selection = Selection::new(&scene, &settings(method));
        let (tasks, _) = select(&mut selection, &scene, &world, &table, u64::MAX);
        assert_eq!(tasks.iter().flatten().count(), expected, "{method}");
        assert!(tasks.contains(&Some(0)));
    }
}

#[test]
fn all_waits_for_a_complete_table() {
    let scene = shipped("h1");
    let mut world = start(&scene);
    world.header.events = 3;
    let mut table = no_constraints();
    for (complete, method, expected) in [
        (u64::MAX, Method::All, false),
        (2, Method::All, false),
        (3, Method::All, true),
        (u64::MAX, Method::Restricted, true),
        (u64::MAX, Method::NoAction, true),
    ] {
        table.complete_for_events = complete;
        let selection = Selection::new(&scene, &settings(method));
        assert_eq!(
            selection.is_ready(checked(&scene, &world), &table),
            expected
        );
    }
}

#[test]
fn a_swap_is_a_cycle_and_nobody_takes_it() {
    let scene = shipped("swap");
    let world = start(&scene);
    let mut selection = Selection::new(&scene, &settings(Method::GraspingAndRestricted));
    let (tasks, counters) = select(&mut selection, &scene, &world, &no_constraints(), u64::MAX);
    assert_eq!(tasks, [None, None]);
    assert_eq!(selection.cycle(), [0, 1]);
    assert_eq!((counters.easy_constraints, counters.selections), (4, 1));
}

/// Four objects in an open room, far from each other, one robot near each.
fn open() -> Scene {
    let trips = [
        ([2.0, 2.0], Some([2.0, 5.0])),
        ([4.0, 2.0], Some([4.0, 5.0])),
        ([6.0, 2.0], Some([6.0, 5.0])),
        ([8.0, 2.0], Some([8.0, 5.0])),
    ];
    let homes = [[8.0, 0.5], [2.0, 0.5], [4.0, 0.5]];
    room([0.0, 0.0, 10.0, 7.0], &[], &homes, &trips)
}

#[test]
fn the_nearest_robot_gets_the_task() {
    let scene = open();
    let world = start(&scene);
    let tasks = select_once(&scene, &world, &settings(Method::GraspingAndRestricted));
    assert_eq!(tasks, [Some(3), Some(0), Some(1)]);
}

#[test]
fn by_transfer_alone_ties_go_to_the_lower_task_and_robot() {
    let scene = open();
    let world = start(&scene);
    let by_transfer = Settings {
        performance: Performance::Transfer,
        ..settings(Method::Restricted)
    };
    assert_eq!(
        select_once(&scene, &world, &by_transfer),
        [Some(0), Some(1), Some(2)]
    );
}

#[test]
fn priority_comes_before_performance() {
    let scene = open();
    let world = start(&scene);
    let mut selection = Selection::new(&scene, &settings(Method::Restricted));
    // Task 2, which nobody is nearest to, comes before two others; 3 before one. Robots 0 and 2
    // are equally far from 2, and robot 2 is farther from 3 than 0 was.
    let table = table_of(&[(2, 0), (2, 1), (3, 1)]);
    let (tasks, _) = select(&mut selection, &scene, &world, &table, u64::MAX);
    assert_eq!(tasks, [Some(2), None, Some(3)]);
}

#[test]
fn a_barred_task_goes_to_another_robot_or_to_none() {
    let scene = open();
    let mut world = start(&scene);
    world.objects[3].epoch_barred[0] = 1;
    let method = settings(Method::Restricted);
    assert_eq!(
        select_once(&scene, &world, &method),
        [Some(2), Some(0), Some(1)]
    );
    for object in &mut world.objects {
        object.epoch_barred[0] = 0b101;
    }
    assert_eq!(select_once(&scene, &world, &method), [None, Some(0), None]);
}

#[test]
fn held_tasks_stay_with_their_robots_and_block_until_they_are_done() {
    let scene = open();
    let mut world = start(&scene);
    hold(&mut world, 0, 0);
    let table = table_of(&[(0, 1), (2, 0), (3, 2)]);
    let mut selection = Selection::new(&scene, &settings(Method::Restricted));
    let (tasks, _) = select(&mut selection, &scene, &world, &table, u64::MAX);
    // 0 blocks 1; the edge from 2 into 0 counts for nothing; 3 blocks 2.
    assert_eq!(tasks, [None, None, Some(3)]);
    // Nor does an edge into a held task close a cycle (rule 9).
    let table = table_of(&[(0, 1), (1, 0)]);
    let (tasks, _) = select(&mut selection, &scene, &world, &table, u64::MAX);
    assert!(selection.cycle().is_empty());
    assert_eq!(tasks.iter().flatten().count(), 2);
}

#[test]
fn only_what_the_epoch_froze_is_read() {
    let scene = open();
    let mut world = start(&scene);
    let method = settings(Method::GraspingAndRestricted);
    let before = select_once(&scene, &world, &method);
    // Since the epoch opened robots have claimed, moved and grasped.
    for (robot, task) in [(0, 3), (1, 0), (2, 1)] {
        world.objects[task].status = TaskStatus::Held.code();
        world.objects[task].holder = robot as u32;
        world.objects[task].barred[0] = u64::MAX;
        world.objects[task].position.y += 1.0;
        world.robots[robot].holding = task as u32;
        world.robots[robot].task = task as u32;
        world.robots[robot].position.x += 0.3;
    }
    assert_eq!(select_once(&scene, &world, &method), before);
}

#[test]
fn the_users_own_order_counts_for_every_method() {
    let mut draft = open().draft().clone();
    draft.before = vec![scene::UserOrder {
        first: (1, scene::Event::Finish),
        then: (0, scene::Event::Grasp),
    }];
    let scene = scene_of(draft);
    for method in Method::PAPERS {
        let tasks = select_once(&scene, &start(&scene), &settings(method));
        assert!(
            tasks.contains(&Some(1)) && !tasks.contains(&Some(0)),
            "{method}: {tasks:?}"
        );
    }
}

#[test]
fn lengths_are_computed_once() {
    let scene = open();
    let mut world = start(&scene);
    let table = no_constraints();
    let mut selection = Selection::new(&scene, &settings(Method::NoAction));
    let (_, first) = select(&mut selection, &scene, &world, &table, u64::MAX);
    // A transfer and a field for each object.
    assert_eq!(first.path_plans, 8);
    world.robots[0].epoch_position.y += 0.5;
    let (_, second) = select(&mut selection, &scene, &world, &table, u64::MAX);
    assert_eq!((second.path_plans, second.cells_expanded), (0, 0));
    assert!(second.units < 20, "{second:?}");
    crate::room::put(&mut world.objects[2], shm_types::Point::new(6.0, 3.0));
    let (_, third) = select(&mut selection, &scene, &world, &table, u64::MAX);
    assert_eq!(third.path_plans, 2);
}

#[test]
fn slices_change_neither_outcome_nor_cost() {
    let scene = narrow();
    let world = start(&scene);
    let table = table_of(&[(3, 4)]);
    let mut whole = Selection::new(&scene, &settings(Method::GraspingAndRestricted));
    let expected = select(&mut whole, &scene, &world, &table, u64::MAX);
    assert!(expected.1.easy_constraints > 0);
    for units in [1, 7, 333] {
        let mut sliced = Selection::new(&scene, &settings(Method::GraspingAndRestricted));
        assert_eq!(select(&mut sliced, &scene, &world, &table, units), expected);
    }
}

/// The robot's own room has a far task; a near one lies behind a wall with a detour.
fn behind_a_wall(clutter: usize) -> Scene {
    let side = 60.0;
    let walls = [[10.0, 0.0, 10.2, 50.0]];
    let mut trips = vec![
        ([12.0, 5.0], Some([15.0, 5.0])),
        ([2.0, 15.0], Some([5.0, 15.0])),
    ];
    // Nothing without a goal is ever selected.
    trips.extend((0..clutter).map(|i| ([20.0 + (i % 20) as f64, 10.0 + (i / 20) as f64], None)));
    room([0.0, 0.0, side, side], &walls, &[[9.0, 5.0]], &trips)
}

#[test]
fn where_fields_would_not_fit_lengths_are_those_of_straight_lines() {
    let taken = |clutter: usize| {
        let scene = behind_a_wall(clutter);
        let points = scene.lattice.len() * scene.objects.len();
        let world = start(&scene);
        let settings = settings(Method::NoAction);
        (points > 1 << 24, select_once(&scene, &world, &settings))
    };
    assert_eq!(taken(0), (false, vec![Some(1)]));
    assert_eq!(taken(60), (true, vec![Some(0)]));
}
