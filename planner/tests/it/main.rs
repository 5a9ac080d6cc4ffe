//! The planner as its users see it.

mod certificate;
mod easy;
mod field;
mod hard;
mod room;
mod search;
mod selection;
mod service;
mod speed;
