//! The user's own order of events: does it name tasks that exist, and can it be kept?
//!
//! Responsible for: unknown tasks, and lines that contradict one another or the order of events
//! within a task (rule 5), naming the cycle.
//! Not responsible for: keeping the order in a run (crate `planner`).

use crate::draft::{Draft, Event, UserOrder};
use crate::problem::{Key, Problem};

/// Event of a task as a node.
type Node = (usize, Event);

/// Checks the user's order.
pub(crate) fn check_orders(draft: &Draft, problems: &mut Vec<Problem>) {
    let mut sound = true;
    for (i, order) in draft.before.iter().enumerate() {
        for (field, (task, _)) in [("first", order.first), ("then", order.then)] {
            let key = Key::Before(i, field);
            let message = match draft.objects.get(task) {
                None => {
                    format!("there is no task {task}: tasks are numbered as their objects, from 0")
                }
                Some(object) if object.goal.is_none() => {
                    format!("object {task} has no goal, so there is no task {task}")
                }
                Some(object) if object.kind.is_some() => {
                    format!("object {task} is one of a kind, any of which may be the one that goes")
                }
                Some(_) => continue,
            };
            problems.push(Problem::new(key, message));
            sound = false;
        }
    }
    if sound && let Some(cycle) = find_cycle(&draft.before) {
        problems.push(contradiction(&draft.before, &cycle));
    }
}

/// What must come after an event: by the user's lines, and within its task.
fn after(orders: &[UserOrder], (task, event): Node) -> impl Iterator<Item = Node> {
    let own = match event {
        Event::Start => Some((task, Event::Grasp)),
        Event::Grasp => Some((task, Event::Finish)),
        Event::Finish => None,
    };
    let stated = orders
        .iter()
        .filter(move |order| order.first == (task, event))
        .map(|order| order.then);
    stated.chain(own)
}

/// A cycle of events, each before the next and the last before the first.
fn find_cycle(orders: &[UserOrder]) -> Option<Vec<Node>> {
    let mut done: Vec<Node> = Vec::new();
    for order in orders {
        // Depth first: the path so far, each with what is still to be tried after it.
        let mut path = vec![order.first];
        let mut to_try: Vec<Vec<Node>> = vec![after(orders, order.first).collect()];
        while let Some(next) = to_try.last_mut() {
            let Some(node) = next.pop() else {
                to_try.pop();
                done.extend(path.pop());
                continue;
            };
            if let Some(start) = path.iter().position(|seen| *seen == node) {
                return Some(path.split_off(start));
            }
            if !done.contains(&node) {
                path.push(node);
                to_try.push(after(orders, node).collect());
            }
        }
    }
    None
}

fn contradiction(orders: &[UserOrder], cycle: &[Node]) -> Problem {
    let words: Vec<_> = cycle
        .iter()
        .chain(cycle.first())
        .map(|(task, event)| format!("{task}.{event}"))
        .collect();
    let in_cycle = |order: &UserOrder| {
        (0..cycle.len())
            .any(|i| order.first == cycle[i] && order.then == cycle[(i + 1) % cycle.len()])
    };
    let mut lines = orders
        .iter()
        .enumerate()
        .filter(|(_, order)| in_cycle(order))
        .map(|(i, _)| Key::Before(i, "first"));
    // A cycle takes at least one stated line: events of one task have no cycle of their own.
    let first = lines.next().unwrap_or(Key::Before(0, "first"));
    let message = format!("the order contradicts itself: {}", words.join(" before "));
    lines.fold(Problem::new(first, message), Problem::also)
}
