//! Many robots and many objects in one thread: how much world time a second of wall time holds.
//!
//! Responsible for: a hall of any size in which every robot finds work, one complete run of it,
//! and how many robots were engaged.
//! Not responsible for: rooms that are hard to solve, or real processes (`speed`, `latency`).
//!
//! Terms: a robot is *engaged* in a tick if it is not idle: it moves, computes, grips or waits for
//! somebody.

use std::time::Instant;

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::{Draft, Method, ObjectDraft, Problems, Scene, Settings, ShapeDraft};
use shm_types::{Activity, Outcome};
use sim::{SimReport, Simulation};

use crate::paper::run::word;
use crate::progress::Progress;
use crate::results::{Finding, Results, Table};

/// Between two starts, and between two goals, m: a loaded robot passes between a start and a goal.
const SPACING_M: f64 = 3.0;
/// From the outer rows to the walls, m: homes lie along them.
const MARGIN_M: f64 = 4.5;
/// Between two homes along a wall at least, m.
const HOMES_M: f64 = 1.5;
/// A goal lies so many rows and columns away from its start at most.
const REACH: i32 = 3;
/// World ticks a second that are claimed for the largest hall: the rate of its own clock.
pub const CLAIMED_HZ: f64 = 100.0;
/// Share of the robots that are claimed to be engaged.
const CLAIMED_SHARE: f64 = 0.9;

/// What is run.
#[derive(Clone, Debug)]
pub struct Options {
    /// Sizes: objects and robots of each hall.
    pub sizes: Vec<(usize, usize)>,
    /// Seed of the halls.
    pub seed: u64,
}

/// A hall in which `objects` stand in rows, each with a goal a few rows away, and `robots` along
/// the walls. All lengths are multiples of a quarter of a metre, so that the lattice is exact and
/// coarse.
///
/// # Errors
/// More objects or robots than a room may have, or more robots than its walls have homes for.
pub fn hall(objects: usize, robots: usize, seed: u64) -> Result<Scene, Problems> {
    let columns = (objects as f64).sqrt().ceil() as usize;
    let side = columns as f64 * SPACING_M + 2.0 * MARGIN_M - SPACING_M / 2.0;
    let mut draft = Draft::room(&format!("hall-{objects}"), [0.0, 0.0, side, side]);
    let at = |place: usize, aside: f64| {
        let (column, row) = (place % columns, place / columns);
        [column, row].map(|index| MARGIN_M + aside + index as f64 * SPACING_M)
    };
    let goals = goals(objects, columns, seed);
    draft.objects = (0..objects)
        .map(|object| ObjectDraft {
            shape: ShapeDraft::Box([0.5, 0.5]),
            grasp: [0.0, -0.5],
            ..ObjectDraft::paper(at(object, 0.0), Some(at(goals[object], SPACING_M / 2.0)))
        })
        .collect();
    let a_wall = robots.div_ceil(4);
    let step = ((side - 2.0 * MARGIN_M) / a_wall.max(1) as f64 * 4.0).floor() / 4.0;
    let step = step.max(HOMES_M);
    for robot in 0..robots {
        let along = MARGIN_M + (robot / 4) as f64 * step;
        draft.homes.push(match robot % 4 {
            0 => [along, 1.0],
            1 => [along, side - 1.0],
            2 => [1.0, along],
            _ => [side - 1.0, along],
        });
    }
    Scene::new(draft)
}

/// A random permutation of the places that takes none further than [`REACH`].
fn goals(objects: usize, columns: usize, seed: u64) -> Vec<usize> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let place = |index: usize| ((index % columns) as i32, (index / columns) as i32);
    let near = |object: usize, goal: usize| {
        let ((x, y), (u, v)) = (place(object), place(goal));
        (x - u).abs() <= REACH && (y - v).abs() <= REACH
    };
    let mut goals: Vec<usize> = (0..objects).collect();
    let mut order = goals.clone();
    order.shuffle(&mut rng);
    for object in order {
        let (x, y) = place(object);
        let by = || -REACH..=REACH;
        let (u, v) = (x + rng.random_range(by()), y + rng.random_range(by()));
        let inside = u >= 0 && v >= 0 && u < columns as i32;
        let other = v as usize * columns + u as usize;
        if inside && other < objects && near(object, goals[other]) && near(other, goals[object]) {
            goals.swap(object, other);
        }
    }
    goals
}

