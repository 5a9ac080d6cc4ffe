//! Which rooms are solved, and how near the optimum: the default method beside the paper's four.
//!
//! Responsible for: which rooms are run with which methods, on how many threads, the rows.
//! Not responsible for: making a room (`rooms`), one run (`run`), what follows from the rows
//! (`summary`), drawing (`figures`).
//!
//! Terms: *R* is the yardstick of rule 32, exact for up to 12 objects; the *bound* holds for every
//! plan; the *best of the four* is the shortest makespan of the paper's four methods in the same
//! room.

pub mod cells;
pub mod figures;
pub mod optimum;
pub mod rooms;
pub mod run;
pub mod summary;

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use planner::{BoundLimits, Bounds, Yardstick};
use scene::{HardMode, Method, Scene, Settings, check_certificate};

use crate::progress::Progress;
use crate::results::{Results, Table, Value};
use rooms::{Room, Set};
use run::Run;

/// The methods, in the order in which they run: that which plans ahead, then the paper's four.
pub const METHODS: [Method; 5] = [
    Method::Anytime,
    Method::GraspingAndRestricted,
    Method::Restricted,
    Method::All,
    Method::NoAction,
];
/// Name of the table with a row for each room and method.
pub const RUNS: &str = "runs";
/// Name of the table with a row for each room.
pub const ROOMS: &str = "rooms";
/// How often it is looked whether somebody interrupts.
const LOOK: Duration = Duration::from_millis(100);

/// What is run.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Which sets of rooms.
    pub sets: Vec<Set>,
    /// Generated rooms, spread over densities, robots, objects and extra moves.
    pub rooms: usize,
    /// Seeded rooms of the paper's sizes, each with one to four robots.
    pub seeded: usize,
    /// Seed of the first room of either kind.
    pub seed: u64,
    /// World time after which a run counts as failed, s.
    pub max_time_s: f64,
    /// Wall time after which a run is given up, s.
    pub wall_cap_s: f64,
    /// The same where nobody knows whether there is a plan, s.
    pub unknown_cap_s: f64,
    /// Rooms of unit cells with a known optimum.
    pub unit_cells: usize,
    /// Large rooms of unit cells.
    pub halls: usize,
    /// Rooms that are run at the same time.
    pub threads: usize,
}

/// What is known of the best makespan of a room.
#[derive(Clone, Debug, PartialEq)]
pub struct Best {
    /// No plan is shorter, s.
    pub bound_s: f64,
    /// What is known of R.
    pub yardstick: Yardstick,
}

/// A room with all that was found out about it.
#[derive(Clone, Debug)]
pub struct Solved {
    /// The room.
    pub room: Room,
    /// Whether the certificate of its generator is one with the robots that take part.
    pub certified: bool,
    /// What its best makespan is; none where the bounds have their limits.
    pub best: Option<Best>,
    /// A run for each of [`METHODS`], or why there is no such room.
    pub runs: Result<Vec<Run>, String>,
}

impl Solved {
    /// Whether the room is known to have a solution: by its certificate, or because one was found.
    #[must_use]
    pub fn is_feasible(&self) -> bool {
        self.certified || self.runs.iter().flatten().any(Run::is_solved)
    }

    /// The run of the method that plans ahead, if there is such a room.
    #[must_use]
    pub fn anytime(&self) -> Option<&Run> {
        self.runs.as_ref().ok().and_then(|runs| runs.first())
    }

    /// The paper's method that was done first, and its makespan, s.
    #[must_use]
    pub fn best_of_four(&self) -> Option<(Method, f64)> {
        let runs = self.runs.as_ref().ok()?;
        let solved = METHODS.into_iter().zip(runs).skip(1);
        solved
            .filter(|(_, run)| run.is_solved())
            .map(|(method, run)| (method, run.makespan_s))
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Whether it is known to have a solution, in words.
    #[must_use]
    pub fn feasible_word(&self) -> &'static str {
        if self.is_feasible() {
            "yes"
        } else {
            "not known"
        }
    }

    /// R, s, where it is exact.
    #[must_use]
    pub fn r_s(&self) -> Option<f64> {
        self.best.as_ref()?.yardstick.exact_s()
    }

