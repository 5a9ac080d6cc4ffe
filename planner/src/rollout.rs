//! Runs of other methods, carried out beforehand: what they come to is a plan to begin with.
//!
//! Responsible for: what a method that plans ahead asks of such a run.
//! Not responsible for: carrying it out, which takes a world and robots (crate `sim`).

use scene::{Scene, Settings};
use shm_types::{Counters, Outcome};

/// What a tick of such a run takes for each robot at least, in work units.
pub const UNITS_PER_ROBOT_AND_TICK: u64 = 3;

/// One object brought from where it stood to its goal, in one go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transfer {
    /// Index of the object.
    pub object: u32,
    /// Index of the robot.
    pub robot: u32,
    /// By which of the object's grasps it is held, from 0.
    pub grasp: u8,
}

/// A run from the scene's start in which nothing goes wrong.
pub trait Rollout {
    /// Makes one tick, unless the run has ended; how it stands then.
    fn tick(&mut self) -> Outcome;

    /// World time that it has taken, ns.
    fn time_ns(&self) -> u64;

    /// What was done in it so far; the units are those that carrying it out took.
    fn work(&self) -> Counters;

    /// What robots have grasped so far, in the order of the grasps.
    fn transfers(&self) -> &[Transfer];
}

/// Begins a run of all robots of a scene, as the settings say.
pub type BeginRollout = fn(&Scene, &Settings) -> Box<dyn Rollout>;
