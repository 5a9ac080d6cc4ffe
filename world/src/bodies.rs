//! What a moving body meets: walls, grounded objects, other bodies.
//!
//! Responsible for: who is an obstacle to whom, and the exact tests behind the broad phase. A
//! carried object is part of its robot's body (rule 3).
//! Not responsible for: what follows from a meeting (`grants.rs`, `invariants.rs`).
//!
//! Terms: *with clearance* means the moving body is grown by the scenario's clearance and the
//! obstacle is bare. A *waiver* says what of an object counts for one robot: a robot may touch
//! the object it has claimed, and whatever it has just put down or given up until it has left; an
//! object lifted from below is then no obstacle at all. A robot that carries nothing passes under
//! objects that allow it.

use std::cell::Cell;

use scene::{Body, ClassId, Scene, Vec2, overlap, swept_overlap, swept_regions_overlap};

use crate::broad::{Aabb, Ground, Walls};
use crate::state::Robot;
use crate::track::Track;

/// What of a grounded object counts for one robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Waiver {
    /// The object and the clearance around it.
    None,
    /// The object, not the clearance.
    Clearance,
    /// Nothing.
    All,
}

/// A straight sweep of a body of one class: centres of the robot, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sweep {
    pub(crate) class: ClassId,
    pub(crate) from: Vec2,
    pub(crate) to: Vec2,
}

impl Sweep {
    pub(crate) const fn standing(class: ClassId, at: Vec2) -> Self {
        Self {
            class,
            from: at,
            to: at,
        }
    }
}

/// The overlap tests of one scene.
#[derive(Clone, Debug)]
pub(crate) struct Bodies {
    pub(crate) ground: Ground,
    walls: Walls,
    /// Box of each class around the robot's centre, without and with clearance.
    boxes: Vec<(Aabb, Aabb)>,
    lifts_from_below: Vec<bool>,
    /// Exact tests made. A cell, so that testing needs no exclusive borrow.
    tests: Cell<u64>,
}

impl Bodies {
    /// All objects at their starts.
    pub(crate) fn new(scene: &Scene) -> Self {
        Self::with(scene, |object| Some(scene.objects[object].start))
    }

    /// The same count of tests, with a version of the scene and its objects at these places; none
    /// for one that is held.
    pub(crate) fn of_version(&self, scene: &Scene, place: impl Fn(usize) -> Option<Vec2>) -> Self {
        let mut bodies = Self::with(scene, place);
        bodies.tests = self.tests.clone();
        bodies.ground.comes_after(&self.ground);
        bodies
    }

    fn with(scene: &Scene, place: impl Fn(usize) -> Option<Vec2>) -> Self {
        let classes = scene.class_count();
        Self {
            ground: Ground::with(scene, place),
            walls: Walls::new(scene),
            boxes: (0..classes)
                .map(|class| {
                    let body = scene.body(ClassId(class));
                    (box_of(body, false), box_of(body, true))
                })
                .collect(),
            lifts_from_below: (0..scene.objects.len())
                .map(|object| scene.lifts_from_below(object))
                .collect(),
            tests: Cell::new(0),
        }
    }

    /// Exact swept tests made so far.
    pub(crate) const fn tests(&self) -> u64 {
        self.tests.get()
    }

    /// As if so many had been made.
    pub(crate) fn go_on_counting(&self, tests: u64) {
        self.tests.set(tests);
    }

    fn count(&self) {
        self.tests.set(self.tests.get() + 1);
    }

    /// Box that a body covers along a sweep.
    pub(crate) fn region(&self, sweep: Sweep, clearance: bool) -> Aabb {
        let (bare, grown) = self.boxes[sweep.class.0];
        Aabb::around(sweep.from, sweep.to).swept_by(if clearance { grown } else { bare })
    }

    /// Box that a body covers from `start` along `places`.
    pub(crate) fn region_along(
        &self,
        class: ClassId,
        start: Vec2,
        places: impl Iterator<Item = Vec2>,
    ) -> Aabb {
        let here = Aabb::around(start, start);
        let all = places.fold(here, |all, place| all.joined(Aabb::around(place, place)));
        all.swept_by(self.boxes[class.0].0)
    }

    /// Whether a sweep meets a wall.
    pub(crate) fn meets_wall(&self, scene: &Scene, sweep: Sweep, clearance: bool) -> bool {
        let body = scene.body(sweep.class);
        self.walls.any_near(self.region(sweep, clearance), |wall| {
            let (shape, at) = &scene.walls[wall];
            self.count();
            body.sweeps(sweep.from, sweep.to, clearance, shape, *at, *at)
        })
    }

    /// Whether an object at `at` would stand in a wall.
    pub(crate) fn object_meets_wall(&self, scene: &Scene, object: usize, at: Vec2) -> bool {
        let shape = &scene.objects[object].shape;
        self.walls.any_near(Aabb::of(shape).at(at), |wall| {
            let (wall, there) = &scene.walls[wall];
            overlap(shape, at, wall, *there)
        })
    }

    /// A grounded object that a sweep meets, each waived as `waiver` says.
    pub(crate) fn object_met(
        &self,
        scene: &Scene,
        sweep: Sweep,
        clearance: bool,
        waiver: impl Fn(usize) -> Waiver,
    ) -> Option<usize> {
        let body = scene.body(sweep.class);
        let region = self.region(sweep, clearance);
        self.ground.find_near(region, |object, at| {
            let grown = match waiver(object) {
                Waiver::None => clearance,
                Waiver::Clearance => false,
                Waiver::All => return false,
            };
            self.count();
            let shape = &scene.objects[object].shape;
            body.sweeps(sweep.from, sweep.to, grown, shape, at, at)
        })
    }

