//! Bars: a failed task is kept from the robot it failed for, so that the number of selections is
//! finite (rule 21).
//!
//! Responsible for: what a failure bars, and what lifts it. Not responsible for: telling robots
//! and objects apart as the cause (crate `robot`).
//!
//! A failure caused by objects bars until the next grasp, release or constraint version. Of those
//! caused by robots, the first B − 1 of one robot and task between such events bar nothing; the
//! B-th bars until its blocker is parked elsewhere; any further one until such an event.

use scene::Vec2;
use shm_types::{Failure, FailureCause, StateHash, TaskStatus, index};

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
