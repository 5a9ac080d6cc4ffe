//! `bench`: the files it leaves, what it says before it measures, and comparing two results.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::{ends_with, rearrange, says, stderr, stdout};

/// The smallest experiment: the paper's rooms, one robot, one speed.
const SMALL: [&str; 10] = [
    "bench",
    "paper",
    "--rooms",
    "1",
    "--robots",
    "1",
    "--units-per-second",
    "10000000",
    "--compute",
    "own",
];

fn small(out: &Path) -> Vec<&str> {
    let out = ["--out", out.to_str().unwrap()];
    [&SMALL[..], &out].concat()
}

fn results(dir: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(dir.join("results.json")).unwrap()).unwrap()
}

#[test]
fn the_papers_experiment_leaves_every_row_in_json_and_csv_and_draws_it() {
    let place = tempfile::tempdir().unwrap();
    let assert = ends_with(0, &small(place.path()));
    let page = place.path().join("report.html");
    says(
        &stdout(&assert),
        &["METHOD", "no-action", page.to_str().unwrap()],
    );
    let results = results(place.path());
    assert_eq!(results["partial"], false);
    let runs = &results["tables"][0];
    // Six rooms and a seeded one, five methods.
    assert_eq!(runs["rows"].as_array().unwrap().len(), 35);
    let csv = fs::read_to_string(place.path().join("runs.csv")).unwrap();
    assert_eq!(csv.lines().count(), 36);
    assert_eq!(results["findings"].as_array().unwrap().len(), 14);
    let page = fs::read_to_string(page).unwrap();
    says(&page, &["<svg", "</html>", "paper-17a"]);
    for outside in ["<link", "<script", "src=", "url("] {
        assert!(!page.contains(outside), "the page needs {outside}");
    }

    let again = tempfile::tempdir().unwrap();
    let again_args = small(again.path());
    ends_with(0, &again_args);
    let same = ends_with(
        0,
        &[
            "bench",
            "compare",
            place.path().to_str().unwrap(),
            again.path().to_str().unwrap(),
        ],
    );
    says(&stdout(&same), &["0 better", "0 worse"]);
}

#[test]
fn a_result_that_got_worse_is_told_by_the_status() {
    let place = tempfile::tempdir().unwrap();
    let file = |name: &str, makespan: f64| {
        let path = place.path().join(name);
        let column = |name: &str, role: &str| serde_json::json!({ "name": name, "unit": "", "role": role, "about": "" });
        let text = serde_json::json!({
            "schema_version": 1, "program_version": "0", "benchmark": "paper", "command": "",
            "date": "", "machine": { "cpu": "", "cores": 1, "kernel": "", "architecture": "" },
            "conditions": {}, "partial": false, "findings": [], "notes": [],
            "tables": [{ "name": "runs", "title": "",
                "columns": [column("room", "key"), column("makespan_s", "lower")],
                "rows": [["a", makespan]] }],
        });
        fs::write(&path, text.to_string()).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let (fast, slow) = (file("fast.json", 10.0), file("slow.json", 20.0));
    let worse = ends_with(1, &["bench", "compare", &fast, &slow]);
    says(&stdout(&worse), &["worse", "makespan_s", "2.000"]);
    let better = ends_with(0, &["bench", "compare", &slow, &fast]);
    says(&stdout(&better), &["1 better"]);
    fs::write(&slow, "[]").unwrap();
    says(
        &stderr(&ends_with(3, &["bench", "compare", &fast, &slow])),
        &["slow.json"],
    );
    let missing = place.path().join("missing");
    let missing = ends_with(3, &["bench", "compare", &fast, missing.to_str().unwrap()]);
    says(&stderr(&missing), &["missing", "cannot be read"]);
}

#[test]
fn a_place_that_cannot_be_written_is_refused_before_anything_is_measured() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("file");
    fs::write(&file, "").unwrap();
    let below = file.join("below");
    let refused = ends_with(7, &["bench", "paper", "--out", below.to_str().unwrap()]);
    says(&stderr(&refused), &["file/below", "--out"]);
    assert_eq!(stdout(&refused), "");
}

#[test]
fn an_interrupted_measurement_keeps_its_rows_and_says_it_is_partial() {
    let place = tempfile::tempdir().unwrap();
    let mut child = Command::new(assert_cmd::cargo::cargo_bin!("rearrange"))
        .args([
            "bench",
            "paper",
            "--json",
            "--out",
            place.path().to_str().unwrap(),
        ])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    // The full experiment takes minutes.
    std::thread::sleep(std::time::Duration::from_secs(3));
    // SAFETY: a signal to the child of this test.
    assert_eq!(unsafe { libc::kill(child.id() as i32, libc::SIGINT) }, 0);
    let mut text = String::new();
    std::io::Read::read_to_string(child.stdout.as_mut().unwrap(), &mut text).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let printed: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(printed["partial"], true);
    assert_eq!(results(place.path()), printed);
    says(
        &fs::read_to_string(place.path().join("report.html")).unwrap(),
        &["Partial"],
    );
}

#[test]
fn options_out_of_range_name_the_allowed() {
    let wrong = ends_with(2, &["bench", "paper", "--compute", "mine"]);
    says(&stderr(&wrong), &["mine", "own, shared"]);
    ends_with(2, &["bench", "paper", "--robots", "5"]);
    let help = rearrange(&["bench", "--help"]).assert().code(0);
    says(&stdout(&help), &["speed", "paper", "compare"]);
}

