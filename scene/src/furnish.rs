//! Robots and objects in a floor plan, scrambled by legal moves (rule 28).
//!
//! Responsible for: choosing homes and goals, and moving the objects from their goals to where
//! they start; the list, read backwards, is the certificate.
//! Not responsible for: the floor plan (`rooms`), what makes a move legal (`moves`).

use rand::RngExt;
use rand::seq::{IndexedRandom, SliceRandom};
use rand_chacha::ChaCha8Rng;

use crate::draft::{Draft, Move, ObjectDraft, WallDraft};
use crate::generate::GenerateOptions;
use crate::geometry::{Vec2, overlap};
use crate::moves::{Mover, check_certificate};
use crate::rooms::{Plan, Rect, UNITS_PER_M};
use crate::scene::Scene;
use crate::shape::Shape;

/// Places tried for one body.
const PLACES: usize = 120;
/// How far an object goes at least in one move, units.
const MOVE_MIN: i32 = 8;
/// How far next to another object "crowded" reaches, units.
const CROWD_REACH: i32 = 18;

/// The paper's object around its centre, units.
const OBJECT: Rect = [-4, -4, 4, 4];
/// The same with the robot that grasps it.
const COMPOUND: Rect = [-5, -14, 5, 4];

/// Puts robots and objects on a floor plan and scrambles them, if the dice fall well.
pub(crate) fn furnish(
    rng: &mut ChaCha8Rng,
    plan: &Plan,
    options: &GenerateOptions,
) -> Option<Scene> {
    let mut draft = room(rng, plan, options)?;
    let goals = place_objects(rng, plan, &draft, options, OBJECT)?;
    draft.objects = goals
        .iter()
        .map(|goal| ObjectDraft::paper(*goal, Some(*goal)))
        .collect();
    let moves = scramble(rng, plan, draft.clone(), options)?;
    for Move { object, to, .. } in &moves {
        draft.objects[*object].start = *to;
    }
    draft.certificate = moves
        .into_iter()
        .rev()
        .map(|Move { object, from, to }| Move {
            object,
            from: to,
            to: from,
        })
        .collect();
    let scene = Scene::new(draft).ok()?;
    check_certificate(&scene, &scene.certificate).ok()?;
    Some(scene)
}

/// Puts robots, objects and goals on a floor plan, wherever they fit.
pub(crate) fn strew(rng: &mut ChaCha8Rng, plan: &Plan, options: &GenerateOptions) -> Option<Draft> {
    let mut draft = room(rng, plan, options)?;
    let starts = place_objects(rng, plan, &draft, options, COMPOUND)?;
    let goals = place_objects(rng, plan, &draft, options, COMPOUND)?;
    draft.objects = starts
        .into_iter()
        .zip(goals)
        .map(|(start, goal)| ObjectDraft::paper(start, Some(goal)))
        .collect();
    Some(draft)
}

/// A floor plan with robots at home.
fn room(rng: &mut ChaCha8Rng, plan: &Plan, options: &GenerateOptions) -> Option<Draft> {
    let name = format!("random-{}", options.seed);
    let size = (metres(plan.size.0), metres(plan.size.1));
    let mut draft = Draft::room(&name, [0.0, 0.0, size.0, size.1]);
    draft.walls = plan
        .walls
        .iter()
        .map(|wall| WallDraft::Box(wall.map(metres)))
        .collect();
    draft.homes = place_homes(rng, plan, options.robots)?;
    Some(draft)
}

/// Units as metres, each the decimal nearest to it.
fn metres(units: i32) -> f64 {
    f64::from(units) / f64::from(UNITS_PER_M)
}

fn place(x: i32, y: i32) -> [f64; 2] {
    [metres(x), metres(y)]
}

/// Corners of rooms, away from doorways, so that parked robots cut nothing off.
fn place_homes(rng: &mut ChaCha8Rng, plan: &Plan, robots: usize) -> Option<Vec<[f64; 2]>> {
    const HALF: i32 = 5;
    let mut corners = Vec::new();
    for room in &plan.rooms {
        // Beside one another along a wall, where the corners are taken.
        for side in 0..3 {
            let (x0, x1) = (
                room[0] + HALF + 1 + side * 11,
                room[2] - HALF - 1 - side * 11,
            );
            let (y0, y1) = (room[1] + HALF, room[3] - HALF);
            corners.extend([(x0, y0), (x1, y0), (x0, y1), (x1, y1)].map(|corner| (side, corner)));
        }
    }
    corners.shuffle(rng);
    corners.sort_by_key(|(side, _)| *side);
    let mut homes: Vec<(i32, i32)> = Vec::new();
    for (_, (x, y)) in corners {
        let body = [x - HALF, y - HALF, x + HALF, y + HALF];
        let apart = |h: &(i32, i32)| (h.0 - x).abs() >= 2 * HALF || (h.1 - y).abs() >= 2 * HALF;
        let clear = plan.walls.iter().all(|wall| !meet(wall, &body))
            && plan
                .doors
                .iter()
                .all(|door| !meet(&wider(door, HALF), &body))
            && meet(
                &[HALF, HALF, plan.size.0 - HALF, plan.size.1 - HALF],
                &[x, y, x + 1, y + 1],
            );
        if homes.len() < robots && clear && homes.iter().all(apart) {
            homes.push((x, y));
        }
    }
    (homes.len() == robots).then(|| homes.into_iter().map(|(x, y)| place(x, y)).collect())
}

