//! In which order objects can move at all, one after the other, and which of them have to wait
//! somewhere in between.
//!
//! Responsible for: a list of moves, each of which has an approach from a home, a transfer and a way
//! back home among all other objects as they stand then; intermediate places.
//! Not responsible for: robots in each other's way, time (`plan`).
//!
//! How: depth first over arrangements. Whatever can go to its goal goes there. If nothing can, the
//! cheapest way of an object *through* others (rule 29) tells which of these to set aside, and
//! they go to the nearest place from which they hinder neither that way nor a goal.
//!
//! Terms: an *arrangement* says where each object stands.

mod floods;

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet, VecDeque};
use std::rc::Rc;

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::{Event, ROBOT_ALONE, Scene, UserOrder};

use crate::anytime::ground::Ground;
use crate::anytime::track::Place;
use crate::frontier::NOWHERE;

/// Floods of the first attempts; later ones may take more.
const FLOODS_PER_ATTEMPT: u64 = 2_000;
/// Stuck objects for which others are set aside, in one arrangement.
const STUCK_LOOKED_AT: usize = 4;
/// Intermediate places tried for one object in one arrangement.
const PLACES_TRIED: usize = 3;
/// Places looked at until that many are found.
const PLACES_LOOKED_AT: usize = 400;
/// The same for each object, where that is more: three are needed to move one.
const FLOODS_PER_OBJECT: u64 = 12;
/// What a step through an object costs, in steps.
const PRICE: u32 = 40;

/// A move of a sequence: an object, and where it goes.
pub(crate) type Step = (usize, Rc<Place>);

/// Looks for sequences.
pub(crate) struct Sequencer {
    homes: Vec<u32>,
    goals: Vec<Option<Rc<Place>>>,
    /// The user's own order.
    before: Vec<UserOrder>,
    /// Where objects are at the start.
    start: Vec<Rc<Place>>,
    /// Blocked in this round, by cell.
    blocked: Vec<u32>,
    seen: Vec<u32>,
    from: Vec<u32>,
    round: u32,
    queue: VecDeque<u32>,
    /// Points to look at from either end of a way, the one nearest to the other end first.
    ahead: [BinaryHeap<(Reverse<i32>, u32)>; 2],
    visited: HashSet<Vec<u32>>,
    random: ChaCha8Rng,
    /// Whether objects are tried in the order of dice.
    is_shuffled: bool,
    most_floods: u64,
    /// How many objects are not at their goals after these steps; the fewest so far.
    most: Option<(usize, Vec<Step>)>,
    pub(crate) floods: u64,
    /// Lattice points looked at.
    pub(crate) cells: u64,
}

/// What the way of a stuck object would be without those it crosses.
struct Crossing {
    /// Class of the robot with the object.
    class: usize,
    crossed: Vec<usize>,
    /// Cells of the robot on its approach and way back, and of the robot with the object.
    alone: Vec<u32>,
    carrying: Vec<u32>,
}

impl Sequencer {
    pub(crate) fn new(
        scene: &Scene,
        ground: &Ground,
        homes: &[u32],
        goals: &[Option<Rc<Place>>],
    ) -> Self {
        let points = ground.points();
        Self {
            homes: homes.to_vec(),
            goals: goals.to_vec(),
            before: scene.before.clone(),
            start: Vec::new(),
            blocked: vec![0; points],
            seen: vec![0; points],
            from: vec![0; points],
            round: 0,
            queue: VecDeque::new(),
            ahead: Default::default(),
            visited: HashSet::new(),
            random: ChaCha8Rng::seed_from_u64(7),
            is_shuffled: false,
            most_floods: 0,
            most: None,
            floods: 0,
            cells: 0,
        }
    }

    /// Other goals.
    pub(crate) fn aim(&mut self, goals: Vec<Option<Rc<Place>>>) {
        self.goals = goals;
    }

    /// A sequence that leads from these places to the goals. Another attempt rolls other dice, and
    /// takes longer.
    pub(crate) fn find(
        &mut self,
        scene: &Scene,
        ground: &Ground,
        start: &[Rc<Place>],
        attempt: u64,
    ) -> Option<Vec<Step>> {
        self.start = start.to_vec();
        self.is_shuffled = attempt > 0;
        let least = FLOODS_PER_ATTEMPT.max(FLOODS_PER_OBJECT * start.len() as u64);
        self.most_floods = self.floods + least * (1 + attempt / 8);
        for asides in [0, 1, 2, 4, start.len() + 4] {
            self.visited.clear();
            let mut places = start.to_vec();
            let mut steps = Vec::new();
            if self.search(scene, ground, &mut places, &mut steps, asides) {
                return Some(steps);
            }
        }
        None
    }