#[test]
fn planning_finds_the_same_constraints_by_either_way_and_says_how_it_grows() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().to_str().unwrap();
    let arguments = [
        "bench",
        "planning",
        "--quick",
        "--objects",
        "5,10",
        "--out",
        out,
    ];
    let assert = ends_with(0, &arguments);
    says(
        &stdout(&assert),
        &["easy constraints", "floods", "path search", "report.html"],
    );
    let results = results(place.path());
    let names: Vec<_> = results["tables"]
        .as_array()
        .unwrap()
        .iter()
        .map(|table| &table["name"])
        .collect();
    assert!(names.iter().any(|name| **name == "growth"), "{names:?}");
    assert!(names.iter().any(|name| **name == "speedups"), "{names:?}");
    says(
        &stderr(&ends_with(2, &["bench", "planning", "--objects", "0"])),
        &["1", "1024"],
    );
}

#[test]
fn a_hall_is_run_to_its_end_and_says_who_was_engaged() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().to_str().unwrap();
    let arguments = [
        "bench",
        "scale",
        "--objects",
        "16",
        "--robots",
        "4",
        "--out",
        out,
    ];
    let assert = ends_with(0, &arguments);
    says(&stdout(&assert), &["ENGAGED", "solved", "4 took part"]);
    assert_eq!(
        results(place.path())["tables"][0]["rows"]
            .as_array()
            .unwrap()
            .len(),
        1
    );
    ends_with(2, &["bench", "scale", "--robots", "4"]);
}

/// The rows of a table, by the names of its columns.
fn rows(results: &Value, name: &str) -> Vec<serde_json::Map<String, Value>> {
    let tables = results["tables"].as_array().unwrap();
    let table = tables.iter().find(|table| table["name"] == name).unwrap();
    let columns: Vec<_> = table["columns"].as_array().unwrap().iter().collect();
    let rows = table["rows"].as_array().unwrap().iter();
    rows.map(|row| {
        let names = columns
            .iter()
            .map(|column| column["name"].as_str().unwrap().to_owned());
        names.zip(row.as_array().unwrap().iter().cloned()).collect()
    })
    .collect()
}

#[test]
fn rooms_are_run_with_every_method_and_the_shares_add_up() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().to_str().unwrap();
    let words = "bench solve --sets generated --rooms 4 --max-time 600 --out";
    let arguments: Vec<_> = words.split(' ').chain([out]).collect();
    let assert = ends_with(0, &arguments);
    says(
        &stdout(&assert),
        &[
            "ANYTIME",
            "NOT_GENERATED",
            "mean makespan at most 1.05",
            "report.html",
        ],
    );
    let results = results(place.path());
    assert_eq!(results["partial"], false);
    let (rooms, runs) = (rows(&results, "rooms"), rows(&results, "runs"));
    assert_eq!(rooms.len(), 4);
    let made = rooms
        .iter()
        .filter(|room| !room["bound_s"].is_null())
        .count();
    assert!(made > 0);
    assert_eq!(runs.len(), 5 * made);
    for room in rooms.iter().filter(|room| room["outcome"] == "solved") {
        let number = |name: &str| room[name].as_f64().unwrap();
        assert!(number("bound_s") <= number("makespan_s"), "{room:?}");
        let ratio = number("makespan_s") / number("bound_s");
        assert!((number("to_bound") - ratio).abs() < 1e-9);
    }
    let shares = rows(&results, "shares");
    let all = shares.iter().find(|row| row["by"] == "all").unwrap();
    for method in ["anytime", "all", "no-action"] {
        let solved = runs
            .iter()
            .filter(|run| run["method"] == method && run["solved"] == 1.0);
        let share = solved.count() as f64 / made as f64;
        assert_eq!(all[method].as_f64().unwrap(), share, "{method}");
    }
    for by in ["density", "robots", "objects", "extra moves"] {
        let of = shares.iter().filter(|row| row["by"] == by);
        let counts =
            of.map(|row| row["rooms"].as_f64().unwrap() + row["not_generated"].as_f64().unwrap());
        assert_eq!(counts.sum::<f64>(), 4.0, "{by}");
    }
    let missed = rooms
        .iter()
        .filter(|room| !room["bound_s"].is_null() && room["outcome"] != "solved");
    assert_eq!(rows(&results, "misses").len(), missed.count());
    for file in [
        "shares.csv",
        "ratios.csv",
        "misses.csv",
        "slower.csv",
        "report.html",
    ] {
        assert!(place.path().join(file).exists(), "{file}");
    }
}

#[test]
fn a_run_that_takes_too_long_is_given_up_and_told_by_name() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().to_str().unwrap();
    let words = "bench solve --sets generated --rooms 1 --wall-cap 0.001 --out";
    let arguments: Vec<_> = words.split(' ').chain([out]).collect();
    ends_with(0, &arguments);
    let results = results(place.path());
    let misses = rows(&results, "misses");
    assert_eq!(misses.len(), 1);
    assert_eq!(misses[0]["outcome"], "given-up");
    says(
        misses[0]["generate"].as_str().unwrap(),
        &["--seed 1 ", "--extra-moves"],
    );
    assert_eq!(results["findings"][0]["held"], false);
    let sets = stderr(&ends_with(2, &["bench", "solve", "--sets", "mine"]));
    says(&sets, &["mine", "paper, seeded, generated"]);
}
