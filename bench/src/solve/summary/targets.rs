//! Whether the targets are reached, as findings.
//!
//! Responsible for: what is to be reached, and what the runs say of it.
//! Not responsible for: tables of the same (the parent module).

use super::{GROUPS, Ratios, SLOWER, excess, is_slower_by_a_tick, there};
use crate::results::Finding;
use crate::solve::rooms::Set;
use crate::solve::{METHODS, Solved};
use crate::stats::mean_interval;

/// Share of all generated rooms that is to be solved.
const TARGET_SHARE: f64 = 0.99;
/// Mean ratio to R that is to be reached with 1, 2, 3 and 4 robots.
pub const TARGET_RATIOS: [f64; 4] = [1.05, 1.15, 1.25, 1.35];
/// Share of rooms in which none of the paper's four is to be faster.
const TARGET_BEST: f64 = 0.99;
/// By how much it may be faster in the others.
const TARGET_EXCESS: f64 = 1.05;

/// Every target, and whether it is reached.
pub(super) fn findings(solved: &[Solved]) -> Vec<Finding> {
    let mut findings = vec![solved_share(solved)];
    findings.extend((1..=TARGET_RATIOS.len()).map(|robots| ratio(solved, robots)));
    findings.extend([not_slower(solved), worst(solved), still(solved)]);
    findings
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
