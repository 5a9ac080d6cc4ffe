//! Whoever dies is started again and takes up where it was, and the run ends as if nothing had been.
//!
//! Each run has a directory and an iceoryx2 domain of its own, which the binary gets by its
//! environment; what is left of either is looked at.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod live;

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::process::Child;
use std::time::Duration;

use node::Role;
use node::domain::RunFile;
use node::supervisor::{DIARY_FILE, Entry, Happened};
use serde_json::Value;
use shm_types::capacity::MAX_OBJECTS;
use shm_types::{Counts, Schedule};
use tempfile::TempDir;

use live::{binary, finish, wait_until};

/// A room where two robots are busy for half a minute of world time.
const ROOM: &str = "e1";
/// Makes a lockstep run of it last for some seconds.
const SLOW: [&str; 2] = ["--delay", "world=1"];

fn kill(pid: u32, signal: i32) {
    // SAFETY: a signal to a process of a run of this test.
    unsafe { libc::kill(i32::try_from(pid).unwrap(), signal) };
}

struct Run {
    place: TempDir,
    child: Option<Child>,
    directory: PathBuf,
    prefix: String,
}

impl Run {
    /// Starts a run, and waits until all its processes are ready.
    fn start(arguments: &[&str]) -> Self {
        let place = tempfile::Builder::new().prefix("rr").tempdir().unwrap();
        let child = binary(place.path())
            .args(["run", ROOM, "--json"])
            .args(arguments)
            .spawn()
            .unwrap();
        let mut found = None;
        wait_until("a run", || {
            let directories = fs::read_dir(place.path().join("rearrange"));
            let mut runs = directories.into_iter().flatten().flatten();
            found = runs.find_map(|run| RunFile::read(&run.path()).ok());
            found.is_some()
        });
        let file = found.unwrap();
        let run = Self {
            place,
            child: Some(child),
            directory: file.root,
            prefix: file.prefix,
        };
        for role in Role::all(file.robots) {
            run.await_ready(role, 1);
        }
        run
    }

    fn diary(&self) -> Vec<Happened> {
        let text = fs::read_to_string(self.directory.join(DIARY_FILE)).unwrap_or_default();
        let entries = text
            .lines()
            .filter_map(|line| serde_json::from_str(line).ok());
        entries.map(|entry: Entry| entry.happened).collect()
    }

    /// Waits until process number `count` of a participant has answered a tick.
    fn await_ready(&self, role: Role, count: usize) {
        wait_until(&format!("process {count} of {role}"), || {
            let diary = self.diary();
            let ready =
                |one: &&Happened| matches!(one, Happened::Ready { role: who, .. } if *who == role);
            diary.iter().filter(ready).count() >= count
        });
    }

    fn pid_of(&self, role: Role) -> u32 {
        let diary = self.diary();
        let started = diary.iter().rev().find_map(|one| match one {
            Happened::Started { role: who, pid, .. } if *who == role => Some(*pid),
            _ => None,
        });
        started.unwrap()
    }

    fn kill_supervisor(&mut self) {
        let mut child = self.child.take().unwrap();
        child.kill().unwrap();
        child.wait().unwrap();
    }

    fn end(&mut self) -> (i32, Value, String) {
        finish(self.child.take().unwrap())
    }

    fn assert_nothing_left(&self) {
        assert_eq!(self.segments(), 0);
        assert!(!self.directory.exists());
    }

    fn segments(&self) -> usize {
        let files = fs::read_dir("/dev/shm").unwrap().flatten();
        let ours =
            files.filter(|file| file.file_name().to_string_lossy().starts_with(&self.prefix));
        ours.count()
    }

    fn say(&self, arguments: &[&str]) -> (i32, String) {
        let output = binary(self.place.path()).args(arguments).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code().unwrap_or(-1), text + &errors)
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        if let Some(mut child) = self.child.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
        for file in fs::read_dir("/dev/shm").unwrap().flatten() {
            if file.file_name().to_string_lossy().starts_with(&self.prefix) {
                let _ = fs::remove_file(file.path());
            }
        }
    }
}

