//! A scenario as somebody states it: plain numbers, nothing checked yet.
//!
//! Responsible for: what can be stated, in a file or by a program.
//! Not responsible for: whether it is any good (`validate`), how a file spells it (`file`).
//!
//! All lengths are metres of the world frame, durations seconds.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::lattice::Connectivity;

/// Default planning cell, m (rule 8).
pub const DEFAULT_RESOLUTION_M: f64 = 0.1;

/// A shape around its own centre.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ShapeDraft {
    /// Full widths along x and y, m.
    Box(#[serde(deserialize_with = "crate::file::numbers")] [f64; 2]),
    /// Radius, m.
    Circle(f64),
    /// Corners of a convex polygon around its centre [0, 0], m.
    Polygon(#[serde(deserialize_with = "crate::file::lists")] Vec<[f64; 2]>),
}

/// A wall, in world coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum WallDraft {
    /// Lower left and upper right corner: x0, y0, x1, y1, m.
    Box(#[serde(deserialize_with = "crate::file::numbers")] [f64; 4]),
    /// Corners of a convex polygon, m.
    Polygon(#[serde(deserialize_with = "crate::file::lists")] Vec<[f64; 2]>),
}

/// The robots' common properties.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotDraft {
    /// Shape around the robot's centre.
    pub shape: ShapeDraft,
    /// Speed, m/s.
    pub speed_m_per_s: f64,
    /// Distance kept from everything but what is grasped, m.
    pub clearance_m: f64,
    /// Duration of a grasp, s.
    pub grasp_s: f64,
    /// Duration of a release, s.
    pub release_s: f64,
}

/// One object.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectDraft {
    /// Shape around the object's centre.
    pub shape: ShapeDraft,
    /// Robot centre minus object centre while grasped, m (rule 2).
    pub grasp: [f64; 2],
    /// Further grasps, likewise.
    pub other_grasps: Vec<[f64; 2]>,
    /// Whether robots that carry nothing may pass under it while it is on the ground.
    pub pass_under: bool,
    /// Objects of one kind are interchangeable: any of them may stand at any of their goals.
    pub kind: Option<String>,
    /// Where its centre is at the start.
    pub start: [f64; 2],
    /// Where its centre shall be; none for clutter.
    pub goal: Option<[f64; 2]>,
}

/// An instant of a task (rule 5).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// A robot sets out for the object.
    Start,
    /// The object is grasped.
    Grasp,
    /// The object is released at its goal.
    Finish,
}

impl Event {
    /// Every event, in the order they occur in.
    pub const ALL: [Self; 3] = [Self::Start, Self::Grasp, Self::Finish];

    /// The word in a scenario file.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Grasp => "grasp",
            Self::Finish => "finish",
        }
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// The user's own order: one event of one task before one of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UserOrder {
    /// Task and event that come first.
    pub first: (usize, Event),
    /// Task and event that come later.
    pub then: (usize, Event),
}

/// One move of a certificate: a robot carries an object, everybody else at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// The object.
    pub object: usize,
    /// Where its centre is before, m.
    pub from: [f64; 2],
    /// Where its centre is afterwards, m.
    pub to: [f64; 2],
}

/// A whole scenario, unchecked.
#[derive(Clone, Debug, PartialEq)]
pub struct Draft {
    /// Its name.
    pub name: String,
    /// Planning cell where no exact lattice can be had (rule 8), m.
    pub resolution_m: f64,
    /// Which lattice points are joined by a step.
    pub connectivity: Connectivity,
    /// Lower left and upper right corner of the workspace: x0, y0, x1, y1, m.
    pub bounds: [f64; 4],
    /// Walls inside the bounds.
    pub walls: Vec<WallDraft>,
    /// What the robots have in common.
    pub robot: RobotDraft,
    /// Where the robots start and return to: as many robots as homes.
    pub homes: Vec<[f64; 2]>,
    /// The objects.
    pub objects: Vec<ObjectDraft>,
    /// The user's own order.
    pub before: Vec<UserOrder>,
    /// Moves that solve it one after the other (rule 28), where known.
    pub certificate: Vec<Move>,
}

impl RobotDraft {
    /// The paper's robot (Table I): 0.5 m square, 0.5 m/s.
    #[must_use]
    pub const fn paper() -> Self {
        Self {
            shape: ShapeDraft::Box([0.5, 0.5]),
            speed_m_per_s: 0.5,
            clearance_m: 0.0,
            grasp_s: 0.0,
            release_s: 0.0,
        }
    }
}

impl ObjectDraft {
    /// The paper's object (Table I): 0.4 m square, the robot against its −y side (rule 2).
    #[must_use]
    pub const fn paper(start: [f64; 2], goal: Option<[f64; 2]>) -> Self {
        Self {
            shape: ShapeDraft::Box([0.4, 0.4]),
            grasp: [0.0, -0.45],
            other_grasps: Vec::new(),
            kind: None,
            pass_under: false,
            start,
            goal,
        }
    }
}

impl Draft {
    /// An empty room with the paper's robots and lattice, to be filled by a program.
    #[must_use]
    pub fn room(name: &str, bounds: [f64; 4]) -> Self {
        Self {
            name: name.to_owned(),
            resolution_m: DEFAULT_RESOLUTION_M,
            connectivity: Connectivity::Eight,
            bounds,
            walls: Vec::new(),
            robot: RobotDraft::paper(),
            homes: Vec::new(),
            objects: Vec::new(),
            before: Vec::new(),
            certificate: Vec::new(),
        }
    }
}
