//! Task events: an object put down, a task completed, a task failed (rules 5, 18, 19, 21).
//!
//! Responsible for: status of tasks, and which events open an epoch. Not responsible for: grips
//! (`grip.rs`), what a failure bars (`bars.rs`).

use scene::Vec2;
use shm_types::{EventKind, Failure, FailureCause, NONE, TaskStatus, index};

use crate::journal::{Event, Journal};
use crate::path::ARRIVAL_M;
use crate::state::{Hand, Object, PendingFailure};
use crate::step::World;

impl World {
    /// Robot `i` has opened its grip: `object` stands on the ground. At its goal its task is
    /// completed; elsewhere it goes back to the pool, which opens an epoch too **(ours)**:
    /// nobody could select it otherwise.
    pub(crate) fn put_down(&mut self, i: usize, object: usize, journal: &mut Journal<'_>) {
        self.exchange_goals(object, journal);
        let put = &mut self.objects[object];
        put.position = place_of(put.position, put.goal);
        put.rest = put.position;
        put.put_downs += 1;
        put.holder = None;
        put.claimed_by = None;
        put.status = put.status_on_ground();
        let done = put.status == TaskStatus::Done;
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

    /// An object is put down at the goal of another one of its kind: they exchange goals.
    fn exchange_goals(&mut self, object: usize, journal: &mut Journal<'_>) {
        let put = &self.objects[object];
        let Some(kind) = put.kind else { return };
        let at = put.position;
        let is_there = |goal: Vec2| (at - goal).norm() <= ARRIVAL_M;
        if put.goal.is_some_and(is_there) {
            return;
        }
        let is_its_goal =
            |other: &Object| other.kind == Some(kind) && other.goal.is_some_and(is_there);
        let Some(other) = self.objects.iter().position(is_its_goal) else {
            return;
        };
        let goal = self.objects[object].goal;
        self.objects[object].goal = std::mem::replace(&mut self.objects[other].goal, goal);
        let left = &mut self.objects[other];
        if left.status == TaskStatus::Waiting {
            left.status = left.status_on_ground();
            if left.status == TaskStatus::Done && goal.is_some() {
                journal.event(Event::new(EventKind::Completed).task(other));
                self.epoch.events += 1;
            }
        }
    }

    /// A grasp, a release or a new constraint: lifts all bars (rule 21).
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

#[cfg(test)]
mod tests {
    use scene::Settings;
    use shm_types::{EventKind, FailureCause, Grip, NONE, Phase, TaskStatus};

    use crate::testing::{BELOW, Bench, papers, room, room_text};

    const OBJECTS: [[[f64; 2]; 2]; 2] = [[[1.0, 1.45], [2.0, 1.45]], [[5.0, 3.0], [5.0, 5.0]]];

    fn bench(settings: Settings) -> Bench {
        Bench::with(
            room(&[[1.0, 1.0], [8.0, 1.0]], &OBJECTS, BELOW, ""),
            settings,
        )
    }

    fn carrying() -> Bench {
        let mut bench = bench(papers());
        bench.claim(0, 0);
        bench.step();
        bench.grasp(0);
        bench
    }

    #[test]
    fn releasing_at_the_goal_completes_the_task_and_opens_an_epoch() {
        let mut bench = carrying();
        bench.drive(0, &[[2.0, 1.0]]);
        assert_eq!((bench.header().epoch, bench.header().events), (1, 0));
        bench.release(0);
        assert_eq!(bench.events(EventKind::Completed).len(), 1);
        assert_eq!((bench.header().epoch, bench.header().events), (2, 1));
        let object = bench.object(0);
        assert_eq!(
            (object.status, object.claimed_by),
            (TaskStatus::Done.code(), NONE)
        );
        assert_eq!(object.epoch_status, TaskStatus::Done.code());
        assert_eq!((bench.robot(0).task, bench.robot(0).epoch_free), (NONE, 1));
    }

    #[test]
    fn releasing_elsewhere_puts_the_task_back_into_the_pool() {
        let mut bench = carrying();
        bench.drive(0, &[[1.5, 1.0]]);
        bench.release(0);
        assert!(bench.events(EventKind::Completed).is_empty());
        assert_eq!((bench.header().epoch, bench.header().events), (2, 0));
        let object = bench.object(0);
        assert_eq!(
            (object.status, object.claimed_by),
            (TaskStatus::Waiting.code(), NONE)
        );
        assert_eq!(object.rest, shm_types::Point::new(1.5, 1.45));
        assert_eq!(object.epoch_status, TaskStatus::Waiting.code());
        bench.claim(1, 0);
        bench.step();
        assert_eq!(bench.robot(1).task, 0);
    }

    #[test]
    fn an_object_at_its_goal_needs_no_transport() {
        let objects = [[[1.0, 3.0], [1.0, 3.0]], [[3.0, 3.0], [3.0 + 2e-6, 3.0]]];
        let bench = Bench::new(room(&[[1.0, 1.0]], &objects, BELOW, ""));
        assert_eq!(bench.object(0).status, TaskStatus::Done.code());
        assert_eq!(bench.object(1).status, TaskStatus::Waiting.code());
    }

    #[test]
    fn an_answered_failure_is_counted_once_and_opens_an_epoch() {
        let mut bench = bench(papers());
        bench.claim(0, 1);
        bench.step();
        bench.fail(0, 1, FailureCause::Objects, NONE);
        bench.step();
        let failed = bench.events(EventKind::Failed);
        assert_eq!(
            (failed[0].robot, failed[0].task, failed[0].other),
            (0, 1, NONE)
        );
        assert_eq!(failed[0].value, u64::from(FailureCause::Objects.code()));
        bench.steps(5);
        assert_eq!(bench.world.counters().task_failures, 1);
        assert_eq!((bench.header().epoch, bench.header().events), (2, 1));
        assert_eq!(bench.object(1).failures, 1);
    }

    #[test]
    fn two_failures_in_one_tick_open_one_epoch() {
        let mut bench = bench(papers());
        bench.fail(0, 0, FailureCause::Objects, NONE);
        bench.fail(1, 1, FailureCause::Objects, NONE);
        bench.step();
        assert_eq!((bench.header().epoch, bench.header().events), (2, 2));
    }

    #[test]
    fn a_failure_waits_for_its_answer_or_its_deadline() {
        let settings = Settings {
            answer_deadline_ns: 100_000_000,
            ..papers()
        };
        let mut bench = bench(settings);
        bench.fail(0, 1, FailureCause::Objects, NONE);
        bench.commands[0].failure.answered = 0;
        bench.commands[0].phase = Phase::Failing.code();
        bench.steps(10);
        assert_eq!((bench.header().epoch, bench.object(1).failures), (1, 0));
        bench.step();
        assert_eq!((bench.header().epoch, bench.object(1).failures), (2, 1));
        assert_eq!(bench.world.counters().answers_missed, 1);
        bench.fail(0, 0, FailureCause::Objects, NONE);
        bench.commands[0].failure.answered = 0;
        bench.step();
        bench.commands[0].failure.answered = 1;
        bench.step();
        assert_eq!((bench.header().epoch, bench.object(0).failures), (3, 1));
        assert_eq!(bench.world.counters().answers_missed, 1);
    }

    #[test]
    fn a_carrying_robot_does_not_fail() {
        let mut bench = carrying();
        bench.fail(0, 0, FailureCause::Objects, NONE);
        bench.steps(3);
        assert_eq!(bench.world.counters().task_failures, 0);
        assert_eq!((bench.header().epoch, bench.robot(0).task), (1, 0));
        bench.grip(0, Grip::Keep);
    }
    #[test]
    fn who_is_on_the_way_to_an_object_keeps_it_when_its_goal_is_taken() {
        let objects = [[[1.0, 1.45], [2.0, 1.45]], [[8.0, 1.45], [8.0, 4.0]]];
        let kind = "[[objects]]\nkind = \"crate\"\n";
        let text = room_text(&[[1.0, 1.0], [8.0, 1.0]], &objects, BELOW, "");
        let text = text.replace("[[objects]]\n", kind);
        let mut bench = Bench::new(scene::parse(&text, "kinds.toml").unwrap());
        bench.claim(0, 0);
        bench.claim(1, 1);
        bench.step();
        bench.grasp(0);
        bench.drive(0, &[[1.0, 3.55], [8.0, 3.55]]);
        bench.release(0);
        assert_eq!(bench.object(0).status, TaskStatus::Done.code());
        assert_eq!(bench.object(1).goal, shm_types::Point::new(2.0, 1.45));
        assert_eq!(bench.object(1).status, TaskStatus::Claimed.code());
        assert_eq!(bench.object(1).claimed_by, 1);
    }
}