fn assert_solved(run: &mut Run) -> Value {
    let (status, result, stderr) = run.end();
    assert_eq!(status, 0, "{} {stderr}", result["reason"]);
    assert_eq!(result["outcome"], "solved");
    assert_eq!(result["checker"]["violations"], 0, "{}", result["checker"]);
    assert_eq!(
        result["checker"]["complete"], true,
        "nothing is missing, nothing comes twice"
    );
    run.assert_nothing_left();
    result
}

/// A run in one thread, where nobody dies.
fn undisturbed() -> Value {
    let place = tempfile::tempdir().unwrap();
    let output = binary(place.path())
        .args(["run", ROOM, "--json", "--driver", "in-process"])
        .output()
        .unwrap();
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn every_process_that_dies_is_started_again_and_the_run_is_solved() {
    let mut run = Run::start(&SLOW);
    let roles = [
        Role::Robot(1),
        Role::World,
        Role::Planner,
        Role::Recorder,
        Role::Robot(0),
    ];
    for role in roles {
        kill(run.pid_of(role), libc::SIGKILL);
        run.await_ready(role, 2);
    }
    let result = assert_solved(&mut run);
    assert_eq!(result["counts"]["restarts"], 5);
}

#[test]
fn a_world_or_recorder_that_dies_changes_no_state_at_all() {
    let mut run = Run::start(&SLOW);
    for count in 2..=5 {
        for role in [Role::World, Role::Recorder] {
            kill(run.pid_of(role), libc::SIGKILL);
            run.await_ready(role, count);
        }
    }
    let result = assert_solved(&mut run);
    let undisturbed = undisturbed();
    assert_eq!(result["state_hash"], undisturbed["state_hash"]);
    // The pieces of motion in the trace are the same, too.
    assert_eq!(result["checker"], undisturbed["checker"]);
}

#[test]
fn in_real_time_too() {
    let mut run = Run::start(&["--clock", "real", "--speed", "10"]);
    for role in [Role::Robot(1), Role::World, Role::Planner, Role::Recorder] {
        kill(run.pid_of(role), libc::SIGKILL);
        run.await_ready(role, 2);
    }
    assert_solved(&mut run);
}

#[test]
fn who_is_stopped_is_killed_and_replaced() {
    let mut run = Run::start(&[SLOW[0], SLOW[1], "--silence-limit", "0.5"]);
    for role in [Role::Robot(0), Role::World] {
        kill(run.pid_of(role), libc::SIGSTOP);
        run.await_ready(role, 2);
    }
    let silent = |one: &Happened| matches!(one, Happened::Silent { .. });
    assert!(run.diary().iter().filter(|one| silent(one)).count() >= 2);
    assert_solved(&mut run);
}

#[test]
fn a_run_whose_supervisor_dies_is_listed_and_resumed_to_its_end() {
    let mut run = Run::start(&SLOW);
    for _ in 0..2 {
        run.kill_supervisor();
        wait_until("the end of its processes", || {
            let (status, listed) = run.say(&["list"]);
            assert_eq!(status, 0);
            listed.contains("can be resumed")
        });
        let (status, words) = run.say(&["resume", "nobody"]);
        assert_eq!(status, 3, "{words}");
        let resume = binary(run.place.path())
            .args(["resume", "--json"])
            .spawn()
            .unwrap();
        run.child = Some(resume);
        wait_until("it is live again", || {
            run.say(&["list"]).1.contains(" live ")
        });
        std::thread::sleep(Duration::from_millis(300));
    }
    let (status, words) = run.say(&["resume"]);
    assert_eq!(status, 3, "it is live: {words}");
    assert_solved(&mut run);
}

/// Puts robot 0 into a wall, in all states that the journal of a dead run holds, with checksums that
/// fit: what a fault of the world itself would leave.
fn put_robot_into_wall(run: &Run) {
    /// Where the first robot's place is after the first word of a state.
    const PLACE: usize = 68;
    let path = run.directory.join("journal");
    let mut journal = fs::read(&path).unwrap();
    let starts: Vec<usize> = (16..journal.len() - 4)
        .filter(|at| &journal[*at..at + 4] == b"rrck")
        .collect();
    // One in each slot, or a single one of a run that was killed at its beginning.
    assert!((1..=2).contains(&starts.len()), "{starts:?}");
    for at in starts {
        let length = u64::from_le_bytes(journal[at - 8..at].try_into().unwrap()) as usize;
        let (state, sum) = journal[at..at + length].split_at_mut(length - 8);
        let place = PLACE..PLACE + 16;
        for coordinate in state[place.clone()].chunks(8) {
            let metres = f64::from_le_bytes(coordinate.try_into().unwrap());
            assert!((0.1..20.0).contains(&metres), "{metres} is no place");
        }
        // The corner of the room.
        state[place].fill(0);
        let mut hash = shm_types::StateHash::new();
        hash.add(&*state);
        sum.copy_from_slice(&hash.finish().to_le_bytes());
    }
    fs::write(&path, journal).unwrap();
}

#[test]
fn a_broken_invariant_stops_the_run_and_keeps_its_trace() {
    let mut run = Run::start(&SLOW);
    run.kill_supervisor();
    wait_until("the end of its processes", || {
        run.say(&["list"]).1.contains("can be resumed")
    });
    put_robot_into_wall(&run);
    let resume = binary(run.place.path())
        .args(["resume", "--json"])
        .env("TMPDIR", run.place.path())
        .spawn();
    run.child = Some(resume.unwrap());
    let (status, result, stderr) = run.end();
    assert_eq!(status, 6, "{result} {stderr}");
    assert_eq!(result["outcome"], "failed");
    assert_eq!(result["reason"], "Wall { robot: 0 }");
    assert_eq!(result["invariants"]["wall"]["violations"], 1);
    assert_eq!(result["invariants"]["robots"]["violations"], 0);
    run.assert_nothing_left();
    // What led there is in the trace, which nobody has asked for.
    let kept = result["trace"].as_str().unwrap();
    assert!(
        kept.starts_with(run.place.path().to_str().unwrap()),
        "{kept}"
    );
    let (status, words) = run.say(&["check", kept]);
    assert_eq!(status, 6, "{words}");
    assert!(words.contains("the world itself found"), "{words}");
}

/// Every file of shared memory that holds messages can be written by the one process that sends them;
/// all others have mapped it to read. The journal is the world's alone.
#[test]
fn who_reads_messages_cannot_write_them() {
    let mut run = Run::start(&SLOW);
    let file = RunFile::read(&run.directory).unwrap();
    let mut pids: Vec<u32> = Role::all(file.robots)
        .map(|role| run.pid_of(role))
        .collect();
    pids.push(run.child.as_ref().unwrap().id());
    let (mut writers, mut readers) = (BTreeMap::new(), 0);
    let mut journals = Vec::new();
    for pid in pids {
        let maps = fs::read_to_string(format!("/proc/{pid}/maps")).unwrap();
        for line in maps.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let [_, mode, .., path] = words[..] else {
                continue;
            };
            if path.ends_with("/journal") {
                journals.push(pid);
            }
            if !path.contains(&run.prefix) || !path.ends_with(".data") {
                continue;
            }
            if mode.contains('w') {
                let before = writers.insert(path.to_owned(), pid);
                assert!(before.is_none_or(|before| before == pid), "{path}");
            } else {
                assert_eq!(mode, "r--s", "{path}");
                readers += 1;
            }
        }
    }
    assert_eq!(journals, [run.pid_of(Role::World)]);
    // Robots, planner and recorder send something each, and read the world.
    let participants = Role::all(file.robots).count();
    assert!(writers.len() >= participants, "{writers:?}");
    assert!(readers >= participants, "{readers}");
    assert_solved(&mut run);
}

