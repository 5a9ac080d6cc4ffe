//! Work that costs more than one unit.
//!
//! Responsible for: letting a piece of work be charged whole although the budget of a step may
//! not cover it: the rest is owed, and paid before anything else is done. So the sum of units
//! is the same however a computation is cut into steps.

use scene::Budget;

/// Units owed.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Meter {
    owed: u64,
}

impl Meter {
    /// Owes `units` more.
    pub(crate) fn charge(&mut self, units: u64) {
        self.owed += units;
    }

    /// Pays what can be paid; says whether work may go on: nothing is owed and some budget is
    /// left.
    pub(crate) fn settle(&mut self, budget: &mut Budget) -> bool {
        let paid = self.owed.min(budget.left());
        budget.spend(paid);
        self.owed -= paid;
        self.owed == 0 && !budget.is_spent()
    }

    /// Whether anything is owed.
    pub(crate) fn is_owing(&self) -> bool {
        self.owed > 0
    }

    /// Forgets what is owed: a new computation begins.
    pub(crate) fn reset(&mut self) {
        self.owed = 0;
    }
}
