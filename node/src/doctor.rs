//! What of this machine stands in the way of runs, or of good ones.
//!
//! Responsible for: looking at shared memory, limits, cores and what dead runs have left, and what
//! mends each.
//! Not responsible for: mending; what one run needs (`shared_memory` refuses that with numbers).

use std::fs;
use std::path::Path;
use std::time::Duration;

use rustix::process::{Resource, getrlimit};
use serde::Serialize;
use std::os::unix::fs::MetadataExt;

use crate::domain;
use crate::shared_memory::SHARED_MEMORY;

/// Shared memory that a small run needs, bytes: less is too little for anything.
const LEAST_SHARED_MEMORY: u64 = 64 << 20;
/// What serves a hundred robots.
const GOOD_SHARED_MEMORY: u64 = 512 << 20;
/// Descriptors that serve a hundred robots.
const GOOD_DESCRIPTORS: u64 = 4_096;
/// Descriptors that a run with a few robots needs.
const LEAST_DESCRIPTORS: u64 = 256;
/// Share of processor time taken away by the host past which latencies say little.
const MUCH_STEAL: f64 = 0.02;
/// How long steal time is watched.
const WATCH: Duration = Duration::from_millis(300);

/// How bad something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grade {
    /// As it should be.
    Ok,
    /// Runs work, but not as well as they could.
    Warn,
    /// Runs do not work.
    Bad,
}

/// One thing that was looked at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What.
    pub what: &'static str,
    /// How bad it is.
    pub grade: Grade,
    /// What was found.
    pub found: String,
    /// How to mend it, if there is anything to mend.
    pub mend: Option<String>,
}

impl Finding {
    fn ok(what: &'static str, found: impl Into<String>) -> Self {
        Self {
            what,
            grade: Grade::Ok,
            found: found.into(),
            mend: None,
        }
    }

    fn not_ok(what: &'static str, grade: Grade, found: impl Into<String>, mend: &str) -> Self {
        Self {
            what,
            grade,
            found: found.into(),
            mend: Some(mend.to_owned()),
        }
    }
}

/// Looks at everything. Takes part of a second.
#[must_use]
pub fn examine() -> Vec<Finding> {
    vec![
        shared_memory(),
        shared_memory_mode(),
        descriptors(),
        rt_priority(),
        locked_memory(),
        governor(&|path| fs::read_to_string(path).ok()),
        steal(),
        leftovers(),
        remove_ipc(&logind_files()),
    ]
}

fn shared_memory() -> Finding {
    let what = "/dev/shm size";
    let Ok(room) = rustix::fs::statvfs(SHARED_MEMORY) else {
        return Finding::not_ok(
            what,
            Grade::Bad,
            "there is none",
            "mount -t tmpfs -o mode=1777,nosuid,nodev tmpfs /dev/shm",
        );
    };
    if room.f_flag.contains(rustix::fs::StatVfsMountFlags::RDONLY) {
        let mend = "mount -o remount,rw /dev/shm";
        return Finding::not_ok(what, Grade::Bad, "read-only", mend);
    }
    graded_room(room.f_blocks * room.f_frsize, room.f_bavail * room.f_frsize)
}

fn graded_room(size: u64, free: u64) -> Finding {
    let what = "/dev/shm size";
    let found = format!("{} MiB, {} MiB free", size >> 20, free >> 20);
    let mend = "mount -o remount,size=2G /dev/shm (docker run --shm-size 2g), or rearrange gc";
    if free < LEAST_SHARED_MEMORY {
        Finding::not_ok(what, Grade::Bad, found, mend)
    } else if free < GOOD_SHARED_MEMORY {
        Finding::not_ok(what, Grade::Warn, found, mend)
    } else {
        Finding::ok(what, found)
    }
}

fn shared_memory_mode() -> Finding {
    match fs::metadata(SHARED_MEMORY) {
        Ok(found) => graded_mode(found.mode() & 0o7777),
        Err(error) => Finding::not_ok(
            "/dev/shm mode",
            Grade::Bad,
            error.to_string(),
            "mount a tmpfs there",
        ),
    }
}

