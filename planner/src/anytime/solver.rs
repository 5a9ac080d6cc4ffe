//! The planner of schedules: a first plan, then better ones.
//!
//! Responsible for: what is tried next, and which plan is the best so far.
//! Not responsible for: committing (`plan`), what is published (`publish`).

use std::collections::HashSet;
use std::rc::Rc;

use scene::{Scene, Settings};

use crate::anytime::ground::{EVER, Ground, Time};
use crate::anytime::order::{Hops, Item, Random, change};
use crate::anytime::plan::{Move, Place, Plan, Start};
use crate::anytime::route::Router;
use crate::anytime::sequence::Sequencer;

/// Orders looked at for each one that is tried.
const LOOKED_AT: usize = 64;

/// Makes plans for one scene.
pub(crate) struct Solver {
    pub(crate) ground: Ground,
    router: Router,
    pub(crate) plan: Plan,
    start: Start,
    homes: Vec<u32>,
    sequencer: Sequencer,
    hops: Option<Hops>,
    random: Random,
    pub(crate) best: Option<(Time, Vec<Item>)>,
    tried: HashSet<Vec<Item>>,
    pub(crate) decoded: u64,
    /// Whether the first plan needed parked robots to make room.
    makes_room: bool,
}

impl Solver {
    /// None if the scene's places are not on its lattice.
    pub(crate) fn new(scene: &Scene, settings: &Settings) -> Option<Self> {
        let ground = Ground::new(scene, settings);
        let homes: Option<Vec<u32>> = scene.homes.iter().map(|h| scene.lattice.cell(*h)).collect();
        let homes = homes?;
        let objects: Option<Vec<Rc<Place>>> = (scene.objects.iter().enumerate())
            .map(|(object, spec)| Place::of(scene, &ground, object, spec.start))
            .collect();
        let start = Start {
            robots: homes.clone(),
            objects: objects?,
        };
        let mut goals = Vec::new();
        for (object, spec) in scene.objects.iter().enumerate() {
            goals.push(match spec.goal {
                Some(goal) => Some(Place::of(scene, &ground, object, goal)?),
                None => None,
            });
        }
        Some(Self {
            router: Router::new(&ground),
            plan: Plan::new(&ground, homes.clone()),
            sequencer: Sequencer::new(&ground, &homes, &goals),
            ground,
            start,
            homes,
            hops: None,
            random: Random(1),
            best: None,
            tried: HashSet::new(),
            decoded: 0,
            makes_room: false,
        })
    }

    /// Work done so far, units.
    pub(crate) fn work(&self) -> u64 {
        self.router.expanded + self.ground.counters.cells_expanded + self.sequencer.cells
    }

    /// A first plan: a sequence, then its moves by whoever can make them soonest.
    pub(crate) fn first(&mut self, scene: &Scene) -> Option<Time> {
        let sequence = self
            .sequencer
            .find(scene, &self.ground, &self.start.objects)?;
        let hops = Hops::new(
            scene,
            &mut self.ground,
            &self.start,
            &self.homes,
            &sequence,
        );
        let objects: Vec<u32> = sequence.iter().map(|(object, _)| *object as u32).collect();
        let mut found = self.greedy(scene, &hops, &objects, false);
        self.makes_room = found.is_none();
        if found.is_none() {
            found = self.greedy(scene, &hops, &objects, true);
        }
        self.hops = Some(hops);
        let (makespan, order) = found?;
        self.tried.insert(order.clone());
        self.best = Some((makespan, order));
        Some(makespan)
    }

