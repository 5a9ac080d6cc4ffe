//! The version of the hard constraints in force.
//!
//! Responsible for: bringing a newer table into force, no earlier than the tick it names, and
//! telling the recorder what it found. Not responsible for: finding constraints (crate `planner`).

use shm_types::{ConstraintTable, EventKind, StateHash};

use crate::journal::{Event, Journal};
use crate::step::World;

/// The table in force, and how much of it has been told.
pub(crate) struct Constraints {
    pub(crate) in_force: Box<ConstraintTable>,
    /// The table before it: what is in both was told already.
    before: Box<ConstraintTable>,
    /// Constraints of `in_force` from here on are still to be told.
    next: usize,
}

impl Constraints {
    /// The empty table, version 0.
    pub(crate) fn none() -> Self {
        Self {
            in_force: shm_types::zeroed(),
            before: shm_types::zeroed(),
            next: 0,
        }
    }

    /// Tells what is new in the table in force, as far as this tick's batch has room.
    fn tell(&mut self, journal: &mut Journal<'_>) {
        while let Some(found) = self.in_force.constraints().get(self.next)
            && journal.has_room_for_constraints()
        {
            if self.before.constraints().binary_search(found).is_err() {
                let event = Event::new(EventKind::Constraint).task(found.before as usize);
                journal.event(event.other(found.after).value(u64::from(found.kind)));
            }
            self.next += 1;
        }
    }

    /// Adds the table, and how far it has been told.
    pub(crate) fn hash_into(&self, hash: &mut StateHash) {
        self.in_force.hash_into(hash);
        hash.add(&(self.next as u64));
    }

    fn is_told(&self) -> bool {
        self.next >= self.in_force.count as usize
    }
}

impl World {
    /// Brings `published` into force for the snapshot of the next tick, if it is newer and may be
    /// named by then. A table so large that telling it takes several ticks is told whole first.
    pub(crate) fn adopt_constraints(
        &mut self,
        published: Option<&ConstraintTable>,
        journal: &mut Journal<'_>,
    ) {
        let newer = published.filter(|table| {
            table.version > self.constraints.in_force.version && table.effect_tick <= self.tick + 1
        });
        if let Some(table) = newer
            && self.constraints.is_told()
        {
            let constraints = &mut self.constraints;
            std::mem::swap(&mut constraints.in_force, &mut constraints.before);
            constraints.in_force.copy_from(table);
            constraints.next = 0;
            self.epoch.due = true;
            self.placed();
        }
        self.constraints.tell(journal);
    }
}