/// Everybody writes there, and nobody removes what is another's.
fn graded_mode(mode: u32) -> Finding {
    let what = "/dev/shm mode";
    let found = format!("{mode:04o}");
    let mend = "chmod 1777 /dev/shm";
    if mode & 0o002 != 0 && mode & 0o1000 == 0 {
        let found = found + ": other users can remove or replace files of a run";
        Finding::not_ok(what, Grade::Bad, found, mend)
    } else if mode == 0o1777 {
        Finding::ok(what, found)
    } else {
        Finding::not_ok(what, Grade::Warn, found, mend)
    }
}

fn descriptors() -> Finding {
    graded_descriptors(getrlimit(Resource::Nofile).maximum.unwrap_or(u64::MAX))
}

fn graded_descriptors(limit: u64) -> Finding {
    let what = "open files";
    let found = match limit {
        u64::MAX => "no limit".to_owned(),
        limit => format!("at most {limit} a process"),
    };
    let mend = "ulimit -Hn 65536 (limits.conf: nofile; systemd: LimitNOFILE=)";
    if limit < LEAST_DESCRIPTORS {
        Finding::not_ok(what, Grade::Bad, found, mend)
    } else if limit < GOOD_DESCRIPTORS {
        let found = found + ", enough for some dozens of robots";
        Finding::not_ok(what, Grade::Warn, found, mend)
    } else {
        Finding::ok(what, found)
    }
}

fn is_root() -> bool {
    rustix::process::geteuid().is_root()
}

fn rt_priority() -> Finding {
    let what = "RLIMIT_RTPRIO";
    match getrlimit(Resource::Rtprio).current {
        _ if is_root() => Finding::ok(what, "root may ask for real-time priority"),
        None => Finding::ok(what, "no limit"),
        Some(0) => Finding::not_ok(
            what,
            Grade::Warn,
            "0: --realtime runs without SCHED_FIFO",
            "limits.conf: rtprio 99 for this user, or CAP_SYS_NICE",
        ),
        Some(limit) => Finding::ok(what, limit.to_string()),
    }
}

fn locked_memory() -> Finding {
    let what = "RLIMIT_MEMLOCK";
    match getrlimit(Resource::Memlock).current {
        _ if is_root() => Finding::ok(what, "root may lock memory"),
        None => Finding::ok(what, "no limit"),
        Some(limit) => Finding::not_ok(
            what,
            Grade::Warn,
            format!("{} KiB: --realtime runs without locked memory", limit >> 10),
            "limits.conf: memlock unlimited for this user, or CAP_IPC_LOCK",
        ),
    }
}

