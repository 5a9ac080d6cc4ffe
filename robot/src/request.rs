//! Asking the world for a path.
//!
//! Responsible for: numbering requests, repeating the newest one, knowing what became of it.
//! Not responsible for: granting.
//! Source: DESIGN idea 3; a refused request is no failure (rule 20).

use shm_types::{PathRequest, RobotState, StateHash};

use crate::ahead::Ahead;

/// The newest request, as every command repeats it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked {
    request: PathRequest,
    /// Number of the first command that carried it.
    sequence: u64,
}

/// What became of the newest request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fate {
    /// The world has not seen it yet.
    Sent,
    /// Taken, and part of it is not granted yet.
    Open,
    /// Taken, and granted whole (or there was nothing to grant).
    Granted,
    /// The world has seen the command and not taken the request: it did not start where the
    /// standing grant ends.
    Refused,
}

impl Asked {
    /// Nothing asked for yet.
    pub(crate) fn nothing() -> Self {
        Self {
            request: PathRequest::default(),
            sequence: 0,
        }
    }

    /// Goes on counting from the newest request the world has taken of this robot.
    pub(crate) fn after(me: &RobotState) -> Self {
        Self {
            request: PathRequest {
                id: me.request,
                ..PathRequest::default()
            },
            ..Self::nothing()
        }
    }

    /// The request to send.
    pub(crate) fn request(&self) -> &PathRequest {
        &self.request
    }

    /// Asks for a path, first in the command of number `sequence`.
    pub(crate) fn ask(&mut self, ahead: &Ahead, sequence: u64) {
        self.ask_for(ahead.request(), sequence);
    }

    /// Asks for this path under a new number, first in the command of number `sequence`. Past the
    /// last number there is, which no run gets to, it is a number that the world refuses.
    pub(crate) fn ask_for(&mut self, request: PathRequest, sequence: u64) {
        self.request = PathRequest {
            id: self.request.id.wrapping_add(1),
            ..request
        };
        self.sequence = sequence;
    }

    /// Gives back what is asked for and not granted yet, if anything.
    pub(crate) fn drop_rest(&mut self, me: &RobotState, sequence: u64) {
        if matches!(self.fate(me), Fate::Sent | Fate::Open) {
            self.ask(&Ahead::NOWHERE, sequence);
        }
    }

    /// What became of the newest request.
    pub(crate) fn fate(&self, me: &RobotState) -> Fate {
        if me.request == self.request.id {
            if me.request_open == 1 {
                Fate::Open
            } else {
                Fate::Granted
            }
        } else if me.acknowledged < self.sequence {
            Fate::Sent
        } else {
            Fate::Refused
        }
    }

    /// Adds all of it, in a fixed order.
    pub(crate) fn hash_into(&self, hash: &mut StateHash) {
        hash.add(&self.sequence);
        hash.add(&[self.request.id, self.request.count]);
        hash.add(&[self.request.actions, self.request.schedule_version]);
        hash.add(self.request.points());
    }
}
