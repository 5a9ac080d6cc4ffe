//! The result of a run: one JSON object, the same fields whatever the driver and the outcome.
//!
//! Responsible for: names, units and meaning of every field; the exit status an outcome means.
//! Not responsible for: how the numbers came about, or the table people see (`table`).
//!
//! Terms: *world* seconds are what the robots live in; only `wall_s` and the latencies are wall
//! time. Times are accounted per robot (rule 24).

use std::collections::BTreeMap;

use bench::machine::Machine;
use node::report::{ActivityReport, InvariantsReport, WorkReport};
use node::{LatencySummary, RoleReport, RunOptions};
use serde::Serialize;

use crate::exit::Exit;

/// Raised whenever a field changes its meaning or goes away; new fields do not raise it.
pub(crate) const SCHEMA_VERSION: u32 = 1;

/// The whole result.
#[derive(Debug, Serialize)]
pub(crate) struct RunResult {
    pub(crate) schema_version: u32,
    pub(crate) program_version: &'static str,
    /// When the run ended, UTC.
    pub(crate) date: String,
    pub(crate) scenario: String,
    /// Hash of the canonical scenario, hexadecimal.
    pub(crate) scenario_hash: String,
    /// Seed of a generated scenario.
    pub(crate) seed: Option<u64>,
    pub(crate) options: Options,
    pub(crate) machine: Machine,
    pub(crate) method: String,
    /// Number of robots, with those that were added on the way.
    pub(crate) robots: usize,
    /// Number of objects.
    pub(crate) objects: usize,
    pub(crate) driver: &'static str,
    pub(crate) outcome: Ending,
    /// Why, where the outcome alone does not say.
    pub(crate) reason: Option<String>,
    /// World time at the end; nothing if no run took place.
    pub(crate) makespan_s: Option<f64>,
    /// Moving and gripping, mean over robots.
    pub(crate) execution_s: Option<f64>,
    /// Computing, mean over robots.
    pub(crate) planning_s: Option<f64>,
    /// Waiting for a grant or another robot, mean over robots.
    pub(crate) waiting_s: Option<f64>,
    /// Having nothing to do, mean over robots: with the three above it makes the makespan.
    pub(crate) idle_s: Option<f64>,
    /// No plan on this lattice can be shorter (rule 32).
    pub(crate) lower_bound_s: Option<f64>,
    /// R: the best plan that moves each object once takes so long if nothing is ever in the way
    /// (rule 32); nothing if it is not known.
    pub(crate) yardstick_s: Option<f64>,
    pub(crate) times: Option<Times>,
    pub(crate) counts: Counts,
    pub(crate) checker: Option<Checker>,
    /// What the world itself checked in every tick; nothing if no run took place.
    pub(crate) invariants: Option<InvariantsReport>,
    pub(crate) latency: BTreeMap<&'static str, LatencySummary>,
    pub(crate) roles: Vec<RoleLine>,
    pub(crate) ticks: u64,
    /// Hash of all states, chained over the ticks, hexadecimal.
    pub(crate) state_hash: String,
    pub(crate) wall_s: f64,
    /// More processes than cores: latencies then measure the scheduler as well.
    pub(crate) oversubscribed: bool,
    /// Where the trace was kept: where it was asked for, or, of a run in which an invariant is
    /// broken, in the directory for temporary files.
    pub(crate) trace: Option<String>,
    /// Things the user should know, such as a priority that was not permitted.
    pub(crate) notes: Vec<String>,
}

/// How it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Ending {
    Solved,
    Infeasible,
    Stuck,
    Timeout,
    Interrupted,
    /// Shared memory, a process or a file failed.
    Failed,
    /// An invariant is broken. Results say "failed"; the exit status tells the two apart.
    #[serde(rename = "failed")]
    Violated,
}

/// Every option in force, defaults included.
#[derive(Debug, Serialize)]
pub(crate) struct Options {
    #[serde(flatten)]
    pub(crate) run: RunOptions,
    /// Tick, budget and so on follow from `settings`; this is what a tick's budget comes to.
    pub(crate) units_per_tick: u64,
}

/// Times of the robots, world seconds.
#[derive(Debug, Serialize)]
pub(crate) struct Times {
    pub(crate) mean: RobotTimes,
    /// Largest of each activity over the robots.
    pub(crate) max: RobotTimes,
    /// In the order of the robots.
    pub(crate) per_robot: Vec<RobotTimes>,
}

/// How one robot spent its time, world seconds. The five sum up to the makespan; of a robot that was
/// added on the way, the time before counts as idle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct RobotTimes {
    pub(crate) moving_s: f64,
    pub(crate) computing_s: f64,
    pub(crate) waiting_s: f64,
    pub(crate) gripping_s: f64,
    pub(crate) idle_s: f64,
}

/// What was done how often.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Counts {
    pub(crate) polygon_tests: u64,
    pub(crate) path_plans: u64,
    pub(crate) cells_expanded: u64,
    pub(crate) easy_constraints: u64,
    pub(crate) hard_constraints: u64,
    pub(crate) task_failures: u64,
    pub(crate) selections: u64,
    pub(crate) selection_conflicts: u64,
    pub(crate) grants_refused: u64,
    /// Path requests that were no sound ones: a plan through a wall, for example.
    pub(crate) invalid_requests: u64,
    /// Schedules that the world refused whole.
    pub(crate) schedules_refused: u64,
    pub(crate) scene_changes: u64,
    pub(crate) deadline_misses: u64,
    pub(crate) restarts: u64,
    pub(crate) lost_commands: u64,
    /// Work units spent by robots and planner.
    pub(crate) units: u64,
}

