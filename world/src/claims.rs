//! Claims: which robot has which task.
//!
//! Responsible for: judging a claim by the epoch it was selected in, giving tasks back. Not
//! responsible for: selecting (crate `planner`); tasks whose object is held, which stay with
//! their robot (rule 19).
//!
//! Terms: a claim of the current epoch is good unless the task is taken in this epoch already
//! (a *conflict*: it never happens while all robots select alike). It displaces a claim that is
//! left over from an earlier epoch, since ungrasped tasks return to the pool (rule 18). A claim
//! one epoch *late* is good if nobody has the task and no known constraint forbids it.

use shm_types::{Claim, ConstraintTable, EventKind, TaskStatus, index};

use crate::journal::{Event, Journal};
use crate::state::{Claimed, Hand};
use crate::step::World;

/// What becomes of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    Good,
    Conflict,
    Invalid,
}

impl World {
    /// Takes robot `i`'s claim as its newest command gives it.
    pub(crate) fn take_claim(
        &mut self,
        i: usize,
        claim: Claim,
        known: Option<&ConstraintTable>,
        journal: &mut Journal<'_>,
    ) {
        if self.robots[i].hand != Hand::Empty {
            return;
        }
        let Some(task) = index(claim.task) else {
            self.unclaim(i, journal);
            self.robots[i].refused_claim = None;
            return;
        };
        let wanted = Claimed {
            task,
            epoch: claim.epoch,
        };
        if let Some(standing) = &mut self.robots[i].claim
            && standing.task == task
        {
            // Selected again: the claim now stands under the newer epoch.
            if claim.epoch > standing.epoch && claim.epoch <= self.epoch.number {
                standing.epoch = claim.epoch;
            }
            return;
        }
        if self.robots[i].refused_claim == Some(wanted) {
            return;
        }
        self.unclaim(i, journal);
        match self.judge(i, wanted, claim.constraints_version, known) {
            Verdict::Good => self.claim(i, wanted, journal),
            Verdict::Conflict => {
                self.counters.selection_conflicts += 1;
                self.robots[i].refused_claim = Some(wanted);
            }
            Verdict::Invalid => {
                self.counters.invalid_claims += 1;
                self.robots[i].refused_claim = Some(wanted);
            }
        }
    }

    fn judge(
        &self,
        i: usize,
        wanted: Claimed,
        version: u32,
        known: Option<&ConstraintTable>,
    ) -> Verdict {
        let object = &self.objects[wanted.task];
        if object.is_barred(i) || self.robots[i].leaving.is_full() {
            return Verdict::Invalid;
        }
        if wanted.epoch == self.epoch.number {
            if version != self.epoch.constraints_version {
                return Verdict::Invalid;
            }
            return match (object.status, object.claimed_by) {
                (TaskStatus::Waiting, _) => Verdict::Good,
                (TaskStatus::Claimed, Some(j)) => self.judge_against(j),
                _ => Verdict::Invalid,
            };
        }
        let late = wanted.epoch + 1 == self.epoch.number;
        let free = object.status == TaskStatus::Waiting;
        let known = known.unwrap_or(&self.constraints.in_force);
        if late && free && !self.is_forbidden(wanted.task, known) {
            Verdict::Good
        } else {
            Verdict::Invalid
        }
    }

    /// A claim of this epoch against the one robot `j` has on the same task.
    fn judge_against(&self, j: usize) -> Verdict {
        let other = &self.robots[j];
        if other.hand != Hand::Empty {
            Verdict::Invalid
        } else if other.claim.is_some_and(|c| c.epoch == self.epoch.number) {
            Verdict::Conflict
        } else {
            Verdict::Good
        }
    }

    /// Whether a known constraint wants another unfinished task completed before `task` (rule 13).
    fn is_forbidden(&self, task: usize, known: &ConstraintTable) -> bool {
        known.constraints().iter().any(|constraint| {
            let before = &self.objects[constraint.before as usize];
            constraint.after as usize == task && before.status != TaskStatus::Done
        })
    }

    fn claim(&mut self, i: usize, wanted: Claimed, journal: &mut Journal<'_>) {
        if let Some(j) = self.objects[wanted.task].claimed_by {
            self.unclaim(j, journal);
        }
        let object = &mut self.objects[wanted.task];
        object.status = TaskStatus::Claimed;
        object.claimed_by = Some(i);
        self.robots[i].claim = Some(wanted);
        self.robots[i].refused_claim = None;
        let event = Event::new(EventKind::Claimed).robot(i).task(wanted.task);
        journal.event(event.value(wanted.epoch));
    }

    /// Gives back the task that robot `i`, which holds nothing, has claimed, if any.
    pub(crate) fn unclaim(&mut self, i: usize, journal: &mut Journal<'_>) {
        let Some(Claimed { task, .. }) = self.robots[i].claim.take() else {
            return;
        };
        self.objects[task].status = TaskStatus::Waiting;
        self.objects[task].claimed_by = None;
        self.robots[i].leaving.add(task);
        journal.event(Event::new(EventKind::Unclaimed).robot(i).task(task));
    }
}
