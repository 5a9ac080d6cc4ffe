//! Distances from one configuration to all others: Dijkstra's flood over the lattice.
//!
//! Responsible for: one flood, resumable within a budget, and reading distances out of it.
//! Not responsible for: what is an obstacle (`obstacles`); which floods are worth keeping
//! (`lengths`).
//!
//! Terms: distances are in metres, exact in the path's corners off the lattice and within
//! 2·10⁻⁶ of the length over lattice points.

use std::task::Poll;

use scene::{Budget, Occupancy, Scene, Vec2};
use shm_types::Counters;

use crate::frontier::{Frontier, NOWHERE, STRAIGHT};
use crate::joints::{Joints, are_close};
use crate::search::{STEP_COSTS, fresh_after};

/// A resumable flood with its buffers. Block what stands in the way with
/// [`DistanceField::occupancy`], then [`DistanceField::begin`], then [`DistanceField::advance`]
/// until it is ready.
#[derive(Clone, Debug)]
pub struct DistanceField {
    occupancy: Occupancy,
    frontier: Frontier,
    joints: Joints,
    from: Vec2,
    counted: bool,
}

impl DistanceField {
    /// A field in `scene`; all memory it will ever use is allocated here.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        Self {
            occupancy: Occupancy::new(scene),
            frontier: Frontier::new(scene.lattice.len()),
            joints: Joints::new(),
            from: Vec2::zeros(),
            counted: true,
        }
    }

    /// What the next flood may not touch.
    pub fn occupancy(&mut self) -> &mut Occupancy {
        &mut self.occupancy
    }

    /// Begins a flood from a robot centre, m, against the occupancy as it is.
    pub fn begin(&mut self, scene: &Scene, from: Vec2) {
        self.from = from;
        self.counted = false;
        self.frontier.begin();
        self.joints.find(scene, &self.occupancy, from);
        for joint in self.joints.list() {
            self.frontier
                .offer(joint.cell, NOWHERE, joint.cost, u8::MAX, || 0);
        }
    }

    /// Goes on within `budget`; ready when every point that can be reached has its distance.
    pub fn advance(&mut self, budget: &mut Budget, counters: &mut Counters) -> Poll<()> {
        if !self.counted {
            self.counted = true;
            counters.path_plans += 1;
        }
        while !budget.is_spent() {
            let Some((cell, cost, fresh)) = self.frontier.take() else {
                return Poll::Ready(());
            };
            budget.spend(1);
            counters.cells_expanded += 1;
            let offsets = self.occupancy.offsets();
            let free = self.occupancy.steps(cell);
            let mut steps = free & fresh;
            while steps != 0 {
                let direction = steps.trailing_zeros() as usize;
                steps &= steps - 1;
                let next = cell.wrapping_add_signed(offsets[direction]);
                let fresh = fresh_after(direction, free);
                self.frontier
                    .offer(next, cell, cost + STEP_COSTS[direction], fresh, || 0);
            }
        }
        if self.frontier.is_empty() {
            Poll::Ready(())
        } else {
            Poll::Pending
        }
    }

    /// Distance to a robot centre, m; none where no path leads.
    #[must_use]
    pub fn distance(&mut self, scene: &Scene, to: Vec2) -> Option<f64> {
        let Self {
            occupancy,
            frontier,
            joints,
            from,
            ..
        } = self;
        joined_distance(scene, occupancy, joints, *from, to, |cell| {
            frontier.cost(cell)
        })
    }

    /// Keeps the flood's distances for [`DistanceField::kept_distance`]: of each lattice point
    /// the path cost plus one, 0 where no path leads.
    pub(crate) fn keep(&self, costs: &mut [u32]) {
        for (cell, cost) in costs.iter_mut().enumerate() {
            *cost = self.frontier.cost(cell as u32).map_or(0, |cost| cost + 1);
        }
    }

    /// As [`DistanceField::distance`], from a flood that began at `from` and was kept. The
    /// occupancy has to be that of the flood.
    pub(crate) fn kept_distance(
        &mut self,
        scene: &Scene,
        costs: &[u32],
        from: Vec2,
        to: Vec2,
    ) -> Option<f64> {
        joined_distance(scene, &self.occupancy, &mut self.joints, from, to, |cell| {
            costs[cell as usize].checked_sub(1)
        })
    }
}

/// Distance between two configurations, of which `cost` knows the lattice points' path costs
/// from the first.
fn joined_distance(
    scene: &Scene,
    occupancy: &Occupancy,
    joints: &mut Joints,
    from: Vec2,
    to: Vec2,
    cost: impl Fn(u32) -> Option<u32>,
) -> Option<f64> {
    let pitch_m = scene.lattice.pitch_m;
    if let Some(cell) = scene.lattice.cell(to)
        && let Some(cost) = cost(cell)
    {
        return Some(f64::from(cost) / f64::from(STRAIGHT) * pitch_m);
    }
    if are_close(pitch_m, from, to) && occupancy.straight_is_free(scene, from, to) {
        return Some((to - from).norm());
    }
    joints.find(scene, occupancy, to);
    let costs = joints
        .list()
        .iter()
        .filter_map(|joint| Some(cost(joint.cell)? + joint.cost));
    Some(f64::from(costs.min()?) / f64::from(STRAIGHT) * pitch_m)
}
