//! Sequences depth first: whatever can go to its goal goes there, else something is set aside.
//!
//! Responsible for: what is tried in an arrangement, and in which order.
//! Not responsible for: the places to which objects are set aside (`places`), what is tried where
//! this finds nothing (`perturb`).
//!
//! How: if nothing can go to its goal, the cheapest way of an object *through* others (rule 29)
//! tells which of these to set aside.

use std::rc::Rc;

use scene::{Event, ROBOT_ALONE, Scene};

use crate::anytime::ground::Ground;
use crate::anytime::sequence::{Sequencer, Step};
use crate::anytime::track::Place;
use crate::frontier::NOWHERE;

/// Stuck objects for which others are set aside, in one arrangement.
const STUCK_LOOKED_AT: usize = 4;

/// What the way of a stuck object would be without those it crosses.
pub(super) struct Crossing {
    /// Class of the robot with the object.
    pub(super) class: usize,
    crossed: Vec<usize>,
    /// Cells of the robot on its approach and way back, and of the robot with the object.
    pub(super) alone: Vec<u32>,
    pub(super) carrying: Vec<u32>,
}

impl Crossing {
    /// That of an object in nobody's way.
    pub(super) const fn nothing() -> Self {
        Self {
            class: ROBOT_ALONE.0,
            crossed: Vec::new(),
            alone: Vec::new(),
            carrying: Vec::new(),
        }
    }
}

impl Sequencer {
    pub(super) fn search(
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
        if let Some(&(last, _)) = steps.last() {
            // Those before the one moved last could not move a moment ago.
            let after = open.partition_point(|&object| object <= last);
            open.rotate_left(after);
        }
        let missing = open
            .iter()
            .filter(|&&object| self.goals[object].is_some())
            .count();
        self.note(missing, || steps.clone());
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
}
