//! Making a plan better while robots follow it.
//!
//! Responsible for: what is looked for anew, and which plan counts after that.
//! Not responsible for: what robots keep (`keep`).

use std::rc::Rc;

use scene::Scene;

use crate::anytime::ground::Time;
use crate::anytime::order::{Hops, Item, Progress};
use crate::anytime::sequence::Step;
use crate::anytime::solver::{Best, Solver, Source};
use crate::anytime::track::{Start, Track};
use crate::anytime::tried::Begun;

impl Solver {
    /// Keeps so many deeds of each robot of the plan that is followed, as `kept` says, and looks
    /// for what comes after them, and not before `until`, anew. False if nothing comes after them.
    pub(crate) fn go_on(
        &mut self,
        scene: &Scene,
        until: Time,
        kept: impl FnOnce(&[Track]) -> Vec<usize>,
    ) -> bool {
        let Some(followed) = self.followed.clone() else {
            return false;
        };
        let Some(source) = &followed.source else {
            return false;
        };
        let kept = kept(&followed.tracks);
        let turns =
            |start: &Start| -> Vec<u32> { start.rests().iter().map(|rest| rest.turns).collect() };
        let before = turns(&self.start);
        self.start.robots = (followed.tracks.iter().zip(kept))
            .map(|(track, kept)| track.cut(&self.ground, kept, until))
            .collect();
        // Of each object, the first moves are those kept.
        let mut kept = turns(&self.start);
        kept.iter_mut()
            .zip(&before)
            .for_each(|(kept, before)| *kept -= before);
        let begun = Begun::of(&source.0, &source.1, &kept);
        let Some((sequence, order)) =
            rest_of(&begun, source).filter(|(_, order)| !order.is_empty())
        else {
            return false;
        };
        self.known.clear();
        let (start, homes) = (&self.start, &self.homes);
        let Some(hops) = Hops::new(scene, &mut self.ground, start, homes, &sequence) else {
            return false;
        };
        let rest = (Rc::new(hops), order);
        let current = self.wander_on(scene, &begun, source, &rest);
        self.current = current.or_else(|| Some(rest.clone()));
        self.misses = 0;
        self.best = Some(Best {
            source: Some(rest),
            ..followed
        });
        self.followed.clone_from(&self.best);
        true
    }

    /// Where orders were looked for, if robots have begun as they do there: what is left of it.
    fn wander_on(
        &mut self,
        scene: &Scene,
        begun: &Begun,
        followed: &Source,
        rest: &Source,
    ) -> Option<Source> {
        self.tried.go_on(begun);
        let current = self.current.take()?;
        let (sequence, order) = rest_of(begun, &current)?;
        if Rc::ptr_eq(&current.0, &followed.0) {
            return Some((Rc::clone(&rest.0), order));
        }
        let (start, homes) = (&self.start, &self.homes);
        let hops = Hops::new(scene, &mut self.ground, start, homes, &sequence)?;
        Some((Rc::new(hops), order))
    }

    /// What robots do in the plan that they follow.
    pub(crate) fn followed(&self) -> &[Track] {
        self.followed
            .as_ref()
            .map_or(&[], |followed| &followed.tracks)
    }

    /// Whether the best plan is better than the one that is followed.
    pub(crate) fn has_better(&self) -> bool {
        let makespan = |best: &Option<Best>| best.as_ref().map(|best| best.makespan);
        makespan(&self.best) < makespan(&self.followed)
    }

    /// Robots follow the best plan from now on.
    pub(crate) fn accept_better(&mut self) {
        self.followed.clone_from(&self.best);
    }
}

/// What is left of moves and an order of them once some have begun; none if it is not one in which
/// they have.
fn rest_of(begun: &Begun, (hops, order): &Source) -> Option<(Vec<Step>, Vec<Item>)> {
    let rest = begun.rest(hops, order)?;
    let mut progress = Progress::new(hops);
    let numbers: Vec<usize> = order.iter().map(|&item| progress.make(item)).collect();
    let step = |&place: &usize| {
        let hop = &hops.list[numbers[place]];
        (hop.object, Rc::clone(&hop.to))
    };
    let sequence = rest.iter().map(step).collect();
    Some((sequence, rest.iter().map(|&place| order[place]).collect()))
}
