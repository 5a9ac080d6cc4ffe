//! `rearrange world | planner | robot | recorder`: one process of a run, started by the supervisor.
//!
//! Responsible for: handing over to the role's loop in crate `node`, or to bare iceoryx2 in its
//! place.

use node::{Role, roles};

use crate::cli::{ReferenceRole, RoleArgs};
use crate::exit::{Exit, Failure, Outcome};

/// Takes part in a run until it ends.
pub(crate) fn main(role: Role, args: &RoleArgs) -> Outcome {
    match role {
        Role::World => roles::world::main(&args.run, args.incarnation),
        Role::Planner => roles::planner::main(&args.run, args.incarnation),
        Role::Robot(index) => roles::robot::main(&args.run, index, args.incarnation),
        Role::Recorder => roles::recorder::main(&args.run, args.incarnation),
    }
    .map(|()| Exit::Success)
    .map_err(|error| Failure::system(format!("{role}: {error}")))
}

/// Takes part in a reference until it ends.
pub(crate) fn reference(role: &ReferenceRole) -> Outcome {
    let (role, args) = match role {
        ReferenceRole::World(args) => (Role::World, args),
        ReferenceRole::Planner(args) => (Role::Planner, args),
        ReferenceRole::Robot(args) => (Role::Robot(args.index), args),
        ReferenceRole::Recorder(args) => (Role::Recorder, args),
    };
    node::reference::main(role, &args.run)
        .map(|()| Exit::Success)
        .map_err(|error| Failure::system(format!("reference of {role}: {error}")))
}
