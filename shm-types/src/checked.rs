//! Validation of what comes out of shared memory, once and in place.
//!
//! The pure crates accept nothing but [`Checked`] values, so no code past this file needs to
//! distrust a count, an id or a tag.

use std::ops::Deref;

use crate::capacity::{
    LAYOUT_VERSION, MAGIC, MAX_ACTIONS, MAX_CHANGES, MAX_CONSTRAINTS, MAX_EVENTS, MAX_MOTIONS,
    MAX_OBJECTS, MAX_PATH_POINTS, MAX_ROBOTS, MAX_WAITS,
};
use crate::{
    Activity, BodyKind, ChangeKind, Command, ConstraintKind, ConstraintTable, ControlKind,
    ControlRequest, EventKind, FailureCause, Grip, HardAnswer, HardRequest, MotionBatch, NONE,
    Outcome, Phase, PlannerReport, Point, RecorderReport, RoleKind, Schedule, TaskStatus, Verdict,
    WorldSnapshot,
};

/// No run comes to a tick, a time in ns or an epoch past this: what is added to one does not
/// overflow.
const MOST_TICKS: u64 = 1 << 60;

/// Nor to a version past this one, or to a place further from the origin, m: there doubles are coarser
/// than what divides touching from overlapping.
const MOST_VERSIONS: u32 = 1 << 31;
const FURTHEST_M: f64 = 1e12;

/// Why a message was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Invalid {
    /// An integer that stands for no value of its type.
    #[error("{code} is no {what}")]
    Tag {
        /// Name of the type.
        what: &'static str,
        /// What was found.
        code: u32,
    },
    /// A count over its capacity.
    #[error("{what} is {count}, over the capacity of {capacity}")]
    Count {
        /// Which count.
        what: &'static str,
        /// What was found.
        count: u32,
        /// The most there can be.
        capacity: usize,
    },
    /// An id out of range.
    #[error("{what} is {id}, but there are only {count}")]
    Id {
        /// Which id.
        what: &'static str,
        /// What was found.
        id: u32,
        /// Ids below this are in range.
        count: u32,
    },
    /// A number that is not finite, or of a place that nothing can be at.
    #[error("{what} is not finite or too far away")]
    NotFinite {
        /// Which number.
        what: &'static str,
    },
    /// A message of some other program, or of another version of this one.
    #[error("not a message of this program and version")]
    Foreign,
    /// A field that has only one legal value, or an ordering that does not hold.
    #[error("{what} contradicts the rest of the message")]
    Inconsistent {
        /// Which field.
        what: &'static str,
    },
}

/// How many robots and objects a run has: what ids are checked against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    /// Robots.
    pub robots: u32,
    /// Objects, and so tasks.
    pub objects: u32,
}

/// A message that can be checked before use.
pub trait Validate {
    /// Checks every live value.
    ///
    /// # Errors
    /// The first value that is out of range.
    fn validate(&self, counts: Counts) -> Result<(), Invalid>;
}

/// A message whose every live value has been checked. Borrowed: checking copies nothing.
pub struct Checked<'a, T>(&'a T);

impl<T> Clone for Checked<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Checked<'_, T> {}

impl<T> Deref for Checked<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.0
    }
}

impl<'a, T: Validate> Checked<'a, T> {
    /// Checks `message` against the run's counts.
    ///
    /// # Errors
    /// The first value that is out of range.
    pub fn new(message: &'a T, counts: Counts) -> Result<Self, Invalid> {
        message.validate(counts)?;
        Ok(Self(message))
    }
}

impl<'a, T> Checked<'a, T> {
    /// A message that was checked against the same counts before and has not changed since: a
    /// sample in shared memory never does. For messages too long to be checked at every tick.
    #[must_use]
    pub const fn as_before(message: &'a T) -> Self {
        Self(message)
    }

    /// The message, for as long as the sample it lies in.
    #[must_use]
    pub const fn get(self) -> &'a T {
        self.0
    }
}

impl Checked<'_, WorldSnapshot> {
    /// The live robots.
    #[must_use]
    pub fn robots(&self) -> &[crate::RobotState] {
        &self.0.robots[..self.0.header.robot_count as usize]
    }

    /// The live objects.
    #[must_use]
    pub fn objects(&self) -> &[crate::ObjectState] {
        &self.0.objects[..self.0.header.object_count as usize]
    }
}

fn count(what: &'static str, count: u32, capacity: usize) -> Result<(), Invalid> {
    if count as usize > capacity {
        Err(Invalid::Count {
            what,
            count,
            capacity,
        })
    } else {
        Ok(())
    }
}

fn id(what: &'static str, id: u32, count: u32) -> Result<(), Invalid> {
    if id < count {
        Ok(())
    } else {
        Err(Invalid::Id { what, id, count })
    }
}

/// A range of a list of `capacity` live entries.
fn within(what: &'static str, first: u32, length: u32, capacity: u32) -> Result<(), Invalid> {
    match first.checked_add(length) {
        Some(end) if end <= capacity => Ok(()),
        _ => Err(Invalid::Count {
            what,
            count: first.saturating_add(length),
            capacity: capacity as usize,
        }),
    }
}

