//! A look: where is the way, from where the robot is going to be, with everything as it is now.
//!
//! Responsible for: the plans of one look, over as many steps as the budget takes: the leg ahead,
//! before a task's first move also the leg after it, and, where it matters, the same leg without
//! the other robots (rules 20, 21).
//! Not responsible for: searching (`planner`), when to look, what follows.
//!
//! Terms: a *leg* is the way to one place.

use std::task::Poll;

use planner::obstacles::{self, Robots};
use scene::{ClassId, ROBOT_ALONE, Vec2, point};
use shm_types::StateHash;

use crate::account::Thinking;
use crate::blocker;
use crate::now::Now;

/// The way to one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Leg {
    /// To the grasp of this task's object.
    Approach(usize),
    /// With this task's object to its goal.
    Transfer(usize),
    /// To the robot's initial position.
    Home,
}

/// What stands in the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Blocker {
    /// Whatever it is, the robot can only wait: nobody looked closer.
    Anything,
    /// Objects: there is no way even without the other robots.
    Objects,
    /// Robots; the first one on the way there would be without them.
    Robot(Option<usize>),
}

/// What a look found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Seen {
    /// A way; its first piece is in [`Thinking::ahead`].
    Way,
    /// None.
    Blocked(Blocker),
}

/// How far a look goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum View {
    /// To the end of one leg.
    Leg(Leg),
    /// The whole manipulation path of a task (rule 4): its approach, then its transfer.
    Task(usize),
}

/// A look under way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look {
    view: View,
    /// Whether the first leg has a way, and the second of the view is planned.
    on_second: bool,
    robots: Robots,
    /// Whether the search has its inputs.
    begun: bool,
    /// Where the first leg starts.
    from: Vec2,
    /// What the snapshot counted when the look began.
    seen: Counted,
}

/// Counts of a snapshot that tell whether there is anything new to see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Counted {
    /// See [`shm_types::SnapshotHeader::change`].
    pub(crate) change: u64,
    /// See [`shm_types::SnapshotHeader::placements`].
    pub(crate) placements: u64,
}

impl Leg {
    /// The task it serves.
    pub(crate) fn task(self) -> Option<usize> {
        match self {
            Self::Approach(task) | Self::Transfer(task) => Some(task),
            Self::Home => None,
        }
    }

    /// Where it leads.
    pub(crate) fn target(self, now: &Now<'_>) -> Vec2 {
        match self {
            Self::Approach(task) => now.grasp_of(task),
            Self::Transfer(task) => now.goal_of(task),
            Self::Home => now.home(),
        }
    }

    fn class(self, now: &Now<'_>) -> ClassId {
        match self {
            Self::Transfer(task) => now.scene.objects[task].class,
            Self::Approach(_) | Self::Home => ROBOT_ALONE,
        }
    }
}

impl Blocker {
    /// A number for the state hash.
    pub(crate) fn code(self) -> u64 {
        match self {
            Self::Anything => 0,
            Self::Objects => 1,
            Self::Robot(None) => 2,
            Self::Robot(Some(robot)) => 3 + robot as u64,
        }
    }
}

impl View {
    /// A number for the state hash.
    pub(crate) fn code(self) -> u64 {
        match self {
            Self::Leg(Leg::Home) => 0,
            Self::Leg(Leg::Approach(_)) => 1,
            Self::Leg(Leg::Transfer(_)) => 2,
            Self::Task(_) => 3,
        }
    }
}

impl Look {
    /// A look from where the robot is going to be, at what is so now.
    pub(crate) fn new(now: &Now<'_>, view: View) -> Self {
        Self {
            view,
            on_second: false,
            robots: Robots::Include,
            begun: false,
            from: now.grant_end(),
            seen: now.counted(),
        }
    }

    /// The same look from the beginning.
    pub(crate) fn again(&self, now: &Now<'_>) -> Self {
        Self::new(now, self.view)
    }

    /// Where it started.
    pub(crate) fn from(&self) -> Vec2 {
        self.from
    }

