//! How a configuration off the lattice is tied to it, exactly (rule 8).
//!
//! Responsible for: finding the free straight pieces between a configuration and the lattice
//! points around it.
//! Not responsible for: searching.

use scene::{Occupancy, Scene, Vec2};

use crate::frontier::{DIAGONAL, STRAIGHT};

/// Most joints of one configuration.
const MAX_JOINTS: usize = 16;

/// A straight piece between a configuration and a lattice point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Joint {
    pub(crate) cell: u32,
    /// Length of the piece as a path cost.
    pub(crate) cost: u32,
    /// Length of the piece, m.
    pub(crate) length_m: f64,
}

/// The joints of one configuration.
#[derive(Clone, Debug)]
pub(crate) struct Joints {
    list: Vec<Joint>,
    on_lattice: bool,
}

impl Joints {
    pub(crate) fn new() -> Self {
        Self {
            list: Vec::with_capacity(MAX_JOINTS),
            on_lattice: false,
        }
    }

    /// Ties `at` to the lattice. A configuration on the lattice is its own only joint; one that
    /// is not free has none.
    pub(crate) fn find(&mut self, scene: &Scene, occupancy: &Occupancy, at: Vec2) {
        self.list.clear();
        let lattice = &scene.lattice;
        let own = lattice.cell(at);
        self.on_lattice = own.is_some();
        if let Some(cell) = own {
            if occupancy.is_free(cell) {
                self.list.push(Joint {
                    cell,
                    cost: 0,
                    length_m: 0.0,
                });
            }
            return;
        }
        if !occupancy.at_is_free(scene, at) {
            return;
        }
        for cell in lattice.around(at) {
            let end = lattice.at(cell);
            if self.list.len() < MAX_JOINTS
                && occupancy.is_free(cell)
                && occupancy.straight_is_free(scene, at, end)
            {
                let length_m = (end - at).norm();
                self.list.push(Joint {
                    cell,
                    cost: cost_of(length_m, lattice.pitch_m),
                    length_m,
                });
            }
        }
    }

    pub(crate) fn list(&self) -> &[Joint] {
        &self.list
    }

    /// Whether the configuration is a lattice point.
    pub(crate) fn is_on_lattice(&self) -> bool {
        self.on_lattice
    }

    /// The cost of the joint at `cell`, if there is one.
    pub(crate) fn at(&self, cell: u32) -> Option<Joint> {
        self.list.iter().copied().find(|joint| joint.cell == cell)
    }
}

/// Two configurations at least one of which is off the lattice and that are so close that the
/// straight piece between them may be shorter than any way over lattice points.
pub(crate) fn are_close(pitch_m: f64, a: Vec2, b: Vec2) -> bool {
    (a - b).amax() <= 2.0 * pitch_m
}

/// A length as a path cost, rounded to the nearest.
pub(crate) fn cost_of(length_m: f64, pitch_m: f64) -> u32 {
    let cost = (length_m / pitch_m * f64::from(STRAIGHT)).round();
    debug_assert!((0.0..=8.0 * f64::from(DIAGONAL)).contains(&cost));
    // In range: a joint is a few pitches long.
    cost as u32
}
