//! Which records can be read at all.
//!
//! Responsible for: refusing records that name bodies the scene does not have, numbers no body
//! can have, shapes that are none, so that no code past the reader needs to distrust an id or a
//! length.
//! Not responsible for: whether the run they tell of is a legal one (`check`).

use nalgebra::Vector2;
use shm_types::capacity::{MAX_OBJECTS, MAX_PATH_POINTS, MAX_ROBOTS};

use crate::record::{BodyKind, ObjectNow};
use crate::record::{
    Event, FORMAT, Happening, Motion, Outline, Place, RobotNow, SceneRecord, State,
};

/// Largest coordinate or length, m: beyond it an `f64` no longer resolves a micrometre safely.
const MAX_LENGTH_M: f64 = 1e6;
/// Most corners of one shape.
const MAX_POINTS: usize = 256;
/// Most walls.
const MAX_WALLS: usize = 4_096;

/// Why a record cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unfit {
    /// A format of another version of this program.
    #[error("has format {found}, but this program reads formats up to {FORMAT}")]
    Format {
        /// The format found.
        found: u32,
    },
    /// Nobody has this number.
    #[error("names {what} {id}, but there are only {count}")]
    Id {
        /// What is named.
        what: &'static str,
        /// Its number.
        id: usize,
        /// Numbers below this exist.
        count: usize,
    },
    /// More than fits.
    #[error("has {count} {what}, but {most} are the most there can be")]
    Count {
        /// What is counted.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// The most there can be.
        most: usize,
    },
    /// A number that is not finite or absurd.
    #[error("has an impossible {what}")]
    Number {
        /// What it is of.
        what: &'static str,
    },
    /// A record that cannot stand where it stands.
    #[error("{what}")]
    Place {
        /// What is wrong.
        what: &'static str,
    },
}

type Fit = Result<(), Unfit>;

/// What a scene record may say behind another one.
pub(crate) fn version(next: &SceneRecord, before: &SceneRecord) -> Fit {
    let same = |what, holds: bool| {
        if holds {
            Ok(())
        } else {
            Err(Unfit::Place { what })
        }
    };
    same(
        "changes the room",
        (next.low, next.high) == (before.low, before.high),
    )?;
    same("changes what robots are like", next.robot == before.robot)?;
    same("moves homes", next.homes.starts_with(&before.homes))?;
    let is_same = next.objects.len() >= before.objects.len()
        && next
            .objects
            .iter()
            .zip(&before.objects)
            .all(|(next, before)| {
                (&next.shape, next.grasp, next.pass_under)
                    == (&before.shape, before.grasp, before.pass_under)
            });
    same("changes what objects are like", is_same)
}

fn ensure(holds: bool, what: &'static str) -> Fit {
    if holds {
        Ok(())
    } else {
        Err(Unfit::Number { what })
    }
}

fn id(what: &'static str, id: usize, count: usize) -> Fit {
    if id < count {
        Ok(())
    } else {
        Err(Unfit::Id { what, id, count })
    }
}

fn most(what: &'static str, count: usize, most: usize) -> Fit {
    if count <= most {
        Ok(())
    } else {
        Err(Unfit::Count { what, count, most })
    }
}

fn place(what: &'static str, place: Place) -> Fit {
    // NaN and the infinities fail these comparisons.
    ensure(
        place.x.abs() <= MAX_LENGTH_M && place.y.abs() <= MAX_LENGTH_M,
        what,
    )
}

fn length(what: &'static str, length_m: f64) -> Fit {
    ensure(length_m > 0.0 && length_m <= MAX_LENGTH_M, what)
}

fn outline(outline: &Outline) -> Fit {
    match outline {
        Outline::Box { half } => {
            length("width", half.x)?;
            length("width", half.y)
        }
        Outline::Circle { radius } => length("radius", *radius),
        Outline::Polygon { points } => {
            most("corners", points.len(), MAX_POINTS)?;
            points
                .iter()
                .try_for_each(|point| place("corner", *point))?;
            ensure(
                points.len() >= 3 && is_convex(points),
                "polygon (it is not convex and counter-clockwise)",
            )
        }
    }
}

/// Every corner turns left, and all of them together once round.
fn is_convex(points: &[Place]) -> bool {
    let corner = |i: usize| Vector2::from(points[i % points.len()]);
    let mut turned = 0.0;
    for i in 0..points.len() {
        let (before, after) = (corner(i + 1) - corner(i), corner(i + 2) - corner(i + 1));
        let turn = before.perp(&after);
        if turn <= 0.0 {
            return false;
        }
        turned += turn.atan2(before.dot(&after));
    }
    turned < 1.5 * std::f64::consts::TAU
}