#[test]
fn a_robot_that_was_added_is_started_again_as_the_others_are() {
    let mut run = Run::start(&SLOW);
    let robot = Role::Robot(2);
    let (status, words) = run.say(&["tell", "add-robot", "3.5", "0.5"]);
    assert_eq!(status, 0, "{words}");
    run.await_ready(robot, 1);
    assert!(run.say(&["list"]).1.contains(" 3 "), "so many robots");
    for (role, count) in [(robot, 2), (Role::World, 2), (Role::Planner, 2), (robot, 3)] {
        kill(run.pid_of(role), libc::SIGKILL);
        run.await_ready(role, count);
    }
    run.kill_supervisor();
    wait_until("the end of its processes", || {
        run.say(&["list"]).1.contains("can be resumed")
    });
    let resume = binary(run.place.path())
        .args(["resume", "--json"])
        .spawn()
        .unwrap();
    run.child = Some(resume);
    run.await_ready(robot, 4);
    kill(run.pid_of(robot), libc::SIGKILL);
    run.await_ready(robot, 5);
    let result = assert_solved(&mut run);
    assert_eq!(result["robots"], 3);
    assert_eq!(result["counts"]["scene_changes"], 1);
}

/// The newest schedule in the run's directory.
fn last_schedule(run: &Run) -> Option<Box<Schedule>> {
    let counts = Counts {
        robots: 3,
        objects: MAX_OBJECTS as u32,
    };
    Schedule::unsealed(&fs::read(run.directory.join("schedule")).ok()?, counts)
}

