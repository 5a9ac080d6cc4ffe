//! `tell` to live runs, and the file that tells a run in its stead. What robots make of it is tested
//! elsewhere.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

use crate::{ends_with, json, rearrange, says, stderr, stdout};

const ROOMS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/rooms/two-rooms.toml");
const CHANGES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/rooms/changes.toml");

/// A directory of runs of its own, so that these runs see nobody else's.
fn place() -> TempDir {
    tempfile::Builder::new().prefix("rr").tempdir().unwrap()
}

fn tell(place: &Path, words: &str) -> assert_cmd::Command {
    let arguments: Vec<&str> = std::iter::once("tell").chain(words.split(' ')).collect();
    let mut command = rearrange(&arguments);
    command.env("XDG_RUNTIME_DIR", place);
    command
}

/// A run under way; killed when dropped.
struct Run(Option<Child>);

impl Run {
    /// Starts it, slow enough to be told of something, and waits until it is live.
    fn start(place: &Path, more: &[&str]) -> Self {
        let child = Command::new(assert_cmd::cargo::cargo_bin!("rearrange"))
            .args(["run", ROOMS, "--name", "rooms", "--json"])
            .args(["--delay", "robot-0=6"])
            .args(more)
            .env("XDG_RUNTIME_DIR", place)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let live = || {
            let mut list = rearrange(&["list", "--json"]);
            json(&list.env("XDG_RUNTIME_DIR", place).assert().code(0))
        };
        while live().as_array().unwrap().is_empty() {
            std::thread::sleep(Duration::from_millis(20));
        }
        Self(Some(child))
    }

