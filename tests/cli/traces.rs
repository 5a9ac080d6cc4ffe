//! `check`: what it says of good, bad, foreign and damaged traces.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use scene::{Scene, Settings};
use shm_types::{BodyKind, MotionBatch, MotionRecord, Outcome, Point, zeroed};
use tempfile::TempDir;
use trace::{Ending, SceneRecord, Writer};

use crate::{ends_with, json, says, stderr, stdout};

/// A trace of a whole run.
fn recorded() -> (TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run.mcap");
    let file = path.to_str().unwrap();
    ends_with(0, &["run", "e1", "--driver", "in-process", "--trace", file]);
    (directory, path)
}

/// A trace in which robot 0 drives through the edge of the workspace.
fn planted(path: &Path) {
    let text = scene::builtin("e1").unwrap().text;
    let scene: Scene = scene::parse(text, "e1").unwrap();
    let record = SceneRecord::new(&scene, &Settings::default(), 0);
    let mut writer = Writer::new(File::create(path).unwrap(), &record, 0).unwrap();
    let home = scene.homes[0];
    let mut batch: Box<MotionBatch> = zeroed();
    batch.tick = 1;
    batch.time_ns = 10_000_000_000;
    batch.motion_count = 1;
    batch.motions[0] = MotionRecord {
        start_ns: 0,
        end_ns: 10_000_000_000,
        body: BodyKind::Robot.code(),
        id: 0,
        from: Point::new(home.x, home.y),
        to: Point::new(home.x - 1.0, home.y),
    };
    writer.batch(&batch).unwrap();
    let ending = Ending {
        outcome: Outcome::Interrupted.into(),
        reason: None,
        makespan_ns: 10_000_000_000,
        options: serde_json::Value::Null,
    };
    writer.finish(ending).unwrap();
}

#[test]
fn a_good_trace_is_clean() {
    let (_directory, path) = recorded();
    let path = path.to_str().unwrap();
    says(
        &stdout(&ends_with(0, &["check", path])),
        &["0 violations", "swept tests"],
    );
    let report = json(&ends_with(0, &["check", path, "--json"]));
    assert_eq!(report["complete"], true);
    assert_eq!(report["violations"].as_array().unwrap().len(), 0);
}

#[test]
fn a_violation_is_printed_and_is_a_status_of_its_own() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("planted.mcap");
    planted(&path);
    let assert = ends_with(6, &["check", path.to_str().unwrap()]);
    says(
        &stdout(&assert),
        &[
            "1 violation in 10",
            "at 2.500 s",
            "robot 0",
            "edge of the workspace",
        ],
    );
    let report = json(&ends_with(6, &["check", path.to_str().unwrap(), "--json"]));
    assert_eq!(report["violations"][0]["kind"], "collision");
}

#[test]
fn a_trace_cut_short_is_said_to_be() {
    let (_directory, path) = recorded();
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let text = stderr(&ends_with(3, &["check", path.to_str().unwrap()]));
    says(&text, &["run.mcap"]);
    assert!(
        text.contains("cut short") || text.contains("first whole chunk"),
        "{text}"
    );
}

#[test]
fn what_is_no_trace_is_said_to_be_none() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("foreign.mcap");
    for bytes in [&b""[..], b"hello", &[0; 4096]] {
        fs::write(&path, bytes).unwrap();
        let text = stderr(&ends_with(3, &["check", path.to_str().unwrap()]));
        says(&text, &["foreign.mcap", "no trace"]);
    }
    says(
        &stderr(&ends_with(3, &["check", "/nowhere/x.mcap"])),
        &["/nowhere/x.mcap", "No such file"],
    );
}
