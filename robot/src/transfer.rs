//! Transfer: on the way with an object (Definition 2).
//!
//! Responsible for: what begins and ends a transfer. A robot that carries keeps its task
//! (rule 19), and when blocked waits with its object (rule 21).
//! Not responsible for: looks and waiting (`trip`).

use crate::account::{Doing, Thinking};
use crate::intent::Intent;
use crate::look::Leg;
use crate::now::{Now, same_place};
use crate::phase::{Next, Phase};
use crate::trip::{Progress, Trip};

/// A transfer of an object the robot finds itself holding.
pub(crate) fn begin(now: &Now<'_>, intent: &mut Intent, task: usize) -> Phase {
    Phase::Transfer(Trip::new(now, intent, Leg::Transfer(task)))
}

/// A transfer right after the grasp: along the way found just before it, or, if grasping took
/// time, after another look.
pub(crate) fn after_grasp(
    now: &Now<'_>,
    thinking: &Thinking,
    intent: &mut Intent,
    task: usize,
) -> Phase {
    let is_fresh = now.scene.robot.grasp_ns == 0
        && thinking
            .ahead
            .start()
            .is_some_and(|start| same_place(start, now.grant_end()));
    if is_fresh {
        intent.ask(&thinking.ahead);
        Phase::Transfer(Trip::underway(now, Leg::Transfer(task)))
    } else {
        begin(now, intent, task)
    }
}

/// Goes on towards the goal.
pub(crate) fn act(
    mut trip: Trip,
    now: &Now<'_>,
    thinking: &mut Thinking,
    intent: &mut Intent,
) -> Next {
    match trip.advance(now, thinking, intent) {
        Progress::Computing => Next::Rest(Phase::Transfer(trip), Doing::COMPUTING),
        Progress::Underway => Next::Rest(Phase::Transfer(trip), Doing::waiting(u64::MAX)),
        Progress::Stalled { looked_change, .. } => {
            Next::Rest(Phase::Transfer(trip), Doing::waiting(looked_change))
        }
        Progress::Arrived => Next::Enter(Phase::Releasing),
    }
}
