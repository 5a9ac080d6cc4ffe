//! `rearrange list`: the runs of this user that are alive, or can be resumed.

use node::options::Clock;

use crate::cli::ListArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::{output, table};

/// Prints a line for each run; nothing at all if there is none.
pub(crate) fn main(args: &ListArgs) -> Outcome {
    let runs = node::domain::list()
        .map_err(|error| Failure::system(format!("the runs cannot be listed: {error}")))?;
    if args.json {
        output::print_json(&runs)?;
        return Ok(Exit::Success);
    }
    if runs.is_empty() {
        output::complain("no run is alive");
        return Ok(Exit::Success);
    }
    let mut table = table::plain();
    table.set_header([
        "ID",
        "NAME",
        "STATE",
        "SCENARIO",
        "ROBOTS",
        "CLOCK",
        "PID",
        "DIRECTORY",
    ]);
    for run in &runs {
        table.add_row([
            run.id.clone(),
            run.name.clone(),
            if run.live {
                "live"
            } else {
                "dead, can be resumed"
            }
            .to_owned(),
            run.scenario.clone(),
            run.robots.to_string(),
            clock(run.clock).to_owned(),
            if run.live {
                run.supervisor_pid.to_string()
            } else {
                "-".to_owned()
            },
            run.directory.display().to_string(),
        ]);
    }
    output::print(&table::finish(&table))?;
    Ok(Exit::Success)
}

const fn clock(clock: Clock) -> &'static str {
    match clock {
        Clock::Lockstep => "lockstep",
        Clock::Real { .. } => "real",
    }
}
