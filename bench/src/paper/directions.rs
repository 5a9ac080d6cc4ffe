//! The paper's directions, each with what the runs say of it.
//!
//! Responsible for: comparing methods on the rooms that both solve, at every modelled speed, and
//! where each direction turns.
//! Not responsible for: the runs. A direction that does not hold is reported so.
//!
//! Terms: a *pair* is two runs that differ in the method alone and are both solved; a ratio is
//! the mean of the first method's times over that of the second's, with a 95 % bootstrap
//! interval over the pairs. A direction holds where the whole interval lies on its side, does
//! not where it lies on the other, and is undecided in between or without a pair.
//!
//! Source: rule 25; paper §V, Figs. 6 and 7.

use std::collections::BTreeMap;

use crate::results::{Finding, Table, Value};
use crate::stats::{Estimate, mean, ratio_of_means_interval};

/// Times this close are similar: within a tenth.
const SIMILAR: f64 = 1.1;

/// Name of the table with a row for each comparison.
pub const DIRECTIONS_TABLE: &str = "directions";

const PAPERS: &str = "grasping-and-restricted";

/// What identifies a run but for its method.
type Situation = Vec<String>;

/// One solved or unsolved run, as far as the directions ask.
#[derive(Clone, Copy, Debug)]
struct Run {
    solved: bool,
    execution_s: f64,
    planning_s: f64,
    total_s: f64,
    robots: f64,
}

/// Runs of one set of rooms at one modelled speed: by method, then by situation.
type Runs = BTreeMap<String, BTreeMap<Situation, Run>>;

/// A direction: words, and what decides it.
struct Direction {
    claim: &'static str,
    judge: fn(&Runs) -> Vec<Verdict>,
}

/// One comparison.
struct Verdict {
    comparison: String,
    numbers: String,
    /// Whether there was anything to compare.
    measured: bool,
    held: Option<bool>,
}

/// Rooms, computer and modelled speed of a group of runs.
#[derive(Clone, Debug, PartialEq, Eq)]
struct World {
    set: String,
    compute: String,
    units_per_second: String,
}

const DIRECTIONS: [Direction; 7] = [
    Direction {
        claim: "execution is similar for the paper's method, all and restricted",
        judge: |runs| {
            ["all", "restricted"]
                .map(|other| similar(runs, other, "execution", |run| run.execution_s))
                .into()
        },
    },
    Direction {
        claim: "planning is least for the paper's method",
        judge: |runs| {
            ["all", "all-literal", "restricted", "no-action"]
                .map(|other| less(runs, PAPERS, other, "planning", |run| run.planning_s))
                .into()
        },
    },
    Direction {
        claim: "the whole is finished soonest with the paper's method",
        judge: |runs| {
            ["all", "all-literal", "restricted", "no-action"]
                .map(|other| less(runs, PAPERS, other, "makespan", |run| run.total_s))
                .into()
        },
    },
    Direction {
        claim: "all takes longer than restricted",
        judge: |runs| {
            ["all", "all-literal"]
                .map(|one| less(runs, "restricted", one, "makespan", |run| run.total_s))
                .into()
        },
    },
    Direction {
        claim: "no-action is worst, and often does not finish",
        judge: |runs| {
            let mut verdicts = vec![solves_least(runs)];
            for better in [PAPERS, "all", "restricted"] {
                verdicts.push(less(runs, better, "no-action", "makespan", |run| {
                    run.total_s
                }));
            }
            verdicts
        },
    },
    Direction {
        claim: "planning grows with the number of robots",
        judge: |runs| {
            [PAPERS, "restricted", "all", "all-literal"]
                .map(|method| grows(runs, method))
                .into()
        },
    },
    Direction {
        claim: "the gap in planning between all and the paper's method grows with the number of robots",
        judge: |runs| {
            ["all", "all-literal"]
                .map(|other| gap_grows(runs, other))
                .into()
        },
    },
];

