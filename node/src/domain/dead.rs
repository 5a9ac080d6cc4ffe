//! Runs whose supervisor is no more.
//!
//! Responsible for: waiting until their processes have ended, emptying their domain so that it can
//! be made anew, and removing them for good.
//! Not responsible for: going on with one (`supervisor`).

use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::domain::runs::{self, Runs};
use crate::domain::{DomainError, RunFile, file_error};
use crate::shared_memory::{self, SHARED_MEMORY};

/// How long processes that die with their supervisor may take to.
const END_GRACE: Duration = Duration::from_secs(5);
/// Sleep between two looks.
const PERIOD: Duration = Duration::from_millis(2);
/// Beginning of every prefix in shared memory, before a run's id.
const PREFIX: &str = "rr";
/// Digits of a run's id.
const ID_DIGITS: usize = 8;

/// Something that a dead run has left.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Leftover {
    /// Id of the run.
    pub id: String,
    /// Its name, if its `run.json` can be read.
    pub name: Option<String>,
    /// Its directory, if there still is one.
    pub directory: Option<PathBuf>,
    /// Files in shared memory.
    pub shared_memory_files: usize,
}

/// What dead runs of this user have left: their directories, and files in shared memory that have
/// no directory any more and that no process has open.
///
/// # Errors
/// The directory of runs is not private, or the system refused.
pub fn leftovers() -> Result<Vec<Leftover>, DomainError> {
    found(&Runs::open(runs::default_path())?)
}

/// Removes what dead runs of this user have left; what that was. They cannot be resumed any more.
///
/// # Errors
/// The directory of runs is not private, or the system refused.
pub fn gc() -> Result<Vec<Leftover>, DomainError> {
    let runs = Runs::open(runs::default_path())?;
    let found = found(&runs)?;
    for leftover in &found {
        if let Some(directory) = &leftover.directory {
            fs::remove_dir_all(directory).map_err(|e| file_error(directory, e))?;
        }
        shared_memory::remove_all(&runs::prefix(&leftover.id))
            .map_err(|e| file_error(Path::new(SHARED_MEMORY), e))?;
    }
    Ok(found)
}

fn found(runs: &Runs) -> Result<Vec<Leftover>, DomainError> {
    let all = runs.all()?;
    let dead = all.dead.into_iter().map(|run| Leftover {
        shared_memory_files: 0,
        directory: Some(run.root),
        name: Some(run.name),
        id: run.id,
    });
    let mut found: Vec<Leftover> = dead.collect();
    let orphans = orphans(|id| all.live.iter().any(|run| run.id == id))
        .map_err(|e| file_error(Path::new(SHARED_MEMORY), e))?;
    for (id, files) in orphans {
        match found.iter_mut().find(|leftover| leftover.id == id) {
            Some(leftover) => leftover.shared_memory_files = files,
            None => found.push(Leftover {
                id,
                name: None,
                directory: None,
                shared_memory_files: files,
            }),
        }
    }
    Ok(found)
}

/// Ids of runs that have files of this user in shared memory, and how many, but for those that are
/// live, here or in another directory of runs: of these somebody has a file open.
fn orphans(is_live: impl Fn(&str) -> bool) -> io::Result<Vec<(String, usize)>> {
    let user = rustix::process::geteuid().as_raw();
    let mut ids: Vec<(String, usize)> = Vec::new();
    for entry in fs::read_dir(SHARED_MEMORY)? {
        let entry = entry?;
        let name = entry.file_name();
        let Some(id) = name.to_str().and_then(id_of) else {
            continue;
        };
        let Ok(file) = entry.metadata() else {
            continue;
        };
        if file.uid() != user || is_live(id) {
            continue;
        }
        match ids.iter_mut().find(|(known, _)| known == id) {
            Some((_, files)) => *files += 1,
            None => ids.push((id.to_owned(), 1)),
        }
    }
    if !ids.is_empty() {
        let used = shared_memory::in_use();
        ids.retain(|(id, _)| !used.iter().any(|name| id_of(name) == Some(id)));
    }
    ids.sort();
    Ok(ids)
}

/// The run that a file in shared memory belongs to, by its name.
fn id_of(name: &str) -> Option<&str> {
    let rest = name.strip_prefix(PREFIX)?;
    let (id, rest) = rest.split_at_checked(ID_DIGITS)?;
    let is_id = id.bytes().all(|byte| byte.is_ascii_hexdigit());
    (is_id && rest.starts_with('_')).then_some(id)
}

/// Waits until the processes of a dead run have ended, which the kernel sees to; kills those that
/// are left. They are known by their arguments: a supervisor may have died before it wrote down
/// whom it had started.
pub(super) fn await_end(run: &RunFile) -> Result<(), DomainError> {
    let by = Instant::now() + END_GRACE;
    while let Some(pid) = processes_of(&run.root).first().copied() {
        if Instant::now() > by {
            return Err(DomainError::Undead {
                name: run.name.clone(),
                pid,
            });
        }
        if let Some(pid) = i32::try_from(pid)
            .ok()
            .and_then(rustix::process::Pid::from_raw)
        {
            let _ = rustix::process::kill_process(pid, rustix::process::Signal::KILL);
        }
        std::thread::sleep(PERIOD);
    }
    Ok(())
}

/// Processes, but for this one, that were started with `--run` and this directory.
fn processes_of(directory: &Path) -> Vec<u32> {
    let directory = directory.as_os_str().as_encoded_bytes();
    let own = std::process::id();
    let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
    let is_role = |pid: &u32| {
        let arguments = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        let words: Vec<&[u8]> = arguments.split(|byte| *byte == 0).collect();
        words
            .windows(2)
            .any(|pair| pair[0] == b"--run" && pair[1] == directory)
    };
    let pids = entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    pids.filter(|pid| *pid != own).filter(is_role).collect()
}

/// Removes iceoryx2's own files from the directory of a run without processes. Ours are plain files
/// that do not have its prefix.
pub(super) fn clear_domain(run: &RunFile) -> Result<(), DomainError> {
    let clear = || -> io::Result<()> {
        for entry in fs::read_dir(&run.root)? {
            let entry = entry?;
            let (path, name) = (entry.path(), entry.file_name());
            if entry.file_type()?.is_dir() {
                fs::remove_dir_all(path)?;
            } else if name.as_encoded_bytes().starts_with(run.prefix.as_bytes()) {
                fs::remove_file(path)?;
            }
        }
        Ok(())
    };
    clear().map_err(|e| file_error(&run.root, e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_in_shared_memory_are_known_by_their_names() {
        assert_eq!(id_of("rr00ab12ff_x.connection"), Some("00ab12ff"));
        for other in [
            "rr00ab12f_x",
            "rrtest12_x",
            "rr00ab12ff",
            "xr00ab12ff_x",
            "rr",
        ] {
            assert_eq!(id_of(other), None, "{other}");
        }
    }
}
