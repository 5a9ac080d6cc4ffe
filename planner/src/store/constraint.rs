//! One explained constraint.
//!
//! Responsible for: what it demands, its reason, its witness and what it assumes, in words too.
//! Not responsible for: finding it (`store`, `ways`).

use std::fmt;

use crate::event::{Event, Precedence};
use crate::kind::Kind;

/// An object that stands somewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Placement {
    /// The object.
    pub object: usize,
    /// Whether it stands at its goal, else at its start.
    pub at_goal: bool,
}

/// A way that a task needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Leg {
    /// Of some robot from its home to the object at its start.
    Approach(usize),
    /// Of the object from its start to its goal.
    Transfer(usize),
    /// Of some robot from the object at its goal to its home.
    Return(usize),
}

/// Why a constraint holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Reason {
    /// The other's start is where a robot stands to grasp, or the object itself is.
    E1,
    /// The other's goal is there.
    E2,
    /// The other's start is where a robot stands to release.
    E3,
    /// The other's goal is there.
    E4,
    /// Objects at their starts cut the transfer.
    H1,
    /// Objects at their goals cut the transfer.
    H2,
    /// Objects at their starts and at their goals cut the transfer together.
    H12,
    /// Objects at their starts cut every robot's way to the grasp (rule 12).
    Approach,
    /// Objects at their goals cut every robot's way home (rule 12).
    Return,
    /// The user says so (`[[before]]`).
    User,
}

/// Something that every plan has to keep: at least one of some precedences.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Constraint {
    /// One of these holds in every plan. A single one leaves no choice; several come from objects
    /// that block only jointly: one of them has to be out of the way.
    pub any_of: Vec<Precedence>,
    /// Why.
    pub reason: Reason,
    /// The task whose grasp, release or way is hindered; with [`Reason::User`] the later one.
    pub task: usize,
    /// The witness: these placements hinder it, and no part of them does. Empty with
    /// [`Reason::User`].
    pub blockers: Vec<Placement>,
}

/// Placements without which a leg has a way: a hypothesis (rule 29), not a constraint. Another set
/// may do as well.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Removal {
    /// The leg.
    pub leg: Leg,
    /// What to take away; with any of it back there is no way.
    pub placements: Vec<Placement>,
}

impl Leg {
    /// Whose way it is.
    #[must_use]
    pub const fn task(self) -> usize {
        match self {
            Self::Approach(task) | Self::Transfer(task) | Self::Return(task) => task,
        }
    }
}

impl Reason {
    /// Its short name, as in docs/method.md.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::E1 => "E1",
            Self::E2 => "E2",
            Self::E3 => "E3",
            Self::E4 => "E4",
            Self::H1 => "H1",
            Self::H2 => "H2",
            Self::H12 => "H1+H2",
            Self::Approach => "approach",
            Self::Return => "return",
            Self::User => "user",
        }
    }
}

impl Constraint {
    pub(crate) fn of_user(order: Precedence) -> Self {
        Self {
            any_of: vec![order],
            reason: Reason::User,
            task: order.after.task(),
            blockers: Vec::new(),
        }
    }

    /// Object `one` stands where a robot has to be that grasps `two`.
    pub(crate) fn of_overlap(kind: Kind, one: usize, two: usize) -> Self {
        let reason = match kind {
            Kind::E1 => Reason::E1,
            Kind::E2 => Reason::E2,
            Kind::E3 => Reason::E3,
            Kind::E4 => Reason::E4,
            Kind::H1 => Reason::H1,
            Kind::H2 => Reason::H2,
        };
        let blocker = Placement {
            object: one,
            at_goal: kind.first_at_goal(),
        };
        Self {
            any_of: vec![kind.precedence(one, two)],
            reason,
            task: two,
            blockers: vec![blocker],
        }
    }

