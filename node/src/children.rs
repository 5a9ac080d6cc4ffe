//! The processes of a run, as the supervisor starts and ends them.
//!
//! Responsible for: starting a role so that it cannot outlive the supervisor or inherit anything
//! of it, signals, reaping, and the last words of one that failed.
//! Not responsible for: when (`supervisor`).

use std::ffi::OsString;
use std::fs::File;
use std::io;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};

use rustix::process::{Pid, Signal, kill_process};

use world::FIRST_INCARNATION;

use crate::options::{Launcher, Role};

/// Bytes of a failed role's log that are quoted.
const LAST_WORDS: usize = 2_000;

/// A started process.
#[derive(Debug)]
pub(crate) struct Participant {
    pub(crate) role: Role,
    /// Which process of its role it is, from 1.
    pub(crate) incarnation: u32,
    process: Child,
    ended: Option<ExitStatus>,
    log: PathBuf,
}

/// What a process has done so far, as the kernel tells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Life {
    /// Processor time of its main thread, ns.
    pub(crate) used_ns: u64,
    /// Whether that waits for a core or a disk, which is none of its own doing.
    pub(crate) is_held_up: bool,
}

impl Life {
    /// That of a process; nothing if there is none, or the kernel does not tell.
    fn of(pid: u32) -> Option<Self> {
        // To the nanosecond: one that only looks now and then uses little.
        let text = std::fs::read_to_string(format!("/proc/{pid}/schedstat")).ok()?;
        let used_ns = text.split_whitespace().next()?.parse().ok()?;
        let text = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        Some(Self {
            used_ns,
            is_held_up: is_held_up(&text)?,
        })
    }

    /// Whether the process has done something since, or could not for want of a core or a disk.
    pub(crate) fn goes_on_since(self, before: Self) -> bool {
        self != before || self.is_held_up
    }
}

/// Whether a process is ready to run or in uninterruptible sleep, by its `/proc/PID/stat`.
fn is_held_up(stat: &str) -> Option<bool> {
    // The name before it is in brackets, and may hold any of them itself.
    let (_, after_name) = stat.rsplit_once(')')?;
    Some(matches!(after_name.trim_start().chars().next()?, 'R' | 'D'))
}

/// The arguments of a role after the launcher's own: `ROLE --run DIR [--index N] [--incarnation K]`.
pub(crate) fn arguments(role: Role, incarnation: u32, run_dir: &Path) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = vec![
        role.subcommand().into(),
        "--run".into(),
        run_dir.as_os_str().into(),
    ];
    if let Role::Robot(index) = role {
        arguments.extend(["--index".into(), index.to_string().into()]);
    }
    if incarnation > FIRST_INCARNATION {
        arguments.extend(["--incarnation".into(), incarnation.to_string().into()]);
    }
    arguments
}

impl Participant {
    /// Starts a role, as its process number `incarnation`, from 1.
    ///
    /// # Errors
    /// The system refused.
    pub(crate) fn start(
        launcher: &Launcher,
        role: Role,
        incarnation: u32,
        run_dir: &Path,
    ) -> io::Result<Self> {
        let log = run_dir.join(format!("{role}.log"));
        let mut command = Command::new(&launcher.program);
        command
            .args(&launcher.before)
            .args(arguments(role, incarnation, run_dir))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .process_group(0);
        if !launcher.inherit_stderr {
            command.stderr(File::create(&log)?);
        }
        let supervisor = rustix::process::getpid();
        // SAFETY: between fork and exec the closure makes only async-signal-safe system calls, on
        // integers, and allocates nothing.
        unsafe { command.pre_exec(move || bind_to(supervisor)) };
        Ok(Self {
            role,
            incarnation,
            process: command.spawn()?,
            ended: None,
            log,
        })
    }

    pub(crate) fn pid(&self) -> u32 {
        self.process.id()
    }

    /// How it ended, if it has. Reaps it.
    pub(crate) fn ended(&mut self) -> Option<ExitStatus> {
        if self.ended.is_none() {
            self.ended = self.process.try_wait().ok().flatten();
        }
        self.ended
    }

