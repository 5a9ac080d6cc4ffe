//! Starts the processes of a run, watches them, and ends them all.
//!
//! Responsible for: readiness, silence, death, interruption, and one report of it all.
//! Not responsible for: what the processes do, or what is printed of it.
//!
//! Terms: a participant is *ready* once it has answered its first tick; until then it is in
//! *set-up*. It is *lost* when its process ends before the run does.
//!
//! A participant that is lost is started again and takes up where it was (`recovery`); so is a run
//! whose supervisor was lost ([`resume`]).

mod diary;
mod ending;
mod janitor;
mod member;
mod recovery;
mod signals;
mod watch;
#[cfg(test)]
mod wedge;

use std::io;
use std::time::{Duration, Instant};

use scene::Scene;
use shm_types::{Checked, ControlKind, ControlRequest, Counts, Outcome, RoleKind, WorldSnapshot};

use crate::domain::{DomainError, NewRun, RunDirectory, RunFile};
use crate::options::{OptionError, Role, RunOptions, RunPlan};
use crate::ports::{self, Burial, IpcNode, TopicError};
use crate::report::RunReport;
use crate::shared_memory::{self, ResourceError};
use crate::topics::{HeldTopics, Topics};
use diary::Diary;
pub use diary::{DIARY_FILE, Entry, Happened};
use janitor::Janitor;
use member::Member;
pub(crate) use recovery::make_private;
pub use signals::Signals;
use watch::Watch;

/// Sleep between two looks at the processes.
const PERIOD: Duration = Duration::from_millis(2);
/// Wall time between two calls of [`Observer::progress`].
const PROGRESS_EVERY: Duration = Duration::from_millis(100);
/// How long the world may take to do what it is asked to before it is asked again.
const ASK_AGAIN: Duration = Duration::from_millis(50);
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
    carry_out(Run::prepare(plan)?, observer)
}

/// Goes on with a run whose supervisor has died, from the newest tick in its journal: the one of
/// this id or name, or for "latest" the one started last. `plan` makes the plan from what its
/// directory says.
///
/// # Errors
/// There is none, or it could not be gone on with. It can be tried again then.
pub fn resume(
    run: &str,
    plan: impl FnOnce(&RunFile, String) -> RunPlan,
    observer: &mut dyn Observer,
) -> Result<RunReport, RunError> {
    let (directory, file) = RunDirectory::take_over(run)?;
    let scenario = RunFile::read_scenario(directory.path())?;
    let plan = plan(&file, scenario);
    carry_out(Run::begin(&plan, directory, file)?, observer)
}

fn carry_out(mut run: Run<'_>, observer: &mut dyn Observer) -> Result<RunReport, RunError> {
    let end = match run.set_up()? {
        Some(end) => end,
        None => {
            observer.started(&run.file.name);
            run.attend(observer)
        }
    };
    run.diary.note(Happened::Over);
    let report = run.wind_up(end);
    for note in &report.notes {
        observer.note(note);
    }
    Ok(report)
}

fn parse(plan: &RunPlan) -> Result<Scene, RunError> {
    scene::parse(&plan.scenario, "scenario.toml").map_err(|error| RunError::Scenario(error.plain()))
}

/// A run and all its processes. Fields are dropped in this order: processes before shared memory,
/// shared memory before the directory.
struct Run<'p> {
    plan: &'p RunPlan,
    members: Vec<Member>,
    watch: Watch,
    janitor: Janitor,
    _topics: HeldTopics,
    node: IpcNode,
    diary: Diary,
    directory: RunDirectory,
    file: RunFile,
    signals: Signals,
    requests: u64,
    restarts: u64,
    /// Half-made files that were removed.
    cleared: u32,
    /// Tasks that are open, as last noted.
    open_tasks: Option<usize>,
    /// By when the world has to have ended the run, once it is asked to; when it was asked last.
    stop_by: Option<(Instant, Instant)>,
    notes: Vec<String>,
}

impl<'p> Run<'p> {
    /// Checks what can be checked, and makes the place and the topics of the run.
    fn prepare(plan: &'p RunPlan) -> Result<Self, RunError> {
        let scene = parse(plan)?;
        let counts = scene.counts();
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        plan.options.check(counts, cores)?;
        let room = plan.options.room(counts);
        let topics = Topics::of(room, plan.options.settings.method, plan.options.monitors);
        let mut options = plan.options.clone();
        options.settings.tick_ns = options.clock.tick_ns(options.settings.tick_ns);
        reserve(&topics, room, &options)?;
        let (directory, file) = RunDirectory::create(&NewRun {
            name: plan.name.as_deref(),
            scenario_text: &plan.scenario,
            scenario: &scene.name,
            scenario_hash: scene.hash,
            counts,
            shared_memory_bytes: topics.bytes(),
            options: &options,
            recovery: plan.recovery,
            silence_limit_s: plan.silence_limit.as_secs_f64(),
        })?;
        Self::begin(plan, directory, file)
    }

