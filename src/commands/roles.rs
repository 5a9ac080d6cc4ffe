//! `rearrange world | planner | robot | recorder`: one process of a run, started by the supervisor.
//!
//! Responsible for: handing over to the role's loop in crate `node`.

use node::{Role, roles};

use crate::cli::RoleArgs;
use crate::exit::{Exit, Failure, Outcome};

/// Takes part in a run until it ends.
pub(crate) fn main(role: Role, args: &RoleArgs) -> Outcome {
    match role {
        Role::World => roles::world::main(&args.run),
        Role::Planner => roles::planner::main(&args.run),
        Role::Robot(index) => roles::robot::main(&args.run, index),
        Role::Recorder => roles::recorder::main(&args.run),
    }
    .map(|()| Exit::Success)
    .map_err(|error| Failure::system(format!("{role}: {error}")))
}
