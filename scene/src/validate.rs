//! Whether a draft describes a scene: numbers, counts and shapes, one by one.
//!
//! Responsible for: finding everything that is wrong with them, in words.
//! Not responsible for: making shapes of them (`build`), how things stand to one another
//! (`overlaps`), the user's order (`orders`), where in a file it says so (`scenario`). What depends on a bad number is not judged.

use shm_types::capacity::{MAX_OBJECTS, MAX_ROBOTS};

use crate::build::{Sound, build};
use crate::draft::Draft;
use crate::lattice::{Lattice, MAX_LATTICE_POINTS, MAX_RASTER_BYTES};
use crate::orders::check_orders;
use crate::overlaps::check_overlaps;
use crate::problem::{Key, Problem, Problems};
use crate::shape::{MAX_LENGTH_M, Shape};

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

/// What the starts of objects are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Starts {
    /// Where they stand: they must be free.
    Checked,
    /// Where they once stood.
    History,
}

/// Checks a draft.
///
/// # Errors
/// Everything that is wrong with it.
pub(crate) fn validate(draft: &Draft, starts: Starts) -> Result<Sound, Problems> {
    let mut problems = Vec::new();
    check_counts(draft, &mut problems);
    check_numbers(draft, &mut problems);
    check_orders(draft, &mut problems);
    let sound = build(draft, &mut problems);
    if problems.is_empty()
        && let Some(sound) = &sound
    {
        check_resolution(draft, sound, &mut problems);
        check_overlaps(draft, sound, starts, &mut problems);
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
