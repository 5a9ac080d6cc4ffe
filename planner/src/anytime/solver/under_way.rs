//! Making a plan better while robots follow it.
//!
//! Responsible for: what is looked for anew, and which plan counts after that.
//! Not responsible for: what robots keep (`keep`).

use std::rc::Rc;

use scene::Scene;

use crate::anytime::ground::Time;
use crate::anytime::order::Hops;
use crate::anytime::sequence::Step;
use crate::anytime::solver::{Best, Solver};
use crate::anytime::track::{Start, Track};

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
        let Some((hops, followed_order)) = &followed.source else {
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
        let mut made = vec![0; kept.len()];
        let mut order = Vec::new();
        let mut sequence: Vec<Step> = Vec::new();
        for &(object, robot) in followed_order {
            let index = object as usize;
            if made[index] >= kept[index] {
                let hop = hops.of[index].0 + made[index] as usize;
                order.push((object, robot));
                sequence.push((index, Rc::clone(&hops.list[hop].to)));
            }
            made[index] += 1;
        }
        if order.is_empty() {
            return false;
        }
        self.known.clear();
        let (start, homes) = (&self.start, &self.homes);
        let Some(hops) = Hops::new(scene, &mut self.ground, start, homes, &sequence) else {
            return false;
        };
        self.current = Some((Rc::new(hops), order));
        self.tried.clear();
        self.misses = 0;
        self.best = Some(Best {
            source: self.current.clone(),
            ..followed
        });
        self.followed.clone_from(&self.best);
        true
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
