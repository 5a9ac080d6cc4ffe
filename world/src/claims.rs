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
//!
//! Where robots follow a schedule, claims say only which object is about to be grasped: one on an
//! object that needs no transport is good too, and one refused is judged again at every tick.

use shm_types::{Claim, ConstraintTable, EventKind, TaskStatus, index};

use crate::guards::Guard;
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
        let repeated = self.robots[i].refused_claim == Some(wanted);
        if repeated && !self.settings.method.plans_ahead() {
            return;
        }
        self.unclaim(i, journal);
        let verdict = self.judge(i, wanted, claim.constraints_version, known);
        if verdict == Verdict::Good {
            self.claim(i, wanted, journal);
            return;
        }
        self.robots[i].refused_claim = Some(wanted);
        if !repeated {
            self.counters.selection_conflicts += u64::from(verdict == Verdict::Conflict);
            self.counters.invalid_claims += u64::from(verdict == Verdict::Invalid);
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
        // Who plans ahead may have to move what is where it belongs, for others' sake.
        let free = object.status == TaskStatus::Waiting
            || object.status == TaskStatus::Done && self.settings.method.plans_ahead();
        if object.is_barred(i) || self.robots[i].leaving.is_full() {
            return Verdict::Invalid;
        }
        let is_present = wanted.epoch == self.epoch.number;
        if self.guards.holds(Guard::Epoch, is_present) {
            let is_known = version == self.epoch.constraints_version;
            if !self.guards.holds(Guard::Constraints, is_known) {
                return Verdict::Invalid;
            }
            return match (object.status, object.claimed_by) {
                _ if free => Verdict::Good,
                (TaskStatus::Claimed, Some(j)) => self.judge_against(j),
                _ => Verdict::Invalid,
            };
        }
        let late = wanted.epoch + 1 == self.epoch.number;
        let known = known.unwrap_or(&self.constraints.in_force);
        let allowed = late && free && !self.is_forbidden(wanted.task, known);
        if allowed || late && free && self.guards.holds(Guard::Constraints, false) {
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
            // It may not have selected yet, and repeat what it had: that is no error of its.
            self.robots[j].refused_claim = self.robots[j].claim;
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
        let object = &mut self.objects[task];
        object.status = object.status_on_ground();
        object.claimed_by = None;
        self.robots[i].leaving.add(task);
        journal.event(Event::new(EventKind::Unclaimed).robot(i).task(task));
    }
}

#[cfg(test)]
mod tests {
    use shm_types::{
        Claim, Constraint, ConstraintKind, ConstraintTable, ControlKind, EventKind, NONE,
        TaskStatus,
    };

    use crate::testing::{BELOW, Bench, room};

    /// Three robots, three tasks; robot 2 comes and goes to open epochs.
    fn bench() -> Bench {
        let objects = [1.0, 3.0, 5.0].map(|x| [[x, 3.0], [x, 5.0]]);
        let homes = [[1.0, 1.0], [3.0, 1.0], [9.0, 1.0]];
        Bench::new(room(&homes, &objects, BELOW, ""))
    }

    fn open_epoch(bench: &mut Bench) {
        let epoch = bench.header().epoch;
        let robot = bench.robot(2);
        if robot.live == 1 {
            bench.tell(ControlKind::Down, 2, 1);
        } else {
            bench.tell(ControlKind::Up, 2, 1);
            bench.commands[2].sequence = 0;
        }
        bench.step();
        assert_eq!(bench.header().epoch, epoch + 1);
    }

    fn tasks(bench: &Bench) -> [u32; 3] {
        [0, 1, 2].map(|i| bench.robot(i).task)
    }

    #[test]
    fn a_claim_of_this_epoch_stands_until_it_is_given_back() {
        let mut bench = bench();
        bench.claim(0, 1);
        bench.step();
        assert_eq!(tasks(&bench), [1, NONE, NONE]);
        let object = bench.object(1);
        assert_eq!(
            (object.claimed_by, object.status),
            (0, TaskStatus::Claimed.code())
        );
        let claimed = bench.events(EventKind::Claimed);
        assert_eq!(
            (claimed[0].robot, claimed[0].task, claimed[0].value),
            (0, 1, 1)
        );
        bench.step();
        assert!(bench.events(EventKind::Claimed).is_empty());
        bench.commands[0].claim = Claim::NONE;
        bench.step();
        assert_eq!(tasks(&bench), [NONE; 3]);
        assert_eq!(bench.object(1).status, TaskStatus::Waiting.code());
        assert_eq!(bench.events(EventKind::Unclaimed).len(), 1);
    }

    #[test]
    fn of_two_claims_in_one_epoch_the_lower_robot_wins_and_the_other_is_counted_once() {
        let mut bench = bench();
        bench.claim(0, 1);
        bench.claim(1, 1);
        bench.steps(3);
        assert_eq!(tasks(&bench), [1, NONE, NONE]);
        assert_eq!(bench.world.counters().selection_conflicts, 1);
    }

