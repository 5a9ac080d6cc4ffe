//! `bench latency`: what it leaves, refuses and keeps. Which times come out is nobody's promise.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::{ends_with, rearrange, says, stderr, stdout};

/// Rows of a table of the result file, each as its cells under their columns' names.
fn rows(dir: &Path, table: &str) -> Vec<serde_json::Map<String, Value>> {
    let text = fs::read_to_string(dir.join("results.json")).unwrap();
    let results: Value = serde_json::from_str(&text).unwrap();
    let tables = results["tables"].as_array().unwrap();
    let table = tables.iter().find(|one| one["name"] == table).unwrap();
    let columns = table["columns"].as_array().unwrap();
    let names = columns
        .iter()
        .map(|column| column["name"].as_str().unwrap());
    let names: Vec<_> = names.map(str::to_owned).collect();
    let rows = table["rows"].as_array().unwrap().iter();
    rows.map(|row| {
        let cells = row.as_array().unwrap().iter().cloned();
        names.iter().cloned().zip(cells).collect()
    })
    .collect()
}

/// Arguments of a measurement into `dir`, short but for its repeats.
fn short(dir: &Path, repeats: u32) -> Vec<String> {
    let words = "bench latency --robots 1,16 --objects 10 --wait spin,hybrid --quick --repeats";
    let mut words: Vec<_> = words.split(' ').map(str::to_owned).collect();
    words.push(repeats.to_string());
    words.extend(["--out".to_owned(), dir.display().to_string()]);
    words
}

#[test]
fn everything_asked_for_is_a_row_measured_or_refused() {
    let place = tempfile::Builder::new().prefix("rr").tempdir().unwrap();
    let dir = place.path().join("out");
    let arguments = short(&dir, 1);
    let arguments: Vec<_> = arguments.iter().map(String::as_str).collect();
    let mut command = rearrange(&arguments);
    let done = command
        .env("XDG_RUNTIME_DIR", place.path())
        .assert()
        .code(0);
    says(&stderr(&done), &["this will take about", "Ctrl-C"]);
    says(&stdout(&done), &["snapshot_age", "report.html"]);
    for file in ["latency.csv", "runs.csv", "histograms.hlog", "report.html"] {
        assert!(dir.join(file).metadata().unwrap().len() > 0, "{file}");
    }
    let runs = rows(&dir, "runs");
    let status = |robots: f64, wait: &str| {
        let about = |row: &&serde_json::Map<String, Value>| {
            row["robots"] == robots && row["wait"] == wait && row["pinned"] == "free"
        };
        runs.iter().find(about).unwrap().clone()
    };
    assert_eq!(status(1.0, "hybrid")["status"], "ok");
    let cores = std::thread::available_parallelism().unwrap().get();
    if cores < 19 {
        let spin = status(16.0, "spin");
        assert_eq!(spin["status"], "refused");
        says(spin["reason"].as_str().unwrap(), &["19 processes", "cores"]);
    }
    let hybrid = status(16.0, "hybrid");
    assert_eq!(hybrid["status"], "ok", "{hybrid:?}");
    let times = rows(&dir, "latency");
    for (system, name) in [
        ("rearrange", "snapshot_age"),
        ("rearrange", "snapshot_lateness"),
        ("rearrange", "tick_lateness"),
        ("rearrange", "robot_step"),
        ("rearrange", "hard_round_trip"),
        (node::reference::NAME, "snapshot_age"),
        (node::reference::NAME, "snapshot_lateness"),
        ("unix datagram", "snapshot_age"),
    ] {
        let found = times
            .iter()
            .any(|row| row["system"] == system && row["name"] == name);
        assert!(found, "{name} of {system}");
    }
}

#[test]
fn an_interruption_keeps_the_rows_so_far() {
    let place = tempfile::Builder::new().prefix("rr").tempdir().unwrap();
    let dir = place.path().join("out");
    let child = Command::new(assert_cmd::cargo::cargo_bin!("rearrange"))
        .args(short(&dir, 1_000))
        .env("XDG_RUNTIME_DIR", place.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    let mut child = child.unwrap();
    std::thread::sleep(Duration::from_secs(3));
    // SAFETY: takes no pointers; the child is not reaped yet, so the id is its own.
    unsafe { libc::kill(child.id().cast_signed(), libc::SIGINT) };
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let text = fs::read_to_string(dir.join("results.json")).unwrap();
    let results: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(results["partial"], true);
    assert!(!rows(&dir, "runs").is_empty());
    assert!(
        fs::read_to_string(dir.join("report.html"))
            .unwrap()
            .contains("Partial")
    );
    let left = fs::read_dir(place.path().join("rearrange")).unwrap();
    assert_eq!(
        left.filter(|one| one.as_ref().unwrap().path().is_dir())
            .count(),
        0
    );
}

#[test]
fn a_place_that_cannot_be_written_is_refused_before_anything_is_measured() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("file");
    fs::write(&file, "").unwrap();
    let below = file.join("x");
    let done = ends_with(7, &["bench", "latency", "--out", below.to_str().unwrap()]);
    says(&stderr(&done), &["--out"]);
}
