//! Path requests: what a robot asks for, checked before it waits in the queue.
//!
//! Responsible for: that a request starts where the standing grant ends, stays in the room and
//! crosses no wall; where a schedule is followed, that each of its points ends an action of the
//! one in force. Not responsible for: objects and other robots, which come and go
//! (`grants.rs`).

use scene::{Scene, Vec2};
use shm_types::PathRequest;

use crate::bodies::{Bodies, Sweep};
use crate::guards::{Guard, Guards};
use crate::path::{ARRIVAL_M, Path};
use crate::state::{Robot, is_at};

/// What a request is held against.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InForce {
    pub(crate) guards: Guards,
    /// The present tick.
    pub(crate) tick: u64,
    /// Version of the schedule; 0 for none.
    pub(crate) schedule_version: u32,
}

/// Takes `request` if it is newer than the last one: what was asked for before and not granted is
/// dropped, whatever comes of the new one. False if it is no sound request.
pub(crate) fn take(
    scene: &Scene,
    bodies: &Bodies,
    robot: &mut Robot,
    request: &PathRequest,
    in_force: InForce,
) -> bool {
    let newer = request.id > robot.request;
    if !in_force.guards.holds(Guard::Request, newer) || robot.hand.is_moving() {
        return true;
    }
    robot.request = request.id;
    robot.request_tick = in_force.tick;
    robot.refused = false;
    robot.drop_rest();
    if request.schedule_version != in_force.schedule_version {
        // Late: what it asks for may have changed.
        return true;
    }
    let Some((first, ahead)) = request.points().split_first() else {
        return true;
    };
    let start = robot.grant_end();
    if !is_at(scene::vec(*first), start) {
        return false;
    }
    let path = corners(start, ahead.iter().copied().map(scene::vec));
    let ends_actions = in_force.schedule_version == 0
        || path.points().len() == ahead.len()
            && request.actions as usize == robot.actions as usize + ahead.len().max(1);
    let sound =
        ends_actions && stays_inside(scene, &path) && crosses_no_wall(scene, bodies, robot, &path);
    if sound {
        robot.rest = path;
        robot.actions = request.actions;
    }
    sound
}

/// The points, without those too near to the one before to be a motion; the last stays.
fn corners(start: Vec2, points: impl Iterator<Item = Vec2>) -> Path {
    let mut path = Path::EMPTY;
    let mut at = start;
    for point in points {
        if (point - at).norm() > ARRIVAL_M {
            path.push(point);
        } else {
            path.replace_last(point);
        }
        at = path.last().unwrap_or(start);
    }
    path
}

fn stays_inside(scene: &Scene, path: &Path) -> bool {
    let (low, high) = scene.bounds;
    path.points()
        .iter()
        .all(|p| (low.x..=high.x).contains(&p.x) && (low.y..=high.y).contains(&p.y))
}

fn crosses_no_wall(scene: &Scene, bodies: &Bodies, robot: &Robot, path: &Path) -> bool {
    let class = robot.class(scene);
    let mut from = robot.grant_end();
    path.points().iter().all(|&to| {
        let sweep = Sweep { class, from, to };
        from = to;
        !bodies.meets_wall(scene, sweep, true)
    })
}

#[cfg(test)]
mod tests {
    use crate::testing::{BELOW, Bench, room};

    fn bench() -> Bench {
        let objects = [[[3.0, 1.0], [5.0, 5.0]]];
        Bench::new(room(&[[1.0, 1.0], [1.0, 3.0]], &objects, BELOW, ""))
    }

    fn refused(bench: &mut Bench, corners: &[[f64; 2]]) -> bool {
        let before = bench.world.counters().invalid_requests;
        bench.ask(0, corners);
        bench.step();
        let request = bench.commands[0].path.id;
        assert_eq!(bench.robot(0).request, request, "taken, good or bad");
        bench.world.counters().invalid_requests > before
    }

    #[test]
    fn a_path_through_a_wall_or_out_of_the_room_is_refused() {
        for bad in [[0.2, 1.0], [-5.0, 1.0], [1e12, 1.0], [1.0, 7.0]] {
            let mut bench = bench();
            assert!(refused(&mut bench, &[[1.5, 1.0], bad]), "{bad:?}");
            assert_eq!(bench.robot(0).request_open, 0);
            assert_eq!(bench.robot(0).grant_count, 0);
        }
        assert!(
            !refused(&mut bench(), &[[1.5, 1.0], [1.5, 0.25]]),
            "touching"
        );
    }

    #[test]
    fn a_path_that_starts_elsewhere_is_refused() {
        let mut bench = bench();
        bench.ask(0, &[[2.0, 1.0]]);
        bench.commands[0].path.points[0].x += 1e-3;
        bench.steps(3);
        assert_eq!(bench.world.counters().invalid_requests, 1, "counted once");
        assert_eq!(bench.at(0), [1.0, 1.0]);
        assert!(!refused(&mut bench, &[[2.0, 1.0]]), "the next one is good");
    }

    #[test]
    fn a_newer_request_replaces_what_is_not_granted() {
        let mut bench = bench();
        bench.ask(0, &[[8.0, 1.0]]);
        bench.steps(600);
        assert_eq!(bench.robot(0).request_open, 1, "the object is in the way");
        let x = bench.at(0)[0];
        bench.ask(0, &[[x, 2.0], [8.0, 2.0]]);
        bench.steps(2_000);
        assert_eq!(bench.at(0), [8.0, 2.0]);
    }

    #[test]
    fn an_empty_request_drops_what_is_not_granted() {
        let mut bench = bench();
        bench.ask(0, &[[8.0, 1.0]]);
        bench.step();
        bench.ask(0, &[]);
        bench.commands[0].path.count = 0;
        bench.steps(600);
        assert_eq!(bench.robot(0).request_open, 0);
        assert!(bench.at(0)[0] > 2.0, "what was granted stays");
        assert_eq!(bench.world.counters().invalid_requests, 0);
    }

    #[test]
    fn points_on_top_of_each_other_are_one() {
        let mut bench = bench();
        let corners = [[1.0, 1.0], [2.0, 1.0], [2.0, 1.0], [2.0 + 1e-12, 1.0]];
        bench.drive(0, &corners);
        assert_eq!(bench.at(0), [2.0 + 1e-12, 1.0]);
    }

    #[test]
    fn an_older_request_is_not_taken_again() {
        let mut bench = bench();
        bench.ask(0, &[[1.5, 1.0]]);
        bench.step();
        bench.ask(0, &[[2.0, 1.0]]);
        bench.commands[0].path.id = 1;
        bench.steps(300);
        assert_eq!(bench.at(0), [1.5, 1.0]);
        assert_eq!(bench.world.counters().invalid_requests, 0);
    }
}
