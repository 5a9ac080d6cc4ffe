//! The directory of all runs of a user.
//!
//! Responsible for: where it is, that nobody else can enter it, which runs in it are live, and
//! sweeping away what dead ones have left in shared memory.
//! Not responsible for: what is in a run's own directory (`domain`).

use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Read};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use rustix::fs::{FlockOperation, flock};

use crate::domain::{
    DomainError, LATEST, LOCK_FILE, MAX_ROOT_AND_PREFIX, RunDirectory, RunFile, file_error,
};
use crate::shared_memory;

/// Digits of a run's id.
const ID_DIGITS: usize = 8;
/// Bytes of a run's directory and prefix past the directory of all runs: `/ID` and `rrID_`.
const ROOT_AND_PREFIX_TAIL: usize = 1 + ID_DIGITS + 2 + ID_DIGITS + 1;

/// All runs of a user, each by id.
#[derive(Debug, Default)]
pub(super) struct All {
    pub(super) live: Vec<RunFile>,
    pub(super) dead: Vec<RunFile>,
}

/// The directory of all runs of this user, locked against other starts and lists.
pub(super) struct Runs {
    path: PathBuf,
    _lock: File,
}

impl Runs {
    pub(super) fn open(path: PathBuf) -> Result<Self, DomainError> {
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

    /// Reads all runs, and removes what dead ones have in shared memory; of one that never came to
    /// be, the directory too. A directory is made and locked while the directory of all runs is
    /// locked, so one without a lock has no supervisor.
    pub(super) fn all(&self) -> Result<All, DomainError> {
        let mut runs = All::default();
        let entries = fs::read_dir(&self.path).map_err(|e| file_error(&self.path, e))?;
        for entry in entries {
            let entry = entry.map_err(|e| file_error(&self.path, e))?;
            let name = entry.file_name();
            let Some(id) = name.to_str().filter(|name| is_id(name)) else {
                continue;
            };
            let directory = entry.path();
            if is_locked(&directory.join(LOCK_FILE)) {
                runs.live.extend(RunFile::read(&directory).ok());
                continue;
            }
            // Its processes die with their supervisor; one that has just done so may still be at
            // it, and is gone by the next start.
            shared_memory::remove_all(&prefix(id))
                .map_err(|e| file_error(Path::new(shared_memory::SHARED_MEMORY), e))?;
            match RunFile::read(&directory) {
                Ok(run) => runs.dead.push(run),
                Err(_) => {
                    tracing::info!("removing what run {id} has left, which never began");
                    fs::remove_dir_all(&directory).map_err(|e| file_error(&directory, e))?;
                }
            }
        }
        runs.live.sort_by(|a, b| a.id.cmp(&b.id));
        runs.dead.sort_by(|a, b| a.id.cmp(&b.id));
        Ok(runs)
    }

    /// Takes the lock of a dead run.
    pub(super) fn lock_again(&self, run: &RunFile) -> Result<RunDirectory, DomainError> {
        let path = self.path.join(&run.id);
        let lock_path = path.join(LOCK_FILE);
        let lock = || -> io::Result<File> {
            let lock = OpenOptions::new().write(true).open(&lock_path)?;
            flock(&lock, FlockOperation::NonBlockingLockExclusive)?;
            Ok(lock)
        };
        Ok(RunDirectory {
            prefix: prefix(&run.id),
            _lock: lock().map_err(|e| file_error(&lock_path, e))?,
            path,
        })
    }

    pub(super) fn make_directory(&self) -> Result<(RunDirectory, String), DomainError> {
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
pub(super) fn default_path() -> PathBuf {
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

/// When the run in a directory began.
pub(super) fn began(directory: &Path) -> Option<SystemTime> {
    fs::metadata(directory.join(LOCK_FILE))
        .ok()?
        .modified()
        .ok()
}

pub(super) fn check_name(name: &str) -> Result<(), DomainError> {
    let fine = (1..=64).contains(&name.len())
        && name != LATEST
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

pub(super) fn prefix(id: &str) -> String {
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
