//! What the rows bear out.
//!
//! Responsible for: the claims, the rows each rests on, and whether they bear it out.
//! Not responsible for: the rows (`rows`).
//!
//! A claim about a ratio holds if the ratio of the medians over the repeats does; its evidence
//! gives the interval too. Ours and bare were measured in turn, so whatever disturbed one
//! disturbed the other.

use node::reference::NAME;

use crate::latency::Options;
use crate::latency::combination::{Combination, Place};
use crate::latency::rows::{Key, RUNS, System, TIMES};
use crate::results::{Finding, Results, Table};
use crate::stats::{Estimate, median, ratio_interval};

/// How much longer than bare iceoryx2 ours may take.
const TARGET: f64 = 1.2;
/// How much longer a look may take where the payload is larger, and still not depend on it.
const SAME: f64 = 1.5;

pub(super) fn all(results: &Results, options: &Options) -> Vec<Finding> {
    let (Some(times), Some(runs)) = (results.table(TIMES), results.table(RUNS)) else {
        return Vec::new();
    };
    let cores = results.machine.cores;
    let combinations: Vec<_> = Combination::all(options)
        .into_iter()
        .filter(|one| one.place == Place::Lanes && !one.fifo)
        .collect();
    let mut findings = ages(times, &combinations, cores);
    findings.extend(latenesses(times, &combinations));
    findings.extend(sends(times, &combinations, cores));
    findings.extend(copies(times, &combinations));
    findings.push(steal(runs));
    findings
}

/// In real time, from the deadline: everybody sleeps most of the time, so that few want a core at
/// once.
fn latenesses(times: &Table, combinations: &[Combination]) -> Vec<Finding> {
    let real = combinations.iter().filter(|one| one.is_real && !one.pin);
    let quantiles = |one| ["p50_ns", "p99_ns"].map(|quantile| (one, quantile));
    real.flat_map(quantiles)
        .map(|(one, quantile)| {
            judged(
                times,
                one,
                "snapshot_lateness",
                quantile,
                "lateness of snapshots",
            )
        })
        .collect()
}

/// The snapshot's age, where each process has a core.
fn ages(times: &Table, combinations: &[Combination], cores: usize) -> Vec<Finding> {
    let lockstep = || combinations.iter().filter(|one| !one.is_real);
    let fitting: Vec<_> = lockstep().filter(|one| one.processes() <= cores).collect();
    if !fitting.is_empty() {
        return fitting
            .into_iter()
            .flat_map(|one| ["p50_ns", "p99_ns"].map(|quantile| age(times, one, quantile, "")))
            .collect();
    }
    // Nobody has a core for each: the nearest to it is one robot that has a core to itself.
    let words = "; no run here has a core for each process, so this is the nearest to it: one \
                 robot bound to a core of its own, all other processes on the other, in both \
                 alike";
    let nearest = lockstep()
        .filter(|one| one.pin && one.robots == 1 && cores >= 2)
        .min_by_key(|one| one.objects.abs_diff(100));
    nearest.map_or_else(
        || {
            vec![Finding {
                claim: format!("snapshot age within {TARGET} times {NAME}"),
                held: None,
                evidence: "no run here has a core for each process, nor was one robot measured \
                           bound to a core"
                    .to_owned(),
            }]
        },
        |one| {
            ["p50_ns", "p99_ns"]
                .map(|quantile| age(times, one, quantile, words))
                .into()
        },
    )
}

fn age(times: &Table, one: &Combination, quantile: &str, words: &str) -> Finding {
    let finding = judged(times, one, "snapshot_age", quantile, "snapshot age");
    Finding {
        evidence: finding.evidence + words,
        ..finding
    }
}

/// Whether ours is within the target of bare.
fn judged(times: &Table, one: &Combination, name: &str, quantile: &str, what: &str) -> Finding {
    let ratio = ratio(times, one, name, quantile);
    Finding {
        claim: format!(
            "{}: {what}, {}, within {TARGET} times {NAME}",
            describe(one),
            quantile.trim_end_matches("_ns")
        ),
        held: ratio.as_ref().map(|(ratio, _)| ratio.value <= TARGET),
        evidence: told(ratio),
    }
}

/// What a snapshot costs its sender for each reader, where processes share cores.
fn sends(times: &Table, combinations: &[Combination], cores: usize) -> Vec<Finding> {
    let beyond = combinations.iter().filter(|one| {
        !one.is_real && !one.pin && one.processes() > cores && one.words()[1] == "hybrid"
    });
    beyond
        .map(|one| {
            let ratio = ratio(times, one, "snapshot_send", "p50_ns");
            Finding {
                claim: format!(
                    "{}: cost of send for each reader within {TARGET} times {NAME}",
                    describe(one)
                ),
                held: ratio.as_ref().map(|(ratio, _)| ratio.value <= TARGET),
                evidence: told(ratio),
            }
        })
        .collect()
}