    /// What follows from placements that cut a leg, and of which no part does.
    pub(crate) fn of_cut(leg: Leg, mut blockers: Vec<Placement>) -> Self {
        blockers.sort_unstable();
        let task = leg.task();
        let demand = |placement: &Placement| {
            let object = placement.object;
            let (before, after) = match (leg, placement.at_goal) {
                (Leg::Approach(_), _) => (Event::Grasp(object), Event::Grasp(task)),
                (Leg::Return(_), _) => (Event::Finish(task), Event::Finish(object)),
                (Leg::Transfer(_), false) => (Event::Grasp(object), Event::Finish(task)),
                (Leg::Transfer(_), true) => (Event::Grasp(task), Event::Finish(object)),
            };
            Precedence { before, after }
        };
        let at_goal = |goal: bool| blockers.iter().any(|placement| placement.at_goal == goal);
        let reason = match leg {
            Leg::Approach(_) => Reason::Approach,
            Leg::Return(_) => Reason::Return,
            Leg::Transfer(_) if !at_goal(true) => Reason::H1,
            Leg::Transfer(_) if !at_goal(false) => Reason::H2,
            Leg::Transfer(_) => Reason::H12,
        };
        Self {
            any_of: blockers.iter().map(demand).collect(),
            reason,
            task,
            blockers,
        }
    }

    /// What it demands, if it leaves no choice.
    #[must_use]
    pub fn precedence(&self) -> Option<Precedence> {
        match self.any_of[..] {
            [order] => Some(order),
            _ => None,
        }
    }

    /// Whether several objects hinder only together.
    #[must_use]
    pub fn is_joint(&self) -> bool {
        self.blockers.len() > 1
    }

    /// Whether it assumes where `object` starts or has to go.
    #[must_use]
    pub fn assumes_object(&self, object: usize) -> bool {
        self.reason != Reason::User
            && (self.task == object || self.blockers.iter().any(|at| at.object == object))
    }

    /// Whether it assumes where the robots' homes are.
    #[must_use]
    pub const fn assumes_homes(&self) -> bool {
        matches!(self.reason, Reason::Approach | Reason::Return)
    }
}

/// An event in words: "object 3 is grasped".
struct Words(Event);

impl fmt::Display for Words {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Event::Grasp(task) => write!(f, "object {task} is grasped"),
            Event::Finish(task) => write!(f, "object {task} is put down"),
        }
    }
}

/// Objects in words: "object 3", "objects 1 and 3", "objects 1, 2 and 3".
struct Objects<'a>(&'a [Placement]);

impl fmt::Display for Objects<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.len() == 1 {
            "object "
        } else {
            "objects "
        })?;
        for (i, placement) in self.0.iter().enumerate() {
            match i {
                0 => {}
                _ if i + 1 == self.0.len() => f.write_str(" and ")?,
                _ => f.write_str(", ")?,
            }
            write!(f, "{}", placement.object)?;
        }
        Ok(())
    }
}

impl fmt::Display for Constraint {
    /// What has to be, and why: one sentence without its full stop.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, order) in self.any_of.iter().enumerate() {
            let or = if i == 0 { "" } else { ", or " };
            write!(
                f,
                "{or}{} before {}",
                Words(order.before),
                Words(order.after)
            )?;
        }
        f.write_str(": ")?;
        let (task, blockers) = (self.task, Objects(&self.blockers));
        let (stand, together) = if self.is_joint() {
            ("stand", "together ")
        } else {
            ("stands", "")
        };
        match self.reason {
            Reason::E1 => write!(
                f,
                "{blockers} {stand} where a robot has to be to grasp object {task}"
            ),
            Reason::E2 => write!(
                f,
                "the goal of {blockers} is where a robot has to be to grasp object {task}"
            ),
            Reason::E3 => write!(
                f,
                "{blockers} {stand} where a robot has to be to put object {task} down"
            ),
            Reason::E4 => write!(
                f,
                "the goal of {blockers} is where a robot has to be to put object {task} down"
            ),
            Reason::H1 => write!(
                f,
                "where {blockers} {together}{stand}, no way is left for object {task} to its goal"
            ),
            Reason::H2 => write!(
                f,
                "with {blockers} {together}at the goal, no way is left for object {task} to its own"
            ),
            Reason::H12 => write!(
                f,
                "between {blockers} no way is left for object {task} to its goal"
            ),
            Reason::Approach => write!(
                f,
                "where {blockers} {together}{stand}, no robot gets to object {task}"
            ),
            Reason::Return => write!(
                f,
                "with {blockers} {together}at the goal, no robot gets home from the goal of object {task}"
            ),
            Reason::User => f.write_str("the scenario says so"),
        }
    }
}
