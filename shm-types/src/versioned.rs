//! What is published in versions, one of which a snapshot names as being in force.
//!
//! Responsible for: what hard constraints and schedules have in common for those who keep them.
//! Not responsible for: which version is in force (the world).

use zerocopy::FromZeros;

use crate::{ConstraintTable, Schedule, Validate};

/// A message that is published in versions.
pub trait Versioned: Validate + FromZeros {
    /// Its version; 0 is the empty one, which nobody publishes.
    fn version(&self) -> u32;

    /// Copies the live part of `other`.
    fn copy_from(&mut self, other: &Self);
}

impl Versioned for ConstraintTable {
    fn version(&self) -> u32 {
        self.version
    }

    fn copy_from(&mut self, other: &Self) {
        Self::copy_from(self, other);
    }
}

impl Versioned for Schedule {
    fn version(&self) -> u32 {
        self.version
    }

    fn copy_from(&mut self, other: &Self) {
        Self::copy_from(self, other);
    }
}
