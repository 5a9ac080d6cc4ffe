//! Grasping: the grip closes (Definition 1).
//!
//! Responsible for: asking for the grip until the object is held.
//! Not responsible for: whether it may be grasped, and how long that takes (the world).

use shm_types::{Grip, StateHash};

use crate::account::{Doing, Thinking};
use crate::intent::Intent;
use crate::now::Now;
use crate::phase::{Next, Phase};
use crate::trip::Trip;
use crate::{transfer, transit};

/// A grasp.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grasping {
    /// The trip whose transfer leg begins when the object is held. Its last look has found a way.
    trip: Trip,
    /// When the grip was first asked for, ns of virtual time.
    since_ns: u64,
}

impl Grasping {
    /// A grasp at the end of `trip`'s approach.
    pub(crate) fn new(now: &Now<'_>, trip: Trip) -> Self {
        Self {
            trip,
            since_ns: now.time_ns(),
        }
    }

    /// The trip it is part of.
    pub(crate) fn trip(&self) -> Trip {
        self.trip
    }

    /// Goes on grasping. If the grip will not close, because somebody came into the place of the
    /// object and its robot, the robot looks again as on any trip that gets no further.
    pub(crate) fn act(self, now: &Now<'_>, thinking: &Thinking, intent: &mut Intent) -> Next {
        if let (Some(held), Some(task)) = (now.holding(), self.trip.leg().task())
            && held == task
        {
            return Next::Enter(transfer::after_grasp(now, thinking, intent, task));
        }
        let look_again_ns = thinking.settings.look_again_ns;
        if now.time_ns() > self.since_ns + look_again_ns && !now.is_gripping() {
            return Next::Enter(transit::resume(now, self.trip));
        }
        Next::Rest(Phase::Grasping(self), Doing::gripping(Grip::Grasp))
    }

    /// Adds what it carries, in a fixed order.
    pub(crate) fn hash_into(&self, hash: &mut StateHash) {
        self.trip.hash_into(hash);
        hash.add(&self.since_ns);
    }
}
