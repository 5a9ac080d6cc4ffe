//! `rearrange bench scale`: many robots and many objects in one thread.
//!
//! Responsible for: sizes from the command line, what is printed.
//! Not responsible for: the runs (crate `bench`).

use bench::report::short;
use bench::results::{Results, Value};
use bench::scale::{self, Options};

use super::{Destination, Watch, command_line};
use crate::cli::ScaleArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::table;

/// Halls of a complete measurement: objects and robots.
const FULL: [(usize, usize); 4] = [(10, 1), (100, 10), (300, 30), (1_000, 100)];
/// Halls of a quick one.
const QUICK: [(usize, usize); 3] = [(10, 1), (50, 5), (100, 10)];

/// Runs the halls.
pub(crate) fn main(args: &ScaleArgs) -> Outcome {
    let destination = Destination::create("scale", &args.output)?;
    let sizes = match (args.objects, args.quick) {
        (Some(objects), _) => vec![(objects as usize, args.robots as usize)],
        (None, true) => QUICK.to_vec(),
        (None, false) => FULL.to_vec(),
    };
    let options = Options {
        sizes,
        seed: args.seed,
    };
    let mut watch = Watch::start()?;
    let results = scale::run(&options, &command_line(), &mut watch)
        .map_err(|problems| Failure::new(Exit::Usage, problems))?;
    drop(watch);
    destination.finish(&results, &[], &[], &text(&results))
}

fn text(results: &Results) -> String {
    let mut text = String::new();
    for rows in &results.tables {
        let mut table = table::plain();
        table.set_header(rows.columns.iter().map(|column| column.name.to_uppercase()));
        for row in &rows.rows {
            table.add_row(row.iter().map(cell));
        }
        text += &table::finish(&table);
    }
    for finding in &results.findings {
        let word = if finding.held == Some(true) {
            "held"
        } else {
            "did not hold"
        };
        text += &format!("\n{word}: {}\n    {}\n", finding.claim, finding.evidence);
    }
    text
}

fn cell(value: &Value) -> String {
    value.number().map_or_else(|| value.to_string(), short)
}
