//! Proofs that a scene has no solution (rules 10 and 28), looked for before anything runs.
//!
//! Responsible for: cycles of E1 over initial places and of E4 over goals. What walls alone make
//! unreachable is found in crate `scene`.
//! Not responsible for: deciding solvability: that nothing is found proves nothing.
//!
//! Why a cycle is a proof: objects are not pushed, and what hinders one counts only if it can be
//! held in one way only. So an object that stands where another's robot must stand to grasp has to
//! be grasped first (E1), and one whose goal is where another's robot must stand to release has to
//! be released later (E4). Around a ring neither can be. That matters as soon as an object that is
//! not at its goal is in the ring, or waits for it.

use scene::{Budget, CONTACT_M, CycleKind, Infeasible, Scene};

use crate::easy;
use crate::kind::Kind;
use crate::places::Places;
use crate::priority::PriorityGraph;

/// Looks for a proof that `scene` has no solution.
#[must_use]
pub fn certificate(scene: &Scene) -> Option<Infeasible> {
    scene::certificate(scene)
        .or_else(|| ring(scene, CycleKind::Starts))
        .or_else(|| ring(scene, CycleKind::Goals))
}

/// A ring of objects, each in the way of the next, that condemns an object which has to move.
fn ring(scene: &Scene, kind: CycleKind) -> Option<Infeasible> {
    let graph = graph(scene, kind);
    let condemned = |object: &usize| has_to_move(scene, *object) && graph.is_unselectable(*object);
    let mut objects = (0..scene.objects.len()).filter(condemned);
    let first = objects.clone().next()?;
    let ring = objects.find_map(|object| shortest_ring(&graph, scene.objects.len(), object));
    // An object that only waits for a ring: the ring is somewhere before it.
    let objects = ring.unwrap_or_else(|| ring_before(&graph, scene.objects.len(), first));
    Some(Infeasible::Cycle { kind, objects })
}

/// The graph "is in the way of": of grasping at the start, or of releasing at the goal.
fn graph(scene: &Scene, kind: CycleKind) -> PriorityGraph {
    let count = scene.objects.len();
    let mut graph = PriorityGraph::new(count);
    let test = match kind {
        CycleKind::Starts => Kind::E1,
        CycleKind::Goals => Kind::E4,
    };
    let places: Vec<_> = (scene.objects.iter())
        .map(|object| match (kind, object.goal) {
            (CycleKind::Goals, None) => None,
            (_, goal) => Some(Places {
                initial: object.start,
                goal: goal.unwrap_or(object.start),
            }),
        })
        .collect();
    for object in 0..count {
        graph.add_task(object);
    }
    for one in 0..count {
        for two in 0..count {
            if one != two
                && scene.is_plain(two)
                && let (Some(first), Some(second)) = (places[one], places[two])
                && easy::holds(scene, test, (one, first), (two, second))
            {
                graph.add_edge(one, two);
            }
        }
    }
    graph.advance(&mut Budget::new(u64::MAX));
    graph
}

fn has_to_move(scene: &Scene, object: usize) -> bool {
    let spec = &scene.objects[object];
    spec.goal
        .is_some_and(|goal| (goal - spec.start).amax() > CONTACT_M)
}

/// The shortest ring through `object`, from its lowest member on; none if it is in none.
pub(crate) fn shortest_ring(
    graph: &PriorityGraph,
    count: usize,
    object: usize,
) -> Option<Vec<usize>> {
    let mut from = vec![None; count];
    let mut reached = vec![object];
    let mut next = 0;
    while from[object].is_none() {
        let here = *reached.get(next)?;
        next += 1;
        for after in (0..count).filter(|&after| graph.has_edge(here, after)) {
            if from[after].is_none() {
                from[after] = Some(here);
                reached.push(after);
            }
        }
    }
    let mut ring = vec![object];
    let mut here = from[object]?;
    while here != object {
        ring.push(here);
        here = from[here]?;
    }
    ring.reverse();
    let lowest = (0..ring.len()).min_by_key(|&i| ring[i])?;
    ring.rotate_left(lowest);
    Some(ring)
}

/// A ring that `object`, in none itself, waits for.
fn ring_before(graph: &PriorityGraph, count: usize, object: usize) -> Vec<usize> {
    let mut here = object;
    for _ in 0..count {
        let before = (0..count)
            .find(|&before| graph.is_unselectable(before) && graph.has_edge(before, here));
        here = before.unwrap_or(here);
    }
    // After as many steps as there are objects the walk goes round.
    shortest_ring(graph, count, here).unwrap_or_default()
}
