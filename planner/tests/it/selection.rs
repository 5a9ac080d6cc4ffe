//! Selection against rule 17 word for word, and its special cases.

use std::collections::BTreeSet;

use planner::{DistanceField, PathSearch, Priority, Selection};
use proptest::prelude::*;
use scene::{Budget, Method, Performance, ROBOT_ALONE, Scene, Settings, vec};
use shm_types::{Constraint, ConstraintKind, ConstraintTable, Counters, TaskStatus, WorldSnapshot};

use crate::easy::easy_of;
use crate::room::{checked, no_constraints, room, scene_of, shipped, start};
use crate::search::run;

fn settings(method: Method) -> Settings {
    Settings {
        method,
        ..Settings::default()
    }
}

/// Works a selection out in slices of `units`; the task of each robot.
fn select(
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

fn table_of(edges: &[(usize, usize)]) -> Box<ConstraintTable> {
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
fn hold(world: &mut WorldSnapshot, robot: usize, task: usize) {
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
    for method in Method::ALL {
        let tasks = select_once(&scene, &start(&scene), &settings(*method));
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

/// A room with a wall in it, six objects, three robots.
fn narrow() -> Scene {
    let trips = [
        ([1.0, 1.5], Some([4.0, 2.0])),
        ([1.0, 2.0], Some([4.0, 2.5])),
        ([1.7, 2.8], Some([1.0, 2.9])),
        ([4.0, 1.2], Some([1.0, 1.0])),
        ([4.4, 2.6], Some([3.2, 2.9])),
        ([3.4, 1.8], None),
    ];
    let walls = [[2.4, 0.0, 2.6, 0.8], [2.4, 2.3, 2.6, 3.4]];
    room(
        [0.0, 0.0, 5.0, 3.4],
        &walls,
        &[[0.4, 0.4], [4.5, 0.4], [1.6, 0.4]],
        &trips,
    )
}

#[derive(Clone, Debug)]
struct Situation {
    edges: BTreeSet<(usize, usize)>,
    done: Vec<bool>,
    held: Option<usize>,
    barred: Vec<u64>,
    places: Vec<(u32, u32)>,
}

fn situation() -> impl Strategy<Value = Situation> {
    (
        proptest::collection::btree_set((0_usize..5, 0_usize..5), 0..5),
        proptest::collection::vec(prop::bool::weighted(0.2), 5),
        prop_oneof![2 => Just(None), 1 => (0_usize..5).prop_map(Some)],
        proptest::collection::vec(prop_oneof![3 => Just(0_u64), 1 => 0_u64..8], 5),
        proptest::collection::vec((0_u32..10, 0_u32..6), 3),
    )
        .prop_map(|(edges, done, held, barred, places)| Situation {
            edges: edges.into_iter().filter(|(a, b)| a != b).collect(),
            done,
            held,
            barred,
            places,
        })
}

impl Situation {
    fn world(&self, scene: &Scene) -> Box<WorldSnapshot> {
        let mut world = start(scene);
        for task in 0..5 {
            world.objects[task].epoch_barred[0] = self.barred[task];
            if self.done[task] {
                let goal = world.objects[task].goal;
                crate::room::put(&mut world.objects[task], goal);
            }
        }
        for (robot, (x, y)) in self.places.iter().enumerate() {
            let place = &mut world.robots[robot].epoch_position;
            place.x += f64::from(*x) * 0.02;
            place.y += f64::from(*y) * 0.05;
        }
        if let Some(task) = self.held.filter(|task| !self.done[*task]) {
            hold(&mut world, 1, task);
        }
        world
    }
}

/// Rule 17 word for word, slowly.
fn by_definition(
    scene: &Scene,
    world: &WorldSnapshot,
    table: &ConstraintTable,
    method: Method,
) -> Vec<Option<usize>> {
    let tasks = scene.objects.len();
    let status = |task: usize| TaskStatus::decode(world.objects[task].epoch_status).unwrap();
    let open = |task: usize| world.objects[task].has_goal == 1 && status(task) != TaskStatus::Done;
    let mut edges = BTreeSet::new();
    if method != Method::NoAction {
        let hard = table.constraints().iter();
        edges.extend(hard.map(|c| (c.before as usize, c.after as usize)));
    }
    if method.uses_easy() {
        edges.extend(
            easy_of(scene, world)
                .into_iter()
                .map(|(_, before, after)| (before, after)),
        );
    }
    edges.retain(|&(before, after)| {
        open(before) && open(after) && status(after) != TaskStatus::Held
    });
    let behind_cycle = behind_cycle(&edges, tasks);
    let mut free: Vec<_> = (0..scene.homes.len())
        .filter(|&robot| world.robots[robot].epoch_free == 1)
        .collect();
    let mut taken = vec![None; scene.homes.len()];
    loop {
        let mut best: Option<((Priority, f64), usize, usize)> = None;
        for task in (0..tasks).filter(|&task| open(task) && status(task) != TaskStatus::Held) {
            let blocked = edges.iter().any(|&(_, after)| after == task);
            if blocked || behind_cycle[task] || taken.contains(&Some(task)) {
                continue;
            }
            let value = priority(task, &edges, &behind_cycle);
            for &robot in &free {
                if world.objects[task].was_barred(robot) {
                    continue;
                }
                let performance = 1.0 / length(scene, world, task, robot);
                let better = best.is_none_or(|((most, fastest), ..)| {
                    value > most || value == most && performance > fastest
                });
                if better {
                    best = Some(((value, performance), task, robot));
                }
            }
        }
        let Some((_, task, robot)) = best else {
            return taken;
        };
        taken[robot] = Some(task);
        free.retain(|&other| other != robot);
    }
}

fn behind_cycle(edges: &BTreeSet<(usize, usize)>, tasks: usize) -> Vec<bool> {
    let mut reach = vec![vec![false; tasks]; tasks];
    for &(a, b) in edges {
        reach[a][b] = true;
    }
    for k in 0..tasks {
        for i in 0..tasks {
            for j in 0..tasks {
                reach[i][j] |= reach[i][k] && reach[k][j];
            }
        }
    }
    (0..tasks)
        .map(|t| (0..tasks).any(|c| reach[c][c] && (c == t || reach[c][t])))
        .collect()
}

fn priority(task: usize, edges: &BTreeSet<(usize, usize)>, sinks: &[bool]) -> Priority {
    if sinks[task] {
        return Priority::ZERO;
    }
    let after = edges.iter().filter(|(before, _)| *before == task);
    after
        .map(|&(_, after)| Priority::ONE + priority(after, edges, sinks))
        .sum()
}

fn length(scene: &Scene, world: &WorldSnapshot, task: usize, robot: usize) -> f64 {
    let grasp = scene.grasp_at(task, vec(world.objects[task].rest));
    let release = scene.grasp_at(task, vec(world.objects[task].goal));
    let mut counters = Counters::default();
    let mut search = PathSearch::new(scene);
    search.occupancy().reset(scene, scene.objects[task].class);
    let (transfer, _) = run(&mut search, scene, grasp, release, u64::MAX, &mut counters);
    let mut field = DistanceField::new(scene);
    field.occupancy().reset(scene, ROBOT_ALONE);
    field.begin(scene, grasp);
    while field
        .advance(&mut Budget::new(u64::MAX), &mut counters)
        .is_pending()
    {}
    let transit = field.distance(scene, vec(world.robots[robot].epoch_position));
    transit.unwrap() + transfer.unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn selection_is_that_of_the_rules_and_the_same_for_every_robot(
        situations in proptest::collection::vec(situation(), 1..4),
        units in [1_u64..3, 5..50, 100..5000],
    ) {
        let scene = narrow();
        // Each robot has a selection of its own, is as fast as it is, and has seen other epochs.
        for method in Method::ALL {
            let mut robots = [(); 3].map(|()| Selection::new(&scene, &settings(*method)));
            for (epoch, situation) in situations.iter().enumerate() {
                let world = situation.world(&scene);
                let edges: Vec<_> = situation.edges.iter().copied().collect();
                let table = table_of(&edges);
                let expected = by_definition(&scene, &world, &table, *method);
                for (robot, selection) in robots.iter_mut().enumerate() {
                    if robot + epoch == 2 {
                        continue; // This one has slept through the epoch.
                    }
                    let (tasks, _) =
                        select(selection, &scene, &world, &table, units[robot]);
                    prop_assert_eq!(&tasks, &expected, "{}, robot {}", method, robot);
                    let claimed: BTreeSet<_> = tasks.iter().flatten().collect();
                    prop_assert_eq!(claimed.len(), tasks.iter().flatten().count());
                }
            }
        }
    }
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
