//! What iceoryx2 leaves in /dev/shm, and what there is room for.
//!
//! Responsible for: the files of one run's prefix (their mode, the half-made ones, all of them),
//! free shared memory, and the limit on descriptors.
//! Not responsible for: how much a run needs (`topics`), or its directory (`domain`).
//!
//! Terms: a *half-made* file is one of no length, or one that its owner may not read yet, left by a
//! process killed while it set up a connection; everybody who opens it waits for it to be made
//! whole, without end.

use std::fs;
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// Where POSIX shared memory lies on Linux.
pub(crate) const SHARED_MEMORY: &str = "/dev/shm";
/// What comes before a mapped file's name in /proc.
const MAPPED: &str = " /dev/shm/";
/// End of the name of the file that every set-up in a domain reads.
const MANAGEMENT: &[u8] = b".global_mgmt";
/// Descriptors a process needs beside its connections.
const BASE_DESCRIPTORS: u64 = 128;
/// Descriptors each other participant costs the one with the most connections.
const DESCRIPTORS_PER_PARTICIPANT: u64 = 8;

/// Why a run has no room on this machine.
#[derive(Debug, thiserror::Error)]
pub enum ResourceError {
    /// No shared memory at all.
    #[error("{SHARED_MEMORY} cannot be used ({0}); mount a tmpfs there")]
    Missing(io::Error),
    /// Shared memory that cannot be written.
    #[error("{SHARED_MEMORY} is read-only; mount it writable")]
    ReadOnly,
    /// Not enough shared memory.
    #[error(
        "this run can come to need {needed} bytes of shared memory, but {SHARED_MEMORY} has \
         {free} free; enlarge it (mount -o remount,size=…, or docker --shm-size), or take fewer \
         robots or --monitors"
    )]
    SharedMemory {
        /// Bytes that all segments add up to.
        needed: u64,
        /// Bytes free.
        free: u64,
    },
    /// Not enough file descriptors.
    #[error(
        "this run needs up to {needed} open files in one process, but the limit is {limit}; raise \
         it (ulimit -Hn), or take fewer robots or --monitors"
    )]
    Descriptors {
        /// Descriptors the process with the most connections needs.
        needed: u64,
        /// The hard limit.
        limit: u64,
    },
}

/// Compares what a run needs with what there is, and raises this process's limit on open files,
/// which its children inherit, as far as needed and permitted: the soft one up to the hard one, and
/// that with `CAP_SYS_RESOURCE`.
///
/// # Errors
/// There is too little; both numbers.
pub(crate) fn reserve(bytes: u64, participants: u64) -> Result<(), ResourceError> {
    let room = rustix::fs::statvfs(SHARED_MEMORY).map_err(|e| ResourceError::Missing(e.into()))?;
    if room.f_flag.contains(rustix::fs::StatVfsMountFlags::RDONLY) {
        return Err(ResourceError::ReadOnly);
    }
    let free = room.f_bavail * room.f_frsize;
    if bytes > free {
        return Err(ResourceError::SharedMemory {
            needed: bytes,
            free,
        });
    }
    let needed = BASE_DESCRIPTORS + DESCRIPTORS_PER_PARTICIPANT * participants;
    let limits = getrlimit(Resource::Nofile);
    let (soft, hard) = (
        limits.current.unwrap_or(u64::MAX),
        limits.maximum.unwrap_or(u64::MAX),
    );
    if needed > soft {
        let raised = Rlimit {
            current: Some(needed),
            maximum: limits.maximum.map(|hard| hard.max(needed)),
        };
        setrlimit(Resource::Nofile, raised).map_err(|_| ResourceError::Descriptors {
            needed,
            limit: hard,
        })?;
    }
    Ok(())
}

/// Takes the files that iceoryx2 opens to everybody away from everybody else. Called right after
/// the first node of a run; later ones of the same user still join.
///
/// # Errors
/// A file's mode cannot be changed, or somebody has emptied the one that every set-up reads.
pub(crate) fn make_private(prefix: &str) -> io::Result<()> {
    for_each_file(prefix, |path, file| {
        if file.len() == 0 && path.as_os_str().as_encoded_bytes().ends_with(MANAGEMENT) {
            return Err(io::Error::other(format!("{} is empty", path.display())));
        }
        if file.permissions().mode() & 0o077 == 0 {
            return Ok(());
        }
        fs::set_permissions(path, fs::Permissions::from_mode(0o600))
    })
}

/// Whether a file is half-made.
fn is_half_made(file: &fs::Metadata) -> bool {
    file.len() == 0 || file.permissions().mode() & 0o400 == 0
}

