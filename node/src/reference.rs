//! Bare iceoryx2, as what a run is measured against: the same message, limits, processes and
//! waits, without the machines.
//!
//! Responsible for: starting as many processes as a run has, ending them, and what they measured.
//! Not responsible for: what they do (`publisher`, `reader`), what is compared with what (crate
//! `bench`).
//!
//! Each process stands for one of the run's: the *publisher* for the world, a *reader* that
//! answers for each robot and the planner, and one that only looks now and then for the recorder;
//! the supervisor looks now and then itself.
//! Their ports are iceoryx2's own, used without any code of ours; the directory, the topics'
//! limits, how a process waits, and the histograms are the run's, so that nothing else differs.

mod publisher;
mod reader;

use std::path::Path;
use std::time::{Duration, Instant};

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{BackpressureStrategy, ipc};
use shm_types::Outcome;
use world::FIRST_INCARNATION;

use crate::children::Participant;
use crate::domain::{NewRun, RunDirectory, RunFile};
use crate::histograms::Latencies;
use crate::options::{Launcher, Recovery, Role, RunPlan};
use crate::ports::{self, Burial, Service, TopicError, failed};
use crate::report::RoleReport;
use crate::roles::{RoleError, Seat};
use crate::shared_memory;
use crate::supervisor::{RunError, Signals, make_private};
use crate::topics::Topics;
use crate::wire::{Message, Wire};

/// What it is called in results.
pub const NAME: &str = "bare iceoryx2";
/// The command of the binary that runs a process of the reference; a role follows.
pub const COMMAND: &str = "reference";
/// Sleep between two looks at the processes.
const PERIOD: Duration = Duration::from_millis(5);
/// How long they may take beyond set-up before the reference counts as failed.
const DEADLINE: Duration = Duration::from_secs(60);

/// Sends without any code of ours.
type BarePublisher<T> = Publisher<ipc::Service, Wire<T>, ()>;
/// Receives without any code of ours.
type BareSubscriber<T> = Subscriber<ipc::Service, Wire<T>, ()>;

/// What the reference measured.
#[derive(Debug)]
pub struct ReferenceReport {
    /// How it ended: [`Outcome::Timeout`] when all ticks were made.
    pub outcome: Outcome,
    /// Why, where it failed.
    pub reason: Option<String>,
    /// Latencies of all processes, merged by name.
    pub latency: Latencies,
    /// Every process.
    pub roles: Vec<RoleReport>,
    /// Ticks made.
    pub ticks: u64,
    /// Wall time from the first tick to the last, seconds.
    pub wall_s: f64,
}

