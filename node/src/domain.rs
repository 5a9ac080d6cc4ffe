//! Where a run lives: a private directory with what all its processes start from.
//!
//! Responsible for: the directory, who owns it, its lock, `run.json`, the canonical scenario, the
//! list of live runs, and that nothing of a run outlives it.
//! Not responsible for: files in shared memory beyond their removal (`shared_memory`), or what the
//! options mean.
//!
//! A run is *live* while its supervisor holds the lock of its directory; the kernel lets go of
//! the lock when the supervisor dies, however it dies. Every start sweeps away what dead runs of
//! this user have left.

use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::{FlockOperation, flock};
use serde::{Deserialize, Serialize};
use shm_types::Counts;
use shm_types::capacity::LAYOUT_VERSION;

use crate::options::{Clock, Role, RunOptions};
use crate::shared_memory;

/// Longest root and prefix together, bytes: event sockets fail beyond.
pub const MAX_ROOT_AND_PREFIX: usize = 60;
/// Digits of a run's id.
const ID_DIGITS: usize = 8;
/// Bytes of a run's directory and prefix past the directory of all runs: `/ID` and `rrID_`.
const ROOT_AND_PREFIX_TAIL: usize = 1 + ID_DIGITS + 2 + ID_DIGITS + 1;

const RUN_FILE: &str = "run.json";
const SCENARIO_FILE: &str = "scenario.toml";
const LOCK_FILE: &str = "lock";

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

/// `run.json`: what every process of the run starts from, and monitors find it by.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFile {
    /// Layout of the messages.
    pub layout_version: u32,
    /// Eight hexadecimal digits.
    pub id: String,
    /// Its name; the id if none was given.
    pub name: String,
    /// Prefix of its files in shared memory.
    pub prefix: String,
    /// Its directory, and the root of its iceoryx2 domain.
    pub root: PathBuf,
    /// Name of the scenario.
    pub scenario: String,
    /// Hash of the canonical scenario.
    pub scenario_hash: u64,
    /// Robots.
    pub robots: u32,
    /// Objects.
    pub objects: u32,
    /// Bytes of shared memory that all segments can come to hold.
    pub shared_memory_bytes: u64,
    /// Process id of the supervisor.
    pub supervisor_pid: u32,
    /// The processes, once started.
    pub processes: Vec<Process>,
    /// What the run was asked to be.
    pub options: RunOptions,
}

/// One process of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Process {
    /// Which participant.
    pub role: Role,
    /// Its process id.
    pub pid: u32,
}

impl RunFile {
    /// Its id as a number; 0 for an id that is none.
    #[must_use]
    pub fn id_number(&self) -> u64 {
        u64::from_str_radix(&self.id, 16).unwrap_or(0)
    }

    /// Robots and objects.
    #[must_use]
    pub const fn counts(&self) -> Counts {
        Counts {
            robots: self.robots,
            objects: self.objects,
        }
    }

    /// Reads the run in a directory.
    ///
    /// # Errors
    /// There is none of this version.
    pub fn read(directory: &Path) -> Result<Self, DomainError> {
        let path = directory.join(RUN_FILE);
        let text = fs::read_to_string(&path).map_err(|e| file_error(&path, e))?;
        let foreign = |reason: String| DomainError::Foreign {
            path: path.clone(),
            reason,
        };
        let run: Self = serde_json::from_str(&text).map_err(|e| foreign(e.to_string()))?;
        if run.layout_version != LAYOUT_VERSION {
            return Err(foreign(format!(
                "its messages have layout {}, this program's {LAYOUT_VERSION}",
                run.layout_version
            )));
        }
        Ok(run)
    }

    /// The canonical scenario text of the run in a directory.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn read_scenario(directory: &Path) -> Result<String, DomainError> {
        let path = directory.join(SCENARIO_FILE);
        fs::read_to_string(&path).map_err(|e| file_error(&path, e))
    }
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
}

