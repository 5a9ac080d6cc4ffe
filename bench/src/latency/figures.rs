//! Figures of latencies.
//!
//! Responsible for: which numbers are drawn against which.
//! Not responsible for: drawing (`crate::figure`). A figure without numbers is left out.

use hdrhistogram::Histogram;
use node::reference::NAME;

use crate::figure::{Axis, Figure, Scale, Series, lines};
use crate::latency::Options;
use crate::latency::combination::{Combination, Place};
use crate::latency::findings::numbers;
use crate::latency::measure::BLOCKING;
use crate::latency::rows::{Kept, Key, System, TIMES};
use crate::results::{Results, Table};
use crate::stats::median_interval;

const NS_PER_US: f64 = 1e3;
/// Points of a percentile curve for each nine.
const POINTS_PER_NINE: usize = 8;
/// Fewest values beyond the last point of a curve: fewer are chance.
const FEWEST_BEYOND: f64 = 10.0;

pub(super) fn all(results: &Results, kept: &[Kept], options: &Options) -> Vec<Figure> {
    let Some(times) = results.table(TIMES) else {
        return Vec::new();
    };
    let combinations: Vec<_> = Combination::all(options)
        .into_iter()
        .filter(|one| one.place == Place::Lanes && !one.fifo)
        .collect();
    let lockstep = |one: &&Combination| !one.is_real && one.words()[1] == "hybrid";
    let plain: Vec<_> = combinations
        .iter()
        .filter(lockstep)
        .filter(|one| !one.pin)
        .collect();
    let pinned: Vec<_> = combinations
        .iter()
        .filter(lockstep)
        .filter(|one| one.pin)
        .collect();
    let real: Vec<_> = combinations
        .iter()
        .filter(|one| one.is_real && !one.pin)
        .collect();
    let mut figures = Vec::new();
    let robots = |one: &Combination| match one.robots {
        1 => "1 robot".to_owned(),
        robots => format!("{robots} robots"),
    };
    for (system, who) in [(System::Ours, "rearrange"), (System::Bare, NAME)] {
        figures.extend(curves(
            &format!("Snapshot age in lockstep, {who}"),
            "From publication to a robot's first look, waiting by yielding (hybrid). The loop is \
             closed: nothing is published while somebody stalls, so a stall is seen once.",
            kept,
            system,
            "snapshot_age",
            plain.iter().map(|one| (robots(one), *one)),
        ));
        figures.extend(curves(
            &format!("Lateness of snapshots at 1 kHz, {who}"),
            "From when a robot was due to have the state of a period to when it had it. Each \
             period that a stall swallowed counts from its own deadline.",
            kept,
            system,
            "snapshot_lateness",
            real.iter().map(|one| (robots(one), *one)),
        ));
    }
    figures.extend(growth(
        "Cost of sending a snapshot",
        "One send to all readers, median over the repeats with 95 % interval, in lockstep \
         (hybrid): robots, planner, recorder and supervisor read.",
        "robots",
        times,
        &[
            line("rearrange", System::Ours, "snapshot_send", &plain),
            line(NAME, System::Bare, "snapshot_send", &plain),
            line("Unix datagrams", System::Datagram, "snapshot_send", &plain),
        ],
        |one| one.robots as f64,
    ));
    let few = pinned.iter().map(|one| one.robots).min().unwrap_or(0);
    let sizes: Vec<_> = pinned.into_iter().filter(|one| one.robots == few).collect();
    figures.extend(growth(
        "What grows with the payload, and what does not",
        "Medians in lockstep (hybrid, pinned) against the live bytes of a snapshot. The age does \
         not grow where nothing is copied; checking every field in place does.",
        "bytes of a snapshot",
        times,
        &[
            line("age, rearrange", System::Ours, "snapshot_age", &sizes),
            line("age, bare", System::Bare, "snapshot_age", &sizes),
            line(
                "age, Unix datagram",
                System::Datagram,
                "snapshot_age",
                &sizes,
            ),
            line("check in place", System::Ours, "snapshot_check", &sizes),
            line("robot's step", System::Ours, "robot_step", &sizes),
            line("writing in place", System::Ours, "snapshot_write", &sizes),
        ],
        |one| one.payload() as f64,
    ));
    figures
}

