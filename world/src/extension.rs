//! How far one grant can grow.
//!
//! Responsible for: whether a robot may be granted a straight piece of path, in space or in time,
//! and the farthest such piece on its way. Not responsible for: whose turn it is (`grants.rs`).
//!
//! The robot that asks keeps its clearance, the others count bare. Walls need no test here: a
//! request that crosses one was refused when it came (`requests.rs`).

use scene::{Scene, Vec2};

use crate::bodies::{Bodies, Sweep};
use crate::broad::Aabb;
use crate::guards::{Guard, Guards};
use crate::path::ARRIVAL_M;
use crate::state::Robot;

/// Why an extension is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// A grounded object is in the way.
    Object,
    /// Another robot is.
    Robot(usize),
}

/// What comes of asking for a piece of path.
pub(crate) struct Farthest {
    /// Where the extension ends, and whether that is the segment's own end.
    pub(crate) end: Option<(Vec2, bool)>,
    /// What is in the way of more.
    pub(crate) refusal: Option<Refusal>,
}

/// What a grant has to keep clear of.
#[derive(Clone, Copy)]
pub(crate) struct Field<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) bodies: &'a Bodies,
    pub(crate) guards: Guards,
    pub(crate) robots: &'a [Robot],
    /// Box of each robot's region.
    pub(crate) regions: &'a [Aabb],
}

impl Field<'_> {
    /// Whether robot `i` may be granted the piece `from`–`to`, whatever the timing: it meets no
    /// grounded object and no other robot's region.
    pub(crate) fn check_in_space(&self, i: usize, from: Vec2, to: Vec2) -> Result<(), Refusal> {
        let sweep = self.check_ground(i, from, to)?;
        self.check_others(i, sweep, |other| {
            self.meets_path(sweep, other, other.position, other.grant.points())
        })
    }

    /// Whether robot `i` may go on to `to` at the end of its track, within a tick of `tick_m`:
    /// it meets no grounded object, no other body at any instant, and nothing that stays granted
    /// to others after the tick.
    pub(crate) fn check_in_time(&self, i: usize, to: Vec2, tick_m: f64) -> Result<(), Refusal> {
        let track = &self.robots[i].track;
        let sweep = self.check_ground(i, track.end(), to)?;
        let longer = track.then(to);
        self.check_others(i, sweep, |other| {
            let ahead = &other.grant.points()[other.track.used()..];
            let class = other.class(self.scene);
            (!ahead.is_empty() && self.meets_path(sweep, other, other.track.end(), ahead))
                || self.bodies.tracks_meet(
                    self.scene,
                    (sweep.class, &longer),
                    true,
                    (class, &other.track),
                    (track.moved_m(), tick_m),
                )
        })
    }

    fn check_ground(&self, i: usize, from: Vec2, to: Vec2) -> Result<Sweep, Refusal> {
        let robot = &self.robots[i];
        let sweep = Sweep {
            class: robot.class(self.scene),
            from,
            to,
        };
        let waiver = |object| self.bodies.waiver(self.scene, robot, object);
        match self.bodies.object_met(self.scene, sweep, true, waiver) {
            Some(_) => Err(Refusal::Object),
            None => Ok(sweep),
        }
    }

    /// Asks `meets` of every other robot whose region is near the sweep.
    fn check_others(
        &self,
        i: usize,
        sweep: Sweep,
        meets: impl Fn(&Robot) -> bool,
    ) -> Result<(), Refusal> {
        let swept = self.bodies.region(sweep, true);
        for (j, region) in self.regions.iter().enumerate() {
            let is_met = j != i && swept.meets(region) && meets(&self.robots[j]);
            if !self.guards.holds(Guard::Grants, !is_met) {
                return Err(Refusal::Robot(j));
            }
        }
        Ok(())
    }

    /// Whether a sweep with clearance meets the body of `other` along `path` from `start`.
    fn meets_path(&self, sweep: Sweep, other: &Robot, start: Vec2, path: &[Vec2]) -> bool {
        let other = (other.class(self.scene), start);
        (self.bodies).meets_path(self.scene, sweep, true, other, path)
    }
}

/// The farthest point from `from` towards `to`, at most `limit_m` away, that `check` lets pass:
/// the whole way, or else a multiple of `step_m`.
pub(crate) fn farthest(
    from: Vec2,
    to: Vec2,
    limit_m: f64,
    step_m: f64,
    mut check: impl FnMut(Vec2) -> Result<(), Refusal>,
) -> Farthest {
    let length_m = (to - from).norm();
    let whole = length_m <= limit_m + ARRIVAL_M;
    let limit_m = limit_m.min(length_m);
    let towards = (to - from) / length_m.max(ARRIVAL_M);
    let end = if whole { to } else { from + towards * limit_m };
    let Err(mut refusal) = check(end) else {
        return Farthest {
            end: Some((end, whole)),
            refusal: None,
        };
    };
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a positive number of steps within a room"
    )]
    let (mut granted, mut refused) = (0_u32, ((limit_m / step_m).ceil() as u32).max(1));
    let mut farthest = None;
    while refused - granted > 1 {
        // The first step first: whoever stands right in front of something asks but twice.
        let steps = if granted == 0 {
            1
        } else {
            granted + (refused - granted) / 2
        };
        let end = from + towards * (f64::from(steps) * step_m);
        match check(end) {
            Ok(()) => {
                granted = steps;
                farthest = Some((end, false));
            }
            Err(nearer) => {
                refused = steps;
                refusal = nearer;
            }
        }
    }
    Farthest {
        end: farthest,
        refusal: Some(refusal),
    }
}
