//! Intermediate places.
//!
//! Responsible for: where an object can be set aside so that it hinders neither a way nor a goal,
//! and where it can be put down to be grasped otherwise.
//! Not responsible for: which object is set aside (`depth_first`).

use std::collections::VecDeque;
use std::rc::Rc;

use scene::{Event, ROBOT_ALONE, Scene};

use crate::anytime::ground::Ground;
use crate::anytime::sequence::Sequencer;
use crate::anytime::sequence::depth_first::Crossing;
use crate::anytime::track::Place;
use crate::frontier::NOWHERE;

/// Intermediate places tried for one object in one arrangement.
const PLACES_TRIED: usize = 3;
/// Places looked at until that many are found.
const PLACES_LOOKED_AT: usize = 400;

impl Sequencer {
    /// Places to which an object can be set aside by any of its grasps.
    pub(super) fn all_asides(
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
    pub(super) fn regrasps(
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
        let nothing = Crossing::nothing();
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
            for &cell in reached.iter().step_by(stride) {
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
        let free = |class: usize, cells: &[u32]| !place.closes_any(class, cells);
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
