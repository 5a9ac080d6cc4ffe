//! Constraint tables on their way from the planner to those who read them.
//!
//! Responsible for: holding, in place, the versions that a snapshot may still name.
//! Not responsible for: which version is in force (the world).
//!
//! An epoch opens with every version that comes into force, so a snapshot names the newest
//! version or the one before it.

use std::collections::VecDeque;

use shm_types::{Checked, ConstraintTable, Counts};

use crate::ports::{Access, Sample, Subscriber};
use crate::roles::{RoleError, Seat, refused};

/// Versions held.
const KEPT: usize = 2;

/// The newest tables.
pub(crate) struct Tables {
    inlet: Subscriber<ConstraintTable>,
    counts: Counts,
    /// Version 0.
    empty: Box<ConstraintTable>,
    /// Oldest first.
    kept: VecDeque<Sample<ConstraintTable>>,
}

impl Tables {
    /// Nothing received yet.
    ///
    /// # Errors
    /// The port cannot be made.
    pub(crate) fn new(seat: &Seat) -> Result<Self, RoleError> {
        let service = seat.topics.constraints.service(&seat.node, Access::Open)?;
        Ok(Self {
            inlet: service.subscriber()?,
            counts: seat.counts(),
            empty: ConstraintTable::none(),
            kept: VecDeque::with_capacity(KEPT + 1),
        })
    }

    /// Takes in what has been published.
    ///
    /// # Errors
    /// Shared memory failed.
    pub(crate) fn receive(&mut self) -> Result<(), RoleError> {
        while let Some(table) = self.inlet.receive()? {
            self.kept.push_back(table);
            if self.kept.len() > KEPT {
                self.kept.pop_front();
            }
        }
        Ok(())
    }

    /// The newest table; `None` before the first.
    ///
    /// # Errors
    /// It is no legal message.
    pub(crate) fn newest(&self) -> Result<Option<Checked<'_, ConstraintTable>>, RoleError> {
        self.kept.back().map(|table| self.check(table)).transpose()
    }

    /// The table of this version. The empty one if it is not held: its reader sees that it is not
    /// the one it wants, and waits.
    ///
    /// # Errors
    /// It is no legal message.
    pub(crate) fn version(&self, version: u32) -> Result<Checked<'_, ConstraintTable>, RoleError> {
        let kept = self
            .kept
            .iter()
            .find(|table| version > 0 && table.version == version);
        self.check(kept.map_or(&*self.empty, |table| table))
    }

    fn check<'a>(
        &self,
        table: &'a ConstraintTable,
    ) -> Result<Checked<'a, ConstraintTable>, RoleError> {
        Checked::new(table, self.counts).map_err(refused("constraints"))
    }
}