    /// What the snapshot counted when it began.
    pub(crate) fn seen(&self) -> Counted {
        self.seen
    }

    /// How far it goes.
    pub(crate) fn view(&self) -> View {
        self.view
    }

    /// Adds what it carries, in a fixed order.
    pub(crate) fn hash_into(&self, hash: &mut StateHash) {
        hash.add(&point(self.from));
        hash.add(&[
            self.view.code(),
            u64::from(self.on_second),
            u64::from(self.robots == Robots::Ignore),
            u64::from(self.begun),
            self.seen.change,
            self.seen.placements,
        ]);
    }

    /// Goes on looking.
    pub(crate) fn advance(&mut self, now: &Now<'_>, thinking: &mut Thinking) -> Poll<Seen> {
        loop {
            if !self.begun {
                self.begin(now, thinking);
            }
            let search = &mut thinking.search;
            let Poll::Ready(found) =
                search.advance(now.scene, &mut thinking.budget, &mut thinking.counters)
            else {
                return Poll::Pending;
            };
            self.begun = false;
            match (found.is_some(), self.robots) {
                (true, Robots::Include) => {
                    if !self.on_second {
                        let length_m = thinking.settings.look_ahead_m;
                        thinking
                            .ahead
                            .cut(search.path(), &now.scene.lattice, length_m);
                    }
                    if self.on_second || matches!(self.view, View::Leg(_)) {
                        return Poll::Ready(Seen::Way);
                    }
                    self.on_second = true;
                }
                (true, Robots::Ignore) => {
                    let who = blocker::first_on(now, self.leg().class(now), search.path());
                    return Poll::Ready(Seen::Blocked(Blocker::Robot(who)));
                }
                (false, Robots::Include) if may_fail(now) && self.leg() != Leg::Home => {
                    self.robots = Robots::Ignore;
                }
                (false, Robots::Include) => return Poll::Ready(Seen::Blocked(Blocker::Anything)),
                (false, Robots::Ignore) => return Poll::Ready(Seen::Blocked(Blocker::Objects)),
            }
        }
    }

    /// The leg that is planned now.
    fn leg(&self) -> Leg {
        match self.view {
            View::Leg(leg) => leg,
            View::Task(task) if self.on_second => Leg::Transfer(task),
            View::Task(task) => Leg::Approach(task),
        }
    }

    /// Copies what the search needs of the snapshot.
    fn begin(&mut self, now: &Now<'_>, thinking: &mut Thinking) {
        let (scene, world, robot) = (now.scene, now.snapshot, now.id);
        let leg = self.leg();
        let from = match leg {
            Leg::Transfer(task) if self.on_second => now.grasp_of(task),
            _ => self.from,
        };
        let search = &mut thinking.search;
        let units = match leg {
            Leg::Approach(task) => {
                let occupancy = search.occupancy();
                obstacles::block_for_approach(occupancy, scene, world, robot, task, self.robots)
            }
            Leg::Transfer(task) => {
                let occupancy = search.occupancy();
                obstacles::block_for_transfer(occupancy, scene, world, robot, task, self.robots)
            }
            Leg::Home => {
                obstacles::block_for_home(search.occupancy(), scene, world, robot, self.robots)
            }
        };
        search.charge(units);
        search.begin(scene, from, leg.target(now));
        self.begun = true;
    }
}

/// Only a robot that may fail needs to know what blocks it: one that carries waits anyway
/// (rule 21).
fn may_fail(now: &Now<'_>) -> bool {
    now.holding().is_none()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_blockers_have_the_same_number_in_the_hash() {
        let robots = (0..shm_types::capacity::MAX_ROBOTS).map(|robot| Blocker::Robot(Some(robot)));
        let others = [Blocker::Anything, Blocker::Objects, Blocker::Robot(None)];
        let mut codes: Vec<u64> = others
            .into_iter()
            .chain(robots)
            .map(Blocker::code)
            .collect();
        let count = codes.len();
        codes.sort_unstable();
        codes.dedup();
        assert_eq!(codes.len(), count);
    }
}
