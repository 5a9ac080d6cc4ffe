//! A run to look at: a page that plays it, and a still.
//!
//! Responsible for: both, from a trace alone. Each is one file that needs no other.
//! Not responsible for: files and options (the command `view`), whether the run was legal
//! (`check`).

mod easy;
mod page;
mod standing;
mod still;
mod story;
mod waits;

pub use page::page;
pub use standing::{Cause, Standing, standing};
pub use still::still;
pub use story::Story;
