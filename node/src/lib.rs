//! The process shell: the only crate that names iceoryx2, `core_affinity` or a clock.
//!
//! Responsible for: carrying messages between processes, the domain of a run and its clean-up,
//! who waits for whom and for how long, starting and stopping processes, measuring.
//! Not responsible for: what any machine decides (crates `world`, `planner`, `robot`), or what is
//! printed (the binary).

mod calls;
mod children;
mod clock;
pub mod doctor;
pub mod domain;
pub mod histograms;
mod journal;
pub mod options;
mod ports;
mod realtime;
pub mod reference;
pub mod report;
pub mod roles;
pub mod shared_memory;
pub mod supervisor;
mod tell;
mod ticker;
mod topics;
mod wait;
mod wakes;
mod wire;

pub use clock::now_ns as monotonic_ns;
pub use histograms::{Latencies, LatencySummary, Timed};
pub use options::{
    Clock, Delay, Launcher, OptionError, Role, RunOptions, RunPlan, Told, ToldAt, Wait,
};
pub use realtime::pin_thread;
pub use report::{RoleReport, RunReport, WorldReport};
pub use supervisor::{Observer, RunError, Signals};
pub use tell::{Answered, TellError, tell};
