//! Channel `scene`: what changes seldom or never.
//!
//! Responsible for: the record's parts. Not responsible for: where they come from
//! (`scene_record`).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Place;

/// What a body or a wall looks like, around its own origin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outline {
    /// An axis-parallel box.
    Box {
        /// Half widths along x and y, m.
        half: Place,
    },
    /// A disc.
    Circle {
        /// Its radius, m.
        radius: f64,
    },
    /// A convex polygon.
    Polygon {
        /// Its corners, counter-clockwise, m.
        points: Vec<Place>,
    },
}

/// A wall.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Wall {
    /// What it looks like.
    pub shape: Outline,
    /// Where its origin is.
    pub at: Place,
}

/// What all robots are like.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotKind {
    /// What it looks like.
    pub shape: Outline,
    /// Its speed limit, m/s.
    pub speed_m_per_s: f64,
    /// What it keeps from everything but what it grasps, m.
    pub clearance_m: f64,
    /// How long its grip takes to close.
    pub grasp_ns: u64,
    /// How long its grip takes to open.
    pub release_ns: u64,
}

/// An object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Object {
    /// What it looks like.
    pub shape: Outline,
    /// Robot centre minus object centre while it is held.
    pub grasp: Place,
    /// Whether robots that carry nothing may pass under it while it stands on the ground.
    pub pass_under: bool,
    /// Where it stands at the start.
    pub start: Place,
    /// Where it is to go; none for clutter.
    pub goal: Option<Place>,
}

/// An instant in the life of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Instant {
    /// A robot sets out for the object: it has claimed the task.
    Start,
    /// The object is grasped.
    Grasp,
    /// The task is completed.
    Finish,
}

/// One instant of one task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct TaskInstant {
    /// The task.
    pub task: usize,
    /// Which of its instants.
    pub instant: Instant,
}

/// An order the user has asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Order {
    /// What comes first.
    pub first: TaskInstant,
    /// What comes later.
    pub then: TaskInstant,
}

/// Channel `scene`, first of all, and again, first behind a mark, whenever it changes: what holds
/// from there on. Robots stay the same, and so do objects but for their goals and their starts;
/// more of them may come behind them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SceneRecord {
    /// Version of this format.
    pub format: u32,
    /// Version of the program that wrote the trace.
    pub program_version: String,
    /// Name of the scenario.
    pub name: String,
    /// Hash of the canonical scenario, hexadecimal.
    pub scenario_hash: String,
    /// Identity of the run, hexadecimal.
    pub run_id: String,
    /// Lower left corner of the workspace.
    pub low: Place,
    /// Upper right corner of the workspace.
    pub high: Place,
    /// The walls inside the workspace.
    pub walls: Vec<Wall>,
    /// What all robots are like.
    pub robot: RobotKind,
    /// Where each robot starts and ends.
    pub homes: Vec<Place>,
    /// The objects.
    pub objects: Vec<Object>,
    /// The orders the user has asked for.
    pub before: Vec<Order>,
    /// All options of the run that the machines read.
    pub settings: serde_json::Value,
}
