//! The events that constraints are about (rules 5 and 27).
//!
//! Responsible for: what grasping and finishing are called, and which of two comes first.
//! Not responsible for: why (`store`), when (`bounds`).
//!
//! Terms: an object that is moved several times, or handed over, is grasped by its *first* grasp
//! and finished by its *last* release, at the goal. In that sense everything here holds for any
//! plan whatever.

use std::fmt;

use crate::kind::Kind;

/// What happens to one object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Event {
    /// g: it leaves its initial place.
    Grasp(usize),
    /// f: it is put down at its goal, to stay.
    Finish(usize),
}

/// One event comes before another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Precedence {
    /// What comes first.
    pub before: Event,
    /// What comes later.
    pub after: Event,
}

impl Event {
    /// The object it happens to.
    #[must_use]
    pub const fn task(self) -> usize {
        match self {
            Self::Grasp(task) | Self::Finish(task) => task,
        }
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Grasp(task) => write!(f, "g{task}"),
            Self::Finish(task) => write!(f, "f{task}"),
        }
    }
}

impl fmt::Display for Precedence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} < {}", self.before, self.after)
    }
}

impl Kind {
    /// What follows for the events of tasks 1 and 2 (§III.B).
    #[must_use]
    pub const fn precedence(self, one: usize, two: usize) -> Precedence {
        use Event::{Finish, Grasp};
        let (before, after) = match self {
            Self::E1 => (Grasp(one), Grasp(two)),
            Self::E2 | Self::H2 => (Grasp(two), Finish(one)),
            Self::E3 | Self::H1 => (Grasp(one), Finish(two)),
            Self::E4 => (Finish(two), Finish(one)),
        };
        Precedence { before, after }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_those_of_the_tables() {
        let kinds = [Kind::E1, Kind::E2, Kind::E3, Kind::E4, Kind::H1, Kind::H2];
        let words = kinds.map(|kind| kind.precedence(1, 2).to_string());
        let expected = [
            "g1 < g2", "g2 < f1", "g1 < f2", "f2 < f1", "g1 < f2", "g2 < f1",
        ];
        assert_eq!(words, expected);
    }

    #[test]
    fn events_and_edges_say_the_same_of_tasks() {
        for kind in Kind::EASY.into_iter().chain(Kind::HARD) {
            let Precedence { before, after } = kind.precedence(1, 2);
            assert_eq!((before.task(), after.task()), kind.edge(1, 2), "{kind:?}");
        }
    }
}
