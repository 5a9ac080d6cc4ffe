//! Each kind of violation, planted in a run that is clean without it, and the checker's geometry
//! held against the scene's.

mod events;
mod geometry;
mod grid;
mod motion;
mod story;
mod touching;

use super::report::Who;

const ROBOT: Who = Who::Robot(0);
const OBJECT: Who = Who::Object(0);