    /// The sequence with which most objects got to their goals, of all that were looked at.
    pub(crate) fn most(&self) -> Vec<Step> {
        self.most
            .as_ref()
            .map(|(_, steps)| steps.clone())
            .unwrap_or_default()
    }

    fn search(
        &mut self,
        scene: &Scene,
        ground: &Ground,
        places: &mut [Rc<Place>],
        steps: &mut Vec<Step>,
        asides: usize,
    ) -> bool {
        let mut open: Vec<usize> = (0..places.len())
            .filter(|&object| !self.is_at_goal(object, places))
            .collect();
        if self.is_shuffled {
            open.shuffle(&mut self.random);
        } else if let Some(&(last, _)) = steps.last() {
            // Those before the one moved last could not move a moment ago.
            let after = open.partition_point(|&object| object <= last);
            open.rotate_left(after);
        }
        let missing = open
            .iter()
            .filter(|&&object| self.goals[object].is_some())
            .count();
        if (self.most.as_ref()).is_none_or(|(fewest, _)| missing < *fewest) {
            self.most = Some((missing, steps.clone()));
        }
        if open.is_empty() {
            return true;
        }
        let mut key: Vec<u32> = (places.iter())
            .flat_map(|place| place.grasps.iter().copied())
            .collect();
        key.push(asides as u32);
        if self.floods > self.most_floods || !self.visited.insert(key) {
            return false;
        }
        for &object in &open {
            let Some(goal) = self.goals[object].clone() else {
                continue;
            };
            if self.is_early(places, object, Event::Finish) {
                continue;
            }
            for by in 0..ground.grasps(object) {
                let goal = goal.held(by);
                if self.can_move(ground, places, object, &goal)
                    && self.try_step(scene, ground, places, steps, (object, goal), asides)
                {
                    return true;
                }
            }
        }
        let Some(fewer) = asides.checked_sub(1) else {
            return false;
        };
        for &object in open.iter().take(STUCK_LOOKED_AT) {
            for place in self.regrasps(scene, ground, places, object) {
                if self.try_step(scene, ground, places, steps, (object, place), fewer) {
                    return true;
                }
            }
        }
        let stuck = open.iter().take(STUCK_LOOKED_AT);
        for (object, by) in
            stuck.flat_map(|&object| (0..ground.grasps(object)).map(move |by| (object, by)))
        {
            let Some(crossing) = self.crossing(ground, places, object, by) else {
                continue;
            };
            // What is to be set aside may itself be shut in.
            let mut crossed = crossing.crossed.clone();
            for &aside in &crossing.crossed {
                let homes = self.homes.clone();
                let Some(grasp) = places[aside].open_grasps().next() else {
                    continue;
                };
                let alone = ROBOT_ALONE.0;
                self.cheapest(ground, places, aside, alone, &homes, grasp, &mut crossed);
            }
            crossed.dedup();
            if self.is_shuffled {
                crossed.shuffle(&mut self.random);
            }
            for &aside in &crossed {
                for place in self.all_asides(scene, ground, places, aside, &crossing) {
                    if self.try_step(scene, ground, places, steps, (aside, place), fewer) {
                        return true;
                    }
                }
            }
        }
        false
    }

    fn try_step(
        &mut self,
        scene: &Scene,
        ground: &Ground,
        places: &mut [Rc<Place>],
        steps: &mut Vec<Step>,
        (object, to): Step,
        asides: usize,
    ) -> bool {
        let before = std::mem::replace(&mut places[object], Rc::clone(&to));
        steps.push((object, to));
        let done = self.search(scene, ground, places, steps, asides);
        if !done {
            places[object] = before;
            steps.pop();
        }
        done
    }

    /// Whether the user's order wants something else done before an object is grasped, or
    /// finished, which comes after that.
    fn is_early(&self, places: &[Rc<Place>], object: usize, event: Event) -> bool {
        self.before.iter().any(|order| {
            let (then, of) = order.then;
            let (first, done) = order.first;
            let concerns = then == object && (of == event || of != Event::Finish);
            let has_moved = self.is_at_goal(first, places)
                || (self.start[first].at - places[first].at).norm() > scene::CONTACT_M;
            let is_done = match done {
                Event::Start | Event::Grasp => has_moved,
                Event::Finish => self.is_at_goal(first, places),
            };
            concerns && !is_done
        })
    }

