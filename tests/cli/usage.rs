//! Command lines that are wrong: status 2, and what is allowed.

use crate::{ends_with, says, stderr, stdout};

#[test]
fn unknown_words_name_the_allowed_ones() {
    let cases = [
        (
            "--method",
            "fast",
            "grasping-and-restricted, restricted, all, no-action, anytime",
        ),
        ("--hard", "maybe", "cached, literal"),
        ("--performance", "x", "transit-and-transfer, transfer"),
        ("--compute", "cloud", "own, shared"),
        ("--driver", "threads", "processes, in-process"),
        ("--clock", "atomic", "lockstep, real"),
        ("--wait", "sleep", "spin, hybrid, block"),
    ];
    for (option, word, allowed) in cases {
        let assert = ends_with(2, &["run", "e1", option, word]);
        says(&stderr(&assert), &[option, word, allowed]);
    }
}

#[test]
fn numbers_out_of_range_name_the_range() {
    let cases = [
        ("--robots", "0", "1..=128"),
        ("--robots", "129", "1..=128"),
        ("--rate", "0", "1..=100000"),
        ("--tick", "0", "from 0.01 to 1000"),
        ("--tick", "nan", "from 0.01 to 1000"),
        ("--speed", "-1", "from 0.001 to 1000"),
        ("--speed", "inf", "from 0.001 to 1000"),
        ("--units-per-second", "0", "1..="),
        ("--time-limit", "0", "from 0.001"),
        ("--monitors", "65", "0..=64"),
        ("--name", "a/b", "1 to 32 letters"),
    ];
    for (option, number, range) in cases {
        let assert = ends_with(2, &["run", "e1", &format!("{option}={number}")]);
        says(&stderr(&assert), &[option, range]);
    }
    let assert = ends_with(2, &["generate", "--objects", "1025"]);
    says(&stderr(&assert), &["--objects", "1..=1024"]);
    let assert = ends_with(2, &["generate", "--area", "0.5"]);
    says(&stderr(&assert), &["--area", "from 1 to 10000"]);
}

#[test]
fn options_that_contradict_each_other_say_which() {
    let cases: [(&[&str], &str); 8] = [
        (&["--rate", "100"], "--clock real"),
        (&["--speed", "2"], "--clock real"),
        (&["--clock", "real", "--tick", "1"], "leave --tick out"),
        (
            &["--clock", "real", "--rate", "1", "--speed", "2"],
            "the most is 1000 ms",
        ),
        (
            &["--driver", "in-process", "--clock", "real"],
            "no wall clock",
        ),
        (&["--driver", "in-process", "--pin"], "--pin"),
        (&["--driver", "in-process", "--name", "x"], "--name"),
        (&["--driver", "in-process", "--wait", "spin"], "--wait spin"),
    ];
    for (options, part) in cases {
        let assert = ends_with(2, &[&["run", "e1"], options].concat());
        says(&stderr(&assert), &[part]);
        assert_eq!(stdout(&assert), "");
    }
}

#[test]
fn more_robots_than_homes_names_the_most() {
    for command in ["run", "validate"] {
        let assert = ends_with(2, &[command, "e1", "--robots", "3"]);
        says(&stderr(&assert), &["--robots 3", "e1", "1 to 2"]);
    }
}

#[test]
fn unknown_commands_and_options_are_refused() {
    ends_with(2, &["rn"]);
    ends_with(2, &["run", "e1", "--fast"]);
    ends_with(2, &[]);
    ends_with(2, &["check"]);
    ends_with(2, &["world"]);
}

#[test]
fn every_command_explains_itself() {
    let commands = [
        "run",
        "check",
        "generate",
        "schema",
        "validate",
        "scenarios",
        "list",
        "bench",
        "world",
        "planner",
        "robot",
        "recorder",
    ];
    for command in commands {
        says(
            &stdout(&ends_with(0, &[command, "--help"])),
            &["Usage: rearrange", command],
        );
    }
    says(
        &stdout(&ends_with(0, &["run", "--help"])),
        &["Exit status", "130", "Examples"],
    );
    says(
        &stdout(&ends_with(0, &["--version"])),
        &[env!("CARGO_PKG_VERSION")],
    );
}
