//! Which placements cut a way.
//!
//! Responsible for: whether a leg has a way among some placements; a smallest set of them that
//! cuts it; a smallest set that suffices to remove (rule 29).
//! Not responsible for: what follows (`constraint`).
//!
//! Robots that carry nothing are held up by less than planning allows for: clearance does not
//! count for them, and objects that robots lift from below or may pass under do not either, since a
//! robot may come as close to such an object as if it were its target and leave on the other side.
//! So what is found to be cut is cut for certain.
//!
//! Source: a smallest set by division, U. Junker, "QuickXplain" (2004): about k·log(n/k) path
//! searches for k of n placements, where leaving out one after the other takes n.

use scene::{Budget, ROBOT_ALONE, Scene, Vec2};
use shm_types::Counters;

use crate::search::PathSearch;
use crate::store::constraint::{Leg, Placement, Removal};

/// Searches ways, a limited number of times.
#[derive(Clone, Debug)]
pub struct Ways {
    search: PathSearch,
    searches_left: u64,
    is_spent: bool,
    work: Counters,
}

impl Ways {
    /// At most so many path searches in `scene`.
    #[must_use]
    pub fn new(scene: &Scene, searches: u64) -> Self {
        Self {
            search: PathSearch::new(scene),
            searches_left: searches,
            is_spent: false,
            work: Counters::default(),
        }
    }

    /// What the searches took so far.
    #[must_use]
    pub const fn work(&self) -> Counters {
        self.work
    }

    /// Whether a search was called for that could not be made.
    #[must_use]
    pub const fn is_spent(&self) -> bool {
        self.is_spent
    }

    /// Whether a leg has a way with only these objects in the room. None when no search is left.
    pub fn is_open(&mut self, scene: &Scene, leg: Leg, placements: &[Placement]) -> Option<bool> {
        let task = leg.task();
        let (start, goal) = (scene.objects[task].start, scene.objects[task].goal);
        let from = scene.grasp_at(task, start);
        let to = goal.map(|goal| scene.grasp_at(task, goal));
        match leg {
            Leg::Transfer(_) => {
                let occupancy = self.search.occupancy();
                occupancy.reset(scene, scene.objects[task].class);
                for placement in placements {
                    let shape = &scene.objects[placement.object].shape;
                    occupancy.block(scene, shape, place(scene, *placement), true);
                }
                self.has_path(scene, from, to?)
            }
            Leg::Approach(_) => self.is_within_reach(scene, placements, task, (start, from)),
            Leg::Return(_) => self.is_within_reach(scene, placements, task, (goal?, to?)),
        }
    }

    /// A smallest part of `placements` that still cuts a leg: without any one of it there is a
    /// way. Empty if the leg has no way with nothing in the room. None if there is a way, or no
    /// search is left.
    pub fn smallest_cut(
        &mut self,
        scene: &Scene,
        leg: Leg,
        placements: &[Placement],
    ) -> Option<Vec<Placement>> {
        if self.is_open(scene, leg, placements)? {
            return None;
        }
        if !self.is_open(scene, leg, &[])? {
            return Some(Vec::new());
        }
        self.part(scene, leg, &mut Vec::new(), false, placements)
    }

    /// Placements without which a leg has a way among the rest, and with any one of which it has
    /// none. None if there is no way with nothing in the room, or no search is left.
    pub fn removal(
        &mut self,
        scene: &Scene,
        leg: Leg,
        placements: &[Placement],
    ) -> Option<Removal> {
        if !self.is_open(scene, leg, &[])? {
            return None;
        }
        let (mut kept, mut removed) = (Vec::new(), Vec::new());
        for &placement in placements {
            kept.push(placement);
            if !self.is_open(scene, leg, &kept)? {
                kept.pop();
                removed.push(placement);
            }
        }
        Some(Removal {
            leg,
            placements: removed,
        })
    }

    /// Which of `choice` it takes, with `given` in the room, to cut the leg. `given` and all of
    /// `choice` do; `added` says whether `given` has grown since that was last looked at.
    fn part(
        &mut self,
        scene: &Scene,
        leg: Leg,
        given: &mut Vec<Placement>,
        added: bool,
        choice: &[Placement],
    ) -> Option<Vec<Placement>> {
        if added && !self.is_open(scene, leg, given)? {
            return Some(Vec::new());
        }
        if choice.len() <= 1 {
            return Some(choice.to_vec());
        }
        let (first, second) = choice.split_at(choice.len() / 2);
        let known = given.len();
        given.extend_from_slice(first);
        let mut found = self.part(scene, leg, given, true, second)?;
        given.truncate(known);
        given.extend_from_slice(&found);
        let rest = self.part(scene, leg, given, !found.is_empty(), first)?;
        given.truncate(known);
        found.extend(rest);
        Some(found)
    }

    /// Whether some robot and the grasp of `task`, standing at `at.0`, are connected.
    fn is_within_reach(
        &mut self,
        scene: &Scene,
        placements: &[Placement],
        task: usize,
        at: (Vec2, Vec2),
    ) -> Option<bool> {
        let occupancy = self.search.occupancy();
        occupancy.reset(scene, ROBOT_ALONE);
        let own = (task, at.0);
        let others = placements.iter().map(|p| (p.object, place(scene, *p)));
        for (object, at) in others.chain([own]) {
            let spec = &scene.objects[object];
            if !spec.pass_under && !scene.lifts_from_below(object) {
                occupancy.block(scene, &spec.shape, at, false);
            }
        }
        for &home in &scene.homes {
            if self.has_path(scene, home, at.1)? {
                return Some(true);
            }
        }
        Some(false)
    }

    fn has_path(&mut self, scene: &Scene, from: Vec2, to: Vec2) -> Option<bool> {
        if self.searches_left == 0 {
            self.is_spent = true;
            return None;
        }
        self.searches_left -= 1;
        self.search.begin(scene, from, to);
        let mut budget = Budget::new(u64::MAX);
        loop {
            if let std::task::Poll::Ready(length_m) =
                self.search.advance(scene, &mut budget, &mut self.work)
            {
                return Some(length_m.is_some());
            }
        }
    }
}

fn place(scene: &Scene, placement: Placement) -> Vec2 {
    let spec = &scene.objects[placement.object];
    match spec.goal {
        Some(goal) if placement.at_goal => goal,
        _ => spec.start,
    }
}
