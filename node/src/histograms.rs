//! Latencies: one histogram per name and process, merged by the supervisor.
//!
//! Responsible for: recording durations, keeping them in a file at exit, merging such files.
//! Not responsible for: reading clocks while a machine steps (the roles do).
//!
//! Terms: a *name* says what was timed; see [`Timed`].

use std::io;
use std::path::Path;

use hdrhistogram::Histogram;
use hdrhistogram::serialization::{Deserializer, Serializer, V2Serializer};

/// Longest duration told apart, ns: a minute. Longer ones count as this.
const HIGHEST_NS: u64 = 60_000_000_000;
/// Significant decimal digits kept.
const DIGITS: u8 = 3;

/// What is timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Timed {
    /// From the publication of a snapshot to its reader's first look.
    SnapshotAge,
    /// One step of the world.
    WorldStep,
    /// One step of the planner.
    PlannerStep,
    /// One step of a robot.
    RobotStep,
    /// From a command that asks for a path to the first snapshot that grants some of it.
    CommandToGrant,
    /// Steps in which easy constraints were worked out, together, per selection.
    EasyConstraints,
    /// Steps in which a selection was worked out, together.
    Selection,
    /// Steps in which a path was searched, together.
    PathSearch,
    /// From a hard-constraint request to its answer.
    HardRoundTrip,
    /// From one tick of the world to the next.
    Tick,
}

impl Timed {
    /// All of them, in the order in which they are reported.
    pub const ALL: [Self; 10] = [
        Self::SnapshotAge,
        Self::WorldStep,
        Self::PlannerStep,
        Self::RobotStep,
        Self::CommandToGrant,
        Self::EasyConstraints,
        Self::Selection,
        Self::PathSearch,
        Self::HardRoundTrip,
        Self::Tick,
    ];

    /// Its name in results.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::SnapshotAge => "snapshot_age",
            Self::WorldStep => "world_step",
            Self::PlannerStep => "planner_step",
            Self::RobotStep => "robot_step",
            Self::CommandToGrant => "command_to_grant",
            Self::EasyConstraints => "easy_constraints",
            Self::Selection => "selection",
            Self::PathSearch => "path_search",
            Self::HardRoundTrip => "hard_round_trip",
            Self::Tick => "tick",
        }
    }
}

/// What a result says of one name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct LatencySummary {
    /// Durations recorded.
    pub count: u64,
    /// Median, ns.
    pub p50_ns: u64,
    /// 99th percentile, ns.
    pub p99_ns: u64,
    /// 99.9th percentile, ns.
    pub p999_ns: u64,
    /// Longest, ns.
    pub max_ns: u64,
}

/// One histogram for each [`Timed`].
#[derive(Clone, Debug)]
pub struct Latencies {
    histograms: Vec<Histogram<u64>>,
}
