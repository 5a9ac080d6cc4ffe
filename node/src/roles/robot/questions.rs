//! A robot's questions to the planner service.
//!
//! Responsible for: keeping a question until its answer has come, showing the robot an answer no
//! earlier than the tick after the planner's step, timing the way there and back.
//! Not responsible for: asking again when no answer comes (the robot does).

use std::collections::VecDeque;

use shm_types::{HardAnswer, HardRequest, Validate};

use crate::calls::{Call, Client, OPEN_CALLS};
use crate::clock;
use crate::histograms::Timed;
use crate::roles::{RoleError, Seat};

/// A robot's questions, and the newest answer.
pub(super) struct Questions {
    client: Client<HardRequest, HardAnswer>,
    /// Oldest first, with the time when each was asked.
    open: VecDeque<(u64, Call<HardRequest, HardAnswer>)>,
    /// Answered, but in a step of the planner on the present snapshot: for the next tick.
    early: Option<HardAnswer>,
    answer: Option<HardAnswer>,
}

impl Questions {
    pub(super) fn new(client: Client<HardRequest, HardAnswer>) -> Self {
        Self {
            client,
            open: VecDeque::with_capacity(OPEN_CALLS),
            early: None,
            answer: None,
        }
    }

    /// The newest answer stamped before the present tick.
    pub(super) const fn answer(&self) -> Option<HardAnswer> {
        self.answer
    }

    /// Takes in the answers that have come by `tick`.
    pub(super) fn receive(&mut self, seat: &mut Seat, tick: u64) -> Result<(), RoleError> {
        for _ in 0..self.open.len() {
            let Some((asked_ns, call)) = self.open.pop_front() else {
                break;
            };
            match call.answer()? {
                Some(answer) => {
                    // One that is none is as good as lost: the robot asks again.
                    if answer.validate(seat.counts()).is_ok() {
                        seat.record_since(Timed::HardRoundTrip, asked_ns);
                        self.early = Some(answer);
                    }
                }
                None => self.open.push_back((asked_ns, call)),
            }
        }
        if self.early.is_some_and(|answer| answer.tick < tick) {
            self.answer = self.early.take();
        }
        Ok(())
    }

    /// Asks. The oldest question is given up if there are too many.
    pub(super) fn ask(&mut self, question: HardRequest) -> Result<(), RoleError> {
        if self.open.len() == OPEN_CALLS {
            self.open.pop_front();
        }
        let asked_ns = clock::now_ns();
        self.open.push_back((asked_ns, self.client.call(question)?));
        Ok(())
    }
}
