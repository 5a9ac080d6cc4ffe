//! A warehouse: pods in racks, aisles between them, robots that lift pods from below (rule 28).
//!
//! Responsible for: the floor plan, which pod goes where, and the file that says so.
//! Not responsible for: random rooms (`generate`).
//!
//! All is in cells as large as a pod, and a robot is as large as a pod: an aisle is as wide as one
//! loaded robot. Racks are [`RACK`] cells, with an aisle all around each, so every *slot* (a cell
//! of a rack) lies at an aisle. Robots that carry nothing pass under pods. Homes lie along the lower
//! and the upper wall.
//!
//! Pods are set at their goals; then each, in random order, is carried to a slot that is empty,
//! and that is where it starts. Read backwards these moves solve the warehouse: slots lie at
//! aisles, and nobody is at rest in one.

use std::fmt::Write as _;

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shm_types::capacity::{MAX_OBJECTS, MAX_ROBOTS};

use crate::generate::GenerateError;

/// Columns and rows of a rack, cells.
const RACK: (usize, usize) = (8, 2);
/// Of so many slots, [`TAKEN`] have a pod.
const SLOTS: usize = 4;
const TAKEN: usize = 3;
/// Rows for homes: one below, one above.
const HOME_ROWS: usize = 2;

/// A cell: column and row.
type Cell = (usize, usize);

/// Makes the file of a warehouse. Same numbers, same text.
///
/// # Errors
/// More objects or robots than a scenario may have, none, or more robots than there is room for
/// homes.
pub fn warehouse(objects: usize, robots: usize, seed: u64) -> Result<String, GenerateError> {
    let refuse = |option, given: usize, most: usize| {
        Err(GenerateError::Option {
            option,
            given: given.to_string(),
            allowed: format!("from 1 to {most}"),
        })
    };
    if !(1..=MAX_OBJECTS).contains(&objects) {
        return refuse("the number of objects", objects, MAX_OBJECTS);
    }
    let floor = Floor::of(objects);
    let most = MAX_ROBOTS.min(HOME_ROWS * floor.width());
    if !(1..=most).contains(&robots) {
        return refuse("the number of robots", robots, most);
    }
    let moves = scramble(floor.slots(), objects, seed);
    Ok(text(&floor, &moves, robots, seed))
}

/// How many racks there are.
#[derive(Clone, Copy, Debug)]
struct Floor {
    columns: usize,
    rows: usize,
}

impl Floor {
    /// About as wide as high, with room for so many pods.
    fn of(objects: usize) -> Self {
        let racks = (objects * SLOTS)
            .div_ceil(TAKEN)
            .div_ceil(RACK.0 * RACK.1)
            .max(1);
        // A rack with its aisles is (columns + 1) by (rows + 1) cells.
        let across = (racks * (RACK.1 + 1)) as f64 / (RACK.0 + 1) as f64;
        let columns = (across.sqrt().ceil() as usize).max(1);
        Self {
            columns,
            rows: racks.div_ceil(columns),
        }
    }

    const fn width(self) -> usize {
        self.columns * (RACK.0 + 1) + 1
    }

    const fn height(self) -> usize {
        self.rows * (RACK.1 + 1) + 1 + HOME_ROWS
    }

    /// The cells of all racks.
    fn slots(self) -> Vec<Cell> {
        let is_rack = |x: usize, y: usize| {
            let is_aisle = x.is_multiple_of(RACK.0 + 1) || (y - 1).is_multiple_of(RACK.1 + 1);
            !is_aisle
        };
        (1..self.height() - 1)
            .flat_map(|y| (0..self.width()).map(move |x| (x, y)))
            .filter(|&(x, y)| is_rack(x, y))
            .collect()
    }

    /// Where robot `robot` of `robots` lives: in turn along the lower and the upper wall.
    fn home(self, robot: usize, robots: usize) -> Cell {
        let along = (robot / HOME_ROWS) * self.width() / robots.div_ceil(HOME_ROWS);
        match robot % HOME_ROWS {
            0 => (along, 0),
            _ => (along, self.height() - 1),
        }
    }
}

/// For each pod where it starts and where it goes, and in what order they can be carried.
struct Moves {
    from: Vec<Cell>,
    to: Vec<Cell>,
    order: Vec<usize>,
}

fn scramble(mut slots: Vec<Cell>, pods: usize, seed: u64) -> Moves {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    slots.shuffle(&mut rng);
    let mut empty = slots.split_off(pods);
    let to = slots;
    let mut from = to.clone();
    let mut order: Vec<usize> = (0..pods).collect();
    order.shuffle(&mut rng);
    for &pod in &order {
        let slot = rng.random_range(0..empty.len() as u32) as usize;
        from[pod] = std::mem::replace(&mut empty[slot], to[pod]);
    }
    order.reverse();
    Moves { from, to, order }
}

