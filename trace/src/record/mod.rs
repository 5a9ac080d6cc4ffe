//! The words of a trace: one type for each channel of the file.
//!
//! Responsible for: what each record holds, its JSON form and schema, and which records are fit to
//! be read at all.
//! Not responsible for: how records lie in the file (`writer`, `reader`) or whether the run they
//! tell of is a legal one (`check`).
//!
//! All lengths are metres in the world frame, all times nanoseconds of virtual time since the
//! start of the run. Robots, objects and walls are counted from 0; object `i` and the task that
//! brings it to its goal share one number. `docs/trace.md` describes the format for readers of
//! other programs.

mod event;
mod scene;
mod state;

use nalgebra::Vector2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use event::{ConstraintKind, Event, FailureCause, Happening, Refusal};
pub use scene::{Instant, Object, Order, Outline, RobotKind, SceneRecord, TaskInstant, Wall};
pub use state::{Activity, ObjectNow, Phase, RobotNow, State, TaskStatus};

/// Version of the format this crate writes. It reads this one and those before.
pub const FORMAT: u32 = 2;

/// A point or an offset, m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Place {
    /// Metres along x.
    pub x: f64,
    /// Metres along y.
    pub y: f64,
}

impl Place {
    /// The point at `x`, `y`.
    #[must_use]
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }
}

impl From<Place> for Vector2<f64> {
    fn from(place: Place) -> Self {
        Self::new(place.x, place.y)
    }
}

impl From<Vector2<f64>> for Place {
    fn from(vector: Vector2<f64>) -> Self {
        Self::new(vector.x, vector.y)
    }
}

impl From<shm_types::Point> for Place {
    fn from(point: shm_types::Point) -> Self {
        Self::new(point.x, point.y)
    }
}

/// What kind of body moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BodyKind {
    /// A robot.
    Robot,
    /// An object, and so the robot that holds it.
    Object,
}

/// Channel `motion`: a body's straight motion at constant velocity. A body that no record moves
/// stands still.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Motion {
    /// What moves.
    pub body: BodyKind,
    /// Which one.
    pub id: usize,
    /// When it is at `from`.
    pub start_ns: u64,
    /// When it is at `to`; later than `start_ns`.
    pub end_ns: u64,
    /// Its centre at the start.
    pub from: Place,
    /// Its centre at the end.
    pub to: Place,
}

impl Motion {
    /// Where the body is at `time_ns`, between start and end.
    #[must_use]
    pub fn at(&self, time_ns: u64) -> Vector2<f64> {
        let (from, to): (Vector2<f64>, Vector2<f64>) = (self.from.into(), self.to.into());
        if time_ns >= self.end_ns {
            return to;
        }
        let part =
            time_ns.saturating_sub(self.start_ns) as f64 / (self.end_ns - self.start_ns) as f64;
        from + (to - from) * part
    }
}

/// Defines an enum that a trace spells out, one value for each of a wire tag.
macro_rules! word {
    ($(#[$meta:meta])* $name:ident { $($(#[$vmeta:meta])* $variant:ident,)+ }) => {
        $(#[$meta])*
        #[derive(
            Clone, Copy, Debug, PartialEq, Eq,
            serde::Serialize, serde::Deserialize, schemars::JsonSchema,
        )]
        #[serde(rename_all = "snake_case")]
        pub enum $name { $($(#[$vmeta])* $variant,)+ }

        impl From<shm_types::$name> for $name {
            fn from(tag: shm_types::$name) -> Self {
                match tag { $(shm_types::$name::$variant => Self::$variant,)+ }
            }
        }
    };
}
pub(crate) use word;

word! {
    /// How the run stands or stood.
    Outcome {
        /// Still going.
        Running,
        /// Every object at its goal, every robot at home (rule 6).
        Solved,
        /// Nothing moves and nothing can be selected (rule 22).
        Stuck,
        /// The time limit has passed (rule 22).
        Timeout,
        /// Somebody stopped it.
        Interrupted,
        /// An invariant was broken.
        Violated,
        /// Something it needs was gone for good.
        Failed,
    }
}

/// Channel `mark`: all motion and events up to this time lie before this record, all later
/// ones behind it. A mark ends every chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Mark {
    /// Tick of the last batch of motion before it.
    pub tick: u64,
    /// Time of that tick.
    pub time_ns: u64,
}

/// Channel `gap`: batches of motion and events were lost here. What is known next is the first
/// `state` record of tick `before_tick - 1` or later.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Gap {
    /// Tick of the last batch before the gap; 0 if there is none.
    pub after_tick: u64,
    /// Tick of the first batch after the gap.
    pub before_tick: u64,
    /// How many batches are missing.
    pub batches: u64,
}

/// Channel `end`, once, last of all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct End {
    /// How the run ended.
    pub outcome: Outcome,
    /// Why, where there is more to say.
    pub reason: Option<String>,
    /// When the run ended.
    pub makespan_ns: u64,
    /// False if a batch is missing.
    pub complete: bool,
    /// All options of the command that ran it.
    pub options: serde_json::Value,
}
