//! What the invariants are called, how often each was checked, and what is found of a broken one.
//!
//! Responsible for: names and numbers, in results and in the `Violated` event. Not responsible for:
//! checking (the parent module).

use shm_types::EventKind;

use crate::journal::Event;

/// What is checked, by what would be found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Invariant {
    /// [`Violation::Robots`], for each pair of robots.
    Robots,
    /// [`Violation::Object`], for each robot.
    Object,
    /// [`Violation::Wall`], for each robot.
    Wall,
    /// [`Violation::Holding`], for each robot that holds something.
    Holding,
    /// [`Violation::Lost`], for each object.
    Lost,
    /// [`Violation::Motion`], for each robot.
    Motion,
    /// [`Violation::Grants`], for each pair of robots.
    Grants,
}

impl Invariant {
    /// Every one, in the order of [`Violation::code`].
    pub const ALL: [Self; 7] = [
        Self::Robots,
        Self::Object,
        Self::Wall,
        Self::Holding,
        Self::Lost,
        Self::Motion,
        Self::Grants,
    ];

    /// Its name in results.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Robots => "robots",
            Self::Object => "object",
            Self::Wall => "wall",
            Self::Holding => "holding",
            Self::Lost => "lost",
            Self::Motion => "motion",
            Self::Grants => "grants",
        }
    }
}

/// How often each invariant was checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Checks {
    pub(crate) made: [u64; Invariant::ALL.len()],
    pub(crate) anew: [u64; Invariant::ALL.len()],
    /// Exact swept tests that took.
    pub swept_tests: u64,
}

impl Checks {
    /// For how many bodies, pairs or objects, summed over the ticks, `invariant` was found to hold
    /// or not.
    #[must_use]
    pub const fn made(&self, invariant: Invariant) -> u64 {
        self.made[invariant as usize]
    }

    /// For how many of these something that it depends on had changed, so that it was looked at
    /// anew; for the others it was seen that nothing had.
    #[must_use]
    pub const fn anew(&self, invariant: Invariant) -> u64 {
        self.anew[invariant as usize]
    }

    pub(super) const fn add(&mut self, invariant: Invariant, made: u64, anew: u64) {
        self.made[invariant as usize] += made;
        self.anew[invariant as usize] += anew;
    }
}

/// An invariant found broken. The numbers travel in the `Violated` event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Violation {
    /// Two robots, or what they carry, overlapped.
    Robots {
        /// The one.
        robot: u32,
        /// The other.
        other: u32,
    },
    /// A robot, or what it carries, overlapped a grounded object.
    Object {
        /// The robot.
        robot: u32,
        /// The object.
        object: u32,
    },
    /// A robot, or what it carries, overlapped a wall.
    Wall {
        /// The robot.
        robot: u32,
    },
    /// A robot and an object disagree on who holds what, or where.
    Holding {
        /// The robot.
        robot: u32,
        /// The object.
        object: u32,
    },
    /// An object is neither held nor on the ground where it rests, or both.
    Lost {
        /// The object.
        object: u32,
    },
    /// A robot moved off its grant, or too fast.
    Motion {
        /// The robot.
        robot: u32,
    },
    /// Path granted to two robots overlaps.
    Grants {
        /// The one.
        robot: u32,
        /// The other.
        other: u32,
    },
}

impl Violation {
    /// What it is a violation of.
    #[must_use]
    pub const fn invariant(self) -> Invariant {
        match self {
            Self::Robots { .. } => Invariant::Robots,
            Self::Object { .. } => Invariant::Object,
            Self::Wall { .. } => Invariant::Wall,
            Self::Holding { .. } => Invariant::Holding,
            Self::Lost { .. } => Invariant::Lost,
            Self::Motion { .. } => Invariant::Motion,
            Self::Grants { .. } => Invariant::Grants,
        }
    }

    /// Its number in the `Violated` event, from 1.
    #[must_use]
    pub const fn code(self) -> u64 {
        self.invariant() as u64 + 1
    }

    /// The event that tells of it.
    pub(crate) const fn event(self) -> Event {
        let mut event = Event::new(EventKind::Violated).value(self.code());
        match self {
            Self::Robots { robot, other } | Self::Grants { robot, other } => {
                event.robot = robot;
                event.other = other;
            }
            Self::Object { robot, object } | Self::Holding { robot, object } => {
                event.robot = robot;
                event.task = object;
            }
            Self::Wall { robot } | Self::Motion { robot } => event.robot = robot,
            Self::Lost { object } => event.task = object,
        }
        event
    }
}