/// What the checker found in the trace.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Checker {
    pub(crate) violations: u64,
    pub(crate) swept_tests: u64,
    /// Whether the trace has everything; otherwise the check says less than it could.
    pub(crate) complete: bool,
    /// The first violations in words.
    pub(crate) first: Vec<String>,
}

/// One process of the run.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct RoleLine {
    pub(crate) role: String,
    pub(crate) pid: u32,
    pub(crate) ticks_answered: u64,
    pub(crate) cpu_s: f64,
}

impl Ending {
    /// The status to end with.
    pub(crate) const fn exit(self) -> Exit {
        match self {
            Self::Solved => Exit::Success,
            Self::Infeasible => Exit::Infeasible,
            Self::Stuck | Self::Timeout => Exit::Unfinished,
            Self::Interrupted => Exit::Interrupted,
            Self::Failed => Exit::System,
            Self::Violated => Exit::Invariant,
        }
    }

    /// The word in results.
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::Solved => "solved",
            Self::Infeasible => "infeasible",
            Self::Stuck => "stuck",
            Self::Timeout => "timeout",
            Self::Interrupted => "interrupted",
            Self::Failed | Self::Violated => "failed",
        }
    }
}

impl Times {
    /// Seconds from ticks; nothing without robots.
    pub(crate) fn new(activities: &[ActivityReport], tick_ns: u64) -> Option<Self> {
        let per_robot: Vec<_> = activities
            .iter()
            .map(|ticks| RobotTimes::from_ticks(ticks, tick_ns))
            .collect();
        let count = per_robot.len() as f64;
        let sum = per_robot
            .iter()
            .copied()
            .reduce(|a, b| a.with(b, |a, b| a + b))?;
        Some(Self {
            mean: sum.with(sum, |a, _| a / count),
            max: per_robot
                .iter()
                .copied()
                .reduce(|a, b| a.with(b, f64::max))?,
            per_robot,
        })
    }
}

impl RobotTimes {
    fn from_ticks(ticks: &ActivityReport, tick_ns: u64) -> Self {
        let seconds = |ticks: u64| seconds(ticks * tick_ns);
        Self {
            moving_s: seconds(ticks.moving),
            computing_s: seconds(ticks.computing),
            waiting_s: seconds(ticks.waiting),
            gripping_s: seconds(ticks.gripping),
            idle_s: seconds(ticks.idle),
        }
    }

    fn with(self, other: Self, combine: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            moving_s: combine(self.moving_s, other.moving_s),
            computing_s: combine(self.computing_s, other.computing_s),
            waiting_s: combine(self.waiting_s, other.waiting_s),
            gripping_s: combine(self.gripping_s, other.gripping_s),
            idle_s: combine(self.idle_s, other.idle_s),
        }
    }
}

impl Counts {
    /// Takes over the work of robots and planner.
    pub(crate) fn add_work(&mut self, work: &WorkReport) {
        self.polygon_tests += work.polygon_tests;
        self.path_plans += work.path_plans;
        self.cells_expanded += work.cells_expanded;
        self.easy_constraints += work.easy_constraints;
        self.selections += work.selections;
        self.units += work.units;
    }
}

impl From<&RoleReport> for RoleLine {
    fn from(report: &RoleReport) -> Self {
        Self {
            role: report.role.to_string(),
            pid: report.pid,
            ticks_answered: report.ticks_answered,
            cpu_s: report.cpu_s,
        }
    }
}

/// Seconds in `ns` nanoseconds.
pub(crate) fn seconds(ns: u64) -> f64 {
    ns as f64 / 1e9
}

/// A 64-bit hash as results write it: hexadecimal, since JSON numbers are no integers.
pub(crate) fn hex(hash: u64) -> String {
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_of_the_activities_make_the_makespan() {
        let robots = [
            ActivityReport {
                moving: 60,
                computing: 10,
                waiting: 5,
                gripping: 5,
                idle: 20,
            },
            ActivityReport {
                moving: 0,
                computing: 30,
                waiting: 0,
                gripping: 0,
                idle: 70,
            },
        ];
        let times = Times::new(&robots, 10_000_000).unwrap();
        let mean = times.mean;
        let sum = mean.moving_s + mean.computing_s + mean.waiting_s + mean.gripping_s + mean.idle_s;
        assert!((sum - 1.0).abs() < 1e-12);
        assert_eq!(times.max.idle_s, 0.7);
        assert_eq!(times.max.moving_s, 0.6);
        assert!(Times::new(&[], 10_000_000).is_none());
    }

    #[test]
    fn a_broken_invariant_is_told_from_a_failed_system_by_the_status_alone() {
        let words = [Ending::Failed, Ending::Violated].map(|e| serde_json::to_string(&e).unwrap());
        assert_eq!(words, ["\"failed\"", "\"failed\""]);
        assert_ne!(Ending::Failed.exit(), Ending::Violated.exit());
    }
}
