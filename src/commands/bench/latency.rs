//! `rearrange bench latency`: what shared memory costs as robots are added.
//!
//! Responsible for: what the command line asks for, how long it will take, a short table of what
//! came out.
//! Not responsible for: the measurement (crate `bench`).

use std::collections::BTreeSet;
use std::time::Duration;

use bench::latency::{self, Options};
use bench::results::{Results, Table};
use bench::stats::median;

use crate::cli::LatencyArgs;
use crate::commands::bench::{Destination, Watch, command_line};
use crate::drivers::processes::launcher;
use crate::exit::{Failure, Outcome};
use crate::{output, table};

/// Repeats, if nobody says how many.
const REPEATS: usize = 5;
/// How long each is measured with `--quick`, each time.
const QUICK: Duration = Duration::from_millis(100);
/// Names in the short table; the files have all.
const SHOWN: [&str; 6] = [
    "snapshot_age",
    "snapshot_lateness",
    "snapshot_send",
    "robot_step",
    "command_to_grant",
    "hard_round_trip",
];

/// Measures latencies of real processes, beside their references.
pub(crate) fn main(args: &LatencyArgs) -> Outcome {
    let options = options(args);
    let destination = Destination::create("latency", &args.output)?;
    let launcher = launcher()?;
    let estimate = options.estimate_s();
    output::complain(&format!(
        "this will take about {}; Ctrl-C keeps what was measured until then",
        duration(estimate)
    ));
    let mut watch = Watch::start()?;
    let found = latency::run(&options, &launcher, &command_line(), &mut watch)
        .map_err(|error| Failure::system(format!("signals cannot be watched: {error}")))?;
    drop(watch);
    let text = text(&found.results);
    destination.finish(&found.results, &found.figures, &found.histograms, &text)
}

fn options(args: &LatencyArgs) -> Options {
    let defaults = Options::default();
    let sorted = |numbers: &[u32], or: Vec<usize>| {
        let numbers: BTreeSet<_> = numbers.iter().map(|number| *number as usize).collect();
        if numbers.is_empty() {
            or
        } else {
            numbers.into_iter().collect()
        }
    };
    Options {
        robots: sorted(&args.robots, defaults.robots),
        objects: sorted(&args.objects, defaults.objects),
        waits: if args.wait.is_empty() {
            defaults.waits
        } else {
            args.wait.clone()
        },
        repeats: args.repeats.map_or(REPEATS, |repeats| repeats as usize),
        measured: if args.quick { QUICK } else { defaults.measured },
        full: args.full,
        quick: args.quick,
    }
}

fn duration(seconds: f64) -> String {
    if seconds < 90.0 {
        format!("{seconds:.0} s")
    } else {
        format!("{:.0} minutes", seconds / 60.0)
    }
}

/// Medians over the repeats, one line for each name of each combination, ours beside bare.
fn text(results: &Results) -> String {
    let mut text = String::new();
    if let Some(times) = results.table("latency") {
        text += &medians(times);
    }
    if let Some(runs) = results.table("runs") {
        text += &refusals(runs);
    }
    for finding in &results.findings {
        let word = match finding.held {
            Some(true) => "held        ",
            Some(false) => "did not hold",
            None => "not measured",
        };
        text += &format!("\n{word}  {}: {}", finding.claim, finding.evidence);
    }
    text + "\n"
}

fn medians(times: &Table) -> String {
    let mut shown = table::plain();
    shown.set_header([
        "ROBOTS", "OBJECTS", "CLOCK", "WAIT", "PINNED", "PRIORITY", "NAME", "p50 µs", "p99 µs",
        "BARE p50", "BARE p99",
    ]);
    let cell = |rows: &[usize], column: &str| {
        let position = times.position(column)?;
        let numbers: Vec<_> = rows
            .iter()
            .filter_map(|row| times.rows[*row][position].number())
            .collect();
        Some(format!("{:.2}", median(&numbers)? / 1e3))
    };
    let groups = times.groups();
    for (key, rows) in &groups {
        let [system, clock, wait, pinned, priority, robots, objects, name] = key.as_slice() else {
            continue;
        };
        if system != "rearrange" || !SHOWN.contains(&name.as_str()) {
            continue;
        }
        let bare = groups
            .iter()
            .find(|(other, _)| other[0] == node::reference::NAME && other[1..] == key[1..]);
        let of_bare = |column| {
            bare.and_then(|(_, rows)| cell(rows, column))
                .unwrap_or_default()
        };
        let own = |column| cell(rows, column).unwrap_or_default();
        shown.add_row([
            robots,
            objects,
            clock,
            wait,
            pinned,
            priority,
            name,
            &own("p50_ns"),
            &own("p99_ns"),
            &of_bare("p50_ns"),
            &of_bare("p99_ns"),
        ]);
    }
    format!("{}\n", table::finish(&shown))
}

/// What could not run, each reason once.
fn refusals(runs: &Table) -> String {
    let (Some(status), Some(reason)) = (runs.position("status"), runs.position("reason")) else {
        return String::new();
    };
    let lines: BTreeSet<_> = runs
        .rows
        .iter()
        .filter(|row| matches!(row[status].to_string().as_str(), "refused" | "failed"))
        .map(|row| format!("\n{}: {}", row[status], row[reason]))
        .collect();
    lines.into_iter().collect()
}
