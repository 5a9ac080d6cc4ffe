//! Beginning with no worse a plan than what the paper's methods come to.
//!
//! Responsible for: which runs of these are carried out before anybody moves, how far, what is made
//! of who grasped what in them.
//! Not responsible for: the runs (`Rollout`), carrying orders out in the plan (`solver`).
//!
//! How: a run that brings all objects to their goals says in which order, and by whom, that can be
//! done. Planned for all robots together that order takes no longer as a rule, so it is the first
//! incumbent where it beats a poor first plan. If it does take longer, robots set off a little later
//! with something better.

use scene::{Method, Scene, Settings};
use shm_types::{Counters, Outcome};

use crate::anytime::solver::Solver;
use crate::rollout::{BeginRollout, Rollout, Transfer, UNITS_PER_ROBOT_AND_TICK};

/// What all runs together may take, as a share of the plan's makespan.
const MOST_SHARE: f64 = 0.005;
/// The same, s.
const MOST_S: f64 = 0.3;
/// How many times as long as its moves alone, in a good order, a poor plan takes.
const ROUNDABOUT: f64 = 1.25;
/// By how much of it a run's time may differ from the plan's where robots do the same in both.
const SAME: f64 = 0.005;
/// Ticks of a run that are made in one go.
const TICKS_PER_SLICE: usize = 200;
/// By how much of what a run took the plan may take longer, until better ones are looked for before
/// anybody moves.
const LAG: f64 = 0.02;
/// For how much of what the run took they are looked for.
const CATCHING_UP: f64 = 0.02;

/// Runs of the paper's methods from the scene's start.
pub(super) struct Rollouts {
    begin: Option<BeginRollout>,
    running: Option<Box<dyn Rollout>>,
    /// How many of the methods have had their turn.
    begun: usize,
    /// What was done in the runs before the present one.
    over: Counters,
    /// What robots grasped in those that brought all objects to their goals.
    found: Vec<Vec<Transfer>>,
    /// The least world time that one of these took, s.
    least_s: f64,
    /// Whether one of these comes to what the planner's own plan does.
    is_matched: bool,
}

impl Rollouts {
    pub(super) fn new(begin: Option<BeginRollout>) -> Self {
        Self {
            begin,
            running: None,
            begun: 0,
            over: Counters::default(),
            found: Vec::new(),
            least_s: f64::INFINITY,
            is_matched: false,
        }
    }

    /// The same again, from the beginning.
    pub(super) fn reset(&mut self) {
        *self = Self::new(self.begin);
    }

    /// What was done in the runs so far.
    pub(super) fn work(&self) -> Counters {
        self.over + self.running.iter().map(|run| run.work()).sum()
    }

    /// Goes on with a run until something is to be paid for. False once all are over, or more of them
    /// would take too long.
    pub(super) fn advance(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        solver: &mut Solver,
    ) -> bool {
        let (Some(begin), Some(best_s)) = (self.begin, solver.best_s()) else {
            return false;
        };
        if !solver.is_start || solver.is_small() {
            return false;
        }
        let most_s = (best_s * MOST_SHARE).min(MOST_S);
        let most_units = (most_s * settings.units_per_second as f64) as u64;
        let running = match self.running.take() {
            Some(run) => Some(run),
            None => self.next(begin, scene, settings, solver, most_units),
        };
        let Some(mut run) = running else {
            return false;
        };
        for _ in 0..TICKS_PER_SLICE {
            let outcome = run.tick();
            let time_s = run.time_ns() as f64 * 1e-9;
            // What takes longer than the plan is of no use.
            let is_over = outcome != Outcome::Running
                || time_s > best_s
                || self.over.units + run.work().units > most_units;
            if is_over {
                self.over += run.work();
                if outcome == Outcome::Solved {
                    self.take(scene, solver, run.transfers(), time_s);
                }
                return true;
            }
        }
        self.running = Some(run);
        true
    }

    /// The run of the next method, if there is time for it. There is no need of it where the plan takes
    /// little longer than its moves alone in a good order, or if a run came to the same: then the plan is one that
    /// does not owe much to luck, and waiting for the runs would only delay it.
    fn next(
        &mut self,
        begin: BeginRollout,
        scene: &Scene,
        settings: &Settings,
        solver: &mut Solver,
        most_units: u64,
    ) -> Option<Box<dyn Rollout>> {
        if self.is_matched || !solver.is_roundabout(ROUNDABOUT) {
            return None;
        }
        let method = *Method::PAPERS.get(self.begun)?;
        let left = (Method::PAPERS.len() - self.begun) as u64;
        self.begun += 1;
        let ticks = (solver.best_s()? * 1e9) as u64 / settings.tick_ns.max(1);
        let least_units = ticks * scene.homes.len() as u64 * UNITS_PER_ROBOT_AND_TICK;
        let is_affordable = self.over.units + left * least_units <= most_units;
        is_affordable.then(|| {
            let settings = settings.clone();
            begin(scene, &Settings { method, ..settings })
        })
    }

