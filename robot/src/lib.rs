//! One robot's step machine: select a task, go and grasp it, bring it to its goal, go home.
//!
//! Responsible for: everything a robot decides by itself, from the snapshot of one tick to the
//! command of that tick (rules 4, 6, 17–22, 24).
//! Not responsible for: what is true of the world (the world decides), how selection, constraints
//! and paths are worked out (crate `planner`), clocks and transport (crate `node`).
//!
//! Terms: a *look* is one plan from where the robot is going to be, and the request for the first
//! piece of it (rule 20). A *trip* is a sequence of looks to one place: to a grasp, to a goal,
//! home. *Blocked* is a trip whose last look found no way.
//!
//! A step reads the snapshot in place, does at most the work its budget allows, and allocates
//! nothing. A robot whose computation is not done at the end of a step stands still: that is the
//! paper's planning time.
#![forbid(unsafe_code)]

mod account;
mod ahead;
mod blocker;
mod failure;
mod follow;
mod grasp;
mod home;
mod intent;
mod look;
mod now;
mod phase;
mod release;
mod request;
mod select;
mod step;
mod transfer;
mod transit;
mod trip;

pub use step::{Robot, RobotInput};
