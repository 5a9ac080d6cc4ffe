//! Who claims and holds what, and who may therefore touch whom.
//!
//! Responsible for: claims, holds, grips, and the few exemptions from keeping apart.
//! Not responsible for: where bodies are (`bodies`), whether a change is legal (`checker`).
//!
//! Terms: a robot is *leaving* an object it has put down or given back, until it has been near it
//! and is no longer. Claims and leaving *waive* the clearance between the two; if the grasp lifts
//! the object from below, they waive the overlap too.

use nalgebra::Vector2;

use super::geometry::{Meeting, Solid};
use super::report::Who;
use crate::record::{SceneRecord, State};

/// Overlap deeper than this is a collision, m: the micrometre that divides touching from overlap,
/// and what joining and rounding pieces of motion may shift.
pub(super) const OVERLAP_M: f64 = 1e-6 + 1e-8;

/// How far two bodies must keep apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Apart {
    /// Not at all.
    Free,
    /// They may touch.
    Bare,
    /// By the clearance.
    Clearance,
}

/// A grip that opens or closes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Grip {
    /// It stands.
    Still,
    /// It closes since this time, ns.
    Closing(u64),
    /// It opens since this time, ns.
    Opening(u64),
    /// Batches are missing: nobody knows whether it moves, and since when.
    Unknown,
}

/// An object a robot is leaving.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Leaving {
    pub(super) object: usize,
    /// Whether the robot has been near it since it gave it back: it may still be under way there
    /// on path granted to it.
    pub(super) was_near: bool,
}

/// What a robot has to do with objects.
#[derive(Clone, Debug)]
pub(super) struct Hand {
    pub(super) claim: Option<usize>,
    pub(super) holding: Option<usize>,
    /// The grasp by which it holds that: its centre minus the other, m.
    pub(super) grasp: Vector2<f64>,
    pub(super) grip: Grip,
    pub(super) leaving: Vec<Leaving>,
}

/// Hands of all robots, holders of all objects.
pub(super) struct Rules {
    pub(super) hands: Vec<Hand>,
    pub(super) holders: Vec<Option<usize>>,
    /// Robots that take part no more.
    pub(super) gone: Vec<bool>,
    pass_under: Vec<bool>,
    lifts_from_below: Vec<bool>,
}

impl Rules {
    /// Nobody holds or claims anything.
    pub(super) fn new(scene: &SceneRecord) -> Self {
        let hand = Hand {
            claim: None,
            holding: None,
            grasp: Vector2::zeros(),
            grip: Grip::Still,
            leaving: Vec::new(),
        };
        let robot = Solid::from(&scene.robot.shape);
        let lifts_from_below = scene.objects.iter().map(|object| {
            let meeting = Meeting::of(&robot, &Solid::from(&object.shape));
            let mut grasps = std::iter::once(&object.grasp).chain(&object.other_grasps);
            grasps.any(|grasp| {
                let grasp = Vector2::from(*grasp);
                meeting.nearer_than(-OVERLAP_M, grasp, grasp).is_some()
            })
        });
        Self {
            hands: vec![hand; scene.homes.len()],
            holders: vec![None; scene.objects.len()],
            gone: vec![false; scene.homes.len()],
            pass_under: scene
                .objects
                .iter()
                .map(|object| object.pass_under)
                .collect(),
            lifts_from_below: lifts_from_below.collect(),
        }
    }

    /// Goes on with another version of the scene: nobody holds or claims what is new.
    pub(super) fn change(&mut self, scene: &SceneRecord) {
        let Self {
            mut hands,
            mut holders,
            mut gone,
            pass_under,
            lifts_from_below,
        } = Self::new(scene);
        let (robots, objects) = (self.hands.len(), self.holders.len());
        self.hands.append(&mut hands.split_off(robots));
        self.gone.append(&mut gone.split_off(robots));
        self.holders.append(&mut holders.split_off(objects));
        (self.pass_under, self.lifts_from_below) = (pass_under, lifts_from_below);
    }

    /// Takes over what a state record says. Who is leaving what, it does not say.
    pub(super) fn resume(&mut self, scene: &SceneRecord, state: &State) {
        for (hand, robot) in self.hands.iter_mut().zip(&state.robots) {
            let held = |object: usize| {
                let offset = Vector2::from(robot.at) - Vector2::from(state.objects[object].at);
                scene.objects[object].nearest_grasp(offset).0
            };
            *hand = Hand {
                claim: robot.task,
                holding: robot.holding,
                grasp: robot.holding.map_or_else(Vector2::zeros, held),
                grip: Grip::Unknown,
                leaving: Vec::new(),
            };
        }
        for (holder, object) in self.holders.iter_mut().zip(&state.objects) {
            *holder = object.holder;
        }
    }

