//! Where a run lives: a private directory with what all its processes start from.
//!
//! Responsible for: the directory, who owns it, its lock, `run.json`, the canonical scenario, the
//! list of live runs, and that nothing of a run outlives it.
//! Not responsible for: files in shared memory beyond their removal (`shared_memory`), or what the
//! options mean.
//!
//! A run is *live* while its supervisor holds the lock of its directory; the kernel lets go of
//! the lock when the supervisor dies, however it dies. What a dead run has left in shared memory is
//! swept away by the next start of this user; its directory stays, since the run can be resumed,
//! until somebody asks for it to go (`gc`).

mod dead;
mod run_file;
mod runs;
#[cfg(test)]
mod tests;

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::Serialize;
use shm_types::Counts;
use shm_types::capacity::LAYOUT_VERSION;

use crate::options::{Clock, Recovery, RunOptions};
use crate::shared_memory;
pub use dead::{Leftover, gc, leftovers};
pub use run_file::{Process, RunFile};
use runs::Runs;

/// Longest root and prefix together, bytes: event sockets fail beyond.
pub const MAX_ROOT_AND_PREFIX: usize = 60;

const RUN_FILE: &str = "run.json";
const SCENARIO_FILE: &str = "scenario.toml";
const LOCK_FILE: &str = "lock";
/// How long it may take until nobody holds the lock of a supervisor that is dead.
const LET_GO: Duration = Duration::from_secs(3);
/// Sleep between two looks.
const PERIOD: Duration = Duration::from_millis(2);
/// What stands for the run started last.
pub const LATEST: &str = "latest";

