//! The rooms in which planning is measured.
//!
//! Responsible for: sizes, densities, pitches.
//! Not responsible for: floor plans and where things stand (`scene::scatter`).

use planner::Places;
use scene::{GenerateOptions, Scene, scatter};

use super::PlanningError;

/// What a reader has to know of them.
pub(super) const ABOUT: &str = "Rooms: the paper's robots and objects with 2.4 m² of free \
    floor an object and two dividing walls with a doorway each for five, never less than its \
    smallest room; starts and goals at random, half of them crowded next to others or in \
    doorways. Nobody knows whether such a room has a solution: what is measured is planning, not \
    execution. Growth with lattice points is that of one room on finer and finer lattices.";

/// Free floor for one object, m²: a little less than in the paper's smallest room, so that 1,000
/// of them still have a lattice that is exact.
const AREA_PER_OBJECT_M2: f64 = 2.4;
const WALLS_PER_FIVE: usize = 2;
/// Least free floor that four robots and doorways fit on, m².
const LEAST_AREA_M2: f64 = 17.0;
const ROBOTS: usize = 4;
/// Distance of the points of the lattice that such a room gets by itself, m.
const PITCH_M: f64 = 0.05;

/// A room to plan in.
pub(super) struct Room {
    pub(super) scene: Scene,
    pub(super) area_m2: f64,
    /// Every object at its start.
    pub(super) places: Vec<Option<Places>>,
}

impl Room {
    pub(super) fn objects(&self) -> usize {
        self.scene.objects.len()
    }

    pub(super) fn points(&self) -> usize {
        self.scene.lattice.len()
    }
}

/// A room of fixed density, on a lattice of this fraction of the pitch.
pub(super) fn refined(objects: usize, seed: u64, divide: u32) -> Result<Room, PlanningError> {
    let area_m2 = (AREA_PER_OBJECT_M2 * objects as f64).max(LEAST_AREA_M2);
    let walls = (objects * WALLS_PER_FIVE / 5).max(1);
    of_area(objects, area_m2, walls, seed, divide)
}

/// A warehouse.
pub(super) fn warehouse(objects: usize, seed: u64) -> Result<Room, PlanningError> {
    let robots = objects / super::OBJECTS_PER_ROBOT;
    let made = scene::warehouse(objects, robots, seed);
    let text = made.map_err(|source| PlanningError::Room { objects, source })?;
    let scene = scene::parse(&text, "warehouse.toml");
    let scene = scene.map_err(|error| PlanningError::Warehouse {
        objects,
        reason: error.to_string(),
    })?;
    let lattice = &scene.lattice;
    Ok(Room {
        // All of the hall: racks are objects.
        area_m2: lattice.len() as f64 * lattice.pitch_m * lattice.pitch_m,
        places: Vec::new(),
        scene,
    })
}

/// Any density.
pub(super) fn of_area(
    objects: usize,
    area_m2: f64,
    walls: usize,
    seed: u64,
    divide: u32,
) -> Result<Room, PlanningError> {
    let options = GenerateOptions {
        seed,
        objects,
        robots: ROBOTS,
        area_m2,
        walls,
        ..GenerateOptions::default()
    };
    let draft = scatter(&options).map_err(|source| PlanningError::Room { objects, source })?;
    // A home a little aside makes a finer lattice necessary (rule 8).
    let aside_m = PITCH_M / f64::from(divide);
    let aside = if divide > 1 {
        [-aside_m, aside_m]
    } else {
        [0.0, 0.0]
    };
    let scene = (0..ROBOTS)
        .flat_map(|robot| aside.map(|by| (robot, by)))
        .find_map(|(robot, by)| {
            let mut draft = draft.clone();
            draft.homes[robot][0] += by;
            Scene::new(draft).ok()
        });
    let Some(scene) = scene else {
        let source = scene::GenerateError::GaveUp { attempts: 1 };
        return Err(PlanningError::Room { objects, source });
    };
    let places = scene.objects.iter().map(|object| {
        Some(Places {
            initial: object.start,
            goal: object.goal?,
        })
    });
    Ok(Room {
        places: places.collect(),
        area_m2,
        scene,
    })
}
