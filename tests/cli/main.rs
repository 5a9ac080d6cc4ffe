//! The command line as a user meets it: every exit status, every message, every output.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod bad_input;
mod benchmarks;
mod explain;
mod latency;
mod processes;
mod proofs;
mod rooms;
mod runs;
mod streams;
mod tell;
mod traces;
mod usage;
mod views;

use assert_cmd::Command;
use assert_cmd::assert::Assert;
use serde_json::Value;

/// The program with these arguments, in an empty directory of runs of its own.
fn rearrange(arguments: &[&str]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("rearrange"));
    command.args(arguments).env_remove("RUST_LOG");
    command
}

/// Runs it to its end and expects this status.
fn ends_with(status: i32, arguments: &[&str]) -> Assert {
    rearrange(arguments).assert().code(status)
}

fn stdout(assert: &Assert) -> String {
    String::from_utf8(assert.get_output().stdout.clone()).unwrap()
}

fn stderr(assert: &Assert) -> String {
    String::from_utf8(assert.get_output().stderr.clone()).unwrap()
}

/// What it printed on stdout, as JSON.
fn json(assert: &Assert) -> Value {
    serde_json::from_str(&stdout(assert)).unwrap()
}

/// Expects every one of `parts` in `text`.
fn says(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "{part:?} is not in:\n{text}");
    }
}
