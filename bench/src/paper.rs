//! The paper's experiment: rooms × robots × methods, and what the numbers say of its directions.
//!
//! Responsible for: which runs are made, in what order, and the row of each.
//! Not responsible for: running one (`run`, or the caller for real processes), judging the
//! directions (`directions`), drawing (`figures`).
//!
//! Terms: the *modelled* planning time counts work units at a stated speed and is the same on
//! every machine; the *measured* one is wall time of the same steps. *Literal* recomputes all
//! hard constraints at every event, *cached* only those of objects that have moved (rule 23).
//!
//! Source: paper §V, Tables I and II, Figs. 6 and 7; rules 23 to 25.

pub mod directions;
pub mod figures;
pub mod run;

use scene::{Compute, GenerateError, GenerateOptions, HardMode, Method, Scene, Settings, generate};

use crate::progress::Progress;
use crate::results::{Results, Table, Value};
use run::{Measures, Row, RunError};

/// Name of the table with a row a run.
pub const RUNS: &str = "runs";
/// The paper's rooms, by name.
pub const PAPER_ROOMS: [&str; 6] = [
    "paper-17a",
    "paper-17b",
    "paper-41a",
    "paper-41b",
    "paper-68a",
    "paper-68b",
];
/// Free floors of the paper's rooms (Table I), m², two rooms of each, and the dividing walls of
/// seeded rooms of that floor.
const FLOORS: [(f64, usize); 3] = [(17.0, 3), (41.5, 4), (68.8, 5)];
/// Objects in each seeded room, as in the paper.
const OBJECTS: usize = 5;
/// Most robots, as in the paper.
const ROBOTS: usize = 4;

/// What is run.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Seeded rooms beside the paper's six.
    pub rooms: usize,
    /// Seed of the first of them.
    pub seed: u64,
    /// Numbers of robots.
    pub robots: Vec<usize>,
    /// Modelled speeds, work units a second.
    pub units_per_second: Vec<u64>,
    /// Whose computer it is.
    pub compute: Vec<Compute>,
    /// How often each run is made: modelled times repeat, wall times spread.
    pub repeats: usize,
}

impl Plan {
    /// The whole experiment.
    #[must_use]
    pub fn full() -> Self {
        Self {
            rooms: 100,
            seed: 1,
            robots: (1..=ROBOTS).collect(),
            units_per_second: vec![10_000, 100_000, 1_000_000, 10_000_000],
            compute: vec![Compute::Own, Compute::Shared],
            repeats: 1,
        }
    }

    /// The paper's 96 runs and a few seeded rooms, at the default speed and a slow one.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            rooms: FLOORS.len(),
            units_per_second: vec![100_000, 10_000_000],
            compute: vec![Compute::Own],
            ..Self::full()
        }
    }
}

/// A method as results name it: "all" comes in two kinds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// The method.
    pub method: Method,
    /// Whether "all" recomputes at every event.
    pub hard: HardMode,
}

/// Every variant, the paper's first.
pub const VARIANTS: [Variant; 5] = [
    Variant::new(Method::GraspingAndRestricted, HardMode::Cached),
    Variant::new(Method::Restricted, HardMode::Cached),
    Variant::new(Method::All, HardMode::Cached),
    Variant::new(Method::All, HardMode::Literal),
    Variant::new(Method::NoAction, HardMode::Cached),
];

impl Variant {
    const fn new(method: Method, hard: HardMode) -> Self {
        Self { method, hard }
    }

    /// Its name in results.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match (self.method, self.hard) {
            (Method::All, HardMode::Literal) => "all-literal",
            (method, _) => method.word(),
        }
    }
}

/// A room of the experiment.
#[derive(Clone, Debug)]
pub struct Room {
    /// Its name.
    pub name: String,
    /// `paper` or `seeded`.
    pub set: &'static str,
    /// Free floor, m².
    pub area_m2: f64,
    /// The scene with all its robots.
    pub scene: Scene,
}

/// A room could not be made.
#[derive(Debug, thiserror::Error)]
pub enum RoomError {
    /// The generator gave up.
    #[error("the room of seed {seed} could not be generated: {source}")]
    Generate {
        /// Its seed.
        seed: u64,
        /// Why.
        source: GenerateError,
    },
    /// A shipped room is not what it should be.
    #[error("the room {name} could not be read")]
    Shipped {
        /// Its name.
        name: String,
    },
}

