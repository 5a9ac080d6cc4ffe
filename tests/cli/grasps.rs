//! Objects that can be held in several ways.

use std::path::PathBuf;

use tempfile::TempDir;

use crate::{ends_with, json, says, stderr};

/// A corridor as wide as the robot, closed on the right, with an object in it that has to go left
/// to a place below the corridor's mouth. Held from the left it can be brought out; then there is no
/// room to its left to put it down from, only above it.
fn room(grasps: &str) -> (TempDir, PathBuf) {
    let text = format!(
        "name = \"corner\"\n[robot]\nshape = {{ box = [0.5, 0.5] }}\nspeed = 0.5\n[object]\nshape = {{ \
         box = [0.5, 0.5] }}\n{grasps}\n[workspace]\nbounds = [0.0, 0.0, 4.0, 2.5]\nwalls = [{{ box = \
         [2.0, 0.0, 4.0, 1.0] }}, {{ box = [2.0, 1.5, 4.0, 2.5] }}, {{ box = [0.0, 0.0, 1.0, 0.5] }}, \
         {{ box = [1.5, 0.0, 2.0, 0.5] }}]\n[[robots]]\nhome = [0.25, 2.25]\n[[robots]]\nhome = \
         [0.75, 2.25]\n[[objects]]\nstart = [3.25, 1.25]\ngoal = [1.25, 0.25]\n"
    );
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("room.toml");
    std::fs::write(&path, text).unwrap();
    (directory, path)
}

const LEFT: &str = "[-0.5, 0.0]";
const ABOVE: &str = "[0.0, 0.5]";

#[test]
fn neither_grasp_alone_will_do() {
    for grasp in [LEFT, ABOVE] {
        let (_directory, path) = room(&format!("grasp = {grasp}"));
        ends_with(4, &["validate", path.to_str().unwrap()]);
    }
}

#[test]
fn an_object_is_put_down_and_grasped_otherwise_where_no_grasp_will_do_all_the_way() {
    let directory = tempfile::tempdir().unwrap();
    let (_room, path) = room(&format!("grasps = [{LEFT}, {ABOVE}]"));
    let path = path.to_str().unwrap();
    ends_with(0, &["validate", path]);
    let trace = directory.path().join("run.mcap");
    let trace = trace.to_str().unwrap();
    for robots in ["1", "2"] {
        let arguments = ["run", path, "--robots", robots, "--driver", "in-process"];
        let result = json(&ends_with(
            0,
            &[&arguments[..], &["--trace", trace, "--json"]].concat(),
        ));
        assert_eq!(result["outcome"], "solved");
        assert_eq!(result["checker"]["violations"], 0);
        let [bound_s, makespan_s] =
            ["lower_bound_s", "makespan_s"].map(|name| result[name].as_f64().unwrap());
        assert!(0.0 < bound_s && bound_s <= makespan_s, "{bound_s}");
        ends_with(0, &["check", trace]);
        ends_with(
            0,
            &[
                "view",
                trace,
                "-o",
                directory.path().join("x.html").to_str().unwrap(),
            ],
        );
    }
}

#[test]
fn the_papers_methods_know_the_first_grasp_only() {
    let (_room, path) = room(&format!("grasps = [{LEFT}, {ABOVE}]"));
    let arguments = ["run", path.to_str().unwrap(), "--driver", "in-process"];
    ends_with(5, &[&arguments[..], &["--method", "restricted"]].concat());
}

#[test]
fn grasps_that_make_no_sense_are_refused() {
    for (grasps, words) in [
        (
            "grasps = []",
            "is empty, but robots have to hold it somehow",
        ),
        (
            "grasp = [0.0, 0.5]\ngrasps = [[0.0, 0.5]]",
            "stands beside grasp",
        ),
        ("grasps = [[0.0, 0.5], [0.0, 0.5]]", "is there twice"),
        (
            "grasps = [[0.0, 0.5, 1.0]]",
            "takes 2 numbers, but 3 are given",
        ),
    ] {
        let (_room, path) = room(grasps);
        let text = stderr(&ends_with(3, &["validate", path.to_str().unwrap()]));
        says(&text, &[words]);
    }
}
