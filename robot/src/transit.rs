//! Transit: on the way to grasp, empty (Definition 3).
//!
//! Responsible for: what begins, interrupts and ends a transit: a grasp, or failure (rule 21).
//! Not responsible for: looks and waiting (`trip`).

use crate::account::{Doing, Thinking};
use crate::failure::Failing;
use crate::grasp::Grasping;
use crate::intent::Intent;
use crate::look::{Blocker, Leg};
use crate::now::Now;
use crate::phase::{Next, Phase};
use crate::trip::{Progress, Trip};

/// A transit to `task`'s object, from the first look on.
pub(crate) fn begin(now: &Now<'_>, intent: &mut Intent, task: usize) -> Phase {
    Phase::Transit(Trip::new(now, intent, Leg::Approach(task)))
}

/// A transit that goes on after a selection which left the robot its task.
pub(crate) fn resume(now: &Now<'_>, mut trip: Trip) -> Phase {
    trip.resume(now);
    Phase::Transit(trip)
}

/// Goes on towards the grasp.
pub(crate) fn act(
    mut trip: Trip,
    now: &Now<'_>,
    thinking: &mut Thinking,
    intent: &mut Intent,
) -> Next {
    match trip.advance(now, thinking, intent) {
        Progress::Computing => Next::Rest(Phase::Transit(trip), Doing::COMPUTING),
        Progress::Underway => Next::Rest(Phase::Transit(trip), Doing::waiting(u64::MAX)),
        Progress::Stalled {
            blocker, since_ns, ..
        } => {
            let patience_ns = thinking.settings.patience_ns;
            if blocker == Blocker::Objects || now.time_ns() >= since_ns + patience_ns {
                Next::Enter(Phase::Failing(Failing::begin(
                    now, thinking, intent, blocker,
                )))
            } else {
                // Failing is still to be done, so it is not settled.
                Next::Rest(Phase::Transit(trip), Doing::waiting(u64::MAX))
            }
        }
        Progress::Arrived => Next::Enter(Phase::Grasping(Grasping::new(now, trip))),
    }
}