/// Why a run's place could not be made or found.
#[derive(Debug, thiserror::Error)]
pub enum DomainError {
    /// A directory that is not this user's own.
    #[error(
        "{path} is not a private directory of this user ({reason}); remove it, or set \
         XDG_RUNTIME_DIR to a directory of your own"
    )]
    NotPrivate {
        /// Which.
        path: PathBuf,
        /// In what way.
        reason: &'static str,
    },
    /// A run of this name is live.
    #[error("a run named {name:?} is live (supervisor {pid}, in {path}); choose another --name")]
    NameLive {
        /// The name.
        name: String,
        /// Process id of its supervisor.
        pid: u32,
        /// Its directory.
        path: PathBuf,
    },
    /// A name that cannot be told from an id, or is none.
    #[error(
        "{0:?} is no name for a run; a name has 1 to 64 letters, digits, '-', '_' or '.', and is \
         not \"latest\""
    )]
    BadName(String),
    /// A run that is live needs no resuming.
    #[error("run {0:?} is live: there is nothing to resume")]
    Live(String),
    /// No dead run has this name.
    #[error(
        "no dead run has the name or id {name:?}; those that can be resumed: {}",
        or_none(dead)
    )]
    NotResumable {
        /// What was asked for.
        name: String,
        /// Names of those that can be resumed.
        dead: Vec<String>,
    },
    /// A process of a dead run is still there.
    #[error("process {pid} of the dead run {name:?} does not end; kill it, and try again")]
    Undead {
        /// The run.
        name: String,
        /// The process.
        pid: u32,
    },
    /// No run is live.
    #[error("no run is live; start one with `rearrange run`")]
    NoneLive,
    /// No live run has this name.
    #[error("no live run has the name or id {name:?}; live are: {}", or_none(live))]
    Unknown {
        /// What was asked for.
        name: String,
        /// Names of those that are live.
        live: Vec<String>,
    },
    /// The system refused.
    #[error("could not use {path}: {source}")]
    File {
        /// Which file or directory.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// A `run.json` of some other program or version.
    #[error("{path} is no run of this version: {reason}")]
    Foreign {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

/// The directory of a run of this process: live until it is dropped, then gone with all that the
/// run has left in shared memory.
#[derive(Debug)]
pub struct RunDirectory {
    path: PathBuf,
    prefix: String,
    _lock: File,
}

/// What a run's place is made from.
pub(crate) struct NewRun<'a> {
    pub(crate) name: Option<&'a str>,
    pub(crate) scenario_text: &'a str,
    pub(crate) scenario: &'a str,
    pub(crate) scenario_hash: u64,
    pub(crate) counts: Counts,
    pub(crate) shared_memory_bytes: u64,
    pub(crate) options: &'a RunOptions,
    pub(crate) recovery: Recovery,
    pub(crate) silence_limit_s: f64,
}

impl RunDirectory {
    /// Makes a place for a run, after sweeping away what dead ones have left in shared memory.
    ///
    /// # Errors
    /// The directory of runs is not private, the name is live, or the system refused.
    pub(crate) fn create(new: &NewRun<'_>) -> Result<(Self, RunFile), DomainError> {
        Self::create_in(runs::default_path(), new)
    }

    fn create_in(runs: PathBuf, new: &NewRun<'_>) -> Result<(Self, RunFile), DomainError> {
        if let Some(name) = new.name {
            runs::check_name(name)?;
        }
        let runs = Runs::open(runs)?;
        let live = runs.all()?.live;
        if let Some(name) = new.name
            && let Some(run) = live.into_iter().find(|run| run.name == name)
        {
            return Err(DomainError::NameLive {
                name: run.name,
                pid: run.supervisor_pid,
                path: run.root,
            });
        }
        let (directory, id) = runs.make_directory()?;
        let run = RunFile {
            layout_version: LAYOUT_VERSION,
            name: new.name.unwrap_or(&id).to_owned(),
            prefix: directory.prefix.clone(),
            root: directory.path.clone(),
            id,
            scenario: new.scenario.to_owned(),
            scenario_hash: new.scenario_hash,
            robots: new.counts.robots,
            most_robots: new.options.room(new.counts).robots,
            objects: new.counts.objects,
            shared_memory_bytes: new.shared_memory_bytes,
            supervisor_pid: std::process::id(),
            processes: Vec::new(),
            options: new.options.clone(),
            recovery: new.recovery,
            silence_limit_s: new.silence_limit_s,
        };
        directory.put(SCENARIO_FILE, new.scenario_text.as_bytes())?;
        directory.write_run(&run)?;
        Ok((directory, run))
    }

    /// Takes over the directory of a dead run, of this id or name or the newest for "latest", once
    /// none of its processes is left, and removes what they have left of the domain.
    ///
    /// # Errors
    /// There is none, a process of it will not go, or the system refused.
    pub(crate) fn take_over(name: &str) -> Result<(Self, RunFile), DomainError> {
        let by = Instant::now() + LET_GO;
        let (runs, mut all, found) = loop {
            let runs = Runs::open(runs::default_path())?;
            let all = runs.all()?;
            if let Some(found) = choose(&all.dead, name) {
                break (runs, all, found);
            }
            let live = choose(&all.live, name).map(|live| &all.live[live]);
            // A process that a supervisor was just starting when it died holds the lock until it
            // becomes the role, or finds that nobody is there.
            let is_dying = live.is_some_and(|live| !is_alive(live.supervisor_pid));
            if is_dying && Instant::now() < by {
                drop(runs);
                std::thread::sleep(PERIOD);
                continue;
            }
            return Err(match live {
                Some(live) if name != LATEST || all.dead.is_empty() => {
                    DomainError::Live(live.name.clone())
                }
                _ => DomainError::NotResumable {
                    name: name.to_owned(),
                    dead: all.dead.into_iter().map(|run| run.name).collect(),
                },
            });
        };
        let mut run = all.dead.swap_remove(found);
        let directory = runs.lock_again(&run)?;
        dead::await_end(&run)?;
        directory.clear_shared_memory()?;
        dead::clear_domain(&run)?;
        run.supervisor_pid = std::process::id();
        directory.write_run(&run)?;
        Ok((directory, run))
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes `run.json`, at once or not at all.
    ///
    /// # Errors
    /// The system refused.
    pub(crate) fn write_run(&self, run: &RunFile) -> Result<(), DomainError> {
        let path = self.path.join(RUN_FILE);
        let text = serde_json::to_string_pretty(run).map_err(|e| file_error(&path, e.into()))?;
        self.put(RUN_FILE, text.as_bytes())
    }

    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), DomainError> {
        put(&self.path.join(name), bytes)
    }

    /// Removes what the run has left in shared memory. Only once all its processes are dead.
    ///
    /// # Errors
    /// The system refused.
    pub(crate) fn clear_shared_memory(&self) -> Result<(), DomainError> {
        shared_memory::remove_all(&self.prefix)
            .map_err(|e| file_error(Path::new(shared_memory::SHARED_MEMORY), e))
    }
}

impl Drop for RunDirectory {
    fn drop(&mut self) {
        if let Err(error) = self.clear_shared_memory() {
            tracing::warn!("{error}");
        }
        if let Err(error) = fs::remove_dir_all(&self.path) {
            tracing::warn!("could not remove {}: {error}", self.path.display());
        }
    }
}

/// A run, as `list` tells it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ListedRun {
    /// Eight hexadecimal digits.
    pub id: String,
    /// Its name.
    pub name: String,
    /// Its directory.
    pub directory: PathBuf,
    /// Process id of its supervisor.
    pub supervisor_pid: u32,
    /// Name of its scenario.
    pub scenario: String,
    /// Robots that take part.
    pub robots: u32,
    /// Who sets the pace.
    pub clock: Clock,
    /// Whether its supervisor is alive; if not, it can be resumed.
    pub live: bool,
}

