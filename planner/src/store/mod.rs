//! What has to come before what in a scene, and why: the store of explained constraints (rule 35).
//!
//! Responsible for: constraints between events with their reasons, from overlaps (E1–E4), from
//! ways that one object cuts (H1, H2, and rule 12's approach and return) or several only together
//! (rule 12's joint blockers), and the user's own order; learning one from a failure; forgetting
//! what assumed something that has changed.
//! Not responsible for: orders and routes that keep them, bounds (`bounds`), what the paper's
//! methods are charged (`easy`, `hard`).
//!
//! Terms: a [`Constraint`] is a *no-good* turned round: it says what every plan has to do, at least
//! one of some precedences. A [`Removal`] is no constraint but a hypothesis (rule 29): without
//! these placements there is a way. Neither follows from the other.
//!
//! All constraints are necessary for every plan, also for one that moves objects several times
//! (see [`crate::Event`]). Not all that are necessary are found: those of joint blockers are
//! disjoint sets among objects that all stand at their starts, or all at their goals.

mod constraint;
mod ways;

use scene::{Event as Stated, Scene};
use shm_types::Counters;

use crate::easy;
use crate::event::{Event, Precedence};
use crate::kind::Kind;
use crate::places::Places;

pub use constraint::{Constraint, Leg, Placement, Reason, Removal};
pub use ways::Ways;

/// All that is known.
#[derive(Clone, Debug)]
pub struct Store {
    constraints: Vec<Constraint>,
    impossible: Vec<Leg>,
    is_complete: bool,
    work: Counters,
}

impl Store {
    /// Finds the constraints of a scene at its beginning with at most so many path searches.
    /// Those that follow from overlaps and from the user's order are found at any rate.
    #[must_use]
    pub fn of(scene: &Scene, searches: u64) -> Self {
        let mut store = Self {
            constraints: Vec::new(),
            impossible: Vec::new(),
            is_complete: true,
            work: Counters::default(),
        };
        let places: Vec<_> = Places::at_start(scene).collect();
        // What hinders one grasp of several, or the way to one goal of several, hinders nobody for
        // certain.
        let is_task = |task: &usize| {
            places[*task].is_some_and(|places| places.is_open()) && scene.is_plain(*task)
        };
        let tasks: Vec<_> = (0..places.len()).filter(is_task).collect();
        store.add_user_order(scene);
        for &task in &tasks {
            store.add_overlaps(scene, &places, task);
        }
        let mut ways = Ways::new(scene, searches);
        for &task in &tasks {
            for (leg, at_goal) in [
                (Leg::Transfer(task), false),
                (Leg::Transfer(task), true),
                (Leg::Approach(task), false),
                (Leg::Return(task), true),
            ] {
                store.add_cuts(scene, &mut ways, leg, at_goal);
            }
        }
        store.is_complete = !ways.is_spent();
        store.work = ways.work();
        store
    }

    /// The constraints, by reason and task.
    #[must_use]
    pub fn constraints(&self) -> &[Constraint] {
        &self.constraints
    }

    /// Legs that have no way even with no other object in the room (rule 10).
    #[must_use]
    pub fn impossible(&self) -> &[Leg] {
        &self.impossible
    }

    /// Whether all searches could be made that were called for.
    #[must_use]
    pub const fn is_complete(&self) -> bool {
        self.is_complete
    }

    /// What the searches took that it was found with.
    #[must_use]
    pub const fn work(&self) -> Counters {
        self.work
    }