    /// Makes the topics of a run that has a place.
    fn begin(plan: &'p RunPlan, directory: RunDirectory, file: RunFile) -> Result<Self, RunError> {
        let options = &file.options;
        let topics = Topics::of(file.room(), options.settings.method, options.monitors);
        reserve(&topics, file.room(), options)?;
        let signals = Signals::watch().map_err(RunError::Signals)?;
        let mut diary = Diary::open(directory.path()).map_err(|source| DomainError::File {
            path: directory.path().join(DIARY_FILE),
            source,
        })?;
        diary.note(Happened::Supervised {
            pid: std::process::id(),
        });
        let node = ports::join(&file.root, &file.prefix, "supervisor", Burial::OfAll)?;
        make_private(&file)?;
        let janitor = Janitor::start(file.prefix.clone()).map_err(RunError::Signals)?;
        let topics = topics.create(&node)?;
        let mut run = Self {
            plan,
            members: Vec::new(),
            watch: Watch::new(&topics, &file)?,
            janitor,
            _topics: topics,
            node,
            diary,
            directory,
            signals,
            requests: 0,
            restarts: 0,
            cleared: 0,
            open_tasks: None,
            stop_by: None,
            notes: Vec::new(),
            file,
        };
        for role in Role::all(run.file.robots) {
            run.enlist(role);
        }
        Ok(run)
    }

    /// Makes room for the processes of a participant: the first is due now.
    fn enlist(&mut self, role: Role) {
        let started = diary::started(self.directory.path()).into_iter();
        // One more may have been started and not been noted.
        let before = started
            .filter(|(who, _)| *who == role)
            .map(|(_, incarnation)| incarnation + 1);
        self.members
            .push(Member::new(role, before.max().unwrap_or(0)));
        self.watch.add(role);
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
    fn watch_once(&mut self) -> Result<Option<End>, RunError> {
        self.watch.look()?;
        self.note_tasks();
        if let Some(outcome) = self.watch.outcome() {
            return Ok(Some(End::Outcome(outcome)));
        }
        if let Some(end) = self.recover()? {
            return Ok(Some(end));
        }
        if self.signals.take() {
            if self.stop_by.is_some() {
                return Ok(Some(End::Interrupted));
            }
            let now = Instant::now();
            self.stop_by = Some((now + STOP_GRACE, now));
            self.ask(ControlKind::Stop, RoleKind::World, 0, 0)?;
        }
        if let Some((by, asked)) = self.stop_by {
            let now = Instant::now();
            if now > by {
                return Ok(Some(End::Interrupted));
            }
            // The world may have been started again since.
            if now - asked > ASK_AGAIN {
                self.stop_by = Some((by, now));
                self.ask(ControlKind::Stop, RoleKind::World, 0, 0)?;
            }
        }
        Ok(None)
    }

    /// Writes down when the number of open tasks has changed.
    fn note_tasks(&mut self) {
        let tasks = self.watch.open_tasks();
        if let Some(tasks) = tasks.filter(|_| tasks != self.open_tasks) {
            self.open_tasks = Some(tasks);
            self.diary.note(Happened::Open { tasks });
        }
    }

    /// Tells the world.
    fn ask(
        &mut self,
        kind: ControlKind,
        role: RoleKind,
        index: u32,
        incarnation: u32,
    ) -> Result<(), TopicError> {
        self.requests += 1;
        let request = ControlRequest {
            id: self.requests,
            kind: kind.code(),
            role: role.code(),
            index,
            incarnation,
            ..ControlRequest::default()
        };
        self.watch.ask(request)
    }
}

/// Holds what a run needs against what there is.
fn reserve(topics: &Topics, room: Counts, options: &RunOptions) -> Result<(), ResourceError> {
    let participants = u64::from(room.robots + options.monitors) + 5;
    shared_memory::reserve(topics.bytes(), participants)
}

/// Their names, for people.
fn names(roles: &[Role]) -> String {
    let names: Vec<_> = roles.iter().map(ToString::to_string).collect();
    names.join(", ")
}