/// Whether the insides of two rectangles meet.
fn meet(a: &Rect, b: &Rect) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

fn wider(rect: &Rect, by: i32) -> Rect {
    [rect[0] - by, rect[1] - by, rect[2] + by, rect[3] + by]
}

/// A place for an object, in units: crowded or anywhere.
fn propose(rng: &mut ChaCha8Rng, plan: &Plan, others: &[[f64; 2]], crowding: f64) -> (i32, i32) {
    let units = |x: f64| (x * f64::from(UNITS_PER_M)).round() as i32;
    if rng.random_bool(crowding) {
        let near_door = plan.doors.choose(rng).filter(|_| rng.random_bool(0.3));
        if let Some(door) = near_door {
            return (
                (door[0] + door[2]) / 2 + rng.random_range(-4..=4),
                (door[1] + door[3]) / 2 + rng.random_range(-4..=4),
            );
        }
        if let Some(other) = others.choose(rng) {
            return (
                units(other[0]) + rng.random_range(-CROWD_REACH / 2..=CROWD_REACH / 2),
                units(other[1]) + rng.random_range(-CROWD_REACH..=CROWD_REACH),
            );
        }
    }
    (
        rng.random_range(0..=plan.size.0),
        rng.random_range(0..=plan.size.1),
    )
}

/// Places of all objects that overlap one another and homes nowhere, and walls nowhere within
/// `body`, units around the centre.
fn place_objects(
    rng: &mut ChaCha8Rng,
    plan: &Plan,
    draft: &Draft,
    options: &GenerateOptions,
    body: Rect,
) -> Option<Vec<[f64; 2]>> {
    let inside = [
        -body[0],
        -body[1],
        plan.size.0 - body[2],
        plan.size.1 - body[3],
    ];
    let mut goals: Vec<[f64; 2]> = Vec::new();
    for _ in 0..options.objects {
        let goal = (0..PLACES).find_map(|_| {
            let (x, y) = propose(rng, plan, &goals, options.crowding);
            let body = [x + body[0], y + body[1], x + body[2], y + body[3]];
            let at = place(x, y);
            let apart = |other: &[f64; 2], least: f64| {
                (other[0] - at[0]).abs().max((other[1] - at[1]).abs()) > least - 1e-9
            };
            let free = meet(&inside, &[x, y, x + 1, y + 1])
                && plan.walls.iter().all(|wall| !meet(wall, &body))
                && goals.iter().all(|goal| apart(goal, 0.4))
                && draft.homes.iter().all(|home| apart(home, 0.45));
            free.then_some(at)
        })?;
        goals.push(goal);
    }
    Some(goals)
}

/// Moves every object once, and some again, from the goal arrangement on.
fn scramble(
    rng: &mut ChaCha8Rng,
    plan: &Plan,
    draft: Draft,
    options: &GenerateOptions,
) -> Option<Vec<Move>> {
    let scene = Scene::new(draft).ok()?;
    let mut scrambler = Scrambler {
        mover: Mover::new(&scene),
        at: scene.objects.iter().map(|object| object.start).collect(),
        scene,
        plan,
        crowding: options.crowding,
    };
    let mut moves: Vec<Move> = Vec::new();
    let mut waiting: Vec<usize> = (0..options.objects).collect();
    waiting.shuffle(rng);
    while !waiting.is_empty() {
        let (index, made) = (0..waiting.len())
            .find_map(|i| scrambler.random_move(rng, waiting[i]).map(|made| (i, made)))?;
        waiting.remove(index);
        moves.push(made);
    }
    for _ in 0..options.extra_moves {
        let object = rng.random_range(0..options.objects as u32) as usize;
        moves.extend(scrambler.random_move(rng, object));
    }
    // An object that extra moves brought back to its goal would need none.
    let displaced = scrambler
        .scene
        .objects
        .iter()
        .zip(&scrambler.at)
        .all(|(object, at)| (object.start - at).amax() >= metres(1));
    displaced.then_some(moves)
}

struct Scrambler<'a> {
    scene: Scene,
    mover: Mover,
    /// Where the objects are.
    at: Vec<Vec2>,
    plan: &'a Plan,
    crowding: f64,
}

