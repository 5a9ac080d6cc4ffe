//! The version of the hard constraints in force.
//!
//! Responsible for: bringing a newer table into force, no earlier than the tick it names, and
//! telling the recorder what it found. Not responsible for: finding constraints (crate `planner`).

use shm_types::{ConstraintTable, EventKind, StateHash};

use crate::journal::{Event, Journal};
use crate::saved::{Reader, Saved, Unreadable};
use crate::step::World;

/// The table in force, and how much of it has been told.
pub(crate) struct Constraints {
    pub(crate) in_force: Box<ConstraintTable>,
    /// The table before it: what is in both was told already.
    before: Box<ConstraintTable>,
    /// Constraints of `in_force` from here on are still to be told.
    next: usize,
    /// Any of this may not be what it was when it was saved last.
    touched: bool,
}

impl Constraints {
    /// The empty table, version 0.
    pub(crate) fn none() -> Self {
        Self {
            in_force: shm_types::zeroed(),
            before: shm_types::zeroed(),
            next: 0,
            touched: true,
        }
    }

    /// Tells what is new in the table in force, as far as this tick's batch has room; how much
    /// that was.
    fn tell(&mut self, journal: &mut Journal<'_>) -> u64 {
        let mut told = 0;
        self.touched |= !self.is_told();
        while let Some(found) = self.in_force.constraints().get(self.next)
            && journal.has_room_for_constraints()
        {
            if self.before.constraints().binary_search(found).is_err() {
                let event = Event::new(EventKind::Constraint).task(found.before as usize);
                journal.event(event.other(found.after).value(u64::from(found.kind)));
                told += 1;
            }
            self.next += 1;
        }
        told
    }

    /// Adds the table, and how far it has been told.
    pub(crate) fn hash_into(&self, hash: &mut StateHash) {
        self.in_force.hash_into(hash);
        hash.add(&(self.next as u64));
    }

    /// Appends all of it.
    pub(crate) fn save(&self, out: &mut Vec<u8>) {
        let Self {
            in_force,
            before,
            next,
            touched: _,
        } = self;
        in_force.save(out);
        before.save(out);
        next.save(out);
    }

    /// Puts what was saved in the place of what there is.
    pub(crate) fn restore(&mut self, from: &mut Reader<'_>) -> Result<(), Unreadable> {
        *self = Self {
            in_force: Saved::restore(from)?,
            before: Saved::restore(from)?,
            next: Saved::restore(from)?,
            touched: true,
        };
        Ok(())
    }

    /// Whether there was any change since the last call.
    pub(crate) const fn take_touched(&mut self) -> bool {
        std::mem::replace(&mut self.touched, false)
    }

    /// Both tables.
    pub(crate) const fn tables(&self) -> [&ConstraintTable; 2] {
        [&*self.in_force, &*self.before]
    }

    /// Whether the table in force holds a constraint that the one before it did not.
    fn say_anything_new(&self) -> bool {
        let mut found = self.in_force.constraints().iter();
        found.any(|c| self.before.constraints().binary_search(c).is_err())
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
            constraints.touched = true;
            self.epoch.due = true;
            // A version that says nothing new lifts no bar: failures each followed by one would
            // otherwise go on for ever (rule 21).
            if constraints.say_anything_new() {
                self.placed();
            }
        }
        self.counters.constraints_found += self.constraints.tell(journal);
    }
}

#[cfg(test)]
mod tests {
    use shm_types::capacity::MAX_CONSTRAINTS;
    use shm_types::{Constraint, ConstraintKind, ConstraintTable, EventKind, FailureCause, NONE};

    use crate::testing::{BELOW, Bench, room};

    fn table(version: u32, effect_tick: u64, pairs: &[(u32, u32)]) -> Box<ConstraintTable> {
        let mut table: Box<ConstraintTable> = shm_types::zeroed();
        (table.version, table.effect_tick) = (version, effect_tick);
        table.count = pairs.len() as u32;
        for (constraint, &(before, after)) in table.constraints.iter_mut().zip(pairs) {
            *constraint = Constraint {
                before,
                after,
                kind: ConstraintKind::H1.code(),
            };
        }
        table
    }

