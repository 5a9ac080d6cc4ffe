//! Cores, priorities, timers and locked memory.
//!
//! Responsible for: asking the system for them, and saying in one line what it did not permit.
//! Not responsible for: whether to ask (`options`).

use std::num::NonZeroU64;

use rustix::process::{Resource, getrlimit};
use rustix::thread::set_current_timer_slack;

use crate::options::Role;

/// Bit of `CAP_IPC_LOCK` in a set of capabilities.
const CAP_IPC_LOCK: u64 = 1 << 14;

/// `SCHED_FIFO` priority: world before robots before planner before recorder.
const fn priority(role: Role) -> i32 {
    match role {
        Role::World => 40,
        Role::Robot(_) => 30,
        Role::Planner => 20,
        Role::Recorder => 10,
    }
}

/// Binds this process to the core of its turn: the world to the first, the robots to those after
/// it, then the planner, round and round. The recorder, which sleeps most of the time and then
/// writes for long, comes last where there is a core for each, else to the world, so that no robot
/// has to wait for it on a core of its own.
///
/// # Errors
/// One line that says what was not permitted.
pub(crate) fn pin(role: Role, robots: u32) -> Result<(), String> {
    let turn = match role {
        Role::World => 0,
        Role::Robot(index) => 1 + index,
        Role::Planner => 1 + robots,
        Role::Recorder if cores() > 2 + robots as usize => 2 + robots,
        Role::Recorder => 0,
    };
    pin_thread(turn as usize)
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Binds the calling thread to the core of this turn, round and round.
///
/// # Errors
/// One line that says what was not permitted.
pub fn pin_thread(turn: usize) -> Result<(), String> {
    let cores = core_affinity::get_core_ids().unwrap_or_default();
    let core = turn
        .checked_rem(cores.len())
        .and_then(|turn| cores.get(turn));
    match core {
        Some(core) if core_affinity::set_for_current(*core) => Ok(()),
        Some(core) => Err(format!("not pinned, the system refused core {}", core.id)),
        None => Err("not pinned, no core is known".to_owned()),
    }
}

/// Lets the kernel wake this thread no later than it can: by default it may gather timers within
/// 50 µs to save power (prctl(2), `PR_SET_TIMERSLACK`).
///
/// # Errors
/// One line that says it was not permitted.
pub(crate) fn sharpen_timers() -> Result<(), String> {
    set_current_timer_slack(Some(NonZeroU64::MIN))
        .map_err(|error| format!("wakes up to 50 µs late, timers cannot be sharpened ({error})"))
}

/// Asks for `SCHED_FIFO`.
///
/// # Errors
/// One line that says it was not permitted.
pub(crate) fn schedule_fifo(role: Role) -> Result<(), String> {
    let parameter = libc::sched_param {
        sched_priority: priority(role),
    };
    // SAFETY: `parameter` is a valid sched_param that outlives the call; 0 means this process.
    let status = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameter) };
    if status == 0 {
        return Ok(());
    }
    Err(format!(
        "runs without SCHED_FIFO, it is not permitted here ({}); it takes CAP_SYS_NICE \
         or a real-time priority limit",
        std::io::Error::last_os_error()
    ))
}

/// Locks all memory of this process, present and future, once all its ports exist. Only where
/// no limit can break later mappings: under a limit a reader could no longer connect.
///
/// # Errors
/// One line that says it was not permitted.
pub(crate) fn lock_memory() -> Result<(), String> {
    let unlimited = getrlimit(Resource::Memlock).current.is_none();
    if !unlimited && !may_lock() {
        return Err(
            "runs without locked memory, it is limited here; it takes CAP_IPC_LOCK or no memlock \
             limit"
                .to_owned(),
        );
    }
    // SAFETY: takes no pointers; it changes only how pages of this process are kept.
    let status = unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) };
    if status == 0 {
        return Ok(());
    }
    Err(format!(
        "runs without locked memory ({})",
        std::io::Error::last_os_error()
    ))
}

/// Whether this process has `CAP_IPC_LOCK`.
fn may_lock() -> bool {
    std::fs::read_to_string("/proc/self/status").is_ok_and(|status| {
        status
            .lines()
            .find_map(|line| line.strip_prefix("CapEff:"))
            .and_then(|set| u64::from_str_radix(set.trim(), 16).ok())
            .is_some_and(|set| set & CAP_IPC_LOCK != 0)
    })
}