impl Scrambler<'_> {
    /// Moves one object to a random place by some robot, if there is a legal move.
    fn random_move(&mut self, rng: &mut ChaCha8Rng, object: usize) -> Option<Move> {
        let mut robots: Vec<usize> = (0..self.scene.homes.len()).collect();
        robots.shuffle(rng);
        let from = self.at[object];
        for robot in robots {
            if !self
                .mover
                .is_within_reach(&self.scene, &self.at, object, robot)
            {
                continue;
            }
            self.mover.carry(&self.scene, &self.at, object, robot);
            let candidates = self.candidates(rng, object);
            for to in candidates {
                self.at[object] = Vec2::new(to[0], to[1]);
                if self
                    .mover
                    .is_within_reach(&self.scene, &self.at, object, robot)
                {
                    return Some(Move {
                        object,
                        from: [from.x, from.y],
                        to,
                    });
                }
                self.at[object] = from;
            }
        }
        None
    }

    /// A few random places the object can be carried to, clear of all homes.
    fn candidates(&self, rng: &mut ChaCha8Rng, object: usize) -> Vec<[f64; 2]> {
        const WANTED: usize = 4;
        let others: Vec<[f64; 2]> = self
            .at
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != object)
            .map(|(_, at)| [at.x, at.y])
            .collect();
        let shape: &Shape = &self.scene.objects[object].shape;
        let robot = &self.scene.robot.shape;
        let from = self.at[object];
        let mut found = Vec::new();
        for _ in 0..PLACES {
            let (x, y) = propose(rng, self.plan, &others, self.crowding);
            let to = place(x, y);
            let at = Vec2::new(to[0], to[1]);
            let far = (at - from).amax() >= metres(MOVE_MIN);
            let clear = |home: &Vec2| !overlap(shape, at, robot, *home);
            if far
                && self.scene.homes.iter().all(clear)
                && self.mover.can_carry_to(&self.scene, object, at)
            {
                found.push(to);
                if found.len() == WANTED {
                    break;
                }
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    const OTHERS: [[f64; 2]; 2] = [[1.0, 1.0], [2.5, 2.0]];

    fn plans() -> impl Iterator<Item = (ChaCha8Rng, Plan)> {
        (0..60).filter_map(|seed| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            Plan::random(&mut rng, 6_800, 3).map(|plan| (rng, plan))
        })
    }

    fn units([x, y]: [f64; 2]) -> (i32, i32) {
        let units = |metres: f64| (metres * f64::from(UNITS_PER_M)).round() as i32;
        (units(x), units(y))
    }

    /// Whether a place lies in a rectangle that is so much wider on each side, the border included.
    fn lies_in(rect: &Rect, by: i32, (x, y): (i32, i32)) -> bool {
        rect[0] - by <= x && x <= rect[2] + by && rect[1] - by <= y && y <= rect[3] + by
    }

    #[test]
    fn homes_are_clear_of_walls_and_of_the_way_through_a_doorway() {
        let mut placed = 0;
        for (mut rng, plan) in plans() {
            let Some(homes) = place_homes(&mut rng, &plan, 4) else {
                continue;
            };
            placed += 1;
            let homes: Vec<_> = homes.into_iter().map(units).collect();
            for (i, &home) in homes.iter().enumerate() {
                let room = [0, 0, plan.size.0, plan.size.1];
                assert!(lies_in(&room, -5, home), "{home:?} in {room:?}");
                // Robots are 10 units wide: one at home, and one in the doorway.
                assert!(!plan.walls.iter().any(|wall| lies_in(wall, 4, home)));
                assert!(!plan.doors.iter().any(|door| lies_in(door, 9, home)));
                let other =
                    |other: &(i32, i32)| lies_in(&[home.0, home.1, home.0, home.1], 9, *other);
                assert!(!homes[..i].iter().any(other));
            }
        }
        assert!(placed > 20, "{placed}");
    }

    #[test]
    fn crowded_places_are_in_doorways_or_beside_others() {
        for (mut rng, plan) in plans() {
            for _ in 0..50 {
                let at = propose(&mut rng, &plan, &OTHERS, 1.0);
                let in_doorway = plan.doors.iter().any(|door| lies_in(door, 4, at));
                let is_beside = OTHERS.iter().any(|other| {
                    let (x, y) = units(*other);
                    lies_in(&[x, y, x, y], CROWD_REACH, at)
                });
                assert!(in_doorway || is_beside, "{at:?}");
            }
        }
    }

    #[test]
    fn objects_are_placed_clear_of_walls_homes_and_one_another() {
        let options = GenerateOptions::default();
        let mut placed = 0;
        for (mut rng, plan) in plans() {
            let Some(draft) = room(&mut rng, &plan, &options) else {
                continue;
            };
            let Some(goals) = place_objects(&mut rng, &plan, &draft, &options, OBJECT) else {
                continue;
            };
            placed += 1;
            let goals: Vec<_> = goals.into_iter().map(units).collect();
            for (i, &at) in goals.iter().enumerate() {
                // Objects are 8 units wide, robots 10.
                assert!(!plan.walls.iter().any(|wall| lies_in(wall, 3, at)));
                let body = [at.0, at.1, at.0, at.1];
                assert!(!goals[..i].iter().any(|other| lies_in(&body, 7, *other)));
                assert!(
                    !draft
                        .homes
                        .iter()
                        .any(|home| lies_in(&body, 8, units(*home)))
                );
            }
        }
        assert!(placed > 20, "{placed}");
    }
}
