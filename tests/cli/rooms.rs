//! `scenarios`, `schema`, `validate`, `generate`.

use std::fs;

use serde_json::Value;

use crate::{ends_with, json, says, stderr, stdout};

#[test]
fn every_built_in_scenario_is_listed_on_a_line_of_its_own() {
    let text = stdout(&ends_with(0, &["scenarios"]));
    let names: Vec<_> = text
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    let shipped = scene::BUILTIN.iter().copied().chain(scene::warehouses());
    let builtin: Vec<_> = shipped.map(|builtin| builtin.name).collect();
    assert_eq!(names, builtin);
    for line in text.lines() {
        assert!(line.len() > 30, "no description: {line}");
    }
}

#[test]
fn built_in_scenarios_are_written_and_read_back() {
    let directory = tempfile::tempdir().unwrap();
    let rooms = directory.path().join("new/rooms");
    ends_with(0, &["scenarios", "--write", rooms.to_str().unwrap()]);
    let shipped = scene::BUILTIN.len() + scene::warehouses().len();
    assert_eq!(fs::read_dir(&rooms).unwrap().count(), shipped);
    let file = rooms.join("e1.toml");
    assert_eq!(
        fs::read_to_string(&file).unwrap(),
        stdout(&ends_with(0, &["scenarios", "e1"]))
    );
    says(
        &stdout(&ends_with(0, &["validate", file.to_str().unwrap()])),
        &["e1: ok"],
    );
}

#[test]
fn an_unknown_built_in_scenario_names_the_known_ones() {
    says(
        &stderr(&ends_with(2, &["scenarios", "e9"])),
        &["e9", "e1, "],
    );
}

#[test]
fn a_directory_that_cannot_be_made_is_a_system_failure() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let path = file.path().join("rooms");
    let path = path.to_str().unwrap();
    says(
        &stderr(&ends_with(7, &["scenarios", "--write", path])),
        &[path],
    );
}

#[test]
fn the_schema_names_the_keys_of_a_scenario() {
    let schema = json(&ends_with(0, &["schema"]));
    for key in [
        "name",
        "robot",
        "object",
        "workspace",
        "robots",
        "objects",
        "before",
    ] {
        assert!(schema["properties"][key].is_object(), "{key}");
    }
}

#[test]
fn validate_sums_up_what_it_has_understood() {
    let text = stdout(&ends_with(0, &["validate", "e1", "--robots", "1"]));
    says(
        &text,
        &[
            "e1: ok",
            "1 robot, 2 objects",
            "pitch 0.05 m",
            "8-connected",
            "E1 0 before 1",
        ],
    );
    let text = stdout(&ends_with(0, &["validate", "h1"]));
    says(&text, &["easy constraints at the start: none"]);
}

#[test]
fn validate_tells_what_is_proved_infeasible() {
    let cases = [
        ("infeasible-e1-cycle", "grasping"),
        ("infeasible-e4-cycle", "releasing"),
        ("unreachable-goal", "carried to its goal"),
    ];
    for (name, reason) in cases {
        let assert = ends_with(4, &["validate", name]);
        says(&stderr(&assert), &[name, "cannot be solved", reason]);
        assert_eq!(stdout(&assert), "");
    }
}

#[test]
fn the_same_seed_generates_the_same_room_and_another_one_another() {
    let room = |seed: &str| {
        let options = [
            "generate",
            "--seed",
            seed,
            "--objects",
            "3",
            "--robots",
            "2",
        ];
        stdout(&ends_with(0, &options))
    };
    assert_eq!(room("5"), room("5"));
    assert_ne!(room("5"), room("6"));
}

#[test]
fn a_generated_room_is_written_validated_run_and_its_seed_reported() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("room.toml");
    let file = file.to_str().unwrap();
    let options = [
        "--seed",
        "3",
        "--objects",
        "3",
        "--robots",
        "2",
        "--walls",
        "1",
        "-o",
        file,
    ];
    let assert = ends_with(0, &[&["generate"], &options[..]].concat());
    says(&stderr(&assert), &[file, "solvable"]);
    assert_eq!(stdout(&assert), "");
    ends_with(0, &["validate", file]);
    let result = json(&ends_with(
        0,
        &["run", file, "--driver", "in-process", "--json"],
    ));
    assert_eq!(result["seed"], Value::from(3));
    assert_eq!(result["outcome"], "solved");
}

#[test]
fn a_room_that_cannot_be_had_says_what_to_change() {
    let options = ["--area", "1", "--objects", "50"];
    let assert = ends_with(5, &[&["generate"], &options[..]].concat());
    says(&stderr(&assert), &["more area"]);
}
