//! Priorities: the paper's example, exactness, cycles, and the definition word for word.

use std::collections::BTreeSet;

use planner::{Priority, PriorityGraph};
use proptest::prelude::*;
use scene::Budget;

fn solved(tasks: usize, edges: &[(usize, usize)]) -> PriorityGraph {
    let mut graph = PriorityGraph::new(tasks);
    for task in 0..tasks {
        graph.add_task(task);
    }
    for &(before, after) in edges {
        graph.add_edge(before, after);
    }
    assert!(graph.advance(&mut Budget::new(u64::MAX)));
    graph
}

fn values(graph: &PriorityGraph, tasks: usize) -> Vec<u64> {
    (0..tasks)
        .map(|task| u64::try_from(graph.priority(task)).unwrap())
        .collect()
}

#[test]
fn figure_5() {
    // Tasks 1, 2, 3 of the figure are 0, 1, 2 here.
    let graph = solved(3, &[(2, 0), (2, 1), (1, 0)]);
    assert_eq!(values(&graph, 3), [0, 1, 3]);
    assert!(graph.cycle().is_empty());
    assert!(graph.is_blocked(0) && graph.is_blocked(1) && !graph.is_blocked(2));
}

#[test]
fn parallel_edges_are_merged() {
    let graph = solved(2, &[(0, 1), (0, 1)]);
    assert_eq!(values(&graph, 2), [1, 0]);
}

#[test]
fn a_total_order_of_1024_tasks_is_exact() {
    let mut graph = PriorityGraph::new(1024);
    for task in 0..1024 {
        graph.add_task(task);
    }
    for before in 0..1024 {
        for after in before + 1..1024 {
            graph.add_edge(before, after);
        }
    }
    assert!(graph.advance(&mut Budget::new(u64::MAX)));
    for task in 0..1024 {
        let expected = (Priority::ONE << (1023 - task)) - Priority::ONE;
        assert_eq!(*graph.priority(task), expected, "task {task}");
    }
}

#[test]
fn what_lies_on_or_behind_a_cycle_is_a_sink() {
    // 1 → 2 → 3 → 1, 3 → 4 behind it, 0 → 1 in front of it, 5 on its own.
    let graph = solved(6, &[(1, 2), (2, 3), (3, 1), (3, 4), (0, 1), (0, 4)]);
    assert_eq!(values(&graph, 6), [2, 0, 0, 0, 0, 0]);
    let unselectable: Vec<_> = (0..6).filter(|&t| graph.is_unselectable(t)).collect();
    assert_eq!(unselectable, [1, 2, 3, 4]);
    assert_eq!(graph.cycle(), [1, 2, 3]);
}

#[test]
fn the_cycle_reported_is_one_even_when_the_walk_starts_behind_it() {
    let graph = solved(4, &[(3, 2), (2, 3), (2, 0), (0, 1)]);
    assert_eq!(graph.cycle(), [2, 3]);
    assert!(graph.is_unselectable(0) && graph.is_unselectable(1));
}

#[test]
fn a_graph_can_be_used_again() {
    let mut graph = solved(3, &[(0, 1), (1, 0)]);
    graph.clear();
    graph.add_task(0);
    graph.add_task(2);
    assert!(!graph.add_edge(0, 1), "1 is no node any more");
    assert!(graph.add_edge(0, 2));
    assert!(graph.advance(&mut Budget::new(u64::MAX)));
    assert_eq!(values(&graph, 3), [1, 0, 0]);
    assert!(graph.cycle().is_empty());
    assert!(!graph.is_unselectable(1));
}

/// Rule 14 word for word, with numbers of any size.
fn by_definition(
    task: usize,
    edges: &BTreeSet<(usize, usize)>,
    known: &mut Vec<Option<Vec<bool>>>,
) -> Vec<bool> {
    if let Some(value) = &known[task] {
        return value.clone();
    }
    let mut sum = Vec::new();
    for &(_, after) in edges.iter().filter(|(before, _)| *before == task) {
        let value = by_definition(after, edges, known);
        sum = add(&add(&sum, &value), &[true]);
    }
    known[task] = Some(sum.clone());
    sum
}

/// Binary addition, lowest bit first.
fn add(a: &[bool], b: &[bool]) -> Vec<bool> {
    let mut carry = false;
    let mut sum = Vec::new();
    for i in 0..a.len().max(b.len()) {
        let ones = [a.get(i), b.get(i), Some(&carry)];
        let ones = ones.iter().filter(|x| **x == Some(&true)).count();
        sum.push(ones % 2 == 1);
        carry = ones >= 2;
    }
    if carry {
        sum.push(true);
    }
    sum
}

proptest! {
    #[test]
    fn priorities_are_those_of_the_definition(
        pairs in proptest::collection::btree_set((0_usize..90, 0_usize..90), 0..1500),
        budget in 1_u64..50,
    ) {
        // Any set of pairs is a graph without cycles once each edge points upwards.
        let edges: BTreeSet<_> = pairs
            .into_iter()
            .filter(|(a, b)| a != b)
            .map(|(a, b)| (a.min(b), a.max(b)))
            .collect();
        let mut graph = PriorityGraph::new(90);
        for task in 0..90 {
            graph.add_task(task);
        }
        for &(before, after) in &edges {
            prop_assert!(graph.add_edge(before, after));
        }
        while !graph.advance(&mut Budget::new(budget)) {}
        let mut known = vec![None; 90];
        for task in 0..90 {
            let value = by_definition(task, &edges, &mut known);
            let mut expected = Priority::ZERO;
            for (i, set) in value.iter().enumerate() {
                expected.set_bit(i, *set);
            }
            prop_assert_eq!(*graph.priority(task), expected);
        }
    }

    #[test]
    fn unselectable_is_exactly_what_a_cycle_reaches(
        edges in proptest::collection::vec((0_usize..8, 0_usize..8), 0..16),
    ) {
        let graph = solved(8, &edges);
        let mut reach = [[false; 8]; 8];
        for &(a, b) in &edges {
            reach[a][b] |= a != b;
        }
        for k in 0..8 {
            for i in 0..8 {
                for j in 0..8 {
                    reach[i][j] |= reach[i][k] && reach[k][j];
                }
            }
        }
        for task in 0..8 {
            let expected = (0..8).any(|c| reach[c][c] && (c == task || reach[c][task]));
            prop_assert_eq!(graph.is_unselectable(task), expected);
        }
        let cycle = graph.cycle();
        prop_assert_eq!(cycle.is_empty(), (0..8).all(|c| !reach[c][c]));
        for (i, &task) in cycle.iter().enumerate() {
            prop_assert!(graph.has_edge(task, cycle[(i + 1) % cycle.len()]));
        }
    }
}
