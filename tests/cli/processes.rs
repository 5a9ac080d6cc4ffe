//! The command line's side of runs with real processes: what it reports, refuses and lists. What
//! the processes do is tested elsewhere.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

use crate::{json, rearrange, says, stderr, stdout};

/// A directory of runs of its own, so that these runs see nobody else's.
fn place() -> TempDir {
    tempfile::Builder::new().prefix("rr").tempdir().unwrap()
}

fn in_place(place: &Path, arguments: &[&str]) -> assert_cmd::Command {
    let mut command = rearrange(arguments);
    command.env("XDG_RUNTIME_DIR", place);
    command
}

#[test]
fn processes_report_who_they_were_and_reach_the_states_of_one_thread() {
    let place = place();
    let processes = json(
        &in_place(place.path(), &["run", "e1", "--json"])
            .assert()
            .code(0),
    );
    assert_eq!(processes["outcome"], "solved");
    assert_eq!(processes["checker"]["violations"], 0);
    assert_eq!(processes["checker"]["complete"], true);
    let roles = processes["roles"].as_array().unwrap();
    let names: Vec<_> = roles
        .iter()
        .map(|role| role["role"].as_str().unwrap())
        .collect();
    assert_eq!(
        names,
        ["world", "planner", "robot-0", "robot-1", "recorder"]
    );
    for role in roles {
        assert!(role["pid"].as_u64().unwrap() > 1, "{role}");
        assert!(role["ticks_answered"].as_u64().unwrap() > 100, "{role}");
    }
    for name in [
        "snapshot_age",
        "world_step",
        "robot_step",
        "planner_step",
        "tick",
    ] {
        assert!(
            processes["latency"][name]["count"].as_u64().unwrap() > 0,
            "{name}"
        );
    }
    let thread = ["run", "e1", "--driver", "in-process", "--json"];
    let thread = json(&rearrange(&thread).assert().code(0));
    assert_eq!(thread["state_hash"], processes["state_hash"]);
    assert_eq!(thread["makespan_s"], processes["makespan_s"]);
}

/// A run in real time that goes on until it is stopped; killed when dropped.
struct LongRun(Option<Child>);

impl LongRun {
    fn start(place: &Path, name: &str) -> Self {
        let child = Command::new(assert_cmd::cargo::cargo_bin!("rearrange"))
            .args([
                "run", "e1", "--clock", "real", "--rate", "50", "--speed", "0.01",
            ])
            .args(["--name", name, "--json"])
            .env("XDG_RUNTIME_DIR", place)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        Self(Some(child))
    }

    fn interrupt(mut self) -> std::process::Output {
        let child = self.0.take().unwrap();
        let pid = i32::try_from(child.id()).unwrap();
        // SAFETY: a signal to a child that has not been waited for.
        assert_eq!(unsafe { libc::kill(pid, libc::SIGINT) }, 0);
        child.wait_with_output().unwrap()
    }
}

impl Drop for LongRun {
    fn drop(&mut self) {
        if let Some(mut child) = self.0.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn live(place: &Path) -> Vec<Value> {
    let list = json(&in_place(place, &["list", "--json"]).assert().code(0));
    list.as_array().unwrap().clone()
}

#[test]
fn a_live_run_is_listed_keeps_its_name_and_ends_on_ctrl_c() {
    let place = place();
    says(
        &stderr(&in_place(place.path(), &["list"]).assert().code(0)),
        &["no run"],
    );
    let run = LongRun::start(place.path(), "mine");
    while live(place.path()).is_empty() {
        std::thread::sleep(Duration::from_millis(20));
    }
    let listed = &live(place.path())[0];
    assert_eq!(listed["name"], "mine");
    assert_eq!(listed["scenario"], "e1");
    assert_eq!(listed["robots"], 2);
    let text = stdout(&in_place(place.path(), &["list"]).assert().code(0));
    says(&text, &["NAME", "mine", "e1", "real"]);

    let second = in_place(place.path(), &["run", "e1", "--name", "mine"])
        .assert()
        .code(7);
    says(&stderr(&second), &["mine"]);

    let output = run.interrupt();
    assert_eq!(output.status.code(), Some(130));
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(result["outcome"], "interrupted");
    assert_eq!(live(place.path()), Vec::<Value>::new());
}

#[test]
fn a_role_without_its_run_is_a_system_failure() {
    for role in ["world", "planner", "robot", "recorder"] {
        let assert = rearrange(&[role, "--run", "/nowhere"]).assert().code(7);
        says(&stderr(&assert), &[role, "/nowhere"]);
    }
}

#[test]
fn a_directory_of_runs_that_is_not_private_is_refused() {
    use std::os::unix::fs::PermissionsExt;
    let place = place();
    let open = place.path().join("rearrange");
    std::fs::create_dir(&open).unwrap();
    std::fs::set_permissions(&open, std::fs::Permissions::from_mode(0o777)).unwrap();
    let assert = in_place(place.path(), &["run", "e1"]).assert().code(7);
    says(&stderr(&assert), &["rearrange"]);
}

#[test]
fn bench_speed_measures_both_drivers_on_the_same_ticks() {
    let place = place();
    let arguments = ["bench", "speed", "e1", "--ticks", "1", "--json"];
    let report = json(&in_place(place.path(), &arguments).assert().code(0));
    let rows = report["rows"].as_array().unwrap();
    let drivers: Vec<_> = rows.iter().map(|row| &row["driver"]).collect();
    assert_eq!(drivers, ["in-process", "lockstep"]);
    assert_eq!(rows[0]["ticks"], rows[1]["ticks"]);
    assert_eq!(rows[1]["processes"], 5);
    for row in rows {
        assert!(row["ratio"].as_f64().unwrap() > 0.0);
        assert!(row["moving_robots"].as_f64().unwrap() > 0.0);
    }
    assert!(report["machine"]["cores"].as_u64().unwrap() >= 1);
    let says_when = report["date"].as_str().unwrap();
    assert_eq!(says_when.len(), "2007-04-10T09:30:00Z".len());
}

#[test]
fn chaos_that_is_interrupted_says_what_came_of_the_runs_before() {
    let place = place();
    let child = Command::new(assert_cmd::cargo::cargo_bin!("rearrange"))
        .args(["chaos", "e1", "--kills", "100000", "--json"])
        .env("XDG_RUNTIME_DIR", place.path())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    while live(place.path()).is_empty() {
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = LongRun(Some(child)).interrupt();
    assert_eq!(output.status.code(), Some(130));
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(result["interrupted"], true);
    assert_eq!(result["failures"], Value::Array(Vec::new()));
    assert_eq!(result["runs"], result["solved"]);
    assert_eq!(result["leftovers"], 0);
    assert!(live(place.path()).is_empty());
}
