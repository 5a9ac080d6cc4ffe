//! Rooms of unit cells: how near the exhaustive optimum plans come, and how soon large ones begin.
//!
//! Responsible for: random rooms, running them, the rows, the findings.
//! Not responsible for: the optimum (`optimum`).
//!
//! Terms: bodies are as large as a cell; objects are lifted from below. A *step* is the time that a
//! robot takes for a cell, and each grip is set to take as long. What execution adds to a grip is
//! far less, so whole steps of a run are the length of its plan. A *hall* is too large for an
//! optimum.

use std::fmt::Write as _;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::{Method, Settings};

use super::optimum::{Cell, Cells, Optimum};
use super::run::{self, Run};
use super::{Plan, spread};
use crate::progress::Progress;
use crate::results::{Finding, Results, Table};
use crate::stats::mean_interval;

/// Name of the table.
pub const CELLS: &str = "cells";
/// Width of a cell, m.
const CELL_M: f64 = 0.5;
/// Speed that makes a step a second.
const SPEED_M_PER_S: f64 = 0.5;
const STEP_S: f64 = CELL_M / SPEED_M_PER_S;
/// Joint states of the largest rooms: free cells to the power of robots and objects.
const MOST_STATES: f64 = 1e7;
/// Configurations looked at for the optimum.
const MOST_LOOKED_AT: usize = 3_000_000;
/// Halls: cells along a side, robots, objects.
const HALL: (usize, usize, usize) = (16, 4, 20);
/// Share of rooms whose plan is to be as short as the optimum.
const TARGET_OPTIMAL: f64 = 0.95;
/// Mean length by the optimum that is to be reached.
const TARGET_RATIO: f64 = 1.03;
/// Most ticks that execution is to add for each grip.
const TARGET_TICKS_PER_GRIP: f64 = 4.0;
/// Longest planning of a room with a known optimum, and of a hall, s.
const TARGET_PLANNING_S: (f64, f64) = (1.0, 2.0);

/// A room as it was run.
#[derive(Clone, Debug)]
pub struct CellRoom {
    seed: u64,
    cells: Cells,
    /// None of halls.
    optimum: Option<Optimum>,
    run: Option<Run>,
    /// World time of a tick, s.
    tick_s: f64,
}

impl CellRoom {
    /// Whole steps from the first motion to the end, and what is left beside them, s.
    fn length(&self) -> Option<(f64, f64)> {
        let run = self.run.as_ref().filter(|run| run.is_solved())?;
        let took_s = run.makespan_s - run.first_motion_s? + self.tick_s;
        let steps = (took_s / STEP_S + 1e-6).floor();
        Some((steps, took_s - steps * STEP_S))
    }

    /// Length by the optimum.
    fn ratio(&self) -> Option<f64> {
        match self.optimum {
            Some(Optimum::Steps(steps)) => Some(self.length()?.0 / f64::from(steps)),
            _ => None,
        }
    }

    /// Ticks beyond whole steps for each grip that has to be made.
    fn ticks_per_grip(&self) -> Option<f64> {
        let moved = self
            .cells
            .objects
            .iter()
            .filter(|(start, goal)| start != goal);
        let grips = 2 * moved.count().max(1);
        Some(self.length()?.1 / self.tick_s / grips as f64)
    }
}

/// A random room with the optimum known to exist, or none.
fn small(random: &mut ChaCha8Rng) -> Option<(Cells, Optimum)> {
    let size = (random.random_range(3..=5), random.random_range(3..=6));
    let robots = random.random_range(1..=3);
    let objects = random.random_range(1..=3);
    let walls = random.random_range(0..=size.0 * size.1 / 4);
    let cells = furnish(random, size, walls, robots, objects)?;
    let free = (size.0 * size.1 - walls) as f64;
    if free.powi((robots + objects) as i32) > MOST_STATES {
        return None;
    }
    let optimum = cells.optimum(MOST_LOOKED_AT);
    matches!(optimum, Optimum::Steps(1..)).then_some((cells, optimum))
}

fn furnish(
    random: &mut ChaCha8Rng,
    (width, height): (usize, usize),
    walls: usize,
    robots: usize,
    objects: usize,
) -> Option<Cells> {
    let mut cells: Vec<Cell> = (0..width * height).map(|cell| cell as Cell).collect();
    cells.shuffle(random);
    let mut is_wall = vec![false; width * height];
    let (closed, open) = cells.split_at(walls);
    for &cell in closed {
        is_wall[usize::from(cell)] = true;
    }
    let (homes, starts) = open.split_at_checked(robots)?;
    let mut goals = starts.to_vec();
    goals.shuffle(random);
    let ends = starts.iter().copied().zip(goals).take(objects);
    let cells = Cells {
        width,
        walls: is_wall,
        homes: homes.to_vec(),
        objects: ends.collect(),
    };
    (cells.objects.len() == objects).then_some(cells)
}

