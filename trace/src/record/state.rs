//! Channel `state`: the whole world at an instant.
//!
//! Responsible for: what viewers see of robots and objects. Not responsible for: how they came
//! there (`motion` and `event` records).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Place, word};

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

/// Whose action a robot waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct WaitsFor {
    /// Who goes first.
    pub robot: usize,
    /// Number of the action that has to be granted to it before, counted from 1.
    pub action: u32,
}

/// One robot in a `state` record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    /// Methods that plan ahead: whose action has to come before its next one. Left out where there
    /// is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub waits_for: Option<WaitsFor>,
    /// Corners of the path granted to it and still ahead: `at`, then these, is the way it will
    /// move. Left out where nothing is granted.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub grant: Vec<Place>,
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
