//! The planner of schedules: a first plan, then better ones.
//!
//! Responsible for: what is tried next, and which plan is the best so far.
//! Not responsible for: committing (`plan`), what is published (`publish`).

use std::collections::HashSet;
use std::rc::Rc;

use scene::{ROBOT_ALONE, Scene, Settings};
use shm_types::Verdict;

use crate::anytime::ground::{EVER, Ground, Time};
use crate::anytime::joint::{Found, Joint, JointMove};
use crate::anytime::order::{Hops, Item, Random, change};
use crate::anytime::plan::{Move, Place, Plan, Start};
use crate::anytime::route::Router;
use crate::anytime::sequence::{Sequencer, Step};
use crate::anytime::{UNITS_PER_CONFIGURATION, UNITS_PER_INTERVAL};

/// Configurations that the complete search looks at in one go.
const CONFIGURATIONS_PER_SLICE: usize = 5_000;
/// Orders looked at for each one that is tried.
const LOOKED_AT: usize = 64;
/// How often in a row nothing may be left to try near the best order until that counts as all.
const MOST_MISSES: u32 = 30;

/// Makes plans for one scene.
pub(crate) struct Solver {
    pub(crate) ground: Ground,
    router: Router,
    pub(crate) plan: Plan,
    start: Start,
    homes: Vec<u32>,
    goals: Vec<Option<Rc<Place>>>,
    sequencer: Sequencer,
    joint: Option<Box<Joint>>,
    /// Configurations that the complete search has seen.
    configurations: u64,
    /// The plan, if it is the complete search's own.
    moves: Option<Vec<(usize, JointMove)>>,
    hops: Option<Hops>,
    random: Random,
    pub(crate) best: Option<(Time, Vec<Item>)>,
    /// Where orders are looked for: near this one.
    current: Vec<Item>,
    /// How often in a row nothing was left to try nearby.
    misses: u32,
    tried: HashSet<Vec<Item>>,
    pub(crate) decoded: u64,
    /// Whether the first plan needed parked robots to make room.
    makes_room: bool,
}

