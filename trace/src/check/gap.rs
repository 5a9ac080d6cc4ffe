//! Over a gap in a trace: what was before it is tested, what is in it unknown, and the next state
//! is a new start.
//!
//! Responsible for: leaving off and going on.
//! Not responsible for: finding the gap (`writer`).

use super::checker::Checker;
use crate::reader::Span;
use crate::record::Gap;

impl Checker {
    /// Batches are missing from here on: what was so far is tested, the rest unknown.
    pub(super) fn lose(&mut self, gap: Gap) {
        self.settle_all();
        self.missing_batches = self.missing_batches.saturating_add(gap.batches);
        self.lost_until = Some(gap.before_tick.saturating_sub(1));
    }

    /// Goes on after a gap from the first state that shows what came of it, and drops what is
    /// older. Says whether there is one.
    pub(super) fn resume(&mut self, span: &mut Span, tick: u64) -> bool {
        let Some(first) = span.states.iter().position(|state| state.tick >= tick) else {
            return false;
        };
        let state = span.states[first].clone();
        self.lost_until = None;
        self.bodies.resume(&state);
        self.rules.resume(&self.scene, &state);
        self.last_state = (state.tick, state.epoch, state.constraints_version);
        self.events.epoch = self.events.epoch.max(state.epoch);
        for robot in 0..self.rules.hands.len() {
            for object in 0..self.rules.holders.len() {
                let (_, is_near) = self
                    .bodies
                    .nearness(robot, object, state.time_ns, &self.rules);
                if is_near {
                    self.rules.leave(robot, object, true);
                }
            }
        }
        span.states.retain(|other| other.tick > state.tick);
        span.events.retain(|event| event.tick > state.tick);
        span.motions.retain_mut(|motion| {
            if motion.start_ns < state.time_ns {
                motion.from = motion.at(state.time_ns).into();
                motion.start_ns = state.time_ns;
            }
            motion.start_ns < motion.end_ns
        });
        true
    }
}
