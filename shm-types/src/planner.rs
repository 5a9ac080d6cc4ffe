//! What robots ask of the planner service and what it publishes.

use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

use crate::capacity::MAX_CONSTRAINTS;
use crate::id::tag;
use crate::{Counters, StateHash};

tag! {
    /// Which hard test found a constraint (METHOD's table, rule 10 ff.).
    pub enum ConstraintKind {
        /// No transfer path for `after` with `before` at its initial place: g before < f after.
        H1 = 1,
        /// No transfer path for `before` with `after` at its goal: g before < f after.
        H2 = 2,
    }
}

tag! {
    /// What a planner that plans ahead says of the run's end.
    pub enum Verdict {
        /// Nothing: it has a plan, looks for one, or the method does not plan ahead.
        Open = 0,
        /// It has looked as far as it may, and found no plan.
        NotFound = 1,
        /// There is none: every arrangement that can be reached was looked at, in the model that
        /// it plans in.
        Exhausted = 2,
        /// There is none: what every plan has to do contradicts itself.
        Proved = 3,
    }
}

/// A hard constraint: task `before` must be completed before task `after` is selected (rule 13).
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, FromBytes, IntoBytes, Immutable, KnownLayout,
)]
#[repr(C)]
pub struct Constraint {
    /// Task that goes first.
    pub before: u32,
    /// Task that goes later.
    pub after: u32,
    /// A [`ConstraintKind`].
    pub kind: u32,
}

/// All hard constraints known, one version. Sorted, no repeats.
#[derive(FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct ConstraintTable {
    /// Rises with each table; 0 is the empty one nobody publishes.
    pub version: u32,
    /// Live constraints.
    pub count: u32,
    /// First tick at which it may be named by a snapshot.
    pub effect_tick: u64,
    /// Method "all": the snapshot's `events` this table is complete for; `u64::MAX` where it is
    /// no complete table.
    pub complete_for_events: u64,
    /// The first `count` are live.
    pub constraints: [Constraint; MAX_CONSTRAINTS],
}

/// "Task k failed at epoch e": a robot asks which hard constraints it has missed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct HardRequest {
    /// Who asks.
    pub robot: u32,
    /// Incarnation of the asking process.
    pub incarnation: u32,
    /// The robot's failure id: asking again with the same one does no work twice.
    pub failure: u32,
    /// Failed task.
    pub task: u32,
    /// Tick of the snapshot it was asked at; the planner sees it in the next.
    pub tick: u64,
    /// Epoch the task was selected in.
    pub epoch: u64,
}

/// The planner's answer to a [`HardRequest`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct HardAnswer {
    /// Echo of the request.
    pub robot: u32,
    /// Echo of the request.
    pub incarnation: u32,
    /// Echo of the request.
    pub failure: u32,
    /// Echo of the request.
    pub task: u32,
    /// Tick of the planner's step that answered; the robot sees it in the next.
    pub tick: u64,
    /// Table version that holds all that was found.
    pub constraints_version: u32,
    /// Constraints found that were not known before.
    pub found: u32,
    /// 1 if the task has no path even alone (rule 10).
    pub infeasible: u32,
    /// Always 0.
    pub reserved: u32,
}

/// What the planner tells the world each tick.
#[derive(Clone, Copy, Debug, Default, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct PlannerReport {
    /// Tick of the snapshot it answers.
    pub tick: u64,
    /// Hash of the planner's private state.
    pub state_hash: u64,
    /// Newest constraint table published; 0 for none.
    pub constraints_version: u32,
    /// Newest schedule published; 0 for none.
    pub schedule_version: u32,
    /// 1 while it has work left.
    pub busy: u32,
    /// Incarnation of its process.
    pub incarnation: u32,
    /// Constraints found that the newest table has no room for: if not 0, the run is no longer
    /// the method it claims to be.
    pub constraints_dropped: u32,
    /// A [`Verdict`]: what the planner knows of the run's end.
    pub verdict: u32,
    /// Work done so far.
    pub counters: Counters,
}

impl ConstraintTable {
    /// The empty table of version 0, which stands for "nothing published yet". It is complete for
    /// no event.
    #[must_use]
    pub fn none() -> Box<Self> {
        let mut table = crate::zeroed::<Self>();
        table.complete_for_events = u64::MAX;
        table
    }

    /// The live constraints.
    #[must_use]
    pub fn constraints(&self) -> &[Constraint] {
        &self.constraints[..(self.count as usize).min(MAX_CONSTRAINTS)]
    }

    /// Copies the live part of `other`.
    pub fn copy_from(&mut self, other: &Self) {
        let count = (other.count as usize).min(MAX_CONSTRAINTS);
        self.version = other.version;
        self.count = other.count;
        self.effect_tick = other.effect_tick;
        self.complete_for_events = other.complete_for_events;
        self.constraints[..count].copy_from_slice(&other.constraints[..count]);
    }

    /// Adds the live part, in canonical order.
    pub fn hash_into(&self, hash: &mut StateHash) {
        hash.add(&[self.version, self.count]);
        hash.add(&[self.effect_tick, self.complete_for_events]);
        hash.add(self.constraints());
    }
}
