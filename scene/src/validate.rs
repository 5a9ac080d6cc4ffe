//! Whether a draft describes a scene: numbers, counts and shapes, one by one.
//!
//! Responsible for: finding everything that is wrong with them, in words, and for building what a
//! sound draft is made of.
//! Not responsible for: how things stand to one another (`overlaps`), the user's order (`orders`),
//! where in a file it says so (`scenario`). What depends on a bad number is not judged.

use shm_types::capacity::{MAX_OBJECTS, MAX_ROBOTS};

use crate::body::{Body, ClassId};
use crate::draft::{Draft, ObjectDraft, RobotDraft, ShapeDraft, WallDraft};
use crate::geometry::Vec2;
use crate::lattice::{Lattice, MAX_LATTICE_POINTS};
use crate::orders::check_orders;
use crate::overlaps::check_overlaps;
use crate::problem::{Key, Problem, Problems};
use crate::scene::{ObjectSpec, RobotSpec};
use crate::shape::{MAX_LENGTH_M, Shape, ShapeError};

/// Most walls.
pub const MAX_WALLS: usize = 4_096;
/// Fastest robots, m/s: beyond it a tick is longer than any room.
pub const MAX_SPEED_M_PER_S: f64 = 1_000.0;
/// Longest grasp or release, s.
pub const MAX_GRIP_S: f64 = 86_400.0;
/// Largest clearance, m.
pub const MAX_CLEARANCE_M: f64 = 10.0;
/// Longest name, bytes.
pub const MAX_NAME_BYTES: usize = 128;
/// Most memory that the walls of all classes of bodies may take, bytes: one a lattice point
/// and class.
pub const MAX_RASTER_BYTES: u64 = 1 << 30;
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

/// Checks a draft.
///
/// # Errors
/// Everything that is wrong with it.
pub(crate) fn validate(draft: &Draft) -> Result<Sound, Problems> {
    let mut problems = Vec::new();
    check_counts(draft, &mut problems);
    check_numbers(draft, &mut problems);
    check_orders(draft, &mut problems);
    let sound = build(draft, &mut problems);
    if problems.is_empty()
        && let Some(sound) = &sound
    {
        check_resolution(draft, sound, &mut problems);
        check_overlaps(draft, sound, &mut problems);
    }
    match sound {
        Some(sound) if problems.is_empty() => Ok(sound),
        _ => Err(Problems(problems)),
    }
}

/// Whether as many robots can take part as asked for.
pub(crate) fn enough_homes(robots: usize, homes: usize) -> Result<(), Problems> {
    let message = match (robots, homes) {
        (0, _) => "a run takes at least one robot".to_owned(),
        (robots, 1) if robots > 1 => {
            format!("{robots} robots asked for, but the scenario has only 1 home")
        }
        (robots, homes) if robots > homes => {
            format!("{robots} robots asked for, but the scenario has only {homes} homes")
        }
        _ => return Ok(()),
    };
    Err(Problems(vec![
        Problem::new(Key::Top("robots"), message)
            .help("ask for fewer, or add a [[robots]] entry with a home for each"),
    ]))
}

fn check_counts(draft: &Draft, problems: &mut Vec<Problem>) {
    let name = &draft.name;
    if name.is_empty() || name.len() > MAX_NAME_BYTES || name.chars().any(char::is_control) {
        problems.push(Problem::new(
            Key::Top("name"),
            format!("a name has 1 to {MAX_NAME_BYTES} bytes and no control characters"),
        ));
    }
    if draft.homes.is_empty() {
        problems.push(
            Problem::new(Key::Top("robots"), "the scenario has no robot")
                .help("add a [[robots]] entry with a home"),
        );
    }
    let mut capacity = |key: Key, what: &str, count: usize, most: usize| {
        if count > most {
            problems.push(Problem::new(
                key,
                format!("the scenario has {count} {what}, over the capacity of {most}"),
            ));
        }
    };
    capacity(
        Key::Home(MAX_ROBOTS),
        "robots",
        draft.homes.len(),
        MAX_ROBOTS,
    );
    capacity(
        Key::Object(MAX_OBJECTS, "start"),
        "objects",
        draft.objects.len(),
        MAX_OBJECTS,
    );
    capacity(Key::Wall(MAX_WALLS), "walls", draft.walls.len(), MAX_WALLS);
}

/// Checks that a number is finite and within limits, both inclusive.
fn within(problems: &mut Vec<Problem>, key: Key, number: f64, low: f64, high: f64, unit: &str) {
    if !number.is_finite() {
        problems.push(Problem::new(key, "is not a finite number"));
    } else if number < low || number > high {
        problems.push(Problem::new(
            key,
            format!("is {number} {unit}, but must be from {low} to {high} {unit}"),
        ));
    }
}

