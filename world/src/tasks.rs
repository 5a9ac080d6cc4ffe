//! Task events: an object put down, a task completed, a task failed (rules 5, 18, 19, 21).
//!
//! Responsible for: status of tasks, and which events open an epoch. Not responsible for: grips
//! (`grip.rs`), what a failure bars (`bars.rs`).

use scene::Vec2;
use shm_types::{EventKind, Failure, FailureCause, NONE, TaskStatus, index};

use crate::journal::{Event, Journal};
use crate::path::ARRIVAL_M;
use crate::state::{Hand, PendingFailure, is_at};
use crate::step::World;

impl World {
    /// Robot `i` has opened its grip: `object` stands on the ground. At its goal its task is
    /// completed; elsewhere it goes back to the pool, which opens an epoch too **(ours)**:
    /// nobody could select it otherwise.
    pub(crate) fn put_down(&mut self, i: usize, object: usize, journal: &mut Journal<'_>) {
        let put = &mut self.objects[object];
        put.position = place_of(put.position, put.goal);
        put.rest = put.position;
        put.holder = None;
        put.claimed_by = None;
        let done = put.goal.is_none_or(|goal| is_at(put.position, goal));
        put.status = if done {
            TaskStatus::Done
        } else {
            TaskStatus::Waiting
        };
        self.bodies.ground.put(object, put.position);
        let robot = &mut self.robots[i];
        robot.claim = None;
        robot.leaving.add(object);
        journal.event(Event::new(EventKind::Released).robot(i).task(object));
        if done {
            journal.event(Event::new(EventKind::Completed).robot(i).task(object));
            self.epoch.events += 1;
        }
        self.epoch.due = true;
        self.placed();
    }

    /// A grasp, a release or a new constraint version: lifts all bars (rule 21).
    pub(crate) fn placed(&mut self) {
        self.epoch.placements += 1;
        self.lift_all_bars();
    }

    /// Takes note of what robot `i`'s newest command says of a failure. Level-triggered: what is
    /// no longer reported is no longer pending.
    pub(crate) fn take_failure(&mut self, i: usize, report: Failure) {
        let now_ns = self.time_ns;
        let robot = &mut self.robots[i];
        let reported = report.cause != FailureCause::None.code() && report.task != NONE;
        if !reported || report.id <= robot.last_failure {
            robot.failure = None;
            return;
        }
        let since_ns = match robot.failure {
            Some(pending) if pending.report.id == report.id => pending.since_ns,
            _ => now_ns,
        };
        robot.failure = Some(PendingFailure { report, since_ns });
    }

    /// Counts the failures that are answered, or whose answer is overdue.
    pub(crate) fn count_failures(&mut self, journal: &mut Journal<'_>) {
        for i in 0..self.robots.len() {
            let Some(PendingFailure { report, since_ns }) = self.robots[i].failure else {
                continue;
            };
            let overdue = self.time_ns - since_ns >= self.settings.answer_deadline_ns;
            if report.answered == 0 && !overdue {
                continue;
            }
            self.robots[i].failure = None;
            self.robots[i].last_failure = report.id;
            let Some(task) = index(report.task) else {
                continue;
            };
            // A carrying robot keeps its task, and a task may have been finished meanwhile.
            let open = matches!(
                self.objects[task].status,
                TaskStatus::Waiting | TaskStatus::Claimed
            );
            if open && self.robots[i].hand == Hand::Empty {
                self.counters.answers_missed += u64::from(report.answered == 0);
                self.count_failure(i, task, report, journal);
            }
        }
    }

    fn count_failure(&mut self, i: usize, task: usize, report: Failure, journal: &mut Journal<'_>) {
        self.counters.task_failures += 1;
        self.objects[task].failures += 1;
        self.epoch.events += 1;
        self.epoch.due = true;
        self.bar(i, task, report);
        let event = Event::new(EventKind::Failed).robot(i).task(task);
        journal.event(event.other(report.blocker).value(u64::from(report.cause)));
    }
}

/// Where an object put down at `position` stands: path points are exact, so at its goal it is
/// there but for rounding, which is taken off.
fn place_of(position: Vec2, goal: Option<Vec2>) -> Vec2 {
    match goal {
        Some(goal) if (position - goal).norm() <= ARRIVAL_M => goal,
        _ => position,
    }
}
