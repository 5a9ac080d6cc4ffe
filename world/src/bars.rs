//! Bars: a failed task is kept from the robot it failed for, so that the number of selections is
//! finite (rule 21).
//!
//! Responsible for: what a failure bars, and what lifts it. Not responsible for: telling robots
//! and objects apart as the cause (crate `robot`).
//!
//! A failure caused by objects bars until the next grasp, release or new constraint. Of those
//! caused by robots, the first B − 1 of one robot and task between such events bar nothing; the
//! B-th bars until its blocker is parked elsewhere; any further one until such an event.

use scene::Vec2;
use shm_types::{Failure, FailureCause, StateHash, TaskStatus, index};

use crate::saved::{Reader, Saved, Unreadable, saved};
use crate::state::{Robot, id, is_at};
use crate::step::World;

/// A bar that goes when a robot does.
#[derive(Clone, Copy, Debug)]
struct Parked {
    robot: usize,
    task: usize,
    blocker: usize,
    /// Where the blocker was when it blocked.
    at: Vec2,
}

saved!(Parked {
    robot,
    task,
    blocker,
    at
});

/// What the bit sets of the objects do not say.
#[derive(Clone, Debug)]
pub(crate) struct Bars {
    /// Robot-caused failures per task and robot since the last placement.
    counts: Vec<u32>,
    parked: Vec<Parked>,
    robots: usize,
    /// Whether there is anything to lift.
    any: bool,
}

impl Bars {
    pub(crate) fn new(robots: usize, objects: usize) -> Self {
        Self {
            counts: vec![0; robots * objects],
            parked: Vec::with_capacity(robots * objects),
            robots,
            any: false,
        }
    }

    /// Makes room for more of both. Counts are by task: another robot moves those of each.
    pub(crate) fn make_room(&mut self, robots: usize, objects: usize) {
        if robots > self.robots {
            let rows = self.counts.chunks(self.robots);
            let none = || std::iter::repeat_n(0, robots - self.robots);
            let rows = rows.flat_map(|row| row.iter().copied().chain(none()));
            self.counts = rows.collect();
            self.robots = robots;
        }
        self.counts.resize(robots * objects, 0);
        let more = (robots * objects).saturating_sub(self.parked.len());
        self.parked.reserve(more);
    }

    /// The counts, for the state hash.
    pub(crate) fn counts(&self) -> &[u32] {
        if self.any { &self.counts } else { &[] }
    }

    /// Adds who waits for whom to park elsewhere.
    pub(crate) fn hash_parked(&self, hash: &mut StateHash) {
        for bar in &self.parked {
            hash.add(&[id(bar.robot), id(bar.task), id(bar.blocker)]);
            hash.add(&scene::point(bar.at));
        }
    }

    /// Appends all of it. Counts are few and far between, so those that are 0 are left out.
    pub(crate) fn save(&self, out: &mut Vec<u8>) {
        let Self {
            counts,
            parked,
            robots: _,
            any,
        } = self;
        any.save(out);
        parked.save(out);
        if *any {
            let counted = || (0..).zip(counts).filter(|(_, count)| **count > 0);
            counted().count().save(out);
            counted().for_each(|(at, count): (usize, &u32)| (at, *count).save(out));
        }
    }

    /// Puts what was saved in the place of what there is, which keeps its memory.
    pub(crate) fn restore(&mut self, from: &mut Reader<'_>) -> Result<(), Unreadable> {
        self.any = Saved::restore(from)?;
        let most = self.counts.len();
        let parked: Vec<Parked> = Saved::restore(from)?;
        if parked.len() > most {
            return Err(Unreadable::Many(parked.len() as u64));
        }
        self.parked.clear();
        self.parked.extend(parked);
        self.counts.fill(0);
        if self.any {
            for _ in 0..from.count()? {
                let (at, count): (usize, u32) = Saved::restore(from)?;
                let slot = self.counts.get_mut(at);
                *slot.ok_or(Unreadable::Many(at as u64))? = count;
            }
        }
        Ok(())
    }