impl RunDirectory {
    /// Makes a place for a run, after sweeping away dead ones.
    ///
    /// # Errors
    /// The directory of runs is not private, the name is live, or the system refused.
    pub(crate) fn create(new: &NewRun<'_>) -> Result<(Self, RunFile), DomainError> {
        Self::create_in(runs_path(), new)
    }

    fn create_in(runs: PathBuf, new: &NewRun<'_>) -> Result<(Self, RunFile), DomainError> {
        if let Some(name) = new.name {
            check_name(name)?;
        }
        let runs = Runs::open(runs)?;
        if let Some(name) = new.name
            && let Some(run) = runs.live()?.into_iter().find(|run| run.name == name)
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
            objects: new.counts.objects,
            shared_memory_bytes: new.shared_memory_bytes,
            supervisor_pid: std::process::id(),
            processes: Vec::new(),
            options: new.options.clone(),
        };
        directory.put(SCENARIO_FILE, new.scenario_text.as_bytes())?;
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

    /// Writes a private file, renamed into place.
    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), DomainError> {
        let path = self.path.join(name);
        let draft = self.path.join(format!("{name}.draft"));
        let write = || {
            let mut file = OpenOptions::new()
                .write(true)
                .create(true)
                .truncate(true)
                .mode(0o600)
                .open(&draft)?;
            file.write_all(bytes)?;
            fs::rename(&draft, &path)
        };
        write().map_err(|e| file_error(&path, e))
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

/// A live run, as `list` tells it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LiveRun {
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
}

