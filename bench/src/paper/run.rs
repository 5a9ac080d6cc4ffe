//! One run of the experiment, and its row.
//!
//! Responsible for: running in process with the steps timed, and the columns of the table.
//! Not responsible for: which runs are made (`paper`).

use std::time::Instant;

use scene::{Compute, Scene, Settings};
use shm_types::{Activity, Counters, Outcome};
use sim::{Participant, Probe, Simulation};

use super::RUNS;
use crate::results::{Table, Value};

/// A run that could not be made, and why.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RunError(pub String);

/// What a run came to. Times are world seconds, means over the robots unless said otherwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measures {
    /// Name of the outcome.
    pub outcome: &'static str,
    /// Time at the end.
    pub makespan_s: f64,
    /// Moving, computing, waiting, gripping, idle: they sum up to the makespan.
    pub activities_s: [f64; 5],
    /// Largest computing time of a robot.
    pub computing_max_s: f64,
    /// Wall time of all steps of robots and planner, seconds, where it was measured.
    pub steps_wall_s: Option<f64>,
    /// Work done by robots and planner.
    pub counters: Counters,
    /// Tasks reported as failed.
    pub task_failures: u64,
    /// Hard constraints that came into force.
    pub hard_constraints: u64,
}

impl Measures {
    /// From the ticks of each robot by activity.
    ///
    /// Shapes: `ticks[robot][activity]`, activities in the order of [`Activity::ALL`].
    #[must_use]
    pub fn of_ticks(outcome: Outcome, ticks: &[[u64; 5]], tick_ns: u64) -> Self {
        let tick_s = tick_ns as f64 / 1e9;
        let robots = ticks.len().max(1) as f64;
        let mean = |activity: usize| {
            let sum: u64 = ticks.iter().map(|robot| robot[activity]).sum();
            sum as f64 * tick_s / robots
        };
        let computing = ticks.iter().map(|robot| robot[COMPUTING]).max();
        let activities_s = std::array::from_fn(mean);
        Self {
            outcome: word(outcome),
            makespan_s: activities_s.iter().sum(),
            activities_s,
            computing_max_s: computing.unwrap_or(0) as f64 * tick_s,
            ..Self::default()
        }
    }
}

/// Places of the activities in [`Measures::activities_s`], and their columns.
pub const ACTIVITIES: [(Activity, &str); 5] = [
    (Activity::Moving, "moving_s"),
    (Activity::Computing, "computing_s"),
    (Activity::Waiting, "waiting_s"),
    (Activity::Gripping, "gripping_s"),
    (Activity::Idle, "idle_s"),
];
const COMPUTING: usize = 1;

/// The word for an outcome.
#[must_use]
pub const fn word(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Running => "running",
        Outcome::Solved => "solved",
        Outcome::Stuck => "stuck",
        Outcome::Timeout => "timeout",
        Outcome::Interrupted => "interrupted",
        Outcome::Violated => "violated",
        Outcome::Failed => "failed",
    }
}

/// Times the steps of robots and planner.
pub(crate) struct Stopwatch {
    since: Instant,
    counting: bool,
    /// Wall time of all of them so far, s.
    pub(crate) sum_s: f64,
}

impl Stopwatch {
    pub(crate) fn new() -> Self {
        Self {
            since: Instant::now(),
            counting: false,
            sum_s: 0.0,
        }
    }

    fn lap(&mut self, counting: bool) {
        let now = Instant::now();
        if self.counting {
            self.sum_s += (now - self.since).as_secs_f64();
        }
        (self.since, self.counting) = (now, counting);
    }
}

impl Probe for Stopwatch {
    fn enter(&mut self, who: Participant) {
        self.lap(who != Participant::World);
    }

    fn leave(&mut self) {
        self.lap(false);
    }
}

