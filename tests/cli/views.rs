//! `view`: what it makes of whole, short, foreign and damaged traces, and where it writes.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use crate::{ends_with, says, stderr, stdout};

/// A trace of a whole run, in a directory of its own.
fn recorded() -> (TempDir, String) {
    recorded_in("h1")
}

fn recorded_in(room: &str) -> (TempDir, String) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run.mcap");
    let file = path.to_str().unwrap().to_owned();
    // Constraints and waits are those of robots that select.
    let run = ["run", room, "--method", "grasping-and-restricted"];
    let driver = ["--driver", "in-process", "--trace", &file];
    ends_with(0, &[run, driver].concat());
    (directory, file)
}

/// A name in a directory.
fn beside(directory: &TempDir, name: &str) -> String {
    directory.path().join(name).to_str().unwrap().to_owned()
}

/// What a page knows of the run.
fn data(page: &str) -> Value {
    let (_, rest) = page.split_once("id=\"data\">").unwrap();
    let (data, _) = rest.split_once("</script>").unwrap();
    serde_json::from_str(data).unwrap()
}

#[test]
fn a_page_holds_the_run_and_asks_for_nothing_else() {
    let (directory, trace) = recorded();
    let file = beside(&directory, "replay.html");
    let assert = ends_with(0, &["view", &trace, "-o", &file]);
    says(&stderr(&assert), &["wrote", "replay.html"]);
    assert_eq!(stdout(&assert), "");
    let page = fs::read_to_string(&file).unwrap();
    assert!(!page.contains("{{"), "a mark of the template is left");
    for outside in ["http://", "https://", "src=", "@import", "url("] {
        assert!(!page.contains(outside), "{outside:?} is in the page");
    }
    let data = data(&page);
    assert_eq!(data["end"]["outcome"], "solved");
    assert_eq!(data["at_s"], 0.0);
    // h1: object 0 stands in the only doorway, which only a path search can find out.
    let hard = |found: &Value| found[0] == 0 && found[1] == 1 && found[2] == "H1";
    assert!(data["constraints"].as_array().unwrap().iter().any(hard));
    let grants = &data["robots"][0]["grants"];
    let granted = |entry: &Value| !entry[1].as_array().unwrap().is_empty();
    assert!(grants.as_array().unwrap().iter().any(granted), "no grants");
    let again = stdout(&ends_with(0, &["view", &trace, "-o", "-", "--at", "1.5"]));
    assert_eq!(
        again.replace("\"at_s\":1.5", "\"at_s\":0.0"),
        page,
        "stdout gets the same page, opened later"
    );
}

#[test]
fn a_still_has_every_robot_and_object() {
    let (_directory, trace) = recorded();
    let end = stdout(&ends_with(0, &["view", &trace, "--svg", "-"]));
    let start = stdout(&ends_with(0, &["view", &trace, "--svg", "-", "--at", "0"]));
    for still in [&end, &start] {
        assert!(still.starts_with("<svg"), "{}", &still[..40]);
        says(
            still,
            &[
                "viewBox",
                "class=\"wall\"",
                "class=\"goal\"",
                "class=\"start\"",
                "</svg>",
            ],
        );
        assert!(!still.contains("href"), "something from elsewhere");
    }
    // In the legend there is one more of each way, and nobody has gone any at the start.
    let ways = |still: &str| {
        let count = |class: &str| still.matches(&format!("class=\"{class}\"")).count();
        (count("way"), count("carried"))
    };
    assert_eq!(ways(&start), (1, 1));
    let (robots, objects) = ways(&end);
    assert!(
        robots > 1 && objects == 3,
        "{robots} and {objects} ways at the end"
    );
}

#[test]
fn both_may_be_asked_for_and_one_must_be() {
    let (directory, trace) = recorded();
    let (page, still) = (beside(&directory, "a.html"), beside(&directory, "a.svg"));
    ends_with(0, &["view", &trace, "-o", &page, "--svg", &still]);
    assert!(Path::new(&page).exists() && Path::new(&still).exists());
    says(
        &stderr(&ends_with(2, &["view", &trace])),
        &["--output", "--svg"],
    );
    let same = stderr(&ends_with(
        2,
        &["view", &trace, "-o", &page, "--svg", &page],
    ));
    says(&same, &["the same"]);
}

#[test]
fn a_time_after_the_end_is_refused_and_leaves_no_file() {
    let (directory, trace) = recorded();
    let file = beside(&directory, "late.svg");
    let text = stderr(&ends_with(
        2,
        &["view", &trace, "--svg", &file, "--at", "1e6"],
    ));
    says(&text, &["--at", "after the end"]);
    assert!(!Path::new(&file).exists());
}

