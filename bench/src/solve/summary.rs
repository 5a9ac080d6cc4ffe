//! What follows from the runs: shares, ratios, and every exception by name.
//!
//! Responsible for: who solved how many of which rooms, the rooms that the default method missed,
//! how near R it comes, in which rooms one of the paper's four was faster, and whether the targets
//! are reached.
//! Not responsible for: the runs (`solve`). A target that is missed is reported so.
//!
//! Terms: a *miss* is a room that a run did not solve, also where none is known to exist (table
//! `rooms`). A ratio to R is taken where the room was solved and R is exact; the rooms left out are
//! counted beside it.

use scene::Settings;

use super::rooms::Set;
use super::{METHODS, Solved, yardstick};
use crate::results::{Finding, Table, Value};
use crate::stats::{Estimate, mean_interval};

/// Name of the table of shares.
pub const SHARES: &str = "shares";
/// Name of the table of ratios.
pub const RATIOS: &str = "ratios";
/// Name of the table of rooms that were not solved.
pub const MISSES: &str = "misses";
/// Name of the table of rooms in which another method was faster.
pub const SLOWER: &str = "slower";

/// Share of all generated rooms that is to be solved.
const TARGET_SHARE: f64 = 0.99;
/// Mean ratio to R that is to be reached with 1, 2, 3 and 4 robots.
pub const TARGET_RATIOS: [f64; 4] = [1.05, 1.15, 1.25, 1.35];
/// Share of rooms in which none of the paper's four is to be faster.
const TARGET_BEST: f64 = 0.99;
/// By how much it may be faster in the others.
const TARGET_EXCESS: f64 = 1.05;

/// Rooms over which ratios are averaged: a name, and what belongs to it.
pub const GROUPS: [(&str, &[Set]); 2] = [
    ("paper and seeded", &[Set::Paper, Set::Seeded]),
    ("generated", &[Set::Generated]),
];

