//! All the supervisor is told.
//!
//! Responsible for: the plan of a run, and how its processes are started.
//! Not responsible for: what the processes are told (`options`).

use std::ffi::OsString;
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::options::RunOptions;

/// How long all participants together may take to answer their first tick.
pub const DEFAULT_SETUP_DEADLINE: Duration = Duration::from_secs(20);
/// How long a participant may be silent before it is killed.
pub const DEFAULT_SILENCE_LIMIT: Duration = Duration::from_secs(5);
/// How many processes of a participant in a row may end before they have answered a tick.
pub const DEFAULT_GIVE_UP_AFTER: u32 = 20;

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

/// What follows when a process of a run has died.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Restart {
    /// It is started again, and takes up what it was doing.
    #[default]
    Auto,
    /// Likewise, but a robot stands where it is until it is let.
    Hold,
    /// A robot is gone for good; without anybody else the run ends.
    Never,
}

/// When it is no use starting a process again that has not answered a tick since it was started.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GiveUp {
    /// After so many in a row.
    Times(u32),
    /// After so many seconds without one that did.
    Seconds(f64),
}

impl Default for GiveUp {
    fn default() -> Self {
        Self::Times(DEFAULT_GIVE_UP_AFTER)
    }
}

/// `20` or `2.5s`, as on the command line.
impl FromStr for GiveUp {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let error = || format!("{text:?} is neither a number of times nor, like 2.5s, of seconds");
        match text.strip_suffix('s') {
            Some(seconds) => {
                let seconds: f64 = seconds.parse().map_err(|_| error())?;
                let fine = seconds.is_finite() && seconds > 0.0;
                fine.then_some(Self::Seconds(seconds)).ok_or_else(error)
            }
            None => {
                let times = text.parse().map_err(|_| error())?;
                (times > 0).then_some(Self::Times(times)).ok_or_else(error)
            }
        }
    }
}

impl fmt::Display for GiveUp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Times(times) => write!(f, "{times}"),
            Self::Seconds(seconds) => write!(f, "{seconds}s"),
        }
    }
}

/// What is done about processes that die.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Recovery {
    /// Whether they are started again.
    pub restart: Restart,
    /// When not any more.
    pub give_up_after: GiveUp,
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
    /// How long a participant may be silent before it is killed: in lockstep, do nothing at all
    /// while the run stands still.
    pub silence_limit: Duration,
    /// What follows when one has died.
    pub recovery: Recovery,
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
            recovery: Recovery::default(),
        }
    }
}
