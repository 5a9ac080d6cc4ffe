//! The paper's directions, each with what the runs say of it.
//!
//! Responsible for: comparing methods on the rooms that both solve, at every modelled speed, and
//! where each direction turns.
//! Not responsible for: the runs. A direction that does not hold is reported so.
//!
//! Terms: a *pair* is two runs that differ in the method alone and are both solved; a ratio is
//! the mean of the first method's times over that of the second's, with a 95 % bootstrap
//! interval over the pairs. A direction holds where the whole interval lies on its side, and
//! does not where it lies on the other.
//!
//! Source: rule 25; paper §V, Figs. 6 and 7.

use std::collections::BTreeMap;

use crate::results::{Finding, Table, Value};
use crate::stats::{Estimate, mean, ratio_of_means_interval};

/// Times this close are similar: within a tenth.
const SIMILAR: f64 = 1.1;

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
    words: String,
    held: Option<bool>,
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
                .map(|method| grows(runs, method, |run| run.planning_s))
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

/// What the runs say of every direction, one finding for each set of rooms and modelled speed.
#[must_use]
pub fn findings(table: &Table) -> Vec<Finding> {
    let worlds = worlds(table);
    let mut findings = Vec::new();
    for direction in &DIRECTIONS {
        for (world, runs) in &worlds {
            let verdicts = (direction.judge)(runs);
            let known: Vec<_> = verdicts.iter().filter_map(|verdict| verdict.held).collect();
            let words: Vec<_> = verdicts.into_iter().map(|verdict| verdict.words).collect();
            findings.push(Finding {
                claim: format!("{world}: {}", direction.claim),
                held: (!known.is_empty()).then(|| known.iter().all(|held| *held)),
                evidence: words.join("; "),
            });
        }
    }
    findings
}

/// The runs by set of rooms, computer and modelled speed.
fn worlds(table: &Table) -> Vec<(String, Runs)> {
    let mut worlds: Vec<(String, Runs)> = Vec::new();
    for row in &table.rows {
        let text = |name: &str| cell(table, row, name).to_string();
        let world = format!(
            "{} rooms, {} computer, {} units/s",
            text("set"),
            text("compute"),
            text("units_per_second")
        );
        let Some(run) = run(table, row) else { continue };
        let place = worlds.iter().position(|(name, _)| *name == world);
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

fn words(what: &str, one: &str, other: &str, found: Option<(Estimate, usize)>) -> String {
    match found {
        Some((ratio, pairs)) => format!(
            "{what} {one} / {other} = {:.3} [{:.3}, {:.3}] over {pairs} pairs",
            ratio.value, ratio.low, ratio.high
        ),
        None => format!("{what} {one} / {other}: no pair to compare"),
    }
}

fn less(runs: &Runs, one: &str, other: &str, what: &str, of: fn(&Run) -> f64) -> Verdict {
    let found = ratio(runs, one, other, of);
    Verdict {
        words: words(what, one, other, found),
        held: found.map(|(ratio, _)| ratio.high < 1.0),
    }
}

fn similar(runs: &Runs, other: &str, what: &str, of: fn(&Run) -> f64) -> Verdict {
    let found = ratio(runs, PAPERS, other, of);
    Verdict {
        words: words(what, PAPERS, other, found),
        held: found.map(|(ratio, _)| ratio.low > 1.0 / SIMILAR && ratio.high < SIMILAR),
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
        words: format!("solved: {}", words.join(", ")),
        held: of("no-action")
            .zip(least)
            .map(|((_, share), least)| *share < least),
    }
}

/// Mean of a number over the solved runs, by number of robots.
fn by_robots(runs: &Runs, method: &str, of: fn(&Run) -> f64) -> Vec<(f64, f64)> {
    let mut groups: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
    for run in runs.get(method).into_iter().flatten().map(|(_, run)| run) {
        if run.solved {
            groups.entry(run.robots as u64).or_default().push(of(run));
        }
    }
    groups
        .into_iter()
        .filter_map(|(robots, numbers)| Some((robots as f64, mean(&numbers)?)))
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

fn grows(runs: &Runs, method: &str, of: fn(&Run) -> f64) -> Verdict {
    let points = by_robots(runs, method, of);
    Verdict {
        words: format!("{method}, s (robots): {}", series(&points)),
        held: rises(&points),
    }
}

fn gap_grows(runs: &Runs, other: &str) -> Verdict {
    let papers = by_robots(runs, PAPERS, |run| run.planning_s);
    let others = by_robots(runs, other, |run| run.planning_s);
    let gaps: Vec<_> = others
        .iter()
        .filter_map(|(robots, number)| {
            let (_, base) = papers.iter().find(|(same, _)| same == robots)?;
            Some((*robots, number - base))
        })
        .collect();
    Verdict {
        words: format!("{other} less the paper's, s (robots): {}", series(&gaps)),
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
        let findings = findings(&table(planning, "no-action"));
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
        let findings = findings(&table(planning, "restricted"));
        assert_eq!(held(&findings, "planning is least"), Some(false));
        assert_eq!(held(&findings, "planning grows"), Some(false));
        assert_eq!(held(&findings, "no-action is worst"), Some(false));
        assert_eq!(held(&findings, "execution is similar"), Some(true));
    }

    #[test]
    fn nothing_to_compare_decides_nothing() {
        let findings = findings(&table(|_, _| 1.0, PAPERS));
        assert_eq!(held(&findings, "planning is least"), None);
    }
}
