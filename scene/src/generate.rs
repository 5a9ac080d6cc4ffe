//! Random scenarios that are known to be solvable (rule 28).
//!
//! Responsible for: the options, trying until the dice fall well, and the text of the result.
//! Not responsible for: the floor plan (`rooms`), what is put in it and how it is scrambled
//! (`furnish`).
//!
//! Terms: *crowding* is the share of places chosen next to another object or in a doorway, where
//! they constrain other tasks; the rest are chosen anywhere.

use std::fmt::Write as _;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::canonical;
use crate::draft::{Draft, Move};
use crate::furnish::{furnish, strew};
use crate::rooms::{Plan, UNITS_PER_M2};
use crate::scene::Scene;

/// Floor plans tried before giving up.
const PLANS: usize = 200;
/// Arrangements tried on one floor plan.
const ARRANGEMENTS: usize = 5;
/// Largest free floor, m².
const AREA_MAX_M2: f64 = 10_000.0;
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
            if let Some(scene) = furnish(&mut rng, &plan, options) {
                return Ok(Generated {
                    text: text(&scene, options),
                    certificate: scene.certificate.clone(),
                    scene,
                });
            }
        }
    }
    Err(GenerateError::GaveUp { attempts: PLANS })
}

/// A room like those of [`generate`] with the objects and their goals anywhere: fit for measuring
/// how planning grows, but nobody knows whether it has a solution. Every object can be grasped and
/// released where it stands, as far as the walls go. Same options, same room; `extra_moves` does
/// not count.
///
/// # Errors
/// Options out of range, or too tight to be met.
pub fn scatter(options: &GenerateOptions) -> Result<Draft, GenerateError> {
    let area = checked_area(options)?;
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    for _ in 0..PLANS {
        if let Some(plan) = Plan::random(&mut rng, area, options.walls)
            && let Some(draft) = strew(&mut rng, &plan, options)
        {
            return Ok(draft);
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