impl ListedRun {
    fn new(run: RunFile, live: bool) -> Self {
        Self {
            live,
            id: run.id,
            name: run.name,
            directory: run.root,
            supervisor_pid: run.supervisor_pid,
            scenario: run.scenario,
            robots: run.robots,
            clock: run.options.clock,
        }
    }
}

/// Every run of this user, the live ones first, by id. Sweeps away what dead ones have left in
/// shared memory.
///
/// # Errors
/// The directory of runs is not private, or the system refused.
pub fn list() -> Result<Vec<ListedRun>, DomainError> {
    let all = Runs::open(runs::default_path())?.all()?;
    let live = all.live.into_iter().map(|run| ListedRun::new(run, true));
    let dead = all.dead.into_iter().map(|run| ListedRun::new(run, false));
    Ok(live.chain(dead).collect())
}

/// Writes a private file, renamed into place: whenever a process dies, it is whole.
pub(crate) fn put(path: &Path, bytes: &[u8]) -> Result<(), DomainError> {
    let draft = path.with_extension("draft");
    let write = || {
        let mut file = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(true)
            .mode(0o600)
            .open(&draft)?;
        file.write_all(bytes)?;
        fs::rename(&draft, path)
    };
    write().map_err(|e| file_error(path, e))
}

/// The directory of a run of this name, live or dead, if there is one. Looks without waiting for
/// anybody who starts or lists runs.
#[must_use]
pub fn directory_of(name: &str) -> Option<PathBuf> {
    let directories = fs::read_dir(runs::default_path()).ok()?;
    let mut runs = (directories.flatten()).filter_map(|run| RunFile::read(&run.path()).ok());
    runs.find(|run| run.name == name).map(|run| run.root)
}

/// The live run of this id or name, or the one started last for "latest".
///
/// # Errors
/// There is none, or the directory of runs cannot be used.
pub(crate) fn find(name: &str) -> Result<RunFile, DomainError> {
    let mut live = Runs::open(runs::default_path())?.all()?.live;
    match choose(&live, name) {
        Some(run) => Ok(live.swap_remove(run)),
        None if name == LATEST => Err(DomainError::NoneLive),
        None => Err(DomainError::Unknown {
            name: name.to_owned(),
            live: live.into_iter().map(|run| run.name).collect(),
        }),
    }
}

/// Whether there is a process of this number.
fn is_alive(pid: u32) -> bool {
    Path::new(&format!("/proc/{pid}")).exists()
}

/// The place of the run of this id or name, or of the newest.
fn choose(runs: &[RunFile], name: &str) -> Option<usize> {
    match name {
        LATEST => (0..runs.len()).max_by_key(|&run| runs::began(&runs[run].root)),
        name => (runs.iter()).position(|run| run.id == name || run.name == name),
    }
}

fn file_error(path: &Path, source: io::Error) -> DomainError {
    DomainError::File {
        path: path.to_owned(),
        source,
    }
}

fn or_none(names: &[String]) -> String {
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}
