//! Epochs: the spans between two selections (rules 17–19).
//!
//! Responsible for: opening an epoch, at most one a tick, and freezing what selection reads, so
//! that all robots find the same. Not responsible for: selecting.
//!
//! What opens one: a completion; a failure counted; a new constraint version; and **(ours)** an
//! object put down short of its goal, a bar lifted for an idle robot, a robot that takes part
//! again or no more. Without these a task could be free and a robot idle, and neither know.

use shm_types::{EventKind, TaskStatus};

use crate::journal::{Event, Journal};
use crate::state::Hand;
use crate::step::World;

/// The counts that everybody's waiting and selecting hangs on; see `SnapshotHeader`.
#[derive(Clone, Debug)]
pub(crate) struct Epoch {
    pub(crate) number: u64,
    pub(crate) events: u64,
    pub(crate) change: u64,
    pub(crate) placements: u64,
    /// Constraint version when the epoch opened.
    pub(crate) constraints_version: u32,
    /// Something in this tick opens an epoch.
    pub(crate) due: bool,
}

impl Epoch {
    /// Epoch 1, open from the start.
    pub(crate) const fn first() -> Self {
        Self {
            number: 1,
            events: 0,
            change: 0,
            placements: 0,
            constraints_version: 0,
            due: false,
        }
    }
}

impl World {
    /// Opens an epoch if one is due.
    pub(crate) fn open_epoch(&mut self, journal: &mut Journal<'_>) {
        if !std::mem::take(&mut self.epoch.due) {
            return;
        }
        self.epoch.number += 1;
        self.epoch.constraints_version = self.constraints.in_force.version;
        for robot in &mut self.robots {
            robot.epoch_position = robot.position;
            robot.epoch_free = robot.link.live && robot.hand == Hand::Empty;
        }
        for object in &mut self.objects {
            // An object around which a grip closes is as good as held.
            let grip = object.claimed_by.map(|i| self.robots[i].hand);
            object.epoch_status = match grip {
                Some(Hand::Closing { .. }) => TaskStatus::Held,
                _ => object.status,
            };
            object.epoch_barred = object.barred;
        }
        journal.event(Event::new(EventKind::Epoch).value(self.epoch.number));
    }
}
