//! A* of the `pathfinding` crate on the same lattice, steps and costs as `planner::PathSearch`.

use pathfinding::directed::astar::astar;
use scene::{Connectivity, Occupancy, Scene};

/// Costs of `planner`'s path search: a convergent of √2.
const STRAIGHT: u32 = 408;
const DIAGONAL: u32 = 577;

/// Cost of the shortest path between two lattice points, in 408ths of the pitch; none if there is
/// none. Cells are `u32`, the heuristic is the octile distance.
#[must_use]
pub fn cost(scene: &Scene, space: &Occupancy, from: u32, to: u32) -> Option<u32> {
    let width = scene.lattice.width;
    let (to_x, to_y) = (to % width, to / width);
    let heuristic = |cell: &u32| {
        let (dx, dy) = ((cell % width).abs_diff(to_x), (cell / width).abs_diff(to_y));
        match scene.lattice.connectivity {
            Connectivity::Four => (dx + dy) * STRAIGHT,
            Connectivity::Eight => dx.max(dy) * STRAIGHT + dx.min(dy) * (DIAGONAL - STRAIGHT),
        }
    };
    let offsets = space.offsets();
    let successors = |cell: &u32| {
        let (cell, steps) = (*cell, space.steps(*cell));
        (0..8_usize)
            .filter(move |direction| steps >> direction & 1 == 1)
            .map(move |direction| {
                let cost = if direction < 4 { STRAIGHT } else { DIAGONAL };
                (cell.wrapping_add_signed(offsets[direction]), cost)
            })
    };
    let found = astar(&from, successors, heuristic, |cell| *cell == to);
    found.map(|(_, cost)| cost)
}
