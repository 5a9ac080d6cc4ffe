//! Legal one-robot moves: somebody fetches an object, puts it down elsewhere and goes home, while
//! everybody else is at rest; and certificates made of such moves (rule 28).
//!
//! Responsible for: whether a move is legal, and whether a list of moves solves a scenario.
//! Not responsible for: finding such lists (`generate`), or plans in which several move at once.
//!
//! A move is reversible: read backwards it is the move from the other place, approach and return
//! exchanged. So a list that leads from the goals to the starts, read backwards, is a solution.

use std::fmt;

use crate::body::ROBOT_ALONE;
use crate::cspace::Occupancy;
use crate::draft::Move;
use crate::geometry::{CONTACT_M, Vec2};
use crate::reach::Flood;
use crate::scene::Scene;

/// Why a list of moves does not solve a scenario.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CertificateError {
    /// A move of an object that does not exist.
    #[error("move {step} is of object {object}, which does not exist")]
    NoSuchObject {
        /// Number of the move, from 0.
        step: usize,
        /// The object.
        object: usize,
    },
    /// A move that starts where its object is not.
    #[error("move {step} takes object {object} from a place where it is not")]
    NotThere {
        /// Number of the move, from 0.
        step: usize,
        /// The object.
        object: usize,
    },
    /// A move no robot can make.
    #[error("no robot can make move {step}, of object {object}: {part} is blocked for all of them")]
    Blocked {
        /// Number of the move, from 0.
        step: usize,
        /// The object.
        object: usize,
        /// The last part of the move that some robot failed at.
        part: MovePart,
    },
    /// An object that is elsewhere at the end.
    #[error("object {object} is not at its goal after the last move")]
    NotAtGoal {
        /// The object.
        object: usize,
    },
}

/// The parts of a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MovePart {
    /// From home to the grasp.
    Approach,
    /// From place to place.
    Transfer,
    /// From the new place home.
    Return,
}

impl fmt::Display for MovePart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Approach => "the approach",
            Self::Transfer => "the transfer",
            Self::Return => "the return",
        })
    }
}

/// Decides moves by floods; reuses its memory.
pub(crate) struct Mover {
    space: Occupancy,
    flood: Flood,
}

impl Mover {
    pub(crate) fn new(scene: &Scene) -> Self {
        Self {
            space: Occupancy::new(scene),
            flood: Flood::new(scene),
        }
    }

    /// Whether `robot` alone gets from its home to the grasp of `object` among all objects `at`
    /// their places and the other robots at home; and so whether it gets back.
    pub(crate) fn is_within_reach(
        &mut self,
        scene: &Scene,
        at: &[Vec2],
        object: usize,
        robot: usize,
    ) -> bool {
        self.space.reset(scene, ROBOT_ALONE);
        for (other, spec) in scene.objects.iter().enumerate() {
            let own = other == object;
            let passable = spec.pass_under || own && scene.lifts_from_below(object);
            if !passable {
                self.space.block(scene, &spec.shape, at[other], !own);
            }
        }
        self.block_parked(scene, robot);
        let grasp = scene.grasp_at(object, at[object]);
        self.flood.run(scene, &self.space, grasp);
        self.flood
            .reached_at(scene, &self.space, scene.homes[robot])
    }

    /// Floods all places `robot` can carry `object` to; ask [`Self::can_carry_to`] about them.
    pub(crate) fn carry(&mut self, scene: &Scene, at: &[Vec2], object: usize, robot: usize) {
        self.space.reset(scene, scene.objects[object].class);
        for (other, spec) in scene.objects.iter().enumerate() {
            if other != object {
                self.space.block(scene, &spec.shape, at[other], true);
            }
        }
        self.block_parked(scene, robot);
        let grasp = scene.grasp_at(object, at[object]);
        self.flood.run(scene, &self.space, grasp);
    }

    /// Whether the last [`Self::carry`] gets `object` to a place.
    pub(crate) fn can_carry_to(&self, scene: &Scene, object: usize, to: Vec2) -> bool {
        let release = scene.grasp_at(object, to);
        self.flood.reached_at(scene, &self.space, release)
    }

    fn block_parked(&mut self, scene: &Scene, mover: usize) {
        for (other, home) in scene.homes.iter().enumerate() {
            if other != mover {
                self.space.block(scene, &scene.robot.shape, *home, true);
            }
        }
    }

    /// Some robot that can make a move, or else how far the best one came. `at` is restored.
    fn robot_for(
        &mut self,
        scene: &Scene,
        at: &mut [Vec2],
        object: usize,
        to: Vec2,
    ) -> Result<usize, MovePart> {
        let mut furthest = MovePart::Approach;
        for robot in 0..scene.homes.len() {
            if !self.is_within_reach(scene, at, object, robot) {
                continue;
            }
            furthest = furthest.max(MovePart::Transfer);
            self.carry(scene, at, object, robot);
            if !self.can_carry_to(scene, object, to) {
                continue;
            }
            furthest = MovePart::Return;
            let from = std::mem::replace(&mut at[object], to);
            let returns = self.is_within_reach(scene, at, object, robot);
            at[object] = from;
            if returns {
                return Ok(robot);
            }
        }
        Err(furthest)
    }
}

/// Checks that moves, one after the other, bring every object to its goal.
///
/// # Errors
/// The first move that is not legal, or an object that is not at its goal in the end.
pub fn check_certificate(scene: &Scene, moves: &[Move]) -> Result<(), CertificateError> {
    let mut mover = Mover::new(scene);
    let mut at: Vec<_> = scene.objects.iter().map(|object| object.start).collect();
    let near = |a: Vec2, b: Vec2| (a - b).amax() <= CONTACT_M;
    for (step, Move { object, from, to }) in moves.iter().enumerate() {
        let (object, to) = (*object, Vec2::new(to[0], to[1]));
        if object >= at.len() {
            return Err(CertificateError::NoSuchObject { step, object });
        }
        if !near(at[object], Vec2::new(from[0], from[1])) {
            return Err(CertificateError::NotThere { step, object });
        }
        mover
            .robot_for(scene, &mut at, object, to)
            .map_err(|part| CertificateError::Blocked { step, object, part })?;
        at[object] = to;
    }
    let elsewhere = scene
        .objects
        .iter()
        .zip(&at)
        .position(|(object, at)| object.goal.is_some_and(|goal| !near(goal, *at)));
    match elsewhere {
        Some(object) => Err(CertificateError::NotAtGoal { object }),
        None => Ok(()),
    }
}