/// Runs the reference of a plan: as many ticks as its time limit has, with bare iceoryx2.
///
/// # Errors
/// It could not be started; nothing of it is left.
pub fn run(plan: &RunPlan) -> Result<ReferenceReport, RunError> {
    let scene = scene::parse(&plan.scenario, "scenario.toml")
        .map_err(|error| RunError::Scenario(error.plain()))?;
    let counts = scene.counts();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    plan.options.check(counts, cores)?;
    let room = plan.options.room(counts);
    let topics = Topics::of(room, plan.options.settings.method, plan.options.monitors);
    let participants = u64::from(room.robots + plan.options.monitors) + 4;
    shared_memory::reserve(topics.bytes(), participants)?;
    let signals = Signals::watch().map_err(RunError::Signals)?;
    let mut options = plan.options.clone();
    options.settings.tick_ns = options.clock.tick_ns(options.settings.tick_ns);
    let (directory, file) = RunDirectory::create(&NewRun {
        name: None,
        scenario_text: &plan.scenario,
        scenario: &scene.name,
        scenario_hash: scene.hash,
        counts,
        shared_memory_bytes: topics.bytes(),
        options: &options,
        recovery: Recovery::default(),
        silence_limit_s: plan.silence_limit.as_secs_f64(),
    })?;
    let node = ports::join(&file.root, &file.prefix, "supervisor", Burial::OfAll)?;
    make_private(&file)?;
    let topics = topics.create(&node)?;
    // As many readers as a run has: its supervisor is one.
    let snapshots = subscriber(&topics.world)?;
    let mut processes = start(plan, &file, directory.path())?;
    let by = Instant::now() + plan.setup_deadline + DEADLINE;
    let (outcome, reason) = loop {
        if let Some(words) = broken(&mut processes) {
            break (Outcome::Failed, Some(words));
        }
        let mut readers = processes.iter_mut().filter(|one| one.role != Role::World);
        if readers.all(|one| one.ended().is_some()) {
            break (Outcome::Timeout, None);
        }
        if signals.take() {
            break (Outcome::Interrupted, None);
        }
        if Instant::now() > by {
            break (
                Outcome::Failed,
                Some("it did not come to its end".to_owned()),
            );
        }
        // What it holds does not matter, only that its buffer is emptied.
        let _ = snapshots.receive();
        std::thread::sleep(PERIOD);
    };
    end(&mut processes);
    let roles: Vec<_> = processes
        .iter()
        .map(|one| {
            RoleReport::read(directory.path(), one.role)
                .unwrap_or_else(|_| RoleReport::missing(one.role, one.pid()))
        })
        .collect();
    let mut latency = Latencies::new();
    for role in &roles {
        if let Ok(own) = Latencies::read(&Latencies::path(directory.path(), role.role)) {
            latency.merge(&own);
        }
    }
    let world = roles.iter().find(|role| role.role == Role::World);
    Ok(ReferenceReport {
        outcome,
        reason,
        latency,
        ticks: world.map_or(0, |world| world.ticks_answered),
        wall_s: world.map_or(0.0, |world| world.wall_s),
        roles,
    })
}

fn start(plan: &RunPlan, file: &RunFile, directory: &Path) -> Result<Vec<Participant>, RunError> {
    let mut before = plan.launcher.before.clone();
    before.push(COMMAND.into());
    let launcher = Launcher {
        before,
        ..plan.launcher.clone()
    };
    Role::all(file.robots)
        .map(|role| {
            Participant::start(&launcher, role, FIRST_INCARNATION, directory).map_err(|source| {
                RunError::Start {
                    role,
                    program: launcher.program.display().to_string(),
                    source,
                }
            })
        })
        .collect()
}

/// The last words of a process that has failed, if one has.
fn broken(processes: &mut [Participant]) -> Option<String> {
    processes.iter_mut().find_map(|one| {
        let failed = one.ended().is_some_and(|status| !status.success());
        failed.then(|| one.last_words())
    })
}

/// Asks those that are left to leave, then kills them.
fn end(processes: &mut [Participant]) {
    for one in processes.iter_mut() {
        one.terminate();
    }
    let by = Instant::now() + Duration::from_secs(2);
    while Instant::now() < by && !processes.iter_mut().all(|one| one.ended().is_some()) {
        std::thread::sleep(PERIOD);
    }
    for one in processes {
        one.kill();
    }
}

/// Takes part in the reference in `run_dir` in the place of `role`, until it ends.
///
/// # Errors
/// Set-up failed, or iceoryx2 did.
pub fn main(role: Role, run_dir: &Path) -> Result<(), RoleError> {
    let seat = Seat::take(run_dir, role, FIRST_INCARNATION)?;
    match role {
        Role::World => publisher::main(seat),
        Role::Planner | Role::Robot(_) => reader::main(seat),
        Role::Recorder => reader::look_now_and_then(seat),
    }
}

fn publisher<T: Message>(service: &Service<T>) -> Result<BarePublisher<T>, TopicError> {
    let builder = service.factory.publisher_builder();
    builder
        .max_loaned_samples(1)
        .backpressure_strategy(BackpressureStrategy::DiscardData)
        .create()
        .map_err(|e| failed("publish on", service.topic)(&e))
}

fn subscriber<T: Message>(service: &Service<T>) -> Result<BareSubscriber<T>, TopicError> {
    let builder = service.factory.subscriber_builder();
    builder
        .buffer_size(service.buffer)
        .history_request(service.history)
        .create()
        .map_err(|e| failed("subscribe to", service.topic)(&e))
}
