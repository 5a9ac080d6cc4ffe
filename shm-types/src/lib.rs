//! The words that cross a process boundary: plain `repr(C)` messages, ids, capacities, and
//! their validation.
//!
//! Responsible for: what a message holds, how it is checked, how it is hashed.
//! Not responsible for: how it travels (crate `node`) or what it means to the method (crates
//! `planner`, `robot`, `world`).
//!
//! Terms: an object `i` and the task `T_i` that brings it to its goal share one id. A *tick* is
//! one step of the world. An *epoch* is the span between two selections (rules 17–19). All
//! lengths are metres in the world frame, all durations nanoseconds of virtual time unless a name
//! says otherwise.
//!
//! Every message is free of padding (`zerocopy::IntoBytes` proves it at compile time), so its
//! bytes are its value: hashing, journalling and fuzzing need no second description of it.
#![forbid(unsafe_code)]

pub mod capacity;
mod checked;
mod command;
mod control;
mod hash;
mod id;
mod motion;
mod planner;
mod point;
mod schedule;
mod snapshot;
mod versioned;

pub use checked::{Checked, Counts, Invalid, Validate};
pub use command::{Claim, Command, Counters, Failure, PathRequest};
pub use control::{ChangeKind, ControlKind, ControlReply, ControlRequest, RoleKind, SceneChange};
pub use hash::StateHash;
pub use id::{NONE, index};
pub use motion::{BodyKind, EventKind, EventRecord, MotionBatch, MotionRecord, RecorderReport};
pub use planner::{
    Constraint, ConstraintKind, ConstraintTable, HardAnswer, HardRequest, PlannerReport, Verdict,
};
pub use point::Point;
pub use schedule::{Action, Refusal, RobotSchedule, Schedule, Wait};
pub use snapshot::{
    Activity, FailureCause, Grip, ObjectState, Outcome, Phase, RobotState, SnapshotHeader,
    TaskStatus, WorldSnapshot,
};
pub use versioned::Versioned;

/// Allocates a message on the heap, all zero, without building it on the stack first.
///
/// # Panics
/// When memory is exhausted.
#[must_use]
#[expect(
    clippy::expect_used,
    reason = "an allocator that is out of memory aborts anyway"
)]
pub fn zeroed<T: zerocopy::FromZeros>() -> Box<T> {
    T::new_box_zeroed().expect("out of memory")
}