    /// What it has done so far.
    pub(crate) fn life(&self) -> Option<Life> {
        Life::of(self.pid())
    }

    /// Asks it to end.
    pub(crate) fn terminate(&mut self) {
        // Not reaped yet, so the process id is still its own.
        if self.ended().is_none()
            && let Some(pid) = i32::try_from(self.pid()).ok().and_then(Pid::from_raw)
        {
            let _ = kill_process(pid, Signal::TERM);
        }
    }

    /// Ends it, and waits until it is gone. A stopped process ends too.
    pub(crate) fn kill(&mut self) {
        if self.ended().is_none() {
            let _ = self.process.kill();
            self.ended = self.process.wait().ok();
        }
    }

    /// Whether it has ended of its own accord, and not well.
    pub(crate) fn has_failed_by_itself(&self) -> bool {
        let code = self.ended.and_then(|status| status.code());
        code.is_some_and(|code| code != 0)
    }

    /// How it ended, in a few words: `signal 9`, `status 7`.
    pub(crate) fn how(&self) -> String {
        match self.ended.map(|status| (status.code(), status.signal())) {
            Some((Some(code), _)) => format!("status {code}"),
            Some((None, Some(signal))) => format!("signal {signal}"),
            _ => "running".to_owned(),
        }
    }

    /// How it ended, with the end of its log: for people.
    pub(crate) fn last_words(&self) -> String {
        let how = self.ended.map_or_else(
            || "is still running".to_owned(),
            |status| status.to_string(),
        );
        let log = std::fs::read_to_string(&self.log).unwrap_or_default();
        let log = log.trim_end();
        let from = log.ceil_char_boundary(log.len().saturating_sub(LAST_WORDS));
        if log.is_empty() {
            format!("{} ended: {how}", self.role)
        } else {
            format!(
                "{} ended: {how}; its last words: {}",
                self.role,
                &log[from..]
            )
        }
    }
}

impl Drop for Participant {
    fn drop(&mut self) {
        self.kill();
    }
}

/// In the child, before it becomes the role: die with the supervisor, keep none of its
/// descriptors (iceoryx2's are not close-on-exec).
fn bind_to(supervisor: Pid) -> io::Result<()> {
    rustix::process::set_parent_process_death_signal(Some(Signal::KILL))?;
    if rustix::process::getppid() != Some(supervisor) {
        return Err(io::ErrorKind::BrokenPipe.into());
    }
    // SAFETY: takes no pointers. Close-on-exec instead of closing keeps the descriptor through
    // which std reports a failed exec.
    let status = unsafe {
        libc::close_range(
            3,
            libc::c_uint::MAX,
            libc::CLOSE_RANGE_CLOEXEC.cast_signed(),
        )
    };
    if status == 0 {
        Ok(())
    } else {
        Err(io::Error::last_os_error())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_that_works_is_told_from_one_that_does_not() {
        // That of this thread: the test's main thread may do nothing at all.
        let thread = rustix::thread::gettid()
            .as_raw_nonzero()
            .get()
            .cast_unsigned();
        let own = || Life::of(thread).unwrap().used_ns;
        let before = own();
        while own() == before {
            std::hint::black_box((0..10_000).sum::<u64>());
        }
        assert_eq!(Life::of(u32::MAX), None);
    }

    #[test]
    fn who_waits_for_a_core_or_a_disk_is_held_up_and_who_sleeps_or_is_stopped_is_not() {
        for (state, expected) in [('R', true), ('D', true), ('S', false), ('T', false)] {
            let stat = format!("7 (a) D (b)) {state} 1 7 7 0 -1");
            assert_eq!(is_held_up(&stat), Some(expected), "{stat}");
        }
        assert_eq!(is_held_up("7 (a"), None);
    }

    #[test]
    fn who_is_held_up_goes_on_though_it_does_nothing() {
        let idle = Life::default();
        let (busy, held_up) = (
            Life { used_ns: 1, ..idle },
            Life {
                is_held_up: true,
                ..idle
            },
        );
        assert!(!idle.goes_on_since(idle) && busy.goes_on_since(idle));
        assert!(held_up.goes_on_since(held_up));
    }
}
