//! Going home, and being there, without a task (§II.C, rule 6).
//!
//! Responsible for: what begins, interrupts and ends the way home.
//! Not responsible for: looks and waiting (`trip`).

use crate::account::{Doing, Thinking};
use crate::intent::Intent;
use crate::look::Leg;
use crate::now::Now;
use crate::phase::{Next, Phase};
use crate::trip::{Progress, Trip};

/// The way home of a robot that has no task; none if it is there.
pub(crate) fn begin(now: &Now<'_>, intent: &mut Intent) -> Phase {
    intent.drop_rest(now);
    if now.stands_at(now.home()) {
        Phase::Idle
    } else {
        Phase::GoingHome(Trip::new(now, intent, Leg::Home))
    }
}

/// The way home that goes on after a selection which gave the robot no task.
pub(crate) fn resume(now: &Now<'_>, mut trip: Trip) -> Phase {
    trip.resume(now);
    Phase::GoingHome(trip)
}

/// Goes on towards home.
pub(crate) fn act(
    mut trip: Trip,
    now: &Now<'_>,
    thinking: &mut Thinking,
    intent: &mut Intent,
) -> Next {
    match trip.advance(now, thinking, intent) {
        Progress::Computing => Next::Rest(Phase::GoingHome(trip), Doing::COMPUTING),
        Progress::Underway => Next::Rest(Phase::GoingHome(trip), Doing::waiting(u64::MAX)),
        Progress::Stalled { looked_change, .. } => {
            Next::Rest(Phase::GoingHome(trip), Doing::waiting(looked_change))
        }
        Progress::Arrived => Next::Enter(Phase::Idle),
    }
}

/// Stays at home until a new epoch calls.
pub(crate) fn stay(now: &Now<'_>) -> Next {
    Next::Rest(Phase::Idle, Doing::idle(now.counted().change))
}
