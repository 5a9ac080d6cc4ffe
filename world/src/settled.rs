//! How a run ends (rules 6, 22).
//!
//! Responsible for: solved, stuck, timed out, stopped, failed; and why. Not
//! responsible for: invariants (`invariants.rs`).
//!
//! Terms: a robot is *settled* when its newest command says it has looked since the last change
//! and found nothing to do. The world never guesses what could be selected; that all who could
//! know have looked, and the planner is idle, is enough (rule 22).

use std::fmt;

use scene::Scene;
use shm_types::{Outcome, PlannerReport, TaskStatus, Verdict};

use crate::state::is_at;
use crate::step::World;

/// Ticks for which everyone must be settled: one in which all have seen the last change, and one
/// in which nothing came of it.
const SETTLED_TICKS: u32 = 2;

/// World time for which everyone must be settled if the planner plans ahead and has not said that
/// it knows no plan, ns: it gets the time to see that its plan cannot be followed, and to make
/// another.
const SETTLED_WITH_PLAN_NS: u64 = 5_000_000_000;

/// Robots or objects that a reason lists one by one.
const MOST_LISTED: usize = 20;

/// More than a message has room for: what follows would not be the whole truth, so the run ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Overflow {
    /// Events of one tick.
    Events,
    /// Hard constraints that the table had no room for.
    Constraints(u32),
}

impl fmt::Display for Overflow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Events => f.write_str("one tick had more events than a batch has room for"),
            Self::Constraints(dropped) => write!(
                f,
                "{dropped} hard constraints were found beyond the {} that a table has room for",
                shm_types::capacity::MAX_CONSTRAINTS
            ),
        }
    }
}

/// What a run is stuck on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct StuckReason {
    /// Tasks that nobody has claimed.
    pub(crate) waiting: usize,
    /// Those of them barred for every live robot.
    pub(crate) barred: usize,
    /// Objects held by robots that cannot go on.
    pub(crate) held: usize,
    /// Robots that take part, carry nothing and are not at home.
    pub(crate) away: usize,
    /// Robots that are gone.
    pub(crate) gone: usize,
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
    pub(crate) fn stuck_reason(&self, scene: &Scene) -> Option<StuckReason> {
        if self.outcome != Outcome::Stuck {
            return None;
        }
        let live = |i: &usize| self.robots[*i].link.live;
        let mut reason = StuckReason::default();
        for object in self.objects.iter() {
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
            let live = robot.link.live;
            reason.away += usize::from(live && empty && !is_at(robot.position, *home));
            reason.gone += usize::from(!live);
        }
        Some(reason)
    }

    /// Why the run ended as it did, where the outcome alone does not say.
    #[must_use]
    pub fn reason(&self, scene: &Scene) -> Option<String> {
        let violation = || self.violation().map(|found| format!("{found:?}"));
        let overflow = || self.overflow.map(|found| found.to_string());
        let stuck = || {
            let stuck = self.stuck_reason(scene)?;
            Some(match self.verdict {
                Verdict::Open => stuck.to_string(),
                Verdict::NotFound => {
                    format!("the planner found no plan within its limits; {stuck}")
                }
                Verdict::Exhausted => "no plan exists on this lattice: every arrangement that can \
                                       be reached was looked at"
                    .to_owned(),
                Verdict::Proved => {
                    "no plan exists: what every plan has to do contradicts itself".to_owned()
                }
            })
        };
        violation()
            .or_else(overflow)
            .or_else(stuck)
            .or_else(|| self.missing(scene))
    }

    /// What a run that was cut short still lacks.
    fn missing(&self, scene: &Scene) -> Option<String> {
        if !matches!(self.outcome, Outcome::Timeout | Outcome::Interrupted) {
            return None;
        }
        let objects = self.objects.iter().enumerate();
        let open = objects.filter(|(_, object)| object.status != TaskStatus::Done);
        let robots = self.robots.iter().zip(&scene.homes).enumerate();
        let away = robots.filter(|(_, (robot, home))| !is_at(robot.position, **home));
        let said = [
            listed("not at their goals: objects", open.map(|(i, _)| i)),
            listed("not at home: robots", away.map(|(i, _)| i)),
        ];
        let said: Vec<String> = said.into_iter().flatten().collect();
        (!said.is_empty()).then(|| said.join("; "))
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
        } else if self.overflow.is_some() {
            Outcome::Failed
        } else if self.is_solved(scene) {
            Outcome::Solved
        } else if self.stopped {
            Outcome::Interrupted
        } else if self.settled_ticks >= self.ticks_to_settle() {
            Outcome::Stuck
        } else if self.time_ns + self.settings.tick_ns >= self.settings.time_limit_ns {
            Outcome::Timeout
        } else {
            Outcome::Running
        }
    }

    fn ticks_to_settle(&self) -> u32 {
        if self.settings.method.plans_ahead() && self.verdict == Verdict::Open {
            let ticks = SETTLED_WITH_PLAN_NS.div_ceil(self.settings.tick_ns.max(1));
            u32::try_from(ticks).map_or(u32::MAX, |ticks| ticks.max(SETTLED_TICKS))
        } else {
            SETTLED_TICKS
        }
    }

    fn is_solved(&self, scene: &Scene) -> bool {
        let done = |status: TaskStatus| status == TaskStatus::Done;
        self.objects.iter().all(|o| done(o.status))
            && self
                .robots
                .iter()
                .zip(&scene.homes)
                .filter(|(robot, _)| robot.link.live)
                .all(|(r, home)| r.hand.object().is_none() && is_at(r.position, *home))
    }

    /// Rule 22, as of the commands of this tick. `epoch.change` is still what they looked at.
    fn everyone_is_settled(&self, planner: Option<&PlannerReport>) -> bool {
        let looked = |settled_at: u64| settled_at == self.epoch.change;
        let mut live = self.robots.iter().filter(|r| r.link.live).peekable();
        let in_force = self.constraints.in_force.version;
        let idle = planner.is_none_or(|p| {
            p.busy == 0
                && p.constraints_version <= in_force
                && p.schedule_version <= self.schedules.judged
                // One that plans ahead has something to do when something has changed.
                && (p.tick >= self.epoch.changed_tick || !self.settings.method.plans_ahead())
        });
        idle && !self.held
            && live.peek().is_some()
            && live.all(|r| {
                r.link.is_fresh(self.tick)
                    && looked(r.link.settled_at_change)
                    && !r.hand.is_moving()
                    // What is granted is driven yet, however slowly.
                    && r.grant.is_empty()
                    && r.failure.is_none()
            })
    }
}

