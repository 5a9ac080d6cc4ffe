//! Channel `event`: what happens at an instant.
//!
//! Responsible for: each kind of event with what it names. Not responsible for: what may happen
//! when (`check`).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Outcome, word};

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

word! {
    /// Why a schedule is refused.
    Refusal {
        /// It is no legal message.
        Illegal,
        /// A robot's actions begin past what is granted to it, or end before.
        Gap,
        /// What is granted to a robot leads elsewhere than it says.
        Elsewhere,
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
    /// The scene has changed, as the newest `scene` record says.
    Changed {
        /// How often it has.
        version: u64,
    },
    /// Somebody has moved an object by hand: it stands at its start in the newest `scene` record.
    Moved {
        /// Which.
        task: usize,
    },
    /// The world has refused a schedule.
    ScheduleRefused {
        /// Its version.
        version: u64,
        /// Why.
        why: Refusal,
        /// The robot that it does not fit.
        robot: Option<usize>,
        /// How many actions were granted to that one.
        granted: u64,
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
            Self::Completed { task } | Self::Moved { task } => (None, Some(task)),
            Self::Violated { robot, task, .. } => (robot, task),
            Self::ScheduleRefused { robot, .. } => (robot, None),
            Self::Started
            | Self::Changed { .. }
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
