//! The rooms in which it is asked what is solved: generated ones of every kind, the paper's six,
//! and seeded ones of the paper's sizes.
//!
//! Responsible for: which rooms there are, and making each from its options.
//! Not responsible for: how a room is generated (`scene::generate`).
//!
//! Terms: a *kind* is a density, a number of robots, one of objects, and extra moves: moves beyond
//! one an object with which the room was scrambled, so that some object may have to be set aside.

use scene::{GenerateOptions, Scene, generate};

use super::Plan;
use crate::paper::{self, PAPER_ROOMS};
use crate::results::{Table, Value};

/// How much floor there is for each object, and how often it stands in the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Density {
    /// Its name in results.
    pub word: &'static str,
    /// Free floor for each object, m².
    pub area_per_object_m2: f64,
    /// Share of places next to other objects or in doorways.
    pub crowding: f64,
}

/// From room to spare to what the generator still finds rooms for.
pub const DENSITIES: [Density; 3] = [
    Density {
        word: "loose",
        area_per_object_m2: 8.0,
        crowding: 0.2,
    },
    Density {
        word: "medium",
        area_per_object_m2: 5.0,
        crowding: 0.5,
    },
    Density {
        word: "dense",
        area_per_object_m2: 3.4,
        crowding: 0.8,
    },
];
/// Least free floor of a generated room, m²: walls, robots and a way past them need some.
const LEAST_AREA_M2: f64 = 12.0;
/// Free floor for each dividing wall, m².
const AREA_PER_WALL_M2: f64 = 8.0;
/// Numbers of objects of generated rooms.
const OBJECTS: std::ops::RangeInclusive<usize> = 3..=12;
/// Numbers of robots.
const ROBOTS: std::ops::RangeInclusive<usize> = 1..=4;
/// Extra moves.
const EXTRA_MOVES: [usize; 2] = [0, 2];
/// From one kind to the next: it has no divisor in common with the number of kinds, so that any
/// few rooms in a row are of very different kinds, and all kinds come in turn.
const STRIDE: usize = 97;

/// Where rooms come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Set {
    /// Of every kind.
    Generated,
    /// The paper's six.
    Paper,
    /// Of the paper's sizes, as in `bench paper`.
    Seeded,
}

impl Set {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Paper, Self::Seeded, Self::Generated];

    /// Its name in results.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Generated => "generated",
            Self::Paper => "paper",
            Self::Seeded => "seeded",
        }
    }
}

/// A room that can be made.
#[derive(Clone, Debug, PartialEq)]
pub struct Room {
    /// Where it comes from.
    pub set: Set,
    /// Its name, the same for all numbers of robots of a paper's or seeded room.
    pub name: String,
    /// Which density, in generated rooms.
    pub density: Option<&'static str>,
    /// What it is generated from; none of the paper's six.
    pub options: Option<GenerateOptions>,
    /// Robots that take part.
    pub robots: usize,
}

impl Room {
    /// The scene.
    ///
    /// # Errors
    /// There is no such room, and why.
    pub fn scene(&self) -> Result<Scene, String> {
        let scene = match &self.options {
            Some(options) => generate(options).map_err(|error| error.to_string())?.scene,
            None => {
                let unknown = || format!("there is no room {}", self.name);
                let builtin = scene::builtin(&self.name).ok_or_else(unknown)?;
                scene::parse(builtin.text, &self.name).map_err(|error| error.to_string())?
            }
        };
        if scene.homes.len() == self.robots {
            return Ok(scene);
        }
        let fewer = scene.with_robots(self.robots);
        fewer.map_err(|problems| problems.to_string())
    }

    /// Options of `rearrange generate` that make it; empty for the paper's six.
    #[must_use]
    pub fn command(&self) -> String {
        self.options.as_ref().map_or_else(String::new, |options| {
            format!(
                "--seed {} --objects {} --robots {} --area {} --walls {} --crowding {} --extra-moves {}",
                options.seed,
                options.objects,
                options.robots,
                options.area_m2,
                options.walls,
                options.crowding,
                options.extra_moves
            )
        })
    }

    /// Cells under [`keys`].
    #[must_use]
    pub fn values(&self) -> Vec<Value> {
        let options = self.options.as_ref();
        vec![
            self.set.word().into(),
            self.name.as_str().into(),
            self.robots.into(),
            self.density.into(),
            options.map(|options| options.objects).into(),
            options.map(|options| options.extra_moves).into(),
            self.command().into(),
        ]
    }
}

/// The table with the columns that say which room a row is of.
#[must_use]
pub fn keys(table: Table) -> Table {
    table
        .key(
            "set",
            "",
            "generated, the paper's six, or seeded ones of the paper's sizes",
        )
        .key("room", "", "name of the room")
        .key("robots", "", "robots that take part")
        .key("density", "", "floor for each object, and crowding")
        .key("objects", "", "objects of a generated or seeded room")
        .key(
            "extra_moves",
            "",
            "moves beyond one an object with which it was scrambled",
        )
        .key(
            "generate",
            "",
            "options of `rearrange generate` that make it; then `--robots` of `run`",
        )
}