fn text(floor: &Floor, moves: &Moves, robots: usize, seed: u64) -> String {
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = write(&mut out, floor, moves, robots, seed);
    out
}

fn write(
    out: &mut String,
    floor: &Floor,
    moves: &Moves,
    robots: usize,
    seed: u64,
) -> std::fmt::Result {
    let pods = moves.from.len();
    writeln!(
        out,
        "# A warehouse of {pods} pods and {robots} robots that lift them from below, with aisles as \
         wide as one loaded robot.\n# Generated: rearrange generate --layout warehouse --objects \
         {pods} --robots {robots} --seed {seed}\n# The moves of the certificate, one after the \
         other, solve it with one robot at a time.\nname = \"warehouse-{pods}\"\nresolution = 1.0\n\
         connectivity = 4"
    )?;
    writeln!(out, "robots = [")?;
    for robot in 0..robots {
        writeln!(out, "  {{ home = {} }},", centre(floor.home(robot, robots)))?;
    }
    writeln!(out, "]\nobjects = [")?;
    for (from, to) in moves.from.iter().zip(&moves.to) {
        let (start, goal) = (centre(*from), centre(*to));
        writeln!(out, "  {{ start = {start}, goal = {goal} }},")?;
    }
    writeln!(out, "]\ncertificate = [")?;
    for &object in &moves.order {
        let (from, to) = (centre(moves.from[object]), centre(moves.to[object]));
        writeln!(out, "  {{ object = {object}, from = {from}, to = {to} }},")?;
    }
    writeln!(
        out,
        "]\n\n[robot]\nshape = {{ box = [1.0, 1.0] }}\nspeed = 1.0\ngrasp_s = 1.0\nrelease_s = \
         1.0\n\n[object]\nshape = {{ box = [1.0, 1.0] }}\ngrasp = [0.0, 0.0]\npass_under = \
         true\n\n[workspace]\nbounds = [0.0, 0.0, {:?}, {:?}]",
        floor.width() as f64,
        floor.height() as f64
    )
}

/// The centre of a cell, m.
fn centre((x, y): Cell) -> String {
    format!("[{:?}, {:?}]", x as f64 + 0.5, y as f64 + 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::moves::check_certificate;

    #[test]
    fn a_warehouse_is_solved_by_its_certificate_on_a_lattice_of_cells() {
        let text = warehouse(60, 10, 7).unwrap();
        assert_eq!(text, warehouse(60, 10, 7).unwrap());
        assert_ne!(text, warehouse(60, 10, 8).unwrap());
        let scene = crate::parse(&text, "warehouse").unwrap_or_else(|e| panic!("{}", e.plain()));
        assert_eq!((scene.objects.len(), scene.homes.len()), (60, 10));
        assert!(scene.lattice.exact);
        assert_eq!(scene.lattice.pitch_m, 1.0);
        assert_eq!(scene.certificate.len(), 60);
        assert_eq!(check_certificate(&scene, &scene.certificate), Ok(()));
        let mut other_way = scene.certificate.clone();
        other_way.reverse();
        assert!(check_certificate(&scene, &other_way).is_err());
    }

    #[test]
    fn what_has_no_room_is_refused() {
        for (objects, robots) in [(0, 1), (1, 0), (1, 100), (MAX_OBJECTS + 1, 1)] {
            assert!(warehouse(objects, robots, 1).is_err(), "{objects} {robots}");
        }
        for (objects, robots) in [(1, 1), (1, 20), (MAX_OBJECTS, 100)] {
            let text = warehouse(objects, robots, 1).unwrap();
            assert!(crate::parse(&text, "x").is_ok(), "{objects} {robots}");
        }
    }

    #[test]
    fn three_of_four_slots_are_taken_and_each_lies_at_an_aisle() {
        for pods in [1, 12, 13, 60, 500, MAX_OBJECTS] {
            let floor = Floor::of(pods);
            let slots = floor.slots();
            let rack = RACK.0 * RACK.1;
            assert_eq!(slots.len(), floor.columns * floor.rows * rack);
            // No more racks than it takes, but for the last row of them.
            let needed = (pods * SLOTS).div_ceil(TAKEN).div_ceil(rack);
            let racks = floor.columns * floor.rows;
            assert!(
                (needed..needed + floor.columns).contains(&racks),
                "{pods}: {racks}"
            );
            for &(x, y) in &slots {
                assert!(
                    (1..floor.width() - 1).contains(&x) && (2..floor.height() - 2).contains(&y)
                );
                let beside = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
                assert!(beside.iter().any(|cell| !slots.contains(cell)), "{x}, {y}");
            }
        }
    }
}