/// The room as a scenario.
#[must_use]
pub fn text(cells: &Cells) -> String {
    let (width, height) = (cells.width, cells.walls.len() / cells.width);
    let edge = |index: usize| index as f64 * CELL_M;
    let at = |cell: Cell| {
        let (x, y) = (usize::from(cell) % width, usize::from(cell) / width);
        format!("[{}, {}]", edge(x) + CELL_M / 2.0, edge(y) + CELL_M / 2.0)
    };
    let boxes: Vec<String> = (0..cells.walls.len())
        .filter(|&cell| cells.walls[cell])
        .map(|cell| {
            let (x, y) = (cell % width, cell / width);
            let ends = [edge(x), edge(y), edge(x + 1), edge(y + 1)];
            format!("{{ box = {ends:?} }}")
        })
        .collect();
    let mut text = format!(
        "name = \"cells\"\nresolution = {CELL_M}\nconnectivity = 4\n[robot]\nshape = {{ box = \
         [{CELL_M}, {CELL_M}] }}\nspeed = {SPEED_M_PER_S}\ngrasp_s = {STEP_S:?}\nrelease_s = \
         {STEP_S:?}\n[object]\nshape = {{ box = [{CELL_M}, {CELL_M}] }}\ngrasp = [0.0, \
         0.0]\npass_under = true\n[workspace]\nbounds = [0.0, 0.0, {}, {}]\nwalls = [{}]\n",
        edge(width),
        edge(height),
        boxes.join(", ")
    );
    // Writing to a string does not fail.
    for &home in &cells.homes {
        let _ = writeln!(text, "[[robots]]\nhome = {}", at(home));
    }
    for &(start, goal) in &cells.objects {
        let _ = writeln!(
            text,
            "[[objects]]\nstart = {}\ngoal = {}",
            at(start),
            at(goal)
        );
    }
    text
}

/// Makes a room of this seed and runs it; none if it has no plan, or too many states.
fn one(seed: u64, is_hall: bool, plan: &Plan, stop: &AtomicBool) -> Option<CellRoom> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (cells, optimum) = if is_hall {
        let (side, robots, objects) = HALL;
        (
            furnish(&mut random, (side, side), 0, robots, objects)?,
            None,
        )
    } else {
        let (cells, optimum) = std::iter::repeat_with(|| small(&mut random))
            .flatten()
            .next()?;
        (cells, Some(optimum))
    };
    let settings = Settings {
        method: Method::Anytime,
        time_limit_ns: (plan.max_time_s * 1e9) as u64,
        ..Settings::default()
    };
    let until = Instant::now() + Duration::from_secs_f64(plan.wall_cap_s);
    let scene = scene::parse(&text(&cells), "cells").ok();
    Some(CellRoom {
        seed,
        cells,
        optimum,
        run: scene.map(|scene| run::run(&scene, &settings, until, stop)),
        tick_s: settings.tick_ns as f64 * 1e-9,
    })
}

/// Runs so many small rooms and halls as the plan says; their rows and findings go to `results`.
pub fn measure(plan: &Plan, results: &mut Results, progress: &mut dyn Progress) {
    let seeds =
        |count: usize, is_hall| (0..count as u64).map(move |index| (plan.seed + index, is_hall));
    let jobs: Vec<_> = seeds(plan.unit_cells, false)
        .chain(seeds(plan.halls, true))
        .collect();
    if jobs.is_empty() {
        return;
    }
    let make = |&(seed, is_hall): &(u64, bool), stop: &AtomicBool| one(seed, is_hall, plan, stop);
    let name = |job: &(u64, bool)| format!("cells-{}", job.0);
    let (rooms, is_partial) = spread(&jobs, plan.threads, progress, name, make);
    results.partial |= is_partial;
    let rooms: Vec<CellRoom> = rooms.into_iter().flatten().collect();
    results.tables.push(table(&rooms));
    results.findings.extend(findings(&rooms));
}

fn table(rooms: &[CellRoom]) -> Table {
    let table = Table::new(CELLS, "Rooms of unit cells")
        .key("seed", "", "what the room is made from")
        .key("cells", "", "cells that are not walls")
        .key("robots", "", "robots")
        .key("objects", "", "objects")
        .info(
            "optimum_steps",
            "",
            "least steps by looking at everything; none of halls",
        )
        .lower("steps", "", "whole steps of the run, from its first motion")
        .lower("to_optimum", "", "steps by the optimum")
        .lower(
            "ticks_per_grip",
            "",
            "ticks beyond whole steps for each grip that has to be made",
        );
    let mut table = run::columns(table);
    for room in rooms {
        let optimum = match room.optimum {
            Some(Optimum::Steps(steps)) => Some(f64::from(steps)),
            _ => None,
        };
        let mut row = vec![
            (room.seed as f64).into(),
            room.cells
                .walls
                .iter()
                .filter(|wall| !**wall)
                .count()
                .into(),
            room.cells.homes.len().into(),
            room.cells.objects.len().into(),
            optimum.into(),
            room.length().map(|(steps, _)| steps).into(),
            room.ratio().into(),
            room.ticks_per_grip().into(),
        ];
        row.extend(room.run.clone().unwrap_or_default().values());
        table.push(row);
    }
    table
}