/// Names of the half-made files of one prefix.
///
/// # Errors
/// The system refused.
pub(crate) fn half_made(prefix: &str) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for_each_file(prefix, |path, file| {
        if is_half_made(file) {
            found.push(path.to_owned());
        }
        Ok(())
    })?;
    Ok(found)
}

/// Names of the files in shared memory that any process of this user has open or mapped, as far as
/// can be seen.
pub(crate) fn in_use() -> Vec<String> {
    let mut used = Vec::new();
    let Ok(processes) = fs::read_dir("/proc") else {
        return used;
    };
    for process in processes.flatten() {
        let name = process.file_name();
        if !name.as_encoded_bytes().iter().all(u8::is_ascii_digit) {
            continue;
        }
        used.extend(opened_by(&process.path()));
        let maps = fs::read_to_string(process.path().join("maps")).unwrap_or_default();
        let mapped = maps.lines().filter_map(|line| line.split_once(MAPPED));
        used.extend(mapped.map(|(_, name)| name.to_owned()));
    }
    used
}

/// Names of the files in shared memory that a process has open: the one in this directory of /proc.
pub(crate) fn opened_by(process: &Path) -> Vec<String> {
    let Ok(descriptors) = fs::read_dir(process.join("fd")) else {
        return Vec::new();
    };
    let targets = descriptors
        .flatten()
        .filter_map(|fd| fs::read_link(fd.path()).ok());
    let names = targets.filter_map(|target| {
        let name = target.strip_prefix(SHARED_MEMORY).ok()?;
        Some(name.to_string_lossy().into_owned())
    });
    names.collect()
}

/// Removes the half-made files of one prefix. Only once every process in set-up is dead.
///
/// # Errors
/// A file cannot be removed.
pub(crate) fn remove_half_made(prefix: &str) -> io::Result<u32> {
    let mut removed = 0;
    for_each_file(prefix, |path, file| {
        if is_half_made(file) {
            fs::remove_file(path)?;
            removed += 1;
        }
        Ok(())
    })?;
    Ok(removed)
}

/// Removes all files of one prefix. Only once every process of the run is dead.
///
/// # Errors
/// A file cannot be removed.
pub(crate) fn remove_all(prefix: &str) -> io::Result<()> {
    for_each_file(prefix, |path, _| fs::remove_file(path))
}

fn for_each_file(
    prefix: &str,
    mut visit: impl FnMut(&Path, &fs::Metadata) -> io::Result<()>,
) -> io::Result<()> {
    for entry in fs::read_dir(SHARED_MEMORY)? {
        let entry = entry?;
        if !entry
            .file_name()
            .as_encoded_bytes()
            .starts_with(prefix.as_bytes())
        {
            continue;
        }
        // What somebody else has removed in the meantime is gone, as wanted.
        match entry
            .metadata()
            .and_then(|file| visit(&entry.path(), &file))
        {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            other => other?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A prefix of this test process, whose files are gone when it is dropped.
    struct Scratch(String);

    impl Scratch {
        fn new(name: &str) -> Self {
            Self(format!("rrtest{}{name}_", std::process::id()))
        }

        fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
            let path = Path::new(SHARED_MEMORY).join(format!("{}{name}", self.0));
            fs::write(&path, bytes).unwrap();
            path
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            remove_all(&self.0).unwrap();
        }
    }

    #[test]
    fn only_half_made_files_of_the_own_prefix_go() {
        let (own, other) = (Scratch::new("own"), Scratch::new("other"));
        let half_made = own.file("1.connection", b"");
        let whole = own.file("2.connection", b"x");
        let foreign = other.file("1.connection", b"");
        assert_eq!(remove_half_made(&own.0).unwrap(), 1);
        assert!(!half_made.exists() && whole.exists() && foreign.exists());
        remove_all(&own.0).unwrap();
        assert!(!whole.exists() && foreign.exists());
    }

    #[test]
    fn files_are_made_private() {
        let own = Scratch::new("mode");
        let path = own.file("1.global_mgmt", b"x");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o666)).unwrap();
        make_private(&own.0).unwrap();
        fs::write(&path, b"").unwrap();
        assert!(make_private(&own.0).is_err(), "an emptied one is noticed");
        assert_eq!(
            fs::metadata(&path).unwrap().permissions().mode() & 0o777,
            0o600
        );
    }

    #[test]
    fn a_refusal_names_both_numbers() {
        let error = reserve(u64::MAX, 1).unwrap_err().to_string();
        assert!(error.contains(&u64::MAX.to_string()), "{error}");
        assert!(error.contains("free"), "{error}");
        let error = reserve(0, u64::from(u32::MAX)).unwrap_err().to_string();
        assert!(error.contains("open files"), "{error}");
    }
}
