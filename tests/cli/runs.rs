//! `run` in process: outcomes, statuses, the result.

use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::{ends_with, json, says, stderr, stdout};

const IN_PROCESS: [&str; 3] = ["--driver", "in-process", "--json"];

fn run(status: i32, arguments: &[&str]) -> Value {
    json(&ends_with(
        status,
        &[&["run"], arguments, &IN_PROCESS[..]].concat(),
    ))
}

/// Every field of the result, with what it must be.
fn is_complete(result: &Value) {
    let numbers = [
        "schema_version",
        "robots",
        "objects",
        "makespan_s",
        "execution_s",
        "planning_s",
        "waiting_s",
        "lower_bound_s",
        "yardstick_s",
        "ticks",
        "wall_s",
    ];
    for key in numbers {
        assert!(result[key].is_number(), "{key}: {}", result[key]);
    }
    let texts = [
        "program_version",
        "scenario",
        "scenario_hash",
        "method",
        "driver",
        "outcome",
        "state_hash",
    ];
    for key in texts {
        assert!(result[key].is_string(), "{key}: {}", result[key]);
    }
    let counts = [
        "polygon_tests",
        "path_plans",
        "cells_expanded",
        "easy_constraints",
        "hard_constraints",
        "task_failures",
        "selections",
        "selection_conflicts",
        "grants_refused",
        "deadline_misses",
        "restarts",
        "lost_commands",
    ];
    for key in counts {
        assert!(result["counts"][key].is_u64(), "counts.{key}");
    }
    for key in ["seed", "reason"] {
        assert!(result.as_object().unwrap().contains_key(key), "{key}");
    }
    assert!(result["oversubscribed"].is_boolean());
    assert!(result["options"]["settings"]["units_per_second"].is_u64());
    assert!(result["machine"]["cpu"].is_string());
    assert_eq!(result["checker"]["violations"], 0);
    assert!(result["checker"]["swept_tests"].is_u64());
    let ticks = result["ticks"].as_u64().unwrap();
    let robots = result["robots"].as_u64().unwrap();
    let objects = result["objects"].as_u64().unwrap();
    for (name, each) in [
        ("robots", robots * (robots - 1) / 2),
        ("object", robots),
        ("wall", robots),
        ("lost", objects),
        ("motion", robots),
        ("grants", robots * (robots - 1) / 2),
    ] {
        let checks = &result["invariants"][name];
        assert_eq!(checks["checks"], ticks * each, "{name}");
        assert_eq!(checks["violations"], 0, "{name}");
        assert!(
            checks["anew"].as_u64() <= checks["checks"].as_u64(),
            "{name}"
        );
    }
    assert!(result["invariants"]["swept_tests"].is_u64());
    for key in ["count", "p50_ns", "p99_ns", "p999_ns", "max_ns"] {
        assert!(
            result["latency"]["tick"][key].is_u64(),
            "latency.tick.{key}"
        );
    }
    for role in result["roles"].as_array().unwrap() {
        assert!(role["role"].is_string() && role["pid"].is_u64());
        assert!(role["ticks_answered"].is_u64() && role["cpu_s"].is_number());
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

#[test]
fn a_solved_run_has_every_field_and_its_times_sum_up() {
    let result = run(0, &["h1", "--method", "grasping-and-restricted"]);
    is_complete(&result);
    assert_eq!(result["outcome"], "solved");
    assert_eq!(result["reason"], Value::Null);
    assert_eq!(result["driver"], "in-process");
    assert!(number(&result["counts"]["hard_constraints"]) >= 1.0);
    assert!(number(&result["lower_bound_s"]) <= number(&result["yardstick_s"]));
    assert!(number(&result["yardstick_s"]) <= number(&result["makespan_s"]));
    for robot in result["times"]["per_robot"].as_array().unwrap() {
        let sum: f64 = robot.as_object().unwrap().values().map(number).sum();
        assert!(
            (sum - number(&result["makespan_s"])).abs() < 1e-9,
            "{robot}"
        );
    }
    let parts = ["execution_s", "planning_s", "waiting_s", "idle_s"];
    let sum: f64 = parts.iter().map(|part| number(&result[part])).sum();
    assert!((sum - number(&result["makespan_s"])).abs() < 1e-9);
}

#[test]
fn the_same_run_has_the_same_state_at_every_tick() {
    let directory = tempfile::tempdir().unwrap();
    let hashes = |name: &str, options: &[&str]| {
        let path = directory.path().join(name);
        let result = run(
            0,
            &[&["e1", "--hashes", path.to_str().unwrap()], options].concat(),
        );
        let text = fs::read_to_string(path).unwrap();
        assert_eq!(text.lines().last().unwrap(), result["state_hash"]);
        assert_eq!(
            text.lines().count() as u64,
            result["ticks"].as_u64().unwrap()
        );
        text
    };
    let first = hashes("first", &[]);
    assert_eq!(hashes("again", &[]), first);
    assert_ne!(hashes("other", &["--units-per-second", "100000"]), first);
}

#[test]
fn options_in_force_are_reported() {
    let options = [
        "e1",
        "--method",
        "all",
        "--hard",
        "literal",
        "--performance",
        "transfer",
        "--compute",
        "shared",
        "--units-per-second",
        "1000000",
        "--tick",
        "20",
        "--time-limit",
        "600",
        "--robots",
        "1",
    ];
    let result = run(0, &options);
    let settings = &result["options"]["settings"];
    assert_eq!(settings["method"], "all");
    assert_eq!(settings["hard"], "literal");
    assert_eq!(settings["performance"], "transfer");
    assert_eq!(settings["compute"], "shared");
    assert_eq!(settings["units_per_second"], 1_000_000);
    assert_eq!(settings["tick_ns"], 20_000_000);
    assert_eq!(settings["time_limit_ns"], 600_000_000_000_u64);
    assert_eq!(result["robots"], 1);
    assert_eq!(result["method"], "all");
}

#[test]
fn an_infeasible_room_is_proved_so_before_anything_runs() {
    let result = run(4, &["infeasible-e1-cycle"]);
    assert_eq!(result["outcome"], "infeasible");
    says(result["reason"].as_str().unwrap(), &["ring", "0 → 1 → 0"]);
    assert_eq!(result["makespan_s"], Value::Null);
    assert_eq!(result["ticks"], 0);
}

#[test]
fn a_swap_is_stuck_and_says_why() {
    let result = run(5, &["swap", "--method", "grasping-and-restricted"]);
    assert_eq!(result["outcome"], "stuck");
    says(result["reason"].as_str().unwrap(), &["cycle"]);
}

#[test]
fn unless_told_otherwise_the_planner_plans_ahead() {
    // Two objects each stand at the other's goal: no order of single moves does it.
    let result = run(0, &["swap"]);
    assert_eq!(result["method"], "anytime");
    assert_eq!(result["options"]["settings"]["method"], "anytime");
    assert_eq!(result["outcome"], "solved");
}

#[test]
fn world_time_runs_out() {
    let result = run(5, &["e1", "--time-limit", "1"]);
    assert_eq!(result["outcome"], "timeout");
    assert!((number(&result["makespan_s"]) - 1.0).abs() < 0.02);
}

#[test]
fn the_table_tells_outcome_makespan_and_checker() {
    let assert = ends_with(0, &["run", "e1", "--driver", "in-process"]);
    says(
        &stdout(&assert),
        &[
            "solved",
            "e1: 2 objects, 2 robots",
            "makespan",
            "0 violations",
        ],
    );
    assert_eq!(stderr(&assert), "");
}

#[test]
fn files_that_cannot_be_written_are_system_failures() {
    for option in ["--trace", "--hashes"] {
        let assert = ends_with(
            7,
            &["run", "e1", "--driver", "in-process", option, "/nowhere/x"],
        );
        says(&stderr(&assert), &["/nowhere/x", "No such file"]);
    }
}

#[test]
fn an_interrupted_run_ends_with_its_partial_result() {
    let directory = tempfile::tempdir().unwrap();
    let trace = directory.path().join("run.mcap");
    // A hundredth of a millisecond a tick: long enough to be interrupted on any machine.
    let child = Command::new(assert_cmd::cargo::cargo_bin!("rearrange"))
        .args([
            "run",
            "e1",
            "--tick",
            "0.01",
            "--trace",
            trace.to_str().unwrap(),
        ])
        .args(IN_PROCESS)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    while !trace.exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    let pid = i32::try_from(child.id()).unwrap();
    // SAFETY: a signal to a child that has not been waited for.
    assert_eq!(unsafe { libc::kill(pid, libc::SIGINT) }, 0);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(result["outcome"], "interrupted");
    assert_eq!(result["checker"]["violations"], 0);
    ends_with(0, &["check", trace.to_str().unwrap()]);
}