/// Reading copies nothing: the age is the same whatever the size of the payload.
fn copies(times: &Table, combinations: &[Combination]) -> Vec<Finding> {
    let mut pinned: Vec<_> = combinations
        .iter()
        .filter(|one| one.pin && !one.is_real && one.words()[1] == "hybrid")
        .collect();
    let Some(robots) = pinned.iter().map(|one| one.robots).min() else {
        return Vec::new();
    };
    pinned.retain(|one| one.robots == robots);
    pinned.sort_by_key(|one| one.objects);
    let (Some(few), Some(many)) = (pinned.first(), pinned.last()) else {
        return Vec::new();
    };
    if few.objects == many.objects {
        return Vec::new();
    }
    let of = |system, one: &Combination| {
        let key = match system {
            System::Datagram => Key {
                words: super::measure::BLOCKING,
                ..Key::of(system, one)
            },
            _ => Key::of(system, one),
        };
        numbers(times, &key, "snapshot_age", "p50_ns")
    };
    let ratio = ratio_interval(&of(System::Ours, many), &of(System::Ours, few));
    let datagram = ratio_interval(&of(System::Datagram, many), &of(System::Datagram, few));
    let payload = many.payload() as f64 / few.payload() as f64;
    let said = |ratio: &Option<Estimate>| {
        ratio.map_or("not measured".to_owned(), |ratio| {
            format!("{:.2} [{:.2}, {:.2}]", ratio.value, ratio.low, ratio.high)
        })
    };
    vec![Finding {
        claim: format!(
            "reading a snapshot copies nothing: its age, p50, does not grow with the payload \
             ({} to {} objects, {} to {} bytes, within {SAME} times)",
            few.objects,
            many.objects,
            few.payload(),
            many.payload()
        ),
        held: ratio.map(|ratio| ratio.value <= SAME),
        evidence: format!(
            "the payload grows {payload:.1}-fold, the age {}-fold; of a Unix datagram, which is \
             copied twice, {}-fold",
            said(&ratio),
            said(&datagram)
        ),
    }]
}

/// Whether the host left the machine alone.
fn steal(runs: &Table) -> Finding {
    let stolen: Vec<_> = runs.numbers("stolen", &[]).collect();
    let worst = stolen.iter().copied().reduce(f64::max);
    Finding {
        claim: "the host took no processor time from this machine during a run".to_owned(),
        held: worst.map(|worst| worst == 0.0),
        evidence: worst.map_or("not told here".to_owned(), |worst| {
            format!(
                "median {:.2} %, most in a run {:.2} %; tails of runs it took from are its, not \
                 ours",
                median(&stolen).unwrap_or(0.0) * 100.0,
                worst * 100.0
            )
        }),
    }
}

type Ratio = (Estimate, (f64, f64));

/// Ours over bare, and both medians.
fn ratio(times: &Table, one: &Combination, name: &str, quantile: &str) -> Option<Ratio> {
    let of = |system| numbers(times, &Key::of(system, one), name, quantile);
    let (ours, bare) = (of(System::Ours), of(System::Bare));
    let ratio = ratio_interval(&ours, &bare)?;
    Some((ratio, (median(&ours)?, median(&bare)?)))
}

fn told(ratio: Option<Ratio>) -> String {
    ratio.map_or("not measured".to_owned(), |(ratio, (ours, bare))| {
        format!(
            "{ours:.0} ns against {bare:.0} ns: {:.2} [{:.2}, {:.2}]",
            ratio.value, ratio.low, ratio.high
        )
    })
}

/// The numbers of all repeats.
pub(super) fn numbers(times: &Table, key: &Key, name: &str, column: &str) -> Vec<f64> {
    let [clock, wait, pinned, priority] = key.words;
    let (robots, objects) = (key.robots.to_string(), key.objects.to_string());
    let keys = [
        ("system", key.system.word()),
        ("clock", clock),
        ("wait", wait),
        ("pinned", pinned),
        ("priority", priority),
        ("robots", &robots),
        ("objects", &objects),
        ("name", name),
    ];
    times.numbers(column, &keys).collect()
}

fn describe(one: &Combination) -> String {
    format!(
        "{} robot{} ({} processes), {}",
        one.robots,
        if one.robots == 1 { "" } else { "s" },
        one.processes(),
        one.words().join(", ")
    )
}

#[cfg(test)]
mod tests {
    use node::histograms::empty;

    use super::*;
    use crate::latency::rows::Rows;

    fn findings(ours_ns: u64, bare_ns: u64, cores: usize) -> Vec<Finding> {
        let options = Options {
            robots: vec![1],
            ..Options::default()
        };
        let mut rows = Rows::new(cores);
        for one in Combination::all(&options) {
            for (system, ns) in [(System::Ours, ours_ns), (System::Bare, bare_ns)] {
                let mut histogram = empty();
                histogram.saturating_record(ns);
                for name in ["snapshot_age", "snapshot_lateness", "snapshot_send"] {
                    rows.time(&Key::of(system, &one), name, 0, &histogram);
                }
            }
        }
        let mut results = Results::new("latency", "");
        results.machine.cores = cores;
        results.tables = rows.into_parts().0;
        all(&results, &options)
    }

    fn held(findings: &[Finding], words: &str) -> Vec<Option<bool>> {
        let about = findings
            .iter()
            .filter(|finding| finding.claim.contains(words));
        about.map(|finding| finding.held).collect()
    }

    #[test]
    fn claims_hold_or_fail_with_the_numbers() {
        let good = findings(1_100, 1_000, 8);
        assert!(
            held(&good, "snapshot age")
                .iter()
                .all(|held| *held == Some(true))
        );
        assert!(
            held(&good, "cost of send").is_empty(),
            "everybody has a core"
        );
        let bad = findings(1_500, 1_000, 8);
        assert!(
            held(&bad, "snapshot age")
                .iter()
                .all(|held| *held == Some(false))
        );
        let shared = findings(1_500, 1_000, 2);
        assert_eq!(held(&shared, "cost of send"), [Some(false)]);
        assert_eq!(
            held(&shared, "snapshot age"),
            [Some(false); 2],
            "the nearest to it"
        );
        assert_eq!(held(&shared, "lateness"), [Some(false); 2]);
        assert_eq!(held(&shared, "copies nothing"), [Some(true)]);
    }
}
