//! MCAP traces and the independent checker.
//!
//! Responsible for: writing what happened in a run, reading it back, whole or cut short, checking
//! that it was legal with geometry of its own, and showing it: as a page that plays it, as a still.
//! Not responsible for: the run itself; where batches of motion come from.
//!
//! A trace is exact, not sampled: every body's motion is a list of straight pieces at constant
//! velocity, so where anything was at any time, and whether two things ever met, follows in closed
//! form. `docs/trace.md` describes the file.
#![forbid(unsafe_code)]

mod channel;
mod check;
mod fit;
mod frames;
mod merge;
mod reader;
pub mod record;
mod replay;
mod scene_record;
mod view;
mod wire;
mod writer;

pub use check::{CheckError, CheckReport, Kind, Violation, Who, check, check_file};
pub use fit::Unfit;
pub use reader::{Close, ReadError, Reader, Span};
pub use record::SceneRecord;
pub use replay::{Frame, Replay};
pub use view::{Cause, Standing, Story, page, standing, still};
pub use writer::{Ending, Resumed, WriteError, Writer};
