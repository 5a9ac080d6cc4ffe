//! Whether a draft describes a scene.
//!
//! Responsible for: finding everything that is wrong with it, in words.
//! Not responsible for: where in a file it stands (`scenario`).

use crate::body::{Body, ClassId};
use crate::draft::{Draft, ObjectDraft, RobotDraft, ShapeDraft, WallDraft};
use crate::geometry::Vec2;
use crate::problem::{Key, Problem, Problems};
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

/// Whether as many robots can take part as asked for.
pub(crate) fn enough_homes(robots: usize, homes: usize) -> Result<(), Problems> {
    if robots == 0 || robots > homes {
        return Err(Problems(vec![Problem::new(
            Key::Top("robots"),
            format!("{robots} robots asked for, but the scenario has {homes} homes"),
        )]));
    }
    Ok(())
}

pub(crate) fn validate(draft: &Draft) -> Result<Sound, Problems> {
    let mut problems = Vec::new();
    let bounds = (
        Vec2::new(draft.bounds[0], draft.bounds[1]),
        Vec2::new(draft.bounds[2], draft.bounds[3]),
    );
    let mut walls = Vec::new();
    for (i, wall) in draft.walls.iter().enumerate() {
        match wall_shape(wall) {
            Ok(wall) => walls.push(wall),
            Err(error) => problems.push(Problem::new(Key::Wall(i), error.to_string())),
        }
    }
    walls.extend(fence(bounds).map_err(|error| {
        Problems(vec![Problem::new(
            Key::Workspace("bounds"),
            error.to_string(),
        )])
    })?);
    let robot = match robot_spec(&draft.robot) {
        Ok(robot) => Some(robot),
        Err(error) => {
            problems.push(Problem::new(Key::Robot("shape"), error.to_string()));
            None
        }
    };
    let mut objects = Vec::new();
    for (i, object) in draft.objects.iter().enumerate() {
        match object_spec(object) {
            Ok(object) => objects.push(object),
            Err(error) => problems.push(Problem::new(Key::Object(i, "shape"), error.to_string())),
        }
    }
    let homes = draft.homes.iter().map(|h| Vec2::new(h[0], h[1])).collect();
    match robot {
        Some(robot) if problems.is_empty() => {
            let classes = assign_classes(&robot, &mut objects);
            Ok(Sound {
                bounds,
                walls,
                robot,
                objects,
                homes,
                classes,
            })
        }
        _ => Err(Problems(problems)),
    }
}

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

fn wall_shape(wall: &WallDraft) -> Result<(Shape, Vec2), ShapeError> {
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
