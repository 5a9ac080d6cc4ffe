//! `rearrange chaos`: processes of real runs are killed and stalled, and the runs have to end as if
//! nothing had been.
//!
//! Responsible for: as many runs as the kills need, and the verdict on them.
//! Not responsible for: what is struck when (`plan`), striking (`victim`), how long set-ups
//! last (`set_ups`), what is counted (`report`), recovering (crate `node`).

mod plan;
mod report;
mod set_ups;
mod victim;

use std::time::Duration;

use crate::cli::ChaosArgs;
use crate::drivers::interrupt::Interrupt;
use crate::exit::{Exit, Failure, Outcome};
use crate::{output, scenario};
use plan::Plan;
use report::Report;
use set_ups::SetUps;
use victim::Victim;

/// A run without any sign of life for so long is wedged.
const WEDGED: Duration = Duration::from_secs(30);
/// Runs that may fail before it is no use to go on.
const MOST_FAILED: usize = 5;

/// Kills, and prints what came of it.
pub(crate) fn main(args: &ChaosArgs) -> Outcome {
    // A scenario that cannot be read is no failure of the runs.
    let scene = scenario::load(&args.scenario, args.robots)?.scene;
    let mut plan = Plan::new(args);
    let mut report = Report::new(args, scene.homes.len());
    let mut set_ups = SetUps::default();
    let interrupt = Interrupt::watch()
        .map_err(|error| Failure::system(format!("signals cannot be watched: {error}")))?;
    while plan.is_open() && report.failures.len() < MOST_FAILED {
        let victim = Victim::start(args, report.runs, &mut set_ups);
        let mut victim = victim
            .map_err(|error| Failure::system(format!("a run could not be started: {error}")))?;
        let Some(ended) = victim.torment(&mut plan, WEDGED, &interrupt) else {
            // What was done to it tells nothing.
            victim.clean_up();
            break;
        };
        report.take(victim, ended, &mut plan);
        if output::is_watched() {
            output::complain(&report.progress(&plan));
        }
    }
    report.interrupted = interrupt.is_asked();
    report.leftovers = node::domain::leftovers().map_or(0, |found| found.len());
    if args.json {
        output::print_json(&report.json())?;
    } else {
        output::print(&report.text())?;
    }
    Ok(if report.is_clean(&plan) {
        Exit::Success
    } else if report.violations > 0 {
        Exit::Invariant
    } else if report.interrupted && report.failures.is_empty() {
        Exit::Interrupted
    } else {
        Exit::System
    })
}
