//! What follows from the runs: shares, ratios, and every exception by name.
//!
//! Responsible for: who solved how many of which rooms, the rooms that the default method missed,
//! how near R it comes, in which rooms one of the paper's four was faster.
//! Not responsible for: the runs (`solve`), whether the targets are reached (`targets`).
//!
//! Terms: a *miss* is a room that a run did not solve, also where none is known to exist (table
//! `rooms`). A ratio to R is taken where the room was solved and R is exact; the rooms left out are
//! counted beside it.

mod targets;
#[cfg(test)]
mod tests;

use scene::Settings;

use super::rooms::Set;
use super::{METHODS, Solved, yardstick};
use crate::results::{Finding, Table, Value};
use crate::stats::{Estimate, mean_interval};

pub use targets::TARGET_RATIOS;

/// Name of the table of shares.
pub const SHARES: &str = "shares";
/// Name of the table of ratios.
pub const RATIOS: &str = "ratios";
/// Name of the table of rooms that were not solved.
pub const MISSES: &str = "misses";
/// Name of the table of rooms in which another method was faster.
pub const SLOWER: &str = "slower";

/// Rooms over which ratios are averaged: a name, and what belongs to it.
pub const GROUPS: [(&str, &[Set]); 2] = [
    ("paper and seeded", &[Set::Paper, Set::Seeded]),
    ("generated", &[Set::Generated]),
];

/// Tables and findings of these rooms.
#[must_use]
pub fn of(solved: &[Solved]) -> (Vec<Table>, Vec<Finding>) {
    let tables = vec![
        shares(solved),
        ratios(solved),
        misses(solved),
        slower(solved),
    ];
    (tables, targets::findings(solved))
}

/// The rooms of one set that exist.
fn there(solved: &[Solved], set: Set) -> impl Iterator<Item = &Solved> {
    solved
        .iter()
        .filter(move |one| one.room.set == set && one.runs.is_ok())
}

/// What shares are told by.
type Facet = (&'static str, fn(&Solved) -> Value);

const FACETS: [Facet; 5] = [
    ("all", |_| "".into()),
    ("density", |one| one.room.density.into()),
    ("robots", |one| one.room.robots.into()),
    ("objects", |one| options(one, |options| options.objects)),
    ("extra moves", |one| {
        options(one, |options| options.extra_moves)
    }),
];

fn options(one: &Solved, number: fn(&scene::GenerateOptions) -> usize) -> Value {
    one.room.options.as_ref().map(number).into()
}

/// How many rooms each method solved, over all and by every facet.
fn shares(solved: &[Solved]) -> Table {
    let mut table = Table::new(SHARES, "Rooms solved")
        .key("set", "", "which rooms")
        .key("by", "", "what the rooms have in common")
        .key("value", "", "and what it is")
        .info("rooms", "", "rooms of this kind")
        .info(
            "not_generated",
            "",
            "rooms beside them that the generator gave up on",
        );
    for method in METHODS {
        table = table.higher(method.word(), "", "share of the rooms that it solved");
    }
    for set in Set::ALL {
        let told = |facet: &&Facet| set == Set::Generated || ["all", "robots"].contains(&facet.0);
        for (by, value) in FACETS.iter().filter(told) {
            let of_set = || solved.iter().filter(move |one| one.room.set == set);
            let mut values: Vec<Value> = of_set().map(value).collect();
            values.sort_by(|a, b| match (a.number(), b.number()) {
                (Some(a), Some(b)) => a.total_cmp(&b),
                _ => a.to_string().cmp(&b.to_string()),
            });
            values.dedup();
            for one_value in values {
                let rooms: Vec<_> = of_set().filter(|one| value(one) == one_value).collect();
                let made: Vec<_> = rooms
                    .iter()
                    .filter_map(|one| one.runs.as_ref().ok())
                    .collect();
                let mut row = vec![
                    set.word().into(),
                    (*by).into(),
                    one_value,
                    made.len().into(),
                    (rooms.len() - made.len()).into(),
                ];
                row.extend((0..METHODS.len()).map(|method| {
                    let count = made.iter().filter(|runs| runs[method].is_solved()).count();
                    Value::from(count as f64 / made.len() as f64)
                }));
                table.push(row);
            }
        }
    }
    table
}

/// Every room that the default method did not solve.
fn misses(solved: &[Solved]) -> Table {
    let table = Table::new(MISSES, "Rooms that the default method did not solve");
    let mut table = super::rooms::keys(table)
        .info(
            "feasible",
            "",
            "whether the room is known to have a solution",
        )
        .info("outcome", "", "how its run ended")
        .info("makespan_s", "s", "world time at its end")
        .info("planning_wall_s", "s", "wall time of planning")
        .info("solved_by", "", "which of the paper's methods solved it")
        .info("reason", "", "why, as the run says");
    for one in solved {
        let Some(run) = one.anytime().filter(|run| !run.is_solved()) else {
            continue;
        };
        let runs = one.runs.iter().flatten();
        let others = METHODS.iter().zip(runs).filter(|(_, run)| run.is_solved());
        let others: Vec<_> = others.map(|(method, _)| method.word()).collect();
        let mut row = one.room.values();
        row.extend([
            one.feasible_word().into(),
            run.outcome.into(),
            run.makespan_s.into(),
            run.planning_wall_s.into(),
            others.join(" ").into(),
            run.reason.clone().into(),
        ]);
        table.push(row);
    }
    table
}

/// Ratios to R and to the bound in the rooms of `sets` with so many robots.
struct Ratios {
    to_r: Vec<f64>,
    to_bound: Vec<f64>,
    /// Rooms, those not solved though they have a solution, those not solved that are not known to
    /// have one, and those solved whose R is not known exactly.
    rooms: usize,
    missed: usize,
    unknown: usize,
    inexact: usize,
}

impl Ratios {
    fn of(solved: &[Solved], sets: &[Set], robots: usize) -> Self {
        let mut ratios = Self {
            to_r: Vec::new(),
            to_bound: Vec::new(),
            rooms: 0,
            missed: 0,
            unknown: 0,
            inexact: 0,
        };
        let rooms = sets.iter().flat_map(|set| there(solved, *set));
        for one in rooms.filter(|one| one.room.robots == robots) {
            ratios.rooms += 1;
            let Some(makespan_s) = one.makespan_s() else {
                if one.is_feasible() {
                    ratios.missed += 1;
                } else {
                    ratios.unknown += 1;
                }
                continue;
            };
            match one.r_s() {
                Some(r_s) => ratios.to_r.push(makespan_s / r_s),
                None => ratios.inexact += 1,
            }
            let best = one.best.as_ref().filter(|best| best.bound_s > 0.0);
            ratios
                .to_bound
                .extend(best.map(|best| makespan_s / best.bound_s));
        }
        ratios
    }
}

/// The mean ratio to R of a group of rooms with so many robots, with its interval.
#[must_use]
pub fn mean_ratio(solved: &[Solved], sets: &[Set], robots: usize) -> Option<Estimate> {
    mean_interval(&Ratios::of(solved, sets, robots).to_r)
}

fn ratios(solved: &[Solved]) -> Table {
    let mut table = Table::new(
        RATIOS,
        "Makespans of the default method against R and the bound",
    )
    .key(
        "rooms",
        "",
        "which rooms; the target is for the paper's and seeded ones",
    )
    .key("robots", "", "number of robots")
    .info("count", "", "rooms")
    .info(
        "missed",
        "",
        "of these, not solved though they have a solution",
    )
    .info(
        "unknown",
        "",
        "of these, not solved and not known to have a solution",
    )
    .info(
        "r_inexact",
        "",
        "of these, solved, but R is only bounded or there is none",
    )
    .lower("to_r", "", "mean makespan by R over the others")
    .info("to_r_low", "", "lower end of its 95 % interval")
    .info("to_r_high", "", "upper end")
    .info("target", "", "what the mean is to be at most")
    .info("reached", "", "whether it is")
    .lower(
        "to_bound",
        "",
        "mean makespan by the bound, over all that are solved",
    );
    for (name, sets) in GROUPS {
        for (robots, target) in (1..).zip(TARGET_RATIOS) {
            let ratios = Ratios::of(solved, sets, robots);
            if ratios.rooms == 0 {
                continue;
            }
            let mean = mean_interval(&ratios.to_r);
            let aimed = sets.contains(&Set::Paper);
            table.push(vec![
                name.into(),
                robots.into(),
                ratios.rooms.into(),
                ratios.missed.into(),
                ratios.unknown.into(),
                ratios.inexact.into(),
                mean.map(|mean| mean.value).into(),
                mean.map(|mean| mean.low).into(),
                mean.map(|mean| mean.high).into(),
                aimed.then_some(target).into(),
                mean.filter(|_| aimed)
                    .map(|mean| yes(mean.value <= target))
                    .into(),
                mean_interval(&ratios.to_bound)
                    .map(|mean| mean.value)
                    .into(),
            ]);
        }
    }
    table
}

const fn yes(reached: bool) -> &'static str {
    if reached { "yes" } else { "no" }
}