    /// Whether all that is named exists.
    pub(crate) fn is_sound(&self, robots: usize, objects: usize) -> bool {
        self.parked
            .iter()
            .all(|bar| bar.robot < robots && bar.blocker < robots && bar.task < objects)
    }
}

impl World {
    /// Bars `task` for robot `i` as its failure demands.
    pub(crate) fn bar(&mut self, i: usize, task: usize, report: Failure) {
        self.bars.any = true;
        if report.cause == FailureCause::Robots.code() {
            let count = &mut self.bars.counts[task * self.bars.robots + i];
            *count += 1;
            let most = self.settings.robot_failures;
            if *count < most {
                return;
            }
            if *count == most
                && let Some(blocker) = index(report.blocker)
            {
                self.bars.parked.push(Parked {
                    robot: i,
                    task,
                    blocker,
                    at: self.robots[blocker].position,
                });
            }
        }
        self.objects[task].barred[i / 64] |= 1 << (i % 64);
    }

    /// Lifts every bar: something was grasped or put down, or constraints are new.
    pub(crate) fn lift_all_bars(&mut self) {
        if !self.bars.any {
            return;
        }
        for task in 0..self.objects.len() {
            for i in 0..self.robots.len() {
                if self.objects[task].is_barred(i) {
                    self.lift(i, task);
                }
            }
        }
        self.bars.counts.fill(0);
        self.bars.parked.clear();
        self.bars.any = false;
    }

    /// Lifts the bars whose blocker now stands somewhere else.
    pub(crate) fn lift_bars_of_parked(&mut self) {
        let mut at = 0;
        while at < self.bars.parked.len() {
            let bar = self.bars.parked[at];
            let blocker = &self.robots[bar.blocker];
            if stands(blocker) && !is_at(blocker.position, bar.at) {
                self.bars.parked.swap_remove(at);
                self.lift(bar.robot, bar.task);
            } else {
                at += 1;
            }
        }
    }

    /// Lifts one bar. If an idle robot may now select the task, an epoch opens **(ours)**:
    /// selection reads bars as they were when the epoch opened, and nothing else might open one.
    fn lift(&mut self, i: usize, task: usize) {
        let object = &mut self.objects[task];
        object.barred[i / 64] &= !(1 << (i % 64));
        let open = matches!(object.status, TaskStatus::Waiting | TaskStatus::Claimed);
        self.epoch.due |= open && self.robots[i].is_idle();
    }
}

fn stands(robot: &Robot) -> bool {
    !robot.moved && robot.grant.is_empty()
}

#[cfg(test)]
mod tests {
    use shm_types::{Claim, FailureCause, NONE};

    use super::{Bars, Parked, Vec2};
    use crate::testing::{BELOW, Bench, room};

    const ROBOTS: [[f64; 2]; 3] = [[1.0, 1.0], [4.0, 1.0], [8.0, 1.0]];
    const OBJECTS: [[[f64; 2]; 2]; 2] = [[[4.0, 1.45], [4.0, 5.0]], [[6.0, 3.0], [6.0, 5.0]]];

    fn bench() -> Bench {
        Bench::new(room(&ROBOTS, &OBJECTS, BELOW, ""))
    }

    fn is_barred(bench: &Bench, robot: usize, task: usize) -> bool {
        bench.object(task).barred[robot / 64] >> (robot % 64) & 1 == 1
    }

    fn fail_for_robots(bench: &mut Bench, blocker: u32) {
        bench.fail(0, 1, FailureCause::Robots, blocker);
        bench.step();
    }

