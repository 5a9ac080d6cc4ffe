//! The short table at the end of a run, for people.
//!
//! Responsible for: which of the result's numbers are worth a look, and their units.
//! Not responsible for: the numbers (`result`).

use comfy_table::{Cell, Color, ContentArrangement, Table, presets};

use crate::output::count;
use crate::result::{Ending, RunResult};

/// The result as a table of two columns, ending in a newline.
pub(crate) fn render(result: &RunResult, colour: bool) -> String {
    let mut table = plain();
    let outcome = Cell::new(outcome(result));
    table.add_row(vec![
        Cell::new("outcome"),
        if colour {
            outcome.fg(shade(result))
        } else {
            outcome
        },
    ]);
    for (name, value) in rows(result) {
        table.add_row(vec![name, &value]);
    }
    finish(&table)
}

/// A table without frames that fits the terminal.
pub(crate) fn plain() -> Table {
    let mut table = Table::new();
    table
        .load_preset(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Dynamic);
    if !crate::output::wants_colour() {
        table.force_no_tty();
    }
    table
}

/// The table's text without blanks at the ends of lines.
pub(crate) fn finish(table: &Table) -> String {
    table
        .to_string()
        .lines()
        .map(|line| format!("{}\n", line.trim()))
        .collect()
}

fn shade(result: &RunResult) -> Color {
    match result.outcome {
        Ending::Solved => Color::Green,
        Ending::Interrupted => Color::Yellow,
        _ => Color::Red,
    }
}

fn outcome(result: &RunResult) -> String {
    match &result.reason {
        Some(reason) => format!("{}: {reason}", result.outcome.word()),
        None => result.outcome.word().to_owned(),
    }
}

fn rows(result: &RunResult) -> Vec<(&'static str, String)> {
    let counts = &result.counts;
    let mut rows = vec![(
        "scenario",
        format!(
            "{}: {}, {}, {}, {}",
            result.scenario,
            count(result.objects as u64, "object"),
            count(result.robots as u64, "robot"),
            result.method,
            result.driver
        ),
    )];
    if result.outcome == Ending::Infeasible {
        return rows;
    }
    if let Some(makespan) = result.makespan_s {
        let yardstick = result.yardstick_s.map_or_else(String::new, |yardstick| {
            format!("; with nothing ever in the way: {yardstick:.2} s")
        });
        let bound = result.lower_bound_s.map_or_else(String::new, |bound| {
            format!(" (no plan is shorter than {bound:.2} s{yardstick})")
        });
        rows.push(("makespan", format!("{makespan:.2} s of world time{bound}")));
    }
    if let Some(times) = &result.times {
        let (mean, max) = (&times.mean, &times.max);
        let line = format!(
            "moving {:.2} s, computing {:.2} s, waiting {:.2} s, gripping {:.2} s, idle {:.2} s",
            mean.moving_s, mean.computing_s, mean.waiting_s, mean.gripping_s, mean.idle_s
        );
        rows.push(("per robot", line));
        rows.push((
            "most computing",
            format!("{:.2} s by one robot", max.computing_s),
        ));
    }
    rows.push((
        "work",
        format!(
            "{}, {}, {} expanded, {}",
            count(counts.polygon_tests, "polygon test"),
            count(counts.path_plans, "path plan"),
            count(counts.cells_expanded, "cell"),
            count(counts.selections, "selection")
        ),
    ));
    rows.push((
        "constraints",
        format!(
            "{} easy, {} hard, {}",
            counts.easy_constraints,
            counts.hard_constraints,
            count(counts.task_failures, "failed task")
        ),
    ));
    if let Some(checker) = &result.checker {
        let complete = if checker.complete {
            ""
        } else {
            ", but the trace is incomplete"
        };
        let line = format!(
            "{} in {}{complete}",
            count(checker.violations, "violation"),
            count(checker.swept_tests, "swept test")
        );
        rows.push(("checker", line));
        rows.extend(checker.first.iter().map(|text| ("violation", text.clone())));
    }
    if let Some(invariants) = &result.invariants {
        let total = invariants.total();
        let line = format!(
            "{} checked, {} of them anew, {} broken",
            count(total.checks, "time"),
            total.anew,
            total.violations
        );
        rows.push(("invariants", line));
    }
    if result.wall_s > 0.0
        && let Some(makespan) = result.makespan_s
    {
        let line = format!(
            "{:.2} s of wall time for {} ticks: {:.0} times world time",
            result.wall_s,
            result.ticks,
            makespan / result.wall_s
        );
        rows.push(("speed", line));
    }
    if counts.deadline_misses > 0 {
        rows.push(("deadlines missed", counts.deadline_misses.to_string()));
    }
    rows.push(("state hash", result.state_hash.clone()));
    rows.extend(result.trace.iter().map(|path| ("trace", path.clone())));
    rows.extend(result.notes.iter().map(|note| ("note", note.clone())));
    rows
}
