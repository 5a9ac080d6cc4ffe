//! Runs in which things go wrong, seed by seed.
//!
//! Responsible for: faults between the machines of a run, what must hold all the same, and making
//! a run that fails small. Not responsible for: the machines; the undisturbed run
//! (`simulation.rs`); threads, progress and files (the binary).
//!
//! Terms: a *fault* is one thing that goes wrong, a *plan* all those of a run. A *trial* is one
//! seed: a room, a method and a plan, run once undisturbed and once disturbed. A *finding* is what
//! was not as it should be.

mod active;
mod babble;
mod driver;
mod fault;
mod ground;
mod line;
mod office;
mod reader;
mod shrink;
mod station;
mod trial;
mod watch;

pub use driver::Disturbed;
pub use fault::{Channel, Fault, Kind, MOST_FAULTS, Numbers, Terms, Whom, draw};
pub use shrink::shrink;
pub use trial::{Cut, Ended, Finding, Onlooker, Trial, Undisturbed};
