//! Which open tasks have to do with one another at all: what stands near what is grasped.
//!
//! Responsible for: keeping, by place, where each open task's object may stand (its initial place
//! and its goal) and where a robot's centre is that grasps it there; finding those so close that
//! the bodies may overlap. Never misses one.
//! Not responsible for: whether they do (`easy`, `floods`).

use scene::near::{Aabb, Near};
use scene::{Scene, Vec2};

use crate::places::Places;

/// Cells along the side of the box in which two bodies may overlap: smaller cells hold less that
/// is not asked for, but there are more of them to look into.
const CELLS_PER_REACH: f64 = 2.0;
/// Wider than rounding, m.
const ROUNDING_M: f64 = 1e-6;

/// A task at one of its two places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AtPlace {
    pub(crate) task: usize,
    /// At its goal, not at its initial place.
    pub(crate) goal: bool,
}

/// Open tasks by place.
#[derive(Clone, Debug)]
pub(crate) struct Nearby {
    /// Centres of objects, two a task.
    standing: Near,
    /// Centres of robots that grasp them.
    grasping: Near,
    /// Where the centre of any object is relative to that of any robot it may overlap, or what
    /// that robot carries.
    reach: Aabb,
}

impl Nearby {
    /// Room for the tasks of `scene`; none is there yet.
    pub(crate) fn new(scene: &Scene) -> Self {
        let nothing = Aabb::around(Vec2::zeros(), Vec2::zeros());
        let shapes = (scene.objects.iter())
            .map(|object| Aabb::of(&object.shape))
            .fold(nothing, Aabb::joined);
        let bodies = (scene.objects.iter())
            .flat_map(|object| &scene.body(object.class).parts)
            .map(|part| Aabb::of(&part.grown).at(part.offset))
            .fold(nothing, Aabb::joined);
        let reach = Aabb {
            min: bodies.min - shapes.max,
            max: bodies.max - shapes.min,
        };
        let cell_m = (reach.max - reach.min).max() / CELLS_PER_REACH;
        let places = 2 * scene.objects.len();
        Self {
            standing: Near::new(scene, places, cell_m),
            grasping: Near::new(scene, places, cell_m),
            reach,
        }
    }

    /// Takes over where a task's object may stand; nowhere if it is not open.
    pub(crate) fn set(&mut self, scene: &Scene, task: usize, places: Option<Places>) {
        for goal in [false, true] {
            let thing = 2 * task + usize::from(goal);
            self.standing.take(thing);
            self.grasping.take(thing);
            if let Some(places) = places {
                let at = places.at(goal);
                self.standing.put(thing, at);
                self.grasping.put(thing, at + scene.objects[task].grasp);
            }
        }
    }

    /// Calls `visit` with every task that may be grasped so close to an object at `at` (m) that
    /// the bodies come within `margin_m` of one another.
    pub(crate) fn for_each_grasped_near(
        &self,
        at: Vec2,
        margin_m: f64,
        visit: impl FnMut(AtPlace),
    ) {
        for_each(
            &self.grasping,
            at - self.reach.max,
            at - self.reach.min,
            margin_m,
            visit,
        );
    }

    /// Calls `visit` with every task whose object may stand so close to a robot grasping at `at`
    /// (its centre, m) that the bodies overlap.
    pub(crate) fn for_each_standing_near(&self, at: Vec2, visit: impl FnMut(AtPlace)) {
        for_each(
            &self.standing,
            at + self.reach.min,
            at + self.reach.max,
            0.0,
            visit,
        );
    }
}

fn for_each(near: &Near, low: Vec2, high: Vec2, margin_m: f64, mut visit: impl FnMut(AtPlace)) {
    let margin = Vec2::repeat(margin_m + ROUNDING_M);
    let region = Aabb {
        min: low - margin,
        max: high + margin,
    };
    near.find(region, |thing, at| {
        if region.meets(&Aabb::around(at, at)) {
            visit(AtPlace {
                task: thing / 2,
                goal: thing % 2 == 1,
            });
        }
        false
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::{Draft, ObjectDraft};

    #[test]
    fn what_comes_within_the_margin_is_found() {
        let mut draft = Draft::room("test", [0.0, 0.0, 5.0, 5.0]);
        draft.homes = vec![[0.5, 0.5]];
        // Robots are 0.5 m wide, objects 0.4 m, and grasped from 0.45 m below.
        draft.objects = vec![ObjectDraft::paper([1.0, 2.5], Some([4.0, 4.0]))];
        let scene = Scene::new(draft).unwrap();
        let mut nearby = Nearby::new(&scene);
        nearby.set(&scene, 0, Places::at_start(&scene).next().flatten());
        let found = |margin_m| {
            let mut found = Vec::new();
            // 5 cm below the robot that grasps it.
            let at = Vec2::new(1.0, 2.5 - 0.45 - 0.25 - 0.05 - 0.2);
            nearby.for_each_grasped_near(at, margin_m, |end| found.push(end));
            found
        };
        let initial = AtPlace {
            task: 0,
            goal: false,
        };
        assert_eq!(found(0.06), [initial]);
        assert_eq!(found(0.04), []);
    }
}
