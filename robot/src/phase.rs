//! The phases of a robot (§III.A, Fig. 2): each variant carries what that phase needs.
//!
//! Responsible for: which phases there are, what they are called on the wire, and what a new
//! epoch interrupts (rule 19).
//! Not responsible for: what happens in a phase (one file each).

use shm_types::{Phase as WirePhase, StateHash};

use crate::account::Doing;
use crate::failure::Failing;
use crate::grasp::Grasping;
use crate::select::Selecting;
use crate::trip::Trip;

/// What a robot is doing.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Phase {
    /// It has just been started, and has yet to see what it finds itself doing.
    Starting,
    /// It works out which task to take.
    Selecting(Selecting),
    /// It has no task and is at home.
    Idle,
    /// It is on its way to grasp, empty.
    Transit(Trip),
    /// It closes its grip.
    Grasping(Grasping),
    /// It is on its way with this task's object.
    Transfer(Trip),
    /// It opens its grip.
    Releasing,
    /// Its task has failed.
    Failing(Failing),
    /// It has no task and is on its way home.
    GoingHome(Trip),
}

/// What follows from a look at a phase.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Next {
    /// Another phase, within the same step.
    Enter(Phase),
    /// The step is over.
    Rest(Phase, Doing),
}

impl Phase {
    /// What it is called in commands.
    pub(crate) fn wire(&self) -> WirePhase {
        match self {
            Self::Starting | Self::Selecting(_) => WirePhase::Selecting,
            Self::Idle => WirePhase::Idle,
            Self::Transit(_) => WirePhase::Transit,
            Self::Grasping(_) => WirePhase::Grasping,
            Self::Transfer(_) => WirePhase::Transfer,
            Self::Releasing => WirePhase::Releasing,
            Self::Failing(_) => WirePhase::Failing,
            Self::GoingHome(_) => WirePhase::GoingHome,
        }
    }

    /// The phase after a new epoch has opened: a robot that carries keeps its task, one whose
    /// grip is closing finishes that, one that waits for an answer needs it first, and everyone
    /// else selects again.
    pub(crate) fn reselect(self, grip_is_closing: bool) -> Self {
        match self {
            Self::Idle => Self::Selecting(Selecting::after(None)),
            Self::Transit(trip) | Self::GoingHome(trip) => {
                Self::Selecting(Selecting::after(Some(trip)))
            }
            Self::Grasping(grasping) if !grip_is_closing => {
                Self::Selecting(Selecting::after(Some(grasping.trip())))
            }
            Self::Starting
            | Self::Selecting(_)
            | Self::Grasping(_)
            | Self::Transfer(_)
            | Self::Releasing
            | Self::Failing(_) => self,
        }
    }

    /// Whether a robot may find itself holding an object in this phase. In any other one it has
    /// missed the snapshots in which its grip closed.
    pub(crate) fn may_hold(&self) -> bool {
        matches!(
            self,
            Self::Starting | Self::Grasping(_) | Self::Transfer(_) | Self::Releasing
        )
    }

    /// Adds what the phase carries, in a fixed order.
    pub(crate) fn hash_into(&self, hash: &mut StateHash) {
        hash.add(&self.wire().code());
        match self {
            Self::Starting | Self::Idle | Self::Releasing => {}
            Self::Selecting(selecting) => selecting.hash_into(hash),
            Self::Transit(trip) | Self::Transfer(trip) | Self::GoingHome(trip) => {
                trip.hash_into(hash);
            }
            Self::Grasping(grasping) => grasping.hash_into(hash),
            Self::Failing(failing) => failing.hash_into(hash),
        }
    }
}
