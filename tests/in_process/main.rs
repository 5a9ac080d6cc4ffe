//! Whole runs in one thread, without processes: one program, so that it is linked once.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod changes;
mod guarantees;
mod paper_rooms;
mod plans;
mod rooms;
mod schedules;
