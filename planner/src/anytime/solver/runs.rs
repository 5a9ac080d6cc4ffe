//! Plans out of runs of other methods.
//!
//! Responsible for: planning for all robots together what they grasped in a run, whether a plan is
//! poor enough to ask for one.
//! Not responsible for: which runs are carried out (`incumbent`).

use std::rc::Rc;

use scene::Scene;

use crate::anytime::ground::EVER;
use crate::anytime::order::{Hops, Item};
use crate::anytime::sequence::Step;
use crate::anytime::solver::{Mode, PATIENT, PLAIN, Solver, Source};
use crate::rollout::Transfer;

/// Orders looked at to know a good one.
const ORDERS_LOOKED_AT: usize = 400;

/// The ways to plan an order that robots carried out in a run. Who had more to do there went on to
/// it, so that nobody made way for robots that go home.
const MODES_OF_RUNS: [Mode; 4] = [
    Mode {
        goes_on: true,
        ..PLAIN
    },
    Mode {
        goes_on: true,
        ..PATIENT
    },
    PLAIN,
    PATIENT,
];

impl Solver {
    /// Plans for these transfers, in turn, and keeps what is better than the best plan. One that takes
    /// no longer than `enough_s` is good enough.
    pub(crate) fn follow(&mut self, scene: &Scene, transfers: &[Transfer], enough_s: f64) {
        let Some((hops, order)) = self.order_of(scene, transfers) else {
            return;
        };
        // What fails in one mode may do in another.
        let tried = std::mem::take(&mut self.tried);
        let mut of_best = self.mode;
        self.plan.grasps_late = true;
        for mode in MODES_OF_RUNS {
            self.mode = mode;
            self.known.clear();
            let best = self.best.as_ref().map_or(EVER, |best| best.makespan);
            let found = self.decode(scene, &hops, &order, best);
            if let Some(makespan) = found.filter(|makespan| *makespan < best) {
                of_best = mode;
                self.current = Some((Rc::clone(&hops), order.clone()));
                let source = self.current.clone();
                self.keep(makespan, source);
            }
            if self.best_s().is_some_and(|best_s| best_s <= enough_s) {
                break;
            }
        }
        self.plan.grasps_late = false;
        self.mode = of_best;
        self.known.clear();
        self.tried = tried;
    }

    /// The moves of these transfers, and their order; none if that is not one in which they can be
    /// made.
    fn order_of(&mut self, scene: &Scene, transfers: &[Transfer]) -> Option<Source> {
        let step = |made: &Transfer| {
            let goal = self.goals[made.object as usize].as_ref()?;
            Some((made.object as usize, goal.held(made.grasp)))
        };
        let sequence: Vec<Step> = transfers.iter().map(step).collect::<Option<_>>()?;
        let (ground, start, homes) = (&mut self.ground, &self.start, &self.homes);
        let hops = Hops::new(scene, ground, start, homes, &sequence)?;
        let items = transfers.iter().map(|made| (made.object, made.robot));
        let order: Vec<Item> = items.collect();
        hops.least(&order)?;
        Some((Rc::new(hops), order))
    }

    /// Whether the plan takes so many times as long as its moves with the walls alone, in a good
    /// order, or moves something twice.
    pub(crate) fn is_roundabout(&mut self, times: f64) -> bool {
        let (Some(best), Some((hops, order))) = (&self.best, &self.current) else {
            return true;
        };
        // What is tried later does not depend on having asked.
        let least = hops.least_nearby(order, ORDERS_LOOKED_AT, &mut self.random.clone());
        self.weighing += ORDERS_LOOKED_AT as u64 * hops.list.len() as u64;
        let is_set_aside = hops.of.iter().any(|(first, end)| first + 1 < *end);
        is_set_aside || f64::from(best.makespan) > f64::from(least) * times
    }
}
