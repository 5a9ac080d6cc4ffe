//! Which robot stands in the way.
//!
//! Responsible for: finding the first robot, body or granted path, that a path crosses.
//! Not responsible for: finding that path, or deciding what follows (rule 21).

use scene::{Body, ClassId, ROBOT_ALONE, Vec2, swept_regions_overlap, vec};
use shm_types::{RobotState, index};

use crate::now::Now;

/// The first robot that a body of class `moving` meets along `path`; of several met on the same
/// straight piece the lowest. `None` if it meets none.
pub(crate) fn first_on(now: &Now<'_>, moving: ClassId, path: &[Vec2]) -> Option<usize> {
    let moving = now.scene.body(moving);
    path.windows(2).find_map(|piece| {
        let others = now.snapshot.robots().iter().enumerate();
        others
            .filter(|(other, _)| *other != now.id)
            .find(|(_, robot)| meets(now, moving, piece[0], piece[1], robot))
            .map(|(other, _)| other)
    })
}

/// The robot nearest to this one; of several the lowest. `None` if it is alone.
pub(crate) fn nearest(now: &Now<'_>) -> Option<usize> {
    let distance = |robot: &RobotState| (vec(robot.position) - now.position()).norm_squared();
    let others = now.snapshot.robots().iter().enumerate();
    others
        .filter(|(other, _)| *other != now.id)
        .min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)))
        .map(|(other, _)| other)
}

/// Whether a body that moves straight crosses where `robot` is or may go.
fn meets(now: &Now<'_>, moving: &Body, from: Vec2, to: Vec2, robot: &RobotState) -> bool {
    let class = index(robot.holding).map_or(ROBOT_ALONE, |held| now.scene.objects[held].class);
    let standing = now.scene.body(class);
    let mut start = vec(robot.position);
    let here = std::iter::once(&robot.position);
    here.chain(robot.grant()).any(|corner| {
        let end = vec(*corner);
        let met = moving.parts.iter().any(|part| {
            standing.parts.iter().any(|other| {
                swept_regions_overlap(
                    &part.grown,
                    from + part.offset,
                    to + part.offset,
                    &other.bare,
                    start + other.offset,
                    end + other.offset,
                )
            })
        });
        start = end;
        met
    })
}