    #[test]
    fn tasks_change_hands_at_a_new_epoch_without_conflict() {
        let mut bench = bench();
        bench.claim(0, 0);
        bench.claim(1, 1);
        bench.step();
        open_epoch(&mut bench);
        assert_eq!(tasks(&bench), [0, 1, NONE], "claims stay until selection");
        bench.claim(0, 1);
        bench.claim(1, 0);
        bench.step();
        assert_eq!(tasks(&bench), [1, 0, NONE]);
        let counters = bench.world.counters();
        assert_eq!(
            (counters.selection_conflicts, counters.invalid_claims),
            (0, 0)
        );
    }

    #[test]
    fn a_claim_left_over_from_an_earlier_epoch_is_displaced() {
        let mut bench = bench();
        bench.claim(1, 0);
        bench.step();
        open_epoch(&mut bench);
        bench.claim(0, 0);
        bench.step();
        assert_eq!(tasks(&bench), [0, NONE, NONE]);
        // Robot 1 has not selected yet and repeats what it had.
        bench.steps(2);
        assert_eq!(tasks(&bench), [0, NONE, NONE]);
        assert_eq!(bench.world.counters().invalid_claims, 0);
    }

    #[test]
    fn selecting_the_same_task_again_renews_the_claim() {
        let mut bench = bench();
        bench.claim(1, 0);
        bench.step();
        open_epoch(&mut bench);
        bench.claim(1, 0);
        bench.step();
        assert!(
            bench.events(EventKind::Claimed).is_empty(),
            "it has it already"
        );
        bench.claim(0, 0);
        bench.step();
        assert_eq!(tasks(&bench), [NONE, 0, NONE]);
        assert_eq!(bench.world.counters().selection_conflicts, 1);
    }

    #[test]
    fn a_claim_one_epoch_late_is_good_if_the_task_is_free() {
        let mut bench = bench();
        bench.claim(0, 0);
        let late = bench.commands[0].claim;
        bench.commands[0].claim = Claim::NONE;
        open_epoch(&mut bench);
        bench.commands[0].claim = late;
        bench.step();
        assert_eq!(tasks(&bench), [0, NONE, NONE]);
        bench.commands[1].claim = late;
        bench.step();
        assert_eq!(tasks(&bench), [0, NONE, NONE], "late and taken");
        assert_eq!(bench.world.counters().invalid_claims, 1);
        open_epoch(&mut bench);
        bench.commands[1].claim = Claim { task: 1, ..late };
        bench.step();
        assert_eq!(tasks(&bench), [0, NONE, NONE], "two epochs late");
        assert_eq!(bench.world.counters().invalid_claims, 2);
        bench.commands[1].claim = Claim {
            task: 1,
            epoch: 9,
            ..late
        };
        bench.step();
        assert_eq!(tasks(&bench), [0, NONE, NONE], "of an epoch yet to come");
    }

    #[test]
    fn a_late_claim_is_refused_if_a_known_constraint_forbids_it() {
        let mut bench = bench();
        bench.claim(0, 1);
        let late = bench.commands[0].claim;
        bench.commands[0].claim = Claim::NONE;
        open_epoch(&mut bench);
        // Known, though not in force yet.
        let mut table: Box<ConstraintTable> = shm_types::zeroed();
        (table.version, table.count, table.effect_tick) = (1, 1, 1_000);
        table.constraints[0] = Constraint {
            before: 0,
            after: 1,
            kind: ConstraintKind::H1.code(),
        };
        bench.table = Some(table);
        bench.commands[0].claim = late;
        bench.step();
        assert_eq!(tasks(&bench), [NONE; 3]);
        assert_eq!(bench.world.counters().invalid_claims, 1);
        bench.commands[1].claim = Claim { task: 2, ..late };
        bench.step();
        assert_eq!(tasks(&bench), [NONE, 2, NONE], "nothing forbids this one");
    }

    #[test]
    fn a_claim_selected_under_another_constraint_version_is_refused() {
        let mut bench = bench();
        bench.claim(0, 0);
        bench.commands[0].claim.constraints_version = 5;
        bench.step();
        assert_eq!(tasks(&bench), [NONE; 3]);
        assert_eq!(bench.world.counters().invalid_claims, 1);
    }

    #[test]
    fn a_held_or_finished_task_cannot_be_claimed() {
        let objects = [[[1.0, 1.45], [5.0, 5.0]], [[3.0, 3.0], [3.0, 3.0]]];
        let homes = [[1.0, 1.0], [8.0, 1.0]];
        let mut bench = Bench::new(room(&homes, &objects, BELOW, ""));
        bench.claim(0, 0);
        bench.step();
        bench.grasp(0);
        bench.claim(1, 0);
        bench.step();
        bench.claim(1, 1);
        bench.step();
        assert_eq!(bench.robot(1).task, NONE);
        assert_eq!(bench.world.counters().invalid_claims, 2);
        // And what a robot holds is its task whatever it claims.
        bench.commands[0].claim = Claim::NONE;
        bench.step();
        assert_eq!((bench.robot(0).task, bench.object(0).claimed_by), (0, 0));
    }
}