fn id_or_none(what: &'static str, value: u32, count: u32) -> Result<(), Invalid> {
    if value == NONE {
        Ok(())
    } else {
        id(what, value, count)
    }
}

fn finite(what: &'static str, point: Point) -> Result<(), Invalid> {
    if point.x.abs() <= FURTHEST_M && point.y.abs() <= FURTHEST_M {
        Ok(())
    } else {
        Err(Invalid::NotFinite { what })
    }
}

fn flag(what: &'static str, code: u32) -> Result<(), Invalid> {
    if code <= 1 {
        Ok(())
    } else {
        Err(Invalid::Tag { what, code })
    }
}

/// A number that a run can come to.
fn possible(what: &'static str, number: u64) -> Result<(), Invalid> {
    if number > MOST_TICKS {
        Err(Invalid::Inconsistent { what })
    } else {
        Ok(())
    }
}

fn version(number: u32) -> Result<(), Invalid> {
    if number > MOST_VERSIONS {
        Err(Invalid::Inconsistent { what: "a version" })
    } else {
        Ok(())
    }
}

impl WorldSnapshot {
    /// How many robots and objects it says there are: a change of the scene adds some. Whoever
    /// does not know the scene checks it against these, which compares only its values.
    #[must_use]
    pub const fn own_counts(&self) -> Counts {
        Counts {
            robots: self.header.robot_count,
            objects: self.header.object_count,
        }
    }
}

impl Validate for WorldSnapshot {
    fn validate(&self, counts: Counts) -> Result<(), Invalid> {
        let header = &self.header;
        if header.magic != MAGIC || header.layout_version != LAYOUT_VERSION {
            return Err(Invalid::Foreign);
        }
        count("robot_count", header.robot_count, MAX_ROBOTS)?;
        count("object_count", header.object_count, MAX_OBJECTS)?;
        if header.robot_count != counts.robots || header.object_count != counts.objects {
            return Err(Invalid::Inconsistent {
                what: "the number of robots or objects",
            });
        }
        Outcome::decode(header.outcome)?;
        flag("held", header.held)?;
        possible("a tick", header.tick)?;
        possible("a time", header.time_ns)?;
        possible("an epoch", header.epoch)?;
        for number in [
            header.constraints_version,
            header.epoch_constraints_version,
            header.schedule_version,
            header.scene_version,
        ] {
            version(number)?;
        }
        for robot in &self.robots[..header.robot_count as usize] {
            finite("a robot's position", robot.position)?;
            finite("a robot's position at the epoch", robot.epoch_position)?;
            id_or_none("a robot's task", robot.task, counts.objects)?;
            id_or_none("a held object", robot.holding, counts.objects)?;
            Phase::decode(robot.phase)?;
            Activity::decode(robot.activity)?;
            flag("epoch_free", robot.epoch_free)?;
            flag("live", robot.live)?;
            flag("request_open", robot.request_open)?;
            count("grant_count", robot.grant_count, MAX_PATH_POINTS)?;
            for point in robot.grant() {
                finite("a granted point", *point)?;
            }
        }
        for object in &self.objects[..header.object_count as usize] {
            finite("an object's position", object.position)?;
            finite("an object's place of rest", object.rest)?;
            flag("has_goal", object.has_goal)?;
            if object.has_goal == 1 {
                finite("a goal", object.goal)?;
            }
            id_or_none("a holder", object.holder, counts.robots)?;
            id_or_none("a claimant", object.claimed_by, counts.robots)?;
            TaskStatus::decode(object.status)?;
            TaskStatus::decode(object.epoch_status)?;
        }
        Ok(())
    }
}

impl Validate for Command {
    fn validate(&self, counts: Counts) -> Result<(), Invalid> {
        id("robot", self.robot, counts.robots)?;
        Phase::decode(self.phase)?;
        Activity::decode(self.activity)?;
        Grip::decode(self.grip)?;
        flag("go", self.go)?;
        id_or_none("a robot waited for", self.waits_for.robot, counts.robots)?;
        id_or_none("a claimed task", self.claim.task, counts.objects)?;
        FailureCause::decode(self.failure.cause)?;
        id_or_none("a failed task", self.failure.task, counts.objects)?;
        id_or_none("a blocking robot", self.failure.blocker, counts.robots)?;
        flag("answered", self.failure.answered)?;
        if self.valid_until_tick < self.tick {
            return Err(Invalid::Inconsistent {
                what: "valid_until_tick",
            });
        }
        count("points asked for", self.path.count, MAX_PATH_POINTS)?;
        for point in self.path.points() {
            finite("a point asked for", *point)?;
        }
        Ok(())
    }
}

