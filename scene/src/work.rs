//! Work units: what computing costs in virtual time.
//!
//! Responsible for: the unit, what each kind of computation costs in it, and the budget of a step.
//! Not responsible for: how many units a second has (`settings`).
//!
//! Terms: one *unit* is one cell expanded by a path search or a flood. The other costs are ratios
//! of measured times, rounded up to whole units, so that virtual planning time is deterministic
//! whatever the machine does.
//!
//! Measured by the test `speed` of crate `planner` on one core of a 2-core x86-64 machine, in a
//! room of 68.8 m² at a pitch of 0.05 m: 57 ns for a cell, 14 to 18 ns for a polygon test, 390 ns
//! for an obstacle, 940 ns for a reset.

/// One test whether two convex bodies overlap, standing or swept. Measured: 10 to 17 ns for a
/// robot with its object against an object, boxes, where a cell takes 55 ns
/// (`planner/tests/it/speed.rs`).
pub const UNITS_PER_POLYGON_TEST: u64 = 1;
/// One obstacle entered into the configuration space of a body.
pub const UNITS_PER_OBSTACLE: u64 = 7;
/// Setting the configuration space back to the walls.
pub const UNITS_PER_RESET: u64 = 17;

/// The work units a step may still spend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    given: u64,
    left: u64,
}

impl Budget {
    /// A budget of this many units.
    #[must_use]
    pub const fn new(units: u64) -> Self {
        Self {
            given: units,
            left: units,
        }
    }

    /// Takes `units` off. Spending more than there is empties the budget: a piece of work that
    /// cannot be cut is done whole.
    pub const fn spend(&mut self, units: u64) {
        self.left = self.left.saturating_sub(units);
    }

    /// Whether nothing is left.
    #[must_use]
    pub const fn is_spent(&self) -> bool {
        self.left == 0
    }

    /// Units left.
    #[must_use]
    pub const fn left(&self) -> u64 {
        self.left
    }

    /// Units spent so far.
    #[must_use]
    pub const fn spent(&self) -> u64 {
        self.given - self.left
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overspending_empties_a_budget() {
        let mut budget = Budget::new(3);
        budget.spend(2);
        assert!(!budget.is_spent());
        assert_eq!((budget.left(), budget.spent()), (1, 2));
        budget.spend(5);
        assert!(budget.is_spent());
        assert_eq!((budget.left(), budget.spent()), (0, 3));
    }
}
