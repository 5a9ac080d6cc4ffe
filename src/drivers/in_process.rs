//! Everything in this thread: no shared memory, no processes, the same states.
//!
//! Responsible for: ticking the simulation, writing its trace and hashes, timing the ticks.
//! Not responsible for: the order of things within a tick (crate `sim`).

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

use node::report::{ActivityReport, WorkReport};
use node::{Latencies, RunOptions, Timed, WorldReport};
use scene::Scene;
use shm_types::{Activity, Checked, Outcome};
use sim::{SimReport, Simulation};
use trace::{Ending, SceneRecord};

use crate::drivers::Finished;
use crate::drivers::interrupt::Interrupt;
use crate::drivers::recording::Recording;
use crate::exit::Failure;
use crate::progress::{PERIOD, Progress};
use crate::result::{RoleLine, seconds};

/// Identity of a run in process: there is never another one to tell it from.
const RUN_ID: u64 = 0;

/// Runs `scene` to its end.
///
/// # Errors
/// A file cannot be made.
pub(crate) fn run(
    scene: &Scene,
    options: &RunOptions,
    progress: &Progress,
) -> Result<Finished, Failure> {
    let interrupt = Interrupt::watch()
        .map_err(|error| Failure::system(format!("signals cannot be watched: {error}")))?;
    let record = SceneRecord::new(scene, &options.settings, RUN_ID);
    let every_ns = (1e9 / options.state_rate_hz) as u64;
    let mut recording =
        Recording::start(options.trace.as_deref(), &record, every_ns).map_err(Failure::system)?;
    let mut hashes = options.hashes.as_deref().map(create).transpose()?;

    let mut simulation = Simulation::new(scene, &options.settings, RUN_ID);
    let mut latency = Latencies::new();
    let (started, mut shown) = (Instant::now(), Instant::now());
    let mut before = started;
    while simulation.outcome() == Outcome::Running {
        if interrupt.is_asked() {
            simulation.stop();
        }
        simulation.tick();
        let after = Instant::now();
        latency.record(Timed::Tick, (after - before).as_nanos() as u64);
        let snapshot = Checked::new(simulation.snapshot(), scene.counts())
            .map_err(|error| Failure::system(format!("a snapshot is invalid: {error}")))?;
        recording
            .tick(snapshot, simulation.motion(), after)
            .map_err(Failure::system)?;
        if let Some(file) = &mut hashes {
            writeln!(file, "{:016x}", snapshot.header.state_hash).map_err(unwritten)?;
        }
        if after - shown >= PERIOD {
            shown = after;
            progress.show(snapshot);
        }
        before = Instant::now();
    }
    let wall_s = started.elapsed().as_secs_f64();
    if let Some(file) = &mut hashes {
        file.flush().map_err(unwritten)?;
    }
    let report = simulation.report();
    let roles = vec![RoleLine {
        role: "in-process".to_owned(),
        pid: std::process::id(),
        ticks_answered: report.ticks,
        cpu_s: cpu_s(),
    }];
    let check = recording
        .finish(ending(&report, options))
        .map_err(Failure::system)?;
    Ok(Finished {
        check: Some(check),
        wall_s,
        latency,
        roles,
        ..finished(report)
    })
}

/// Processor time of this thread so far, seconds, where the kernel tells.
fn cpu_s() -> f64 {
    let text = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let first = text.split_whitespace().next();
    first.and_then(|ns| ns.parse().ok()).map_or(0.0, seconds)
}

fn create(path: &Path) -> Result<BufWriter<File>, Failure> {
    let file = File::create(path).map_err(|error| {
        Failure::system(format!("{} cannot be written: {error}", path.display()))
    })?;
    Ok(BufWriter::new(file))
}

fn unwritten(error: std::io::Error) -> Failure {
    Failure::system(format!("the hashes cannot be written: {error}"))
}

fn ending(report: &SimReport, options: &RunOptions) -> Ending {
    Ending {
        outcome: report.outcome.into(),
        reason: report.reason.clone(),
        makespan_ns: report.time_ns,
        options: serde_json::to_value(options).unwrap_or_default(),
    }
}

fn finished(report: SimReport) -> Finished {
    let mut work = WorkReport::from(report.planner);
    for robot in &report.robots {
        work.add(&WorkReport::from(robot.counters));
    }
    let activities = report.robots.iter().map(|robot| {
        let mut ticks = ActivityReport::default();
        for activity in Activity::ALL {
            *ticks.of_mut(*activity) = robot.times.ticks(*activity);
        }
        ticks
    });
    Finished {
        outcome: report.outcome,
        reason: report.reason,
        world: WorldReport {
            outcome: report.outcome.code(),
            reason: None,
            ticks: report.ticks,
            time_ns: report.time_ns,
            state_hash: report.state_hash,
            hard_constraints: report.hard_constraints,
            task_failures: report.world.task_failures,
            grants_refused: report.world.grants_refused,
            selection_conflicts: report.world.selection_conflicts,
            violations: report.world.violations,
            swept_tests: report.world.swept_tests,
            activities: activities.collect(),
        },
        work,
        latency: Latencies::new(),
        roles: Vec::new(),
        deadline_misses: 0,
        restarts: 0,
        lost_commands: 0,
        wall_s: 0.0,
        oversubscribed: false,
        notes: Vec::new(),
        check: None,
    }
}
