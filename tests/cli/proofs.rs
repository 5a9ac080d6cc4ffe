//! Rooms that have no solution: what `validate` and `run` say, and with which status.

use std::path::PathBuf;

use tempfile::TempDir;

use crate::{ends_with, json, says, stderr};

/// A corridor all around a pillar, the robot below. Each object fills it and is grasped from above:
/// who wants to get there has to pass the other one.
const AROUND: &str = "\
name = \"around\"
[robot]
shape = { box = [0.5, 0.5] }
speed = 0.5
[object]
shape = { box = [0.4, 0.4] }
grasp = [0.0, 0.45]
[workspace]
bounds = [0.0, 0.0, 3.0, 3.0]
walls = [{ box = [0.5, 0.5, 2.5, 2.5] }]
[[robots]]
home = [1.5, 0.25]
[[objects]]
start = [0.25, 1.5]
goal = [0.25, 1.2]
";
const OTHER: &str = "\
[[objects]]
start = [2.75, 1.5]
goal = [2.75, 1.2]
";

fn room(text: &str) -> (TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("room.toml");
    std::fs::write(&path, text).unwrap();
    (directory, path)
}

#[test]
fn a_ring_that_no_overlap_shows_is_told_by_validate_and_by_run() {
    let (_directory, path) = room(&[AROUND, OTHER].concat());
    let path = path.to_str().unwrap();
    let ring = "in a ring, each of these has to come before the next";
    let text = stderr(&ends_with(4, &["validate", path]));
    says(&text, &["around cannot be solved", ring]);
    for method in ["anytime", "no-action", "restricted"] {
        let arguments = ["run", path, "--method", method, "--driver", "in-process"];
        let result = json(&ends_with(4, &[&arguments[..], &["--json"]].concat()));
        assert_eq!(result["outcome"], "infeasible", "{method}");
        says(result["reason"].as_str().unwrap(), &[ring]);
        let moved = result["makespan_s"].as_f64().unwrap();
        assert!(
            moved < 1.0,
            "{method} ends when it is proved, not after 60 s: {moved}"
        );
    }
}

#[test]
fn the_same_room_with_a_way_round_is_solved() {
    let (_directory, path) = room(AROUND);
    let path = path.to_str().unwrap();
    ends_with(0, &["validate", path]);
    ends_with(0, &["run", path, "--driver", "in-process"]);
}
