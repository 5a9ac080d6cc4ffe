//! Making a plan better: which order is tried next.
//!
//! Responsible for: orders near the best one, orders from far away that promise most, orders in
//! which an object is set aside to make way.
//! Not responsible for: how long an order takes (`plan`), the plan itself (`solver`).
//!
//! How: the three take turns. Where robots hardly meet, the time that an order takes with the walls
//! alone tells good ones from bad ones; where they do, only trying does. Nothing is tried twice. Once
//! nothing is left, they go on near moves by some other intermediate places, whatever these promise.

use std::rc::Rc;

use rand::RngExt;
use scene::Scene;

use crate::anytime::asides::{ORDERS_LOOKED_AT, vary};
use crate::anytime::ground::Time;
use crate::anytime::order::{Hops, Item, change};
use crate::anytime::solver::{Solver, Source};

/// Orders looked at for each one nearby that is tried.
const LOOKED_AT: usize = 64;
/// Orders looked at on a way downhill from one far away.
const DESCENT: usize = 400;
/// The first of these, which lead there.
const WANDERING: usize = 30;
/// Looking at an order, beyond one for each of its moves, in work units.
const UNITS_PER_ORDER: u64 = 4;
/// Comparing a move with another one, in work units.
const UNITS_PER_PAIR: usize = 4;
/// Intermediate places by which moves far away differ from those of the best order, at most.
const MOST_STRAYED: u32 = 3;
/// How often in a row nothing may be left to try near the best order until that counts as all.
const MOST_MISSES: u32 = 300;

impl Solver {
    /// Tries one more order. False if nothing near the best one is left to try.
    pub(crate) fn improve(&mut self, scene: &Scene) -> bool {
        let (Some(best), Some((hops, order))) = (&self.best, self.current.clone()) else {
            return false;
        };
        let best = best.makespan;
        self.turn += 1;
        let chosen = match self.turn % 3 {
            // That of the first plan itself, whose ways were looked for in haste, or one strayed to.
            _ if self.tried.insert(&hops, &order) => Some((hops, order)),
            0 => self.set_aside(scene, &hops, &order, best),
            1 => self.descend(hops, &order, best),
            _ => self.reorder(hops, &order, best),
        };
        let Some((hops, near)) = chosen else {
            self.misses += 1;
            self.stray(scene);
            return self.misses < MOST_MISSES;
        };
        self.misses = 0;
        if let Some(makespan) = self.decode(scene, &hops, &near, worst(best)) {
            self.current = Some((hops, near));
            if makespan < best {
                let source = self.current.clone();
                self.keep(makespan, source);
            }
        } else if self.random.random_range(0..8) == 0 {
            self.go_back();
        }
        true
    }

    /// The order near another one that promises most and was not tried yet.
    fn reorder(&mut self, hops: Rc<Hops>, order: &[Item], best: Time) -> Option<Source> {
        self.weigh(&hops, LOOKED_AT);
        let mut chosen: Option<(Time, Vec<Item>)> = None;
        for attempt in 0..LOOKED_AT {
            let mut near = order.to_vec();
            for _ in 0..=attempt % 4 {
                change(&mut near, self.homes.len(), &mut self.random);
            }
            let Some(least) = hops.least(&near) else {
                continue;
            };
            let is_better = chosen.as_ref().is_none_or(|(known, _)| least < *known);
            if least < best && is_better && !self.is_hopeless(&hops, &near, best) {
                chosen = Some((least, near));
            }
        }
        let (_, near) = chosen?;
        self.tried.insert(&hops, &near);
        Some((hops, near))
    }

    /// An order that was not tried yet: from one far away, downhill by the time that orders take
    /// with the walls alone.
    fn descend(&mut self, hops: Rc<Hops>, order: &[Item], best: Time) -> Option<Source> {
        self.weigh(&hops, DESCENT);
        let mut found = order.to_vec();
        let mut known = hops.least(&found)?;
        for step in 0..DESCENT {
            let mut near = found.clone();
            for _ in 0..=step % 3 {
                change(&mut near, self.homes.len(), &mut self.random);
            }
            if let Some(least) = hops.least(&near)
                && (least <= known || step < WANDERING)
                && !self.is_hopeless(&hops, &near, best)
            {
                (found, known) = (near, least);
            }
        }
        let is_new = known < best && self.tried.insert(&hops, &found);
        is_new.then_some((hops, found))
    }