#[test]
fn a_trace_cut_short_is_shown_as_far_as_it_goes_and_said_to_be() {
    let (directory, trace) = recorded();
    let bytes = fs::read(&trace).unwrap();
    let mut length = bytes.len();
    // The end record goes with the last bytes; how many, the index behind it decides.
    let page = loop {
        length -= bytes.len() / 20;
        fs::write(&trace, &bytes[..length]).unwrap();
        let assert = ends_with(0, &["view", &trace, "-o", "-"]);
        let page = stdout(&assert);
        if data(&page)["end"].is_null() {
            says(&stderr(&assert), &["run.mcap is cut short"]);
            break page;
        }
    };
    says(&page, &["The trace was cut short"]);
    let still = beside(&directory, "short.svg");
    ends_with(0, &["view", &trace, "--svg", &still]);
    says(&fs::read_to_string(&still).unwrap(), &["trace cut short"]);
}

#[test]
fn what_is_no_trace_is_said_to_be_none_and_leaves_no_file() {
    let directory = tempfile::tempdir().unwrap();
    let (foreign, page) = (beside(&directory, "x.mcap"), beside(&directory, "x.html"));
    fs::write(&foreign, "hello").unwrap();
    let text = stderr(&ends_with(3, &["view", &foreign, "-o", &page]));
    says(&text, &["x.mcap", "no trace"]);
    assert!(!Path::new(&page).exists());
    let text = stderr(&ends_with(3, &["view", "/nowhere/x.mcap", "-o", &page]));
    says(&text, &["/nowhere/x.mcap", "No such file"]);
}

#[test]
fn a_damaged_trace_leaves_what_was_there() {
    let (directory, trace) = recorded();
    let mut bytes = fs::read(&trace).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&trace, bytes).unwrap();
    let (old, new) = (
        beside(&directory, "old.html"),
        beside(&directory, "new.html"),
    );
    fs::write(&old, "as it was").unwrap();
    for file in [&old, &new] {
        says(
            &stderr(&ends_with(3, &["view", &trace, "-o", file])),
            &["run.mcap", "damaged"],
        );
    }
    assert_eq!(fs::read_to_string(&old).unwrap(), "as it was");
    assert!(!Path::new(&new).exists());
}

#[test]
fn an_output_that_cannot_be_written_is_said_before_the_trace_is_read() {
    let (directory, trace) = recorded();
    // Damaged, so that reading it would say something else.
    let mut bytes = fs::read(&trace).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&trace, bytes).unwrap();
    let nowhere = beside(&directory, "no/such/page.html");
    let text = stderr(&ends_with(7, &["view", &trace, "-o", &nowhere]));
    says(
        &text,
        &["no/such/page.html", "cannot be written", "No such file"],
    );
}

#[test]
fn the_trace_itself_is_no_place_to_write_to() {
    let (_directory, trace) = recorded();
    let before = fs::read(&trace).unwrap();
    let text = stderr(&ends_with(2, &["view", &trace, "-o", &trace]));
    says(&text, &["the trace itself"]);
    assert_eq!(fs::read(&trace).unwrap(), before);
}

#[test]
fn rooms_that_isolate_an_easy_constraint_show_it() {
    // What each room is there for (`rearrange scenarios`), in the order of rule 9's table.
    for (room, before, after, kind) in [
        ("e1", 0, 1, "E1"),
        ("e2", 1, 0, "E2"),
        ("e3", 0, 1, "E3"),
        ("e4", 1, 0, "E4"),
    ] {
        let (_directory, trace) = recorded_in(room);
        let data = data(&stdout(&ends_with(0, &["view", &trace, "-o", "-"])));
        let easy = serde_json::json!([[before, after, kind, 0]]);
        assert_eq!(data["constraints"], easy, "{room}");
    }
}

#[test]
fn who_meets_the_only_other_robot_waits_for_that_one() {
    let (_directory, trace) = recorded_in("head-on-corridor");
    let data = data(&stdout(&ends_with(0, &["view", &trace, "-o", "-"])));
    let mut found = 0;
    for (id, robot) in data["robots"].as_array().unwrap().iter().enumerate() {
        for wait in robot["waits"].as_array().unwrap() {
            if wait[1][0] == "robot" {
                assert_eq!(wait[1][1], 1 - id);
                found += 1;
            }
        }
    }
    assert!(found > 0, "nobody waits for anybody");
}
