//! Latencies: one histogram per name and process, merged by the supervisor.
//!
//! Responsible for: recording durations, keeping them in a file at exit, merging such files.
//! Not responsible for: reading clocks while a machine steps (the roles do).
//!
//! Terms: a *name* says what was timed; see [`Timed`]. A thing is *due* at its intended time: in
//! real time the deadlines of a grid, whether or not anybody came in time for them. What is timed
//! from there counts every period that a stall has swallowed, each from its own deadline.

use std::io;
use std::path::{Path, PathBuf};

use hdrhistogram::Histogram;
use hdrhistogram::serialization::{Deserializer, Serializer, V2Serializer};

use crate::options::Role;

/// Longest duration told apart, ns: a minute. Longer ones count as this.
const HIGHEST_NS: u64 = 60_000_000_000;
/// Significant decimal digits kept: errors stay below 1 %.
const DIGITS: u8 = 2;

/// What is timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Timed {
    /// From the publication of a snapshot to a robot's first look.
    SnapshotAge,
    /// From the publication of a snapshot to the planner's first look.
    PlannerSnapshotAge,
    /// Real time: from when a robot was due to have the state of a period to when it had it, or
    /// a newer one.
    SnapshotLateness,
    /// Checking a snapshot in place, by a robot.
    SnapshotCheck,
    /// Writing a snapshot in place.
    SnapshotWrite,
    /// Sending a written snapshot to all readers.
    SnapshotSend,
    /// One step of the world.
    WorldStep,
    /// Putting a tick into the world's journal.
    Journal,
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
    /// Real time: from when a tick was due to its publication.
    TickLateness,
}

impl Timed {
    /// All of them, in the order in which they are reported.
    pub const ALL: [Self; 17] = [
        Self::SnapshotAge,
        Self::PlannerSnapshotAge,
        Self::SnapshotLateness,
        Self::SnapshotCheck,
        Self::SnapshotWrite,
        Self::SnapshotSend,
        Self::WorldStep,
        Self::Journal,
        Self::PlannerStep,
        Self::RobotStep,
        Self::CommandToGrant,
        Self::EasyConstraints,
        Self::Selection,
        Self::PathSearch,
        Self::HardRoundTrip,
        Self::Tick,
        Self::TickLateness,
    ];

    /// Its name in results.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::SnapshotAge => "snapshot_age",
            Self::PlannerSnapshotAge => "planner_snapshot_age",
            Self::SnapshotLateness => "snapshot_lateness",
            Self::SnapshotCheck => "snapshot_check",
            Self::SnapshotWrite => "snapshot_write",
            Self::SnapshotSend => "snapshot_send",
            Self::WorldStep => "world_step",
            Self::Journal => "journal",
            Self::PlannerStep => "planner_step",
            Self::RobotStep => "robot_step",
            Self::CommandToGrant => "command_to_grant",
            Self::EasyConstraints => "easy_constraints",
            Self::Selection => "selection",
            Self::PathSearch => "path_search",
            Self::HardRoundTrip => "hard_round_trip",
            Self::Tick => "tick",
            Self::TickLateness => "tick_lateness",
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

/// A file of latencies could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum LatencyFileError {
    /// The system refused.
    #[error(transparent)]
    File(#[from] io::Error),
    /// It holds something else.
    #[error("the file holds no latencies of this version")]
    Foreign,
}

impl Default for Latencies {
    fn default() -> Self {
        Self::new()
    }
}

impl Latencies {
    /// Empty histograms, with all their memory.
    #[must_use]
    pub fn new() -> Self {
        Self {
            histograms: Timed::ALL.map(|_| empty()).into(),
        }
    }

    /// Records one duration. Makes no system call and allocates nothing.
    pub fn record(&mut self, timed: Timed, duration_ns: u64) {
        self.histograms[timed as usize].saturating_record(duration_ns);
    }

    /// Forgets all that was recorded: the warm-up is over.
    pub fn reset(&mut self) {
        for histogram in &mut self.histograms {
            histogram.reset();
        }
    }

    /// Adds all that another process recorded.
    pub fn merge(&mut self, other: &Self) {
        for (mine, theirs) in self.histograms.iter_mut().zip(&other.histograms) {
            // Equal bounds, so nothing of theirs can be out of range here.
            let _ = mine.add(theirs);
        }
    }

