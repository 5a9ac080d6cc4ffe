//! What a robot wants of others, beside motion: what its commands repeat.
//!
//! Responsible for: the claim, the failure and the path asked for, as they stand.
//! Not responsible for: why they are so (the phases).

use shm_types::{Claim, Failure, HardRequest, StateHash, Wait};

use crate::ahead::Ahead;
use crate::now::Now;
use crate::request::Asked;

/// The standing part of a robot's commands.
#[derive(Clone, Debug)]
pub(crate) struct Intent {
    /// Number of the command of this step.
    pub(crate) sequence: u64,
    pub(crate) claim: Claim,
    pub(crate) failure: Failure,
    pub(crate) asked: Asked,
    /// What the next action of its schedule waits for.
    pub(crate) waits_for: Wait,
    /// What is asked of the planner in this step.
    pub(crate) hard_request: Option<HardRequest>,
    /// Epoch of the newest selection made; 0 is none yet.
    pub(crate) selected_epoch: u64,
}

impl Intent {
    /// Nothing wanted.
    pub(crate) fn new() -> Self {
        Self {
            sequence: 0,
            claim: Claim::NONE,
            failure: Failure::default(),
            asked: Asked::nothing(),
            waits_for: Wait::NONE,
            hard_request: None,
            selected_epoch: 0,
        }
    }

    /// Goes on from what the world has of an earlier process of this robot.
    pub(crate) fn take_up(&mut self, now: &Now<'_>) {
        // The world takes nothing of one that is lost, but whoever hears it goes on counting.
        self.sequence = self.sequence.max(now.me().acknowledged.saturating_add(1));
        self.asked = Asked::after(now.me());
    }

    /// Asks for a way, if there is any motion in it.
    pub(crate) fn ask(&mut self, ahead: &Ahead) {
        if !ahead.stays() {
            self.asked.ask(ahead, self.sequence);
        }
    }

    /// Gives back what is asked for and not granted.
    pub(crate) fn drop_rest(&mut self, now: &Now<'_>) {
        self.asked.drop_rest(now.me(), self.sequence);
    }

    /// Adds all of it, in a fixed order.
    pub(crate) fn hash_into(&self, hash: &mut StateHash) {
        hash.add(&[self.sequence, self.selected_epoch]);
        hash.add(&self.claim);
        hash.add(&self.failure);
        self.asked.hash_into(hash);
    }
}
