//! A trip: look after look, to one place.
//!
//! Responsible for: when to look, what to ask for, when to wait and when the place is reached
//! (rules 20, 21).
//! Not responsible for: what is done there, what follows a failure.

use std::task::Poll;

use shm_types::StateHash;

use crate::account::Thinking;
use crate::blocker;
use crate::intent::Intent;
use crate::look::{Blocker, Counted, Leg, Look, Seen, View};
use crate::now::{Now, same_place};
use crate::request::Fate;

/// Rounding errors forgiven when motion is compared with what is granted, m.
const MOTION_TOLERANCE_M: f64 = 1e-9;

/// A sequence of looks to one place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trip {
    leg: Leg,
    state: State,
    /// Since when it gets no further: first look that found no way, or first time the queue was
    /// found too slow, since the robot last moved.
    blocked_since_ns: Option<u64>,
    /// Since when it stands still, or its last look, if that was later.
    still_since_ns: u64,
    /// When the last look ended.
    looked_ns: u64,
    /// What the snapshot counted when the last look began.
    seen: Counted,
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// A look is under way.
    Looking(Look),
    /// A way was found and its first piece asked for.
    Underway,
    /// The last look, of this view, found no way.
    Blocked(Blocker, View),
}

/// How a trip stands at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Progress {
    /// A look is not done.
    Computing,
    /// Something is granted, or asked for.
    Underway,
    /// It gets no further.
    Stalled {
        /// What stands in the way.
        blocker: Blocker,
        /// Since when, ns of virtual time.
        since_ns: u64,
        /// Value of `change` when the last look began: there is nothing new to see until that
        /// differs.
        looked_change: u64,
    },
    /// Its end is reached: the goal, home, or a grasp from which there is a way on.
    Arrived,
}

impl Trip {
    /// A trip that begins with a look; what was asked for on an earlier one is dropped.
    pub(crate) fn new(now: &Now<'_>, intent: &mut Intent, leg: Leg) -> Self {
        intent.drop_rest(now);
        let view = match leg {
            Leg::Approach(task) => View::Task(task),
            Leg::Transfer(_) | Leg::Home => View::Leg(leg),
        };
        Self::with(now, leg, State::Looking(Look::new(now, view)))
    }

    /// A trip whose first look is made and its first piece asked for.
    pub(crate) fn underway(now: &Now<'_>, leg: Leg) -> Self {
        Self::with(now, leg, State::Underway)
    }

    fn with(now: &Now<'_>, leg: Leg, state: State) -> Self {
        Self {
            leg,
            state,
            blocked_since_ns: None,
            still_since_ns: now.time_ns(),
            looked_ns: now.time_ns(),
            seen: now.counted(),
        }
    }

    /// Where it leads.
    pub(crate) fn leg(&self) -> Leg {
        self.leg
    }

    /// Goes on after an interruption: a look that was under way starts over.
    pub(crate) fn resume(&mut self, now: &Now<'_>) {
        if let State::Looking(look) = &mut self.state {
            *look = look.again(now);
        }
    }

    /// Goes on as far as this tick allows.
    pub(crate) fn advance(
        &mut self,
        now: &Now<'_>,
        thinking: &mut Thinking,
        intent: &mut Intent,
    ) -> Progress {
        if now.has_moved() {
            self.still_since_ns = now.time_ns();
            self.blocked_since_ns = None;
        }
        loop {
            let progress = match self.state {
                State::Looking(mut look) => {
                    let seen = look.advance(now, thinking);
                    self.state = State::Looking(look);
                    match seen {
                        Poll::Pending => Some(Progress::Computing),
                        Poll::Ready(seen) => self.looked(now, thinking, intent, &look, seen),
                    }
                }
                State::Underway => self.go_on(now, thinking, intent),
                State::Blocked(blocker, view) => self.wait(now, thinking, blocker, view),
            };
            if let Some(progress) = progress {
                return progress;
            }
        }
    }

