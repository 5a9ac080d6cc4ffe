//! `rearrange bench solve`: which rooms are solved, and how near the optimum.
//!
//! Responsible for: the plan from the command line, what is printed.
//! Not responsible for: the runs and what follows from them (crate `bench`).

use bench::report::short;
use bench::results::{Results, Table, Value};
use bench::solve::cells::{self, CELLS};
use bench::solve::rooms::Set;
use bench::solve::summary::{MISSES, RATIOS, SHARES, SLOWER};
use bench::solve::{self, Plan, figures, summary};

use super::{Destination, Watch, command_line};
use crate::cli::SolveArgs;
use crate::exit::{Failure, Outcome};
use crate::table;

/// Generated rooms, seeded ones, those of unit cells, and halls of these.
type Counts = (u32, u32, u32, u32);
/// Those of a complete measurement.
const FULL: Counts = (1_000, 100, 200, 5);
/// And of a quick one: some seeded rooms take a minute each.
const QUICK: Counts = (24, 0, 10, 1);
/// Exceptions that are printed; the files have all.
const MOST_PRINTED: usize = 40;

/// Runs the rooms.
pub(crate) fn main(args: &SolveArgs) -> Outcome {
    let destination = Destination::create("solve", &args.output)?;
    let mut watch = Watch::start()?;
    let mut results = Results::new("solve", &command_line());
    let plan = plan(args);
    let solved = solve::measure(&plan, &mut results, &mut watch);
    if !results.partial {
        cells::measure(&plan, &mut results, &mut watch);
    }
    drop(watch);
    let (tables, findings) = summary::of(&solved);
    let figures = figures::all(&solved, &tables).map_err(Failure::system)?;
    results.tables.splice(0..0, tables);
    results.findings.splice(0..0, findings);
    destination.finish(&results, &figures, &[], &text(&results))
}

fn plan(args: &SolveArgs) -> Plan {
    let (rooms, seeded, unit_cells, halls) = if args.quick { QUICK } else { FULL };
    Plan {
        sets: if args.sets.is_empty() {
            Set::ALL.into()
        } else {
            args.sets.clone()
        },
        rooms: args.rooms.unwrap_or(rooms) as usize,
        seeded: args.seeded.unwrap_or(seeded) as usize,
        seed: args.seed,
        max_time_s: args.max_time,
        wall_cap_s: args.wall_cap,
        unknown_cap_s: args.unknown_cap,
        unit_cells: args.unit_cells.unwrap_or(unit_cells) as usize,
        halls: args.halls.unwrap_or(halls) as usize,
        threads: args.threads as usize,
    }
}

/// Shares and ratios, the exceptions, the targets.
fn text(results: &Results) -> String {
    let mut text = String::new();
    for name in [SHARES, RATIOS, MISSES, SLOWER, CELLS] {
        let Some(rows) = results.table(name).filter(|table| !table.rows.is_empty()) else {
            continue;
        };
        text += &format!("{}\n{}\n", rows.title, printed(rows));
        if rows.rows.len() > MOST_PRINTED && [MISSES, SLOWER, CELLS].contains(&name) {
            text += &format!("all {} are in {name}.csv\n", rows.rows.len());
        }
        text.push('\n');
    }
    for finding in &results.findings {
        let word = match finding.held {
            Some(true) => "reached",
            Some(false) => "missed",
            None => "not measured",
        };
        text += &format!("{word}: {}\n    {}\n", finding.claim, finding.evidence);
    }
    text
}

fn printed(rows: &Table) -> String {
    let mut table = table::plain();
    table.set_header(rows.columns.iter().map(|column| column.name.to_uppercase()));
    let most = if [MISSES, SLOWER, CELLS].contains(&rows.name.as_str()) {
        MOST_PRINTED
    } else {
        usize::MAX
    };
    for row in rows.rows.iter().take(most) {
        table.add_row(row.iter().map(cell));
    }
    table::finish(&table)
}

fn cell(value: &Value) -> String {
    value.number().map_or_else(|| value.to_string(), short)
}
