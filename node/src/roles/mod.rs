//! One file per role: the loop around its machine.

pub mod planner;
pub mod recorder;
pub mod robot;
pub mod world;

/// Why a role gave up.
#[derive(Debug, thiserror::Error)]
pub enum RoleError {
    /// The run's directory could not be read.
    #[error("could not read the run in {path}: {reason}")]
    Run {
        /// Where it was looked for.
        path: std::path::PathBuf,
        /// Why not.
        reason: String,
    },
}
