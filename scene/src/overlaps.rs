//! How things stand to one another at the start and at the end.
//!
//! Responsible for: finding bodies that overlap a wall or one another where they start, where
//! objects shall go, and where robots return to.
//! Not responsible for: what lies between start and end (`reach`).

use crate::build::Sound;
use crate::draft::Draft;
use crate::geometry::{CONTACT_M, Vec2, overlap};
use crate::problem::{Key, Problem};
use crate::shape::Shape;
use crate::validate::Starts;

/// Overlaps beyond this many are only counted: they share one cause.
const MAX_REPORTED: usize = 50;

/// A body at rest.
#[derive(Clone, Copy)]
struct Resting<'a> {
    shape: &'a Shape,
    at: Vec2,
    key: Key,
}

impl Resting<'_> {
    fn overlaps(&self, other: &Resting) -> bool {
        meet(self.shape, self.at, other.shape, other.at)
    }
}

/// Exact overlap behind a test of extents.
fn meet(a: &Shape, at: Vec2, b: &Shape, bt: Vec2) -> bool {
    let ((a_low, a_high), (b_low, b_high)) = (a.extent(), b.extent());
    let apart = bt - at;
    apart.x < a_high.x - b_low.x
        && -apart.x < b_high.x - a_low.x
        && apart.y < a_high.y - b_low.y
        && -apart.y < b_high.y - a_low.y
        && overlap(a, at, b, bt)
}

/// Finds every overlap of a draft whose numbers and shapes are sound.
pub(crate) fn check_overlaps(
    draft: &Draft,
    sound: &Sound,
    which: Starts,
    problems: &mut Vec<Problem>,
) {
    let robot = &sound.robot.shape;
    let grown = robot.grown(sound.robot.clearance_m);
    let homes: Vec<_> = sound
        .homes
        .iter()
        .enumerate()
        .map(|(i, at)| Resting {
            shape: robot,
            at: *at,
            key: Key::Home(i),
        })
        .collect();
    let mut starts = Vec::new();
    let mut goals = Vec::new();
    for (i, object) in sound.objects.iter().enumerate() {
        let shape = &object.shape;
        if which == Starts::Checked {
            starts.push(Resting {
                shape,
                at: object.start,
                key: Key::Object(i, "start"),
            });
        }
        goals.extend(object.goal.map(|at| Resting {
            shape,
            at,
            key: Key::Object(i, "goal"),
        }));
    }
    let mut found = Vec::new();
    for body in &starts {
        in_wall(
            draft,
            sound,
            body,
            body.shape,
            "the object stands",
            &mut found,
        );
    }
    for body in &goals {
        in_wall(draft, sound, body, body.shape, "the goal lies", &mut found);
    }
    for body in &homes {
        in_wall(draft, sound, body, &grown, "the home lies", &mut found);
    }
    pairs(&starts, "overlap at the start", &mut found);
    pairs(&goals, "have overlapping goals", &mut found);
    for (i, home) in homes.iter().enumerate() {
        let roomy = Resting {
            shape: &grown,
            ..*home
        };
        for other in &homes[..i] {
            if roomy.overlaps(other) {
                found.push(two(home, other, "are blocked by one another"));
            }
        }
        for (start, _) in starts
            .iter()
            .zip(&sound.objects)
            .filter(|(_, o)| !o.pass_under)
        {
            if roomy.overlaps(start) {
                found.push(two(
                    home,
                    start,
                    "overlap: the robot's home is blocked by the object",
                ));
            }
        }
        let with_goal = sound.objects.iter().filter(|object| object.goal.is_some());
        for (goal, _) in goals.iter().zip(with_goal).filter(|(_, o)| !o.pass_under) {
            if roomy.overlaps(goal) {
                found.push(
                    two(home, goal, "overlap: the run could never be complete")
                        .help("a robot has to stand at its home while the object is at its goal"),
                );
            }
        }
    }
    if found.len() > MAX_REPORTED {
        let more = found.len() - MAX_REPORTED;
        found.truncate(MAX_REPORTED);
        found.extend(found.last().cloned().map(|last| Problem {
            message: format!("{more} more overlaps are not listed"),
            ..last
        }));
    }
    problems.extend(found);
}

/// Walls a body stands in, with or without its clearance.
fn in_wall(
    draft: &Draft,
    sound: &Sound,
    body: &Resting,
    shape: &Shape,
    what: &str,
    found: &mut Vec<Problem>,
) {
    let fits = |shape: &Shape| {
        let (low, high) = shape.extent();
        let below = sound.bounds.0 - (body.at + low);
        let above = body.at + high - sound.bounds.1;
        below.max() <= CONTACT_M && above.max() <= CONTACT_M
    };
    let without_clearance = |problem: Problem, fits: bool| {
        if fits {
            problem.help("without the clearance it would fit")
        } else {
            problem
        }
    };
    if !fits(shape) {
        let problem = Problem::new(
            body.key,
            format!("{what} partly or wholly outside the bounds"),
        );
        let problem = problem.also(Key::Workspace("bounds"));
        found.push(without_clearance(problem, fits(body.shape)));
    }
    for (i, (wall, at)) in sound.walls[..draft.walls.len()].iter().enumerate() {
        if meet(shape, body.at, wall, *at) {
            let problem = Problem::new(body.key, format!("{what} in wall {i}")).also(Key::Wall(i));
            let bare_fits = !meet(body.shape, body.at, wall, *at);
            found.push(without_clearance(problem, bare_fits));
        }
    }
}

fn pairs(bodies: &[Resting], what: &str, found: &mut Vec<Problem>) {
    for (i, body) in bodies.iter().enumerate() {
        for other in &bodies[..i] {
            if body.overlaps(other) {
                found.push(two(body, other, what));
            }
        }
    }
}

fn two(body: &Resting, other: &Resting, what: &str) -> Problem {
    let gap = (body.at - other.at).amax();
    let message = if gap <= CONTACT_M {
        format!("this and {} {what} (they are the same place)", other.key)
    } else {
        format!("this and {} {what}", other.key)
    };
    Problem::new(body.key, message).also(other.key)
}