    /// Whether a sweep, with clearance or without, meets the bare sweep of another body, whatever
    /// the timing.
    pub(crate) fn sweeps_meet(
        &self,
        scene: &Scene,
        sweep: Sweep,
        clearance: bool,
        other: Sweep,
    ) -> bool {
        let path = std::slice::from_ref(&other.to);
        self.meets_path(scene, sweep, clearance, (other.class, other.from), path)
    }

    /// The same of a body that goes from where it is along `path`, or stands there if that is
    /// empty.
    pub(crate) fn meets_path(
        &self,
        scene: &Scene,
        sweep: Sweep,
        clearance: bool,
        (class, start): (ClassId, Vec2),
        path: &[Vec2],
    ) -> bool {
        let region = self.region(sweep, clearance);
        let (bare, _) = self.boxes[class.0];
        let stand = [start];
        let ends = if path.is_empty() { &stand } else { path };
        let mut from = start;
        ends.iter().any(|&to| {
            let piece = Sweep { class, from, to };
            from = to;
            let is_near = Aabb::around(piece.from, to).swept_by(bare).meets(&region);
            is_near && self.parts_meet(scene, sweep, clearance, piece)
        })
    }

    fn parts_meet(&self, scene: &Scene, sweep: Sweep, clearance: bool, other: Sweep) -> bool {
        let parts = &scene.body(sweep.class).parts;
        scene.body(other.class).parts.iter().any(|obstacle| {
            parts.iter().any(|part| {
                self.count();
                swept_regions_overlap(
                    part.shape(clearance),
                    sweep.from + part.offset,
                    sweep.to + part.offset,
                    &obstacle.bare,
                    other.from + obstacle.offset,
                    other.to + obstacle.offset,
                )
            })
        })
    }

    /// Whether two bodies, each straight and uniform over the same time, meet at some instant.
    pub(crate) fn motions_meet(
        &self,
        scene: &Scene,
        sweep: Sweep,
        clearance: bool,
        other: Sweep,
    ) -> bool {
        let (from, to) = (sweep.from - other.from, sweep.to - other.to);
        let relative = Sweep {
            class: sweep.class,
            from,
            to,
        };
        let standing = Sweep::standing(other.class, Vec2::zeros());
        if !self
            .region(relative, clearance)
            .meets(&self.region(standing, false))
        {
            return false;
        }
        let parts = &scene.body(sweep.class).parts;
        scene.body(other.class).parts.iter().any(|obstacle| {
            parts.iter().any(|part| {
                self.count();
                swept_overlap(
                    part.shape(clearance),
                    from + part.offset,
                    to + part.offset,
                    &obstacle.bare,
                    obstacle.offset,
                )
            })
        })
    }

    /// Whether two bodies on their tracks meet at some instant of the tick between the arc
    /// lengths `from_m` and `until_m`, which stand for times.
    pub(crate) fn tracks_meet(
        &self,
        scene: &Scene,
        (class, track): (ClassId, &Track),
        clearance: bool,
        (other_class, other): (ClassId, &Track),
        (from_m, until_m): (f64, f64),
    ) -> bool {
        let mut start_m = from_m;
        loop {
            let end_m = track
                .next_corner_m(start_m)
                .min(other.next_corner_m(start_m))
                .min(until_m);
            let sweep = Sweep {
                class,
                from: track.at(start_m),
                to: track.at(end_m),
            };
            let other_sweep = Sweep {
                class: other_class,
                from: other.at(start_m),
                to: other.at(end_m),
            };
            if self.motions_meet(scene, sweep, clearance, other_sweep) {
                return true;
            }
            if end_m >= until_m {
                return false;
            }
            start_m = end_m;
        }
    }

    /// Whether `robot`, or path granted to it, is where `object` stands, clearance included.
    pub(crate) fn is_around(&self, scene: &Scene, robot: &Robot, object: usize) -> bool {
        let Some(at) = self.ground.place(object) else {
            return false;
        };
        let body = scene.body(robot.class(scene));
        let shape = &scene.objects[object].shape;
        let mut from = robot.position;
        body.overlaps(from, true, shape, at)
            || robot.grant.points().iter().any(|&to| {
                let meets = body.sweeps(from, to, true, shape, at, at);
                from = to;
                meets
            })
    }

    /// What of `object`, which is on the ground, counts for `robot`.
    pub(crate) fn waiver(&self, scene: &Scene, robot: &Robot, object: usize) -> Waiver {
        let carries = robot.hand.object().is_some();
        if !carries && scene.objects[object].pass_under {
            return Waiver::All;
        }
        let own = robot.claim.is_some_and(|claim| claim.task == object);
        if !own && !robot.leaving.contains(object) {
            Waiver::None
        } else if self.lifts_from_below[object] {
            Waiver::All
        } else {
            Waiver::Clearance
        }
    }
}

fn box_of(body: &Body, clearance: bool) -> Aabb {
    let boxes = body
        .parts
        .iter()
        .map(|part| Aabb::of(part.shape(clearance)).at(part.offset));
    boxes
        .reduce(Aabb::joined)
        .unwrap_or_else(|| Aabb::around(Vec2::zeros(), Vec2::zeros()))
}
