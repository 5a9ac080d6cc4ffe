//! One file per command.
//!
//! Responsible for: which file does which command, and the end of a failed one.
//! Not responsible for: parsing (`cli`).

mod bench;
mod chaos;
mod check;
mod doctor;
mod explain;
mod gc;
mod generate;
mod list;
mod resume;
mod roles;
mod run;
mod scenarios;
mod schema;
mod simulate;
mod still;
mod tell;
mod validate;
mod view;

use std::io::IsTerminal;
use std::process::ExitCode;

use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::fmt;
use tracing_subscriber::prelude::*;

use crate::cli::{Cli, Command};
use crate::exit::Outcome;
use crate::output;

/// Does what the command line asks for.
pub(crate) fn execute(cli: Cli) -> ExitCode {
    log_to_stderr();
    output::unfold_reports();
    match dispatch(cli.command) {
        Ok(exit) => exit.into(),
        Err(failure) => {
            failure.print();
            failure.exit.into()
        }
    }
}

fn dispatch(command: Command) -> Outcome {
    match command {
        Command::Run(args) => run::main(&args),
        Command::Check(args) => check::main(&args),
        Command::View(args) => view::main(&args),
        Command::Explain(args) => explain::main(&args),
        Command::Generate(args) => generate::main(&args),
        Command::Schema => schema::main(),
        Command::Validate(args) => validate::main(&args),
        Command::Scenarios(args) => scenarios::main(&args),
        Command::List(args) => list::main(&args),
        Command::Resume(args) => resume::main(&args),
        Command::Gc(args) => gc::main(&args),
        Command::Doctor(args) => doctor::main(&args),
        Command::Chaos(args) => chaos::main(&args),
        Command::Tell(args) => tell::main(&args),
        Command::Simulate(args) => simulate::main(&args),
        Command::Bench(args) => bench::main(&args.workload),
        Command::World(args) => roles::main(node::Role::World, &args),
        Command::Planner(args) => roles::main(node::Role::Planner, &args),
        Command::Robot(args) => roles::main(node::Role::Robot(args.index), &args),
        Command::Recorder(args) => roles::main(node::Role::Recorder, &args),
        Command::Reference(args) => roles::reference(&args.role),
    }
}

/// What `RUST_LOG` asks for (`info`, or `node=debug,warn`), else warnings.
fn log_to_stderr() {
    let asked = std::env::var("RUST_LOG").ok();
    let filter = asked.and_then(|asked| asked.parse::<Targets>().ok());
    let filter = filter.unwrap_or_else(|| Targets::new().with_default(LevelFilter::WARN));
    let colour = std::io::stderr().is_terminal() && !output::no_colour();
    let lines = fmt::layer().with_writer(std::io::stderr).with_ansi(colour);
    tracing_subscriber::registry()
        .with(lines)
        .with(filter)
        .init();
}
