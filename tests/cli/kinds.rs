//! Interchangeable objects: any of a kind on any of the kind's goals.

use std::path::PathBuf;

use serde_json::Value;
use tempfile::TempDir;

use crate::{ends_with, json, says, stderr};

const HEAD: &str = "\
name = \"kinds\"
[robot]
shape = { box = [0.5, 0.5] }
speed = 0.5
[object]
shape = { box = [0.5, 0.5] }
";

fn room(rest: &str) -> (TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("room.toml");
    std::fs::write(&path, [HEAD, rest].concat()).unwrap();
    (directory, path)
}

fn run(status: i32, path: &str, method: &str) -> Value {
    let arguments = ["run", path, "--driver", "in-process", "--method", method];
    let result = json(&ends_with(status, &[&arguments[..], &["--json"]].concat()));
    assert_eq!(result["checker"]["violations"], 0, "{method}");
    result
}

/// Each states the goal that is next to the other one.
const CROSSED: &str = "\
grasp = [0.0, -0.5]
[workspace]
bounds = [0.0, 0.0, 10.0, 3.0]
[[robots]]
home = [5.25, 0.25]
[[objects]]
start = [1.25, 2.25]
goal = [8.25, 2.25]
[[objects]]
start = [8.75, 1.25]
goal = [1.25, 1.25]
";

#[test]
fn goals_go_to_the_objects_that_are_near_them() {
    let (_directory, path) = room(CROSSED);
    let path = path.to_str().unwrap();
    let of_a_kind = CROSSED.replace("[[objects]]\n", "[[objects]]\nkind = \"pallet\"\n");
    let (_other, alike) = room(&of_a_kind);
    let alike = alike.to_str().unwrap();
    for method in ["anytime", "restricted"] {
        let makespan = |path: &str| run(0, path, method)["makespan_s"].as_f64().unwrap();
        let (fixed, free) = (makespan(path), makespan(alike));
        // 12 m of carrying less, 6 m more to the second object, at half a metre a second.
        assert!(
            free < fixed - 10.0,
            "{method}: {free} s, {fixed} s as stated"
        );
    }
    // What holds of one assignment only is no bound.
    let bound_s = |path: &str| run(0, path, "anytime")["lower_bound_s"].as_f64().unwrap();
    assert!(0.0 < bound_s(alike) && bound_s(alike) < bound_s(path) - 5.0);
}

/// A corridor. Nobody can grasp what stands in the middle of it; left of it the object that is
/// nearest to the goal, right of it the goal, another object, the robot.
const CUT_OFF: &str = "\
grasp = [0.5, 0.0]
[workspace]
bounds = [0.0, 0.0, 8.0, 0.5]
[[robots]]
home = [7.5, 0.25]
[[objects]]
kind = \"pallet\"
start = [2.0, 0.25]
goal = [4.0, 0.25]
[[objects]]
kind = \"pallet\"
start = [6.5, 0.25]
[[objects]]
start = [3.0, 0.25]
grasp = [0.0, 0.5]
";

#[test]
fn where_the_nearest_cannot_be_brought_another_one_is() {
    let (_directory, path) = room(CUT_OFF);
    let path = path.to_str().unwrap();
    ends_with(0, &["validate", path]);
    assert_eq!(run(0, path, "anytime")["outcome"], "solved");
    // These keep to the assignment that the scene begins with.
    assert_eq!(run(5, path, "no-action")["outcome"], "stuck");
    let (_directory, path) = room(&CUT_OFF.replace("kind = \"pallet\"\n", ""));
    ends_with(
        4,
        &["run", path.to_str().unwrap(), "--driver", "in-process"],
    );
}

#[test]
fn objects_of_a_kind_are_alike_and_have_no_order_of_their_own() {
    for (from, to, words) in [
        (
            "start = [6.5, 0.25]\n",
            "start = [6.5, 0.25]\nshape = { box = [0.4, 0.4] }\n",
            "whose shape or grasps are others",
        ),
        (
            "[[robots]]\n",
            "[[before]]\nfirst = \"0.finish\"\nthen = \"1.finish\"\n[[robots]]\n",
            "is one of a kind",
        ),
        ("kind = \"pallet\"", "kind = \"\"", "has 1 to 128 bytes"),
    ] {
        let (_directory, path) = room(&CUT_OFF.replacen(from, to, 1));
        let text = stderr(&ends_with(3, &["validate", path.to_str().unwrap()]));
        says(&text, &[words]);
    }
}
