//! What the supervisor, and people, tell the world.

use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

use crate::id::tag;

tag! {
    /// A kind of participant.
    pub enum RoleKind {
        /// Owns the state of all bodies.
        World = 0,
        /// Works out hard constraints.
        Planner = 1,
        /// Moves one robot.
        Robot = 2,
        /// Writes the trace.
        Recorder = 3,
    }
}

tag! {
    /// What is asked of the world.
    pub enum ControlKind {
        /// `role` `index` takes part from now on, as `incarnation`.
        Up = 0,
        /// `role` `index` is gone.
        Down = 1,
        /// End the run.
        Stop = 2,
        /// Hold all motion.
        Hold = 3,
        /// Go on moving.
        Resume = 4,
    }
}

/// One request to the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct ControlRequest {
    /// Rises with each request of one sender.
    pub id: u64,
    /// A [`ControlKind`].
    pub kind: u32,
    /// A [`RoleKind`], for `Up` and `Down`.
    pub role: u32,
    /// Which robot, for the role `Robot`.
    pub index: u32,
    /// Incarnation of the process that is up.
    pub incarnation: u32,
}

/// The world's reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct ControlReply {
    /// Echo of the request.
    pub id: u64,
    /// Tick at which it takes effect.
    pub effect_tick: u64,
    /// 1 if accepted.
    pub accepted: u32,
    /// Always 0.
    pub reserved: u32,
}
