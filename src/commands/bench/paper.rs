//! `rearrange bench paper`: the paper's experiment.
//!
//! Responsible for: the plan from the command line, handing real processes to the workload.
//! Not responsible for: the runs and what follows from them (crate `bench`).

use bench::files;
use bench::paper::run::{ACTIVITIES, Measures, RunError, in_process};
use bench::paper::{self, Plan, RUNS, VARIANTS, directions, figures};
use bench::results::Results;
use node::{RunOptions, RunReport, supervisor};
use scene::{Scene, Settings};
use shm_types::{Activity, Counters};

use super::{Destination, Watch, command_line};
use crate::cli::PaperArgs;
use crate::drivers::processes::plan as process_plan;
use crate::exit::{Exit, Failure, Outcome};
use crate::run_options::Driver;
use crate::table;

/// Runs the experiment.
pub(crate) fn main(args: &PaperArgs) -> Outcome {
    let destination = Destination::create("paper", &args.output)?;
    if let Some(earlier) = &args.from {
        let results = files::read(earlier).map_err(|error| Failure::new(Exit::BadInput, error))?;
        return finish(&destination, results);
    }
    let plan = plan(args);
    let mut watch = Watch::start()?;
    let rooms = paper::rooms(&plan, &mut watch).map_err(Failure::system)?;
    let mut results = Results::new("paper", &command_line());
    let mut run = |scene: &Scene, settings: &Settings| match args.driver {
        Driver::InProcess => Ok(in_process(scene, settings)),
        Driver::Processes => processes(scene, settings),
    };
    paper::measure(&plan, &rooms, &mut results, &mut watch, &mut run);
    drop(watch);
    finish(&destination, results)
}

/// Judges and draws the runs, and leaves everything.
fn finish(destination: &Destination, mut results: Results) -> Outcome {
    if let Some((findings, comparisons)) = paper::runs(&results).map(directions::judge) {
        results.findings = findings;
        results
            .tables
            .retain(|table| table.name != comparisons.name);
        results.tables.push(comparisons);
    }
    let figures = figures::all(&results).map_err(Failure::system)?;
    destination.finish(&results, &figures, &[], &text(&results))
}

fn plan(args: &PaperArgs) -> Plan {
    let base = if args.quick {
        Plan::quick()
    } else {
        Plan::full()
    };
    let numbers = |given: &[u32], base: Vec<usize>| match given {
        [] => base,
        given => given.iter().map(|robots| *robots as usize).collect(),
    };
    Plan {
        rooms: args.rooms.map_or(base.rooms, |rooms| rooms as usize),
        seed: args.seed,
        robots: numbers(&args.robots, base.robots),
        units_per_second: if args.units_per_second.is_empty() {
            base.units_per_second
        } else {
            args.units_per_second.clone()
        },
        compute: if args.compute.is_empty() {
            base.compute
        } else {
            args.compute.clone()
        },
        repeats: args.repeats as usize,
    }
}

/// The same run as real processes in lockstep.
fn processes(scene: &Scene, settings: &Settings) -> Result<Measures, RunError> {
    let failed = |words: String| RunError(words);
    let plan = process_plan(scene, RunOptions::new(settings.clone()))
        .map_err(|failure| failed(format!("{:?}", failure.complaint)))?;
    let report = supervisor::run(&plan, &mut ()).map_err(|error| failed(error.to_string()))?;
    Ok(measures(&report, settings.tick_ns))
}

fn measures(report: &RunReport, tick_ns: u64) -> Measures {
    let ticks: Vec<_> = report
        .world
        .activities
        .iter()
        .map(|robot| {
            let mut robot = *robot;
            ACTIVITIES.map(|(activity, _): (Activity, _)| *robot.of_mut(activity))
        })
        .collect();
    Measures {
        counters: Counters {
            polygon_tests: report.counters.polygon_tests,
            path_plans: report.counters.path_plans,
            cells_expanded: report.counters.cells_expanded,
            ..Counters::default()
        },
        task_failures: report.world.task_failures,
        hard_constraints: report.world.hard_constraints,
        ..Measures::of_ticks(report.outcome, &ticks, tick_ns)
    }
}

/// Every direction with where it held, and the comparisons behind it.
fn findings(results: &Results) -> String {
    let mut text = String::new();
    for finding in &results.findings {
        let word = match finding.held {
            Some(true) => "held",
            Some(false) => "did not hold",
            None => "undecided",
        };
        text += &format!("{word}: {}\n    {}\n", finding.claim, finding.evidence);
    }
    let comparisons = results.table(directions::DIRECTIONS_TABLE);
    let rows = comparisons.map_or(&[][..], |table| &table.rows);
    let mut direction = String::new();
    for row in rows {
        let cells: Vec<_> = row.iter().map(ToString::to_string).collect();
        let [claim, set, compute, speed, comparison, held, numbers] = cells.as_slice() else {
            continue;
        };
        if *claim != direction {
            text += &format!("\n{claim}\n");
            direction.clone_from(claim);
        }
        text += &format!(
            "    {set} rooms, {compute}, {speed} units/s: {comparison} = {numbers}: {held}\n"
        );
    }
    text
}

/// Success and mean times of each method, and the directions.
fn text(results: &Results) -> String {
    let mut text = String::new();
    if let Some(runs) = results.table(RUNS) {
        let mut table = table::plain();
        table.set_header([
            "METHOD",
            "RUNS",
            "SOLVED",
            "MAKESPAN s",
            "MOVING s",
            "COMPUTING s",
            "WAITING s",
        ]);
        for variant in VARIANTS {
            let all: Vec<_> = runs
                .numbers("solved", &[("method", variant.word())])
                .collect();
            let solved = [("method", variant.word()), ("solved", "1")];
            let mean = |column: &str| {
                let numbers: Vec<_> = runs.numbers(column, &solved).collect();
                bench::stats::mean(&numbers).map_or_else(String::new, |mean| format!("{mean:.2}"))
            };
            table.add_row([
                variant.word().to_owned(),
                all.len().to_string(),
                format!("{}", all.iter().sum::<f64>()),
                mean("makespan_s"),
                mean("moving_s"),
                mean("computing_s"),
                mean("waiting_s"),
            ]);
        }
        text += &table::finish(&table);
        text += "Means over solved runs of all rooms, robots and modelled speeds.\n\n";
    }
    text += &findings(results);
    text
}