/// A name of one system at several combinations.
struct Line<'a> {
    label: &'a str,
    system: System,
    name: &'a str,
    at: Vec<&'a Combination>,
}

fn line<'a>(label: &'a str, system: System, name: &'a str, at: &[&'a Combination]) -> Line<'a> {
    let mut at = at.to_vec();
    at.sort_by_key(|one| (one.robots, one.objects));
    Line {
        label,
        system,
        name,
        at,
    }
}

/// Percentile curves, one for each combination.
fn curves<'a>(
    title: &str,
    caption: &str,
    kept: &[Kept],
    system: System,
    name: &str,
    combinations: impl Iterator<Item = (String, &'a Combination)>,
) -> Option<Figure> {
    let series: Vec<_> = combinations
        .filter_map(|(label, one)| {
            let key = Key::of(system, one);
            let found = kept
                .iter()
                .find(|kept| kept.key == key && kept.name == name)?;
            Some(Series {
                name: label,
                points: curve(&found.histogram),
                intervals: Vec::new(),
            })
        })
        .collect();
    let axes = (
        Axis {
            label: "share of all looks",
            scale: Scale::Quantile,
        },
        Axis {
            label: "µs",
            scale: Scale::Log,
        },
    );
    lines(title, caption, axes, &series).ok()
}

/// Quantile and value, µs, as far as the histogram has enough values to tell.
fn curve(histogram: &Histogram<u64>) -> Vec<(f64, f64)> {
    let count = histogram.len() as f64;
    // The first is the quartile: below it there is no tail to see.
    (1..)
        .map(|point| 1.0 - 10f64.powf(-(point as f64) / POINTS_PER_NINE as f64))
        .take_while(|quantile| (1.0 - quantile) * count >= FEWEST_BEYOND)
        .map(|quantile| {
            let value = histogram.value_at_quantile(quantile).max(1);
            (quantile, value as f64 / NS_PER_US)
        })
        .collect()
}

/// Medians against `x`, in µs.
fn growth(
    title: &str,
    caption: &str,
    label: &str,
    times: &Table,
    all: &[Line<'_>],
    x: impl Fn(&Combination) -> f64,
) -> Option<Figure> {
    let series: Vec<_> = all
        .iter()
        .map(|line| {
            let mut series = Series {
                name: line.label.to_owned(),
                ..Series::default()
            };
            for one in &line.at {
                let mut key = Key::of(line.system, one);
                if line.system == System::Datagram {
                    key.words = BLOCKING;
                }
                let numbers = numbers(times, &key, line.name, "p50_ns");
                if let Some(median) = median_interval(&numbers) {
                    series.points.push((x(one), median.value / NS_PER_US));
                    let interval = (median.low / NS_PER_US, median.high / NS_PER_US);
                    series.intervals.push(interval);
                }
            }
            series
        })
        .filter(|series| !series.points.is_empty())
        .collect();
    let axes = (
        Axis {
            label,
            scale: Scale::Log,
        },
        Axis {
            label: "µs",
            scale: Scale::Log,
        },
    );
    lines(title, caption, axes, &series).ok()
}

#[cfg(test)]
mod tests {
    use node::histograms::empty;

    use super::*;

    #[test]
    fn a_curve_ends_where_chance_begins() {
        let mut histogram = empty();
        for value in 1..=1_000 {
            histogram.saturating_record(value * 1_000);
        }
        let curve = curve(&histogram);
        let (last, value) = curve[curve.len() - 1];
        assert!((0.98..=0.990_001).contains(&last), "{last}");
        assert!((980.0..=1_000.0).contains(&value), "{value}");
        assert!(curve.windows(2).all(|pair| pair[0].1 <= pair[1].1));
    }
}
