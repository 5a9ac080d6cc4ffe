//! `rearrange bench planning`: how planning grows with objects and lattice points.
//!
//! Responsible for: options, and what is printed.
//! Not responsible for: the measurement (crate `bench`).

use bench::planning::{self, Options};
use bench::report::short;
use bench::results::{Results, Table};

use super::{Destination, Watch, command_line};
use crate::cli::PlanningArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::table;

/// Objects, unless asked for otherwise: as far as a minute goes.
const QUICK: [usize; 6] = [5, 10, 20, 50, 100, 200];
/// Objects of a complete measurement.
const FULL: [usize; 8] = [5, 10, 20, 50, 100, 200, 500, 1000];

/// Measures every step of planning.
pub(crate) fn main(args: &PlanningArgs) -> Outcome {
    let destination = Destination::create("planning", &args.output)?;
    let objects = match (&args.objects[..], args.quick) {
        ([], true) => QUICK.to_vec(),
        ([], false) => FULL.to_vec(),
        (objects, _) => objects.to_vec(),
    };
    let options = Options {
        objects,
        seed: args.seed,
        quick: args.quick,
    };
    let mut watch = Watch::start()?;
    let (results, figures) = planning::run(&options, &command_line(), &mut watch)
        .map_err(|error| Failure::new(Exit::System, error))?;
    drop(watch);
    destination.finish(&results, &figures, &[], &text(&results))
}

/// Growth exponents, and what was claimed.
fn text(results: &Results) -> String {
    let mut text = String::new();
    if let Some(growth) = results.table("growth") {
        text += &rows(growth);
    }
    for finding in &results.findings {
        let held = match finding.held {
            Some(true) => "held",
            Some(false) => "did not hold",
            None => "not known",
        };
        text += &format!("\n{held}: {}\n      {}", finding.claim, finding.evidence);
    }
    text + "\n"
}

fn rows(growth: &Table) -> String {
    let mut table = table::plain();
    table.set_header(
        growth
            .columns
            .iter()
            .map(|column| column.name.to_uppercase()),
    );
    for row in &growth.rows {
        table.add_row(
            row.iter()
                .map(|value| value.number().map_or_else(|| value.to_string(), short)),
        );
    }
    table::finish(&table)
}
