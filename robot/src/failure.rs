//! Failing: there is no manipulation path for the selected task (rule 21).
//!
//! Responsible for: reporting the failure, asking the planner which hard constraints were missed
//! where the method wants that, and holding out until the answer is there and the failure is
//! counted.
//! Not responsible for: deciding that a task has failed (`transit`), the constraints (`planner`),
//! bars and epochs (the world).
//!
//! A robot that waits for the answer stands still and counts as computing (rule 24).

use shm_types::{Failure, FailureCause, HardRequest, NONE, StateHash, index};

use crate::account::{Doing, Thinking};
use crate::intent::Intent;
use crate::look::Blocker;
use crate::now::Now;
use crate::phase::{Next, Phase};
use crate::select::{self, Selecting};

/// How long a question may stay unanswered before it is asked again, ns of virtual time.
const ASK_AGAIN_NS: u64 = 5_000_000_000;

/// A failure that is not counted yet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Failing {
    stage: Stage,
}

#[derive(Clone, Copy, Debug)]
enum Stage {
    /// The planner has been asked.
    Asked {
        /// When first, ns of virtual time.
        since_ns: u64,
        /// When last.
        asked_ns: u64,
    },
    /// The world has been told that there is no answer to wait for.
    Told {
        /// Number of the first command that said so.
        sequence: u64,
    },
}

impl Failing {
    /// The failure of the claimed task. Robots that block are no matter for constraints.
    pub(crate) fn begin(
        now: &Now<'_>,
        thinking: &Thinking,
        intent: &mut Intent,
        blocker: Blocker,
    ) -> Self {
        let (cause, blocker) = match blocker {
            Blocker::Objects => (FailureCause::Objects, NONE),
            Blocker::Robot(robot) => (
                FailureCause::Robots,
                robot.map_or(NONE, |robot| robot as u32),
            ),
            Blocker::Anything => (FailureCause::Robots, NONE),
        };
        let asks = cause == FailureCause::Objects && thinking.settings.method.restricts();
        intent.drop_rest(now);
        intent.failure = Failure {
            id: intent.failure.id + 1,
            task: intent.claim.task,
            cause: cause.code(),
            blocker,
            answered: u32::from(!asks),
            reserved: 0,
            epoch: intent.claim.epoch,
        };
        let time_ns = now.time_ns();
        let stage = if asks {
            intent.hard_request = hard_request(now, intent);
            Stage::Asked {
                since_ns: time_ns,
                asked_ns: time_ns,
            }
        } else {
            Stage::Told {
                sequence: intent.sequence,
            }
        };
        Self { stage }
    }

    /// Holds out for the answer, then for the world. Asking again costs nothing: the planner
    /// knows the failure by its id.
    pub(crate) fn act(mut self, now: &Now<'_>, thinking: &Thinking, intent: &mut Intent) -> Next {
        let time_ns = now.time_ns();
        let settings = &thinking.settings;
        if now.epoch() != intent.selected_epoch {
            // The task is back in the pool (rule 18), and another robot's perhaps.
            intent.claim = select::claim(now, None);
        }
        match self.stage {
            Stage::Asked { since_ns, .. }
                if is_answered(now, intent)
                    || time_ns >= since_ns + settings.answer_deadline_ns =>
            {
                intent.failure.answered = 1;
                self.stage = Stage::Told {
                    sequence: intent.sequence,
                };
            }
            Stage::Asked { since_ns, asked_ns } if time_ns >= asked_ns + ASK_AGAIN_NS => {
                intent.hard_request = hard_request(now, intent);
                self.stage = Stage::Asked {
                    since_ns,
                    asked_ns: time_ns,
                };
            }
            Stage::Told { sequence }
                if now.has_acknowledged(sequence) && now.epoch() != intent.selected_epoch =>
            {
                return Next::Enter(Phase::Selecting(Selecting::after(None)));
            }
            Stage::Asked { .. } | Stage::Told { .. } => {}
        }
        Next::Rest(Phase::Failing(self), Doing::COMPUTING)
    }

    /// Adds what it carries, in a fixed order.
    pub(crate) fn hash_into(&self, hash: &mut StateHash) {
        match self.stage {
            Stage::Asked { since_ns, asked_ns } => hash.add(&[0, since_ns, asked_ns]),
            Stage::Told { sequence } => hash.add(&[1, sequence, 0]),
        }
    }
}

/// Whether the planner's answer to this failure is there.
fn is_answered(now: &Now<'_>, intent: &Intent) -> bool {
    now.answer.is_some_and(|answer| {
        answer.robot as usize == now.id
            && answer.incarnation == now.incarnation
            && answer.failure == intent.failure.id
    })
}

/// The question which hard constraints the failure shows to be missing.
fn hard_request(now: &Now<'_>, intent: &Intent) -> Option<HardRequest> {
    index(intent.failure.task)?;
    Some(HardRequest {
        robot: now.id as u32,
        incarnation: now.incarnation,
        failure: intent.failure.id,
        task: intent.failure.task,
        tick: now.snapshot.header.tick,
        epoch: intent.failure.epoch,
    })
}
