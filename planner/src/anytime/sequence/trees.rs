//! Arrangements that were reached, and how.
//!
//! Responsible for: two trees, one that grows from the start and one that grows back from the
//! goals; the steps by an arrangement of each.
//! Not responsible for: how they grow (`perturb`).

use std::collections::HashSet;
use std::rc::Rc;

use crate::anytime::sequence::{Step, is_same};
use crate::anytime::track::Place;

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

impl Trees {
    pub(super) fn new(
        start: &[Rc<Place>],
        goals: &[Option<Rc<Place>>],
        is_free: bool,
        most: usize,
    ) -> Self {
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

    pub(super) fn are_full(&self) -> bool {
        self.nodes.iter().map(Vec::len).sum::<usize>() >= self.most
    }

    pub(super) const fn len(&self, side: usize) -> usize {
        self.nodes[side].len()
    }

    /// Where objects are in an arrangement; the first one is where a tree begins.
    pub(super) fn places(&self, side: usize, node: usize) -> &[Rc<Place>] {
        &self.nodes[side][node].places
    }

    /// Adds what steps lead to, if that is new; its number.
    pub(super) fn add(&mut self, side: usize, parent: usize, steps: Vec<Step>) -> Option<usize> {
        let mut places = self.nodes[side][parent].places.clone();
        for (object, to) in &steps {
            places[*object] = Rc::clone(to);
        }
        let key = places.iter().flat_map(|place| place.grasps.iter().copied());
        if !self.known[side].insert(key.collect()) {
            return None;
        }
        self.nodes[side].push(Node {
            places,
            parent,
            steps,
        });
        Some(self.nodes[side].len() - 1)
    }

    /// Which tree is to grow.
    pub(super) const fn turn(&mut self) -> usize {
        self.side = if self.is_two_way { 1 - self.side } else { 0 };
        self.side
    }

    /// The arrangement in which fewest objects are elsewhere.
    pub(super) fn nearest(&self, side: usize, places: &[Rc<Place>]) -> usize {
        let elsewhere = |node: &Node| {
            let both = node.places.iter().zip(places);
            both.filter(|(a, b)| !is_same(a, b)).count()
        };
        (0..self.nodes[side].len())
            .min_by_key(|&node| elsewhere(&self.nodes[side][node]))
            .unwrap_or(0)
    }

    /// The steps from a tree's root to one of its arrangements.
    pub(super) fn steps_to(&self, side: usize, mut node: usize) -> Vec<Step> {
        let mut parts = Vec::new();
        while node != 0 {
            parts.push(&self.nodes[side][node].steps);
            node = self.nodes[side][node].parent;
        }
        parts.into_iter().rev().flatten().cloned().collect()
    }

    /// The steps from the start to the goals by an arrangement of one tree, which was led to one of
    /// the other.
    pub(super) fn joined(
        &self,
        side: usize,
        (node, other): (usize, usize),
        lead: Vec<Step>,
    ) -> Vec<Step> {
        let mut parts = [self.steps_to(side, node), self.steps_to(1 - side, other)];
        parts[0].extend(lead);
        parts.rotate_left(side);
        let [mut steps, back] = parts;
        steps.extend(reversed(self.places(1, 0), &back));
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
