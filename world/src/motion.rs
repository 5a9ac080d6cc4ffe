//! Motion: robots use up granted path.
//!
//! Responsible for: moving each robot to the end of its track, what it holds with it, and telling
//! the recorder piece by piece. Not responsible for: where the track leads (`grants.rs`).
//!
//! A held object is always at the robot's centre minus its grasp, computed anew: nothing drifts.

use scene::Scene;
use shm_types::BodyKind;

use crate::journal::Journal;
use crate::objects::Objects;
use crate::state::Robot;

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
    objects: &mut Objects,
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
            objects[object].position = robot.place_of(scene, object);
        }
    }
}

fn record(i: usize, robot: &Robot, scene: &Scene, span: Span, journal: &mut Journal<'_>) {
    let carried = robot
        .hand
        .object()
        .map(|object| (object, scene.objects[object].grasps[robot.grasp].offset));
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

#[cfg(test)]
mod tests {
    use shm_types::{BodyKind, Grip, MotionRecord};

    use crate::testing::{BELOW, Bench, room};

    fn of(bench: &Bench, body: BodyKind) -> Vec<MotionRecord> {
        let motions = bench.batch.motions().iter();
        motions.filter(|m| m.body == body.code()).copied().collect()
    }

    #[test]
    fn pieces_join_in_space_and_time_and_add_up_to_the_speed() {
        let mut bench = Bench::new(room(&[[1.0, 1.0]], &[], BELOW, ""));
        let corners = [[1.003, 1.0], [1.003, 1.001], [1.006, 1.001], [3.0, 1.001]];
        bench.ask(0, &corners);
        let (mut at, mut end_ns) = (bench.robot(0).position, 0);
        for _ in 0..10 {
            bench.step();
            let pieces = of(&bench, BodyKind::Robot);
            assert_eq!(bench.batch.time_ns, bench.header().time_ns);
            for piece in pieces {
                assert_eq!((piece.from, piece.start_ns), (at, end_ns));
                let length_m =
                    (piece.to.x - piece.from.x).abs() + (piece.to.y - piece.from.y).abs();
                let exact_ns = length_m / 0.5 * 1e9;
                let taken_ns = (piece.end_ns - piece.start_ns) as f64;
                assert!(
                    (taken_ns - exact_ns).abs() <= 1.0,
                    "{taken_ns} for {exact_ns}"
                );
                (at, end_ns) = (piece.to, piece.end_ns);
            }
        }
        assert_eq!(bench.robot(0).position, at);
        assert_eq!(end_ns, bench.header().time_ns);
        assert!((at.x - 1.049).abs() < 1e-12, "{at:?}");
    }

    #[test]
    fn a_held_object_moves_with_its_robot() {
        let objects = [[[1.0, 1.45], [5.0, 5.0]]];
        let mut bench = Bench::new(room(&[[1.0, 1.0]], &objects, BELOW, ""));
        bench.claim(0, 0);
        bench.step();
        bench.grasp(0);
        bench.ask(0, &[[1.1, 1.0], [1.3, 1.2]]);
        for _ in 0..80 {
            bench.step();
            let (robot, object) = (bench.robot(0).position, bench.object(0).position);
            assert_eq!(object.x, robot.x);
            assert_eq!(object.y, robot.y + 0.45);
            let (robots, objects) = (of(&bench, BodyKind::Robot), of(&bench, BodyKind::Object));
            assert_eq!(robots.len(), objects.len());
            for (r, o) in robots.iter().zip(&objects) {
                assert_eq!((r.start_ns, r.end_ns), (o.start_ns, o.end_ns));
                assert_eq!((o.to.x, o.to.y), (r.to.x, r.to.y + 0.45));
            }
        }
        assert_eq!(bench.at(0), [1.3, 1.2]);
        bench.grip(0, Grip::Release);
        bench.step();
        assert_eq!(bench.object(0).rest, bench.object(0).position);
    }

    #[test]
    fn a_stale_command_holds_its_robot() {
        let mut bench = Bench::new(room(&[[1.0, 1.0]], &[], BELOW, ""));
        bench.ask(0, &[[8.0, 1.0]]);
        bench.step();
        let last = bench.commands[0].valid_until_tick;
        while bench.header().tick <= last {
            bench.step_as_is();
        }
        let at = bench.at(0);
        assert!(at[0] > 1.0);
        for _ in 0..5 {
            bench.step_as_is();
        }
        assert_eq!(bench.at(0), at);
        assert!(bench.robot(0).grant_count > 0, "its grant stays");
        assert_eq!(bench.world.counters().stale_commands, 5);
        bench.step();
        assert!(bench.at(0)[0] > at[0], "a fresh one frees it");
    }

    #[test]
    fn a_robot_that_computes_stands_still_and_keeps_its_grant() {
        let mut bench = Bench::new(room(&[[1.0, 1.0]], &[], BELOW, ""));
        bench.ask(0, &[[8.0, 1.0]]);
        bench.step();
        bench.commands[0].go = 0;
        bench.steps(5);
        assert_eq!(bench.at(0), [1.005, 1.0]);
        assert_eq!(bench.robot(0).grant().last().unwrap().x, 8.0);
    }
}
