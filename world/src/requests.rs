//! Path requests: what a robot asks for, checked before it waits in the queue.
//!
//! Responsible for: that a request starts where the standing grant ends, stays in the room and
//! crosses no wall. Not responsible for: objects and other robots, which come and go
//! (`grants.rs`).

use scene::{Scene, Vec2};
use shm_types::PathRequest;

use crate::bodies::{Bodies, Sweep};
use crate::path::{ARRIVAL_M, Path};
use crate::state::{Robot, is_at};

/// Takes `request` if it is newer than the last one: what was asked for before and not granted is
/// dropped, whatever comes of the new one. False if it is no sound request.
pub(crate) fn take(
    scene: &Scene,
    bodies: &Bodies,
    robot: &mut Robot,
    request: &PathRequest,
    tick: u64,
) -> bool {
    if request.id <= robot.request || robot.hand.is_moving() {
        return true;
    }
    robot.request = request.id;
    robot.request_tick = tick;
    robot.refused = false;
    robot.drop_rest();
    let Some((first, ahead)) = request.points().split_first() else {
        return true;
    };
    let start = robot.grant_end();
    if !is_at(scene::vec(*first), start) {
        return false;
    }
    let path = corners(start, ahead.iter().copied().map(scene::vec));
    let sound = stays_inside(scene, &path) && crosses_no_wall(scene, bodies, robot, &path);
    if sound {
        robot.rest = path;
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
