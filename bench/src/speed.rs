//! How much faster than its own time the world runs: in process, and in lockstep with real
//! processes.
//!
//! Responsible for: running a scenario again and again until enough ticks are measured, and the
//! numbers that follow.
//! Not responsible for: how processes are started (the caller hands in a closure), checking the
//! runs, or printing.
//!
//! Terms: *world* seconds are what the robots live in, *wall* seconds what the user waits. Only
//! ticks are timed: setting up, constructing and reporting are not.

use std::time::Instant;

use scene::{Scene, Settings};
use serde::Serialize;
use shm_types::{Activity, Outcome};
use sim::Simulation;

use crate::machine::{Machine, date_utc};

/// What to measure.
#[derive(Clone, Debug)]
pub struct Workload<'a> {
    /// The room.
    pub scene: &'a Scene,
    /// What the machines are asked to do.
    pub settings: &'a Settings,
    /// Fewest ticks with each driver.
    pub ticks: u64,
}

/// One run from its first tick to its last.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Run {
    /// Ticks made.
    pub ticks: u64,
    /// World time that passed, seconds.
    pub world_s: f64,
    /// Wall time that passed, seconds.
    pub wall_s: f64,
    /// Ticks in which a robot moved, summed over the robots.
    pub moving: u64,
}

/// What was measured with one driver.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Speed {
    /// Name of the driver.
    pub driver: &'static str,
    /// Processes that took part in each tick.
    pub processes: usize,
    /// Complete runs.
    pub runs: u64,
    /// Ticks of all runs.
    pub ticks: u64,
    /// World time of all runs, seconds.
    pub world_s: f64,
    /// Wall time of all runs, seconds.
    pub wall_s: f64,
    /// World seconds per wall second.
    pub ratio: f64,
    /// Wall time of a tick, mean, microseconds.
    pub us_per_tick: f64,
    /// Robots that moved, mean over the ticks.
    pub moving_robots: f64,
}

/// The whole measurement.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// When, UTC.
    pub date: String,
    /// Where.
    pub machine: Machine,
    /// Name of the room.
    pub scenario: String,
    /// Robots in it.
    pub robots: usize,
    /// Objects in it.
    pub objects: usize,
    /// What the machines were asked to do.
    pub settings: Settings,
    /// One row a driver.
    pub rows: Vec<Speed>,
}

impl Report {
    /// A report on `workload` with these rows, of here and now.
    #[must_use]
    pub fn new(workload: &Workload<'_>, rows: Vec<Speed>) -> Self {
        Self {
            date: date_utc(),
            machine: Machine::current(),
            scenario: workload.scene.name.clone(),
            robots: workload.scene.homes.len(),
            objects: workload.scene.objects.len(),
            settings: workload.settings.clone(),
            rows,
        }
    }
}

/// Runs all machines in this thread.
#[must_use]
pub fn in_process(workload: &Workload<'_>) -> Speed {
    let once = || Ok::<_, std::convert::Infallible>(run_in_process(workload));
    match repeat("in-process", 1, workload.ticks, once) {
        Ok(speed) => speed,
        Err(never) => match never {},
    }
}

/// Runs real processes in lockstep; `run` makes one complete run of `processes` processes.
///
/// # Errors
/// What `run` returns.
pub fn lockstep<E>(
    workload: &Workload<'_>,
    processes: usize,
    run: impl FnMut() -> Result<Run, E>,
) -> Result<Speed, E> {
    repeat("lockstep", processes, workload.ticks, run)
}

fn repeat<E>(
    driver: &'static str,
    processes: usize,
    ticks: u64,
    mut run: impl FnMut() -> Result<Run, E>,
) -> Result<Speed, E> {
    let (mut runs, mut sum) = (0, Run::default());
    while sum.ticks < ticks {
        let one = run()?;
        runs += 1;
        sum.ticks += one.ticks;
        sum.world_s += one.world_s;
        sum.wall_s += one.wall_s;
        sum.moving += one.moving;
        if one.ticks == 0 {
            break;
        }
    }
    Ok(Speed {
        driver,
        processes,
        runs,
        ticks: sum.ticks,
        world_s: sum.world_s,
        wall_s: sum.wall_s,
        ratio: sum.world_s / sum.wall_s,
        us_per_tick: sum.wall_s * 1e6 / sum.ticks as f64,
        moving_robots: sum.moving as f64 / sum.ticks as f64,
    })
}

fn run_in_process(workload: &Workload<'_>) -> Run {
    let mut simulation = Simulation::new(workload.scene, workload.settings, 0);
    let started = Instant::now();
    while simulation.outcome() == Outcome::Running {
        simulation.tick();
    }
    let wall_s = started.elapsed().as_secs_f64();
    let report = simulation.report();
    let moving = report
        .robots
        .iter()
        .map(|robot| robot.times.ticks(Activity::Moving));
    Run {
        ticks: report.ticks,
        world_s: report.time_ns as f64 / 1e9,
        wall_s,
        moving: moving.sum(),
    }
}

#[cfg(test)]
mod tests {
    use scene::Method;

    use super::*;

    fn scene() -> Scene {
        let e1 = scene::builtin("e1").unwrap();
        scene::parse(e1.text, e1.name).unwrap()
    }

    fn settings() -> Settings {
        Settings {
            method: Method::GraspingAndRestricted,
            ..Settings::default()
        }
    }

    #[test]
    fn runs_are_repeated_until_there_are_enough_ticks() {
        let (scene, settings) = (scene(), settings());
        let workload = Workload {
            scene: &scene,
            settings: &settings,
            ticks: 250,
        };
        let one = Run {
            ticks: 100,
            world_s: 1.0,
            wall_s: 0.25,
            moving: 50,
        };
        let speed = lockstep(&workload, 5, || Ok::<_, ()>(one)).unwrap();
        assert_eq!((speed.runs, speed.ticks, speed.processes), (3, 300, 5));
        assert_eq!((speed.ratio, speed.us_per_tick), (4.0, 2_500.0));
        assert_eq!(speed.moving_robots, 0.5);
    }

    #[test]
    fn a_run_that_fails_ends_the_measurement() {
        let (scene, settings) = (scene(), settings());
        let workload = Workload {
            scene: &scene,
            settings: &settings,
            ticks: 1,
        };
        assert_eq!(lockstep(&workload, 5, || Err("lost")), Err("lost"));
    }

    #[test]
    fn in_process_counts_world_time_and_motion() {
        let (scene, settings) = (scene(), settings());
        let workload = Workload {
            scene: &scene,
            settings: &settings,
            ticks: 1,
        };
        let speed = in_process(&workload);
        assert_eq!(speed.runs, 1);
        assert!((speed.world_s - speed.ticks as f64 * 0.01).abs() < 1e-9);
        assert!(speed.moving_robots > 0.0 && speed.moving_robots <= 2.0);
        let report = Report::new(&workload, vec![speed]);
        assert_eq!((report.robots, report.objects), (2, 2));
    }
}