/// Runs every hall to its end.
///
/// # Errors
/// A hall of that size cannot be made.
pub fn run(
    options: &Options,
    command: &str,
    progress: &mut dyn Progress,
) -> Result<Results, Problems> {
    let mut results = Results::new("scale", command);
    let mut table = table();
    progress.begin(options.sizes.len() as u64);
    for &(objects, robots) in &options.sizes {
        if progress.is_interrupted() {
            results.partial = true;
            break;
        }
        progress.step(&format!("{objects} objects, {robots} robots"));
        let scene = hall(objects, robots, options.seed)?;
        let settings = Settings {
            method: Method::GraspingAndRestricted,
            ..Settings::default()
        };
        let made = Instant::now();
        let mut simulation = Simulation::new(&scene, &settings, 0);
        let set_up_s = made.elapsed().as_secs_f64();
        let started = Instant::now();
        while simulation.outcome() == Outcome::Running && !progress.is_interrupted() {
            simulation.tick();
        }
        let wall_s = started.elapsed().as_secs_f64();
        let report = simulation.report();
        results.partial |= report.outcome == Outcome::Running;
        results.findings.push(finding(&scene, &report, wall_s));
        let counters = report.counters();
        table.push(vec![
            objects.into(),
            robots.into(),
            0usize.into(),
            word(report.outcome).into(),
            report.ticks.into(),
            (report.time_ns as f64 / 1e9).into(),
            wall_s.into(),
            set_up_s.into(),
            (report.ticks as f64 / wall_s).into(),
            took_part(&report).into(),
            engaged(&report).into(),
            counters.selections.into(),
            counters.path_plans.into(),
        ]);
    }
    results.tables.push(table);
    Ok(results)
}

fn table() -> Table {
    Table::new("scale", "Halls")
        .key("objects", "", "objects, each with a goal")
        .key("robots", "", "robots")
        .repeat()
        .info("outcome", "", "how the run ended")
        .info("ticks", "", "ticks of 10 ms of world time")
        .lower("makespan_s", "s", "world time until the end")
        .lower("wall_s", "s", "wall time of the ticks, one thread")
        .info("set_up_s", "s", "wall time until the first tick")
        .higher("ticks_per_s", "1/s", "ticks in a second of wall time")
        .info("took_part", "", "robots that carried something somewhere")
        .higher(
            "engaged",
            "",
            "robots that were not idle, mean over the run",
        )
        .info("selections", "", "selections by all robots")
        .info("path_plans", "", "paths planned by all robots")
}

/// Robots that moved at all.
fn took_part(report: &SimReport) -> usize {
    let moved = |robot: &&sim::RobotReport| robot.times.ticks(Activity::Moving) > 0;
    report.robots.iter().filter(moved).count()
}

/// Robots that were not idle, mean over the ticks.
fn engaged(report: &SimReport) -> f64 {
    let busy = |robot: &sim::RobotReport| report.ticks - robot.times.ticks(Activity::Idle);
    let sum: u64 = report.robots.iter().map(busy).sum();
    sum as f64 / report.ticks.max(1) as f64
}

fn finding(scene: &Scene, report: &SimReport, wall_s: f64) -> Finding {
    let (objects, robots) = (scene.objects.len(), scene.homes.len());
    let rate = report.ticks as f64 / wall_s;
    let solved = report.outcome == Outcome::Solved;
    let least = CLAIMED_SHARE * robots as f64;
    Finding {
        claim: format!(
            "{objects} objects and {robots} robots, at least {least:.0} of them taking part, are \
             brought home at {CLAIMED_HZ} ticks a second or more in one thread"
        ),
        held: Some(solved && rate >= CLAIMED_HZ && took_part(report) as f64 >= least),
        evidence: format!(
            "{}, {rate:.0} ticks a second over {} ticks; {} took part, {:.1} engaged on average",
            word(report.outcome),
            report.ticks,
            took_part(report),
            engaged(report)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_are_a_permutation_within_reach() {
        let goals = goals(100, 10, 3);
        let mut sorted = goals.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..100).collect::<Vec<_>>());
        assert!(
            goals
                .iter()
                .enumerate()
                .any(|(object, goal)| object != *goal)
        );
        for (object, goal) in goals.iter().enumerate() {
            let apart = |a: usize, b: usize| a.abs_diff(b) <= REACH as usize;
            assert!(apart(object % 10, goal % 10) && apart(object / 10, goal / 10));
        }
    }

    #[test]
    fn a_small_hall_is_solved_and_everybody_takes_part() {
        let options = Options {
            sizes: vec![(36, 8)],
            seed: 1,
        };
        let results = run(&options, "", &mut ()).unwrap();
        let table = results.table("scale").unwrap();
        assert_eq!(table.rows[0][3].to_string(), "solved");
        let number = |name: &str| table.numbers(name, &[]).next().unwrap();
        assert_eq!(number("took_part"), 8.0);
        assert!(number("engaged") > 4.0 && number("engaged") <= 8.0);
        assert!(!results.partial);
    }

    #[test]
    fn the_largest_hall_is_a_room() {
        let scene = hall(1_000, 100, 1).unwrap();
        assert!(scene.lattice.exact && scene.lattice.len() < 200_000);
    }
}
