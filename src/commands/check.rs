//! `rearrange check`: a trace replayed with geometry of its own.
//!
//! Responsible for: what is said of the checker's report.
//! Not responsible for: the check (crate `trace`).

use std::fmt::Write as _;

use trace::CheckReport;

use crate::cli::CheckArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::output;

/// Checks a trace; status 6 if something in it is not legal, 3 if it is no trace at all.
pub(crate) fn main(args: &CheckArgs) -> Outcome {
    let report =
        trace::check_file(&args.trace).map_err(|error| Failure::new(Exit::BadInput, error))?;
    if args.json {
        output::print_json(&report)?;
    } else {
        output::print(&text(&report))?;
    }
    if !report.violations.is_empty() {
        return Ok(Exit::Invariant);
    }
    if report.truncated {
        return Err(Failure::new(
            Exit::BadInput,
            truncated(&args.trace, &report),
        ));
    }
    Ok(Exit::Success)
}

fn truncated(path: &std::path::Path, report: &CheckReport) -> String {
    format!(
        "{} is cut short: it was checked up to {:.3} s of world time, and has no end",
        path.display(),
        report.checked_until_ns as f64 / 1e9
    )
}

fn text(report: &CheckReport) -> String {
    let mut text = String::new();
    for violation in &report.violations {
        let _ = writeln!(text, "{violation}");
    }
    if report.unlisted_violations > 0 {
        let _ = writeln!(text, "and {} more", report.unlisted_violations);
    }
    let violations = report.violations.len() as u64 + report.unlisted_violations;
    let _ = writeln!(
        text,
        "{} in {:.3} s of world time, {}",
        output::count(violations, "violation"),
        report.checked_until_ns as f64 / 1e9,
        output::count(report.swept_tests, "swept test")
    );
    if report.missing_batches > 0 {
        let _ = writeln!(
            text,
            "the trace is incomplete: {} of motion missing",
            output::count(report.missing_batches, "tick")
        );
    }
    text
}
