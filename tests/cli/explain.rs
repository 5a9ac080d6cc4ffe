//! `explain`: constraints with their reasons, rings, proofs, bounds.

use std::process::Stdio;

use serde_json::Value;

use crate::{ends_with, says, stderr, stdout};

fn json(status: i32, arguments: &[&str]) -> Value {
    let assert = ends_with(status, &[&["explain", "--json"], arguments].concat());
    serde_json::from_str(&stdout(&assert)).unwrap()
}

/// Reason and demand of each constraint.
fn constraints(told: &Value) -> Vec<(String, String)> {
    let demand = |constraint: &Value| {
        let any_of = constraint["any_of"].as_array().unwrap().iter();
        let word = |order: &Value, key: &str| order[key].as_str().unwrap().to_owned();
        let any_of = any_of.map(|order| word(order, "before") + " < " + &word(order, "after"));
        any_of.collect::<Vec<_>>().join(" or ")
    };
    let all = told["constraints"].as_array().unwrap().iter();
    all.map(|one| (one["reason"].as_str().unwrap().to_owned(), demand(one)))
        .collect()
}

#[test]
fn each_small_room_is_explained_by_its_constraint() {
    for (name, reason, demand) in [
        ("h1", "H1", "g0 < f1"),
        ("h2", "H2", "g1 < f0"),
        ("blocked-approach", "approach", "g0 < g1"),
        ("blocked-return", "return", "f1 < f0"),
        ("joint-blockers", "H1", "g0 < f2 or g1 < f2"),
    ] {
        let told = json(0, &[name]);
        assert_eq!(
            constraints(&told),
            [(reason.to_owned(), demand.to_owned())],
            "{name}"
        );
        assert_eq!(told["infeasible"], Value::Null);
        assert_eq!(told["complete"], true);
    }
}

#[test]
fn words_say_what_json_says() {
    let text = stdout(&ends_with(0, &["explain", "h1"]));
    says(
        &text,
        &[
            "h1: 2 objects, 2 robots",
            "object 0 is grasped before object 1 is put down: where object 0 stands, no way is left for object 1 to its goal (H1)",
            "object 1 waits for 0 (H1)",
            "waiting for nobody: object 0",
            "no proof that it cannot be solved",
            "no plan is shorter than",
            "were nothing ever in the way",
        ],
    );
    let told = json(0, &["h1"]);
    let words = told["constraints"][0]["words"].as_str().unwrap();
    assert!(text.contains(words));
}

#[test]
fn a_swap_is_a_ring_of_tasks_but_not_of_events() {
    let text = stdout(&ends_with(0, &["explain", "swap"]));
    says(
        &text,
        &[
            "of tasks: 0 → 1 → 0",
            "No ring of events",
            "intermediate place",
        ],
    );
    let told = json(0, &["swap"]);
    assert_eq!(told["task_rings"], serde_json::json!([[0, 1]]));
    assert_eq!(told["event_ring"], Value::Null);
    assert!(told["bounds"]["yardstick_s"].is_number());
    let one = stdout(&ends_with(0, &["explain", "swap", "--robots", "1"]));
    says(&one, &["no plan moves each object only once"]);
}

#[test]
fn what_cannot_be_solved_is_proved_and_repaired() {
    let ring = json(4, &["infeasible-e1-cycle"]);
    says(
        ring["infeasible"]["proof"].as_str().unwrap(),
        &["ring", "0 → 1 → 0"],
    );
    assert_eq!(ring["infeasible"]["take_away"], serde_json::json!([0]));
    assert_eq!(ring["infeasible"]["deliver"], serde_json::json!([]));
    assert_eq!(ring["event_ring"], serde_json::json!(["g0", "g1"]));
    assert_eq!(ring["bounds"], Value::Null);
    let walls = stdout(&ends_with(4, &["explain", "unreachable-goal"]));
    says(
        &walls,
        &[
            "infeasible: ",
            "fewest to take away",
            "most that can be delivered",
        ],
    );
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin!("rearrange"))
        .args(["explain", "paper-68a"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(output.stderr, b"");
}

#[test]
fn bad_input_is_told_as_everywhere() {
    let unknown = stderr(&ends_with(3, &["explain", "paper-99"]));
    says(&unknown, &["paper-99", "built-in scenarios are"]);
    ends_with(2, &["explain"]);
    ends_with(2, &["explain", "e1", "--searches", "0"]);
    let few = stdout(&ends_with(
        0,
        &["explain", "joint-blockers", "--searches", "1"],
    ));
    says(&few, &["There may be more"]);
}