/// Numbers behind a word, the first of them one by one; nothing for none.
fn listed(what: &str, numbers: impl Iterator<Item = usize>) -> Option<String> {
    let all: Vec<String> = numbers.map(|number| number.to_string()).collect();
    let more = all.len().saturating_sub(MOST_LISTED);
    let first = all[..all.len() - more].join(", ");
    match (all.len(), more) {
        (0, _) => None,
        (_, 0) => Some(format!("{what} {first}")),
        _ => Some(format!("{what} {first} and {more} more")),
    }
}

#[cfg(test)]
mod tests {
    use scene::Settings;
    use shm_types::{ControlKind, EventKind, FailureCause, NONE};

    use super::*;
    use crate::testing::{BELOW, Bench, papers, room};

    const OBJECTS: [[[f64; 2]; 2]; 1] = [[[1.0, 1.45], [2.0, 1.45]]];

    fn bench() -> Bench {
        Bench::new(room(&[[1.0, 1.0], [8.0, 1.0]], &OBJECTS, BELOW, ""))
    }

    fn settle_all(bench: &mut Bench, ticks: usize) {
        for _ in 0..ticks {
            bench.settle(0);
            bench.settle(1);
            bench.step();
        }
    }

    #[test]
    fn solved_is_every_object_at_its_goal_and_every_robot_at_home() {
        let mut bench = bench();
        bench.claim(0, 0);
        bench.step();
        bench.grasp(0);
        bench.drive(0, &[[2.0, 1.0]]);
        bench.release(0);
        assert_eq!(bench.world.outcome(), Outcome::Running, "not at home yet");
        bench.ask(0, &[[1.0, 1.0]]);
        bench.steps(199);
        assert_eq!(bench.world.outcome(), Outcome::Running);
        bench.steps(3);
        assert_eq!(bench.header().outcome, Outcome::Solved.code());
    }