    /// The histogram of one name.
    #[must_use]
    pub fn histogram(&self, timed: Timed) -> &Histogram<u64> {
        &self.histograms[timed as usize]
    }

    /// Every name under which something was recorded, with its summary.
    pub fn summaries(&self) -> impl Iterator<Item = (Timed, LatencySummary)> {
        Timed::ALL.into_iter().filter_map(|timed| {
            let histogram = self.histogram(timed);
            (!histogram.is_empty()).then(|| (timed, summary(histogram)))
        })
    }

    /// Where a participant leaves its latencies.
    #[must_use]
    pub fn path(run_dir: &Path, role: Role) -> PathBuf {
        run_dir.join(format!("{role}.latencies"))
    }

    /// Keeps them in a file: for each name the length of its histogram and the histogram, in
    /// `HdrHistogram`'s V2 format.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), LatencyFileError> {
        let mut bytes = Vec::new();
        let mut one = Vec::new();
        let mut serializer = V2Serializer::new();
        for histogram in &self.histograms {
            one.clear();
            serializer
                .serialize(histogram, &mut one)
                .map_err(|_| LatencyFileError::Foreign)?;
            bytes.extend_from_slice(&(one.len() as u64).to_le_bytes());
            bytes.extend_from_slice(&one);
        }
        std::fs::write(path, bytes)?;
        Ok(())
    }

    /// Reads what [`Self::write`] kept.
    ///
    /// # Errors
    /// The file cannot be read, or holds something else.
    pub fn read(path: &Path) -> Result<Self, LatencyFileError> {
        let bytes = std::fs::read(path)?;
        let mut rest = bytes.as_slice();
        let mut histograms = Vec::new();
        let mut deserializer = Deserializer::new();
        for _ in Timed::ALL {
            let (length, tail) = rest.split_first_chunk().ok_or(LatencyFileError::Foreign)?;
            let length = usize::try_from(u64::from_le_bytes(*length))
                .map_err(|_| LatencyFileError::Foreign)?;
            let (mut one, tail) = tail
                .split_at_checked(length)
                .ok_or(LatencyFileError::Foreign)?;
            histograms.push(
                deserializer
                    .deserialize(&mut one)
                    .map_err(|_| LatencyFileError::Foreign)?,
            );
            rest = tail;
        }
        Ok(Self { histograms })
    }
}

/// A histogram with the bounds of them all.
#[must_use]
pub fn empty() -> Histogram<u64> {
    #[expect(
        clippy::expect_used,
        reason = "the bounds are constants, and a test makes one"
    )]
    Histogram::new_with_bounds(1, HIGHEST_NS, DIGITS).expect("constant bounds are legal")
}

/// What a result says of `histogram`.
#[must_use]
pub fn summary(histogram: &Histogram<u64>) -> LatencySummary {
    LatencySummary {
        count: histogram.len(),
        p50_ns: histogram.value_at_quantile(0.5),
        p99_ns: histogram.value_at_quantile(0.99),
        p999_ns: histogram.value_at_quantile(0.999),
        max_ns: histogram.max(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_in_files_adds_up() {
        let directory = tempfile::tempdir().unwrap();
        let mut sum = Latencies::new();
        for process in 0..3_u64 {
            let mut own = Latencies::new();
            for i in 0..100 {
                own.record(Timed::SnapshotAge, 1_000 + process * 100 + i);
            }
            own.record(Timed::HardRoundTrip, u64::MAX);
            let path = directory.path().join(format!("{process}"));
            own.write(&path).unwrap();
            sum.merge(&Latencies::read(&path).unwrap());
        }
        let all: Vec<_> = sum.summaries().collect();
        assert_eq!(all.len(), 2);
        assert_eq!(all[0].0, Timed::SnapshotAge);
        assert_eq!(all[0].1.count, 300);
        assert!((1_100..=1_210).contains(&all[0].1.p50_ns));
        assert!(
            all[1].1.max_ns >= HIGHEST_NS,
            "a long one counts as the longest"
        );
    }

    #[test]
    fn a_truncated_file_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("latencies");
        Latencies::new().write(&path).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert!(matches!(
            Latencies::read(&path),
            Err(LatencyFileError::Foreign)
        ));
    }
}
