//! The checks that runs are safe by, each with a name, so that a test can do without one and see
//! that it is missed.
//!
//! Responsible for: the names. Not responsible for: the checks (where each is made).
//!
//! Nothing that a user can say switches one off: only [`World::without`] does, which simulated
//! runs of the tests use.

use crate::step::World;

/// A check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum Guard {
    /// A grant meets no other robot's body or grant.
    Grants,
    /// A claim, and a grasp under it, is of this epoch, or of the one before.
    Epoch,
    /// A claim was selected under the constraints of this epoch; one that is late is forbidden by
    /// none that is known.
    Constraints,
    /// A path request is taken once.
    Request,
    /// A command is newer than the last.
    Sequence,
    /// A command is of the robot's present process.
    Incarnation,
    /// A command counts for so many ticks.
    Validity,
    /// What was saved has the checksum that was saved with it.
    Checksum,
    /// The invariants hold, as far as each tick shows. As long as all other checks are made nobody
    /// misses this one: it is here to see what it costs.
    Invariants,
}

impl Guard {
    /// Every check that is missed as soon as it is not made.
    pub const ALL: [Self; 8] = [
        Self::Grants,
        Self::Epoch,
        Self::Constraints,
        Self::Request,
        Self::Sequence,
        Self::Incarnation,
        Self::Validity,
        Self::Checksum,
    ];
}

/// Which checks are made.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Guards {
    off: u16,
}

impl Guards {
    /// All but one.
    pub(crate) const fn without(guard: Guard) -> Self {
        Self {
            off: 1 << guard as u16,
        }
    }

    /// What `guard` says: whether `condition` holds, or always, if it is not asked.
    pub(crate) const fn holds(self, guard: Guard, condition: bool) -> bool {
        condition || self.off >> guard as u16 & 1 == 1
    }
}

impl World {
    /// This world, but that it makes all checks except this one.
    #[must_use]
    pub fn without(self, guard: Guard) -> Self {
        Self {
            guards: Guards::without(guard),
            ..self
        }
    }
}