    /// Whether the grasp of `object` puts the robot under it.
    pub(super) fn lifts_from_below(&self, object: usize) -> bool {
        self.lifts_from_below[object]
    }

    /// The robot that a body is, or is held by.
    pub(super) fn robot_of(&self, body: Who) -> Option<usize> {
        match body {
            Who::Robot(robot) => Some(robot),
            Who::Object(object) => self.holders[object],
            Who::Wall(_) | Who::Bounds => None,
        }
    }

    fn waives(&self, robot: usize, object: usize) -> bool {
        let hand = &self.hands[robot];
        let leaves = hand.leaving.iter().any(|leaving| leaving.object == object);
        hand.claim == Some(object) || leaves
    }

    /// How far `a` and `b` must keep apart. Clearance is kept by what moves; two that stand have
    /// come there by motion that was held to it.
    pub(super) fn apart(&self, a: Who, b: Who, moving: bool) -> Apart {
        let (robot_a, robot_b) = (self.robot_of(a), self.robot_of(b));
        if robot_a.is_some() && robot_a == robot_b {
            return Apart::Free;
        }
        if robot_a.is_none() && robot_b.is_none() {
            return Apart::Bare;
        }
        match (a, b) {
            (Who::Robot(robot), Who::Object(object)) | (Who::Object(object), Who::Robot(robot)) => {
                self.apart_from_object(robot, object, moving)
            }
            (Who::Object(object), Who::Object(other)) => {
                let waived = robot_a.is_some_and(|robot| self.waives(robot, other))
                    || robot_b.is_some_and(|robot| self.waives(robot, object));
                if waived || !moving {
                    Apart::Bare
                } else {
                    Apart::Clearance
                }
            }
            _ if moving => Apart::Clearance,
            _ => Apart::Bare,
        }
    }

    fn apart_from_object(&self, robot: usize, object: usize, moving: bool) -> Apart {
        let grounded = self.holders[object].is_none();
        let passes = self.pass_under[object] && self.hands[robot].holding.is_none();
        let waived = self.waives(robot, object);
        if grounded && (passes || waived && self.lifts_from_below[object]) {
            Apart::Free
        } else if waived || !moving {
            Apart::Bare
        } else {
            Apart::Clearance
        }
    }

    /// `robot` takes `object` up, by a grasp.
    pub(super) fn grasp(&mut self, robot: usize, object: usize, grasp: Vector2<f64>) {
        if let Some(other) = self.holders[object].replace(robot) {
            self.hands[other].holding = None;
        }
        if let Some(other) = self.hands[robot].holding.replace(object) {
            self.holders[other] = (other == object).then_some(robot);
        }
        let hand = &mut self.hands[robot];
        hand.grip = Grip::Still;
        hand.grasp = grasp;
        hand.claim = Some(object);
        // Whatever path it had been granted towards others is behind it now.
        hand.leaving.retain(|leaving| leaving.was_near);
    }

    /// `robot` puts `object` down, with which its claim ends.
    pub(super) fn release(&mut self, robot: usize, object: usize) {
        if self.holders[object] == Some(robot) {
            self.holders[object] = None;
        }
        let hand = &mut self.hands[robot];
        hand.holding = None;
        hand.grip = Grip::Still;
        hand.claim = None;
        self.leave(robot, object, true);
    }

    /// `robot` claims `object`.
    pub(super) fn claim(&mut self, robot: usize, object: usize) {
        self.unclaim(robot);
        let hand = &mut self.hands[robot];
        hand.claim = Some(object);
        hand.leaving.retain(|leaving| leaving.object != object);
    }

    /// `robot` gives back what it has claimed.
    pub(super) fn unclaim(&mut self, robot: usize) {
        if let Some(object) = self.hands[robot].claim.take() {
            self.leave(robot, object, false);
        }
    }

    /// `robot` is leaving `object` from now on.
    pub(super) fn leave(&mut self, robot: usize, object: usize, was_near: bool) {
        let leaving = &mut self.hands[robot].leaving;
        leaving.retain(|leaving| leaving.object != object);
        leaving.push(Leaving { object, was_near });
    }
}