impl Solver {
    /// None if some start, goal or home cannot be joined to the lattice.
    pub(crate) fn new(scene: &Scene, settings: &Settings) -> Option<Self> {
        let ground = Ground::new(scene, settings);
        let homes: Option<Vec<u32>> = (scene.homes.iter())
            .map(|&home| ground.entry(scene, &[ROBOT_ALONE.0], home, &[]))
            .collect();
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
            goals,
            joint: None,
            configurations: 0,
            moves: None,
            hops: None,
            random: Random(1),
            best: None,
            current: Vec::new(),
            misses: 0,
            tried: HashSet::new(),
            decoded: 0,
            makes_room: false,
        })
    }

    /// Cells expanded so far.
    pub(crate) fn cells(&self) -> u64 {
        self.router.expanded + self.ground.counters.cells_expanded + self.sequencer.cells
    }

    /// Ways looked for so far.
    pub(crate) fn ways(&self) -> u64 {
        self.router.searches + self.sequencer.floods
    }

    /// Work done so far, units.
    pub(crate) fn units(&self) -> u64 {
        let floods = self.ground.counters.cells_expanded + self.sequencer.cells;
        self.router.expanded * UNITS_PER_INTERVAL
            + floods
            + self.configurations * UNITS_PER_CONFIGURATION
    }

    /// A first plan: a sequence, then its moves by whoever can make them soonest. Other attempts
    /// find other sequences.
    pub(crate) fn first(&mut self, scene: &Scene, attempt: u64) -> Option<Time> {
        let (ground, objects) = (&self.ground, &self.start.objects);
        let sequence = self.sequencer.find(scene, ground, objects, attempt)?;
        self.begin_with(scene, &sequence)
    }

    /// A first plan out of a sequence.
    fn begin_with(&mut self, scene: &Scene, sequence: &[Step]) -> Option<Time> {
        let hops = Hops::new(scene, &mut self.ground, &self.start, &self.homes, sequence);
        let objects: Vec<u32> = sequence.iter().map(|(object, _)| *object as u32).collect();
        let mut found = self.greedy(scene, &hops, &objects, false);
        self.makes_room = found.is_none();
        if found.is_none() {
            found = self.greedy(scene, &hops, &objects, true);
        }
        self.hops = Some(hops);
        let (makespan, order) = found?;
        self.tried.insert(order.clone());
        self.current.clone_from(&order);
        self.best = Some((makespan, order));
        Some(makespan)
    }

    /// A first plan by the complete search, a slice of it: nothing while it goes on, then whether
    /// there is a plan, or that there is none.
    pub(crate) fn search(&mut self, scene: &Scene) -> Option<Result<Time, Verdict>> {
        let mut joint = match self.joint.take() {
            Some(joint) => joint,
            None => {
                let cells: Vec<u32> = self.start.objects.iter().map(|at| at.grasp).collect();
                let goals: Vec<Option<u32>> = (self.goals.iter())
                    .map(|goal| goal.as_ref().map(|place| place.grasp))
                    .collect();
                let start = (&self.start.robots[..], &cells[..]);
                let homes = &self.homes;
                match Joint::new(scene, &mut self.ground, start, homes, &goals) {
                    Some(joint) => Box::new(joint),
                    None => return Some(Err(Verdict::NotFound)),
                }
            }
        };
        let found = joint.advance(&self.ground, CONFIGURATIONS_PER_SLICE);
        self.configurations = joint.seen() as u64;
        match found {
            Found::Open => {
                self.joint = Some(joint);
                None
            }
            Found::TooMany => Some(Err(Verdict::NotFound)),
            Found::Exhausted => Some(Err(Verdict::Exhausted)),
            Found::Plan(moves) => Some(Ok(self.adopt(scene, moves))),
        }
    }

    /// Takes moves of single robots over: as a sequence that robots may carry out side by side, or
    /// else as they are.
    fn adopt(&mut self, scene: &Scene, moves: Vec<(usize, JointMove)>) -> Time {
        let mut cells = self.start.robots.clone();
        let mut sequence = Vec::new();
        for &(robot, made) in &moves {
            match made {
                JointMove::Step(direction) => {
                    let offset = self.ground.offsets[direction as usize];
                    cells[robot] = cells[robot].wrapping_add_signed(offset);
                }
                JointMove::Grasp(_) => {}
                JointMove::Release(object) => {
                    let object = usize::from(object);
                    let at = scene.lattice.at(cells[robot]) - scene.objects[object].grasp;
                    sequence.extend(
                        Place::of(scene, &self.ground, object, at).map(|place| (object, place)),
                    );
                }
            }
        }
        if let Some(makespan) = self.begin_with(scene, &sequence) {
            return makespan;
        }
        self.plan.replay(&self.ground, &self.start, &moves);
        self.moves = Some(moves);
        self.plan.makespan()
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
            let mut taken = None;
            for leaves_away in [false, true] {
                self.plan.leaves_away = leaves_away;
                taken = taken.or_else(|| {
                    candidates.iter().copied().find(|&(_, place, robot)| {
                        self.commit(scene, hops, &order, (left[place], robot as u32), in_turn)
                    })
                });
            }
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
        self.plan.leaves_away = self.makes_room;
        for (place, &item) in order.iter().enumerate() {
            if !self.commit(scene, hops, &order[..place], item, self.makes_room)
                || self.plan.is_past(limit)
            {
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
        let Some(best) = self.best.as_ref().map(|(best, _)| *best) else {
            return false;
        };
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
        let Some((_, near)) = chosen else {
            self.misses += 1;
            self.current = self.best.clone().map_or_else(Vec::new, |(_, order)| order);
            return self.misses < MOST_MISSES;
        };
        self.misses = 0;
        self.tried.insert(near.clone());
        // A little worse is good enough to go on from: what is better may lie behind it.
        let limit = best + best / 32;
        if let Some(makespan) = self.decode(scene, hops, &near, limit) {
            self.current.clone_from(&near);
            if makespan < best {
                self.best = Some((makespan, near));
            }
        } else if self.random.below(8) == 0 {
            self.current = self.best.clone().map_or_else(Vec::new, |(_, order)| order);
        }
        true
    }

    /// Puts the best order into the plan again.
    pub(crate) fn restore(&mut self, scene: &Scene) -> Option<Time> {
        if let Some(moves) = &self.moves {
            self.plan.replay(&self.ground, &self.start, moves);
            return Some(self.plan.makespan());
        }
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
        let only = std::env::var("ONLY").unwrap_or_default();
        for builtin in scene::BUILTIN.iter().filter(|b| b.name.contains(&only)) {
            let all = scene::parse(builtin.text, builtin.name).unwrap();
            for robots in 1..=all.homes.len() {
                let scene = all.with_robots(robots).unwrap();
                let begun = Instant::now();
                let Some(mut solver) = Solver::new(&scene, &Settings::default()) else {
                    println!("{} off the lattice", builtin.name);
                    continue;
                };
                let made = begun.elapsed();
                let first = (0..20).find_map(|attempt| solver.first(&scene, attempt));
                let first_at = begun.elapsed();
                let work = solver.cells();
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
                    solver.cells(),
                );
            }
        }
    }

    #[test]
    #[ignore = "a look at figures"]
    fn look_at_generated() {
        let mut rooms = 0;
        let mut missed = 0;
        let mut slowest = 0.0_f64;
        for seed in 0..12 {
            for (objects, area_m2) in [(3, 12.0), (5, 17.0), (8, 24.0), (12, 34.0)] {
                for crowding in [0.2, 0.5, 0.9] {
                    for extra_moves in [0, 2] {
                        let robots = 1 + (seed as usize + objects) % 4;
                        if std::env::var("HARD").is_ok() && !(seed == 0 && objects == 3)
                            || crowding > 0.4
                            || extra_moves == 0
                        {
                            continue;
                        }
                        let Ok(room) = scene::generate(&scene::GenerateOptions {
                            seed,
                            objects,
                            robots,
                            area_m2,
                            walls: 3,
                            crowding,
                            extra_moves,
                        }) else {
                            continue;
                        };
                        rooms += 1;
                        let begun = Instant::now();
                        let Some(mut solver) = Solver::new(&room.scene, &Settings::default())
                        else {
                            println!("off the lattice");
                            continue;
                        };
                        let first = (0..40).find_map(|attempt| solver.first(&room.scene, attempt));
                        let took_s = begun.elapsed().as_secs_f64();
                        slowest = slowest.max(took_s);
                        if first.is_none() {
                            missed += 1;
                            println!(
                                "missed: seed {seed} objects {objects} robots {robots} area {area_m2} crowding {crowding} extra {extra_moves}: sequence {} floods {} {took_s:.2} s, certificate of {}",
                                solver.hops.is_some(),
                                solver.sequencer.floods,
                                room.certificate.len(),
                            );
                        }
                    }
                }
            }
        }
        println!("rooms {rooms}, missed {missed}, slowest first {slowest:.2} s");
    }
}
