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

use nalgebra::Vector2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Version of the format this crate writes and reads.
pub const FORMAT: u32 = 1;

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

/// Channel `scene`, once, first of all: everything that does not change.
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
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum $name { $($(#[$vmeta])* $variant,)+ }

        impl From<shm_types::$name> for $name {
            fn from(tag: shm_types::$name) -> Self {
                match tag { $(shm_types::$name::$variant => Self::$variant,)+ }
            }
        }
    };
}

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

word! {
    /// What a robot says it is doing.
    Phase {
        /// No task, at home.
        Idle,
        /// Working out which task to take.
        Selecting,
        /// On its way to grasp, empty.
        Transit,
        /// Closing its grip.
        Grasping,
        /// On its way with its object.
        Transfer,
        /// Opening its grip.
        Releasing,
        /// Its task has failed; it waits for the answer.
        Failing,
        /// No task, on its way home.
        GoingHome,
    }
}

word! {
    /// What a robot did in the tick before (rule 24).
    Activity {
        /// Its position changed.
        Moving,
        /// It stood still because it, or someone it waits for, was computing.
        Computing,
        /// It stood still for a grant or for another robot.
        Waiting,
        /// Its grip closed or opened.
        Gripping,
        /// It had nothing to do.
        Idle,
    }
}

word! {
    /// Where an object's task stands.
    TaskStatus {
        /// Needs transport, nobody has claimed it.
        Waiting,
        /// Claimed by a robot that does not hold the object yet.
        Claimed,
        /// Its object is held.
        Held,
        /// At its goal, or in need of none.
        Done,
    }
}

word! {
    /// Why a task has failed (rule 21).
    FailureCause {
        /// None given.
        None,
        /// No manipulation path with the objects as they are.
        Objects,
        /// Another robot was in the way for too long.
        Robots,
    }
}

word! {
    /// Which hard test found a constraint (the table before rule 10).
    ConstraintKind {
        /// No transfer path with the other object at its initial place.
        H1,
        /// No transfer path with the other object at its goal.
        H2,
    }
}

/// What happens at an instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Happening {
    /// The run begins.
    Started,
    /// A robot has claimed a task.
    Claimed {
        /// Who.
        robot: usize,
        /// Which task.
        task: usize,
        /// Epoch in which it was selected.
        epoch: u64,
    },
    /// A robot has given its task back.
    Unclaimed {
        /// Who.
        robot: usize,
        /// Which task.
        task: usize,
    },
    /// A robot has begun to close its grip.
    GraspStarted {
        /// Who.
        robot: usize,
        /// On which task's object.
        task: usize,
    },
    /// A robot holds an object.
    Grasped {
        /// Who.
        robot: usize,
        /// Which task's object.
        task: usize,
    },
    /// A robot has begun to open its grip.
    ReleaseStarted {
        /// Who.
        robot: usize,
    },
    /// A robot has put its object down.
    Released {
        /// Who.
        robot: usize,
        /// Which task's object.
        task: usize,
    },
    /// A task is completed: its object stands at its goal.
    Completed {
        /// Which task.
        task: usize,
    },
    /// A task has failed for a robot.
    Failed {
        /// Who.
        robot: usize,
        /// Which task.
        task: usize,
        /// Why.
        cause: FailureCause,
        /// The robot in the way, if it was one.
        blocker: Option<usize>,
    },
    /// A hard constraint came into force.
    Constraint {
        /// Task that goes first.
        before: usize,
        /// Task that goes later.
        after: usize,
        /// Which test found it.
        test: ConstraintKind,
    },
    /// A new epoch of selection has opened.
    Epoch {
        /// Its number.
        epoch: u64,
    },
    /// A robot takes part again.
    RobotUp {
        /// Who.
        robot: usize,
        /// Incarnation of its process.
        incarnation: u64,
    },
    /// A robot is gone; it stays where it is.
    RobotDown {
        /// Who.
        robot: usize,
    },
    /// All motion is held.
    Held,
    /// Motion goes on.
    Resumed,
    /// The run has ended.
    Ended {
        /// How.
        outcome: Outcome,
    },
    /// The world found an invariant broken.
    Violated {
        /// A robot involved.
        robot: Option<usize>,
        /// An object involved.
        task: Option<usize>,
        /// Another body involved.
        other: Option<usize>,
        /// Which invariant, by the world's numbers.
        invariant: u64,
    },
}

impl Happening {
    /// The robot and the task it names, where there is one of each kind.
    pub(crate) const fn names(&self) -> (Option<usize>, Option<usize>) {
        match *self {
            Self::Claimed { robot, task, .. }
            | Self::Unclaimed { robot, task }
            | Self::GraspStarted { robot, task }
            | Self::Grasped { robot, task }
            | Self::Released { robot, task }
            | Self::Failed { robot, task, .. } => (Some(robot), Some(task)),
            Self::ReleaseStarted { robot }
            | Self::RobotUp { robot, .. }
            | Self::RobotDown { robot } => (Some(robot), None),
            Self::Completed { task } => (None, Some(task)),
            Self::Violated { robot, task, .. } => (robot, task),
            Self::Started
            | Self::Constraint { .. }
            | Self::Epoch { .. }
            | Self::Held
            | Self::Resumed
            | Self::Ended { .. } => (None, None),
        }
    }
}

/// Channel `event`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Event {
    /// Tick whose state is the first to show it.
    pub tick: u64,
    /// When.
    pub time_ns: u64,
    /// What.
    #[serde(flatten)]
    pub what: Happening,
}

/// One robot in a `state` record.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotNow {
    /// Its centre.
    pub at: Place,
    /// Task it has claimed.
    pub task: Option<usize>,
    /// Object it holds.
    pub holding: Option<usize>,
    /// What it says it is doing.
    pub phase: Phase,
    /// What it did in the tick before.
    pub activity: Activity,
}

/// One object in a `state` record.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ObjectNow {
    /// Its centre.
    pub at: Place,
    /// Robot that holds it.
    pub holder: Option<usize>,
    /// Where its task stands.
    pub status: TaskStatus,
}

/// Channel `state`: the whole world at an instant, at a set rate, for viewers, and as the new
/// start after a gap.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct State {
    /// Number of the world's snapshot.
    pub tick: u64,
    /// When.
    pub time_ns: u64,
    /// Epoch of selection.
    pub epoch: u64,
    /// Version of the hard constraints in force.
    pub constraints_version: u32,
    /// The robots.
    pub robots: Vec<RobotNow>,
    /// The objects.
    pub objects: Vec<ObjectNow>,
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
