//! How planning grows: each step of it against the number of objects at fixed density, and
//! against the number of lattice points in one room.
//!
//! Responsible for: which rooms and sizes, in which order, what is too long to be measured, and
//! what follows from the rows.
//! Not responsible for: the steps themselves (`steps`), the rooms (`room`), before and after
//! (`speedups`), files and pages.
//!
//! Terms: a *step* is a piece of planning that is timed as a whole; its *work* is counted, in
//! units of its own, and the same on every machine.

mod growth;
mod room;
mod speedups;
mod steps;

use scene::GenerateError;
use shm_types::capacity::MAX_OBJECTS;

use crate::figure::{Figure, FigureError};
use crate::progress::Progress;
use crate::results::{Results, Table, Value};
use room::Room;
use steps::{Sample, Step, Workbench};

/// Fractions of the pitch for the growth with lattice points.
const DIVISIONS: [u32; 3] = [1, 2, 4];
/// Objects for each robot of a warehouse.
const OBJECTS_PER_ROBOT: usize = 10;
/// Objects in the room whose pitch is refined.
const REFINED_OBJECTS: usize = 40;

/// What to measure.
#[derive(Clone, Debug)]
pub struct Options {
    /// Numbers of objects.
    pub objects: Vec<usize>,
    /// Seed of the rooms.
    pub seed: u64,
    /// Less of everything, within a minute on two cores.
    pub quick: bool,
}

impl Options {
    /// Rooms with so many objects; each is a repeat.
    const fn repeats(&self, objects: usize) -> usize {
        match (self.quick, objects) {
            (true, ..100) => 3,
            (true, _) | (false, 1_000..) => 2,
            (false, _) => 5,
        }
    }

    /// A step is left out where it would probably expand more cells.
    const fn most_cells(&self) -> f64 {
        if self.quick { 4e6 } else { 1.5e9 }
    }
}

/// Nothing could be measured.
#[derive(Debug, thiserror::Error)]
pub enum PlanningError {
    /// There are no such rooms.
    #[error("a room for {objects} objects could not be made: {source}")]
    Room {
        /// Objects asked for.
        objects: usize,
        /// Why not.
        source: GenerateError,
    },
    /// A warehouse that is no scenario.
    #[error("a warehouse for {objects} objects is no scenario: {reason}")]
    Warehouse {
        /// Objects asked for.
        objects: usize,
        /// Why not.
        reason: String,
    },
    /// A number of objects that no scenario has.
    #[error("a room with {0} objects: there are from 1 to {MAX_OBJECTS}")]
    Objects(usize),
    /// A figure could not be drawn.
    #[error(transparent)]
    Figure(#[from] FigureError),
}

/// Measures, until it is done or `progress` is interrupted.
///
/// # Errors
/// A room could not be made, or a figure not drawn.
pub fn run(
    options: &Options,
    command: &str,
    progress: &mut dyn Progress,
) -> Result<(Results, Vec<Figure>), PlanningError> {
    let mut results = Results::new("planning", command);
    let mut sizes = options.objects.clone();
    sizes.sort_unstable();
    sizes.dedup();
    if let Some(wrong) = sizes.iter().find(|n| !(1..=MAX_OBJECTS).contains(*n)) {
        return Err(PlanningError::Objects(*wrong));
    }
    let refined = DIVISIONS.len() * options.repeats(REFINED_OBJECTS);
    let rooms: usize = sizes.iter().map(|n| options.repeats(*n)).sum();
    // Fewer objects make no warehouse.
    let warehouse_sizes = sizes.iter().copied().filter(|n| *n >= OBJECTS_PER_ROBOT);
    let warehouse_sizes: Vec<usize> = warehouse_sizes.collect();
    let halls: usize = warehouse_sizes.iter().map(|n| options.repeats(*n)).sum();
    progress.begin((rooms + refined + halls + speedups::STEPS) as u64);
    let mut by_objects = Sweep::new(
        "by-objects",
        "Planning against the number of objects",
        &Step::PAPER,
    );
    for objects in sizes {
        by_objects.measure(options, objects, progress, &mut results, |seed| {
            room::refined(objects, seed, 1)
        })?;
    }
    let mut by_points = Sweep::new(
        "by-points",
        "Planning against the number of lattice points",
        &Step::PAPER,
    );
    for divide in DIVISIONS {
        by_points.measure(options, REFINED_OBJECTS, progress, &mut results, |seed| {
            room::refined(REFINED_OBJECTS, seed, divide)
        })?;
    }
    let mut warehouses = Sweep::new(
        "warehouses",
        "First plans of warehouses, 10 objects a robot",
        &[Step::FirstPlan],
    );
    for objects in warehouse_sizes {
        warehouses.measure(options, objects, progress, &mut results, |seed| {
            room::warehouse(objects, seed)
        })?;
    }
    let speedups = speedups::measure(options, progress, &mut results)?;
    let swept = [
        (&by_objects.table, "objects"),
        (&by_points.table, "points"),
        (&warehouses.table, "objects"),
    ];
    let growth = growth::table(swept);
    let figures = growth::figures(&by_objects.table, &by_points.table)?;
    growth::findings(&growth, &by_objects.table, &mut results);
    results.notes.push(room::ABOUT.to_owned());
    results.tables = vec![
        growth,
        speedups,
        by_objects.table,
        by_points.table,
        warehouses.table,
    ];
    Ok((results, figures))
}

/// All steps in rooms of one size after the other.
struct Sweep {
    table: Table,
    steps: &'static [Step],
}

impl Sweep {
    fn new(name: &str, title: &str, steps: &'static [Step]) -> Self {
        let table = Table::new(name, title)
            .key("step", "", "what was computed")
            .key("objects", "", "objects in the room")
            .key("pitch_m", "m", "distance of neighbouring lattice points")
            .repeat()
            .info(
                "points",
                "",
                "lattice points, free or not, of one class of bodies",
            )
            .info("area_m2", "m²", "free floor")
            .info("counted", "", "what the work is counted in")
            .lower("work", "", "work done, the same on every machine")
            .info(
                "charged_units",
                "",
                "modelled work units the paper's way costs",
            )
            .lower("step_wall_s", "s", "wall time");
        Self { table, steps }
    }

    fn measure(
        &mut self,
        options: &Options,
        objects: usize,
        progress: &mut dyn Progress,
        results: &mut Results,
        room: impl Fn(u64) -> Result<Room, PlanningError>,
    ) -> Result<(), PlanningError> {
        for repeat in 0..options.repeats(objects) {
            if progress.is_interrupted() {
                results.partial = true;
                return Ok(());
            }
            let room = room(options.seed + repeat as u64)?;
            let size = format!("{objects} objects, {} points", room.points());
            progress.step(&size);
            let mut bench = Workbench::new(&room);
            for &step in self.steps {
                let cells = step.cells(objects, room.points());
                if cells > options.most_cells() {
                    results.notes.extend((repeat == 0).then(|| {
                        format!(
                            "{}: left out with {size}, it would take too long.",
                            step.name()
                        )
                    }));
                } else if !progress.is_interrupted() {
                    let sample = bench.measure(step, repeat);
                    self.table.push(row(&room, step, repeat, sample));
                }
            }
        }
        Ok(())
    }
}

fn row(room: &Room, step: Step, repeat: usize, sample: Sample) -> Vec<Value> {
    vec![
        step.name().into(),
        room.objects().into(),
        room.scene.lattice.pitch_m.into(),
        repeat.into(),
        room.points().into(),
        room.area_m2.into(),
        step.counted().into(),
        sample.work.into(),
        sample.charged_units.into(),
        sample.time_s.into(),
    ]
}
