//! How long ways are that something is chosen for, with the walls alone.
//!
//! Responsible for: ways from place to place, ways of objects that are carried by one grasp, and of
//! those that may change from grasp to grasp.
//! Not responsible for: what is chosen, and what follows for bounds (the parent module).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use scene::{Budget, ClassId, Occupancy, Scene, Vec2};
use shm_types::Counters;

use crate::bounds::choices::Group;
use crate::field::DistanceField;

/// Distances with the walls alone.
pub(super) struct Floods<'a> {
    scene: &'a Scene,
    field: DistanceField,
}

impl<'a> Floods<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        Self {
            scene,
            field: DistanceField::new(scene),
        }
    }

    /// From each of some places to each of others, as a body of this class.
    pub(super) fn all_s(&mut self, from: &[Vec2], class: ClassId, to: &[Vec2]) -> Vec<f64> {
        let speed_m_per_s = self.scene.robot.speed_m_per_s;
        let mut all = Vec::with_capacity(from.len() * to.len());
        for &from in from {
            self.field.occupancy().reset(self.scene, class);
            self.field.begin(self.scene, from);
            let mut budget = Budget::new(u64::MAX);
            let mut counters = Counters::default();
            while self.field.advance(&mut budget, &mut counters).is_pending() {}
            for &to in to {
                let length_m = self.field.distance(self.scene, to);
                all.push(length_m.map_or(f64::INFINITY, |length_m| length_m / speed_m_per_s));
            }
        }
        all
    }

    pub(super) fn carried_s(&mut self, group: &Group) -> Vec<f64> {
        let by_grasp: Vec<Vec<f64>> = group
            .grasps
            .iter()
            .map(|&(offset, class)| {
                let at = |places: &[Vec2]| -> Vec<Vec2> {
                    places.iter().map(|place| place + offset).collect()
                };
                self.all_s(&at(&group.starts), class, &at(&group.goals))
            })
            .collect();
        let pairs = 0..group.objects.len() * group.goals.len();
        pairs
            .flat_map(|pair| by_grasp.iter().map(move |table| table[pair]))
            .collect()
    }

    /// The shortest way of the object itself, held by any grasp at any time. Where the lattice does
    /// not have all that takes, the straight line, which no way is shorter than.
    pub(super) fn moved_s(&self, group: &Group) -> Vec<f64> {
        if group.grasps.len() == 1 {
            return group.carried_s.clone();
        }
        let speed_m_per_s = self.scene.robot.speed_m_per_s;
        let ends = || group.starts.iter().chain(&group.goals);
        let is_on_lattice =
            |offset: &Vec2| ends().all(|place| self.scene.lattice.cell(place + offset).is_some());
        if !group.grasps.iter().all(|(offset, _)| is_on_lattice(offset)) {
            let straight_m = group
                .starts
                .iter()
                .flat_map(|start| group.goals.iter().map(move |goal| (goal - start).norm()));
            return straight_m
                .map(|length_m| length_m / speed_m_per_s)
                .collect();
        }
        let spaces: Vec<Occupancy> = group
            .grasps
            .iter()
            .map(|&(_, class)| {
                let mut space = Occupancy::new(self.scene);
                space.reset(self.scene, class);
                space
            })
            .collect();
        let moved_m = (group.starts.iter()).flat_map(|start| self.flood(group, &spaces, *start));
        moved_m.map(|length_m| length_m / speed_m_per_s).collect()
    }

    /// From a start to each goal, m.
    fn flood(&self, group: &Group, spaces: &[Occupancy], start: Vec2) -> Vec<f64> {
        let lattice = &self.scene.lattice;
        let size = lattice.len();
        let mut best_m = vec![f64::INFINITY; size * spaces.len()];
        let mut open = BinaryHeap::new();
        let node = |place: Vec2, by: usize| {
            let cell = lattice.cell(place + group.grasps[by].0);
            let cell = cell.filter(|&cell| spaces[by].is_free(cell));
            cell.map(|cell| by * size + cell as usize)
        };
        for by in 0..spaces.len() {
            if let Some(node) = node(start, by) {
                best_m[node] = 0.0;
                open.push((Reverse(0), node));
            }
        }
        // Lengths are no less than 0: their bits are in the same order.
        while let Some((Reverse(bits), at)) = open.pop() {
            let gone_m = f64::from_bits(bits);
            if gone_m > best_m[at] {
                continue;
            }
            let (by, cell) = (at / size, (at % size) as u32);
            let mut offer = |node: usize, length_m: f64| {
                if length_m < best_m[node] {
                    best_m[node] = length_m;
                    open.push((Reverse(length_m.to_bits()), node));
                }
            };
            spaces[by].for_each_step(cell, |next, step_m| {
                offer(by * size + next as usize, gone_m + step_m);
            });
            let place = lattice.at(cell) - group.grasps[by].0;
            for other in (0..spaces.len()).filter(|other| *other != by) {
                if let Some(node) = node(place, other) {
                    offer(node, gone_m);
                }
            }
        }
        let at_goal = |goal: &Vec2| {
            let ends = (0..spaces.len()).filter_map(|by| node(*goal, by));
            ends.fold(f64::INFINITY, |least_m, node| least_m.min(best_m[node]))
        };
        group.goals.iter().map(at_goal).collect()
    }
}
