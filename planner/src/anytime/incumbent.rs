//! Beginning with what the paper's methods come to, if that is better.
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
/// Ticks of a run that are made in one go, and the work units after which it is enough.
const TICKS_PER_SLICE: usize = 200;
const UNITS_PER_SLICE: u64 = 50_000;
/// By how much of what a run took the plan may take longer, until better ones are looked for before
/// anybody moves.
const LAG: f64 = 0.02;
/// For how much of what the run took they are looked for.
const CATCHING_UP: f64 = 0.02;
/// For how long at most, s.
const MOST_CATCHING_UP_S: f64 = 1.0;

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
    /// Whether the first of these came to what the planner's own plan does.
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
        let before = run.work().units;
        for _ in 0..TICKS_PER_SLICE {
            let outcome = run.tick();
            let time_s = run.time_ns() as f64 * 1e-9;
            // What takes longer than the plan is of no use.
            let is_over = outcome != Outcome::Running
                || time_s > best_s
                || self.over.units + run.work().units > most_units;
            let is_enough = run.work().units > before + UNITS_PER_SLICE;
            if is_over {
                self.over += run.work();
                if outcome == Outcome::Solved {
                    self.take(scene, solver, run.transfers(), time_s);
                }
                return true;
            }
            if is_enough {
                break;
            }
        }
        self.running = Some(run);
        true
    }

    /// The run of the next method, if there is time for it. There is no need of it where the best plan
    /// so far takes little longer than its moves alone in a good order, or if the first run that was
    /// solved came to the same: waiting for more would only delay it.
    fn next(
        &mut self,
        begin: BeginRollout,
        scene: &Scene,
        settings: &Settings,
        solver: &mut Solver,
        most_units: u64,
    ) -> Option<Box<dyn Rollout>> {
        let method = *Method::PAPERS.get(self.begun)?;
        let left = (Method::PAPERS.len() - self.begun) as u64;
        let ticks = (solver.best_s()? * 1e9) as u64 / settings.tick_ns.max(1);
        let least_units = ticks * scene.homes.len() as u64 * UNITS_PER_ROBOT_AND_TICK;
        let is_affordable = self.over.units + left * least_units <= most_units;
        if self.is_matched || !is_affordable || !solver.is_roundabout(ROUNDABOUT) {
            return None;
        }
        self.begun += 1;
        let settings = settings.clone();
        Some(begin(scene, &Settings { method, ..settings }))
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

    /// For how long better plans are looked for before anybody moves at most, s.
    pub(super) fn catching_up_s(&self) -> f64 {
        if self.least_s.is_finite() {
            (self.least_s * CATCHING_UP).min(MOST_CATCHING_UP_S)
        } else {
            0.0
        }
    }

    /// Whether the plan takes clearly longer than one of the runs did.
    pub(super) fn lags(&self, solver: &Solver) -> bool {
        let best_s = solver.best_s();
        best_s.is_some_and(|best_s| best_s > self.least_s * (1.0 + LAG))
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use scene::GenerateOptions;

    use super::*;
    use crate::anytime::situation::Situation;
    use crate::anytime::solver::testing::{cells, planned, solver_of};

    /// A run that is solved after so many ticks, if ever, at so many units a tick.
    #[derive(Clone, Default)]
    struct Told {
        ticks: u64,
        solved_after: Option<u64>,
        units_per_tick: u64,
        transfers: Vec<Transfer>,
    }

    impl Rollout for Told {
        fn tick(&mut self) -> Outcome {
            self.ticks += 1;
            match self.solved_after {
                Some(last) if self.ticks >= last => Outcome::Solved,
                _ => Outcome::Running,
            }
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
            &self.transfers
        }
    }

    thread_local! {
        /// The run that every method comes to.
        static TOLD: RefCell<Told> = RefCell::default();
    }

    fn begin(_: &Scene, _: &Settings) -> Box<dyn Rollout> {
        Box::new(TOLD.with_borrow(Clone::clone))
    }

    /// Carries out runs that all come to this.
    fn carry_out(
        told: Told,
        settings: &Settings,
        (scene, solver): &mut (Scene, Solver),
    ) -> Rollouts {
        TOLD.set(told);
        let mut rollouts = Rollouts::new(Some(begin));
        while rollouts.advance(scene, settings, solver) {}
        rollouts
    }

    /// A room with a first plan like this.
    fn room(mut is_wanted: impl FnMut(&Scene, &mut Solver) -> bool) -> (Scene, Solver) {
        let mut rooms = (0..).filter_map(|seed| {
            let (scene, mut solver, _) = planned(&GenerateOptions {
                seed,
                crowding: 0.8,
                ..GenerateOptions::default()
            });
            is_wanted(&scene, &mut solver).then_some((scene, solver))
        });
        rooms.next().unwrap()
    }

    fn is_poor(solver: &mut Solver) -> bool {
        solver.is_roundabout(ROUNDABOUT)
    }

    const ENDLESS: Told = Told {
        ticks: 0,
        solved_after: None,
        units_per_tick: 1,
        transfers: Vec::new(),
    };

    fn ticks(time_s: f64) -> u64 {
        (time_s * 1e9) as u64 / Settings::default().tick_ns
    }

    #[test]
    fn each_method_has_its_turn_until_it_takes_longer_than_the_plan() {
        let mut room = room(|_, solver| is_poor(solver));
        let rollouts = carry_out(ENDLESS, &Settings::default(), &mut room);
        assert_eq!(rollouts.begun, Method::PAPERS.len());
        let each = ticks(room.1.best_s().unwrap()) + 1;
        assert_eq!(rollouts.work().units, rollouts.begun as u64 * each);
    }

    #[test]
    fn no_run_is_begun_where_the_plan_takes_little_longer_than_its_moves() {
        let mut room = room(|_, solver| !is_poor(solver));
        let rollouts = carry_out(ENDLESS, &Settings::default(), &mut room);
        assert_eq!(rollouts.begun, 0);
    }

    #[test]
    fn runs_that_would_take_too_long_are_given_up_or_not_begun() {
        let mut room = room(|_, solver| is_poor(solver));
        let settings = Settings::default();
        let costly = Told {
            units_per_tick: 1_000_000,
            ..ENDLESS
        };
        let rollouts = carry_out(costly, &settings, &mut room);
        let most_s = MOST_S.min(room.1.best_s().unwrap() * MOST_SHARE);
        let most = (most_s * settings.units_per_second as f64) as u64;
        let units = rollouts.work().units;
        assert!(units > most && units - 1_000_000 <= most);
        assert!(rollouts.begun < Method::PAPERS.len());
        let slow = Settings {
            units_per_second: 1_000,
            ..settings
        };
        assert_eq!(carry_out(ENDLESS, &slow, &mut room).begun, 0);
    }

    /// The transfers of the best plan; none if something is set aside in it.
    fn transfers(solver: &Solver) -> Option<Vec<Transfer>> {
        let (hops, order) = solver.best.as_ref()?.source.as_ref()?;
        let once = hops.of.iter().all(|(first, end)| end - first <= 1);
        let made = |&(object, robot): &(u32, u32)| Transfer {
            object,
            robot,
            grasp: 0,
        };
        once.then(|| order.iter().map(made).collect())
    }

    /// Robots that are parked in the way go home again at no limit.
    #[test]
    fn a_plan_that_is_no_better_is_not_kept_though_its_moves_are_made_in_time() {
        let scene = cells(&["1.AB.a", "##.###"]);
        let mut solver = solver_of(&scene);
        solver.first(&scene, 0).unwrap();
        let made = transfers(&solver).unwrap();
        let best = &mut solver.best.as_mut().unwrap().makespan;
        *best -= 1;
        let best = *best;
        solver.follow(&scene, &made, 0.0);
        assert_eq!(solver.best.unwrap().makespan, best);
    }

    #[test]
    fn what_robots_grasp_in_a_run_is_followed_if_it_is_better() {
        let again = |scene: &Scene| {
            let situation = Situation::at_start(scene);
            let mut solver = Solver::new(scene, &Settings::default(), &situation).unwrap();
            solver.first(scene, 0).unwrap();
            solver
        };
        let (mut first, mut better) = (None, None);
        let (scene, solver) = room(|scene, solver| {
            first = transfers(solver);
            if first.is_none() || !is_poor(solver) {
                return false;
            }
            let mut improved = again(scene);
            let enough_s = 0.9 * solver.best_s().unwrap();
            better = (0..300).find_map(|_| {
                improved.improve(scene);
                let is_better = improved.best_s().unwrap() < enough_s;
                transfers(&improved).filter(|_| is_better)
            });
            better.is_some()
        });
        let (first, first_s) = (first.unwrap(), solver.best_s().unwrap());
        let again = || (scene.clone(), again(&scene));
        let told = |solved_s: f64, transfers| Told {
            solved_after: Some(ticks(solved_s)),
            transfers,
            ..ENDLESS
        };
        let settings = Settings::default();

        // A better order is taken over.
        let mut taken = again();
        let by_better = told(0.9 * first_s, better.unwrap());
        carry_out(by_better, &settings, &mut taken);
        assert!(taken.1.best_s().unwrap() < first_s);

        // A worse one is not, though its run is said to be quick; the plan lags behind that.
        let mut kept = again();
        let by_one: Vec<Transfer> = (first.iter())
            .map(|made| Transfer { robot: 0, ..*made })
            .collect();
        let rollouts = carry_out(told(0.5 * first_s, by_one), &settings, &mut kept);
        assert_eq!(kept.1.best_s(), Some(first_s));
        assert!(rollouts.lags(&kept.1));
        let up_to_s = rollouts.catching_up_s();
        assert!(up_to_s > 0.0 && up_to_s <= MOST_CATCHING_UP_S);

        // One that comes to the same is enough.
        let rollouts = carry_out(told(first_s, first), &settings, &mut again());
        assert_eq!(rollouts.begun, 1);
        assert!(rollouts.is_matched && !rollouts.lags(&kept.1));
    }
}
