//! How a run ends: whether a solved one is solved, and whether its end record tells what happened.
//!
//! Responsible for: final configurations (rule 6), the report.
//! Not responsible for: what happened before.

use nalgebra::Vector2;

use super::bodies::SAME_PLACE_M;
use super::checker::Checker;
use super::report::{CheckReport, Kind, Who};
use crate::record::Outcome;

impl Checker {
    /// The end of the trace; `has_ended` if it has an `end` record.
    pub(super) fn finish(mut self, has_ended: bool) -> CheckReport {
        self.settle_all();
        if self.lost_until.is_none() {
            self.test_end();
        }
        let is_told_whole = self.end.as_ref().is_some_and(|end| end.complete);
        let (violations, unlisted_violations) = self.findings.into_sorted();
        CheckReport {
            violations,
            unlisted_violations,
            swept_tests: self.bodies.tests(),
            complete: is_told_whole && self.missing_batches == 0,
            truncated: !has_ended,
            missing_batches: self.missing_batches,
            checked_until_ns: self.last.time_ns,
            outcome: self.end.map(|end| end.outcome),
        }
    }

    fn test_end(&mut self) {
        let Some(end) = &self.end else {
            return;
        };
        let (outcome, makespan_ns) = (end.outcome, end.makespan_ns);
        if let Some((time_ns, told)) = self.events.ended
            && (told, time_ns) != (outcome, makespan_ns)
        {
            self.findings.add(Kind::Final, time_ns, &[], || {
                format!(
                    "the run ended as {told:?} at {:.3} s, but the end record says {outcome:?} at {:.3} s",
                    time_ns as f64 / 1e9,
                    makespan_ns as f64 / 1e9
                )
            });
        }
        if let Some((end_ns, who)) = self.last_motion.filter(|&(end_ns, _)| end_ns > makespan_ns) {
            self.findings.add(Kind::Final, end_ns, &[who], || {
                format!("{who} moves after the run's end")
            });
        }
        if outcome == Outcome::Solved {
            self.test_solved(makespan_ns);
        }
    }

    fn test_solved(&mut self, time_ns: u64) {
        let is_off = |who, place| {
            (self.bodies.at(who, u64::MAX) - Vector2::from(place)).norm() > SAME_PLACE_M
        };
        for (id, home) in self.scene.homes.iter().enumerate() {
            // Nobody can bring home who is gone.
            if self.rules.gone[id] {
                continue;
            }
            let who = Who::Robot(id);
            if is_off(who, *home) {
                self.findings.add(Kind::Final, time_ns, &[who], || {
                    format!("{who} does not end at home")
                });
            }
            if let Some(held) = self.rules.hands[id].holding {
                self.findings
                    .add(Kind::Final, time_ns, &[who, Who::Object(held)], || {
                        format!("{who} ends with object {held} in its hand")
                    });
            }
        }
        for (id, object) in self.scene.objects.iter().enumerate() {
            let who = Who::Object(id);
            if object.goal.is_some_and(|goal| is_off(who, goal)) {
                self.findings.add(Kind::Final, time_ns, &[who], || {
                    format!("{who} does not end at its goal")
                });
            }
        }
    }
}