    #[test]
    fn a_failure_caused_by_objects_bars_until_the_next_grasp() {
        let mut bench = bench();
        bench.claim(1, 0);
        bench.fail(0, 1, FailureCause::Objects, NONE);
        bench.step();
        assert!(is_barred(&bench, 0, 1) && !is_barred(&bench, 1, 1));
        assert_eq!(bench.object(1).epoch_barred, bench.object(1).barred);
        bench.claim(0, 1);
        bench.claim(1, 0);
        bench.step();
        assert_eq!(bench.robot(0).task, NONE, "barred");
        let epoch = bench.header().epoch;
        bench.grasp(1);
        assert!(!is_barred(&bench, 0, 1));
        assert_eq!(bench.header().epoch, epoch + 1, "robot 0 may select it now");
        assert_eq!(bench.object(1).epoch_barred, [0; 2]);
        bench.claim(0, 1);
        bench.step();
        assert_eq!(bench.robot(0).task, 1);
    }

    #[test]
    fn a_lifted_bar_of_a_busy_robot_opens_no_epoch() {
        let mut bench = bench();
        bench.fail(0, 1, FailureCause::Objects, NONE);
        bench.step();
        bench.claim(0, 0);
        bench.step();
        assert_eq!(bench.robot(0).task, 0);
        let epoch = bench.header().epoch;
        bench.commands[0].claim = Claim::NONE;
        bench.claim(1, 0);
        bench.step();
        bench.claim(2, 1);
        bench.step();
        // Robot 0 is idle, but its task is about to be done by another: still open.
        bench.grasp(1);
        assert_eq!(bench.header().epoch, epoch + 1);
        bench.claim(0, 1);
        bench.fail(1, 0, FailureCause::Objects, NONE);
        bench.step();
        let epoch = bench.header().epoch;
        bench.release(1);
        assert_eq!(
            bench.header().epoch,
            epoch + 1,
            "a release opens one anyway"
        );
    }

    #[test]
    fn only_the_last_of_the_failures_caused_by_robots_bars() {
        let mut bench = bench();
        fail_for_robots(&mut bench, 2);
        fail_for_robots(&mut bench, 2);
        assert!(!is_barred(&bench, 0, 1));
        fail_for_robots(&mut bench, 2);
        assert!(is_barred(&bench, 0, 1));
        assert_eq!(bench.world.counters().task_failures, 3);
    }

    #[test]
    fn it_goes_when_the_blocker_is_parked_elsewhere_but_not_twice() {
        let mut bench = bench();
        for _ in 0..3 {
            fail_for_robots(&mut bench, 2);
        }
        let epoch = bench.header().epoch;
        bench.ask(2, &[[8.0, 3.0]]);
        bench.steps(100);
        assert!(is_barred(&bench, 0, 1), "still on its way");
        bench.steps(400);
        assert!(!is_barred(&bench, 0, 1));
        assert_eq!(bench.header().epoch, epoch + 1);
        fail_for_robots(&mut bench, 2);
        assert!(is_barred(&bench, 0, 1));
        bench.drive(2, &[[8.0, 1.0]]);
        bench.steps(5);
        assert!(is_barred(&bench, 0, 1), "now only a placement lifts it");
        bench.claim(1, 0);
        bench.step();
        bench.grasp(1);
        assert!(!is_barred(&bench, 0, 1));
        fail_for_robots(&mut bench, 2);
        assert!(!is_barred(&bench, 0, 1), "counting begins anew");
    }

    #[test]
    fn a_blocker_that_stays_keeps_its_bar() {
        let mut bench = bench();
        for _ in 0..3 {
            fail_for_robots(&mut bench, 2);
        }
        bench.drive(1, &[[4.5, 1.0]]);
        bench.steps(5);
        assert!(is_barred(&bench, 0, 1));
    }

    #[test]
    fn a_bar_names_robots_and_tasks_that_there_are() {
        let is_sound = |[robot, task, blocker]: [usize; 3]| {
            let mut bars = Bars::new(3, 2);
            let at = Vec2::default();
            bars.parked.push(Parked {
                robot,
                task,
                blocker,
                at,
            });
            bars.is_sound(3, 2)
        };
        assert!(is_sound([2, 1, 2]), "the last of each");
        for beyond in [[3, 1, 2], [2, 2, 2], [2, 1, 3]] {
            assert!(!is_sound(beyond), "{beyond:?}");
        }
    }
}