impl From<RunFile> for LiveRun {
    fn from(run: RunFile) -> Self {
        Self {
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

/// Every live run of this user, by id. Sweeps away what dead ones have left.
///
/// # Errors
/// The directory of runs is not private, or the system refused.
pub fn list() -> Result<Vec<LiveRun>, DomainError> {
    let live = Runs::open(runs_path())?.live()?;
    Ok(live.into_iter().map(LiveRun::from).collect())
}

/// The directory of all runs of this user, locked against other starts and lists.
struct Runs {
    path: PathBuf,
    _lock: File,
}

impl Runs {
    fn open(path: PathBuf) -> Result<Self, DomainError> {
        match DirBuilder::new().mode(0o700).create(&path) {
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
                return Err(file_error(&path, error));
            }
            _ => check_private(&path)?,
        }
        let lock = File::open(&path).map_err(|e| file_error(&path, e))?;
        flock(&lock, FlockOperation::LockExclusive).map_err(|e| file_error(&path, e.into()))?;
        Ok(Self { path, _lock: lock })
    }

    /// Reads live runs and removes dead ones. A directory is made and locked while the directory
    /// of all runs is locked, so one without a lock has no supervisor.
    fn live(&self) -> Result<Vec<RunFile>, DomainError> {
        let mut runs = Vec::new();
        let entries = fs::read_dir(&self.path).map_err(|e| file_error(&self.path, e))?;
        for entry in entries {
            let entry = entry.map_err(|e| file_error(&self.path, e))?;
            let name = entry.file_name();
            let Some(id) = name.to_str().filter(|name| is_id(name)) else {
                continue;
            };
            let directory = entry.path();
            if is_locked(&directory.join(LOCK_FILE)) {
                runs.extend(RunFile::read(&directory).ok());
                continue;
            }
            tracing::info!("removing what the dead run {id} has left");
            // Its processes die with their supervisor; one that has just done so may still be at
            // it, and is gone by the next start.
            shared_memory::remove_all(&prefix(id))
                .map_err(|e| file_error(Path::new(shared_memory::SHARED_MEMORY), e))?;
            fs::remove_dir_all(&directory).map_err(|e| file_error(&directory, e))?;
        }
        runs.sort_by(|a: &RunFile, b| a.id.cmp(&b.id));
        Ok(runs)
    }

    fn make_directory(&self) -> Result<(RunDirectory, String), DomainError> {
        loop {
            let id = random_id().map_err(|e| file_error(Path::new("/dev/urandom"), e))?;
            let path = self.path.join(&id);
            match DirBuilder::new().mode(0o700).create(&path) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                other => other.map_err(|e| file_error(&path, e))?,
            }
            let lock_path = path.join(LOCK_FILE);
            let lock = || -> io::Result<File> {
                let lock = OpenOptions::new()
                    .write(true)
                    .create_new(true)
                    .mode(0o600)
                    .open(&lock_path)?;
                flock(&lock, FlockOperation::NonBlockingLockExclusive)?;
                Ok(lock)
            };
            let lock = lock().map_err(|e| file_error(&lock_path, e))?;
            let directory = RunDirectory {
                path,
                prefix: prefix(&id),
                _lock: lock,
            };
            return Ok((directory, id));
        }
    }
}

/// Where this user's runs lie: under `XDG_RUNTIME_DIR` if that is a directory with a short enough
/// path, else under /tmp.
fn runs_path() -> PathBuf {
    let runtime = std::env::var_os("XDG_RUNTIME_DIR")
        .map(PathBuf::from)
        .filter(|path| path.is_absolute() && path.is_dir())
        .map(|path| path.join("rearrange"))
        .filter(|path| path.as_os_str().len() + ROOT_AND_PREFIX_TAIL <= MAX_ROOT_AND_PREFIX);
    runtime.unwrap_or_else(|| {
        let user = rustix::process::geteuid().as_raw();
        PathBuf::from(format!("/tmp/rearrange-{user}"))
    })
}

fn check_private(path: &Path) -> Result<(), DomainError> {
    let found = fs::symlink_metadata(path).map_err(|e| file_error(path, e))?;
    let reason = if !found.is_dir() {
        "it is no directory"
    } else if found.uid() != rustix::process::geteuid().as_raw() {
        "somebody else owns it"
    } else if found.mode() & 0o077 != 0 {
        "others may enter it"
    } else {
        return Ok(());
    };
    Err(DomainError::NotPrivate {
        path: path.to_owned(),
        reason,
    })
}

fn check_name(name: &str) -> Result<(), DomainError> {
    let fine = (1..=64).contains(&name.len())
        && name != "latest"
        && !is_id(name)
        && !name.starts_with('.')
        && name
            .bytes()
            .all(|byte| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte));
    if fine {
        Ok(())
    } else {
        Err(DomainError::BadName(name.to_owned()))
    }
}

fn is_id(name: &str) -> bool {
    name.len() == ID_DIGITS && name.bytes().all(|byte| byte.is_ascii_hexdigit())
}

fn prefix(id: &str) -> String {
    format!("rr{id}_")
}

fn random_id() -> io::Result<String> {
    let mut bytes = [0; ID_DIGITS / 2];
    File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(format!("{:08x}", u32::from_le_bytes(bytes)))
}

/// Whether another process, or another part of this one, holds the lock.
fn is_locked(path: &Path) -> bool {
    File::open(path).is_ok_and(|file| flock(&file, FlockOperation::NonBlockingLockShared).is_err())
}