pub(crate) fn scene(scene: &SceneRecord) -> Fit {
    if scene.format != FORMAT {
        return Err(Unfit::Format {
            found: scene.format,
        });
    }
    most("robots", scene.homes.len(), MAX_ROBOTS)?;
    most("objects", scene.objects.len(), MAX_OBJECTS)?;
    most("walls", scene.walls.len(), MAX_WALLS)?;
    place("corner of the workspace", scene.low)?;
    place("corner of the workspace", scene.high)?;
    ensure(
        scene.low.x < scene.high.x && scene.low.y < scene.high.y,
        "workspace",
    )?;
    for wall in &scene.walls {
        outline(&wall.shape)?;
        place("wall", wall.at)?;
    }
    outline(&scene.robot.shape)?;
    length("speed", scene.robot.speed_m_per_s)?;
    ensure(
        (0.0..=MAX_LENGTH_M).contains(&scene.robot.clearance_m),
        "clearance",
    )?;
    scene
        .homes
        .iter()
        .try_for_each(|home| place("home", *home))?;
    for object in &scene.objects {
        outline(&object.shape)?;
        place("grasp", object.grasp)?;
        (object.other_grasps.iter()).try_for_each(|grasp| place("grasp", *grasp))?;
        place("start", object.start)?;
        object.goal.map_or(Ok(()), |goal| place("goal", goal))?;
    }
    for order in &scene.before {
        id("task", order.first.task, scene.objects.len())?;
        id("task", order.then.task, scene.objects.len())?;
    }
    Ok(())
}

fn robot(robot: usize, scene: &SceneRecord) -> Fit {
    id("robot", robot, scene.homes.len())
}

fn task(task: usize, scene: &SceneRecord) -> Fit {
    id("object", task, scene.objects.len())
}

pub(crate) fn motion(motion: &Motion, scene: &SceneRecord) -> Fit {
    match motion.body {
        BodyKind::Robot => robot(motion.id, scene)?,
        BodyKind::Object => task(motion.id, scene)?,
    }
    place("place", motion.from)?;
    place("place", motion.to)?;
    ensure(
        motion.start_ns < motion.end_ns,
        "duration (it ends before it starts)",
    )
}

pub(crate) fn event(event: &Event, scene: &SceneRecord) -> Fit {
    let (named_robot, named_task) = event.what.names();
    named_robot.map_or(Ok(()), |named| robot(named, scene))?;
    named_task.map_or(Ok(()), |named| task(named, scene))?;
    match event.what {
        Happening::Failed {
            blocker: Some(blocker),
            ..
        } => robot(blocker, scene),
        Happening::Constraint { before, after, .. } => {
            task(before, scene)?;
            task(after, scene)
        }
        // Whether the third party of a broken invariant is a robot or an object is not told.
        _ => Ok(()),
    }
}

pub(crate) fn state(state: &State, scene: &SceneRecord) -> Fit {
    let complete =
        state.robots.len() == scene.homes.len() && state.objects.len() == scene.objects.len();
    ensure(complete, "number of robots or objects")?;
    for RobotNow {
        at,
        task: claimed,
        holding,
        waits_for,
        grant,
        ..
    } in &state.robots
    {
        place("place", *at)?;
        most("granted corners", grant.len(), MAX_PATH_POINTS)?;
        grant
            .iter()
            .try_for_each(|corner| place("granted corner", *corner))?;
        claimed.map_or(Ok(()), |claimed| task(claimed, scene))?;
        holding.map_or(Ok(()), |held| task(held, scene))?;
        waits_for.map_or(Ok(()), |other| robot(other.robot, scene))?;
    }
    for ObjectNow { at, holder, .. } in &state.objects {
        place("place", *at)?;
        holder.map_or(Ok(()), |holder| robot(holder, scene))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_is_convex_and_goes_round_once_counter_clockwise() {
        let polygon = |corners: &[[f64; 2]]| {
            let points = corners.iter().map(|[x, y]| Place::new(*x, *y)).collect();
            outline(&Outline::Polygon { points }).is_ok()
        };
        let house = [
            [-1.0, -1.0],
            [1.0, -1.0],
            [1.0, 0.5],
            [0.0, 1.0],
            [-1.0, 0.5],
        ];
        assert!(polygon(&house) && polygon(&house[..4]) && polygon(&house[..3]));
        let mut clockwise = house;
        clockwise.reverse();
        assert!(!polygon(&clockwise));
        assert!(!polygon(&house[..2]));
        let mut dented = house;
        dented[3] = [0.0, 0.0];
        assert!(!polygon(&dented));
        // Each corner turns left, but it goes round twice.
        let star = [0, 2, 4, 1, 3].map(|i| house[i]);
        assert!(!polygon(&star));
    }
}
