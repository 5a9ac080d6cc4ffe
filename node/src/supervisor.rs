//! Starts the processes of a run, watches them, and ends them all.
//!
//! Responsible for: readiness, silence, death, interruption, and one report of it all.
//! Not responsible for: what the processes do, or what is printed of it.
//!
//! Terms: a participant is *ready* once it has answered its first tick; until then it is in
//! *set-up*. It is *lost* when its process ends before the run does.
//!
//! In this version a lost participant ends the run, with one exception: in real time a robot that
//! is silent for too long is killed and declared gone, and the others go on around it.

mod ending;
mod set_up;
mod signals;
mod watch;

use std::io;
use std::time::{Duration, Instant};

use shm_types::{Checked, ControlKind, ControlRequest, Outcome, RoleKind, WorldSnapshot};
use world::FIRST_INCARNATION;

use crate::children::Participant;
use crate::domain::{DomainError, NewRun, RunDirectory, RunFile};
use crate::options::{self, Clock, OptionError, Role, RunPlan};
use crate::ports::{self, IpcNode, TopicError};
use crate::report::RunReport;
use crate::shared_memory::{self, ResourceError};
use crate::topics::{HeldTopics, Topics};
use watch::Watch;

pub(crate) use set_up::make_private;
pub use signals::Signals;

/// Sleep between two looks at the processes.
const PERIOD: Duration = Duration::from_millis(5);
/// Wall time between two calls of [`Observer::progress`].
const PROGRESS_EVERY: Duration = Duration::from_millis(100);
/// How long the news of the run's end may take to come to the supervisor.
const NEWS_GRACE: Duration = Duration::from_millis(200);
/// How long the world may take to end the run once it is asked to.
const STOP_GRACE: Duration = Duration::from_secs(3);

/// Told how a run is going. Called from the thread that runs the supervisor.
pub trait Observer {
    /// All participants have answered their first tick.
    fn started(&mut self, run: &str) {
        let _ = run;
    }

    /// The newest state, a few times a second.
    fn progress(&mut self, snapshot: Checked<'_, WorldSnapshot>) {
        let _ = snapshot;
    }

    /// Something a user should know, as one sentence.
    fn note(&mut self, text: &str) {
        let _ = text;
    }
}

/// An observer that wants to know nothing.
impl Observer for () {}

/// Why a run could not be started. Once its first tick is answered, whatever goes wrong ends in a
/// [`RunReport`] instead.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// An option that cannot be honoured (status 2).
    #[error(transparent)]
    Options(#[from] OptionError),
    /// The plan's scenario is none (a bug of the caller: it comes from a parsed scenario).
    #[error("could not read the run's own scenario: {0}")]
    Scenario(String),
    /// The run has no place to live.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// The machine has no room for it.
    #[error(transparent)]
    Resources(#[from] ResourceError),
    /// Shared memory failed.
    #[error(transparent)]
    Topics(#[from] TopicError),
    /// Signals cannot be caught.
    #[error("could not watch for signals: {0}")]
    Signals(io::Error),
    /// A process could not be started.
    #[error("could not start {role} with {program}: {source}")]
    Start {
        /// Which.
        role: Role,
        /// The executable.
        program: String,
        /// Why not.
        source: io::Error,
    },
    /// A process ended before it had answered its first tick.
    #[error("a process failed while it was setting up: {0}")]
    SetUp(String),
    /// Participants never answered their first tick, however often they were started.
    #[error(
        "{roles} did not answer a first tick within {seconds} s, {attempts} times over; is the \
         machine overloaded?"
    )]
    Unready {
        /// Who.
        roles: String,
        /// The deadline of each attempt.
        seconds: f64,
        /// How often it was tried.
        attempts: u32,
    },
}

/// How the watch over a run came to its end.
enum End {
    /// The world has said so.
    Outcome(Outcome),
    /// Somebody asked for it, and the world did not come to say so.
    Interrupted,
    /// A participant was lost: the reason.
    Lost(String),
}

/// Runs a plan to its end.
///
/// # Errors
/// The run could not be started; nothing of it is left.
pub fn run(plan: &RunPlan, observer: &mut dyn Observer) -> Result<RunReport, RunError> {
    let mut run = Run::prepare(plan)?;
    let end = match run.set_up()? {
        Some(end) => end,
        None => {
            observer.started(&run.file.name);
            run.attend(observer)
        }
    };
    let report = run.wind_up(end);
    for note in &report.notes {
        observer.note(note);
    }
    Ok(report)
}

/// A run and all its processes. Fields are dropped in this order: processes before shared memory,
/// shared memory before the directory.
struct Run<'p> {
    plan: &'p RunPlan,
    participants: Vec<Participant>,
    watch: Watch,
    _topics: HeldTopics,
    node: IpcNode,
    directory: RunDirectory,
    file: RunFile,
    signals: Signals,
    requests: u64,
    restarts: u64,
    /// By when the world has to have ended the run, once it is asked to.
    stop_by: Option<Instant>,
    notes: Vec<String>,
    oversubscribed: bool,
}

