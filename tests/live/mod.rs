//! Runs of the binary in a place of their own: starting one, waiting for what it does, its end.

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// No run may take longer, whatever the machine does.
const WATCHDOG: Duration = Duration::from_secs(240);
/// Sleep between two looks.
const PERIOD: Duration = Duration::from_millis(2);

/// The binary, whose runs live in `place`.
pub(crate) fn binary(place: &Path) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("rearrange"));
    command
        .env("XDG_RUNTIME_DIR", place)
        .env_remove("RUST_LOG")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

pub(crate) fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    let started = Instant::now();
    while !done() {
        assert!(started.elapsed() < WATCHDOG, "{what} never happened");
        std::thread::sleep(PERIOD);
    }
}

/// Waits for the end; the status, the result, and what went to stderr.
pub(crate) fn finish(mut child: Child) -> (i32, Value, String) {
    let started = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if started.elapsed() > WATCHDOG {
            child.kill().unwrap();
            panic!("the run has hung: {:?}", child.wait_with_output());
        }
        std::thread::sleep(PERIOD);
    }
    let Output {
        status,
        stdout,
        stderr,
    } = child.wait_with_output().unwrap();
    let result = serde_json::from_slice(&stdout).unwrap_or(Value::Null);
    let stderr = String::from_utf8_lossy(&stderr).into_owned();
    (status.code().unwrap_or(-1), result, stderr)
}