    fn is_at_goal(&self, object: usize, places: &[Rc<Place>]) -> bool {
        self.goals[object]
            .as_ref()
            .is_none_or(|goal| (goal.at - places[object].at).norm() <= scene::CONTACT_M)
    }

    /// Whether an object can be fetched, brought there and left, with the others as they are.
    fn can_move(
        &mut self,
        ground: &Ground,
        places: &[Rc<Place>],
        object: usize,
        to: &Place,
    ) -> bool {
        let from = places[object].held(to.by);
        if from.grasp == NOWHERE || to.grasp == NOWHERE {
            return false;
        }
        let carrying = ground.carrying(object, to.by);
        self.block(ground, places, object, carrying);
        if !self.finds(ground, carrying, from.grasp, to.grasp) {
            return false;
        }
        // Somebody has to come from a home and get back to it: the nearest one is tried first.
        let far = |home: &&u32| {
            let (dx, dy) = ground.offset(**home, from.grasp);
            dx.abs() + dy.abs()
        };
        let Some(nearest) = self.homes.iter().min_by_key(far).copied() else {
            return false;
        };
        let mut is_near = true;
        for place in [&*from, to] {
            self.block(ground, places, object, ROBOT_ALONE.0);
            self.block_cells(&place.bare);
            is_near = is_near && self.finds(ground, ROBOT_ALONE.0, place.grasp, nearest);
        }
        if is_near {
            return true;
        }
        let homes = std::mem::take(&mut self.homes);
        let mut open: Vec<u32> = homes.clone();
        for place in [&*from, to] {
            self.block(ground, places, object, ROBOT_ALONE.0);
            self.block_cells(&place.bare);
            self.reaches(ground, ROBOT_ALONE.0, &[place.grasp], &[]);
            open.retain(|&home| self.seen[home as usize] == self.mark(0));
            if open.is_empty() {
                break;
            }
        }
        self.homes = homes;
        !open.is_empty()
    }

    /// The cheapest way of a stuck object through others, held by one of its grasps.
    fn crossing(
        &mut self,
        ground: &Ground,
        places: &[Rc<Place>],
        object: usize,
        by: u8,
    ) -> Option<Crossing> {
        let goal = self.goals[object].as_ref()?.held(by);
        let from = places[object].held(by);
        if from.grasp == NOWHERE || goal.grasp == NOWHERE {
            return None;
        }
        let class = ground.carrying(object, by);
        let homes = self.homes.clone();
        let mut crossed = Vec::new();
        let carrying = self.cheapest(
            ground,
            places,
            object,
            class,
            &[from.grasp],
            goal.grasp,
            &mut crossed,
        )?;
        let alone = ROBOT_ALONE.0;
        let mut ways = self.cheapest(
            ground,
            places,
            object,
            alone,
            &homes,
            from.grasp,
            &mut crossed,
        )?;
        ways.extend(self.cheapest(
            ground,
            places,
            object,
            alone,
            &homes,
            goal.grasp,
            &mut crossed,
        )?);
        crossed.sort_unstable();
        crossed.dedup();
        Some(Crossing {
            class,
            crossed,
            alone: ways,
            carrying,
        })
    }

    /// Places to which an object can be set aside by any of its grasps.
    fn all_asides(
        &mut self,
        scene: &Scene,
        ground: &Ground,
        places: &[Rc<Place>],
        aside: usize,
        crossing: &Crossing,
    ) -> Vec<Rc<Place>> {
        (0..ground.grasps(aside))
            .flat_map(|by| self.asides(scene, ground, places, (aside, by), crossing, None))
            .collect()
    }

    /// Places at which an object can be put down, to be grasped otherwise and brought to its goal.
    fn regrasps(
        &mut self,
        scene: &Scene,
        ground: &Ground,
        places: &[Rc<Place>],
        object: usize,
    ) -> Vec<Rc<Place>> {
        let Some(goal) = self.goals[object].clone() else {
            return Vec::new();
        };
        if ground.grasps(object) == 1 || self.is_early(places, object, Event::Finish) {
            return Vec::new();
        }
        let nothing = Crossing {
            class: ROBOT_ALONE.0,
            crossed: Vec::new(),
            alone: Vec::new(),
            carrying: Vec::new(),
        };
        (0..ground.grasps(object))
            .flat_map(|by| self.asides(scene, ground, places, (object, by), &nothing, Some(&goal)))
            .collect()
    }

