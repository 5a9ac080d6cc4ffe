//! What is left of a run: one report per process, merged by the supervisor.
//!
//! Responsible for: the files processes leave in the run's directory at exit, and the sum of them.
//! Not responsible for: what is printed (the binary's) or what was measured (`histograms`).

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use shm_types::{Activity, Counters, Outcome};
use world::{Checks, Invariant, Violation};

use crate::histograms::Latencies;
use crate::options::Role;

/// What every process reports of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RoleReport {
    /// Which participant.
    pub role: Role,
    /// Its process id.
    pub pid: u32,
    /// Which process of this participant it was, from 1: what follows is of this one alone.
    pub incarnation: u32,
    /// Ticks it answered (the world: ticks it made).
    pub ticks_answered: u64,
    /// Processor time it used, user and system, seconds.
    pub cpu_s: f64,
    /// Wall time from its first answer to its last, seconds.
    pub wall_s: f64,
    /// Real time: periods it was too late for, and skipped.
    pub deadline_misses: u64,
    /// Snapshots that were gone before it looked, the warm-up not counted.
    pub snapshots_skipped: u64,
    /// Messages it knows it lost: for the world commands that never arrived or were invalid, for
    /// the recorder batches, for robots constraint tables.
    pub lost: u64,
    /// Work its machine did, for robots and planner.
    pub counters: WorkReport,
    /// Things its user should know, such as a priority that was not permitted.
    pub notes: Vec<String>,
    /// What only the world knows.
    pub world: Option<WorldReport>,
    /// What only the recorder knows.
    pub recorder: Option<RecorderSummary>,
}

/// [`Counters`], as they are kept in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[expect(
    missing_docs,
    reason = "each is the counter of its name in shm_types::Counters"
)]
pub struct WorkReport {
    pub polygon_tests: u64,
    pub path_plans: u64,
    pub cells_expanded: u64,
    pub selections: u64,
    pub easy_constraints: u64,
    pub units: u64,
}

impl From<Counters> for WorkReport {
    fn from(counters: Counters) -> Self {
        Self {
            polygon_tests: counters.polygon_tests,
            path_plans: counters.path_plans,
            cells_expanded: counters.cells_expanded,
            selections: counters.selections,
            easy_constraints: counters.easy_constraints,
            units: counters.units,
        }
    }
}

impl WorkReport {
    /// Adds another participant's work.
    pub fn add(&mut self, other: &Self) {
        self.polygon_tests += other.polygon_tests;
        self.path_plans += other.path_plans;
        self.cells_expanded += other.cells_expanded;
        self.selections += other.selections;
        self.easy_constraints += other.easy_constraints;
        self.units += other.units;
    }
}

/// Ticks a robot spent in each [`Activity`]; they sum up to the ticks of the run (rule 24).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "each is the activity of its name")]
pub struct ActivityReport {
    pub moving: u64,
    pub computing: u64,
    pub waiting: u64,
    pub gripping: u64,
    pub idle: u64,
}

impl ActivityReport {
    /// The ticks of one activity.
    pub const fn of_mut(&mut self, activity: Activity) -> &mut u64 {
        match activity {
            Activity::Moving => &mut self.moving,
            Activity::Computing => &mut self.computing,
            Activity::Waiting => &mut self.waiting,
            Activity::Gripping => &mut self.gripping,
            Activity::Idle => &mut self.idle,
        }
    }
}

/// How often one invariant was checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChecksReport {
    /// For how many robots, pairs of them or objects, summed over the ticks.
    pub checks: u64,
    /// For how many of these something had changed, so that it was looked at anew.
    pub anew: u64,
    /// How often it was found broken: the first time ends the run.
    pub violations: u64,
}

/// How often the world checked its invariants.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InvariantsReport {
    /// By name.
    #[serde(flatten)]
    pub by_name: BTreeMap<String, ChecksReport>,
    /// Swept tests that took.
    pub swept_tests: u64,
}

impl InvariantsReport {
    /// What a world has counted, and what it has found.
    #[must_use]
    pub fn new(checks: &Checks, found: Option<Violation>) -> Self {
        let of = |invariant: Invariant| ChecksReport {
            checks: checks.made(invariant),
            anew: checks.anew(invariant),
            violations: u64::from(found.is_some_and(|found| found.invariant() == invariant)),
        };
        let names = Invariant::ALL.map(|invariant| (invariant.word().to_owned(), of(invariant)));
        Self {
            by_name: names.into(),
            swept_tests: checks.swept_tests,
        }
    }

