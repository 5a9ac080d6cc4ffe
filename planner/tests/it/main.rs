//! The planner as its users see it.

mod field;
mod room;
mod search;
mod speed;
