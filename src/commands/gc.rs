//! `rearrange gc`: removes what dead runs of this user have left.
//!
//! Responsible for: saying what goes, or would.
//! Not responsible for: finding it (crate `node`).

use crate::cli::GcArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::output;

/// Removes it, and prints a line for each run.
pub(crate) fn main(args: &GcArgs) -> Outcome {
    let found = if args.dry_run {
        node::domain::leftovers()
    } else {
        node::domain::gc()
    };
    let found = found.map_err(Failure::system)?;
    if found.is_empty() {
        output::complain("dead runs have left nothing");
    }
    for run in found {
        let verb = if args.dry_run {
            "would remove"
        } else {
            "removed"
        };
        let name = run.name.as_deref().unwrap_or("without a name");
        let place = run.directory.map_or_else(
            || "no directory".to_owned(),
            |directory| directory.display().to_string(),
        );
        let files = output::count(run.shared_memory_files as u64, "file");
        let id = run.id;
        output::print(&format!(
            "{verb} run {id} ({name}): {place}, {files} in shared memory\n"
        ))?;
    }
    Ok(Exit::Success)
}
