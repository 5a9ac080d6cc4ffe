//! One run in one room, with all that is asked of it.
//!
//! Responsible for: running in process, when the first robot moved, what was computed before and
//! after that, giving up.
//! Not responsible for: which runs are made (`solve`).
//!
//! Terms: *planning* is every step of the planner service and of robots: with the default method
//! nearly all of it is the service's, with the paper's four nearly all of it the robots'.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use scene::{Scene, Settings};
use shm_types::{Activity, Outcome, Verdict, WorldSnapshot};
use sim::Simulation;

use crate::paper::run::{Stopwatch, word};
use crate::results::{Table, Value};

/// The word for a run that took too long on the wall.
pub const GIVEN_UP: &str = "given-up";
/// The word for a run whose planner has proved that there is no plan in its model.
pub const INFEASIBLE: &str = "infeasible";
/// Longest reason in a row, characters.
const MOST_REASON: usize = 160;

/// What a run came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// How it ended: the word for an outcome, or [`GIVEN_UP`].
    pub outcome: &'static str,
    /// Why, where the outcome alone does not say.
    pub reason: Option<String>,
    /// World time at its end, s.
    pub makespan_s: f64,
    /// Tick in which the first robot moved, if one did.
    pub first_motion_tick: Option<u64>,
    /// World time until then, s.
    pub first_motion_s: Option<f64>,
    /// Ticks in which a robot computed after that, summed over robots.
    pub computing_after_ticks: u64,
    /// Wall time of planning until the first robot moved, s.
    pub planning_before_wall_s: f64,
    /// Wall time of planning in all, s.
    pub planning_wall_s: f64,
    /// Wall time of the whole run, s.
    pub run_wall_s: f64,
}

impl Run {
    /// Whether every object and robot is where it should be.
    #[must_use]
    pub fn is_solved(&self) -> bool {
        self.outcome == word(Outcome::Solved)
    }

    /// Cells under [`columns`].
    #[must_use]
    pub fn values(&self) -> Vec<Value> {
        let solved = self.is_solved();
        vec![
            self.outcome.into(),
            f64::from(u8::from(solved)).into(),
            solved.then_some(self.makespan_s).into(),
            self.first_motion_tick.into(),
            self.first_motion_s.into(),
            self.computing_after_ticks.into(),
            self.planning_before_wall_s.into(),
            self.planning_wall_s.into(),
            self.run_wall_s.into(),
            self.reason.clone().into(),
        ]
    }
}

/// The table with the columns of a run.
#[must_use]
pub fn columns(table: Table) -> Table {
    table
        .info(
            "outcome",
            "",
            "how the run ended; infeasible: no plan on its lattice, by exhaustion; given-up: it took too long on the wall",
        )
        .higher(
            "solved",
            "",
            "1 if all objects and robots are where they should be",
        )
        .lower("makespan_s", "s", "world time until the end, where solved")
        .info(
            "first_motion_tick",
            "",
            "tick in which the first robot moved",
        )
        .lower(
            "first_motion_s",
            "s",
            "world time until then: all planning before the first motion",
        )
        .info(
            "computing_after_ticks",
            "",
            "ticks in which a robot computed after that, summed over robots",
        )
        .info(
            "planning_before_wall_s",
            "s",
            "wall time of planning until then",
        )
        .info("planning_wall_s", "s", "wall time of planning in all")
        .info("run_wall_s", "s", "wall time of the run, world included")
        .info("reason", "", "why it ended so")
}

/// Runs to the end, or until the wall clock shows `until`, or `stop` is set.
#[must_use]
pub fn run(scene: &Scene, settings: &Settings, until: Instant, stop: &AtomicBool) -> Run {
    let begun = Instant::now();
    let mut simulation = Simulation::new(scene, settings, 0);
    let mut watch = Stopwatch::new();
    let mut run = Run::default();
    let mut given_up = false;
    while simulation.outcome() == Outcome::Running {
        if stop.load(Ordering::Relaxed) || Instant::now() >= until {
            given_up = true;
            break;
        }
        simulation.tick_probed(&mut watch);
        let snapshot = simulation.snapshot();
        if run.first_motion_tick.is_some() {
            run.computing_after_ticks += count(snapshot, scene, Activity::Computing);
        } else if count(snapshot, scene, Activity::Moving) > 0 {
            run.first_motion_tick = Some(snapshot.header.tick);
            run.first_motion_s = Some(snapshot.header.time_ns as f64 / 1e9);
            run.planning_before_wall_s = watch.sum_s;
        }
    }
    let report = simulation.report();
    if run.first_motion_tick.is_none() {
        run.planning_before_wall_s = watch.sum_s;
    }
    Run {
        outcome: match (given_up, report.outcome) {
            (true, _) => GIVEN_UP,
            (_, Outcome::Stuck) if report.verdict == Verdict::Exhausted => INFEASIBLE,
            (_, outcome) => word(outcome),
        },
        reason: report
            .reason
            .map(|reason| reason.chars().take(MOST_REASON).collect()),
        makespan_s: report.time_ns as f64 / 1e9,
        planning_wall_s: watch.sum_s,
        run_wall_s: begun.elapsed().as_secs_f64(),
        ..run
    }
}

/// Robots that did this in the tick that led to the snapshot.
fn count(snapshot: &WorldSnapshot, scene: &Scene, activity: Activity) -> u64 {
    let robots = snapshot.robots.iter().take(scene.homes.len());
    robots
        .filter(|robot| robot.activity == activity.code())
        .count() as u64
}