#[test]
fn a_planner_that_dies_after_the_scene_was_changed_leaves_robots_to_its_plan() {
    let mut run = Run::start(&SLOW);
    let (status, words) = run.say(&["tell", "add-robot", "3.5", "0.5"]);
    assert_eq!(status, 0, "{words}");
    let mut version = 0;
    wait_until("a whole plan for three robots", || {
        let last = last_schedule(&run);
        last.is_some_and(|last| {
            let listed = &last.robots[..last.robot_count as usize];
            version = last.version;
            listed.len() == 3 && last.action_count > 0 && listed.iter().all(|r| r.complete == 1)
        })
    });
    let written = || {
        let file = fs::metadata(run.directory.join("schedule"));
        file.and_then(|file| file.modified()).unwrap()
    };
    let before = written();
    kill(run.pid_of(Role::Planner), libc::SIGKILL);
    wait_until("word of the next planner", || written() != before);
    assert_eq!(last_schedule(&run).unwrap().version, version);
    assert_solved(&mut run);
}

#[test]
fn dead_runs_stay_until_they_are_asked_to_go() {
    let mut run = Run::start(&SLOW);
    run.kill_supervisor();
    let (status, words) = run.say(&["gc", "--dry-run"]);
    assert_eq!(status, 0);
    assert!(words.contains("would remove"), "{words}");
    assert!(run.directory.exists());
    let live = Run::start(&SLOW);
    let (_, words) = live.say(&["gc"]);
    assert!(
        !words.contains(&live.prefix[2..10]),
        "a live one stays: {words}"
    );
    assert!(live.directory.exists() && live.segments() > 0);
    let (status, words) = run.say(&["gc"]);
    assert_eq!(status, 0);
    assert!(words.contains("removed"), "{words}");
    run.assert_nothing_left();
}

#[test]
fn with_hold_a_robot_waits_until_it_is_released() {
    let mut run = Run::start(&[SLOW[0], SLOW[1], "--restart", "hold"]);
    let robot = Role::Robot(1);
    kill(run.pid_of(robot), libc::SIGKILL);
    run.await_ready(robot, 2);
    std::thread::sleep(Duration::from_millis(300));
    let (status, words) = run.say(&["tell", "release", "1"]);
    assert_eq!(status, 0, "{words}");
    let (status, words) = run.say(&["tell", "release", "1"]);
    assert_eq!(status, 3, "it takes part already: {words}");
    assert_solved(&mut run);
}

/// What cannot be finished without it is named.
#[test]
fn a_robot_that_is_not_started_again_is_an_obstacle_with_what_it_holds() {
    let mut run = Run::start(&[SLOW[0], SLOW[1], "--restart", "never"]);
    std::thread::sleep(Duration::from_millis(800));
    kill(run.pid_of(Role::Robot(0)), libc::SIGKILL);
    let (status, result, stderr) = run.end();
    assert!([0, 5].contains(&status), "{status} {result} {stderr}");
    assert_eq!(result["checker"]["violations"], 0);
    assert_eq!(result["checker"]["complete"], true);
    let notes = result["notes"].to_string();
    assert!(notes.contains("robot-0 is gone for good"), "{notes}");
    run.assert_nothing_left();
}
