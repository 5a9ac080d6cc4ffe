//! Real processes against the in-process driver: the same state at every tick, whoever is slow or
//! stopped; and in real time, whoever is stopped is held, alone.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod live;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Child;
use std::time::Duration;

use scene::builtin::BUILTIN;
use serde_json::Value;
use tempfile::TempDir;

use live::{binary, finish, wait_until};

/// Wall time for which a process is stopped: far more than a tick, less than the 5 s after which
/// a silent process counts as dead in real time.
const STOPPED: Duration = Duration::from_millis(1_500);

/// A private place for one run; gone when dropped, with all it started.
struct Place {
    dir: TempDir,
    run: Option<Child>,
}

impl Place {
    fn new() -> Self {
        let dir = tempfile::Builder::new().prefix("rr").tempdir().unwrap();
        Self { dir, run: None }
    }

    fn file(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn start(&mut self, arguments: &[&str]) {
        let child = binary(self.dir.path()).arg("run").args(arguments).spawn();
        self.run = Some(child.unwrap());
    }

    /// The result of the run, which must end within the watchdog's time.
    fn finish(mut self) -> Finished {
        let (status, result, stderr) = finish(self.run.take().unwrap());
        assert!(result.is_object(), "{status}: {stderr}");
        Finished {
            result,
            place: self,
        }
    }

    /// What the run says of itself, once all its processes are up.
    fn run_json(&self) -> Value {
        let mut found = None;
        wait_until("a run", || {
            let runs = fs::read_dir(self.file("rearrange")).into_iter().flatten();
            let read = |run: fs::DirEntry| fs::read_to_string(run.path().join("run.json")).ok();
            let texts = runs.flatten().filter_map(read);
            let mut runs = texts.filter_map(|text| serde_json::from_str::<Value>(&text).ok());
            let is_up = |run: &Value| run["processes"].as_array().is_some_and(|p| p.len() > 3);
            found = runs.find(is_up);
            found.is_some()
        });
        found.unwrap()
    }

    fn signal_robot(&self, robot: u64, signal: i32) {
        let run = self.run_json();
        let processes = run["processes"].as_array().unwrap();
        let process = processes
            .iter()
            .find(|process| process["role"]["robot"] == robot)
            .unwrap();
        let pid = i32::try_from(process["pid"].as_i64().unwrap()).unwrap();
        // SAFETY: a signal to a process of the run under test, which reaps it only at its end.
        assert_eq!(unsafe { libc::kill(pid, signal) }, 0);
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        if let Some(mut child) = self.run.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

struct Finished {
    result: Value,
    place: Place,
}

/// Runs to the end; the state hash of every tick.
fn hashes(scenario: &str, more: &[&str]) -> Vec<String> {
    let mut place = Place::new();
    let file = place.file("hashes");
    let hashes = file.to_str().unwrap().to_owned();
    let mut arguments = vec![scenario, "--json", "--hashes", &hashes];
    arguments.extend(more);
    place.start(&arguments);
    let finished = place.finish();
    let result = &finished.result;
    assert_eq!(result["checker"]["violations"], 0, "{scenario}");
    // Another process of a robot or the planner would be another state.
    assert_eq!(result["counts"]["restarts"], 0, "{}", result["notes"]);
    lines(&file)
}

fn lines(file: &Path) -> Vec<String> {
    let text = fs::read_to_string(file).unwrap();
    text.lines().map(str::to_owned).collect()
}

fn assert_same(scenario: &str, expected: &[String], found: &[String], who: &str) {
    let first = expected.iter().zip(found).position(|(a, b)| a != b);
    assert_eq!(first, None, "{scenario}, {who}: first tick that differs");
    assert_eq!(expected.len(), found.len(), "{scenario}, {who}: ticks");
    assert!(!expected.is_empty());
}

const IN_PROCESS: &[&str] = &["--driver", "in-process"];
const PAPERS: &[&str; 2] = &["--method", "grasping-and-restricted"];

#[test]
fn processes_reach_the_same_state_at_every_tick_in_every_shipped_room() {
    for scenario in BUILTIN {
        let scene = scene::parse(scenario.text, scenario.name).unwrap();
        if planner::certificate(&scene).is_some() {
            continue;
        }
        for method in [&["--method", "anytime"], PAPERS] {
            let expected = hashes(scenario.name, &[IN_PROCESS, method].concat());
            let found = hashes(scenario.name, method);
            assert_same(scenario.name, &expected, &found, method[1]);
        }
    }
}

#[test]
fn whoever_is_slow_the_states_are_the_same() {
    // Tasks fail from the first ticks on in this room, so that questions and answers are slow too.
    let room = "paper-17a";
    let expected = hashes(room, &[IN_PROCESS, PAPERS].concat());
    for role in [
        "world", "planner", "recorder", "robot-0", "robot-1", "robot-2", "robot-3",
    ] {
        let delay = format!("{role}=50x30");
        let found = hashes(room, &[&["--delay", delay.as_str()][..], PAPERS].concat());
        assert_same(room, &expected, &found, &delay);
    }
}

#[test]
fn robots_that_follow_a_schedule_reach_the_same_states() {
    let room = "h1";
    let method = ["--method", "anytime"];
    let expected = hashes(room, &[IN_PROCESS, &method].concat());
    assert_same(room, &expected, &hashes(room, &method), "nobody delayed");
    for role in ["planner", "robot-1"] {
        let delay = format!("{role}=50x30");
        let delayed = [&["--delay", delay.as_str()][..], &method].concat();
        assert_same(room, &expected, &hashes(room, &delayed), &delay);
    }
}

#[test]
fn what_changes_on_the_way_changes_alike_whatever_drives_the_run() {
    let rooms = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/rooms/two-rooms.toml");
    let changes = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/rooms/changes.toml");
    for method in [&["--method", "anytime"], PAPERS] {
        let told = [&["--changes", changes][..], method].concat();
        let expected = hashes(rooms, &[IN_PROCESS, &told].concat());
        assert_same(rooms, &expected, &hashes(rooms, &told), method[1]);
        let late = [&["--delay", "robot-1=20x30"][..], &told].concat();
        assert_same(rooms, &expected, &hashes(rooms, &late), method[1]);
        let without = hashes(rooms, &[IN_PROCESS, method].concat());
        assert_ne!(expected, without, "nothing has changed");
    }
}

#[test]
fn robots_that_are_added_come_alike_whatever_drives_the_run() {
    let rooms = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/rooms/two-rooms.toml");
    let changes = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/rooms/more-robots.toml");
    for method in [&["--method", "anytime"], PAPERS] {
        let told = [&["--changes", changes][..], method].concat();
        let expected = hashes(rooms, &[IN_PROCESS, &told].concat());
        assert_same(rooms, &expected, &hashes(rooms, &told), method[1]);
        for role in ["world", "robot-2"] {
            let delay = format!("{role}=20x30");
            let late = [&["--delay", delay.as_str()][..], &told].concat();
            assert_same(rooms, &expected, &hashes(rooms, &late), method[1]);
        }
        let without = hashes(rooms, &[IN_PROCESS, method].concat());
        assert_ne!(expected, without, "nobody has come");
    }
}

#[test]
fn lockstep_waits_for_a_stopped_robot() {
    let room = "paper-17a";
    let expected = hashes(room, IN_PROCESS);
    let mut place = Place::new();
    let file = place.file("hashes");
    let hashes = file.to_str().unwrap().to_owned();
    // A slow world, so that the run is still going on when the robot stops.
    let slow = ["--delay", "world=1x2000"];
    place.start(&[room, "--json", "--hashes", &hashes, slow[0], slow[1]]);
    place.run_json();
    std::thread::sleep(Duration::from_millis(500));
    place.signal_robot(0, libc::SIGSTOP);
    std::thread::sleep(STOPPED);
    let ended = place.run.as_mut().unwrap().try_wait().unwrap();
    place.signal_robot(0, libc::SIGCONT);
    assert!(ended.is_none(), "the run went on without the stopped robot");
    let finished = place.finish();
    assert_eq!(finished.result["outcome"], "solved");
    assert_same(room, &expected, &lines(&file), "robot 0 stopped");
}

/// Two robots, each with an object on its own side of an open room.
const TWO_SIDES: &str = r#"
name = "two-sides"
[robot]
shape = { box = [0.5, 0.5] }
speed = 0.5
[object]
shape = { box = [0.4, 0.4] }
grasp = [0.0, -0.45]
[workspace]
bounds = [0.0, 0.0, 12.0, 4.0]
[[robots]]
home = [0.5, 0.5]
[[robots]]
home = [0.5, 3.5]
[[objects]]
start = [2.0, 1.0]
goal = [11.0, 1.0]
[[objects]]
start = [2.0, 3.0]
goal = [11.0, 3.0]
"#;

#[test]
fn in_real_time_a_stopped_robot_is_held_alone() {
    let mut place = Place::new();
    let (room, trace) = (place.file("room.toml"), place.file("run.mcap"));
    fs::write(&room, TWO_SIDES).unwrap();
    let (room, path) = (room.to_str().unwrap(), trace.to_str().unwrap());
    // Four seconds of world time in one of wall time: some 25 s of motion in some 6 s.
    let pace = ["--clock", "real", "--rate", "200", "--speed", "4"];
    let mut arguments = vec![room, "--json", "--trace", path];
    arguments.extend(pace);
    place.start(&arguments);
    place.run_json();
    std::thread::sleep(Duration::from_millis(1_500));
    place.signal_robot(0, libc::SIGSTOP);
    std::thread::sleep(STOPPED);
    place.signal_robot(0, libc::SIGCONT);
    let finished = place.finish();
    assert_eq!(finished.result["outcome"], "solved");
    assert_eq!(finished.result["checker"]["violations"], 0);
    let longest = |robot: u64| longest_rest_s(&finished.place.file("run.mcap"), robot);
    // It was stopped for 6 s of world time, less what its last command still allowed.
    assert!(longest(0) > 2.0, "robot 0 stood for {} s", longest(0));
    assert!(
        longest(1) < longest(0) / 2.0,
        "robot 1 stood for {} s, robot 0 for {} s",
        longest(1),
        longest(0)
    );
}

/// The longest time for which `robot` stood still before its object was at its goal, s of world
/// time.
fn longest_rest_s(trace: &Path, robot: u64) -> f64 {
    let robot = usize::try_from(robot).unwrap();
    let reader = trace::Reader::new(fs::File::open(trace).unwrap()).unwrap();
    let goal = reader.scene().objects[robot].goal.unwrap();
    let (mut since_ns, mut longest_ns, mut last) = (0, 0, None);
    for frame in trace::Replay::new(reader, 0, 10_000_000) {
        let frame = frame.unwrap();
        if frame.objects[robot] == goal {
            break;
        }
        if last.replace(frame.robots[robot]) != Some(frame.robots[robot]) {
            since_ns = frame.time_ns;
        }
        longest_ns = longest_ns.max(frame.time_ns - since_ns);
    }
    longest_ns as f64 * 1e-9
}