/// What the runs say of every direction: one finding for each set of rooms, and a row for each
/// comparison behind it. A finding holds if it does at every modelled speed; its evidence says
/// where it turns.
#[must_use]
pub fn judge(table: &Table) -> (Vec<Finding>, Table) {
    let worlds = worlds(table);
    let mut rows = comparisons();
    let mut findings: Vec<Finding> = Vec::new();
    for direction in &DIRECTIONS {
        for (world, runs) in &worlds {
            let verdicts = (direction.judge)(runs);
            let held = verdicts
                .iter()
                .filter(|verdict| verdict.measured)
                .map(|verdict| verdict.held)
                .reduce(both)
                .flatten();
            for verdict in verdicts {
                rows.push(vec![
                    direction.claim.into(),
                    world.set.as_str().into(),
                    world.compute.as_str().into(),
                    world.units_per_second.as_str().into(),
                    verdict.comparison.into(),
                    word(verdict.held).into(),
                    verdict.numbers.into(),
                ]);
            }
            let claim = format!("{} rooms: {}", world.set, direction.claim);
            let place = format!("{}, {} units/s", world.compute, world.units_per_second);
            let place = format!("{place}: {}", word(held));
            match findings.iter_mut().find(|finding| finding.claim == claim) {
                Some(finding) => {
                    finding.held = both(finding.held, held);
                    finding.evidence += &format!("; {place}");
                }
                None => findings.push(Finding {
                    claim,
                    held,
                    evidence: place,
                }),
            }
        }
    }
    (findings, rows)
}

/// Both hold, or one does not, or nobody knows.
const fn both(one: Option<bool>, other: Option<bool>) -> Option<bool> {
    match (one, other) {
        (Some(false), _) | (_, Some(false)) => Some(false),
        (Some(true), Some(true)) => Some(true),
        _ => None,
    }
}

const fn word(held: Option<bool>) -> &'static str {
    match held {
        Some(true) => "held",
        Some(false) => "did not hold",
        None => "undecided",
    }
}

fn comparisons() -> Table {
    Table::new(
        DIRECTIONS_TABLE,
        "The paper's directions, comparison by comparison",
    )
    .key("direction", "", "what the paper says")
    .key("set", "", "the paper's six rooms, or seeded ones")
    .key(
        "compute",
        "",
        "one computer each (own), or one for all (shared)",
    )
    .key("units_per_second", "1/s", "modelled speed of a computer")
    .key("comparison", "", "what is compared")
    .info("held", "", "whether the numbers bear it out")
    .info(
        "numbers",
        "",
        "ratio with its 95 % interval over the pairs, or values by robots",
    )
}

/// The runs by set of rooms, computer and modelled speed.
fn worlds(table: &Table) -> Vec<(World, Runs)> {
    let mut worlds: Vec<(World, Runs)> = Vec::new();
    for row in &table.rows {
        let text = |name: &str| cell(table, row, name).to_string();
        let world = World {
            set: text("set"),
            compute: text("compute"),
            units_per_second: text("units_per_second"),
        };
        let Some(run) = run(table, row) else { continue };
        let place = worlds.iter().position(|(other, _)| *other == world);
        let place = place.unwrap_or_else(|| {
            worlds.push((world, Runs::new()));
            worlds.len() - 1
        });
        let situation = vec![text("room"), text("robots"), text("repeat")];
        let method = worlds[place].1.entry(text("method")).or_default();
        method.insert(situation, run);
    }
    worlds
}

fn cell<'a>(table: &'a Table, row: &'a [Value], name: &str) -> &'a Value {
    table
        .position(name)
        .map_or(&Value::Missing(()), |index| &row[index])
}

fn run(table: &Table, row: &[Value]) -> Option<Run> {
    let number = |name: &str| cell(table, row, name).number();
    Some(Run {
        solved: number("solved")? > 0.5,
        execution_s: number("moving_s")? + number("gripping_s")?,
        planning_s: number("computing_s")?,
        total_s: number("makespan_s")?,
        robots: number("robots")?,
    })
}

/// The numbers of two methods over all pairs.
fn pairs(runs: &Runs, one: &str, other: &str, of: fn(&Run) -> f64) -> Vec<(f64, f64)> {
    let (Some(ones), Some(others)) = (runs.get(one), runs.get(other)) else {
        return Vec::new();
    };
    ones.iter()
        .filter_map(|(situation, first)| Some((first, others.get(situation)?)))
        .filter(|(first, second)| first.solved && second.solved)
        .map(|(first, second)| (of(first), of(second)))
        .collect()
}

fn ratio(runs: &Runs, one: &str, other: &str, of: fn(&Run) -> f64) -> Option<(Estimate, usize)> {
    let pairs = pairs(runs, one, other, of);
    Some((ratio_of_means_interval(&pairs)?, pairs.len()))
}

fn compared(
    what: &str,
    (one, other): (&str, &str),
    found: Option<(Estimate, usize)>,
    judge: impl Fn(Estimate) -> Option<bool>,
) -> Verdict {
    Verdict {
        comparison: format!("{what}: {one} / {other}"),
        numbers: found.map_or_else(
            || "no pair to compare".to_owned(),
            |(ratio, pairs)| {
                let Estimate { value, low, high } = ratio;
                format!("{value:.3} [{low:.3}, {high:.3}] over {pairs} pairs")
            },
        ),
        measured: found.is_some(),
        held: found.and_then(|(ratio, _)| judge(ratio)),
    }
}

