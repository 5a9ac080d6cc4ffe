//! Who takes part in a run.
//!
//! Responsible for: the participants and what they are called.
//! Not responsible for: what they do (`roles`).
//!
//! Terms: a *role* is a kind of process; a *participant* is one process of a run.

use std::fmt;

use serde::{Deserialize, Serialize};
use shm_types::RoleKind;

/// One process of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Owns the state of all bodies.
    World,
    /// Works out hard constraints.
    Planner,
    /// Moves the robot of this number.
    Robot(u32),
    /// Writes the trace.
    Recorder,
}

impl Role {
    /// All participants of a run with `robots` robots, in the order in which they are started.
    pub fn all(robots: u32) -> impl Iterator<Item = Self> {
        [Self::World, Self::Planner, Self::Recorder]
            .into_iter()
            .chain((0..robots).map(Self::Robot))
    }

    /// The subcommand that runs it.
    #[must_use]
    pub const fn subcommand(self) -> &'static str {
        match self {
            Self::World => "world",
            Self::Planner => "planner",
            Self::Robot(_) => "robot",
            Self::Recorder => "recorder",
        }
    }

    /// Its kind on the wire.
    #[must_use]
    pub const fn kind(self) -> RoleKind {
        match self {
            Self::World => RoleKind::World,
            Self::Planner => RoleKind::Planner,
            Self::Robot(_) => RoleKind::Robot,
            Self::Recorder => RoleKind::Recorder,
        }
    }
}

/// `world`, `planner`, `robot-2`, `recorder`: in messages and in file names.
impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Robot(index) => write!(f, "robot-{index}"),
            other => f.write_str(other.subcommand()),
        }
    }
}

/// A text that names no participant.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no role is called {0:?}; roles are world, planner, recorder and robot-N")]
pub struct UnknownRole(pub String);

impl std::str::FromStr for Role {
    type Err = UnknownRole;

    fn from_str(text: &str) -> Result<Self, UnknownRole> {
        match text {
            "world" => Ok(Self::World),
            "planner" => Ok(Self::Planner),
            "recorder" => Ok(Self::Recorder),
            other => other
                .strip_prefix("robot-")
                .and_then(|index| index.parse().ok())
                .map(Self::Robot)
                .ok_or_else(|| UnknownRole(other.to_owned())),
        }
    }
}