    /// What certainly comes before what: the constraints that leave no choice.
    pub fn precedences(&self) -> impl Iterator<Item = Precedence> + '_ {
        self.constraints.iter().filter_map(Constraint::precedence)
    }

    /// Learns from a leg that had no way among these placements: a smallest part of them that
    /// cuts it, and what follows. None if there is a way, or if it is known already.
    pub fn learn(
        &mut self,
        scene: &Scene,
        ways: &mut Ways,
        leg: Leg,
        placements: &[Placement],
    ) -> Option<&Constraint> {
        let cut = ways.smallest_cut(scene, leg, placements)?;
        if cut.is_empty() {
            self.impossible.push(leg);
            return None;
        }
        let new = Constraint::of_cut(leg, cut);
        if self.constraints.contains(&new) {
            return None;
        }
        self.constraints.push(new);
        self.constraints.last()
    }

    /// Forgets what assumed that `object` stands where it stood, or has the goal it had.
    pub fn forget_object(&mut self, object: usize) {
        self.constraints
            .retain(|constraint| !constraint.assumes_object(object));
        self.impossible.retain(|leg| leg.task() != object);
    }

    /// Forgets what assumed where the robots' homes are.
    pub fn forget_homes(&mut self) {
        self.constraints
            .retain(|constraint| !constraint.assumes_homes());
        self.impossible
            .retain(|leg| matches!(leg, Leg::Transfer(_)));
    }

    fn add_user_order(&mut self, scene: &Scene) {
        for order in &scene.before {
            let (first, then) = (order.first, order.then);
            // When a robot sets out says nothing of when it grasps, only the other way round.
            let before = match first.1 {
                Stated::Start => continue,
                Stated::Grasp => Event::Grasp(first.0),
                Stated::Finish => Event::Finish(first.0),
            };
            let after = match then.1 {
                Stated::Start | Stated::Grasp => Event::Grasp(then.0),
                Stated::Finish => Event::Finish(then.0),
            };
            self.constraints
                .push(Constraint::of_user(Precedence { before, after }));
        }
    }

    /// E1–E4 between every object that may be in the way and a robot that grasps `task`.
    fn add_overlaps(&mut self, scene: &Scene, places: &[Option<Places>], task: usize) {
        let Some(own) = places[task] else { return };
        for (other, spec) in scene.objects.iter().enumerate() {
            // Where one of a kind ends is not certain.
            let goal = places[other].filter(|_| spec.kind.is_none());
            let goal = goal.map(|places| places.goal);
            let standing = Places {
                initial: spec.start,
                goal: goal.unwrap_or(spec.start),
            };
            for kind in Kind::EASY {
                let is_there = goal.is_some() || !kind.first_at_goal();
                if other != task
                    && is_there
                    && easy::holds(scene, kind, (other, standing), (task, own))
                {
                    self.constraints
                        .push(Constraint::of_overlap(kind, other, task));
                }
            }
        }
    }

    /// Sets of placements that cut a leg: every single one, and joint ones until there is a way.
    fn add_cuts(&mut self, scene: &Scene, ways: &mut Ways, leg: Leg, at_goal: bool) {
        let overlaps = self.overlaps_of(leg);
        let mut standing: Vec<_> = (0..scene.objects.len())
            .filter(|&object| object != leg.task())
            .filter(|&object| {
                let spec = &scene.objects[object];
                !at_goal || spec.goal.is_some() && spec.kind.is_none()
            })
            .map(|object| Placement { object, at_goal })
            .filter(|placement| !overlaps.contains(placement))
            .collect();
        while let Some(cut) = ways.smallest_cut(scene, leg, &standing) {
            if cut.is_empty() {
                if !self.impossible.contains(&leg) {
                    self.impossible.push(leg);
                }
                return;
            }
            standing.retain(|placement| !cut.contains(placement));
            self.constraints.push(Constraint::of_cut(leg, cut));
        }
    }

    /// Placements of which an overlap says at least as much as that they cut a leg by themselves.
    fn overlaps_of(&self, leg: Leg) -> Vec<Placement> {
        let says = |known: &&Constraint| match (leg, known.blockers.as_slice()) {
            (Leg::Transfer(_), [placement]) if placement.at_goal => {
                matches!(known.reason, Reason::E2 | Reason::E4)
            }
            (Leg::Transfer(_), [_]) => matches!(known.reason, Reason::E1 | Reason::E3),
            (Leg::Approach(_), [_]) => known.reason == Reason::E1,
            (Leg::Return(_), [_]) => known.reason == Reason::E4,
            (_, _) => false,
        };
        let own = (self.constraints.iter()).filter(|known| known.task == leg.task());
        own.filter(says)
            .flat_map(|known| known.blockers.iter().copied())
            .collect()
    }
}