fn less(runs: &Runs, one: &str, other: &str, what: &str, of: fn(&Run) -> f64) -> Verdict {
    let found = ratio(runs, one, other, of);
    compared(what, (one, other), found, |ratio| {
        decided(ratio.high < 1.0, ratio.low > 1.0)
    })
}

fn similar(runs: &Runs, other: &str, what: &str, of: fn(&Run) -> f64) -> Verdict {
    let found = ratio(runs, PAPERS, other, of);
    compared(what, (PAPERS, other), found, |ratio| {
        let within = ratio.low > 1.0 / SIMILAR && ratio.high < SIMILAR;
        decided(within, ratio.low > SIMILAR || ratio.high < 1.0 / SIMILAR)
    })
}

/// What an interval decides: nothing while it lies on both sides.
const fn decided(held: bool, turned: bool) -> Option<bool> {
    match (held, turned) {
        (true, _) => Some(true),
        (_, true) => Some(false),
        _ => None,
    }
}

fn solves_least(runs: &Runs) -> Verdict {
    let shares: Vec<(&str, f64)> = runs
        .iter()
        .filter_map(|(method, runs)| {
            let solved: Vec<_> = runs
                .values()
                .map(|run| f64::from(u8::from(run.solved)))
                .collect();
            Some((method.as_str(), mean(&solved)?))
        })
        .collect();
    let of = |name: &str| shares.iter().find(|(method, _)| *method == name);
    let others = shares.iter().filter(|(method, _)| *method != "no-action");
    let least = others.map(|(_, share)| *share).reduce(f64::min);
    let words: Vec<_> = shares
        .iter()
        .map(|(method, share)| format!("{method} {:.0} %", share * 100.0))
        .collect();
    Verdict {
        comparison: "runs that end solved".to_owned(),
        numbers: words.join(", "),
        measured: true,
        held: of("no-action")
            .zip(least)
            .map(|((_, share), least)| *share < least),
    }
}

/// Planning of all robots together, mean over the rooms that each of `methods` solves with every
/// number of robots: numbers of robots, and seconds by method.
fn planning_by_robots(runs: &Runs, methods: &[&str]) -> Vec<(f64, Vec<f64>)> {
    let solved_everywhere = |room: &str| {
        methods.iter().all(|method| {
            let runs = runs.get(*method).into_iter().flatten();
            let mut of_room = runs
                .filter(|(situation, _)| situation[0] == room)
                .peekable();
            of_room.peek().is_some() && of_room.all(|(_, run)| run.solved)
        })
    };
    let mut sums: BTreeMap<u64, Vec<Vec<f64>>> = BTreeMap::new();
    for (index, method) in methods.iter().enumerate() {
        for (situation, run) in runs.get(*method).into_iter().flatten() {
            if solved_everywhere(&situation[0]) {
                let robots = sums.entry(run.robots as u64).or_default();
                robots.resize(methods.len(), Vec::new());
                robots[index].push(run.planning_s * run.robots);
            }
        }
    }
    let means =
        |sums: Vec<Vec<f64>>| -> Option<Vec<f64>> { sums.iter().map(|sums| mean(sums)).collect() };
    sums.into_iter()
        .filter_map(|(robots, sums)| Some((robots as f64, means(sums)?)))
        .collect()
}

fn series(points: &[(f64, f64)]) -> String {
    let numbers: Vec<_> = points
        .iter()
        .map(|(robots, number)| format!("{number:.3} ({robots})"))
        .collect();
    numbers.join(", ")
}

/// Whether a series ends above where it begins and rises at every step.
fn rises(points: &[(f64, f64)]) -> Option<bool> {
    (points.len() > 1).then(|| points.windows(2).all(|pair| pair[0].1 < pair[1].1))
}

fn grows(runs: &Runs, method: &str) -> Verdict {
    let points: Vec<_> = planning_by_robots(runs, &[method])
        .into_iter()
        .map(|(robots, seconds)| (robots, seconds[0]))
        .collect();
    Verdict {
        comparison: format!("{method}, all robots together, s (robots)"),
        numbers: series(&points),
        measured: points.len() > 1,
        held: rises(&points),
    }
}

