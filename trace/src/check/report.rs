//! What the checker has to say.
//!
//! Responsible for: the kinds of violation, how one reads, reporting one that goes on only once.
//! Not responsible for: finding them.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use crate::record::Outcome;

/// Violations with less than this between them are one that goes on, ns.
const GOES_ON_NS: u64 = 1_000;
/// Violations listed in full. A trace with more is not worth reading on; the rest is counted.
const MOST_LISTED: usize = 1_000;

/// What was not legal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A record of a time that is over, or of one not reached yet.
    Order,
    /// A body is somewhere else than its motion so far has brought it.
    Continuity,
    /// A body moves faster than robots do.
    Speed,
    /// An object moves that nobody holds.
    MovedAlone,
    /// A held object and its holder do not move as one.
    Rigidity,
    /// Two bodies, or a body and a wall, overlap.
    Collision,
    /// A robot, or what it carries, comes nearer to something than the clearance.
    Clearance,
    /// A robot claims a task that it cannot have.
    Claim,
    /// An object is grasped by a robot that has not claimed it, or from a wrong place.
    Grasp,
    /// A grip opens or closes in less than its time, or its robot moves meanwhile.
    Grip,
    /// A robot holds two objects, two robots hold one, or one is let go that is not held.
    Holding,
    /// A task is called completed, but its object is not at its goal on the ground.
    Completion,
    /// An epoch or a version of the constraints goes back.
    Epoch,
    /// The user's own order is not kept.
    UserOrder,
    /// A state record does not show what the motion and events so far have led to.
    State,
    /// The run does not end as the trace says it does.
    Final,
    /// The world itself reported a broken invariant.
    Reported,
}

/// A body, or what does not move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(tag = "body", content = "id", rename_all = "snake_case")]
pub enum Who {
    /// A robot.
    Robot(usize),
    /// An object.
    Object(usize),
    /// A wall inside the workspace.
    Wall(usize),
    /// The edge of the workspace.
    Bounds,
}

impl fmt::Display for Who {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Robot(id) => write!(f, "robot {id}"),
            Self::Object(id) => write!(f, "object {id}"),
            Self::Wall(id) => write!(f, "wall {id}"),
            Self::Bounds => write!(f, "the edge of the workspace"),
        }
    }
}

/// One thing that was not legal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Violation {
    /// What kind of thing.
    pub kind: Kind,
    /// When it began, ns of virtual time.
    pub time_ns: u64,
    /// Whom it concerns.
    pub who: Vec<Who>,
    /// What happened, as a sentence.
    pub message: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at {:.3} s: {}", self.time_ns as f64 / 1e9, self.message)
    }
}

/// What a check found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckReport {
    /// What was not legal, in order of time.
    pub violations: Vec<Violation>,
    /// How many more there were than are listed.
    pub unlisted_violations: u64,
    /// Exact tests of two bodies in time.
    pub swept_tests: u64,
    /// Whether the trace tells the whole run: not cut short, no batch missing.
    pub complete: bool,
    /// Whether the file was cut short: there is no `end` record.
    pub truncated: bool,
    /// Batches of motion that are missing.
    pub missing_batches: u64,
    /// Virtual time up to which the run was checked, ns.
    pub checked_until_ns: u64,
    /// How the run ended, as the trace says; none if it was cut short.
    pub outcome: Option<Outcome>,
}

/// Collects violations.
#[derive(Default)]
pub(super) struct Findings {
    listed: Vec<Violation>,
    unlisted: u64,
    /// When each violation between two was last seen.
    going_on: BTreeMap<(Kind, Who, Who), u64>,
}

impl Findings {
    /// Adds one that happens at an instant.
    pub(super) fn add(
        &mut self,
        kind: Kind,
        time_ns: u64,
        who: &[Who],
        message: impl FnOnce() -> String,
    ) {
        if self.listed.len() >= MOST_LISTED {
            self.unlisted += 1;
            return;
        }
        self.listed.push(Violation {
            kind,
            time_ns,
            who: who.to_vec(),
            message: message(),
        });
    }

    /// Adds one between two that lasts; as long as it goes on it is one.
    pub(super) fn lasting(
        &mut self,
        kind: Kind,
        (start_ns, end_ns): (u64, u64),
        (a, b): (Who, Who),
        message: impl FnOnce() -> String,
    ) {
        let last = self.going_on.insert((kind, a, b), end_ns);
        if last.is_none_or(|last| last.saturating_add(GOES_ON_NS) < start_ns) {
            self.add(kind, start_ns, &[a, b], message);
        }
    }

    /// All of them in order of time, and how many more there were.
    pub(super) fn into_sorted(mut self) -> (Vec<Violation>, u64) {
        self.listed.sort_by_key(|violation| violation.time_ns);
        (self.listed, self.unlisted)
    }
}