fn file_error(path: &Path, source: io::Error) -> DomainError {
    DomainError::File {
        path: path.to_owned(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::Settings;
    use std::os::unix::fs::PermissionsExt;

    fn runs() -> tempfile::TempDir {
        tempfile::Builder::new().prefix("rr").tempdir().unwrap()
    }

    fn create(runs: &Path, name: Option<&str>) -> Result<(RunDirectory, RunFile), DomainError> {
        let new = NewRun {
            name,
            scenario_text: "name = \"x\"",
            scenario: "x",
            scenario_hash: 7,
            counts: Counts {
                robots: 1,
                objects: 2,
            },
            shared_memory_bytes: 3,
            options: &RunOptions::new(Settings::default()),
        };
        RunDirectory::create_in(runs.join("runs"), &new)
    }

    fn live(runs: &Path) -> Vec<RunFile> {
        Runs::open(runs.join("runs")).unwrap().live().unwrap()
    }

    #[test]
    fn a_run_is_private_found_by_others_and_gone_with_its_directory() {
        let runs = runs();
        let (directory, run) = create(runs.path(), None).unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(directory.path()), 0o700);
        assert_eq!(mode(&directory.path().join(RUN_FILE)), 0o600);
        assert_eq!(RunFile::read(directory.path()).unwrap(), run);
        assert_eq!(live(runs.path()), std::slice::from_ref(&run));
        let segment = Path::new(shared_memory::SHARED_MEMORY).join(format!("{}x", run.prefix));
        fs::write(&segment, b"x").unwrap();
        let path = directory.path().to_owned();
        drop(directory);
        assert!(!path.exists() && !segment.exists());
        assert_eq!(live(runs.path()), []);
    }

    #[test]
    fn a_live_name_is_refused_and_free_afterwards() {
        let runs = runs();
        let (first, _) = create(runs.path(), Some("mine")).unwrap();
        let refused = create(runs.path(), Some("mine"));
        assert!(matches!(refused, Err(DomainError::NameLive { .. })));
        create(runs.path(), Some("other")).unwrap();
        drop(first);
        create(runs.path(), Some("mine")).unwrap();
    }

    #[test]
    fn what_a_dead_run_has_left_is_swept_away_and_nothing_else() {
        let runs = runs();
        let (alive, _) = create(runs.path(), None).unwrap();
        let (dead, run) = create(runs.path(), None).unwrap();
        let foreign = runs.path().join("runs/not-a-run");
        fs::create_dir(&foreign).unwrap();
        let segment = Path::new(shared_memory::SHARED_MEMORY).join(format!("{}x", run.prefix));
        fs::write(&segment, b"x").unwrap();
        let path = dead.path().to_owned();
        // A supervisor that is killed lets go of its lock and does nothing else.
        let RunDirectory { _lock, .. } = &dead;
        flock(_lock, FlockOperation::Unlock).unwrap();
        assert_eq!(live(runs.path()).len(), 1);
        assert!(!path.exists() && !segment.exists());
        assert!(alive.path().exists() && foreign.exists());
    }

    #[test]
    fn a_directory_of_runs_that_others_may_enter_is_refused() {
        let runs = runs();
        let path = runs.path().join("runs");
        fs::create_dir(&path).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
        assert!(matches!(
            Runs::open(path.clone()),
            Err(DomainError::NotPrivate { .. })
        ));
        fs::remove_dir(&path).unwrap();
        std::os::unix::fs::symlink(runs.path(), &path).unwrap();
        assert!(matches!(
            Runs::open(path),
            Err(DomainError::NotPrivate { .. })
        ));
    }

    #[test]
    fn names_that_could_be_mistaken_are_refused() {
        for name in ["", "latest", "0123abcd", "a/b", "..", ".x", "a b", "é"] {
            let refused = check_name(name);
            assert!(matches!(refused, Err(DomainError::BadName(_))), "{name:?}");
        }
        for name in ["a", "paper-68a_2.b", "0123abcdx"] {
            check_name(name).unwrap();
        }
    }

    #[test]
    fn a_run_of_another_version_is_refused() {
        let runs = runs();
        let (directory, mut run) = create(runs.path(), None).unwrap();
        run.layout_version += 1;
        directory.write_run(&run).unwrap();
        let error = RunFile::read(directory.path()).unwrap_err();
        assert!(matches!(error, DomainError::Foreign { .. }), "{error}");
    }

    #[test]
    fn roots_and_prefixes_stay_short_enough_for_sockets() {
        let path = runs_path().join("0123abcd");
        let length = path.as_os_str().len() + prefix("0123abcd").len();
        assert!(length <= MAX_ROOT_AND_PREFIX, "{length}");
    }
}
