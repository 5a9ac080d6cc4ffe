//! The world's step machine: it owns every body, grants space before anyone moves, moves what is
//! granted, and keeps the book of tasks.
//!
//! Responsible for: bodies and what overlaps what; granting path (no two robots ever collide,
//! whatever is late, stale or dead); motion; grips; claims, failures, bars and epochs (rules 13,
//! 18–22); the account of each robot's time (rule 24); the invariants; the state hash.
//! Not responsible for: what to do next. The world knows neither planner nor robot, only their
//! messages, and reads no clock.
//!
//! Terms: a *grant* is path that is one robot's own until it has moved along it; the *rest* is
//! what it asked for and has not been granted. A *claim* is a robot's hold on a task, a *grip* its
//! hold on an object. A *bar* keeps a failed task from the robot it failed for. A *track* is where
//! a robot is during one tick.
//!
//! One step, in this order: a change of the scene, control, commands, constraint version, failures, grips that begin,
//! grants in space, grants in time, motion, grips that end, bars and epoch, invariants, accounts,
//! schedule version, outcome, hash. One file each.
#![forbid(unsafe_code)]

mod accounts;
mod bars;
mod bodies;
mod broad;
mod change;
mod checkpoint;
mod claims;
mod cleared;
mod commands;
mod constraints;
mod control;
mod epoch;
mod extension;
mod grants;
mod grip;
mod guards;
mod invariants;
mod journal;
mod motion;
mod objects;
mod parts;
mod path;
#[cfg(test)]
mod random;
mod requests;
mod saved;
mod schedules;
mod settled;
mod state;
mod step;
mod tasks;
#[cfg(test)]
mod testing;
mod track;
mod wire;

pub use accounts::{ActivityTimes, WorldCounters};
pub use change::{Blocked, Next, NotMade};
pub use checkpoint::CheckpointError;
pub use control::FIRST_INCARNATION;
pub use guards::Guard;
pub use invariants::{Checks, Invariant, Violation};
pub use objects::{MAX_PARTS, PER_PART};
pub use schedules::{PublishedSchedule, Refused};
pub use step::{World, WorldInput};
