//! In which order objects can move at all, one after the other, and which of them have to wait
//! somewhere in between.
//!
//! Responsible for: a list of moves, each of which has an approach from a home, a transfer and a way
//! back home among all other objects as they stand then.
//! Not responsible for: robots in each other's way, time (`plan`).
//!
//! How: the first attempt is made depth first (`depth_first`). It sets aside what is seen to be in
//! the way, to the nearest place that is clear of it. That is quick, and misses what has to go far,
//! or before it is in anybody's way. Further attempts look for that from both ends, with dice
//! (`perturb`).
//!
//! Terms: an *arrangement* says where each object stands.

mod depth_first;
mod floods;
mod monotone;
mod perturb;
mod places;
#[cfg(test)]
mod tests;
mod trees;

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet, VecDeque};
use std::rc::Rc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use scene::{CONTACT_M, Event, ROBOT_ALONE, Scene, UserOrder};

use crate::anytime::ground::Ground;
use crate::anytime::sequence::perturb::FIRST_NODES;
use crate::anytime::sequence::trees::Trees;
use crate::anytime::track::Place;
use crate::frontier::NOWHERE;

/// Floods of an attempt.
const FLOODS_PER_ATTEMPT: u64 = 2_000;
/// The same for each object, where that is more: three are needed to move one.
const FLOODS_PER_OBJECT: u64 = 12;
/// What a step through an object costs, in steps.
const PRICE: u32 = 40;

/// A move of a sequence: an object, and where it goes.
pub(crate) type Step = (usize, Rc<Place>);

/// The ways of a move.
#[derive(Clone, Debug, Default)]
struct Ways {
    /// Class of the robot with the object.
    class: usize,
    /// Cells of the robot with the object, and of the robot on its approach and way back.
    carrying: Vec<u32>,
    alone: Vec<u32>,
    /// Whether these are all.
    is_whole: bool,
}

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
    /// The way found last: where its two ends met.
    met: (u32, u32),
    /// The ways of the move that was found possible last.
    ways: Ways,
    /// Arrangements reached by perturbing, to be gone on from.
    trees: Option<Trees>,
    /// How many the next trees may have.
    most_nodes: usize,
    most_floods: u64,
    /// How many objects are not at their goals after these steps; the fewest so far.
    most: Option<(usize, Vec<Step>)>,
    pub(crate) floods: u64,
    /// Lattice points looked at.
    pub(crate) cells: u64,
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
            met: (0, 0),
            ways: Ways::default(),
            trees: None,
            most_nodes: FIRST_NODES,
            most_floods: 0,
            most: None,
            floods: 0,
            cells: 0,
        }
    }

    /// Other goals.
    pub(crate) fn aim(&mut self, goals: Vec<Option<Rc<Place>>>) {
        self.goals = goals;
        self.trees = None;
    }

    /// A sequence that leads from these places to the goals. Another attempt finds another one, or
    /// goes on from where the one before it ended.
    pub(crate) fn find(
        &mut self,
        scene: &Scene,
        ground: &Ground,
        start: &[Rc<Place>],
        attempt: u64,
    ) -> Option<Vec<Step>> {
        self.start = start.to_vec();
        let least = FLOODS_PER_ATTEMPT.max(FLOODS_PER_OBJECT * start.len() as u64);
        self.most_floods = self.floods + least;
        if attempt > 0 {
            return self.perturb(scene, ground);
        }
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

    /// Takes note of steps that leave so many objects elsewhere than at their goals.
    fn note(&mut self, missing: usize, steps: impl FnOnce() -> Vec<Step>) {
        if (self.most.as_ref()).is_none_or(|(fewest, _)| missing < *fewest) {
            self.most = Some((missing, steps()));
        }
    }

    /// The sequence with which most objects got to their goals, of all that were looked at.
    pub(crate) fn most(&self) -> Vec<Step> {
        self.most
            .as_ref()
            .map(|(_, steps)| steps.clone())
            .unwrap_or_default()
    }

    /// Whether the user's order wants something else done before an object is grasped, or
    /// finished, which comes after that.
    fn is_early(&self, places: &[Rc<Place>], object: usize, event: Event) -> bool {
        self.before.iter().any(|order| {
            let (then, of) = order.then;
            let (first, done) = order.first;
            let concerns = then == object && (of == event || of != Event::Finish);
            let has_moved = self.is_at_goal(first, places)
                || (self.start[first].at - places[first].at).norm() > CONTACT_M;
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
            .is_none_or(|goal| (goal.at - places[object].at).norm() <= CONTACT_M)
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
        self.can_move_from(ground, places, object, &from, to)
    }

    /// The same from another place.
    fn can_move_from(
        &mut self,
        ground: &Ground,
        places: &[Rc<Place>],
        object: usize,
        from: &Place,
        to: &Place,
    ) -> bool {
        if from.grasp == NOWHERE || to.grasp == NOWHERE {
            return false;
        }
        let carrying = ground.carrying(object, to.by);
        self.block(ground, places, object, carrying);
        if !self.finds(ground, carrying, from.grasp, to.grasp) {
            return false;
        }
        let mut ways = std::mem::take(&mut self.ways);
        ways.class = carrying;
        ways.carrying.clear();
        ways.alone.clear();
        self.found(&mut ways.carrying);
        // Somebody has to come from a home and get back to it: the nearest one is tried first.
        let far = |home: &&u32| {
            let (dx, dy) = ground.offset(**home, from.grasp);
            dx.abs() + dy.abs()
        };
        let nearest = self.homes.iter().min_by_key(far).copied();
        ways.is_whole = nearest.is_some_and(|nearest| {
            [from, to].into_iter().all(|place| {
                self.block(ground, places, object, ROBOT_ALONE.0);
                self.block_cells(&place.bare);
                let finds = self.finds(ground, ROBOT_ALONE.0, place.grasp, nearest);
                if finds {
                    self.found(&mut ways.alone);
                }
                finds
            })
        });
        self.ways = ways;
        self.ways.is_whole || self.can_return(ground, places, object, [from, to])
    }

    /// Whether some home can be reached from both ends of a move.
    fn can_return(
        &mut self,
        ground: &Ground,
        places: &[Rc<Place>],
        object: usize,
        ends: [&Place; 2],
    ) -> bool {
        let homes = std::mem::take(&mut self.homes);
        let mut open: Vec<u32> = homes.clone();
        for place in ends {
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
}

/// Whether an object is at the same place in both.
fn is_same(a: &Place, b: &Place) -> bool {
    (a.at - b.at).norm() <= CONTACT_M
}
