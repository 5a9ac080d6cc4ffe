//! Selection against rule 17 word for word, in random situations.

use std::collections::BTreeSet;

use planner::{DistanceField, PathSearch, Priority, Selection};
use proptest::prelude::*;
use scene::{Budget, Method, ROBOT_ALONE, Scene, vec};
use shm_types::{ConstraintTable, Counters, TaskStatus, WorldSnapshot};

use crate::easy::easy_of;
use crate::room::{room, start};
use crate::search::run;
use crate::selection::{hold, select, settings, table_of};

/// A room with a wall in it, six objects, three robots.
pub(crate) fn narrow() -> Scene {
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
        for method in Method::PAPERS {
            let mut robots = [(); 3].map(|()| Selection::new(&scene, &settings(method)));
            for (epoch, situation) in situations.iter().enumerate() {
                let world = situation.world(&scene);
                let edges: Vec<_> = situation.edges.iter().copied().collect();
                let table = table_of(&edges);
                let expected = by_definition(&scene, &world, &table, method);
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
