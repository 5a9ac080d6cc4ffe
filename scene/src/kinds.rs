//! Which of several interchangeable objects goes to which of their goals, as a run begins.
//!
//! Responsible for: the assignment of least total distance, with the walls alone.
//! Not responsible for: other assignments (planner and world exchange goals while a run goes on).
//!
//! Terms: objects of one *kind* may stand at any of the goals that objects of the kind state.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::assignment::assignment;
use crate::cspace::Occupancy;
use crate::geometry::Vec2;
use crate::scene::Scene;

/// What a goal costs that cannot be reached, m: more than any way.
const UNREACHED_M: f64 = 1e9;
/// Lengths are compared as whole micrometres.
const UM_PER_M: f64 = 1e6;

/// Gives the goals of each kind to its objects: as many go to a goal as there are goals.
pub(crate) fn assign(scene: &mut Scene) {
    let kinds = scene.objects.iter().filter_map(|object| object.kind);
    let count = kinds.max().map_or(0, |last| last + 1);
    for kind in 0..count {
        let of_kind = |object: &usize| scene.objects[*object].kind == Some(kind);
        let members: Vec<usize> = (0..scene.objects.len()).filter(of_kind).collect();
        let stated = members.iter().map(|&object| scene.objects[object].goal);
        // Goals, and as many columns as objects are left over.
        let mut goals: Vec<Option<Vec2>> = stated.collect();
        goals.sort_by_key(Option::is_none);
        let rows: Vec<Vec<f64>> = (members.iter())
            .map(|&object| lengths(scene, object, &goals))
            .collect();
        let cost = |row: usize, column: usize| rows[row][column];
        let Some(row_of) = assignment(members.len(), &cost) else {
            continue;
        };
        for (goal, row) in goals.into_iter().zip(row_of) {
            scene.objects[members[row]].goal = goal;
        }
    }
}

/// From an object's start to each goal, carried by its first grasp, m; 0 to none.
fn lengths(scene: &Scene, object: usize, goals: &[Option<Vec2>]) -> Vec<f64> {
    let spec = &scene.objects[object];
    let mut space = Occupancy::new(scene);
    space.reset(scene, spec.class);
    let mut best = vec![u64::MAX; scene.lattice.len()];
    let mut open = BinaryHeap::new();
    let from = joined(scene, &space, spec.start + spec.grasp);
    for &cell in &from {
        best[cell as usize] = 0;
        open.push((Reverse(0), cell));
    }
    while let Some((Reverse(gone), cell)) = open.pop() {
        if gone > best[cell as usize] {
            continue;
        }
        space.for_each_step(cell, |next, length_m| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a step is far below 2^53 µm"
            )]
            let there = gone + (length_m * UM_PER_M) as u64;
            if there < best[next as usize] {
                best[next as usize] = there;
                open.push((Reverse(there), next));
            }
        });
    }
    let length_m = |goal: Vec2| {
        if goal == spec.start {
            return 0.0;
        }
        let ends = joined(scene, &space, goal + spec.grasp);
        let least = ends.iter().map(|&cell| best[cell as usize]).min();
        match least {
            Some(least) if least < u64::MAX => least as f64 / UM_PER_M,
            _ => UNREACHED_M,
        }
    };
    let lengths = goals.iter().map(|goal| goal.map_or(0.0, length_m));
    lengths.collect()
}

/// The free lattice points at a place, or around it.
fn joined(scene: &Scene, space: &Occupancy, at: Vec2) -> Vec<u32> {
    let mut cells: Vec<u32> = match scene.lattice.cell(at) {
        Some(cell) => vec![cell],
        None => scene.lattice.around(at).collect(),
    };
    cells.retain(|&cell| space.is_free(cell));
    cells
}