/// How much longer than the best of the four, where that solved the room: infinite where the
/// default method did not.
fn excess(one: &Solved) -> Option<f64> {
    let (_, best_s) = one.best_of_four()?;
    Some(
        one.makespan_s()
            .map_or(f64::INFINITY, |makespan_s| makespan_s / best_s),
    )
}

/// Whether one of the four was done a tick before the default method: its robots ask for their ways
/// in the first tick, those of the default method once a schedule is in force.
fn is_slower_by_a_tick(one: &Solved) -> bool {
    let tick_s = Settings::default().tick_ns as f64 * 1e-9;
    let best = one.best_of_four().zip(one.makespan_s());
    best.is_some_and(|((_, best_s), makespan_s)| {
        (0.5 * tick_s..1.5 * tick_s).contains(&(makespan_s - best_s))
    })
}

/// Every room in which one of the four was done before the default method.
fn slower(solved: &[Solved]) -> Table {
    let table = Table::new(SLOWER, "Rooms in which one of the paper's four was faster");
    let mut table = super::rooms::keys(table)
        .info(
            "makespan_s",
            "s",
            "of the default method, where it solved the room",
        )
        .info("best_of_four", "", "the method that was done first")
        .info("best_of_four_s", "s", "its makespan")
        .info("excess", "", "the default method's makespan by that")
        .info("yardstick_s", "s", "R, or what it is at least");
    let mut rows: Vec<_> = solved
        .iter()
        .filter_map(|one| Some((excess(one).filter(|excess| *excess > 1.0)?, one)))
        .collect();
    rows.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (excess, one) in rows {
        let four = one.best_of_four();
        let mut row = one.room.values();
        row.extend([
            one.makespan_s().into(),
            four.map(|(method, _)| method.word()).into(),
            four.map(|(_, best_s)| best_s).into(),
            excess.into(),
            yardstick(one.best.as_ref()).1.into(),
        ]);
        table.push(row);
    }
    table
}