/// Every room of a plan, in order.
#[must_use]
pub fn all(plan: &Plan) -> Vec<Room> {
    let mut rooms = Vec::new();
    for set in Set::ALL.iter().filter(|set| plan.sets.contains(set)) {
        match set {
            Set::Paper => rooms.extend(PAPER_ROOMS.iter().flat_map(|name| {
                ROBOTS.map(|robots| Room {
                    set: *set,
                    name: (*name).to_owned(),
                    density: None,
                    options: None,
                    robots,
                })
            })),
            Set::Seeded => rooms.extend((0..plan.seeded).flat_map(|index| {
                let options = paper::seeded(plan.seed + index as u64, index);
                ROBOTS.map(move |robots| Room {
                    set: *set,
                    name: format!("seed-{}", options.seed),
                    density: None,
                    options: Some(options.clone()),
                    robots,
                })
            })),
            Set::Generated => {
                let kinds = kinds();
                rooms.extend((0..plan.rooms).map(|index| {
                    let kind = kinds[index * STRIDE % kinds.len()];
                    generated(kind, plan.seed + index as u64)
                }));
            }
        }
    }
    rooms
}

/// A density, robots, objects, extra moves.
type Kind = (Density, usize, usize, usize);

fn kinds() -> Vec<Kind> {
    let mut kinds = Vec::new();
    for extra_moves in EXTRA_MOVES {
        for objects in OBJECTS {
            for robots in ROBOTS {
                kinds.extend(DENSITIES.map(|density| (density, robots, objects, extra_moves)));
            }
        }
    }
    kinds
}

fn generated((density, robots, objects, extra_moves): Kind, seed: u64) -> Room {
    let area_m2 = (density.area_per_object_m2 * objects as f64).max(LEAST_AREA_M2);
    // Whole tenths: options read back as they were, and the generator's unit divides them.
    let area_m2 = (area_m2 * 10.0).round() / 10.0;
    Room {
        set: Set::Generated,
        name: format!("generated-{seed}"),
        density: Some(density.word),
        options: Some(GenerateOptions {
            seed,
            objects,
            robots,
            area_m2,
            walls: (area_m2 / AREA_PER_WALL_M2).round() as usize,
            crowding: density.crowding,
            extra_moves,
        }),
        robots,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn plan(rooms: usize) -> Plan {
        Plan {
            sets: Set::ALL.into(),
            rooms,
            seeded: 2,
            seed: 5,
            max_time_s: 1.0,
            wall_cap_s: 1.0,
            unknown_cap_s: 1.0,
            unit_cells: 0,
            halls: 0,
            threads: 1,
        }
    }

    #[test]
    fn every_kind_comes_in_turn_and_few_rooms_are_of_all_sorts() {
        let of = |rooms| all(&plan(rooms)).split_off((PAPER_ROOMS.len() + 2) * 4);
        let kind = |room: &Room| {
            let options = room.options.as_ref().unwrap();
            (
                room.density,
                room.robots,
                options.objects,
                options.extra_moves,
            )
        };
        let rooms = of(240);
        assert_eq!(rooms.iter().map(kind).collect::<BTreeSet<_>>().len(), 240);
        let few = of(24);
        let values =
            |value: &dyn Fn(&Room) -> usize| few.iter().map(value).collect::<BTreeSet<_>>();
        assert_eq!(values(&|room| room.robots).len(), 4);
        assert_eq!(values(&|room| kind(room).2).len(), 10);
        assert_eq!(values(&|room| kind(room).3).len(), 2);
        let densities: BTreeSet<_> = few.iter().map(|room| room.density).collect();
        assert_eq!(densities.len(), 3);
    }

    #[test]
    fn a_room_is_made_with_as_many_robots_as_take_part() {
        let rooms = all(&plan(1));
        let shipped = rooms.iter().find(|room| room.robots == 3).unwrap();
        assert_eq!(
            (shipped.name.as_str(), shipped.command().as_str()),
            ("paper-17a", "")
        );
        assert_eq!(shipped.scene().unwrap().homes.len(), 3);
        let seeded = rooms.iter().find(|room| room.set == Set::Seeded).unwrap();
        assert_eq!(seeded.scene().unwrap().homes.len(), 1);
        assert!(
            seeded
                .command()
                .starts_with("--seed 5 --objects 5 --robots 4 --area 17 ")
        );
        let none = Room {
            name: "no such".into(),
            ..shipped.clone()
        };
        assert_eq!(none.scene().unwrap_err(), "there is no room no such");
    }
}
