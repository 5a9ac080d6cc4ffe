//! `explain --at`: why robots stood still.

use serde_json::Value;
use tempfile::TempDir;

use crate::{ends_with, says, stderr, stdout};

/// A trace of a run in process.
fn trace(scenario: &str, options: &[&str]) -> (TempDir, String) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run.mcap");
    let path = path.to_str().unwrap().to_owned();
    let arguments = ["run", scenario, "--driver", "in-process", "--trace", &path];
    ends_with(0, &[&arguments[..], options].concat());
    (directory, path)
}

fn at(trace: &str, time: f64) -> Vec<Value> {
    let time = time.to_string();
    let assert = ends_with(0, &["explain", "--at", &time, trace, "--json"]);
    let told: Value = serde_json::from_str(&stdout(&assert)).unwrap();
    told["robots"].as_array().unwrap().clone()
}

/// Robot and cause at every half second of a run.
fn causes(trace: &str) -> Vec<(f64, u64, String, Value)> {
    let mut found = Vec::new();
    for half in 0.. {
        let time = f64::from(half) * 0.5;
        let check = ["explain", "--at", &time.to_string(), trace].map(str::to_owned);
        let ran = std::process::Command::new(assert_cmd::cargo::cargo_bin!("rearrange"))
            .args(check)
            .output()
            .unwrap();
        if !ran.status.success() {
            return found;
        }
        for robot in at(trace, time) {
            let cause = robot["cause"].as_str().unwrap().to_owned();
            found.push((time, robot["robot"].as_u64().unwrap(), cause, robot));
        }
    }
    found
}

#[test]
fn robots_that_follow_a_schedule_name_whose_action_comes_first() {
    let (_directory, trace) = trace("blocked-return", &["--method", "anytime"]);
    let causes = causes(&trace);
    let (time, robot, _, told) = (causes.iter())
        .find(|(_, _, cause, _)| cause == "order")
        .expect("one of the two lets the other one go first");
    assert_eq!(told["waits_for"], 1 - robot);
    assert!(told["action"].as_u64().unwrap() > 0);
    let words = stdout(&ends_with(
        0,
        &["explain", "--at", &time.to_string(), &trace],
    ));
    let comes_first = format!("waits for robot {}, whose action", 1 - robot);
    says(&words, &["blocked-return at", "stands still", &comes_first]);
    // The other one is on its way then, or grips.
    let other = &at(&trace, *time)[1 - *robot as usize];
    assert_ne!(other["cause"], "order", "{other}");
    assert!(causes.iter().any(|(_, _, cause, _)| cause == "moves"));
}

#[test]
fn the_papers_robots_are_in_each_others_way() {
    let (_directory, trace) = trace("paper-17a", &["--method", "grasping-and-restricted"]);
    let causes = causes(&trace);
    let is_there = |wanted: &str| causes.iter().any(|(_, _, cause, _)| cause == wanted);
    assert!(is_there("moves") && is_there("no_task"));
    assert!(is_there("robot") || is_there("object"), "somebody waits");
    assert!(!is_there("order"), "they follow no schedule");
}

#[test]
fn bad_times_and_traces_are_refused() {
    let (_directory, trace) = trace("e1", &[]);
    let late = stderr(&ends_with(2, &["explain", "--at", "1000", &trace]));
    says(&late, &["after the end of the trace"]);
    ends_with(2, &["explain", "--at", "-1", &trace]);
    ends_with(2, &["explain", "--at", "1", &trace, "--robots", "1"]);
    ends_with(3, &["explain", "--at", "1", "nowhere.mcap"]);
}
