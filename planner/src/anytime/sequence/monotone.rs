//! From one arrangement to another, each object straight to its place.
//!
//! Responsible for: an order in which every object can make its one move, or else how far one gets
//! without shutting anything in.
//! Not responsible for: objects that have to be set aside (`perturb`).
//!
//! How: depth first over the sets of objects that have moved. An object is not brought to its place
//! if another one could then never get to its own, even with all that have still to move out of the
//! way. Most dead ends are seen where they begin in that way.

use std::collections::HashSet;
use std::rc::Rc;

use rand::seq::SliceRandom;
use scene::{Event, ROBOT_ALONE};

use crate::anytime::ground::Ground;
use crate::anytime::sequence::{Sequencer, Step, Ways, is_same};
use crate::anytime::track::Place;

/// Floods for each object, at most.
const FLOODS_PER_MOVE: u64 = 40;

/// What is on its way from one arrangement to another.
struct Lead<'a> {
    from: &'a [Rc<Place>],
    to: &'a [Rc<Place>],
    /// Where objects are.
    places: Vec<Rc<Place>>,
    /// The same, but those that have still to move are nowhere.
    settled: Vec<Rc<Place>>,
    /// By object: how it gets to its place with only those that are settled about.
    ways: Vec<Option<Ways>>,
    left: Vec<usize>,
    steps: Vec<Step>,
    /// The most that were made.
    furthest: Vec<Step>,
    dead_ends: HashSet<Vec<usize>>,
    /// No more is tried from then on.
    until: u64,
}

impl Sequencer {
    /// Moves of objects from where they are to where they are in another arrangement, one each:
    /// whether they lead all the way. Where objects have no goal, they stay.
    pub(super) fn lead(
        &mut self,
        ground: &Ground,
        from: &[Rc<Place>],
        to: &[Rc<Place>],
    ) -> (Vec<Step>, bool) {
        let mut left: Vec<usize> = (0..from.len())
            .filter(|&object| self.goals[object].is_some() && !is_same(&from[object], &to[object]))
            .collect();
        left.shuffle(&mut self.random);
        let mut settled = from.to_vec();
        for &object in &left {
            settled[object] = Place::out_of_reach(ground, from[object].at);
        }
        let mut lead = Lead {
            from,
            to,
            places: from.to_vec(),
            settled,
            ways: vec![None; from.len()],
            until: self.floods + FLOODS_PER_MOVE * left.len() as u64,
            left,
            steps: Vec::new(),
            furthest: Vec::new(),
            dead_ends: HashSet::new(),
        };
        for object in lead.left.clone() {
            lead.ways[object] = self.way_to(ground, &lead, object);
            if lead.ways[object].is_none() {
                // It cannot lead all the way: how far is enough.
                lead.until = 0;
            }
        }
        let is_there = self.lead_on(ground, &mut lead);
        (lead.furthest, is_there)
    }

    /// How an object gets to its place with only those about that are settled.
    fn way_to(&mut self, ground: &Ground, lead: &Lead<'_>, object: usize) -> Option<Ways> {
        let goes = (0..ground.grasps(object)).any(|by| {
            let (from, to) = (lead.from[object].held(by), lead.to[object].held(by));
            self.can_move_from(ground, &lead.settled, object, &from, &to)
        });
        goes.then(|| self.ways.clone())
    }

    fn lead_on(&mut self, ground: &Ground, lead: &mut Lead<'_>) -> bool {
        if lead.steps.len() > lead.furthest.len() {
            lead.furthest.clone_from(&lead.steps);
        }
        if lead.left.is_empty() {
            return true;
        }
        let mut key = lead.left.clone();
        key.sort_unstable();
        if !lead.dead_ends.insert(key) {
            return false;
        }
        for number in 0..lead.left.len() {
            let object = lead.left[number];
            let Some(to) = self.next_move(ground, lead, object) else {
                continue;
            };
            // Those before it could not move a moment ago: they come last.
            let before = lead.left.clone();
            lead.left.remove(number);
            lead.left.rotate_left(number);
            let from = std::mem::replace(&mut lead.places[object], Rc::clone(&to));
            lead.steps.push((object, to));
            if self.lead_on(ground, lead) {
                return true;
            }
            lead.left = before;
            lead.steps.pop();
            lead.places[object] = from;
            lead.settled[object] = Place::out_of_reach(ground, lead.from[object].at);
            if self.floods > lead.until {
                return false;
            }
        }
        false
    }

    /// The move of an object to its place, if it can be made and shuts nothing in; it counts as
    /// settled then.
    fn next_move(
        &mut self,
        ground: &Ground,
        lead: &mut Lead<'_>,
        object: usize,
    ) -> Option<Rc<Place>> {
        if self.is_early(&lead.places, object, Event::Finish) {
            return None;
        }
        let to = (0..ground.grasps(object))
            .map(|by| lead.to[object].held(by))
            .find(|to| self.can_move(ground, &lead.places, object, to))?;
        lead.settled[object] = Rc::clone(&to);
        for number in 0..lead.left.len() {
            let other = lead.left[number];
            let is_hit = lead.ways[other].as_ref().is_some_and(|way| way.meets(&to));
            if other == object || !is_hit {
                continue;
            }
            let way = self.way_to(ground, lead, other);
            if way.is_none() {
                lead.settled[object] = Place::out_of_reach(ground, to.at);
                return None;
            }
            lead.ways[other] = way;
        }
        Some(to)
    }
}

impl Ways {
    /// Whether an object at a place may be in the way.
    pub(super) fn meets(&self, place: &Place) -> bool {
        let meets = |class: usize, cells: &[u32]| place.closes_any(class, cells);
        !self.is_whole || meets(self.class, &self.carrying) || meets(ROBOT_ALONE.0, &self.alone)
    }
}
