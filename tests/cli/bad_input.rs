//! Scenarios that are wrong: status 3, with file, line, key and reason, and nothing started.

use std::path::PathBuf;

use tempfile::TempDir;

use crate::{ends_with, says, stderr, stdout};

/// A scenario that is right. Each test spoils one line of it.
const GOOD: &str = "\
name = \"good\"
[robot]
shape = { box = [0.5, 0.5] }
speed = 0.5
[object]
shape = { box = [0.4, 0.4] }
[workspace]
bounds = [0.0, 0.0, 6.0, 4.0]
walls = [{ box = [5.0, 3.0, 5.5, 3.5] }]
[[robots]]
home = [0.5, 0.5]
[[objects]]
start = [2.0, 2.0]
goal = [4.0, 1.0]
[[objects]]
start = [3.0, 3.0]
goal = [4.0, 2.0]
";

fn file(text: &str) -> (TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("room.toml");
    std::fs::write(&path, text).unwrap();
    (directory, path)
}

/// What `validate` and `run` say of `GOOD` with its line `line` replaced; they say the same.
fn complaint(line: usize, by: &str) -> String {
    let mut lines: Vec<_> = GOOD.lines().collect();
    lines[line - 1] = by;
    let (_directory, path) = file(&lines.join("\n"));
    let path = path.to_str().unwrap();
    let assert = ends_with(3, &["validate", path]);
    assert_eq!(stdout(&assert), "");
    let text = stderr(&assert);
    let run = ends_with(3, &["run", path, "--json"]);
    assert_eq!(stdout(&run), "");
    assert_eq!(stderr(&run), text);
    text
}

#[test]
fn the_unspoilt_scenario_is_right() {
    let (_directory, path) = file(GOOD);
    says(
        &stdout(&ends_with(0, &["validate", path.to_str().unwrap()])),
        &["good: ok"],
    );
}

#[test]
fn each_mistake_has_its_line_key_and_reason() {
    let cases: [(usize, &str, &[&str]); 16] = [
        (1, "name = [", &["room.toml:3:", "missing comma"]),
        (
            1,
            "nmae = \"good\"",
            &["room.toml:1:", "unknown key", "nmae"],
        ),
        (
            4,
            "speed = \"fast\"",
            &["room.toml:4:", "robot.speed", "fast"],
        ),
        (
            4,
            "speed = 0.0",
            &["room.toml:4:", "robot.speed", "have to move"],
        ),
        (4, "speed = inf", &["room.toml:4:", "robot.speed", "finite"]),
        (
            3,
            "shape = { box = [0.0, 0.5] }",
            &["room.toml:3:", "robot.shape"],
        ),
        (
            3,
            "shape = { box = [nan, 0.5] }",
            &["room.toml:3:", "robot.shape", "finite"],
        ),
        (
            8,
            "bounds = [0.0, 0.0, -6.0, 4.0]",
            &["room.toml:8:", "workspace.bounds"],
        ),
        (
            11,
            "home = [0.1, 0.5]",
            &["room.toml:11:", "robots[0].home"],
        ),
        (
            11,
            "home = [2.0, 2.0]",
            &["room.toml:11:", "robots[0].home", "objects[0].start"],
        ),
        (
            13,
            "start = [nan, 2.0]",
            &["room.toml:13:", "objects[0].start", "finite"],
        ),
        (
            14,
            "goal = [5.2, 3.2]",
            &["room.toml:14:", "objects[0].goal", "wall"],
        ),
        (
            16,
            "start = [2.0, 2.1]",
            &["room.toml:16:", "objects[1].start", "objects[0].start"],
        ),
        (
            17,
            "goal = [4.1, 1.1]",
            &["room.toml:17:", "objects[1].goal", "objects[0].goal"],
        ),
        (
            2,
            "resolution = 1e-9\n[robot]",
            &["room.toml:2:", "resolution"],
        ),
        (
            2,
            "resolution = 1e9\n[robot]",
            &["room.toml:2:", "resolution"],
        ),
    ];
    for (line, by, parts) in cases {
        says(&complaint(line, by), parts);
    }
}

#[test]
fn all_mistakes_are_told_at_once_each_on_a_whole_line() {
    let text = GOOD
        .replace("[2.0, 2.0]", "[5.2, 3.2]")
        .replace("[4.0, 1.0]", "[9.0, 1.0]");
    let (_directory, path) = file(&text);
    let text = stderr(&ends_with(3, &["validate", path.to_str().unwrap()]));
    says(&text, &["2 problems"]);
    let line = |key: &str| text.lines().filter(|line| line.contains(key)).count();
    assert_eq!(line("room.toml:13: objects[0].start: "), 1, "{text}");
    assert_eq!(line("room.toml:14: objects[0].goal: "), 1, "{text}");
}

#[test]
fn an_order_that_contradicts_itself_names_the_cycle() {
    let order = "[[before]]\nfirst = \"0.finish\"\nthen = \"1.grasp\"\n\
                 [[before]]\nfirst = \"1.finish\"\nthen = \"0.start\"\n";
    let (_directory, path) = file(&(GOOD.to_owned() + order));
    let cycle =
        "0.finish before 1.grasp before 1.finish before 0.start before 0.grasp before 0.finish";
    for command in ["validate", "run"] {
        let told = stderr(&ends_with(3, &[command, path.to_str().unwrap()]));
        says(
            &told,
            &["room.toml:19:", "the order contradicts itself", cycle],
        );
    }
}

#[test]
fn too_many_objects_name_the_capacity() {
    let object = "[[objects]]\nstart = [1.0, 1.0]\n";
    let (_directory, path) = file(&(GOOD.to_owned() + &object.repeat(1_024)));
    says(
        &stderr(&ends_with(3, &["validate", path.to_str().unwrap()])),
        &["1026", "1024"],
    );
}

#[test]
fn a_scenario_that_is_not_there_is_said_to_be() {
    let text = stderr(&ends_with(3, &["run", "paper-99"]));
    says(
        &text,
        &["paper-99", "No such file", "built-in scenarios are", "e1"],
    );
    let text = stderr(&ends_with(3, &["validate", "/nowhere/room.toml"]));
    says(&text, &["/nowhere/room.toml", "No such file"]);
    assert!(!text.contains("built-in"), "{text}");
    says(
        &stderr(&ends_with(3, &["validate", "/"])),
        &["error: ", "/"],
    );
}

#[test]
fn a_file_that_is_no_text_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("room.toml");
    std::fs::write(&path, [0xff, 0xfe, 0x00]).unwrap();
    says(
        &stderr(&ends_with(3, &["validate", path.to_str().unwrap()])),
        &["UTF-8"],
    );
}
