//! Random scenarios that are known to be solvable (rule 28).
//!
//! Responsible for: filling a random floor plan with robots and objects at their goals, and
//! scrambling them by legal moves; the list, read backwards, is the certificate.
//! Not responsible for: the floor plan (`rooms`), what makes a move legal (`moves`).
//!
//! Terms: *crowding* is the share of places chosen next to another object or in a doorway, where
//! they constrain other tasks; the rest are chosen anywhere.

use std::fmt::Write as _;

use rand::seq::{IndexedRandom, SliceRandom};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::canonical;
use crate::draft::{Draft, Move, ObjectDraft, WallDraft};
use crate::geometry::{Vec2, overlap};
use crate::moves::{Mover, check_certificate};
use crate::rooms::{Plan, Rect, UNITS_PER_M, UNITS_PER_M2};
use crate::scene::Scene;
use crate::shape::Shape;

/// Floor plans tried before giving up.
const PLANS: usize = 200;
/// Arrangements tried on one floor plan.
const ARRANGEMENTS: usize = 5;
/// Places tried for one body.
const PLACES: usize = 120;
/// Largest free floor, m².
const AREA_MAX_M2: f64 = 10_000.0;
/// How far an object goes at least in one move, units.
const MOVE_MIN: i32 = 8;
/// How far next to another object "crowded" reaches, units.
const CROWD_REACH: i32 = 18;

/// What to generate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GenerateOptions {
    /// Same seed, same scenario.
    pub seed: u64,
    /// Objects, each with a goal.
    pub objects: usize,
    /// Robots.
    pub robots: usize,
    /// Free floor, m²: a multiple of 0.0025.
    pub area_m2: f64,
    /// Dividing walls, each with one doorway.
    pub walls: usize,
    /// Share of places next to other objects or in doorways, from 0 to 1.
    pub crowding: f64,
    /// Moves beyond one an object: with 0, each object goes straight to its goal.
    pub extra_moves: usize,
}

impl Default for GenerateOptions {
    /// The paper's smallest room (Table I).
    fn default() -> Self {
        Self {
            seed: 0,
            objects: 5,
            robots: 4,
            area_m2: 17.0,
            walls: 3,
            crowding: 0.5,
            extra_moves: 0,
        }
    }
}

/// A generated scenario.
#[derive(Clone, Debug)]
pub struct Generated {
    /// The scenario file, with the certificate in it.
    pub text: String,
    /// The scenario.
    pub scene: Scene,
    /// Moves that solve it one after the other.
    pub certificate: Vec<Move>,
}

/// Why nothing was generated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GenerateError {
    /// An option out of range.
    #[error("{option} is {given}, but must be {allowed}")]
    Option {
        /// Which option.
        option: &'static str,
        /// What was given.
        given: String,
        /// What is allowed.
        allowed: String,
    },
    /// No luck within the number of attempts.
    #[error(
        "no solvable room of this kind was found in {attempts} attempts; try more area, fewer walls or fewer objects"
    )]
    GaveUp {
        /// Floor plans tried.
        attempts: usize,
    },
}

/// Generates a scenario with the paper's robots and objects. Same options, same text.
///
/// # Errors
/// Options out of range, or too tight to be met.
pub fn generate(options: &GenerateOptions) -> Result<Generated, GenerateError> {
    let area = checked_area(options)?;
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    for _ in 0..PLANS {
        let Some(plan) = Plan::random(&mut rng, area, options.walls) else {
            continue;
        };
        for _ in 0..ARRANGEMENTS {
            if let Some(generated) = furnish(&mut rng, &plan, options) {
                return Ok(generated);
            }
        }
    }
    Err(GenerateError::GaveUp { attempts: PLANS })
}

/// The free floor in square units.
fn checked_area(options: &GenerateOptions) -> Result<i32, GenerateError> {
    use shm_types::capacity::{MAX_OBJECTS, MAX_ROBOTS};
    let refuse = |option, given: String, allowed: String| {
        Err(GenerateError::Option {
            option,
            given,
            allowed,
        })
    };
    if !(1..=MAX_OBJECTS).contains(&options.objects) {
        let allowed = format!("from 1 to {MAX_OBJECTS}");
        return refuse(
            "the number of objects",
            options.objects.to_string(),
            allowed,
        );
    }
    if !(1..=MAX_ROBOTS).contains(&options.robots) {
        let allowed = format!("from 1 to {MAX_ROBOTS}");
        return refuse("the number of robots", options.robots.to_string(), allowed);
    }
    if !(0.0..=1.0).contains(&options.crowding) {
        let given = options.crowding.to_string();
        return refuse("the crowding", given, "from 0 to 1".to_owned());
    }
    let given = format!("{} m²", options.area_m2);
    if !(1.0..=AREA_MAX_M2).contains(&options.area_m2) {
        let allowed = format!("from 1 to {AREA_MAX_M2} m²");
        return refuse("the area", given, allowed);
    }
    let units = options.area_m2 * UNITS_PER_M2;
    if (units - units.round()).abs() > 1e-6 {
        return refuse("the area", given, "a multiple of 0.0025 m²".to_owned());
    }
    Ok(units.round() as i32)
}

/// Puts robots and objects on a floor plan and scrambles them.
fn furnish(rng: &mut ChaCha8Rng, plan: &Plan, options: &GenerateOptions) -> Option<Generated> {
    let name = format!("random-{}", options.seed);
    let size = (metres(plan.size.0), metres(plan.size.1));
    let mut draft = Draft::room(&name, [0.0, 0.0, size.0, size.1]);
    draft.walls = plan
        .walls
        .iter()
        .map(|wall| WallDraft::Box(wall.map(metres)))
        .collect();
    draft.homes = place_homes(rng, plan, options.robots)?;
    let goals = place_goals(rng, plan, &draft, options)?;
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
    Some(Generated {
        text: text(&scene, options),
        certificate: scene.certificate.clone(),
        scene,
    })
}

/// The scenario file: what it is, the scenario, the certificate.
fn text(scene: &Scene, options: &GenerateOptions) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "# Generated: rearrange generate --seed {} --objects {} --robots {} --area {} --walls {} \
         --crowding {} --extra-moves {}\n# {} m² of free floor. The moves at the end, one after \
         the other, solve it with one robot at a time.\n",
        options.seed,
        options.objects,
        options.robots,
        options.area_m2,
        options.walls,
        options.crowding,
        options.extra_moves,
        options.area_m2,
    );
    text += &canonical::text(scene.draft());
    text += &canonical::certificate_text(&scene.certificate);
    text
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

/// Goals that overlap no wall, no home and no other goal.
fn place_goals(
    rng: &mut ChaCha8Rng,
    plan: &Plan,
    draft: &Draft,
    options: &GenerateOptions,
) -> Option<Vec<[f64; 2]>> {
    // Half an object, and half an object and half a robot.
    const HALF: i32 = 4;
    let inside = [HALF, HALF, plan.size.0 - HALF, plan.size.1 - HALF];
    let mut goals: Vec<[f64; 2]> = Vec::new();
    for _ in 0..options.objects {
        let goal = (0..PLACES).find_map(|_| {
            let (x, y) = propose(rng, plan, &goals, options.crowding);
            let body = [x - HALF, y - HALF, x + HALF, y + HALF];
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