    /// Makespan of the method that plans ahead, s, where it has solved the room.
    #[must_use]
    pub fn makespan_s(&self) -> Option<f64> {
        self.anytime()
            .filter(|run| run.is_solved())
            .map(|run| run.makespan_s)
    }
}

/// Runs every room of the plan with every method. The rooms come back in the order of the plan,
/// whatever the number of threads; those that an interruption cut short do not.
pub fn measure(plan: &Plan, results: &mut Results, progress: &mut dyn Progress) -> Vec<Solved> {
    let rooms = rooms::all(plan);
    let name = |room: &Room| room.name.clone();
    let make = |room: &Room, stop: &AtomicBool| one(room, plan, stop);
    let (solved, is_partial) = spread(&rooms, plan.threads, progress, name, make);
    results.partial = is_partial;
    results
        .tables
        .extend([rooms_table(&solved), runs_table(&solved)]);
    solved
}

/// Does all jobs on so many threads; what came of them, in their order, without those that an
/// interruption cut short, and whether there were such.
fn spread<J: Sync, R: Send>(
    jobs: &[J],
    threads: usize,
    progress: &mut dyn Progress,
    name: impl Fn(&J) -> String,
    make: impl Fn(&J, &AtomicBool) -> R + Sync,
) -> (Vec<R>, bool) {
    progress.begin(jobs.len() as u64);
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let (sender, receiver) = mpsc::channel();
    let mut done: Vec<(usize, R)> = Vec::with_capacity(jobs.len());
    std::thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            let (sender, next, stop, make) = (sender.clone(), &next, &stop, &make);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(job) = jobs.get(index) else { break };
                    let made = make(job, stop);
                    // The receiver outlives this scope.
                    if stop.load(Ordering::Relaxed) || sender.send((index, made)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        loop {
            if progress.is_interrupted() {
                stop.store(true, Ordering::Relaxed);
            }
            match receiver.recv_timeout(LOOK) {
                Ok((index, made)) => {
                    progress.step(&name(&jobs[index]));
                    done.push((index, made));
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
    });
    done.sort_by_key(|(index, _)| *index);
    let is_partial = done.len() < jobs.len();
    (done.into_iter().map(|(_, made)| made).collect(), is_partial)
}

/// Makes a room and runs it with every method.
fn one(room: &Room, plan: &Plan, stop: &AtomicBool) -> Solved {
    let made = room.scene();
    let best = made.as_ref().ok().and_then(best);
    let certified = made
        .as_ref()
        .is_ok_and(|scene| check_certificate(scene, &scene.certificate).is_ok());
    let cap_s = if certified {
        plan.wall_cap_s
    } else {
        plan.wall_cap_s.min(plan.unknown_cap_s)
    };
    let runs = made.map(|scene| {
        METHODS
            .iter()
            .map(|&method| {
                let settings = Settings {
                    method,
                    hard: HardMode::Cached,
                    time_limit_ns: (plan.max_time_s * 1e9) as u64,
                    ..Settings::default()
                };
                let until = Instant::now() + Duration::from_secs_f64(cap_s);
                run::run(&scene, &settings, until, stop)
            })
            .collect()
    });
    Solved {
        room: room.clone(),
        certified,
        best,
        runs,
    }
}

fn best(scene: &Scene) -> Option<Best> {
    let bounds = Bounds::of(scene, BoundLimits::default())?;
    Some(Best {
        bound_s: bounds.best_s(),
        yardstick: bounds.yardstick,
    })
}

/// What is known of R: a word, and how much it is, s.
fn yardstick(best: Option<&Best>) -> (&'static str, Option<f64>) {
    match best.map(|best| &best.yardstick) {
        Some(Yardstick::Exact { makespan_s, .. }) => ("exact", Some(*makespan_s)),
        Some(Yardstick::AtLeast { makespan_s }) => ("at least", Some(*makespan_s)),
        Some(Yardstick::Impossible) => ("impossible", None),
        None => ("unknown", None),
    }
}

/// A row for each room.
fn rooms_table(solved: &[Solved]) -> Table {
    let mut table = rooms::keys(Table::new(ROOMS, "Rooms"))
        .info(
            "outcome",
            "",
            "how the default method's run ended, or why there is no such room",
        )
        .info("feasible", "", "whether it is known to have a solution")
        .lower("makespan_s", "s", "its makespan, where solved")
        .info("bound_s", "s", "no plan is shorter")
        .info(
            "yardstick",
            "",
            "whether R is known exactly, or only that it is at least so much",
        )
        .info("yardstick_s", "s", "R, or what it is at least")
        .lower("to_yardstick", "", "makespan by R, where exact")
        .lower("to_bound", "", "makespan by the bound")
        .info("best_of_four", "", "the paper's method that was done first")
        .info("best_of_four_s", "s", "its makespan")
        .lower("to_best_of_four", "", "makespan by that");
    for one in solved {
        let makespan_s = one.makespan_s();
        let by = |under: Option<f64>| Some(makespan_s? / under.filter(|under| *under > 0.0)?);
        let (known, yardstick_s) = yardstick(one.best.as_ref());
        let bound_s = one.best.as_ref().map(|best| best.bound_s);
        let four = one.best_of_four();
        let outcome = match &one.runs {
            Ok(_) => one.anytime().map(|run| run.outcome.to_owned()),
            Err(reason) => Some(reason.clone()),
        };
        let mut row = one.room.values();
        row.extend([
            outcome.into(),
            one.feasible_word().into(),
            makespan_s.into(),
            bound_s.into(),
            known.into(),
            yardstick_s.into(),
            by(one.r_s()).into(),
            by(bound_s).into(),
            four.map(|(method, _)| method.word()).into(),
            four.map(|(_, best_s)| best_s).into(),
            by(four.map(|(_, best_s)| best_s)).into(),
        ]);
        table.push(row);
    }
    table
}

/// A row for each room and method.
fn runs_table(solved: &[Solved]) -> Table {
    let table = Table::new(RUNS, "Runs")
        .key("set", "", "which rooms")
        .key("room", "", "name of the room")
        .key("robots", "", "number of robots")
        .key("method", "", "the method");
    let mut table = run::columns(table);
    for one in solved {
        for (method, run) in METHODS.iter().zip(one.runs.iter().flatten()) {
            let mut row: Vec<Value> = vec![
                one.room.set.word().into(),
                one.room.name.as_str().into(),
                one.room.robots.into(),
                method.word().into(),
            ];
            row.extend(run.values());
            table.push(row);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(threads: usize) -> Plan {
        Plan {
            sets: vec![Set::Generated],
            rooms: 3,
            seeded: 0,
            seed: 1,
            max_time_s: 400.0,
            wall_cap_s: 600.0,
            unknown_cap_s: 600.0,
            unit_cells: 0,
            halls: 0,
            threads,
        }
    }

    /// All that does not come from a clock on the wall.
    fn rows(threads: usize) -> (Vec<Vec<Value>>, Vec<Vec<Value>>) {
        let mut results = Results::new("solve", "");
        let solved = measure(&plan(threads), &mut results, &mut ());
        assert_eq!(solved.len(), 3);
        let table = |name: &str| {
            let table = results.table(name).unwrap();
            let kept = |name: &str| !name.contains("wall");
            let rows = table.rows.iter().map(|row| {
                let cells = table.columns.iter().zip(row);
                let cells = cells.filter(|(column, _)| kept(&column.name));
                cells.map(|(_, cell)| cell.clone()).collect()
            });
            rows.collect()
        };
        (table(ROOMS), table(RUNS))
    }

    #[test]
    fn the_rows_do_not_depend_on_the_number_of_threads() {
        let alone = rows(1);
        assert_eq!(alone.1.len(), 3 * METHODS.len());
        assert_eq!(rows(3), alone);
    }

    #[test]
    fn who_interrupts_gets_the_rooms_so_far() {
        struct Impatient(u32);
        impl Progress for Impatient {
            fn begin(&mut self, _steps: u64) {}
            fn step(&mut self, _what: &str) {
                self.0 += 1;
            }
            fn is_interrupted(&self) -> bool {
                self.0 > 0
            }
        }
        let mut results = Results::new("solve", "");
        let plan = Plan {
            rooms: 1_000,
            ..plan(1)
        };
        let solved = measure(&plan, &mut results, &mut Impatient(0));
        assert!(results.partial && !solved.is_empty() && solved.len() < 10);
        assert_eq!(results.table(ROOMS).unwrap().rows.len(), solved.len());
    }
}
