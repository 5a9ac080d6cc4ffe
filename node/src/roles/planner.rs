//! The loop around the planner.

use std::path::Path;

use crate::roles::RoleError;

/// Takes part in the run in `run_dir` until it ends.
///
/// # Errors
/// Set-up failed, or the run broke off.
pub fn main(run_dir: &Path) -> Result<(), RoleError> {
    let _ = run_dir;
    todo!()
}
