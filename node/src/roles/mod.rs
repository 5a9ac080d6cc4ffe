//! The processes of a run: one file per role, each a loop around its machine.
//!
//! Responsible for: joining a run, what all roles do alike at its start and its end.
//! Not responsible for: what a role does in between (`world`, `planner`, `robot`, `recorder`), or
//! for starting processes (`supervisor`).
//!
//! Terms: a participant has *answered* a tick when the message its step made for that tick is
//! sent.

mod follower;
pub mod planner;
pub mod recorder;
pub mod robot;
mod tables;
pub mod world;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use scene::Scene;
use shm_types::{Counts, Invalid, SnapshotHeader};
use signal_hook::consts::{SIGINT, SIGTERM};

use crate::clock;
use crate::domain::{DomainError, RunFile};
use crate::histograms::{Latencies, LatencyFileError, Timed};
use crate::options::{Clock, Role, RunOptions, Wait};
use crate::ports::{self, Burial, IpcNode, TopicError};
use crate::realtime;
use crate::report::RoleReport;
use crate::topics::Topics;
use crate::wait::Waiter;
use crate::wakes::{Sleeper, Waker};

/// The world's journal, in the run's directory.
pub(crate) const JOURNAL_FILE: &str = "journal";
/// The newest schedule, likewise.
const SCHEDULE_FILE: &str = "schedule";
/// The trace, in the run's directory, where no other place was asked for.
pub const TRACE_FILE: &str = "trace.mcap";