/// Runs all machines in this thread.
#[must_use]
pub fn in_process(scene: &Scene, settings: &Settings) -> Measures {
    let mut simulation = Simulation::new(scene, settings, 0);
    let mut stopwatch = Stopwatch::new();
    while simulation.outcome() == Outcome::Running {
        simulation.tick_probed(&mut stopwatch);
    }
    let report = simulation.report();
    let ticks: Vec<_> = report
        .robots
        .iter()
        .map(|robot| ACTIVITIES.map(|(activity, _)| robot.times.ticks(activity)))
        .collect();
    Measures {
        steps_wall_s: Some(stopwatch.sum_s),
        counters: report.counters(),
        task_failures: report.world.task_failures,
        hard_constraints: report.world.constraints_found,
        ..Measures::of_ticks(report.outcome, &ticks, settings.tick_ns)
    }
}

/// A row before it becomes one.
#[derive(Clone, Debug)]
pub struct Row<'a> {
    pub(super) room: &'a str,
    pub(super) set: &'static str,
    pub(super) area_m2: f64,
    pub(super) robots: usize,
    pub(super) method: &'static str,
    pub(super) units_per_second: u64,
    pub(super) compute: Compute,
    pub(super) repeat: usize,
    pub(super) measures: Result<Measures, RunError>,
}

/// The table without rows.
#[must_use]
pub fn table() -> Table {
    let mut table = Table::new(RUNS, "Runs")
        .key("set", "", "the paper's six rooms, or seeded ones")
        .key("room", "", "name of the room")
        .key("area_m2", "m²", "free floor")
        .key("robots", "", "number of robots")
        .key("method", "", "which constraints are computed when")
        .key("units_per_second", "1/s", "modelled speed of a computer")
        .key(
            "compute",
            "",
            "one computer each (own), or one for all (shared)",
        )
        .repeat()
        .info("outcome", "", "how the run ended")
        .higher(
            "solved",
            "",
            "1 if all objects and robots are where they should be",
        )
        .lower("makespan_s", "s", "world time until the end");
    for (_, column) in ACTIVITIES {
        table = match column {
            "moving_s" | "gripping_s" => table.info(column, "s", "world time, mean over robots"),
            _ => table.lower(column, "s", "world time, mean over robots"),
        };
    }
    table
        .lower("computing_max_s", "s", "largest computing time of a robot")
        .info(
            "steps_wall_s",
            "s",
            "wall time of all steps of robots and planner on this machine",
        )
        .info("polygon_tests", "", "easy tests charged")
        .info("path_plans", "", "paths planned, as charged")
        .info("cells_expanded", "", "lattice points expanded")
        .info("task_failures", "", "tasks reported as failed")
        .info(
            "hard_constraints",
            "",
            "hard constraints that came into force",
        )
}

impl Row<'_> {
    /// The cells, in the order of [`table`].
    #[must_use]
    pub fn values(&self) -> Vec<Value> {
        let mut row: Vec<Value> = vec![
            self.set.into(),
            self.room.into(),
            self.area_m2.into(),
            self.robots.into(),
            self.method.into(),
            self.units_per_second.into(),
            self.compute.word().into(),
            self.repeat.into(),
        ];
        match &self.measures {
            Ok(run) => {
                let solved = f64::from(u8::from(run.outcome == word(Outcome::Solved)));
                row.extend([run.outcome.into(), solved.into(), run.makespan_s.into()]);
                row.extend(run.activities_s.map(Value::from));
                row.extend([run.computing_max_s.into(), run.steps_wall_s.into()]);
                let counters = &run.counters;
                row.extend(
                    [
                        counters.polygon_tests,
                        counters.path_plans,
                        counters.cells_expanded,
                        run.task_failures,
                        run.hard_constraints,
                    ]
                    .map(Value::from),
                );
            }
            Err(error) => {
                row.extend([error.to_string().into(), 0.0.into()]);
                row.resize(table().columns.len(), Value::Missing(()));
            }
        }
        row
    }
}
