//! All the supervisor is told.
//!
//! Responsible for: the plan of a run, and how its processes are started.
//! Not responsible for: what the processes are told (`options`).

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

use crate::options::RunOptions;

/// How long all participants together may take to answer their first tick.
pub const DEFAULT_SETUP_DEADLINE: Duration = Duration::from_secs(20);
/// How long a participant may be silent in real time before it is killed.
pub const DEFAULT_SILENCE_LIMIT: Duration = Duration::from_secs(5);

/// How the supervisor starts a role: `program before… ROLE --run DIR [--index N]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Launcher {
    /// The executable.
    pub program: PathBuf,
    /// Arguments before the role's name.
    pub before: Vec<OsString>,
    /// Whether the roles' standard error is the supervisor's; otherwise it goes to a file in the
    /// run's directory, whose end is quoted when the role fails.
    pub inherit_stderr: bool,
}

/// All the supervisor is told.
#[derive(Clone, Debug, PartialEq)]
pub struct RunPlan {
    /// Name of the run; a live name is refused. Its id serves if none is given.
    pub name: Option<String>,
    /// The canonical scenario text all processes start from, cut to the robots that take part.
    pub scenario: String,
    /// What every process of the run reads.
    pub options: RunOptions,
    /// How a role is started.
    pub launcher: Launcher,
    /// How long all participants together may take to answer their first tick, per attempt.
    pub setup_deadline: Duration,
    /// How long a participant may be silent in real time before it is killed. Lockstep waits.
    pub silence_limit: Duration,
}

impl RunPlan {
    /// A plan with the default limits.
    #[must_use]
    pub fn new(scenario: String, options: RunOptions, launcher: Launcher) -> Self {
        Self {
            name: None,
            scenario,
            options,
            launcher,
            setup_deadline: DEFAULT_SETUP_DEADLINE,
            silence_limit: DEFAULT_SILENCE_LIMIT,
        }
    }
}
