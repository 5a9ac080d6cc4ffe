//! Motion: robots use up granted path.
//!
//! Responsible for: moving each robot to the end of its track, what it holds with it, and telling
//! the recorder piece by piece. Not responsible for: where the track leads (`grants.rs`).
//!
//! A held object is always at the robot's centre minus its grasp, computed anew: nothing drifts.

use scene::Scene;
use shm_types::BodyKind;

use crate::journal::Journal;
use crate::state::{Object, Robot};

/// The tick in which the motion takes place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    /// World time at its start, ns.
    pub(crate) start_ns: u64,
    /// Its length, ns.
    pub(crate) tick_ns: u64,
    /// Arc length of a whole tick at full speed, m.
    pub(crate) tick_m: f64,
}

impl Span {
    /// World time at which `gone_m` of the tick's arc length has passed, ns.
    fn time_ns(&self, gone_m: f64) -> u64 {
        #[expect(
            clippy::cast_precision_loss,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a share of one tick, far below 2^53 ns"
        )]
        let into_ns = (gone_m / self.tick_m * self.tick_ns as f64).round() as u64;
        self.start_ns + into_ns.min(self.tick_ns)
    }
}

/// Moves every robot along its track.
pub(crate) fn advance(
    scene: &Scene,
    robots: &mut [Robot],
    objects: &mut [Object],
    span: Span,
    journal: &mut Journal<'_>,
) {
    for (i, robot) in robots.iter_mut().enumerate() {
        robot.granted_m = robot.grant.length_from(robot.position);
        let track = robot.track;
        robot.grant.drop_front(track.used());
        robot.moved = track.corners().len() > 1;
        if !robot.moved {
            continue;
        }
        robot.position = track.end();
        record(i, robot, scene, span, journal);
        if let Some(object) = robot.hand.object() {
            objects[object].position = robot.position - scene.objects[object].grasp;
        }
    }
}

fn record(i: usize, robot: &Robot, scene: &Scene, span: Span, journal: &mut Journal<'_>) {
    let carried = robot
        .hand
        .object()
        .map(|object| (object, scene.objects[object].grasp));
    let pieces = robot.track.corners().len() as u64 - 1;
    let mut start_ns = span.start_ns;
    for (piece, ((_, from), (gone_m, to))) in (1..).zip(robot.track.pieces()) {
        // However short, a piece takes a nanosecond, and leaves one to each that follows.
        let latest_ns = (span.start_ns + span.tick_ns).saturating_sub(pieces - piece);
        let end_ns = span.time_ns(gone_m).min(latest_ns).max(start_ns + 1);
        journal.motion(BodyKind::Robot, i, (start_ns, from), (end_ns, to));
        if let Some((object, grasp)) = carried {
            let (from, to) = (from - grasp, to - grasp);
            journal.motion(BodyKind::Object, object, (start_ns, from), (end_ns, to));
        }
        start_ns = end_ns;
    }
}
