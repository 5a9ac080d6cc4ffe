//! Everything in this thread: no shared memory, no processes, the same states.
//!
//! Responsible for: ticking the simulation, writing its trace and hashes, timing the ticks.
//! Not responsible for: the order of things within a tick (crate `sim`).

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use node::report::{ActivityReport, InvariantsReport, WorkReport};
use node::{Latencies, RunOptions, Timed, Told, WorldReport};
use scene::Scene;
use shm_types::{Activity, Checked, ControlKind, Outcome, WorldSnapshot};
use sim::{SimReport, Simulation};
use trace::{CheckReport, Ending, SceneRecord};

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
/// A file cannot be made or written.
pub(crate) fn run(
    scene: &Scene,
    options: &RunOptions,
    progress: &Progress,
) -> Result<Finished, Failure> {
    let interrupt = Interrupt::watch()
        .map_err(|error| Failure::system(format!("signals cannot be watched: {error}")))?;
    let mut files = Files::create(scene, options)?;
    let mut simulation = Simulation::new(scene, &options.settings, RUN_ID);
    files.add_state(scene, simulation.snapshot())?;
    let mut latency = Latencies::new();
    let started = Instant::now();
    let (mut shown, mut before) = (started, started);
    let mut notes = Vec::new();
    while simulation.outcome() == Outcome::Running {
        if interrupt.is_asked() {
            simulation.stop();
        }
        let tick = simulation.snapshot().header.tick;
        for told in options.changes.iter().filter(|told| told.tick == tick) {
            if let Err(why) = tell(&mut simulation, &told.what) {
                notes.push(told.not_made(&why));
            }
        }
        simulation.tick();
        let after = Instant::now();
        latency.record(Timed::Tick, (after - before).as_nanos() as u64);
        files.add_tick(options, &simulation)?;
        if after - shown >= PERIOD {
            shown = after;
            progress.show(checked(simulation.snapshot(), simulation.scene())?);
        }
        before = Instant::now();
    }
    let wall_s = started.elapsed().as_secs_f64();
    let report = simulation.report();
    let role = RoleLine {
        role: "in-process".to_owned(),
        pid: std::process::id(),
        ticks_answered: report.ticks,
        cpu_s: cpu_s(),
    };
    let (check, evidence) = files.finish(ending(&report, options))?;
    Ok(Finished {
        check: Some(check),
        evidence,
        wall_s,
        latency,
        roles: vec![role],
        notes,
        ..finished(report)
    })
}

/// Tells the run of a change: why it would not have it, if so.
fn tell(simulation: &mut Simulation<'_>, told: &Told) -> Result<u64, String> {
    match told {
        Told::Change(changes) => (simulation.change(changes)).map_err(|why| why.to_string()),
        Told::Lose(robot) => simulation.take_part(ControlKind::Down, *robot as usize),
        Told::Back(robot) => simulation.take_part(ControlKind::Up, *robot as usize),
    }
}

/// What a run writes while it goes on.
struct Files {
    recording: Recording,
    /// Version of the scene that it is at.
    version: u32,
    hashes: Option<BufWriter<File>>,
}

impl Files {
    fn create(scene: &Scene, options: &RunOptions) -> Result<Self, Failure> {
        let record = SceneRecord::new(scene, &options.settings, RUN_ID);
        let every_ns = (1e9 / options.state_rate_hz) as u64;
        Ok(Self {
            hashes: options.hashes.as_deref().map(create).transpose()?,
            version: 0,
            recording: Recording::start(options.trace.as_deref(), &record, every_ns)
                .map_err(Failure::system)?,
        })
    }

    fn add_state(&mut self, scene: &Scene, snapshot: &WorldSnapshot) -> Result<(), Failure> {
        let snapshot = checked(snapshot, scene)?;
        self.recording.state(snapshot).map_err(Failure::system)
    }

    fn add_tick(
        &mut self,
        options: &RunOptions,
        simulation: &Simulation<'_>,
    ) -> Result<(), Failure> {
        let scene = simulation.scene();
        let version = simulation.snapshot().header.scene_version;
        if version != self.version {
            self.version = version;
            let record = SceneRecord::new(scene, &options.settings, RUN_ID);
            self.recording.change(&record).map_err(Failure::system)?;
        }
        self.recording
            .motion(simulation.motion())
            .map_err(Failure::system)?;
        self.add_state(scene, simulation.snapshot())?;
        if let Some(file) = &mut self.hashes {
            let hash = simulation.snapshot().header.state_hash;
            writeln!(file, "{hash:016x}").map_err(unwritten)?;
        }
        Ok(())
    }

    fn finish(self, ending: Ending) -> Result<(CheckReport, Option<PathBuf>), Failure> {
        if let Some(mut file) = self.hashes {
            file.flush().map_err(unwritten)?;
        }
        self.recording.finish(ending).map_err(Failure::system)
    }
}

fn checked<'a>(
    snapshot: &'a WorldSnapshot,
    scene: &Scene,
) -> Result<Checked<'a, WorldSnapshot>, Failure> {
    Checked::new(snapshot, scene.counts())
        .map_err(|error| Failure::system(format!("a snapshot is invalid: {error}")))
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
            verdict: report.verdict.code(),
            reason: None,
            ticks: report.ticks,
            time_ns: report.time_ns,
            state_hash: report.state_hash,
            hard_constraints: report.world.constraints_found,
            task_failures: report.world.task_failures,
            grants_refused: report.world.grants_refused,
            invalid_requests: report.world.invalid_requests,
            schedules_refused: report.world.schedules_refused,
            refused_schedule: report.refused.map(|refused| refused.to_string()),
            scene_changes: u64::from(report.scene_version),
            selection_conflicts: report.world.selection_conflicts,
            invariants: InvariantsReport::new(&report.world.checks, report.violation),
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
        evidence: None,
    }
}
