//! The version of the schedule in force, for methods that plan ahead.
//!
//! Responsible for: bringing a newer schedule into force, no earlier than the tick it names, or
//! refusing it whole. Not responsible for: making schedules (crate `planner`), following them
//! (crate `robot`). Whether a robot follows is not checked: the world grants what is free.
//!
//! What is asked for under one version and not granted is dropped when the next comes into force:
//! it may go elsewhere now, or wait for others.

use scene::vec;
use shm_types::{Checked, Schedule, StateHash};

use crate::state::{Robot, is_at};
use crate::step::World;

/// A schedule as it came: its version, and what it says unless it is no legal message.
pub type PublishedSchedule<'a> = (u32, Option<Checked<'a, Schedule>>);

/// Versions of schedules.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Schedules {
    /// The one in force; 0 for none.
    pub(crate) in_force: u32,
    /// The newest brought into force or refused.
    pub(crate) judged: u32,
}

impl Schedules {
    /// Adds all of it.
    pub(crate) fn hash_into(self, hash: &mut StateHash) {
        hash.add(&[self.in_force, self.judged]);
    }
}

impl World {
    /// Brings `published` into force for the snapshot of the next tick, if it is newer, may be
    /// named by then and goes on from what is granted. Whether it did.
    pub(crate) fn adopt_schedule(&mut self, published: Option<PublishedSchedule<'_>>) -> bool {
        let Some((version, schedule)) = published else {
            return false;
        };
        let early = schedule.is_some_and(|s| s.effect_tick > self.tick + 1);
        if !self.settings.method.plans_ahead() || version <= self.schedules.judged || early {
            return false;
        }
        self.schedules.judged = version;
        let fits = schedule.is_some_and(|schedule| {
            let mut robots = self.robots.iter().enumerate();
            robots.all(|(i, robot)| goes_on(&schedule, i, robot))
        });
        if fits {
            self.schedules.in_force = version;
            self.robots.iter_mut().for_each(Robot::keep_whole_actions);
        } else {
            self.counters.schedules_refused += 1;
        }
        fits
    }
}

/// Whether a schedule goes on where robot `i`'s grant ends: no gap after what is granted, and
/// what it lists of that leads where it was granted to.
fn goes_on(schedule: &Schedule, i: usize, robot: &Robot) -> bool {
    let granted = robot.granted_actions();
    let part = &schedule.robots[i];
    let leads_to = |number: u32, place| {
        let action = schedule.action(i, number);
        action.is_some_and(|action| is_at(vec(action.to), place))
    };
    let last_is_same = match (granted.checked_sub(1), robot.action_end) {
        (Some(last), Some(end)) if last >= part.first => leads_to(last, end),
        _ => true,
    };
    let part_is_same = match robot.rest.first() {
        Some(end) if robot.cut => leads_to(granted, end),
        _ => true,
    };
    part.first <= granted && granted <= part.first + part.count && last_is_same && part_is_same
}
