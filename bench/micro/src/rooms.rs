//! Rooms and queries.

use planner::Places;
use scene::{GenerateOptions, Scene, Vec2, scatter};

/// A room at random with so many objects on so much free floor, m².
///
/// # Panics
/// There is no such room.
#[must_use]
pub fn room(objects: usize, area_m2: f64, walls: usize, robots: usize) -> Scene {
    let options = GenerateOptions {
        seed: 1,
        objects,
        robots,
        area_m2,
        walls,
        ..GenerateOptions::default()
    };
    let draft = scatter(&options).unwrap_or_else(|error| panic!("{error}"));
    Scene::new(draft).unwrap_or_else(|problems| panic!("{problems:?}"))
}

/// A room that comes with the program.
///
/// # Panics
/// There is none of that name.
#[must_use]
pub fn builtin(name: &str) -> Scene {
    let found = scene::builtin(name).unwrap_or_else(|| panic!("no room {name}"));
    scene::parse(found.text, found.name).unwrap_or_else(|error| panic!("{}", error.plain()))
}

/// Where all objects are at the start.
pub fn places(scene: &Scene) -> impl Iterator<Item = Option<Places>> + '_ {
    scene.objects.iter().map(|object| {
        Some(Places {
            initial: object.start,
            goal: object.goal?,
        })
    })
}

/// Pairs of robot centres to search a path between, for the class of the first object.
#[must_use]
pub fn queries(scene: &Scene, count: usize) -> Vec<(Vec2, Vec2)> {
    let ends: Vec<_> = scene
        .objects
        .iter()
        .flat_map(|object| [Some(object.start), object.goal].map(|at| Some(at? + object.grasp)))
        .flatten()
        .collect();
    (0..count)
        .map(|query| {
            let from = ends[query % ends.len()];
            // Any step that shares no factor with most numbers of ends.
            (
                from,
                ends[(query * 31 + query / ends.len() + 7) % ends.len()],
            )
        })
        .collect()
}