impl<'p> Run<'p> {
    /// Checks what can be checked, and makes the place and the topics of the run.
    fn prepare(plan: &'p RunPlan) -> Result<Self, RunError> {
        let scene = scene::parse(&plan.scenario, "scenario.toml")
            .map_err(|error| RunError::Scenario(error.plain()))?;
        let counts = scene.counts();
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        plan.options.check(counts, cores)?;
        let topics = Topics::of(counts, plan.options.settings.method, plan.options.monitors);
        let participants = u64::from(counts.robots + plan.options.monitors) + 5;
        shared_memory::reserve(topics.bytes(), participants)?;
        let signals = Signals::watch().map_err(RunError::Signals)?;
        let mut options = plan.options.clone();
        options.settings.tick_ns = options.clock.tick_ns(options.settings.tick_ns);
        let (directory, file) = RunDirectory::create(&NewRun {
            name: plan.name.as_deref(),
            scenario_text: &plan.scenario,
            scenario: &scene.name,
            scenario_hash: scene.hash,
            counts,
            shared_memory_bytes: topics.bytes(),
            options: &options,
        })?;
        let node = ports::join(&file.root, &file.prefix, "supervisor")?;
        make_private(&file)?;
        let topics = topics.create(&node)?;
        Ok(Self {
            plan,
            participants: Vec::new(),
            watch: Watch::new(&topics, &file)?,
            _topics: topics,
            node,
            directory,
            signals,
            requests: 0,
            restarts: 0,
            stop_by: None,
            notes: Vec::new(),
            oversubscribed: options::processes(counts) > cores,
            file,
        })
    }

    /// Watches until the run is over. Shared memory that fails ends it too.
    fn attend(&mut self, observer: &mut dyn Observer) -> End {
        let mut shown = Instant::now();
        loop {
            match self.watch_once() {
                Ok(None) => {}
                Ok(Some(end)) => return end,
                Err(error) => return End::Lost(error.to_string()),
            }
            if shown.elapsed() >= PROGRESS_EVERY {
                shown = Instant::now();
                self.watch.show(observer);
            }
            std::thread::sleep(PERIOD);
        }
    }

    /// One look at everything; the end, if this is it.
    fn watch_once(&mut self) -> Result<Option<End>, TopicError> {
        self.watch.look()?;
        if let Some(outcome) = self.watch.outcome() {
            return Ok(Some(End::Outcome(outcome)));
        }
        if let Some(words) = self.lost() {
            return self.end_after(words).map(Some);
        }
        if self.signals.take() {
            if self.stop_by.is_some() {
                return Ok(Some(End::Interrupted));
            }
            self.ask(ControlKind::Stop, RoleKind::World, 0)?;
            self.stop_by = Some(Instant::now() + STOP_GRACE);
        }
        if self.stop_by.is_some_and(|by| Instant::now() > by) {
            return Ok(Some(End::Interrupted));
        }
        self.dismiss_silent()
    }

    /// A participant has left: because it has seen an end that is yet to come to us, or because
    /// it was lost.
    fn end_after(&mut self, words: String) -> Result<End, TopicError> {
        let by = Instant::now() + NEWS_GRACE;
        while Instant::now() < by {
            self.watch.look()?;
            if let Some(outcome) = self.watch.outcome() {
                return Ok(End::Outcome(outcome));
            }
            std::thread::sleep(PERIOD);
        }
        Ok(End::Lost(words))
    }

    /// The last words of a participant whose process has ended, if one has.
    fn lost(&mut self) -> Option<String> {
        let mut ended = self
            .participants
            .iter_mut()
            .filter_map(|one| one.ended().is_some().then(|| one.last_words()));
        ended.next()
    }

    /// In real time, kills who has been silent for too long. A robot is declared gone; without
    /// any other participant the run cannot go on.
    fn dismiss_silent(&mut self) -> Result<Option<End>, TopicError> {
        if self.file.options.clock == Clock::Lockstep {
            return Ok(None);
        }
        let Some(role) = self.watch.silent_for(self.plan.silence_limit) else {
            return Ok(None);
        };
        let seconds = self.plan.silence_limit.as_secs_f64();
        let words = format!("{role} was silent for {seconds} s and was killed");
        for one in self.participants.iter_mut().filter(|one| one.role == role) {
            one.kill();
        }
        let Role::Robot(index) = role else {
            return Ok(Some(End::Lost(words)));
        };
        self.participants.retain(|one| one.role != role);
        self.watch.forget(role);
        self.node.try_cleanup_dead_nodes();
        self.ask(ControlKind::Down, RoleKind::Robot, index)?;
        self.notes.push(words);
        Ok(None)
    }

    /// Tells the world.
    fn ask(&mut self, kind: ControlKind, role: RoleKind, index: u32) -> Result<(), TopicError> {
        self.requests += 1;
        let request = ControlRequest {
            id: self.requests,
            kind: kind.code(),
            role: role.code(),
            index,
            incarnation: FIRST_INCARNATION,
            ..ControlRequest::default()
        };
        self.watch.ask(request)
    }
}

/// Their names, for people.
fn names(roles: &[Role]) -> String {
    let names: Vec<_> = roles.iter().map(ToString::to_string).collect();
    names.join(", ")
}