fn check_point(problems: &mut Vec<Problem>, key: Key, point: [f64; 2]) {
    if !point.iter().all(|x| x.is_finite()) {
        problems.push(Problem::new(key, "is not a point of finite numbers"));
    } else if point.iter().any(|x| x.abs() > MAX_LENGTH_M) {
        problems.push(Problem::new(
            key,
            format!("lies more than {MAX_LENGTH_M} m from the origin"),
        ));
    }
}

fn check_numbers(draft: &Draft, problems: &mut Vec<Problem>) {
    let robot = &draft.robot;
    if robot.speed_m_per_s <= 0.0 {
        problems.push(Problem::new(
            Key::Robot("speed"),
            format!("is {} m/s, but robots have to move", robot.speed_m_per_s),
        ));
    } else {
        let most = MAX_SPEED_M_PER_S;
        within(
            problems,
            Key::Robot("speed"),
            robot.speed_m_per_s,
            0.0,
            most,
            "m/s",
        );
    }
    let clearance = Key::Robot("clearance");
    within(
        problems,
        clearance,
        robot.clearance_m,
        0.0,
        MAX_CLEARANCE_M,
        "m",
    );
    within(
        problems,
        Key::Robot("grasp_s"),
        robot.grasp_s,
        0.0,
        MAX_GRIP_S,
        "s",
    );
    within(
        problems,
        Key::Robot("release_s"),
        robot.release_s,
        0.0,
        MAX_GRIP_S,
        "s",
    );
    let [x0, y0, x1, y1] = draft.bounds;
    check_point(problems, Key::Workspace("bounds"), [x0, y0]);
    check_point(problems, Key::Workspace("bounds"), [x1, y1]);
    for (i, home) in draft.homes.iter().enumerate() {
        check_point(problems, Key::Home(i), *home);
    }
    for (i, object) in draft.objects.iter().enumerate() {
        check_point(problems, Key::Object(i, "start"), object.start);
        check_point(problems, Key::Object(i, "grasp"), object.grasp);
        if let Some(goal) = object.goal {
            check_point(problems, Key::Object(i, "goal"), goal);
        }
    }
    for (i, step) in draft.certificate.iter().enumerate() {
        check_point(problems, Key::Certificate(i), step.from);
        check_point(problems, Key::Certificate(i), step.to);
        if step.object >= draft.objects.len() {
            problems.push(Problem::new(
                Key::Certificate(i),
                format!("there is no object {}", step.object),
            ));
        }
    }
}

/// Refuses cells that are too many, or so coarse that bodies fall between them.
fn check_resolution(draft: &Draft, sound: &Sound, problems: &mut Vec<Problem>) {
    let key = Key::Top("resolution");
    let cell = draft.resolution_m;
    let bodies = std::iter::once(&sound.robot.shape).chain(sound.objects.iter().map(|o| &o.shape));
    let narrowest = bodies.map(Shape::width_m).fold(f64::INFINITY, f64::min);
    if !cell.is_finite() {
        problems.push(Problem::new(key, "is not a finite number"));
        return;
    }
    if cell <= 0.0 {
        problems.push(Problem::new(
            key,
            format!("is {cell} m, but a cell has a size"),
        ));
        return;
    }
    if cell > narrowest {
        problems.push(
            Problem::new(
                key,
                format!("cells of {cell} m are wider than the narrowest body ({narrowest} m)"),
            )
            .help("give cells that are a fraction of the narrowest body"),
        );
    }
    let points = Lattice::points_of_resolution(sound.bounds, cell);
    if points > MAX_LATTICE_POINTS as f64 {
        problems.push(
            Problem::new(
                key,
                format!("cells of {cell} m are {points} in these bounds; {MAX_LATTICE_POINTS} are the most"),
            )
            .help("give coarser cells or a smaller workspace"),
        );
    } else if points * sound.classes.len() as f64 > MAX_RASTER_BYTES as f64 {
        problems.push(
            Problem::new(
                key,
                format!(
                    "{points} cells for each of {} combinations of shape and grasp take more than {MAX_RASTER_BYTES} bytes",
                    sound.classes.len()
                ),
            )
            .help("give coarser cells, or more objects the same shape and grasp"),
        );
    }
}

/// Builds whatever shapes are sound; nothing if one is not.
fn build(draft: &Draft, problems: &mut Vec<Problem>) -> Option<Sound> {
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