impl Validate for ConstraintTable {
    fn validate(&self, counts: Counts) -> Result<(), Invalid> {
        version(self.version)?;
        count("constraints", self.count, MAX_CONSTRAINTS)?;
        for constraint in self.constraints() {
            id("a task", constraint.before, counts.objects)?;
            id("a task", constraint.after, counts.objects)?;
            ConstraintKind::decode(constraint.kind)?;
            if constraint.before == constraint.after {
                return Err(Invalid::Inconsistent {
                    what: "a constraint of a task on itself",
                });
            }
        }
        if !self.constraints().is_sorted_by(|a, b| a < b) {
            return Err(Invalid::Inconsistent {
                what: "the order of the constraints",
            });
        }
        Ok(())
    }
}

impl Validate for Schedule {
    fn validate(&self, counts: Counts) -> Result<(), Invalid> {
        version(self.version)?;
        version(self.scene_version)?;
        // One that was made before a robot was added lists nothing for it.
        if self.robot_count > counts.robots {
            return Err(Invalid::Inconsistent {
                what: "the number of robots",
            });
        }
        count("robots", self.robot_count, MAX_ROBOTS)?;
        count("actions", self.action_count, MAX_ACTIONS)?;
        count("waits", self.wait_count, MAX_WAITS)?;
        for part in &self.robots[..self.robot_count as usize] {
            flag("complete", part.complete)?;
            within(
                "a robot's actions",
                part.offset,
                part.count,
                self.action_count,
            )?;
            if part.first.checked_add(part.count).is_none() {
                return Err(Invalid::Inconsistent {
                    what: "the number of an action",
                });
            }
        }
        for action in &self.actions[..self.action_count as usize] {
            finite("the end of an action", action.to)?;
            match Grip::decode(action.grip)? {
                Grip::Keep => id_or_none("an action's object", action.object, counts.objects)?,
                Grip::Grasp | Grip::Release => {
                    id("an action's object", action.object, counts.objects)?;
                }
            }
            within(
                "an action's waits",
                action.first_wait,
                action.waits,
                self.wait_count,
            )?;
        }
        for wait in &self.waits[..self.wait_count as usize] {
            id("a robot waited for", wait.robot, counts.robots)?;
        }
        Ok(())
    }
}

impl Validate for HardRequest {
    fn validate(&self, counts: Counts) -> Result<(), Invalid> {
        id("robot", self.robot, counts.robots)?;
        id("task", self.task, counts.objects)
    }
}

impl Validate for HardAnswer {
    fn validate(&self, counts: Counts) -> Result<(), Invalid> {
        id("robot", self.robot, counts.robots)?;
        id("task", self.task, counts.objects)?;
        flag("infeasible", self.infeasible)
    }
}

impl Validate for PlannerReport {
    fn validate(&self, _counts: Counts) -> Result<(), Invalid> {
        possible("the tick it answers", self.tick)?;
        flag("busy", self.busy)?;
        Verdict::decode(self.verdict).map(|_| ())
    }
}

impl Validate for RecorderReport {
    fn validate(&self, _counts: Counts) -> Result<(), Invalid> {
        possible("the number of the next batch", self.next_sequence)?;
        if self.lost > self.next_sequence {
            return Err(Invalid::Inconsistent {
                what: "the number of lost batches",
            });
        }
        if self.durable_sequence > self.next_sequence {
            return Err(Invalid::Inconsistent {
                what: "how much is in the file",
            });
        }
        Ok(())
    }
}

impl Validate for ControlRequest {
    fn validate(&self, counts: Counts) -> Result<(), Invalid> {
        ControlKind::decode(self.kind)?;
        if RoleKind::decode(self.role)? == RoleKind::Robot {
            id("robot", self.index, counts.robots)?;
        }
        count("changes", self.change_count, MAX_CHANGES)?;
        for change in self.changes() {
            flag("has_goal", change.has_goal)?;
            finite("a place of a change", change.at)?;
            finite("a place of a change", change.to)?;
            match ChangeKind::decode(change.kind)? {
                ChangeKind::Goal | ChangeKind::Move | ChangeKind::Add => {
                    id("object", change.object, counts.objects)?;
                }
                ChangeKind::Close | ChangeKind::Open | ChangeKind::AddRobot => {}
            }
        }
        Ok(())
    }
}

impl Validate for MotionBatch {
    fn validate(&self, counts: Counts) -> Result<(), Invalid> {
        possible("the number of a batch", self.sequence)?;
        possible("a tick", self.tick)?;
        possible("a time", self.time_ns)?;
        count("motions", self.motion_count, MAX_MOTIONS)?;
        count("events", self.event_count, MAX_EVENTS)?;
        for motion in self.motions() {
            let bodies = match BodyKind::decode(motion.body)? {
                BodyKind::Robot => counts.robots,
                BodyKind::Object => counts.objects,
            };
            id("a moving body", motion.id, bodies)?;
            finite("a place of motion", motion.from)?;
            finite("a place of motion", motion.to)?;
            if motion.end_ns <= motion.start_ns {
                return Err(Invalid::Inconsistent {
                    what: "the end of a motion",
                });
            }
        }
        for event in self.events() {
            EventKind::decode(event.kind)?;
            id_or_none("an event's robot", event.robot, counts.robots)?;
            id_or_none("an event's task", event.task, counts.objects)?;
        }
        Ok(())
    }
}