fn gap_grows(runs: &Runs, other: &str) -> Verdict {
    let gaps: Vec<_> = planning_by_robots(runs, &[PAPERS, other])
        .into_iter()
        .map(|(robots, seconds)| (robots, seconds[1] - seconds[0]))
        .collect();
    Verdict {
        comparison: format!("{other} less the paper's, all robots together, s (robots)"),
        numbers: series(&gaps),
        measured: gaps.len() > 1,
        held: rises(&gaps),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::run;

    /// Runs of two rooms with 1 and 2 robots; planning time by method and robots.
    fn table(planning_s: impl Fn(&str, u64) -> f64, unsolved: &str) -> Table {
        let mut table = run::table();
        for room in ["a", "b"] {
            for robots in [1u64, 2] {
                for variant in crate::paper::VARIANTS {
                    let method = variant.word();
                    let planning = planning_s(method, robots);
                    let mut row: Vec<Value> = vec![
                        "paper".into(),
                        room.into(),
                        17.0.into(),
                        robots.into(),
                        method.into(),
                        10u64.into(),
                        "own".into(),
                        0u64.into(),
                        "solved".into(),
                        f64::from(u8::from(method != unsolved)).into(),
                        (10.0 + planning).into(),
                        9.0.into(),
                        planning.into(),
                        0.0.into(),
                        1.0.into(),
                        0.0.into(),
                    ];
                    row.resize(table.columns.len(), Value::Missing(()));
                    table.push(row);
                }
            }
        }
        table
    }

    fn held(findings: &[Finding], claim: &str) -> Option<bool> {
        findings
            .iter()
            .find(|finding| finding.claim.contains(claim))
            .unwrap()
            .held
    }

    #[test]
    fn the_papers_directions_hold_where_the_runs_say_so() {
        let planning = |method: &str, robots: u64| match method {
            PAPERS => robots as f64,
            "restricted" => 2.0 * robots as f64,
            _ => 5.0 * robots as f64,
        };
        let (findings, _) = judge(&table(planning, "no-action"));
        assert_eq!(findings.len(), DIRECTIONS.len());
        for finding in &findings {
            assert_eq!(finding.held, Some(true), "{finding:?}");
        }
    }

    #[test]
    fn a_direction_that_turns_is_not_said_to_hold() {
        let planning = |method: &str, robots: u64| match method {
            PAPERS => 9.0 / robots as f64,
            _ => 2.0,
        };
        let (findings, _) = judge(&table(planning, "restricted"));
        assert_eq!(held(&findings, "planning is least"), Some(false));
        assert_eq!(held(&findings, "planning grows"), Some(false));
        assert_eq!(held(&findings, "no-action is worst"), Some(false));
        assert_eq!(held(&findings, "execution is similar"), Some(true));
    }

    #[test]
    fn one_speed_at_which_it_turns_is_enough_not_to_hold_and_is_named() {
        let mut runs = table(
            |method, robots| if method == PAPERS { 1.0 } else { 2.0 } * robots as f64,
            "no-action",
        );
        let mut slow = table(
            |method, robots| if method == PAPERS { 3.0 } else { 2.0 } * robots as f64,
            "no-action",
        );
        let speed = runs.position("units_per_second").unwrap();
        for row in &mut slow.rows {
            row[speed] = 5u64.into();
        }
        runs.rows.append(&mut slow.rows);
        let (findings, rows) = judge(&runs);
        let least = findings
            .iter()
            .find(|finding| finding.claim.contains("planning is least"))
            .unwrap();
        assert_eq!(least.held, Some(false));
        assert_eq!(
            least.evidence,
            "own, 10 units/s: held; own, 5 units/s: did not hold"
        );
        assert_eq!(
            rows.rows
                .iter()
                .filter(|row| row[0].to_string().contains("planning is least"))
                .count(),
            8
        );
    }

    #[test]
    fn nothing_to_compare_decides_nothing() {
        let (findings, _) = judge(&table(|_, _| 1.0, PAPERS));
        assert_eq!(held(&findings, "planning is least"), None);
    }

    #[test]
    fn planning_is_averaged_over_the_rooms_that_every_method_solves() {
        let run = |solved, planning_s| Run {
            solved,
            execution_s: 1.0,
            planning_s,
            total_s: 1.0,
            robots: 2.0,
        };
        let of = |rooms: &[(&str, bool, f64)]| -> BTreeMap<Situation, Run> {
            let runs = rooms.iter().map(|(room, solved, planning_s)| {
                (vec![(*room).to_owned()], run(*solved, *planning_s))
            });
            runs.collect()
        };
        let mut runs = Runs::new();
        runs.insert(
            "x".into(),
            of(&[("a", true, 1.0), ("b", true, 10.0), ("c", true, 20.0)]),
        );
        runs.insert("y".into(), of(&[("a", true, 3.0), ("b", false, 30.0)]));
        // Room b was not solved by one of them, room c was not given to it.
        let planning = planning_by_robots(&runs, &["x", "y"]);
        assert_eq!(planning, [(2.0, vec![2.0, 6.0])]);
    }
}
