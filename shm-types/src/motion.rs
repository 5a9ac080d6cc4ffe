//! Every piece of motion and every event, as the world tells the recorder.

use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

use crate::capacity::{MAX_EVENTS, MAX_MOTIONS};
use crate::id::tag;
use crate::{NONE, Point};

tag! {
    /// What moved.
    pub enum BodyKind {
        /// A robot.
        Robot = 0,
        /// An object (with the robot that holds it).
        Object = 1,
    }
}

tag! {
    /// What happened. The comments say what `robot`, `task`, `other` and `value` hold; those
    /// not named are [`NONE`] and 0.
    pub enum EventKind {
        /// The run begins.
        Started = 0,
        /// `robot` has claimed `task`; `value` is the epoch it was selected in.
        Claimed = 1,
        /// `robot` has given `task` back.
        Unclaimed = 2,
        /// `robot` has begun to close its grip on `task`'s object.
        GraspStarted = 3,
        /// `robot` holds `task`'s object.
        Grasped = 4,
        /// `robot` has begun to open its grip.
        ReleaseStarted = 5,
        /// `robot` has put `task`'s object down.
        Released = 6,
        /// `task` is completed: its object stands at its goal.
        Completed = 7,
        /// `task` has failed for `robot`; `other` is the blocking robot or none, `value` the
        /// code of the [`crate::FailureCause`].
        Failed = 8,
        /// A hard constraint came into force: `task` before `other`; `value` is the code of
        /// the [`crate::ConstraintKind`].
        Constraint = 9,
        /// A new epoch has opened; `value` is its number.
        Epoch = 10,
        /// `robot` takes part again; `value` is its incarnation.
        RobotUp = 11,
        /// `robot` is gone.
        RobotDown = 12,
        /// Motion is held.
        Held = 13,
        /// Motion goes on.
        Resumed = 14,
        /// The run has ended; `value` is the code of the [`crate::Outcome`].
        Ended = 15,
        /// Two robots or bodies broke an invariant: `robot`, `task`, `other` say who, `value`
        /// which (the world's numbering).
        Violated = 16,
        /// The scenario has changed; `other` is its version, `value` its hash. What it says holds
        /// from the beginning of this tick on.
        Changed = 17,
        /// Somebody has moved `task`'s object by hand, to its start in the version of the scenario
        /// just announced.
        Moved = 18,
        /// A schedule was refused: `value` is its version and, from bit 32 on, how many actions
        /// were granted to `robot`, the one it does not fit; `other` is the code of the
        /// [`crate::Refusal`].
        ScheduleRefused = 19,
    }
}

/// A straight piece of motion at constant velocity.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct MotionRecord {
    /// Virtual time at `from`, ns.
    pub start_ns: u64,
    /// Virtual time at `to`, ns; later than `start_ns`.
    pub end_ns: u64,
    /// A [`BodyKind`].
    pub body: u32,
    /// Which robot or object.
    pub id: u32,
    /// Centre at the start.
    pub from: Point,
    /// Centre at the end.
    pub to: Point,
}

/// Something that happened at an instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct EventRecord {
    /// Virtual time, ns.
    pub time_ns: u64,
    /// See [`EventKind`].
    pub value: u64,
    /// An [`EventKind`].
    pub kind: u32,
    /// See [`EventKind`].
    pub robot: u32,
    /// See [`EventKind`].
    pub task: u32,
    /// See [`EventKind`].
    pub other: u32,
}

/// All motion and events of the tick that led to snapshot `tick`. Batches are numbered without
/// gaps, so a reader sees at once when one is lost.
#[derive(FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct MotionBatch {
    /// Number of this batch, from 0.
    pub sequence: u64,
    /// Tick of the snapshot that this batch led to.
    pub tick: u64,
    /// Virtual time of that snapshot, ns.
    pub time_ns: u64,
    /// Live pieces.
    pub motion_count: u32,
    /// Live events.
    pub event_count: u32,
    /// Oldest batch that can still be sent again: whoever lacks an older one has lost it, and
    /// whoever lacks a newer one will get it.
    pub kept_from: u64,
    /// The first `motion_count` are live.
    pub motions: [MotionRecord; MAX_MOTIONS],
    /// The first `event_count` are live.
    pub events: [EventRecord; MAX_EVENTS],
}

/// How far the recorder has come: the world runs ahead of it only so many batches, where it waits
/// for anybody at all.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout,
)]
#[repr(C)]
pub struct RecorderReport {
    /// Number of the batch it expects next: all before it are written or lost.
    pub next_sequence: u64,
    /// All batches before this one are in the file whatever becomes of the process, or lost.
    pub durable_sequence: u64,
    /// Batches that never reached it.
    pub lost: u64,
    /// Incarnation of its process.
    pub incarnation: u32,
    /// Always 0.
    pub reserved: u32,
}

impl EventRecord {
    /// An event of `kind` at `time_ns` that names nobody.
    #[must_use]
    pub const fn new(kind: EventKind, time_ns: u64) -> Self {
        Self {
            time_ns,
            value: 0,
            kind: kind.code(),
            robot: NONE,
            task: NONE,
            other: NONE,
        }
    }
}

impl MotionBatch {
    /// The live pieces of motion.
    #[must_use]
    pub fn motions(&self) -> &[MotionRecord] {
        &self.motions[..(self.motion_count as usize).min(MAX_MOTIONS)]
    }

    /// Copies the live part of `other`.
    pub fn copy_from(&mut self, other: &Self) {
        let (motions, events) = (other.motions(), other.events());
        self.sequence = other.sequence;
        self.tick = other.tick;
        self.time_ns = other.time_ns;
        self.motion_count = other.motion_count;
        self.event_count = other.event_count;
        self.kept_from = other.kept_from;
        self.motions[..motions.len()].copy_from_slice(motions);
        self.events[..events.len()].copy_from_slice(events);
    }

    /// The live events.
    #[must_use]
    pub fn events(&self) -> &[EventRecord] {
        &self.events[..(self.event_count as usize).min(MAX_EVENTS)]
    }
}
