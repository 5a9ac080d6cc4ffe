//! What the invariants have found clear, so that they look again only at what has changed.
//!
//! Responsible for: for each robot the *way* that was looked at last, from where it stood along all
//! that was granted to it, and whether it has left it since. Not responsible for: looking
//! (`invariants.rs`).
//!
//! Nothing tells it of changes: it compares what is with what was looked at, value by value. A way
//! is as good as new while the robot is on it, its grant is no more than what is left of it, and
//! all else that the answer depends on is the same ([`Terms`]).

use scene::{ClassId, Scene, Vec2};
use shm_types::capacity::MAX_PATH_POINTS;

use crate::bodies::Bodies;
use crate::broad::Aabb;
use crate::path::ARRIVAL_M;
use crate::state::{Leaving, Robot};

/// As far off a straight line (m) rounding may lead in one tick: over as many ticks as one piece
/// of path takes it stays far below what divides touching from overlap.
const ON_LINE_M: f64 = ARRIVAL_M / 1_000.0;

/// What decides on an overlap besides where the robot is.
#[derive(Clone, Copy, Debug)]
struct Terms {
    class: ClassId,
    /// The rest says what of the objects is an obstacle to it, and that none has come.
    put_downs: u64,
    carries: bool,
    claim: Option<usize>,
    leaving: Leaving,
}

impl Terms {
    fn of(scene: &Scene, bodies: &Bodies, robot: &Robot) -> Self {
        Self {
            class: robot.class(scene),
            put_downs: bodies.ground.put_downs(),
            carries: robot.hand.object().is_some(),
            claim: robot.claim.map(|claim| claim.task),
            leaving: robot.leaving,
        }
    }

    /// Whether they are these.
    #[inline]
    fn are_those_of(&self, scene: &Scene, bodies: &Bodies, robot: &Robot) -> bool {
        self.class == robot.class(scene)
            && self.put_downs == bodies.ground.put_downs()
            && self.carries == robot.hand.object().is_some()
            && self.claim == robot.claim.map(|claim| claim.task)
            && self.leaving == robot.leaving
    }
}

/// What is to be looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Change {
    /// In this tick the robot was where it was not known to be clear.
    pub(crate) strayed: bool,
    /// Pieces of its grant from this one on are not known to be clear.
    pub(crate) new_from: usize,
}

/// One robot's way.
#[derive(Clone, Debug)]
pub(crate) struct Cleared {
    /// On which terms; `None` if nothing is clear.
    terms: Option<Terms>,
    /// Its corners; those before `at` are left behind.
    corners: [Vec2; MAX_PATH_POINTS + 1],
    count: usize,
    at: usize,
    /// Box of what the body covers on it.
    region: Aabb,
    /// What has changed since, and then on what terms and where the robot is now.
    change: Option<Change>,
    now_on: Option<Terms>,
    now: Aabb,
}

impl Cleared {
    /// Nothing is.
    pub(crate) fn nothing() -> Self {
        Self {
            terms: None,
            corners: [Vec2::zeros(); MAX_PATH_POINTS + 1],
            count: 0,
            at: 0,
            region: Aabb::around(Vec2::zeros(), Vec2::zeros()),
            change: None,
            now_on: None,
            now: Aabb::around(Vec2::zeros(), Vec2::zeros()),
        }
    }

    /// Compares where `robot` was in this tick, and what is granted to it, with the way.
    pub(crate) fn compare(&mut self, scene: &Scene, bodies: &Bodies, robot: &Robot) {
        let known = (self.terms.as_ref()).is_some_and(|t| t.are_those_of(scene, bodies, robot));
        let strayed = !known || !self.follow(robot.track.corners());
        let points = robot.grant.points();
        let left = if strayed {
            &[]
        } else {
            &self.corners[self.at + 1..self.count]
        };
        let same = points.iter().zip(left).take_while(|(a, b)| a == b);
        let new_from = same.count();
        // What was given back is no longer clear: somebody else may get it.
        self.count = self.count.min(self.at + 1 + new_from);
        self.change = (strayed || new_from < points.len()).then_some(Change { strayed, new_from });
        if self.change.is_some() {
            let terms = Terms::of(scene, bodies, robot);
            let places = robot.track.corners().iter().map(|&(_, place)| place);
            let places = places.chain(points.iter().copied());
            self.now = bodies.region_along(terms.class, robot.position, places);
            self.now_on = Some(terms);
        }
    }

    /// What has changed since the way was looked at, if anything has.
    pub(crate) fn change(&self) -> Option<Change> {
        self.change
    }

    /// Box that holds all that the body has covered in this tick and may cover on its grant.
    pub(crate) fn region(&self) -> Aabb {
        if self.change.is_some() {
            self.now
        } else {
            self.region
        }
    }

    /// What was compared is clear, of the grant the first `clear` points.
    pub(crate) fn accept(&mut self, robot: &Robot, clear: usize) {
        (self.terms, self.region) = (self.now_on, self.now);
        self.corners[0] = robot.position;
        self.corners[1..=clear].copy_from_slice(&robot.grant.points()[..clear]);
        (self.at, self.count) = (0, clear + 1);
    }

    /// Goes along the way with a tick's motion, corner by corner, and leaves behind what is
    /// passed; `false` as soon as that is somewhere else.
    fn follow(&mut self, track: &[(f64, Vec2)]) -> bool {
        let mut last = None;
        for &(_, place) in track {
            if let Some(corner) = last {
                self.pass(corner);
            }
            let from = self.corners[self.at];
            let to = self.corners[(self.at + 1).min(self.count - 1)];
            if !is_between(from, to, place) {
                return false;
            }
            self.corners[self.at] = place;
            last = Some(place);
        }
        if let Some(place) = last {
            self.pass(place);
        }
        true
    }

    /// Leaves corners at `place` behind.
    fn pass(&mut self, place: Vec2) {
        while self.at + 1 < self.count && self.corners[self.at + 1] == place {
            self.at += 1;
        }
    }
}

/// Whether `place` is on the straight line from `from` to `to`.
fn is_between(from: Vec2, to: Vec2, place: Vec2) -> bool {
    if place == from || place == to {
        return true;
    }
    let (along, off) = (to - from, place - from);
    let square = along.norm_squared();
    let (cross, dot) = (along.perp(&off), along.dot(&off));
    cross * cross <= ON_LINE_M * ON_LINE_M * square && 0.0 < dot && dot < square
}
