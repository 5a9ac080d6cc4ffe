//! The ways a run is driven. Whatever the way, what is left of it has the same shape.
//!
//! Responsible for: one account of a run, from either driver.
//! Not responsible for: the machines (their crates), the processes (crate `node`).

pub(crate) mod in_process;
pub(crate) mod interrupt;
pub(crate) mod processes;
pub(crate) mod recording;

use std::path::PathBuf;

use node::report::WorkReport;
use node::{Latencies, WorldReport};
use shm_types::Outcome;
use trace::CheckReport;

use crate::result::RoleLine;

/// A run that is over.
#[derive(Debug)]
pub(crate) struct Finished {
    pub(crate) outcome: Outcome,
    pub(crate) reason: Option<String>,
    pub(crate) world: WorldReport,
    /// Work of robots and planner together.
    pub(crate) work: WorkReport,
    pub(crate) latency: Latencies,
    pub(crate) roles: Vec<RoleLine>,
    pub(crate) deadline_misses: u64,
    pub(crate) restarts: u64,
    pub(crate) lost_commands: u64,
    /// Wall time from the first tick to the last.
    pub(crate) wall_s: f64,
    pub(crate) oversubscribed: bool,
    pub(crate) notes: Vec<String>,
    /// What the checker says of the trace; nothing if there is none to read.
    pub(crate) check: Option<CheckReport>,
    /// Where the trace was put for somebody to look at, since an invariant is broken in it and it
    /// was not to be kept.
    pub(crate) evidence: Option<PathBuf>,
}
