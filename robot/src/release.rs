//! Releasing: the grip opens, at the goal.
//!
//! Responsible for: asking for the release until the object is on the ground.
//! Not responsible for: whether the task is completed by it (the world).

use shm_types::Grip;

use crate::account::Doing;
use crate::intent::Intent;
use crate::now::Now;
use crate::phase::{Next, Phase};
use crate::{home, select};

/// Goes on releasing.
pub(crate) fn act(now: &Now<'_>, intent: &mut Intent) -> Next {
    if now.holding().is_some() {
        return Next::Rest(Phase::Releasing, Doing::gripping(Grip::Release));
    }
    intent.claim = select::claim(now, None);
    Next::Enter(if now.epoch() == intent.selected_epoch {
        home::begin(now, intent)
    } else {
        Phase::Selecting(select::Selecting::after(None))
    })
}
