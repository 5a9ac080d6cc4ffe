//! Sequences by perturbing: some object is moved somewhere, and then all others are led to their
//! goals as far as that goes.
//!
//! Responsible for: trees of arrangements, one that grows from the start and one that grows back
//! from the goals; which object is moved where.
//! Not responsible for: leading one arrangement to another (`monotone`).
//!
//! How: moves can be made backwards (rule 28), so a sequence is found as soon as an arrangement of
//! one tree can be led to one of the other. An object goes to a place that it can be brought to and
//! from which it can be brought on while some of the others are already where they have to go: that
//! is what being set aside is for.
//!
//! Source: A. Krontiris and K. E. Bekris, "Dealing with Difficult Instances of Object
//! Rearrangement", RSS 2015; R. Wang et al., "Uniform Object Rearrangement: From Complete Monotone
//! Primitives to Efficient Non-Monotone Informed Search", ICRA 2021.

use std::collections::HashSet;
use std::rc::Rc;

use rand::RngExt;
use rand::seq::IndexedRandom;
use scene::{Event, ROBOT_ALONE, Scene};

use crate::anytime::ground::Ground;
use crate::anytime::sequence::{Sequencer, Step, is_same};
use crate::anytime::track::Place;
use crate::frontier::NOWHERE;

/// Arrangements in the first two trees; in the next ones there may be twice as many.
pub(super) const FIRST_NODES: usize = 64;
/// At most.
const MOST_NODES: usize = 4096;
/// Objects in arrangements that are compared for the work of one lattice point.
const COMPARED_PER_CELL: usize = 8;
/// Points looked at for a place.
const POINTS_LOOKED_AT: usize = 24;

/// An arrangement.
struct Node {
    places: Vec<Rc<Place>>,
    /// The one it was reached from, and how.
    parent: usize,
    steps: Vec<Step>,
}

/// Arrangements that can be reached from the start, and from which the goals can be reached.
pub(super) struct Trees {
    nodes: [Vec<Node>; 2],
    known: [HashSet<Vec<u32>>; 2],
    /// Whether both grow: backwards it is not known what the user's order would say, nor where
    /// objects without a goal are.
    is_two_way: bool,
    /// Which one grew last.
    side: usize,
    /// So many arrangements they may have; then others may be luckier.
    most: usize,
}

impl Sequencer {
    /// A sequence, if one is found in time. The next attempt goes on from the same trees.
    pub(super) fn perturb(&mut self, scene: &Scene, ground: &Ground) -> Option<Vec<Step>> {
        let mut kept = self.trees.take();
        while self.floods < self.most_floods {
            let Some(mut trees) = kept.take().filter(|trees| !trees.are_full()) else {
                match self.plant(ground) {
                    Ok(steps) => return Some(steps),
                    Err(trees) => kept = Some(trees),
                }
                continue;
            };
            let side = trees.turn();
            if let Some(steps) = self.grow(scene, ground, &mut trees, side) {
                return Some(self.without_detours(ground, steps));
            }
            kept = Some(trees);
        }
        self.trees = kept;
        None
    }

    /// Begins new trees, unless each object can go straight to its goal: then these moves.
    fn plant(&mut self, ground: &Ground) -> Result<Vec<Step>, Trees> {
        let most = self.most_nodes;
        self.most_nodes = (2 * most).min(MOST_NODES);
        let mut trees = Trees::new(&self.start, &self.goals, self.before.is_empty(), most);
        let [start, goals] = trees.roots();
        let (steps, is_there) = self.lead(ground, &start, &goals);
        if is_there {
            return Ok(steps);
        }
        self.add(&mut trees, 0, 0, steps);
        Err(trees)
    }