/// Tables and findings of these rooms.
#[must_use]
pub fn of(solved: &[Solved]) -> (Vec<Table>, Vec<Finding>) {
    let mut findings = vec![solved_share(solved)];
    findings.extend((1..=TARGET_RATIOS.len()).map(|robots| ratio(solved, robots)));
    findings.extend([not_slower(solved), worst(solved), still(solved)]);
    let tables = vec![
        shares(solved),
        ratios(solved),
        misses(solved),
        slower(solved),
    ];
    (tables, findings)
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

/// A share in words.
fn share(part: usize, whole: usize) -> String {
    format!(
        "{part} of {whole} ({:.1} %)",
        100.0 * part as f64 / whole.max(1) as f64
    )
}

fn solved_share(solved: &[Solved]) -> Finding {
    let rooms: Vec<_> = there(solved, Set::Generated).collect();
    let count = |method: usize| {
        let runs = rooms.iter().filter_map(|one| one.runs.as_ref().ok());
        runs.filter(|runs| runs[method].is_solved()).count()
    };
    let others = (1..METHODS.len())
        .map(|method| format!("{} {}", METHODS[method], share(count(method), rooms.len())));
    let evidence = format!(
        "{}; {}",
        share(count(0), rooms.len()),
        others.collect::<Vec<_>>().join(", ")
    );
    let reached = count(0) as f64 >= TARGET_SHARE * rooms.len() as f64;
    Finding {
        claim: format!(
            "at least {} % of the generated rooms are solved",
            TARGET_SHARE * 100.0
        ),
        held: (!rooms.is_empty()).then_some(reached),
        evidence,
    }
}

fn ratio(solved: &[Solved], robots: usize) -> Finding {
    let target = TARGET_RATIOS[robots - 1];
    let ratios = Ratios::of(solved, GROUPS[0].1, robots);
    let mean = mean_interval(&ratios.to_r);
    let evidence = mean.map_or_else(
        || "no such room".to_owned(),
        |mean| {
            format!(
                "{:.3} [{:.3}, {:.3}] over {} rooms; {} missed, {} not known to have a solution, {} without an exact R",
                mean.value,
                mean.low,
                mean.high,
                ratios.to_r.len(),
                ratios.missed,
                ratios.unknown,
                ratios.inexact
            )
        },
    );
    let plural = if robots == 1 { "" } else { "s" };
    Finding {
        claim: format!(
            "paper's and seeded rooms, {robots} robot{plural}: mean makespan at most {target} times R"
        ),
        held: mean.map(|mean| mean.value <= target),
        evidence,
    }
}

fn not_slower(solved: &[Solved]) -> Finding {
    let all: Vec<_> = solved.iter().filter_map(excess).collect();
    let slower = all.iter().filter(|excess| **excess > 1.0).count();
    let kept = all.len() - slower;
    let nearly = solved.iter().filter(|one| is_slower_by_a_tick(one)).count();
    Finding {
        claim: format!(
            "in at least {} % of the rooms that one of the paper's four solves, none is faster",
            TARGET_BEST * 100.0
        ),
        held: (!all.is_empty()).then_some(kept as f64 >= TARGET_BEST * all.len() as f64),
        evidence: format!(
            "{}; the others are in {SLOWER}.csv, {nearly} of them by a single tick",
            share(kept, all.len())
        ),
    }
}

fn worst(solved: &[Solved]) -> Finding {
    let all: Vec<_> = solved.iter().filter_map(excess).collect();
    let worst = all.iter().copied().reduce(f64::max);
    let missed = all.iter().filter(|excess| excess.is_infinite()).count();
    let finite = all
        .iter()
        .copied()
        .filter(|excess| excess.is_finite())
        .reduce(f64::max);
    Finding {
        claim: format!(
            "and never by more than {:.0} %",
            (TARGET_EXCESS - 1.0) * 100.0
        ),
        held: worst.map(|worst| worst <= TARGET_EXCESS),
        evidence: format!(
            "worst {:.3} times the best of the four; {missed} rooms that one of them solves were missed",
            finite.unwrap_or(f64::NAN)
        ),
    }
}

fn still(solved: &[Solved]) -> Finding {
    let runs: Vec<_> = there(solved, Set::Paper)
        .filter_map(Solved::anytime)
        .collect();
    let ticks: u64 = runs.iter().map(|run| run.computing_after_ticks).sum();
    let first_s: Vec<_> = runs.iter().filter_map(|run| run.first_motion_s).collect();
    let first = first_s.iter().copied().reduce(f64::max);
    Finding {
        claim: "paper's rooms: no robot computes after the first motion".into(),
        held: (!runs.is_empty()).then_some(ticks == 0),
        evidence: format!(
            "{ticks} ticks over {} runs; the first motion after at most {:.2} s",
            runs.len(),
            first.unwrap_or(f64::NAN)
        ),
    }
}

#[cfg(test)]
mod tests {
    use planner::Yardstick;

    use super::super::Best;
    use super::super::rooms::Room;
    use super::super::run::Run;
    use super::*;
    use crate::paper::run::word;

    /// A room with two robots: makespans of the default method and of the best of the four where
    /// they solved it, and R.
    fn room(set: Set, default_s: Option<f64>, best_s: Option<f64>, r_s: Option<f64>) -> Solved {
        let run = |makespan_s: Option<f64>| Run {
            outcome: makespan_s.map_or("timeout", |_| word(shm_types::Outcome::Solved)),
            reason: None,
            makespan_s: makespan_s.unwrap_or(400.0),
            first_motion_tick: Some(1),
            first_motion_s: Some(0.5),
            computing_after_ticks: 0,
            planning_before_wall_s: 0.0,
            planning_wall_s: 0.0,
            run_wall_s: 0.0,
        };
        let room = Room {
            set,
            name: "made up".into(),
            density: None,
            options: None,
            robots: 2,
        };
        let four = [None, best_s, best_s.map(|best_s| best_s + 9.0), None];
        let best = r_s.map(|r_s| Best {
            bound_s: r_s / 2.0,
            yardstick: Yardstick::Exact {
                makespan_s: r_s,
                routes: Vec::new(),
            },
        });
        Solved {
            room,
            certified: false,
            best,
            runs: Ok([default_s].into_iter().chain(four).map(run).collect()),
        }
    }

    fn column(table: &Table, name: &str) -> Vec<String> {
        let index = table.position(name).unwrap();
        table
            .rows
            .iter()
            .map(|row| row[index].to_string())
            .collect()
    }

    fn finding<'a>(findings: &'a [Finding], claim: &str) -> &'a Finding {
        let its = |finding: &&Finding| finding.claim.contains(claim);
        findings.iter().find(its).unwrap()
    }

    #[test]
    fn ratios_are_over_the_rooms_that_are_solved_and_the_others_are_counted() {
        let paper = |default_s, best_s, r_s| room(Set::Paper, default_s, best_s, r_s);
        let rooms = [
            paper(Some(11.0), Some(20.0), Some(10.0)),
            paper(Some(12.0), Some(20.0), Some(10.0)),
            paper(Some(12.0), Some(20.0), None),
            paper(None, Some(20.0), Some(10.0)),
            paper(None, None, None),
            paper(None, None, None),
        ];
        let (tables, findings) = of(&rooms);
        let table = tables.iter().find(|table| table.name == RATIOS).unwrap();
        for (name, number) in [
            ("count", "6"),
            ("missed", "1"),
            ("unknown", "2"),
            ("r_inexact", "1"),
            ("to_r", "1.15"),
            ("reached", "yes"),
        ] {
            assert_eq!(column(table, name), [number], "{name}");
        }
        let found = finding(&findings, "2 robots: mean makespan");
        assert_eq!(found.held, Some(true), "{}", found.evidence);
        let mean = mean_ratio(&rooms, &[Set::Paper], 2).unwrap();
        assert!((mean.value - 1.15).abs() < 1e-12);
        assert!(mean_ratio(&rooms, &[Set::Paper], 3).is_none());
    }

    #[test]
    fn the_figure_of_ratios_names_its_groups_and_the_target() {
        let rooms = [Set::Paper, Set::Generated]
            .map(|set| [11.0, 12.0].map(|default_s| room(set, Some(default_s), None, Some(10.0))));
        let figures = super::super::figures::all(rooms.as_flattened(), &[]).unwrap();
        let legend = figures[0].legend.iter().map(|(_, name)| name.as_str());
        let groups = ["paper and seeded rooms", "generated rooms"];
        assert!(
            legend.eq(groups
                .into_iter()
                .chain(["target in the paper's and seeded rooms"]))
        );
    }

    #[test]
    fn rooms_in_which_another_method_was_faster_are_named_the_worst_first() {
        let rooms = [
            (10.0, 20.0),
            (10.0, 10.0),
            (30.0, 20.0),
            (40.0, 20.0),
            (20.01, 20.0),
        ]
        .map(|(own, best)| room(Set::Generated, Some(own), Some(best), None));
        let (tables, findings) = of(&rooms);
        let table = tables.iter().find(|table| table.name == SLOWER).unwrap();
        let excess = column(table, "excess");
        assert_eq!(
            (&excess[..2], excess.len()),
            (&["2", "1.5"].map(String::from)[..], 3)
        );
        let found = finding(&findings, "none is faster");
        assert_eq!(found.held, Some(false));
        assert!(found.evidence.starts_with("2 of 5"), "{}", found.evidence);
        assert!(found.evidence.contains("1 of them by a single tick"));
        assert_eq!(finding(&findings, "never by more than").held, Some(false));
        assert_eq!(finding(&findings, "are solved").held, Some(true));
    }

    #[test]
    fn a_robot_that_computes_after_the_first_motion_is_found() {
        let held = |ticks| {
            let mut rooms = [(); 2].map(|()| room(Set::Paper, Some(9.0), None, None));
            for run in rooms[1].runs.iter_mut().flatten() {
                run.computing_after_ticks = ticks;
            }
            finding(&of(&rooms).1, "no robot computes").held
        };
        assert_eq!((held(0), held(3)), (Some(true), Some(false)));
    }
}