fn governor(read: &dyn Fn(&Path) -> Option<String>) -> Finding {
    let what = "CPU governor";
    let path = Path::new("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
    match read(path).as_deref().map(str::trim) {
        None => Finding::ok(what, "the kernel does not set clock rates here"),
        Some("performance") => Finding::ok(what, "performance"),
        Some(other) => Finding::not_ok(
            what,
            Grade::Warn,
            format!("{other}: latencies include the clock speeding up"),
            "cpupower frequency-set -g performance",
        ),
    }
}

fn steal() -> Finding {
    let read = || fs::read_to_string("/proc/stat").ok();
    let before = read();
    std::thread::sleep(WATCH);
    graded_steal(
        before.as_deref().unwrap_or(""),
        read().as_deref().unwrap_or(""),
    )
}

/// From two readings of /proc/stat.
fn graded_steal(before: &str, after: &str) -> Finding {
    let what = "steal time";
    let times = |text: &str| -> Vec<u64> {
        let line = text.lines().next().unwrap_or_default();
        let words = line.split_whitespace().skip(1).take(8);
        words.filter_map(|word| word.parse().ok()).collect()
    };
    let (before, after) = (times(before), times(after));
    if before.len() < 8 || after.len() < 8 {
        return Finding::ok(what, "the kernel does not tell");
    }
    let all: u64 = after
        .iter()
        .sum::<u64>()
        .saturating_sub(before.iter().sum());
    let stolen = after[7].saturating_sub(before[7]);
    let share = stolen as f64 / all.max(1) as f64;
    let found = format!("{:.1} % taken by the host", 100.0 * share);
    if share > MUCH_STEAL {
        let mend = "measure on a machine of your own: tails of latencies are the host's here";
        Finding::not_ok(what, Grade::Warn, found, mend)
    } else {
        Finding::ok(what, found)
    }
}

fn leftovers() -> Finding {
    let what = "leftovers";
    match domain::leftovers() {
        Ok(found) if found.is_empty() => Finding::ok(what, "none of dead runs"),
        Ok(found) => Finding::not_ok(
            what,
            Grade::Warn,
            format!("{} dead runs", found.len()),
            "rearrange resume goes on with one, rearrange gc removes all",
        ),
        Err(error) => Finding::not_ok(
            what,
            Grade::Bad,
            error.to_string(),
            "remove what stands in the way, or set XDG_RUNTIME_DIR",
        ),
    }
}

fn logind_files() -> Vec<String> {
    let main = Path::new("/etc/systemd/logind.conf").to_owned();
    let more = fs::read_dir("/etc/systemd/logind.conf.d");
    let mut paths: Vec<_> = more
        .into_iter()
        .flatten()
        .flatten()
        .map(|file| file.path())
        .collect();
    paths.sort();
    paths.insert(0, main);
    paths
        .iter()
        .filter_map(|path| fs::read_to_string(path).ok())
        .collect()
}

/// systemd removes the files of users who have logged out, unless told otherwise; not those of root
/// and of system users.
fn remove_ipc(files: &[String]) -> Finding {
    let what = "RemoveIPC";
    if is_root() || !Path::new("/run/systemd/system").exists() {
        return Finding::ok(what, "does not concern this user");
    }
    graded_remove_ipc(files)
}

fn graded_remove_ipc(files: &[String]) -> Finding {
    let what = "RemoveIPC";
    let lines = files.iter().flat_map(|file| file.lines());
    let values = lines.filter_map(|line| line.trim().strip_prefix("RemoveIPC="));
    let last = values.map(str::trim).next_back().map(str::to_lowercase);
    if matches!(last.as_deref(), Some("no" | "false" | "0" | "off")) {
        return Finding::ok(what, "no");
    }
    Finding::not_ok(
        what,
        Grade::Warn,
        "yes: a run that goes on after its user has logged out loses its shared memory",
        "RemoveIPC=no in /etc/systemd/logind.conf, or loginctl enable-linger",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_told_with_the_way_out() {
        let cases = [
            (graded_room(1 << 30, 1 << 30), Grade::Ok),
            (graded_room(256 << 20, 100 << 20), Grade::Warn),
            (graded_room(64 << 20, 1 << 20), Grade::Bad),
            (graded_mode(0o1777), Grade::Ok),
            (graded_mode(0o0777), Grade::Bad),
            (graded_mode(0o1755), Grade::Warn),
            (graded_descriptors(u64::MAX), Grade::Ok),
            (graded_descriptors(1_024), Grade::Warn),
            (graded_descriptors(64), Grade::Bad),
            (governor(&|_| Some("powersave\n".to_owned())), Grade::Warn),
            (governor(&|_| Some("performance\n".to_owned())), Grade::Ok),
            (governor(&|_| None), Grade::Ok),
            (
                graded_steal("cpu 0 0 0 0 0 0 0 0", "cpu 50 0 0 0 0 0 0 50"),
                Grade::Warn,
            ),
            (
                graded_steal("cpu 0 0 0 0 0 0 0 5", "cpu 100 0 0 0 0 0 0 5"),
                Grade::Ok,
            ),
            (graded_remove_ipc(&[]), Grade::Warn),
            (
                graded_remove_ipc(&["#RemoveIPC=yes\nRemoveIPC=no".to_owned()]),
                Grade::Ok,
            ),
            (
                graded_remove_ipc(&["RemoveIPC=no".to_owned(), "RemoveIPC=yes".to_owned()]),
                Grade::Warn,
            ),
        ];
        for (finding, grade) in cases {
            assert_eq!(finding.grade, grade, "{finding:?}");
            assert_eq!(finding.mend.is_some(), grade != Grade::Ok, "{finding:?}");
        }
    }

    #[test]
    fn everything_is_looked_at() {
        assert_eq!(examine().len(), 9);
    }
}
