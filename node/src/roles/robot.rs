//! The loop around one robot.

use std::path::Path;

use crate::roles::RoleError;

/// Takes part in the run in `run_dir` as robot `index` until it ends.
///
/// # Errors
/// Set-up failed, or the run broke off.
pub fn main(run_dir: &Path, index: u32) -> Result<(), RoleError> {
    let _ = (run_dir, index);
    todo!()
}