    /// Moves some object in some arrangement of a tree, and leads what comes of it to the other one.
    fn grow(
        &mut self,
        scene: &Scene,
        ground: &Ground,
        trees: &mut Trees,
        side: usize,
    ) -> Option<Vec<Step>> {
        // Whatever comes of it: it is to end.
        self.floods += 1;
        self.cells += self.start.len() as u64;
        let count = trees.nodes[side].len();
        let parent = if self.random.random_range(0..3) == 0 {
            0
        } else {
            self.random.random_range(0..count)
        };
        let places = trees.nodes[side][parent].places.clone();
        let toward = trees.nodes[1 - side][0].places.clone();
        let Some(step) = self.perturbation(scene, ground, &places, &toward) else {
            return None;
        };
        let node = self.add(trees, side, parent, vec![step])?;
        let places = trees.nodes[side][node].places.clone();
        let other = trees.nearest(1 - side, &places);
        let compared = trees.nodes[1 - side].len() * places.len();
        self.cells += (compared / COMPARED_PER_CELL) as u64;
        let toward = trees.nodes[1 - side][other].places.clone();
        let (steps, is_there) = self.lead(ground, &places, &toward);
        if is_there {
            let ends = if side == 0 { (node, other) } else { (other, node) };
            return Some(trees.joined(ends, side, steps));
        }
        self.add(trees, side, node, steps);
        None
    }

    /// Adds what steps lead to, if that is new; its number.
    fn add(
        &mut self,
        trees: &mut Trees,
        side: usize,
        parent: usize,
        steps: Vec<Step>,
    ) -> Option<usize> {
        let mut places = trees.nodes[side][parent].places.clone();
        for (object, to) in &steps {
            places[*object] = Rc::clone(to);
        }
        let key = places.iter().flat_map(|place| place.grasps.iter().copied());
        if !trees.known[side].insert(key.collect()) {
            return None;
        }
        let missing = (0..places.len()).filter(|&object| !self.is_at_goal(object, &places));
        let missing = missing.count();
        let node = trees.nodes[side].len();
        trees.nodes[side].push(Node {
            places,
            parent,
            steps,
        });
        if side == 0 {
            self.note(missing, || trees.steps_to(0, node));
        }
        Some(node)
    }

    /// A move of some object to some place where it may be less in the way.
    fn perturbation(
        &mut self,
        scene: &Scene,
        ground: &Ground,
        places: &[Rc<Place>],
        toward: &[Rc<Place>],
    ) -> Option<Step> {
        let is_away = |&object: &usize| !is_same(&places[object], &toward[object]);
        let away: Vec<usize> = (0..places.len()).filter(is_away).collect();
        let object = if self.random.random_range(0..4) == 0 || away.is_empty() {
            self.random.random_range(0..places.len())
        } else {
            *away.choose(&mut self.random)?
        };
        let by = self.random.random_range(0..ground.grasps(object));
        let from = places[object].held(by);
        if from.grasp == NOWHERE || self.is_early(places, object, Event::Grasp) {
            return None;
        }
        let class = ground.carrying(object, by);
        self.block(ground, places, object, class);
        self.reaches(ground, class, &[from.grasp], &[]);
        let mark = self.mark(0);
        let within: Vec<u32> = (0..ground.points() as u32)
            .filter(|&cell| self.seen[cell as usize] == mark)
            .collect();
        let onward = self.onward(ground, places, toward, (object, by), &within);
        let within = if onward.is_empty() { within } else { onward };
        for _ in 0..POINTS_LOOKED_AT {
            let cell = *within.choose(&mut self.random)?;
            let grasp = scene.objects[object].grasps[usize::from(by)].offset;
            let at = scene.lattice.at(cell) - grasp;
            let place = Place::of(scene, ground, object, at).held(by);
            let kept = &place.cells[ROBOT_ALONE.0];
            let is_clear = self.homes.iter().all(|home| kept.binary_search(home).is_err());
            if place.grasp != NOWHERE && is_clear && self.can_move(ground, places, object, &place) {
                return Some((object, place));
            }
        }
        None
    }

    /// Of some cells, those from which an object can be brought to its place while some of those
    /// that have to move stand where they have to go, and others do not stand anywhere.
    fn onward(
        &mut self,
        ground: &Ground,
        places: &[Rc<Place>],
        toward: &[Rc<Place>],
        (object, by): (usize, u8),
        within: &[u32],
    ) -> Vec<u32> {
        let to = toward[object].held(by);
        if to.grasp == NOWHERE || self.goals[object].is_none() {
            return Vec::new();
        }
        let after: Vec<Rc<Place>> = (places.iter().zip(toward))
            .map(|(place, toward)| {
                if is_same(place, toward) || self.random.random_bool(0.5) {
                    Rc::clone(toward)
                } else {
                    Place::out_of_reach(ground, place.at)
                }
            })
            .collect();
        let class = ground.carrying(object, by);
        self.block(ground, &after, object, class);
        self.reaches(ground, class, &[to.grasp], &[]);
        let mark = self.mark(0);
        let cells = within.iter().copied();
        cells.filter(|&cell| self.seen[cell as usize] == mark).collect()
    }