    /// Commits the moves of a sequence, each by the robot that is done with it soonest: whichever
    /// of them is soonest, or strictly in turn.
    fn greedy(
        &mut self,
        scene: &Scene,
        hops: &Hops,
        sequence: &[u32],
        in_turn: bool,
    ) -> Option<(Time, Vec<Item>)> {
        self.decoded += 1;
        self.plan.begin(&self.ground, &self.start, EVER);
        let mut left = sequence.to_vec();
        let mut order: Vec<Item> = Vec::new();
        while !left.is_empty() {
            let looked_at = if in_turn { 1 } else { left.len() };
            let mut candidates: Vec<(Time, usize, usize)> = Vec::new();
            for (place, &object) in left[..looked_at].iter().enumerate() {
                if left[..place].contains(&object) {
                    continue;
                }
                for robot in 0..self.homes.len() {
                    let done = hops.done_by(&order, object as usize, robot);
                    candidates.extend(done.map(|done| (done, place, robot)));
                }
            }
            candidates.sort_unstable();
            let taken = candidates.into_iter().find(|&(_, place, robot)| {
                self.commit(scene, hops, &order, (left[place], robot as u32), in_turn)
            });
            let (_, place, robot) = taken?;
            order.push((left.remove(place), robot as u32));
        }
        let makespan = self
            .plan
            .send_all_home(&mut self.ground, &mut self.router, scene)?;
        Some((makespan, order))
    }

    /// Commits the next move of an object, after those of `order`.
    fn commit(
        &mut self,
        scene: &Scene,
        hops: &Hops,
        order: &[Item],
        (object, robot): Item,
        makes_room: bool,
    ) -> bool {
        let made = order.iter().filter(|item| item.0 == object).count();
        let hop = &hops.list[hops.of[object as usize].0 + made];
        let wanted = Move {
            robot: robot as usize,
            object: object as usize,
            to: Rc::clone(&hop.to),
        };
        let (plan, ground, router) = (&mut self.plan, &mut self.ground, &mut self.router);
        let done = if makes_room {
            plan.commit_making_room(ground, router, scene, &wanted)
        } else {
            plan.commit(ground, router, scene, &wanted)
        };
        done.is_some()
    }

    /// Carries an order out in the plan; how long it takes, if it can be done within `limit`.
    fn decode(&mut self, scene: &Scene, hops: &Hops, order: &[Item], limit: Time) -> Option<Time> {
        self.decoded += 1;
        self.plan.begin(&self.ground, &self.start, limit);
        for (place, &item) in order.iter().enumerate() {
            if !self.commit(scene, hops, &order[..place], item, self.makes_room) || self.plan.is_past(limit) {
                return None;
            }
        }
        self.plan
            .send_all_home(&mut self.ground, &mut self.router, scene)
    }

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
        let Some((best, order)) = self.best.clone() else {
            return false;
        };
        let mut chosen: Option<(Time, Vec<Item>)> = None;
        for attempt in 0..LOOKED_AT {
            let mut near = order.clone();
            for _ in 0..=attempt % 3 {
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
        let Some((_, near)) = chosen else {
            return false;
        };
        self.tried.insert(near.clone());
        if let Some(makespan) = self.decode(scene, hops, &near, best)
            && makespan < best
        {
            self.best = Some((makespan, near));
        }
        true
    }

    /// Puts the best order into the plan again.
    pub(crate) fn restore(&mut self, scene: &Scene) -> Option<Time> {
        let (_, order) = self.best.clone()?;
        let hops = self.hops.take()?;
        let makespan = self.decode(scene, &hops, &order, EVER);
        self.hops = Some(hops);
        makespan
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    #[test]
    #[ignore = "a look at figures"]
    fn look() {
        for builtin in scene::BUILTIN {
            let all = scene::parse(builtin.text, builtin.name).unwrap();
            for robots in 1..=all.homes.len() {
                let scene = all.with_robots(robots).unwrap();
                let begun = Instant::now();
                let Some(mut solver) = Solver::new(&scene, &Settings::default()) else {
                    println!("{} off the lattice", builtin.name);
                    continue;
                };
                let made = begun.elapsed();
                let first = solver.first(&scene);
                let first_at = begun.elapsed();
                let work = solver.work();
                let mut rounds = 0;
                while rounds < 300 && solver.improve(&scene) {
                    rounds += 1;
                }
                let show = |time: Option<Time>| time.map(|time| solver.ground.seconds(time));
                println!(
                    "{} {robots}: made {made:?} first {:?} at {first_at:?} work {work}, best {:?} after {rounds} {:?} work {}",
                    builtin.name,
                    show(first),
                    show(solver.best.as_ref().map(|b| b.0)),
                    begun.elapsed(),
                    solver.work(),
                );
            }
        }
    }
}
