//! Joining the pieces of motion of one body that lie on one straight line and go on at one
//! velocity, so that a trace holds a handful of records for each leg instead of one a tick.
//!
//! Responsible for: the rule by which two pieces are one.
//! Not responsible for: when pieces are written (`writer`).

use nalgebra::Vector2;

use crate::record::Motion;

/// How far a joined motion may lie from the pieces it was made of, m: far below the micrometre
/// that divides touching from overlap.
const MERGE_M: f64 = 1e-9;

/// A motion that may still grow.
pub(crate) struct Pending {
    motion: Motion,
    /// Metres per nanosecond, of its first piece. All later ones are held against this one line,
    /// so that errors do not add up.
    velocity: Vector2<f64>,
}

impl Pending {
    pub(crate) fn new(motion: Motion) -> Self {
        let (from, to): (Vector2<f64>, Vector2<f64>) = (motion.from.into(), motion.to.into());
        let duration = (motion.end_ns - motion.start_ns) as f64;
        Self {
            motion,
            velocity: (to - from) / duration,
        }
    }

    /// Takes `next` in if it goes on where this one ends, on the same line at the same velocity.
    pub(crate) fn extend(&mut self, next: &Motion) -> bool {
        let end: Vector2<f64> = self.motion.to.into();
        let start: Vector2<f64> = self.motion.from.into();
        let duration = next.end_ns.saturating_sub(self.motion.start_ns) as f64;
        let on_the_line = start + self.velocity * duration;
        let goes_on = next.start_ns == self.motion.end_ns
            && (Vector2::from(next.from) - end).norm() <= MERGE_M
            && (Vector2::from(next.to) - on_the_line).norm() <= MERGE_M;
        if goes_on {
            self.motion.end_ns = next.end_ns;
            self.motion.to = next.to;
        }
        goes_on
    }

    pub(crate) fn into_motion(self) -> Motion {
        self.motion
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{BodyKind, Place};

    fn piece(start_ns: u64, end_ns: u64, from: (f64, f64), to: (f64, f64)) -> Motion {
        Motion {
            body: BodyKind::Robot,
            id: 0,
            start_ns,
            end_ns,
            from: Place::new(from.0, from.1),
            to: Place::new(to.0, to.1),
        }
    }

    #[test]
    fn joins_what_goes_on_and_nothing_else() {
        let mut pending = Pending::new(piece(0, 10, (0.0, 0.0), (0.1, 0.2)));
        assert!(pending.extend(&piece(10, 30, (0.1, 0.2), (0.3, 0.6))));
        // Another direction, another speed, a pause, a jump.
        assert!(!pending.extend(&piece(30, 40, (0.3, 0.6), (0.5, 0.7))));
        assert!(!pending.extend(&piece(30, 40, (0.3, 0.6), (0.35, 0.7))));
        assert!(!pending.extend(&piece(31, 40, (0.3, 0.6), (0.39, 0.78))));
        assert!(!pending.extend(&piece(30, 40, (0.31, 0.6), (0.4, 0.8))));
        let motion = pending.into_motion();
        assert_eq!((motion.start_ns, motion.end_ns), (0, 30));
        assert_eq!(
            (motion.from, motion.to),
            (Place::new(0.0, 0.0), Place::new(0.3, 0.6))
        );
    }

    #[test]
    fn a_slow_curve_does_not_pass_as_a_line() {
        // Each piece turns by less than the tolerance; the sum of them does not.
        let mut pending = Pending::new(piece(0, 10, (0.0, 0.0), (0.005, 0.0)));
        let mut at = (0.005, 0.0);
        let mut joined = 0;
        for step in 1..1000_u64 {
            let to = (at.0 + 0.005, at.1 + 5e-10 * step as f64);
            if !pending.extend(&piece(10 * step, 10 * (step + 1), at, to)) {
                break;
            }
            joined += 1;
            at = to;
        }
        assert_eq!(
            joined, 1,
            "the second turn leaves the line by more than the tolerance"
        );
    }
}