fn findings(rooms: &[CellRoom]) -> Vec<Finding> {
    let small: Vec<_> = rooms.iter().filter(|room| room.optimum.is_some()).collect();
    let halls: Vec<_> = rooms.iter().filter(|room| room.optimum.is_none()).collect();
    let ratios: Vec<f64> = small.iter().filter_map(|room| room.ratio()).collect();
    let optimal = ratios.iter().filter(|ratio| **ratio < 1.0 + 1e-9).count();
    let mean = mean_interval(&ratios);
    let most = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::NAN, f64::max);
    let ticks = most(&mut small.iter().filter_map(|room| room.ticks_per_grip()));
    let planning = |rooms: &[&CellRoom]| {
        let runs = rooms.iter().filter_map(|room| room.run.as_ref());
        let world_s = most(&mut runs.clone().filter_map(|run| run.first_motion_s));
        (
            world_s,
            most(&mut runs.map(|run| run.planning_before_wall_s)),
        )
    };
    let solved = |rooms: &[&CellRoom]| rooms.iter().filter(|room| room.length().is_some()).count();
    let (small_s, halls_s) = (planning(&small), planning(&halls));
    let claim = |claim: String, held: bool, rooms: &[&CellRoom], evidence: String| Finding {
        claim,
        held: (!rooms.is_empty()).then_some(held),
        evidence,
    };
    vec![
        claim(
            format!(
                "unit cells: at least {} % of plans are as short as the optimum",
                TARGET_OPTIMAL * 100.0
            ),
            optimal as f64 >= TARGET_OPTIMAL * small.len() as f64,
            &small,
            format!("{optimal} of {}, {} solved", small.len(), solved(&small)),
        ),
        claim(
            format!("unit cells: mean length at most {TARGET_RATIO} times the optimum"),
            mean.is_some_and(|mean| mean.value <= TARGET_RATIO),
            &small,
            mean.map_or_else(String::new, |mean| {
                format!("{:.3} [{:.3}, {:.3}]", mean.value, mean.low, mean.high)
            }),
        ),
        claim(
            format!(
                "unit cells: execution adds at most {TARGET_TICKS_PER_GRIP} ticks for each grip"
            ),
            ticks <= TARGET_TICKS_PER_GRIP,
            &small,
            format!("at most {ticks:.2}"),
        ),
        claim(
            format!("unit cells: at most {} s of planning", TARGET_PLANNING_S.0),
            small_s.0.max(small_s.1) <= TARGET_PLANNING_S.0,
            &small,
            format!(
                "at most {:.2} s of world time, {:.2} s on the wall",
                small_s.0, small_s.1
            ),
        ),
        claim(
            format!(
                "{0} × {0} unit cells, {1} robots, {2} objects: solved within {3} s",
                HALL.0, HALL.1, HALL.2, TARGET_PLANNING_S.1
            ),
            solved(&halls) == halls.len() && halls_s.0.max(halls_s.1) <= TARGET_PLANNING_S.1,
            &halls,
            format!(
                "{} of {}; at most {:.2} s of world time, {:.2} s on the wall until the first motion",
                solved(&halls),
                halls.len(),
                halls_s.0,
                halls_s.1
            ),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rooms_of_cells_are_scenes_and_no_run_is_shorter_than_the_optimum() {
        let plan = Plan {
            sets: Vec::new(),
            rooms: 0,
            seeded: 0,
            unit_cells: 12,
            halls: 1,
            seed: 1,
            max_time_s: 400.0,
            wall_cap_s: 600.0,
            unknown_cap_s: 600.0,
            threads: 2,
        };
        let mut results = Results::new("solve", "");
        measure(&plan, &mut results, &mut ());
        let table = results.table(CELLS).unwrap();
        assert_eq!(table.rows.len(), 13);
        let ratios: Vec<f64> = table.numbers("to_optimum", &[]).collect();
        assert_eq!(ratios.len(), 12, "all solved");
        assert!(ratios.iter().all(|ratio| *ratio >= 1.0), "{ratios:?}");
        let ticks: Vec<f64> = table.numbers("ticks_per_grip", &[]).collect();
        assert!(
            ticks.iter().all(|ticks| (-1e-6..50.0).contains(ticks)),
            "{ticks:?}"
        );
    }
}
