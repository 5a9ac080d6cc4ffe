//! Grasping: the grip closes (Definition 1).
//!
//! Responsible for: asking for the grip until the object is held.
//! Not responsible for: whether it may be grasped, and how long that takes (the world).

use shm_types::Grip;

use crate::account::{Doing, Thinking};
use crate::intent::Intent;
use crate::now::Now;
use crate::phase::{Next, Phase};
use crate::transfer;
use crate::trip::Trip;

/// A grasp.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grasping {
    /// The trip whose transfer leg begins when the object is held. Its last look has found a way.
    trip: Trip,
}

impl Grasping {
    /// A grasp at the end of `trip`'s approach.
    pub(crate) fn new(trip: Trip) -> Self {
        Self { trip }
    }

    /// The trip it is part of.
    pub(crate) fn trip(&self) -> Trip {
        self.trip
    }

    /// Goes on grasping.
    pub(crate) fn act(self, now: &Now<'_>, thinking: &Thinking, intent: &mut Intent) -> Next {
        match (now.holding(), self.trip.leg().task()) {
            (Some(held), Some(task)) if held == task => {
                Next::Enter(transfer::after_grasp(now, thinking, intent, task))
            }
            _ => Next::Rest(Phase::Grasping(self), Doing::gripping(Grip::Grasp)),
        }
    }
}