    /// The same without moves that turn out not to be needed.
    fn without_detours(&mut self, ground: &Ground, mut steps: Vec<Step>) -> Vec<Step> {
        let mut number = 0;
        while number < steps.len() {
            let object = steps[number].0;
            let is_moved_again = steps[number + 1..].iter().any(|step| step.0 == object);
            let mut fewer = steps.clone();
            fewer.remove(number);
            if is_moved_again && self.can_make(ground, &fewer) {
                steps = fewer;
            } else {
                number += 1;
            }
        }
        steps
    }

    /// Whether steps can be made one after the other from the start.
    fn can_make(&mut self, ground: &Ground, steps: &[Step]) -> bool {
        let mut places = self.start.clone();
        steps.iter().all(|(object, to)| {
            let is_made = !is_same(&places[*object], to)
                && !self.is_early(&places, *object, Event::Finish)
                && self.can_move(ground, &places, *object, to);
            places[*object] = Rc::clone(to);
            is_made
        })
    }
}

impl Trees {
    fn new(start: &[Rc<Place>], goals: &[Option<Rc<Place>>], is_free: bool, most: usize) -> Self {
        let root = |places| {
            vec![Node {
                places,
                parent: 0,
                steps: Vec::new(),
            }]
        };
        let end = goals.iter().zip(start);
        let end = end.map(|(goal, start)| Rc::clone(goal.as_ref().unwrap_or(start)));
        Self {
            nodes: [root(start.to_vec()), root(end.collect())],
            known: Default::default(),
            is_two_way: is_free && goals.iter().all(Option::is_some),
            side: 1,
            most,
        }
    }

    fn are_full(&self) -> bool {
        self.nodes.iter().map(Vec::len).sum::<usize>() >= self.most
    }

    /// The arrangements at the start and at the goals.
    fn roots(&self) -> [Vec<Rc<Place>>; 2] {
        [0, 1].map(|side: usize| self.nodes[side][0].places.clone())
    }

    /// Which tree is to grow.
    const fn turn(&mut self) -> usize {
        self.side = if self.is_two_way { 1 - self.side } else { 0 };
        self.side
    }

    /// The arrangement in which fewest objects are elsewhere.
    fn nearest(&self, side: usize, places: &[Rc<Place>]) -> usize {
        let elsewhere = |node: &Node| {
            let both = node.places.iter().zip(places);
            both.filter(|(a, b)| !is_same(a, b)).count()
        };
        (0..self.nodes[side].len())
            .min_by_key(|&node| elsewhere(&self.nodes[side][node]))
            .unwrap_or(0)
    }

    /// The steps from a tree's root to one of its arrangements.
    fn steps_to(&self, side: usize, mut node: usize) -> Vec<Step> {
        let mut parts = Vec::new();
        while node != 0 {
            parts.push(&self.nodes[side][node].steps);
            node = self.nodes[side][node].parent;
        }
        parts.into_iter().rev().flatten().cloned().collect()
    }

    /// The steps from the start to the goals by an arrangement of each tree, one of which was led
    /// to the other.
    fn joined(
        &self,
        (first, last): (usize, usize),
        side: usize,
        lead: Vec<Step>,
    ) -> Vec<Step> {
        let mut steps = self.steps_to(0, first);
        let mut back = self.steps_to(1, last);
        if side == 0 {
            steps.extend(lead);
        } else {
            back.extend(lead);
        }
        steps.extend(reversed(&self.nodes[1][0].places, &back));
        steps
    }
}

/// Steps backwards: from where they lead to where they begin.
fn reversed(from: &[Rc<Place>], steps: &[Step]) -> Vec<Step> {
    let mut places = from.to_vec();
    let mut back: Vec<Step> = (steps.iter())
        .map(|(object, to)| {
            let from = std::mem::replace(&mut places[*object], Rc::clone(to));
            (*object, from.held(to.by))
        })
        .collect();
    back.reverse();
    back
}
