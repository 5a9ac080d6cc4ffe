//! What a robot wants: its whole intent, repeated until the snapshot acknowledges it.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Sub};

use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

use crate::capacity::MAX_PATH_POINTS;
use crate::{NONE, Point, Wait};

/// A claim on a task, or on none. Level-triggered: it stands as long as it is repeated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Claim {
    /// Claimed task, or [`NONE`].
    pub task: u32,
    /// Version of the hard constraints it was selected under.
    pub constraints_version: u32,
    /// Epoch it was selected in.
    pub epoch: u64,
}

/// A path asked for. It starts where the standing grant ends (`points[0]`; the robot's position
/// if nothing is granted) and replaces whatever of an older request is not granted yet. A request
/// with `count` 0 and a new id only drops what is not granted.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct PathRequest {
    /// Rises with each new request; 0 is none yet.
    pub id: u32,
    /// Live points.
    pub count: u32,
    /// Actions of the robot's schedule that are granted to it once all of this is: each point but
    /// the first ends one. Always 0 where no schedule is followed.
    pub actions: u32,
    /// Version of the schedule that these actions are of; 0 where none is followed. A request
    /// of another version than the one in force is not taken.
    pub schedule_version: u32,
    /// Corner points; unused ones are zero.
    pub points: [Point; MAX_PATH_POINTS],
}

/// A task that has failed (rule 21), reported until the world has counted it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Failure {
    /// Rises with each failure of this robot; 0 is none yet.
    pub id: u32,
    /// Failed task, or [`NONE`].
    pub task: u32,
    /// A [`crate::FailureCause`].
    pub cause: u32,
    /// For a failure caused by robots: the nearest one in the way, else [`NONE`].
    pub blocker: u32,
    /// 1 once the planner has answered, or where no answer is asked for: only then does the world
    /// count the failure and open an epoch.
    pub answered: u32,
    /// Always 0.
    pub reserved: u32,
    /// Epoch the task was selected in.
    pub epoch: u64,
}

/// Work done so far, by one participant.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout,
)]
#[repr(C)]
pub struct Counters {
    /// Polygon tests charged (rule 23).
    pub polygon_tests: u64,
    /// Path plans charged.
    pub path_plans: u64,
    /// Cells expanded.
    pub cells_expanded: u64,
    /// Selections worked out.
    pub selections: u64,
    /// Easy constraints found in those selections.
    pub easy_constraints: u64,
    /// Work units spent.
    pub units: u64,
}

impl Counters {
    fn with(self, other: Self, of: fn(u64, u64) -> u64) -> Self {
        Self {
            polygon_tests: of(self.polygon_tests, other.polygon_tests),
            path_plans: of(self.path_plans, other.path_plans),
            cells_expanded: of(self.cells_expanded, other.cells_expanded),
            selections: of(self.selections, other.selections),
            easy_constraints: of(self.easy_constraints, other.easy_constraints),
            units: of(self.units, other.units),
        }
    }
}

impl Add for Counters {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.with(other, u64::add)
    }
}

impl AddAssign for Counters {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// What was done since.
impl Sub for Counters {
    type Output = Self;

    fn sub(self, before: Self) -> Self {
        self.with(before, u64::sub)
    }
}

impl Sum for Counters {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), Self::add)
    }
}

/// A robot's whole intent at one tick.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Command {
    /// Who sends it.
    pub robot: u32,
    /// Incarnation of the sending process.
    pub incarnation: u32,
    /// Rises with every command of this incarnation.
    pub sequence: u64,
    /// Tick of the snapshot it answers.
    pub tick: u64,
    /// Last tick at which it still counts; after that the robot is held where it is.
    pub valid_until_tick: u64,
    /// Value of the snapshot's `change` when the robot last looked and found nothing to do;
    /// `u64::MAX` while it has something to do (rule 22).
    pub settled_at_change: u64,
    /// Hash of the robot's private state.
    pub state_hash: u64,
    /// A [`crate::Phase`].
    pub phase: u32,
    /// An [`crate::Activity`]: what it counts as doing if it does not move.
    pub activity: u32,
    /// 1 to move along what is granted, 0 to stand still (a robot that computes stands still).
    pub go: u32,
    /// A [`crate::Grip`].
    pub grip: u32,
    /// What the next action of its schedule waits for, or [`Wait::NONE`].
    pub waits_for: Wait,
    /// Its claim.
    pub claim: Claim,
    /// Its failure.
    pub failure: Failure,
    /// Path it asks for.
    pub path: PathRequest,
    /// Work done so far.
    pub counters: Counters,
}

impl Claim {
    /// No claim.
    pub const NONE: Self = Self {
        task: NONE,
        constraints_version: 0,
        epoch: 0,
    };
}

impl PathRequest {
    /// The corner points asked for.
    #[must_use]
    pub fn points(&self) -> &[Point] {
        &self.points[..(self.count as usize).min(MAX_PATH_POINTS)]
    }
}

impl Default for PathRequest {
    fn default() -> Self {
        zerocopy::FromZeros::new_zeroed()
    }
}

impl Default for Failure {
    fn default() -> Self {
        Self {
            task: NONE,
            blocker: NONE,
            ..zerocopy::FromZeros::new_zeroed()
        }
    }
}

impl Default for Command {
    fn default() -> Self {
        Self {
            claim: Claim::NONE,
            failure: Failure::default(),
            settled_at_change: u64::MAX,
            waits_for: Wait::NONE,
            ..zerocopy::FromZeros::new_zeroed()
        }
    }
}