    fn bench() -> Bench {
        let objects = [1.0, 3.0, 5.0].map(|x| [[x, 3.0], [x, 5.0]]);
        Bench::new(room(&[[1.0, 1.0]], &objects, BELOW, ""))
    }

    #[test]
    fn a_new_version_opens_an_epoch_that_uses_it_and_tells_what_is_new() {
        let mut bench = bench();
        bench.table = Some(table(1, 0, &[(0, 1)]));
        bench.steps(3);
        assert_eq!(
            (bench.header().epoch, bench.header().constraints_version),
            (2, 1)
        );
        assert_eq!(bench.header().epoch_constraints_version, 1);
        assert_eq!(bench.header().placements, 1);
        assert_eq!(bench.world.counters().constraints_found, 1);
        bench.table = Some(table(2, 0, &[(0, 1), (2, 1)]));
        bench.step();
        let told = bench.events(EventKind::Constraint);
        assert_eq!(told.len(), 1, "the other was told before");
        assert_eq!(bench.world.counters().constraints_found, 2);
        assert_eq!((told[0].task, told[0].other), (2, 1));
        assert_eq!(told[0].value, u64::from(ConstraintKind::H1.code()));
        assert_eq!(bench.header().epoch, 3);
    }

    #[test]
    fn a_version_that_says_nothing_new_opens_an_epoch_but_lifts_no_bar() {
        let mut bench = bench();
        bench.table = Some(table(1, 0, &[(0, 1), (0, 2)]));
        bench.step();
        bench.fail(0, 1, FailureCause::Objects, NONE);
        bench.step();
        let (epoch, placements) = (bench.header().epoch, bench.header().placements);
        bench.table = Some(table(2, 0, &[(0, 1)]));
        bench.step();
        assert_eq!(bench.header().epoch, epoch + 1);
        assert_eq!(bench.header().placements, placements);
        assert_eq!(bench.object(1).barred[0], 1);
        bench.table = Some(table(3, 0, &[(0, 1), (2, 1)]));
        bench.step();
        assert_eq!(bench.header().placements, placements + 1);
        assert_eq!(bench.object(1).barred[0], 0);
    }

    #[test]
    fn no_version_comes_into_force_before_the_tick_it_names_nor_back() {
        let mut bench = bench();
        bench.table = Some(table(4, 5, &[(0, 1)]));
        for tick in 1..=7 {
            bench.step();
            let expected = if tick < 5 { 0 } else { 4 };
            assert_eq!(bench.header().constraints_version, expected, "tick {tick}");
        }
        bench.table = Some(table(3, 0, &[]));
        bench.step();
        assert_eq!(bench.header().constraints_version, 4);
    }

    #[test]
    fn a_table_too_large_for_one_batch_is_told_over_several() {
        let objects: Vec<_> = (0..140)
            .map(|i| {
                let (x, y) = (
                    0.3 + 0.45 * f64::from(i % 20),
                    1.5 + 0.45 * f64::from(i / 20),
                );
                [[x, y], [x, y + 0.01]]
            })
            .collect();
        let mut bench = Bench::new(room(&[[1.0, 1.0]], &objects, BELOW, ""));
        let pairs: Vec<_> = (0..140)
            .flat_map(|a| (0..140).filter(move |b| a != *b).map(move |b| (a, b)))
            .take(MAX_CONSTRAINTS)
            .collect();
        bench.table = Some(table(1, 0, &pairs));
        let mut told = Vec::new();
        for _ in 0..30 {
            bench.step();
            let found = bench.events(EventKind::Constraint);
            told.extend(found.iter().map(|event| (event.task, event.other)));
        }
        assert_eq!(told, pairs);
    }
}