    #[test]
    fn stuck_is_when_all_have_looked_since_the_last_change() {
        let mut bench = bench();
        bench.steps(5);
        settle_all(&mut bench, 1);
        assert_eq!(
            bench.world.outcome(),
            Outcome::Running,
            "one tick is not enough"
        );
        assert_eq!(bench.world.stuck_reason(&bench.scene), None);
        settle_all(&mut bench, 1);
        assert_eq!(bench.world.outcome(), Outcome::Stuck);
        assert_eq!(bench.events(EventKind::Ended).len(), 1);
        let reason = bench.world.stuck_reason(&bench.scene).unwrap();
        assert_eq!(
            reason,
            StuckReason {
                waiting: 1,
                ..StuckReason::default()
            }
        );
    }

    #[test]
    fn who_has_not_looked_keeps_the_run_going() {
        let mut bench = bench();
        for _ in 0..20 {
            bench.settle(0);
            bench.step();
        }
        assert_eq!(bench.world.outcome(), Outcome::Running);
        // What was looked at before a change counts no more.
        bench.settle(0);
        bench.settle(1);
        bench.claim(1, 0);
        bench.steps(20);
        assert_eq!(bench.world.outcome(), Outcome::Running);
        settle_all(&mut bench, 2);
        assert_eq!(bench.world.outcome(), Outcome::Stuck);
    }

    #[test]
    fn a_busy_planner_an_open_failure_or_a_hold_keeps_the_run_going() {
        let mut bench = bench();
        bench.steps(2);
        bench.planner.busy = 1;
        settle_all(&mut bench, 20);
        assert_eq!(bench.world.outcome(), Outcome::Running);
        bench.planner.busy = 0;
        bench.planner.constraints_version = 3;
        settle_all(&mut bench, 20);
        assert_eq!(
            bench.world.outcome(),
            Outcome::Running,
            "a version is on its way"
        );
        bench.planner.constraints_version = 0;
        bench.fail(0, 0, FailureCause::Objects, NONE);
        bench.commands[0].failure.answered = 0;
        settle_all(&mut bench, 20);
        assert_eq!(bench.world.outcome(), Outcome::Running);
        bench.commands[0].failure.id = 0;
        bench.tell(ControlKind::Hold, 0, 0);
        settle_all(&mut bench, 20);
        assert_eq!(bench.world.outcome(), Outcome::Running);
        bench.tell(ControlKind::Resume, 0, 0);
        settle_all(&mut bench, 4);
        assert_eq!(bench.world.outcome(), Outcome::Stuck);
    }

    #[test]
    fn robots_that_are_gone_are_not_waited_for_but_named() {
        let mut bench = bench();
        bench.tell(ControlKind::Down, 1, 1);
        bench.step();
        bench.fail(0, 0, FailureCause::Objects, NONE);
        bench.step();
        for _ in 0..3 {
            bench.settle(0);
            bench.step();
        }
        bench.world.robots[1].position.x += 0.5;
        let reason = bench.world.stuck_reason(&bench.scene).unwrap();
        assert_eq!((reason.gone, reason.waiting, reason.barred), (1, 1, 1));
        assert_eq!(reason.away, 0, "it is not to go home");
        assert!(reason.to_string().contains("1 robots are gone"), "{reason}");
    }

    #[test]
    fn constraints_without_room_end_the_run_since_it_would_no_longer_be_the_method() {
        let mut bench = bench();
        bench.step();
        assert_eq!(bench.world.outcome(), Outcome::Running);
        bench.planner.constraints_dropped = 3;
        bench.step();
        assert_eq!(bench.world.outcome(), Outcome::Failed);
        let reason = bench.world.reason(&bench.scene).unwrap();
        assert!(reason.starts_with("3 hard constraints"), "{reason}");
    }

    #[test]
    fn the_time_limit_ends_a_run() {
        let settings = Settings {
            time_limit_ns: 1_000_000_000,
            ..papers()
        };
        let mut bench = Bench::with(room(&[[1.0, 1.0]], &OBJECTS, BELOW, ""), settings);
        bench.steps(99);
        assert_eq!(bench.world.outcome(), Outcome::Running);
        bench.step();
        assert_eq!(bench.header().outcome, Outcome::Timeout.code());
        let reason = bench.world.reason(&bench.scene).unwrap();
        assert_eq!(reason, "not at their goals: objects 0");
        let words = listed("objects", 0..23).unwrap();
        assert!(words.ends_with("18, 19 and 3 more"), "{words}");
    }
}