    /// Whether an object can be brought on from a place by another grasp than that which brought
    /// it there.
    fn leads_on(
        &mut self,
        ground: &Ground,
        places: &[Rc<Place>],
        object: usize,
        place: &Rc<Place>,
        goal: &Rc<Place>,
    ) -> bool {
        let mut then = places.to_vec();
        then[object] = Rc::clone(place);
        (0..ground.grasps(object))
            .filter(|&by| by != place.by)
            .any(|by| self.can_move(ground, &then, object, &goal.held(by)))
    }

    /// Places to which an object, held by one of its grasps, can be set aside, so that it hinders
    /// neither a way nor a goal.
    fn asides(
        &mut self,
        scene: &Scene,
        ground: &Ground,
        places: &[Rc<Place>],
        (aside, by): (usize, u8),
        crossing: &Crossing,
        onward: Option<&Rc<Place>>,
    ) -> Vec<Rc<Place>> {
        let class = ground.carrying(aside, by);
        let from = places[aside].held(by);
        if from.grasp == NOWHERE || self.is_early(places, aside, Event::Grasp) {
            return Vec::new();
        }
        // Everything it can be brought to, nearest first.
        self.block(ground, places, aside, class);
        self.reaches(ground, class, &[from.grasp], &[]);
        let reached_now = self.mark(0);
        let mut reached: Vec<u32> = Vec::new();
        let mut near = VecDeque::from([from.grasp]);
        let mut listed = vec![false; ground.points()];
        listed[from.grasp as usize] = true;
        while let Some(cell) = near.pop_front() {
            reached.push(cell);
            for direction in 0..4 {
                let next = cell.wrapping_add_signed(ground.offsets[direction]);
                let within = (next as usize) < listed.len();
                if within && self.seen[next as usize] == reached_now && !listed[next as usize] {
                    listed[next as usize] = true;
                    near.push_back(next);
                }
            }
        }
        let stride = (reached.len() / PLACES_LOOKED_AT).max(1);
        let mut found = Vec::new();
        for with_goals in [true, false] {
            let skipped = if self.is_shuffled {
                self.random.random_range(0..reached.len())
            } else {
                0
            };
            let from_there = reached.iter().skip(skipped);
            for &cell in from_there.chain(&reached[..skipped]).step_by(stride) {
                if found.len() >= PLACES_TRIED || self.floods > self.most_floods {
                    return found;
                }
                let grasp = scene.objects[aside].grasps[usize::from(by)].offset;
                let at = scene.lattice.at(cell) - grasp;
                let place = Place::of(scene, ground, aside, at).held(by);
                if place.grasp != NOWHERE
                    && self.is_clear(ground, places, aside, &place, crossing, with_goals)
                    && self.can_move(ground, places, aside, &place)
                    && onward.is_none_or(|goal| self.leads_on(ground, places, aside, &place, goal))
                {
                    found.push(place);
                }
            }
            if !found.is_empty() {
                break;
            }
        }
        found
    }

    /// Whether an object at a place hinders neither the way of the stuck one nor, if asked, goals.
    fn is_clear(
        &self,
        ground: &Ground,
        places: &[Rc<Place>],
        aside: usize,
        place: &Place,
        crossing: &Crossing,
        with_goals: bool,
    ) -> bool {
        let free = |class: usize, cells: &[u32]| {
            cells
                .iter()
                .all(|cell| place.cells[class].binary_search(cell).is_err())
        };
        let ways = free(crossing.class, &crossing.carrying)
            && free(ROBOT_ALONE.0, &crossing.alone)
            && free(ROBOT_ALONE.0, &self.homes);
        let goals = !with_goals
            || (0..places.len()).all(|other| {
                let reached = |goal: &Rc<Place>| {
                    let grasps = goal.grasps.iter().zip(0..);
                    let mut grasps = grasps.map(|(&cell, by)| (ground.carrying(other, by), cell));
                    grasps.any(|(class, cell)| free(class, &[cell]))
                };
                other == aside || self.goals[other].as_ref().is_none_or(reached)
            });
        ways && goals
    }
}