    /// Plans the same for all robots together, unless that was done.
    fn take(&mut self, scene: &Scene, solver: &mut Solver, transfers: &[Transfer], time_s: f64) {
        self.least_s = self.least_s.min(time_s);
        let own_s = solver.best_s().unwrap_or(f64::INFINITY);
        self.is_matched |= self.found.is_empty() && (own_s - time_s).abs() < SAME * time_s;
        if self.found.iter().all(|known| known != transfers) {
            self.found.push(transfers.to_vec());
            solver.follow(scene, transfers, time_s);
        }
    }

    /// For how long better plans are looked for before anybody moves, s: not at all, unless the plan
    /// takes longer than one of the runs did.
    pub(super) fn catching_up_s(&self) -> f64 {
        if self.least_s.is_finite() {
            self.least_s * CATCHING_UP
        } else {
            0.0
        }
    }

    /// Whether the plan takes longer than one of the runs did.
    pub(super) fn lags(&self, solver: &Solver) -> bool {
        let best_s = solver.best_s();
        best_s.is_some_and(|best_s| best_s > self.least_s * (1.0 + LAG))
    }
}

#[cfg(test)]
mod tests {
    use scene::GenerateOptions;

    use super::*;
    use crate::anytime::solver::testing::planned;

    /// A run that never ends, at so many units a tick.
    struct Endless {
        ticks: u64,
        units_per_tick: u64,
    }

    impl Rollout for Endless {
        fn tick(&mut self) -> Outcome {
            self.ticks += 1;
            Outcome::Running
        }

        fn time_ns(&self) -> u64 {
            self.ticks * Settings::default().tick_ns
        }

        fn work(&self) -> Counters {
            Counters {
                units: self.ticks * self.units_per_tick,
                ..Counters::default()
            }
        }

        fn transfers(&self) -> &[Transfer] {
            &[]
        }
    }

    fn begin<const UNITS_PER_TICK: u64>(_: &Scene, _: &Settings) -> Box<dyn Rollout> {
        Box::new(Endless {
            ticks: 0,
            units_per_tick: UNITS_PER_TICK,
        })
    }

    /// A room whose first plan is roundabout, or is not.
    fn room(is_roundabout: bool) -> (Scene, Solver) {
        let mut rooms = (0..).map(|seed| {
            let (scene, mut solver, _) = planned(&GenerateOptions {
                seed,
                crowding: 0.8,
                ..GenerateOptions::default()
            });
            let found = solver.is_roundabout(ROUNDABOUT);
            (found, (scene, solver))
        });
        rooms.find(|(found, _)| *found == is_roundabout).unwrap().1
    }

    /// What carrying runs out takes in all, units, how many were begun, and the plan's makespan, s.
    fn carry_out(
        begin: BeginRollout,
        settings: &Settings,
        (scene, mut solver): (Scene, Solver),
    ) -> (u64, usize, f64) {
        let best_s = solver.best_s().unwrap();
        let mut rollouts = Rollouts::new(Some(begin));
        while rollouts.advance(&scene, settings, &mut solver) {}
        assert_eq!(solver.best_s(), Some(best_s));
        assert!(!rollouts.lags(&solver));
        assert_eq!(rollouts.catching_up_s(), 0.0);
        (rollouts.work().units, rollouts.begun, best_s)
    }

    #[test]
    fn each_method_has_its_turn_until_it_takes_longer_than_the_plan() {
        let settings = Settings::default();
        let (units, begun, best_s) = carry_out(begin::<1>, &settings, room(true));
        assert_eq!(begun, Method::PAPERS.len());
        let ticks = (best_s * 1e9 / settings.tick_ns as f64).ceil() as u64;
        assert_eq!(units, begun as u64 * ticks);
    }

    #[test]
    fn no_run_is_begun_where_the_plan_takes_little_longer_than_its_moves() {
        let (units, begun, _) = carry_out(begin::<1>, &Settings::default(), room(false));
        assert_eq!((units, begun), (0, 0));
    }

    #[test]
    fn runs_that_would_take_too_long_are_given_up_or_not_begun() {
        let settings = Settings::default();
        let (units, begun, best_s) = carry_out(begin::<1_000_000>, &settings, room(true));
        let most = MOST_S.min(best_s * MOST_SHARE) * settings.units_per_second as f64;
        assert!(units as f64 > most && (units - 1_000_000) as f64 <= most);
        assert!(begun < Method::PAPERS.len());
        let slow = Settings {
            units_per_second: 1_000,
            ..settings
        };
        assert_eq!(carry_out(begin::<1>, &slow, room(true)).0, 0);
    }
}
