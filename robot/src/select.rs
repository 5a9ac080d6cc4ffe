//! Selecting: which task to take in this epoch (§III.C).
//!
//! Responsible for: waiting for the constraints the epoch names, working the selection out, and
//! what follows for this robot: a task, the one it had, or none.
//! Not responsible for: the rules of selection (`planner`); every robot works out the same.
//! Source: rules 17–19.

use std::task::Poll;

use shm_types::{Claim, NONE, StateHash};

use crate::account::{Doing, Thinking};
use crate::home;
use crate::intent::Intent;
use crate::look::Leg;
use crate::now::Now;
use crate::phase::{Next, Phase};
use crate::transit;
use crate::trip::Trip;

/// A selection to be made, or under way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Selecting {
    /// Epoch whose inputs were copied; 0 while none were.
    epoch: u64,
    /// What it interrupts: gone on with if the robot keeps its task, or gets none and was on its
    /// way home.
    before: Option<Trip>,
}

impl Selecting {
    /// A selection that interrupts `trip`.
    pub(crate) fn after(trip: Option<Trip>) -> Self {
        Self {
            epoch: 0,
            before: trip,
        }
    }

    /// Goes on selecting.
    pub(crate) fn act(
        mut self,
        now: &Now<'_>,
        thinking: &mut Thinking,
        intent: &mut Intent,
    ) -> Next {
        if self.epoch != now.epoch() {
            if !constraints_are_known(now, thinking) {
                return Next::Rest(Phase::Selecting(self), Doing::COMPUTING);
            }
            thinking.selection.begin(now.snapshot, now.table.get());
            self.epoch = now.epoch();
        }
        let selected =
            thinking
                .selection
                .advance(now.scene, &mut thinking.budget, &mut thinking.counters);
        if selected == Poll::Pending {
            return Next::Rest(Phase::Selecting(self), Doing::COMPUTING);
        }
        intent.selected_epoch = self.epoch;
        let task = thinking.selection.task_of(now.id);
        intent.claim = claim(now, task);
        Next::Enter(match (task, self.before) {
            (Some(task), Some(trip)) if trip.leg().task() == Some(task) => {
                transit::resume(now, trip)
            }
            (Some(task), _) => transit::begin(now, intent, task),
            (None, Some(trip)) if trip.leg() == Leg::Home => home::resume(now, trip),
            (None, _) => home::begin(now, intent),
        })
    }

    /// Adds what it carries, in a fixed order.
    pub(crate) fn hash_into(&self, hash: &mut StateHash) {
        hash.add(&self.epoch);
        if let Some(trip) = &self.before {
            trip.hash_into(hash);
        }
    }
}

/// The claim on a task, or on none, that follows from this epoch's selection.
pub(crate) fn claim(now: &Now<'_>, task: Option<usize>) -> Claim {
    Claim {
        task: task.map_or(NONE, |task| task as u32),
        constraints_version: now.snapshot.header.epoch_constraints_version,
        epoch: now.epoch(),
    }
}

/// Whether the table at hand is the one this epoch names, and has all that the method wants
/// before a selection (rule 23).
fn constraints_are_known(now: &Now<'_>, thinking: &Thinking) -> bool {
    now.table.version == now.snapshot.header.epoch_constraints_version
        && thinking.selection.is_ready(now.snapshot, now.table.get())
}
