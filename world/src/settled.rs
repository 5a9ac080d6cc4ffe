//! How a run ends (rules 6, 22).
//!
//! Responsible for: solved, stuck, timed out, stopped; and what a stuck run is stuck on. Not
//! responsible for: invariants (`invariants.rs`).
//!
//! Terms: a robot is *settled* when its newest command says it has looked since the last change
//! and found nothing to do. The world never guesses what could be selected; that all who could
//! know have looked, and the planner is idle, is enough (rule 22).

use std::fmt;

use scene::Scene;
use shm_types::{Outcome, PlannerReport, TaskStatus};

use crate::state::is_at;
use crate::step::World;

/// Ticks for which everyone must be settled: one in which all have seen the last change, and one
/// in which nothing came of it.
const SETTLED_TICKS: u32 = 2;

/// What a run is stuck on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StuckReason {
    /// Tasks that nobody has claimed.
    pub waiting: usize,
    /// Those of them barred for every live robot.
    pub barred: usize,
    /// Objects held by robots that cannot go on.
    pub held: usize,
    /// Robots that carry nothing and are not at home.
    pub away: usize,
    /// Robots that are gone.
    pub gone: usize,
}

impl fmt::Display for StuckReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} tasks wait ({} failed for every robot), {} objects are held by robots that \
             cannot go on, {} robots cannot go home, {} robots are gone",
            self.waiting, self.barred, self.held, self.away, self.gone
        )
    }
}

impl World {
    /// What a stuck run is stuck on; `None` unless the outcome is [`Outcome::Stuck`].
    #[must_use]
    pub fn stuck_reason(&self, scene: &Scene) -> Option<StuckReason> {
        if self.outcome != Outcome::Stuck {
            return None;
        }
        let live = |i: &usize| self.robots[*i].link.live;
        let mut reason = StuckReason::default();
        for object in &self.objects {
            let waiting = object.status == TaskStatus::Waiting;
            let barred = waiting
                && (0..self.robots.len())
                    .filter(live)
                    .all(|i| object.is_barred(i));
            reason.waiting += usize::from(waiting);
            reason.barred += usize::from(barred);
            reason.held += usize::from(object.holder.is_some());
        }
        for (robot, home) in self.robots.iter().zip(&scene.homes) {
            let empty = robot.hand.holding().is_none();
            reason.away += usize::from(empty && !is_at(robot.position, *home));
            reason.gone += usize::from(!robot.link.live);
        }
        Some(reason)
    }

    /// How the run stands after this tick.
    pub(crate) fn judge_outcome(
        &mut self,
        scene: &Scene,
        planner: Option<&PlannerReport>,
        eventful: bool,
    ) -> Outcome {
        let quiet = !eventful && self.everyone_is_settled(planner);
        self.settled_ticks = if quiet { self.settled_ticks + 1 } else { 0 };
        if self.counters.violations > 0 {
            Outcome::Violated
        } else if self.overflowed {
            Outcome::Failed
        } else if self.is_solved(scene) {
            Outcome::Solved
        } else if self.stopped {
            Outcome::Interrupted
        } else if self.settled_ticks >= SETTLED_TICKS {
            Outcome::Stuck
        } else if self.time_ns >= self.settings.time_limit_ns {
            Outcome::Timeout
        } else {
            Outcome::Running
        }
    }

    fn is_solved(&self, scene: &Scene) -> bool {
        let done = |status: TaskStatus| status == TaskStatus::Done;
        self.objects.iter().all(|o| done(o.status))
            && self
                .robots
                .iter()
                .zip(&scene.homes)
                .all(|(r, home)| r.hand.object().is_none() && is_at(r.position, *home))
    }

    /// Rule 22, as of the commands of this tick. `epoch.change` is still what they looked at.
    fn everyone_is_settled(&self, planner: Option<&PlannerReport>) -> bool {
        let looked = |settled_at: u64| settled_at == self.epoch.change;
        let mut live = self.robots.iter().filter(|r| r.link.live).peekable();
        let in_force = self.constraints.in_force.version;
        let idle = planner.is_none_or(|p| p.busy == 0 && p.constraints_version <= in_force);
        idle && !self.held
            && live.peek().is_some()
            && live.all(|r| {
                r.link.is_fresh(self.tick)
                    && looked(r.link.settled_at_change)
                    && !r.hand.is_moving()
                    && r.failure.is_none()
            })
    }
}
