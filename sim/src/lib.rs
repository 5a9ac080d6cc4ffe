//! The in-process driver: world, planner and robots in one thread, with in-memory channels.
//!
//! Responsible for: the order of things within a tick, what is seen when, and one report at the
//! end. It is the reference for the other drivers: a lockstep run of real processes has the same
//! hash at every tick. And for the same with faults between the machines ([`faults`]).
//! Not responsible for: what the machines decide, traces, clocks, printing.
//!
//! Terms: a message is *staged* from the step that sends it to the step that sees it.
//!
//! In tick k everyone steps on snapshot k. A request stamped k is seen by the planner in its step
//! k+1; its answers and the tables it publishes are seen by the robots one step later still. The
//! world takes the commands of tick k, in robot order, and makes snapshot k+1.
#![forbid(unsafe_code)]

pub mod faults;
mod report;
mod rollout;
mod simulation;
mod tables;

pub use report::{RobotReport, SimReport};
pub use rollout::rollout;
pub use simulation::{Observer, Participant, Probe, Simulation};
