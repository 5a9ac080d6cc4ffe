//! Telling a live run of something that has changed.
//!
//! Responsible for: finding the run, asking its world, and the answer.
//! Not responsible for: what can be changed (crate `world`), or command lines (the binary's).

use std::path::PathBuf;
use std::time::{Duration, Instant};

use shm_types::capacity::MAX_CHANGES;
use shm_types::{ControlKind, ControlRequest, RoleKind};

use crate::domain::{self, DomainError, RunFile};
use crate::options::{Clock, Role, Told, Wait};
use crate::ports::{self, Access, Burial, TopicError};
use crate::topics::Topics;

/// How long the world may take to answer.
const PATIENCE: Duration = Duration::from_secs(20);
/// Sleep between two looks for the answer.
const PERIOD: Duration = Duration::from_millis(2);

/// Why a run was not told, or would not have it. Nothing has changed then.
#[derive(Debug, thiserror::Error)]
pub enum TellError {
    /// There is no such run.
    #[error(transparent)]
    Run(#[from] DomainError),
    /// Shared memory failed.
    #[error(transparent)]
    Topic(#[from] TopicError),
    /// More changes than one request has room for.
    #[error("{0} changes at once are more than the {MAX_CHANGES} that one request has room for")]
    TooMany(usize),
    /// The process of a robot has ended.
    #[error("the process of robot {0} has ended: it cannot take part again")]
    Ended(u32),
    /// The world says no.
    #[error("{0}")]
    Refused(String),
    /// It has ended before the world has said anything.
    #[error("run {0} ended before it could be told")]
    Over(String),
    /// The world says nothing.
    #[error("the world of run {0} did not answer within {seconds} s", seconds = PATIENCE.as_secs())]
    Silent(String),
}

/// What a run has been told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answered {
    /// Name of the run.
    pub run: String,
    /// Tick whose snapshot is the first to show it.
    pub tick: u64,
    /// World time of that snapshot, ns.
    pub time_ns: u64,
    /// How many objects the run started with.
    pub objects: u32,
}

/// Tells the run of this name or id, or for "latest" the one started last.
///
/// # Errors
/// It could not be told, or would not have it.
pub fn tell(run: &str, told: &Told) -> Result<Answered, TellError> {
    let request = request(told)?;
    let run = domain::find(run)?;
    if let Told::Back(robot) = told
        && has_ended(&run, *robot)
    {
        return Err(TellError::Ended(*robot));
    }
    let node = ports::join(&run.root, &run.prefix, "tell", Burial::OfAll)?;
    let options = &run.options;
    let topics = Topics::of(run.room(), options.settings.method, options.monitors);
    let by = Instant::now() + PATIENCE;
    // A run is live before all of it is there.
    let service = loop {
        match topics.control.service(&node, Access::Open) {
            Err(_) if Instant::now() < by && !is_over(&run) => std::thread::sleep(PERIOD),
            result => break result?,
        }
    };
    let client = service.client()?;
    let call = client.call(request)?;
    if options.clock == Clock::Lockstep && options.wait == Wait::Block {
        let waker = topics.wake_world.service(&node, Access::Open)?.waker()?;
        waker.wake()?;
    }
    while Instant::now() < by {
        if let Some(reply) = call.answer()? {
            let tick = reply.result().map_err(TellError::Refused)?;
            return Ok(Answered {
                tick,
                time_ns: tick.saturating_mul(options.settings.tick_ns),
                objects: run.objects,
                run: run.name,
            });
        }
        if is_over(&run) {
            return Err(TellError::Over(run.name));
        }
        std::thread::sleep(PERIOD);
    }
    Err(TellError::Silent(run.name))
}

fn request(told: &Told) -> Result<ControlRequest, TellError> {
    let mut request = ControlRequest {
        id: 1,
        ..ControlRequest::default()
    };
    let (kind, robot) = match told {
        Told::Change(changes) => {
            if changes.len() > MAX_CHANGES {
                return Err(TellError::TooMany(changes.len()));
            }
            for (slot, change) in request.changes.iter_mut().zip(changes) {
                *slot = change.to_wire();
            }
            request.change_count = changes.len() as u32;
            (ControlKind::Change, None)
        }
        Told::Lose(robot) => (ControlKind::Down, Some(*robot)),
        Told::Back(robot) => (ControlKind::Up, Some(*robot)),
    };
    let role = robot.map_or(RoleKind::World, |_| RoleKind::Robot);
    (request.kind, request.role) = (kind.code(), role.code());
    request.index = robot.unwrap_or_default();
    Ok(request)
}

/// Whether the run has ended meanwhile.
fn is_over(run: &RunFile) -> bool {
    !run.root.exists()
}

/// Whether the process of a robot of the run is no more.
fn has_ended(run: &RunFile, robot: u32) -> bool {
    let mut processes = run.processes.iter();
    let process = processes.find(|process| process.role == Role::Robot(robot));
    process.is_some_and(|process| !PathBuf::from(format!("/proc/{}", process.pid)).exists())
}
