//! Grasping no earlier than an object can be brought on.
//!
//! Responsible for: which grasps of a first plan wait, and until when.
//! Not responsible for: the way itself (`route`), what is listed meanwhile (`publish`).
//!
//! How: what a robot has grasped it brings to its place (`keep`), so a grasp long before that is
//! fixed before better plans are found. Where the move is done as soon, the robot waits with free
//! hands instead.

use crate::anytime::ground::{Ground, Time};
use crate::anytime::plan::Plan;
use crate::anytime::rounds::MOST_PATIENCE_S;
use crate::anytime::route::{Leg, Piece, Router, Target, Then};
use crate::anytime::track::Move;

/// A robot that would wait for longer at a grasp has not begun it, s.
pub(in crate::anytime) const LONG_WAIT_S: f64 = 1.0;

impl Plan {
    /// Lets a robot that would hold an object for long before it can put it down wait with free
    /// hands instead, if it is done as soon: what it has not grasped yet can still be planned anew.
    pub(super) fn grasp_late(
        &self,
        ground: &Ground,
        router: &mut Router,
        wanted: &Move,
        legs: &mut [Leg; 3],
        end: Time,
        way: &mut Vec<Piece>,
    ) {
        let Some(late) = late_grasp(ground, legs, way) else {
            return;
        };
        legs[0].then = Then::Grasp(late);
        let mut quest = self.quest(wanted, legs, 0);
        quest.limit = end.saturating_add(1);
        let mut later = Vec::new();
        if (router.find(ground, &self.timeline, &quest, &mut later)).is_some() {
            *way = later;
        }
    }
}

/// When the grasp of a move may begin at the latest, with the walls alone; none if the object is not
/// held for much longer than it takes to bring it to its place, or once plans change no more.
fn late_grasp(ground: &Ground, legs: &[Leg; 3], way: &[Piece]) -> Option<Time> {
    let mut grips = way.iter().filter_map(|piece| match piece {
        Piece::Grip(end) => Some(*end),
        Piece::Step(..) => None,
    });
    let (grasped, released) = (grips.next()?, grips.next()?);
    if grasped > ground.time(MOST_PATIENCE_S) {
        return None;
    }
    let Target::Place(at, _) = legs[0].target else {
        return None;
    };
    let late = released.checked_sub(legs[1].ahead(at)? + ground.release)?;
    (late > grasped + ground.time(LONG_WAIT_S)).then(|| late - ground.grasp)
}
