//! Making bodies, walls and classes of a draft.
//!
//! Responsible for: shapes and places as the rest of the crate uses them.
//! Not responsible for: whether the numbers make sense (`validate`), where things stand to one
//! another (`overlaps`).

use crate::body::{Body, ClassId};
use crate::draft::{Draft, ObjectDraft, RobotDraft, ShapeDraft, WallDraft};
use crate::geometry::Vec2;
use crate::problem::{Key, Problem};
use crate::scene::{ObjectSpec, RobotSpec};
use crate::shape::{Shape, ShapeError};

/// Thickness of the walls around the bounds, m: thicker than any step.
const FENCE_M: f64 = 10.0;
const NS_PER_S: f64 = 1e9;

/// What a sound draft is made of.
pub(crate) struct Sound {
    pub(crate) bounds: (Vec2, Vec2),
    pub(crate) walls: Vec<(Shape, Vec2)>,
    pub(crate) robot: RobotSpec,
    pub(crate) objects: Vec<ObjectSpec>,
    pub(crate) homes: Vec<Vec2>,
    pub(crate) classes: Vec<Body>,
}

/// Builds whatever shapes are sound; nothing if one is not.
pub(crate) fn build(draft: &Draft, problems: &mut Vec<Problem>) -> Option<Sound> {
    fn note<T>(problems: &mut Vec<Problem>, key: Key, found: Result<T, ShapeError>) -> Option<T> {
        found
            .map_err(|error| problems.push(Problem::new(key, error.to_string())))
            .ok()
    }
    let bounds = (
        Vec2::new(draft.bounds[0], draft.bounds[1]),
        Vec2::new(draft.bounds[2], draft.bounds[3]),
    );
    let room = rectangle(bounds.0, bounds.1).and_then(|_| fence(bounds));
    let fence = note(problems, Key::Workspace("bounds"), room);
    let mut walls = Vec::new();
    for (i, wall) in draft.walls.iter().enumerate() {
        walls.extend(note(problems, Key::Wall(i), wall_shape(wall)));
    }
    let robot = note(problems, Key::Robot("shape"), robot_spec(&draft.robot));
    let mut objects = Vec::new();
    for (i, object) in draft.objects.iter().enumerate() {
        objects.extend(note(problems, Key::Object(i, "shape"), object_spec(object)));
    }
    let robot = robot?;
    walls.extend(fence?);
    let classes = assign_classes(&robot, &mut objects);
    Some(Sound {
        bounds,
        walls,
        robot,
        objects,
        homes: draft.homes.iter().map(|h| Vec2::new(h[0], h[1])).collect(),
        classes,
    })
}

/// A shape around its own centre.
pub(crate) fn shape_of(draft: &ShapeDraft) -> Result<Shape, ShapeError> {
    let shape = match draft {
        ShapeDraft::Box([x, y]) => Shape::rectangle(Vec2::new(*x, *y))?,
        ShapeDraft::Circle(radius) => Shape::circle(*radius)?,
        ShapeDraft::Polygon(points) => {
            let points: Vec<_> = points.iter().map(|p| Vec2::new(p[0], p[1])).collect();
            Shape::polygon(&points)?
        }
    };
    if shape.contains_origin() {
        Ok(shape)
    } else {
        Err(ShapeError::CentreOutside)
    }
}

/// The robot centred against the object's −y side (rule 2); [0, 0] where a shape is none, which
/// is then reported as such.
pub(crate) fn default_grasp(robot: &ShapeDraft, object: &ShapeDraft) -> [f64; 2] {
    match (shape_of(robot), shape_of(object)) {
        (Ok(robot), Ok(object)) => {
            let (object_low, object_high) = object.extent();
            let (robot_low, robot_high) = robot.extent();
            let middle = (object_low.x + object_high.x - robot_low.x - robot_high.x) / 2.0;
            [middle, object_low.y - robot_high.y]
        }
        _ => [0.0, 0.0],
    }
}

/// A wall around its own origin, and where that is.
pub(crate) fn wall_shape(wall: &WallDraft) -> Result<(Shape, Vec2), ShapeError> {
    match wall {
        WallDraft::Box([x0, y0, x1, y1]) => rectangle(Vec2::new(*x0, *y0), Vec2::new(*x1, *y1)),
        WallDraft::Polygon(points) => {
            let points: Vec<_> = points.iter().map(|p| Vec2::new(p[0], p[1])).collect();
            Ok((Shape::polygon(&points)?, Vec2::zeros()))
        }
    }
}

fn rectangle(low: Vec2, high: Vec2) -> Result<(Shape, Vec2), ShapeError> {
    Ok((Shape::rectangle(high - low)?, (low + high) / 2.0))
}

/// Four walls around the bounds: left, right, below, above.
fn fence((low, high): (Vec2, Vec2)) -> Result<[(Shape, Vec2); 4], ShapeError> {
    let out = Vec2::new(FENCE_M, FENCE_M);
    let (far_low, far_high) = (low - out, high + out);
    Ok([
        rectangle(far_low, Vec2::new(low.x, far_high.y))?,
        rectangle(Vec2::new(high.x, far_low.y), far_high)?,
        rectangle(far_low, Vec2::new(far_high.x, low.y))?,
        rectangle(Vec2::new(far_low.x, high.y), far_high)?,
    ])
}

fn robot_spec(robot: &RobotDraft) -> Result<RobotSpec, ShapeError> {
    Ok(RobotSpec {
        shape: shape_of(&robot.shape)?,
        speed_m_per_s: robot.speed_m_per_s,
        clearance_m: robot.clearance_m,
        grasp_ns: (robot.grasp_s * NS_PER_S).round() as u64,
        release_ns: (robot.release_s * NS_PER_S).round() as u64,
    })
}

fn object_spec(object: &ObjectDraft) -> Result<ObjectSpec, ShapeError> {
    let vector = |p: [f64; 2]| Vec2::new(p[0], p[1]);
    Ok(ObjectSpec {
        shape: shape_of(&object.shape)?,
        grasp: vector(object.grasp),
        pass_under: object.pass_under,
        start: vector(object.start),
        goal: object.goal.map(vector),
        class: ClassId(0),
    })
}

/// The robot alone, then one class for each distinct shape and grasp, in order of appearance.
fn assign_classes(robot: &RobotSpec, objects: &mut [ObjectSpec]) -> Vec<Body> {
    let mut classes = vec![Body::robot(&robot.shape, robot.clearance_m)];
    let mut kinds: Vec<(Shape, Vec2)> = Vec::new();
    for object in objects {
        let known = kinds
            .iter()
            .position(|(shape, grasp)| *shape == object.shape && *grasp == object.grasp);
        let kind = known.unwrap_or_else(|| {
            kinds.push((object.shape.clone(), object.grasp));
            classes.push(Body::carrying(
                &robot.shape,
                &object.shape,
                object.grasp,
                robot.clearance_m,
            ));
            kinds.len() - 1
        });
        object.class = ClassId(kind + 1);
    }
    classes
}