/// Why a role gave up.
#[derive(Debug, thiserror::Error)]
pub enum RoleError {
    /// The run cannot be found or read.
    #[error(transparent)]
    Run(#[from] DomainError),
    /// The run's own scenario is none, or not the one `run.json` names.
    #[error("could not use the scenario of the run: {0}")]
    Scenario(String),
    /// Shared memory failed.
    #[error(transparent)]
    Topic(#[from] TopicError),
    /// Another participant sent what no version of this program sends.
    #[error("could not use a message on topic {topic}: {invalid}")]
    Message {
        /// Topic it came on.
        topic: &'static str,
        /// What is wrong with it.
        invalid: Invalid,
    },
    /// A robot the run does not have.
    #[error("there is no robot {index}, the run has {robots}, counted from 0")]
    Index {
        /// The number asked for.
        index: u32,
        /// Robots of the run.
        robots: u32,
    },
    /// Signals cannot be caught.
    #[error("could not watch for signals: {0}")]
    Signals(io::Error),
    /// A file of the run cannot be written.
    #[error("could not write {path}: {reason}")]
    File {
        /// Which file.
        path: PathBuf,
        /// Why not.
        reason: String,
    },
}

/// What every role has once it has joined.
pub(crate) struct Seat {
    pub(crate) role: Role,
    /// Which process of this participant it is, from 1.
    pub(crate) incarnation: u32,
    pub(crate) run: RunFile,
    /// The scene in force, as far as this process has seen.
    pub(crate) scene: Scene,
    /// Its version.
    scene_version: u32,
    pub(crate) node: IpcNode,
    pub(crate) topics: Topics,
    pub(crate) latencies: Latencies,
    stop: Arc<AtomicBool>,
    directory: PathBuf,
    notes: Vec<String>,
    delay: Option<(Duration, u64)>,
    answered: u64,
    /// When it answered first and last, ns.
    active_ns: Option<(u64, u64)>,
}

impl Seat {
    /// Joins the run in `directory` as process `incarnation` of `role`.
    ///
    /// # Errors
    /// It is no run of this version, or its shared memory cannot be used.
    pub(crate) fn take(directory: &Path, role: Role, incarnation: u32) -> Result<Self, RoleError> {
        let stop = Arc::new(AtomicBool::new(false));
        for signal in [SIGTERM, SIGINT] {
            signal_hook::flag::register(signal, Arc::clone(&stop)).map_err(RoleError::Signals)?;
        }
        let run = RunFile::read(directory)?;
        let text = RunFile::read_scenario(directory)?;
        let scene = scene::parse(&text, "scenario.toml")
            .map_err(|error| RoleError::Scenario(error.to_string()))?;
        if scene.hash != run.scenario_hash {
            return Err(RoleError::Scenario(format!(
                "its hash is {:016x}, the run's {:016x}",
                scene.hash, run.scenario_hash
            )));
        }
        let delay = run.options.delays.iter().find(|delay| delay.role == role);
        Ok(Self {
            role,
            incarnation,
            node: ports::join(&run.root, &run.prefix, &role.to_string(), Burial::ByOthers)?,
            topics: Topics::of(
                run.room(),
                run.options.settings.method,
                run.options.monitors,
            ),
            scene,
            scene_version: 0,
            latencies: Latencies::new(),
            stop,
            directory: directory.to_owned(),
            notes: Vec::new(),
            delay: delay.map(|delay| (Duration::from_millis(delay.ms), delay.ticks)),
            answered: 0,
            active_ns: None,
            run,
        })
    }

    /// Takes its core, priority, timers and memory, once all its ports exist. What is not permitted is
    /// noted.
    pub(crate) fn settle(&mut self) {
        let mut asked = Vec::new();
        if matches!(self.options().clock, Clock::Real { .. }) {
            asked.push(realtime::sharpen_timers());
        }
        if self.options().pin {
            asked.push(realtime::pin(self.role, self.run.robots));
        }
        if self.options().realtime_scheduling {
            asked.push(realtime::lock_memory());
            asked.push(realtime::schedule_fifo(self.role));
        }
        self.notes.extend(asked.into_iter().filter_map(Result::err));
    }

    /// Whether somebody has asked this process to end.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    pub(crate) const fn options(&self) -> &RunOptions {
        &self.run.options
    }

    pub(crate) fn counts(&self) -> Counts {
        self.scene.counts()
    }

    /// Version of the scene in force, as far as this process has seen.
    pub(crate) const fn version(&self) -> u32 {
        self.scene_version
    }

    /// Takes over the version of the scene that a snapshot names, if it is another one. Whether it
    /// is.
    ///
    /// # Errors
    /// It cannot be read.
    pub(crate) fn follow(&mut self, header: &SnapshotHeader) -> Result<bool, RoleError> {
        if header.scene_version == self.scene_version {
            return Ok(false);
        }
        if header.scenario_hash != self.scene.hash {
            self.scene = RunFile::read_version(&self.directory, header.scenario_hash)?;
        }
        self.scene_version = header.scene_version;
        Ok(true)
    }

    /// Takes a version of the scene over that this process has made, and writes it down for all
    /// others.
    ///
    /// # Errors
    /// It cannot be written.
    pub(crate) fn write_version(&self, scene: &Scene) -> Result<(), RoleError> {
        Ok(RunFile::write_version(&self.directory, scene)?)
    }

    /// Notes what a user should know.
    pub(crate) fn note(&mut self, text: String) {
        self.notes.push(text);
    }

    /// Where the world keeps its journal.
    pub(crate) fn journal_path(&self) -> PathBuf {
        self.directory.join(JOURNAL_FILE)
    }

    /// Where the planner keeps its newest schedule.
    pub(crate) fn schedule_path(&self) -> PathBuf {
        self.directory.join(SCHEDULE_FILE)
    }

    /// Where the recorder writes: the place asked for, or one in the run's directory.
    pub(crate) fn trace_path(&self) -> PathBuf {
        let asked = self.options().trace.clone();
        asked.unwrap_or_else(|| self.directory.join(TRACE_FILE))
    }

    /// The way this participant waits for messages. Only a blocking wait needs to be woken, and
    /// only in lockstep: in real time nobody wakes anybody.
    pub(crate) fn waiter(
        &self,
        sleeper: impl FnOnce() -> Result<Sleeper, TopicError>,
    ) -> Result<Waiter, TopicError> {
        let options = self.options();
        match (options.clock, options.wait) {
            (Clock::Lockstep, Wait::Block) => Ok(Waiter::new(Wait::Block, Some(sleeper()?))),
            (Clock::Lockstep, wait) => Ok(Waiter::new(wait, None)),
            (Clock::Real { .. }, _) => Ok(Waiter::new(Wait::Block, None)),
        }
    }

    /// What wakes those who block on this participant; nothing where nobody does.
    pub(crate) fn waker(
        &self,
        waker: impl FnOnce() -> Result<Waker, TopicError>,
    ) -> Result<Option<Waker>, TopicError> {
        let options = self.options();
        let blocks = options.clock == Clock::Lockstep && options.wait == Wait::Block;
        blocks.then(waker).transpose()
    }

    /// Times from a stamp to now.
    pub(crate) fn record_since(&mut self, timed: Timed, stamp_ns: u64) {
        let duration_ns = clock::now_ns().saturating_sub(stamp_ns);
        self.latencies.record(timed, duration_ns);
    }

    /// Counts an answer that is about to be sent; sleeps first if this participant is to be slow.
    pub(crate) fn answering(&mut self) {
        if let Some((delay, ticks)) = self.delay
            && self.answered < ticks
        {
            std::thread::sleep(delay);
        }
        self.answered += 1;
        if self.answered == self.options().warm_up_ticks {
            self.latencies.reset();
        }
        let now_ns = clock::now_ns();
        let (first_ns, _) = self.active_ns.unwrap_or((now_ns, now_ns));
        self.active_ns = Some((first_ns, now_ns));
    }

    /// Whether what is counted from here on counts: the warm-up is over.
    pub(crate) const fn is_warm(&self) -> bool {
        self.answered >= self.options().warm_up_ticks
    }

    /// Leaves the run: keeps what there is to tell in its directory.
    ///
    /// # Errors
    /// A file cannot be written.
    pub(crate) fn leave(self, telling: Telling) -> Result<(), RoleError> {
        let (first_ns, last_ns) = self.active_ns.unwrap_or_default();
        let report = RoleReport {
            role: self.role,
            pid: std::process::id(),
            incarnation: self.incarnation,
            ticks_answered: self.answered,
            cpu_s: clock::cpu_s(),
            wall_s: (last_ns - first_ns) as f64 * 1e-9,
            deadline_misses: telling.deadline_misses,
            snapshots_skipped: telling.snapshots_skipped,
            lost: telling.lost,
            counters: telling.counters,
            notes: self.notes,
            world: telling.world,
            recorder: telling.recorder,
        };
        let latencies = Latencies::path(&self.directory, self.role);
        self.latencies
            .write(&latencies)
            .map_err(|error: LatencyFileError| RoleError::File {
                path: latencies,
                reason: error.to_string(),
            })?;
        report
            .write(&self.directory)
            .map_err(|error| RoleError::File {
                path: RoleReport::path(&self.directory, self.role),
                reason: error.to_string(),
            })
    }
}

/// What a role tells at its end beside what its seat knows.
#[derive(Default)]
pub(crate) struct Telling {
    pub(crate) deadline_misses: u64,
    pub(crate) snapshots_skipped: u64,
    pub(crate) lost: u64,
    pub(crate) counters: crate::report::WorkReport,
    pub(crate) world: Option<crate::report::WorldReport>,
    pub(crate) recorder: Option<crate::report::RecorderSummary>,
}

/// What a message on `topic` was refused for.
pub(crate) const fn refused(topic: &'static str) -> impl Fn(Invalid) -> RoleError {
    move |invalid| RoleError::Message { topic, invalid }
}
