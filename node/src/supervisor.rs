//! Starts the processes of a run, watches them, and ends them all.
//!
//! Responsible for: readiness, silence, death, interruption, and one report of it all.
//! Not responsible for: what the processes do, or what is printed of it.

use shm_types::{Checked, WorldSnapshot};

use crate::options::{OptionError, RunPlan};
use crate::report::RunReport;

/// Told how a run is going. Called from the thread that runs the supervisor.
pub trait Observer {
    /// All participants have answered their first tick. `pids` are in the order of the roles.
    fn started(&mut self, run: &str) {
        let _ = run;
    }

    /// The newest state, a few times a second.
    fn progress(&mut self, snapshot: Checked<'_, WorldSnapshot>) {
        let _ = snapshot;
    }

    /// Something a user should know, as one sentence.
    fn note(&mut self, text: &str) {
        let _ = text;
    }
}

/// An observer that wants to know nothing.
impl Observer for () {}

/// Why a run could not be started. Once its first tick is answered, whatever goes wrong ends in a
/// [`RunReport`] instead.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// An option that cannot be honoured (status 2).
    #[error(transparent)]
    Options(#[from] OptionError),
    /// The plan's scenario is none (a bug of the caller: it comes from a parsed scenario).
    #[error("could not read the run's own scenario: {0}")]
    Scenario(String),
}

/// Runs a plan to its end.
///
/// # Errors
/// The run could not be started; nothing of it is left.
pub fn run(plan: &RunPlan, observer: &mut dyn Observer) -> Result<RunReport, RunError> {
    let _ = (plan, observer);
    todo!()
}