    fn finish(mut self) -> Value {
        let output = self.0.take().unwrap().wait_with_output().unwrap();
        serde_json::from_slice(&output.stdout).unwrap()
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        if let Some(mut child) = self.0.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

#[test]
fn a_live_run_is_told_and_what_cannot_be_changes_nothing() {
    let place = place();
    for method in ["anytime", "grasping-and-restricted"] {
        let run = Run::start(place.path(), &["--method", method]);
        let refused = [
            ("--run nobody goal 0 1 1", "live are: rooms"),
            (
                "goal 9 1 1",
                "there is no object 9: the run has 2, counted from 0",
            ),
            ("goal 0 3.1 2", "the goal lies in wall 1"),
            (
                // By then a robot may stand there, too.
                "add-object 5.2 2.9",
                "object 2 cannot stand there: ",
            ),
            ("close 5 1 6 2", "objects[0].goal: the goal lies in wall 3"),
            ("open 1 1", "0 walls cover the point 1, 1"),
            ("add-robot 3.1 2", "robots[2].home: the home lies in wall 1"),
            ("add-robot 0.6 0.6", "are blocked by one another"),
            (
                "lose 7",
                "there is no robot 7: the run has 2, counted from 0",
            ),
            ("back 1", "robot 1 takes part already"),
        ];
        for (words, why) in refused {
            let failed = tell(place.path(), words).assert().code(3);
            says(&stderr(&failed), &[why]);
        }
        let done = [
            (
                "goal 0 5.0 2.5 1 none",
                "run rooms: the goal is changed, from tick ",
            ),
            (
                "--run rooms lose 1",
                "robot 1 takes part no more, from tick ",
            ),
            (
                "--run latest back 1",
                "robot 1 takes part again, from tick ",
            ),
            (
                "add-object 2.0 3.5 --goal 2.4 1.0 --like 1",
                "there is one more object",
            ),
        ];
        for (words, what) in done {
            let told = tell(place.path(), words).assert().code(0);
            says(&stdout(&told), &[what]);
        }
        let result = run.finish();
        assert_eq!(result["outcome"], "solved", "{result}");
        assert_eq!(result["checker"]["violations"], 0);
        assert_eq!(result["checker"]["complete"], true);
        assert_eq!(result["counts"]["scene_changes"], 2);
        assert_eq!(result["lower_bound_s"], Value::Null, "of another scene");
    }
}

#[test]
fn a_robot_joins_a_live_run() {
    let place = place();
    for more in [
        &["--more-robots", "1"][..],
        &[
            "--more-robots",
            "1",
            "--method",
            "grasping-and-restricted",
            "--pin",
        ],
        &["--more-robots", "1", "--wait", "block"],
        &[
            "--more-robots",
            "1",
            "--clock",
            "real",
            "--rate",
            "200",
            "--speed",
            "3",
        ],
    ] {
        let run = Run::start(place.path(), more);
        let told = tell(place.path(), "add-robot 2.0 0.4").assert().code(0);
        says(&stdout(&told), &["there is one more robot, from tick "]);
        let refused = tell(place.path(), "add-robot 4.2 0.4").assert().code(3);
        says(
            &stderr(&refused),
            &["the run has room for 3 robots", "--more-robots"],
        );
        let result = run.finish();
        assert_eq!(result["outcome"], "solved", "{result}");
        assert_eq!(result["checker"]["violations"], 0);
        assert_eq!(result["checker"]["complete"], true);
        assert_eq!(result["robots"], 3);
        let robots = result["times"]["per_robot"].as_array().unwrap();
        assert_eq!(robots.len(), 3);
        for robot in robots {
            let times = robot.as_object().unwrap().values();
            let sum: f64 = times.map(|time| time.as_f64().unwrap()).sum();
            assert!((sum - result["makespan_s"].as_f64().unwrap()).abs() < 1e-6);
        }
        let roles = result["roles"].as_array().unwrap();
        let added = roles.iter().find(|role| role["role"] == "robot-2").unwrap();
        assert!(added["pid"].as_u64().unwrap() > 0);
        let answered = added["ticks_answered"].as_u64().unwrap();
        assert!(answered > 0 && answered < result["ticks"].as_u64().unwrap());
    }
}

#[test]
fn in_real_time_a_run_is_told_too() {
    let place = place();
    let real = ["--clock", "real", "--rate", "200", "--speed", "3"];
    let run = Run::start(place.path(), &real);
    let told = tell(place.path(), "close 3.0 2.4 3.2 3.6").assert().code(0);
    says(&stdout(&told), &["there is a wall"]);
    let result = run.finish();
    assert_eq!(result["outcome"], "solved", "{result}");
    assert_eq!(result["checker"]["violations"], 0);
    assert_eq!(result["counts"]["scene_changes"], 1);
}

#[test]
fn who_is_not_there_cannot_be_told() {
    let place = place();
    let nobody = tell(place.path(), "goal 0 1 1").assert().code(3);
    says(&stderr(&nobody), &["no run is live"]);
    for (words, why) in [
        ("goal 0 1", "lacks the y"),
        ("goal zero 1 1", "no number of an object"),
        ("move 0 1", "2 values required"),
        ("close 0 0 1", "4 values required"),
        ("explode 1", "unrecognized subcommand"),
    ] {
        let wrong = tell(place.path(), words).assert().code(2);
        says(&stderr(&wrong), &[why]);
    }
}

#[test]
fn a_file_tells_a_run_and_what_cannot_be_is_noted() {
    let arguments = [
        "run",
        ROOMS,
        "--changes",
        CHANGES,
        "--driver",
        "in-process",
        "--json",
    ];
    let result = json(&ends_with(0, &arguments));
    assert_eq!(result["counts"]["scene_changes"], 3);
    let notes = result["notes"].to_string();
    says(&notes, &["tick 1300", "robot 0 takes part already"]);
    let none = [
        "run",
        ROOMS,
        "--changes",
        "/nowhere.toml",
        "--driver",
        "in-process",
    ];
    says(
        &stderr(&ends_with(3, &none)),
        &["/nowhere.toml cannot be read"],
    );
}