    /// All together.
    #[must_use]
    pub fn total(&self) -> ChecksReport {
        let all = self.by_name.values();
        all.fold(ChecksReport::default(), |sum, one| ChecksReport {
            checks: sum.checks + one.checks,
            anew: sum.anew + one.anew,
            violations: sum.violations + one.violations,
        })
    }
}

/// What the world knows at the end.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WorldReport {
    /// Code of the [`Outcome`].
    pub outcome: u32,
    /// Code of the [`Verdict`](shm_types::Verdict): what the planner said of the run's end.
    pub verdict: u32,
    /// Why it is stuck, failed or violated, if it is.
    pub reason: Option<String>,
    /// Ticks made.
    pub ticks: u64,
    /// Virtual time at the end, ns.
    pub time_ns: u64,
    /// State hash of the last tick, chained over all.
    pub state_hash: u64,
    /// Hard constraints that came into force, each once for every time it did.
    pub hard_constraints: u64,
    /// Tasks reported as failed.
    pub task_failures: u64,
    /// Path requests refused because they contradicted the state.
    pub grants_refused: u64,
    /// Path requests that were no sound ones: dropped.
    pub invalid_requests: u64,
    /// Schedules refused whole.
    pub schedules_refused: u64,
    /// The newest of them, in words.
    pub refused_schedule: Option<String>,
    /// How often the scene was changed.
    pub scene_changes: u64,
    /// Claims on one task by two robots in one tick.
    pub selection_conflicts: u64,
    /// The invariants that were checked in every tick.
    pub invariants: InvariantsReport,
    /// Ticks of each activity, per robot.
    pub activities: Vec<ActivityReport>,
}

/// What the recorder knows at the end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecorderSummary {
    /// Batches written.
    pub batches: u64,
    /// Batches that never reached it.
    pub lost: u64,
    /// Whether no batch is missing, the last one included.
    pub complete: bool,
}

/// How a run ended, as its processes tell it.
#[derive(Debug)]
pub struct RunReport {
    /// Identity of the run.
    pub run_id: u64,
    /// Its name.
    pub name: String,
    /// How it ended. [`Outcome::Failed`] when a process was lost.
    pub outcome: Outcome,
    /// Why, where the outcome alone does not say.
    pub reason: Option<String>,
    /// The world's account; what was last seen of it if the world was lost.
    pub world: WorldReport,
    /// Every process, world first, then planner, recorder, robots.
    pub roles: Vec<RoleReport>,
    /// Work of robots and planner together.
    pub counters: WorkReport,
    /// Latencies of all processes, merged by name.
    pub latency: Latencies,
    /// Real time: periods missed by any process.
    pub deadline_misses: u64,
    /// Snapshots that were gone before a robot or the planner looked, warm-up not counted.
    pub snapshots_skipped: u64,
    /// Commands that never reached the world, or were invalid.
    pub lost_commands: u64,
    /// Processes started again during set-up.
    pub restarts: u64,
    /// Wall time from the first tick to the last, seconds.
    pub wall_s: f64,
    /// Whether there were more processes than cores.
    pub oversubscribed: bool,
    /// Where the trace can be read, if there is one. Unless the plan named a place for it, it has
    /// no name any more, can be read only by this process, and goes when this report is dropped.
    pub trace: Option<PathBuf>,
    /// Things a user should know.
    pub notes: Vec<String>,
    pub(crate) _trace: Option<fs::File>,
}

impl RoleReport {
    /// What is known of a process that has left no report.
    pub(crate) const fn missing(role: Role, pid: u32) -> Self {
        Self {
            role,
            pid,
            incarnation: 0,
            ticks_answered: 0,
            cpu_s: 0.0,
            wall_s: 0.0,
            deadline_misses: 0,
            snapshots_skipped: 0,
            lost: 0,
            counters: WorkReport {
                polygon_tests: 0,
                path_plans: 0,
                cells_expanded: 0,
                selections: 0,
                easy_constraints: 0,
                units: 0,
            },
            notes: Vec::new(),
            world: None,
            recorder: None,
        }
    }

    /// Where a participant leaves its report.
    #[must_use]
    pub fn path(run_dir: &Path, role: Role) -> PathBuf {
        run_dir.join(format!("{role}.report.json"))
    }

    /// Leaves it.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn write(&self, run_dir: &Path) -> io::Result<()> {
        let text = serde_json::to_vec(self)?;
        fs::write(Self::path(run_dir, self.role), text)
    }

    /// Reads what a participant has left.
    ///
    /// # Errors
    /// It has left nothing, or nothing of this version.
    pub(crate) fn read(run_dir: &Path, role: Role) -> io::Result<Self> {
        Ok(serde_json::from_slice(&fs::read(Self::path(
            run_dir, role,
        ))?)?)
    }
}
