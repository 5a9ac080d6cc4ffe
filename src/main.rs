//! The `rearrange` binary: parses the command line, does it, ends with a status.

mod changes;
mod cli;
mod commands;
mod drivers;
mod exit;
mod output;
mod progress;
mod result;
mod run_options;
mod scenario;
mod table;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    commands::execute(cli::Cli::parse())
}
