//! Making a plan better: which order is tried next.
//!
//! Responsible for: orders near the best one, orders from far away that promise most.
//! Not responsible for: how long an order takes (`plan`), the plan itself (`solver`).
//!
//! How: both take turns. Where robots hardly meet, the time that an order takes with the walls alone
//! tells good ones from bad ones; where they do, only trying does.

use rand::RngExt;
use scene::Scene;

use crate::anytime::ground::Time;
use crate::anytime::order::{Hops, Item, change};
use crate::anytime::solver::Solver;

/// Orders looked at for each one nearby that is tried.
const LOOKED_AT: usize = 64;
/// Orders looked at on a way downhill from one far away.
const DESCENT: usize = 400;
/// The first of these, which lead there.
const WANDERING: usize = 30;
/// How often in a row nothing may be left to try near the best order until that counts as all.
const MOST_MISSES: u32 = 30;

impl Solver {
    /// Tries one more order. False if nothing near the best one is left to try.
    pub(crate) fn improve(&mut self, scene: &Scene) -> bool {
        let Some(hops) = self.hops.take() else {
            return false;
        };
        let goes_on = self.improve_with(scene, &hops);
        self.hops = Some(hops);
        goes_on
    }

    fn improve_with(&mut self, scene: &Scene, hops: &Hops) -> bool {
        let Some(best) = self.best.as_ref().map(|best| best.makespan) else {
            return false;
        };
        self.turn += 1;
        let chosen = if self.turn % 2 == 1 {
            self.descend(hops, best)
        } else {
            self.reorder(hops, best)
        };
        let Some(near) = chosen else {
            self.misses += 1;
            self.go_back();
            return self.misses < MOST_MISSES;
        };
        self.misses = 0;
        self.tried.insert(near.clone());
        // A little worse is good enough to go on from: what is better may lie behind it.
        let limit = best + best / 32;
        if let Some(makespan) = self.decode(scene, hops, &near, limit) {
            self.current.clone_from(&near);
            if makespan < best {
                self.keep(makespan, near);
            }
        } else if self.random.random_range(0..8) == 0 {
            self.go_back();
        }
        true
    }

    /// The order nearby that promises most and was not tried yet.
    fn reorder(&mut self, hops: &Hops, best: Time) -> Option<Vec<Item>> {
        let mut chosen: Option<(Time, Vec<Item>)> = None;
        for attempt in 0..LOOKED_AT {
            let mut near = self.current.clone();
            for _ in 0..=attempt % 4 {
                change(&mut near, self.homes.len(), &mut self.random);
            }
            let Some(least) = hops.least(&near) else {
                continue;
            };
            let is_better = chosen.as_ref().is_none_or(|(known, _)| least < *known);
            if least < best && is_better && !self.tried.contains(&near) {
                chosen = Some((least, near));
            }
        }
        chosen.map(|(_, near)| near)
    }

    /// An order that was not tried yet: from one far away, downhill by the time that orders take
    /// with the walls alone.
    fn descend(&mut self, hops: &Hops, best: Time) -> Option<Vec<Item>> {
        let mut found = self.current.clone();
        let mut known = hops.least(&found)?;
        for step in 0..DESCENT {
            let mut near = found.clone();
            for _ in 0..=step % 3 {
                change(&mut near, self.homes.len(), &mut self.random);
            }
            if let Some(least) = hops.least(&near)
                && (least <= known || step < WANDERING)
                && !self.tried.contains(&near)
            {
                (found, known) = (near, least);
            }
        }
        (known < best && !self.tried.contains(&found)).then_some(found)
    }

    /// Goes on from the best order.
    fn go_back(&mut self) {
        if let Some(best) = &self.best {
            self.current.clone_from(&best.order);
        }
    }
}
