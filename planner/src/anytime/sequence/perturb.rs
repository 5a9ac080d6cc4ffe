//! Sequences by perturbing: some object is moved somewhere, and then all others are led to their
//! goals as far as that goes.
//!
//! Responsible for: which object is moved where, in which arrangement.
//! Not responsible for: leading one arrangement to another (`monotone`), keeping arrangements
//! (`trees`).
//!
//! How: moves can be made backwards (rule 28), so a sequence is found as soon as an arrangement of
//! one tree can be led to one of the other. An object goes to a place that it can be brought to and
//! from which it can be brought on while some of the others are already where they have to go: that
//! is what being set aside is for.
//!
//! Source: A. Krontiris and K. E. Bekris, "Dealing with Difficult Instances of Object
//! Rearrangement", RSS 2015; R. Wang et al., "Uniform Object Rearrangement: From Complete Monotone
//! Primitives to Efficient Non-Monotone Informed Search", ICRA 2021.

use std::rc::Rc;

use rand::RngExt;
use rand::seq::IndexedRandom;
use scene::{Event, ROBOT_ALONE, Scene};

use crate::anytime::ground::Ground;
use crate::anytime::sequence::trees::Trees;
use crate::anytime::sequence::{Sequencer, Step, is_same};
use crate::anytime::track::Place;
use crate::frontier::NOWHERE;

/// Arrangements in the first two trees; in the next ones there may be twice as many.
pub(super) const FIRST_NODES: usize = 64;
/// At most.
const MOST_NODES: usize = 4096;
/// One in so many arrangements that are gone on from is that at the root.
const FROM_ROOT: usize = 3;
/// One in so many objects that are moved is any, the others are not where they have to go.
const ANYTHING: usize = 4;
/// Objects in arrangements that are compared for the work of one lattice point.
const COMPARED_PER_CELL: usize = 8;
/// Points looked at for a place.
const POINTS_LOOKED_AT: usize = 24;

impl Sequencer {
    /// A sequence, if one is found in time. The next attempt goes on from the same trees.
    pub(super) fn perturb(&mut self, scene: &Scene, ground: &Ground) -> Option<Vec<Step>> {
        let mut kept = self.trees.take();
        while self.floods < self.most_floods {
            let Some(mut trees) = kept.take().filter(|trees| !trees.are_full()) else {
                let mut trees = self.plant();
                let ends = [0, 1].map(|side| trees.places(side, 0));
                let (steps, is_there) = self.lead(ground, ends[0], ends[1]);
                if is_there {
                    return Some(steps);
                }
                self.add(&mut trees, 0, 0, steps);
                kept = Some(trees);
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

    /// New trees, which may grow larger than the ones before.
    fn plant(&mut self) -> Trees {
        let most = self.most_nodes;
        self.most_nodes = (2 * most).min(MOST_NODES);
        Trees::new(&self.start, &self.goals, self.before.is_empty(), most)
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
        let parent = if self.random.random_range(0..FROM_ROOT) == 0 {
            0
        } else {
            self.random.random_range(0..trees.len(side))
        };
        let (places, goals) = (trees.places(side, parent), trees.places(1 - side, 0));
        let step = self.perturbation(scene, ground, places, goals)?;
        let node = self.add(trees, side, parent, vec![step])?;
        let places = trees.places(side, node);
        let other = trees.nearest(1 - side, places);
        let compared = trees.len(1 - side) * places.len();
        self.cells += (compared / COMPARED_PER_CELL) as u64;
        let (steps, is_there) = self.lead(ground, places, trees.places(1 - side, other));
        if is_there {
            return Some(trees.joined(side, (node, other), steps));
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
        let node = trees.add(side, parent, steps)?;
        if side == 0 {
            let places = trees.places(0, node);
            let away = (0..places.len()).filter(|&object| !self.is_at_goal(object, places));
            self.note(away.count(), || trees.steps_to(0, node));
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
        let object = if away.is_empty() || self.random.random_range(0..ANYTHING) == 0 {
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
            let is_clear = !place.closes_any(ROBOT_ALONE.0, &self.homes);
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
        cells
            .filter(|&cell| self.seen[cell as usize] == mark)
            .collect()
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
