//! Rings of constraints: among tasks (rule 13) and among events (rule 27).
//!
//! Responsible for: finding one through each object concerned, the shortest first.
//! Not responsible for: what follows (`proof`).
//!
//! A ring of tasks stops methods that complete one task before they select the next. A ring of
//! events stops everybody: each event would have to come before itself.

use crate::certificate::shortest_ring;
use crate::event::{Event, Precedence};
use crate::priority::PriorityGraph;
use scene::Budget;

/// Rings of tasks, each from its lowest member on; every task that is in a ring is in one of
/// these. `tasks` is the number of objects.
#[must_use]
pub fn task_rings(tasks: usize, orders: &[Precedence]) -> Vec<Vec<usize>> {
    let edges = orders
        .iter()
        .map(|order| (order.before.task(), order.after.task()));
    let graph = graph(tasks, edges);
    let mut rings: Vec<Vec<usize>> = Vec::new();
    for task in (0..tasks).filter(|&task| graph.is_unselectable(task)) {
        if !rings.iter().flatten().any(|&known| known == task) {
            rings.extend(shortest_ring(&graph, tasks, task));
        }
    }
    rings
}

/// The shortest ring of events through the first event that is in one: each of these comes before
/// the next, and the last before the first. That an object is grasped before it is put down counts
/// as well. None if there is no ring.
#[must_use]
pub fn event_ring(tasks: usize, orders: &[Precedence]) -> Option<Vec<Event>> {
    let number = |event: Event| match event {
        Event::Grasp(task) => 2 * task,
        Event::Finish(task) => 2 * task + 1,
    };
    let own = (0..tasks).map(|task| (2 * task, 2 * task + 1));
    let stated = orders
        .iter()
        .map(|order| (number(order.before), number(order.after)));
    let graph = graph(2 * tasks, own.chain(stated));
    let mut events = (0..2 * tasks).filter(|&event| graph.is_unselectable(event));
    let ring = events.find_map(|event| shortest_ring(&graph, 2 * tasks, event))?;
    let event = |number: usize| {
        if number.is_multiple_of(2) {
            Event::Grasp(number / 2)
        } else {
            Event::Finish(number / 2)
        }
    };
    Some(ring.into_iter().map(event).collect())
}

fn graph(nodes: usize, edges: impl Iterator<Item = (usize, usize)>) -> PriorityGraph {
    let mut graph = PriorityGraph::new(nodes);
    for node in 0..nodes {
        graph.add_task(node);
    }
    for (before, after) in edges {
        graph.add_edge(before, after);
    }
    graph.advance(&mut Budget::new(u64::MAX));
    graph
}

#[cfg(test)]
mod tests {
    use super::*;
    use Event::{Finish, Grasp};

    fn order(before: Event, after: Event) -> Precedence {
        Precedence { before, after }
    }

    #[test]
    fn a_swap_is_a_ring_of_tasks_and_none_of_events() {
        let swap = [order(Grasp(0), Finish(2)), order(Grasp(2), Finish(0))];
        assert_eq!(task_rings(3, &swap), [[0, 2]]);
        assert_eq!(event_ring(3, &swap), None);
    }

    #[test]
    fn grasping_before_putting_down_is_part_of_a_ring() {
        let orders = [order(Finish(0), Grasp(1)), order(Finish(1), Finish(0))];
        let ring = event_ring(2, &orders).unwrap();
        assert_eq!(ring, [Finish(0), Grasp(1), Finish(1)]);
    }

    #[test]
    fn what_only_waits_for_a_ring_is_in_none() {
        let orders = [
            order(Grasp(0), Grasp(1)),
            order(Grasp(1), Grasp(0)),
            order(Grasp(1), Grasp(2)),
        ];
        assert_eq!(task_rings(3, &orders), [[0, 1]]);
        assert_eq!(event_ring(3, &orders), Some(vec![Grasp(0), Grasp(1)]));
    }
}