    /// An order with another intermediate place.
    fn set_aside(
        &mut self,
        scene: &Scene,
        hops: &Hops,
        order: &[Item],
        best: Time,
    ) -> Option<Source> {
        let (hops, order) = self.vary(scene, hops, order)?;
        let promises = hops.least(&order)? < best
            && !self.is_hopeless(&hops, &order, best)
            && self.tried.insert(&hops, &order);
        promises.then_some((hops, order))
    }

    /// Goes on from moves like those of the best order but for a few intermediate places, whatever
    /// they promise.
    fn stray(&mut self, scene: &Scene) {
        self.go_back();
        for _ in 0..self.random.random_range(0..=MOST_STRAYED) {
            let Some((hops, order)) = self.current.clone() else {
                return;
            };
            self.current = self.vary(scene, &hops, &order).or(Some((hops, order)));
        }
    }

    /// Moves and an order like these but for an intermediate place.
    fn vary(&mut self, scene: &Scene, hops: &Hops, order: &[Item]) -> Option<Source> {
        // Its moves are compared with each other anew.
        self.weigh(hops, ORDERS_LOOKED_AT + UNITS_PER_PAIR * hops.list.len());
        let (ground, start, homes) = (&mut self.ground, &self.start, &self.homes);
        let near = (hops, order);
        let (hops, order) = vary(scene, ground, start, homes, near, &mut self.random)?;
        Some((Rc::new(hops), order))
    }

    /// Whether an order was tried before, or is known to lead nowhere.
    fn is_hopeless(&self, hops: &Hops, order: &[Item], best: Time) -> bool {
        self.tried.has(hops, order, worst(best)) || self.cuts.forbid(hops, order)
    }

    /// Pays for looking at so many orders.
    fn weigh(&mut self, hops: &Hops, orders: usize) {
        self.weighing += orders as u64 * (hops.list.len() as u64 + UNITS_PER_ORDER);
    }

    /// Goes on from the best order.
    fn go_back(&mut self) {
        if let Some(best) = &self.best {
            self.current.clone_from(&best.source);
        }
    }
}

/// A little worse than the best is good enough to go on from: what is better may lie behind it.
const fn worst(best: Time) -> Time {
    best + best / 32
}

#[cfg(test)]
mod tests {
    use scene::{GenerateOptions, Vec2};

    use crate::anytime::order::Hops;
    use crate::anytime::solver::testing::planned;
    use crate::{BoundLimits, Bounds};

    #[test]
    fn setting_aside_what_nobody_has_to_move_can_beat_moving_each_object_once() {
        let is_beaten = (11..35).any(|seed| {
            let options = GenerateOptions {
                seed,
                area_m2: 41.5,
                walls: 4,
                robots: 2,
                ..GenerateOptions::default()
            };
            let (scene, mut solver, _) = planned(&options);
            let bounds = Bounds::of(&scene, BoundLimits::default()).unwrap();
            let r_s = bounds.r_s().unwrap();
            for _ in 0..600 {
                solver.improve(&scene);
            }
            let found = solver.best.as_ref().unwrap().makespan;
            let found_s = solver.ground.seconds(found);
            assert!(found_s > bounds.best_s(), "no plan is below the bound");
            found_s < r_s
        });
        assert!(is_beaten);
    }

    /// By object that is moved, where it is in the end.
    fn ends(hops: &Hops) -> impl Iterator<Item = (usize, Vec2)> {
        let lasts = hops.of.iter().filter(|(first, end)| first < end);
        lasts.map(|&(_, end)| (hops.list[end - 1].object, hops.list[end - 1].to.at))
    }

    #[test]
    fn straying_leads_by_other_intermediate_places_to_the_same_ends() {
        let mut most = 0;
        for seed in 0..6 {
            let (scene, mut solver, best) = planned(&GenerateOptions {
                seed,
                crowding: 0.8,
                ..GenerateOptions::default()
            });
            let (hops, _) = solver.current.clone().unwrap();
            for _ in 0..50 {
                solver.stray(&scene);
                let (strayed, order) = solver.current.clone().unwrap();
                assert_eq!(strayed.list.len(), order.len());
                assert!(ends(&hops).eq(ends(&strayed)));
                most = most.max(strayed.list.len().saturating_sub(hops.list.len()));
            }
            assert_eq!(solver.best.unwrap().makespan, best);
        }
        assert!((2..=super::MOST_STRAYED as usize).contains(&most), "{most}");
    }
}