/// The rooms of a plan: the paper's six, then the seeded ones, their floors in turn; fewer if
/// somebody interrupts.
///
/// # Errors
/// A room cannot be made.
pub fn rooms(plan: &Plan, progress: &mut dyn Progress) -> Result<Vec<Room>, RoomError> {
    progress.begin((PAPER_ROOMS.len() + plan.rooms) as u64);
    let shipped = PAPER_ROOMS.iter().enumerate().map(|(index, name)| {
        let unread = || RoomError::Shipped {
            name: (*name).to_owned(),
        };
        let builtin = scene::builtin(name).ok_or_else(unread)?;
        Ok(Room {
            name: (*name).to_owned(),
            set: "paper",
            area_m2: FLOORS[index / 2].0,
            scene: scene::parse(builtin.text, name).map_err(|_| unread())?,
        })
    });
    let seeded = (0..plan.rooms).map(|index| seeded_room(plan.seed + index as u64, index));
    shipped
        .chain(seeded)
        .take_while(|_| {
            progress.step("making the rooms");
            !progress.is_interrupted()
        })
        .collect()
}

/// The seeded room of this seed, as options: the paper's floors in turn.
#[must_use]
pub fn seeded(seed: u64, index: usize) -> GenerateOptions {
    let (area_m2, walls) = FLOORS[index % FLOORS.len()];
    GenerateOptions {
        seed,
        objects: OBJECTS,
        robots: ROBOTS,
        area_m2,
        walls,
        ..GenerateOptions::default()
    }
}

fn seeded_room(seed: u64, index: usize) -> Result<Room, RoomError> {
    let options = seeded(seed, index);
    let area_m2 = options.area_m2;
    let generated = generate(&options).map_err(|source| RoomError::Generate { seed, source })?;
    Ok(Room {
        name: format!("seed-{seed}"),
        set: "seeded",
        area_m2,
        scene: generated.scene,
    })
}

/// Makes every run of the plan with `run`; rows of runs that failed say why.
pub fn measure(
    plan: &Plan,
    rooms: &[Room],
    results: &mut Results,
    progress: &mut dyn Progress,
    run: &mut dyn FnMut(&Scene, &Settings) -> Result<Measures, RunError>,
) {
    let mut table = run::table();
    let jobs = jobs(plan);
    progress.begin((jobs.len() * rooms.len()) as u64);
    'all: for room in rooms {
        for job in &jobs {
            if progress.is_interrupted() {
                results.partial = true;
                break 'all;
            }
            progress.step(&format!(
                "{}, {} robots, {}",
                room.name,
                job.robots,
                job.variant.word()
            ));
            let row = one(room, job, run);
            table.push(row.values());
        }
    }
    results.tables.push(table);
}

/// One run to make, whatever the room.
#[derive(Clone, Debug)]
struct Job {
    robots: usize,
    variant: Variant,
    units_per_second: u64,
    compute: Compute,
    repeat: usize,
}

fn jobs(plan: &Plan) -> Vec<Job> {
    let mut jobs = Vec::new();
    for repeat in 0..plan.repeats {
        for &compute in &plan.compute {
            for &units_per_second in &plan.units_per_second {
                for &robots in &plan.robots {
                    jobs.extend(VARIANTS.iter().map(|&variant| Job {
                        robots,
                        variant,
                        units_per_second,
                        compute,
                        repeat,
                    }));
                }
            }
        }
    }
    jobs
}

fn one<'a>(
    room: &'a Room,
    job: &'a Job,
    run: &mut dyn FnMut(&Scene, &Settings) -> Result<Measures, RunError>,
) -> Row<'a> {
    let settings = Settings {
        method: job.variant.method,
        hard: job.variant.hard,
        units_per_second: job.units_per_second,
        compute: job.compute,
        ..Settings::default()
    };
    let scene = room.scene.with_robots(job.robots);
    let measures = match &scene {
        Ok(scene) => run(scene, &settings),
        Err(problems) => Err(RunError(problems.to_string())),
    };
    Row {
        room: &room.name,
        set: room.set,
        area_m2: room.area_m2,
        robots: job.robots,
        method: job.variant.word(),
        units_per_second: job.units_per_second,
        compute: job.compute,
        repeat: job.repeat,
        measures,
    }
}

/// The runs' table of a result.
#[must_use]
pub fn runs(results: &Results) -> Option<&Table> {
    results.table(RUNS)
}

/// A number of the row under `name`.
fn number(table: &Table, row: &[Value], name: &str) -> Option<f64> {
    row[table.position(name)?].number()
}