    /// A look is done.
    fn looked(
        &mut self,
        now: &Now<'_>,
        thinking: &Thinking,
        intent: &mut Intent,
        look: &Look,
        seen: Seen,
    ) -> Option<Progress> {
        self.looked_ns = now.time_ns();
        self.still_since_ns = now.time_ns();
        self.seen = look.seen();
        match seen {
            Seen::Way if !same_place(look.from(), now.grant_end()) => {
                self.state = State::Looking(look.again(now));
                None
            }
            Seen::Way => {
                self.state = State::Underway;
                if matches!(self.leg, Leg::Transfer(_)) && now.holding().is_none() {
                    return Some(Progress::Arrived);
                }
                intent.ask(&thinking.ahead);
                None
            }
            Seen::Blocked(blocker) => {
                intent.drop_rest(now);
                self.blocked_since_ns.get_or_insert(now.time_ns());
                self.state = State::Blocked(blocker, look.view());
                None
            }
        }
    }

    /// A way was found, and its first piece asked for.
    fn go_on(
        &mut self,
        now: &Now<'_>,
        thinking: &Thinking,
        intent: &mut Intent,
    ) -> Option<Progress> {
        let target = self.leg.target(now);
        if now.me().grant_count == 0 && same_place(now.position(), target) {
            return self.arrive(now);
        }
        match intent.asked.fate(now.me()) {
            Fate::Sent => Some(Progress::Underway),
            Fate::Open => self.queue(now, thinking, intent),
            Fate::Granted if same_place(now.grant_end(), target) => Some(Progress::Underway),
            Fate::Granted if now.granted_m() > thinking.step_m + MOTION_TOLERANCE_M => {
                Some(Progress::Underway)
            }
            Fate::Granted | Fate::Refused => {
                self.state = State::Looking(Look::new(now, View::Leg(self.leg)));
                None
            }
        }
    }

    /// The end of the leg. An approach goes on with a look along the transfer, so that nothing is
    /// grasped that cannot be moved; the first piece of that way is used once it is grasped.
    fn arrive(&mut self, now: &Now<'_>) -> Option<Progress> {
        let Leg::Approach(task) = self.leg else {
            return Some(Progress::Arrived);
        };
        self.leg = Leg::Transfer(task);
        self.state = State::Looking(Look::new(now, View::Leg(self.leg)));
        None
    }

    /// The request, or a part of it, is in the world's queue. That is no failure (rule 20): the
    /// robot looks again only when it has got nowhere for as long as a blocked one waits.
    fn queue(
        &mut self,
        now: &Now<'_>,
        thinking: &Thinking,
        intent: &mut Intent,
    ) -> Option<Progress> {
        let settings = &thinking.settings;
        if now.time_ns() < self.still_since_ns + settings.look_again_ns {
            return Some(Progress::Underway);
        }
        let since_ns = *self.blocked_since_ns.get_or_insert(self.still_since_ns);
        if now.counted() != self.seen {
            intent.drop_rest(now);
            self.state = State::Looking(Look::new(now, View::Leg(self.leg)));
            return None;
        }
        Some(self.stalled(Blocker::Robot(blocker::nearest(now)), since_ns))
    }

    /// No way was found. The robot looks again whenever something was grasped or put down or a
    /// constraint is new, and else now and then, as long as there is something new to see.
    fn wait(
        &mut self,
        now: &Now<'_>,
        thinking: &Thinking,
        blocker: Blocker,
        view: View,
    ) -> Option<Progress> {
        let is_due = now.time_ns() >= self.looked_ns + thinking.settings.look_again_ns
            || now.counted().placements != self.seen.placements;
        if is_due && now.counted() != self.seen {
            self.state = State::Looking(Look::new(now, view));
            return None;
        }
        let since_ns = *self.blocked_since_ns.get_or_insert(now.time_ns());
        Some(self.stalled(blocker, since_ns))
    }

    fn stalled(&self, blocker: Blocker, since_ns: u64) -> Progress {
        Progress::Stalled {
            blocker,
            since_ns,
            looked_change: self.seen.change,
        }
    }

    /// Adds what it carries, in a fixed order.
    pub(crate) fn hash_into(&self, hash: &mut StateHash) {
        let (leg, task) = match self.leg {
            Leg::Approach(task) => (0, task as u64),
            Leg::Transfer(task) => (1, task as u64),
            Leg::Home => (2, 0),
        };
        hash.add(&[
            leg,
            task,
            self.blocked_since_ns.unwrap_or(u64::MAX),
            self.still_since_ns,
            self.looked_ns,
            self.seen.change,
            self.seen.placements,
        ]);
        match self.state {
            State::Looking(look) => look.hash_into(hash),
            State::Underway => hash.add(&3_u64),
            State::Blocked(blocker, view) => hash.add(&[blocker.code(), view.code()]),
        }
    }
}
