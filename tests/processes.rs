//! The life of a run's processes: how they end, however they end, and that nothing of them stays.
//! That they reach the same states as one thread is tested in `lockstep`.
//!
//! Each run has a directory and an iceoryx2 domain of its own. A run that goes on for too long is
//! ended with all its processes.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod live;

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Child;
use std::time::Duration;

use node::domain::RunFile;
use node::options::{Delay, Role};
use node::{Launcher, RunOptions, RunPlan, RunReport, supervisor};
use scene::Settings;
use serde_json::Value;
use shm_types::Outcome;
use tempfile::TempDir;

use live::{binary, finish, wait_until};

/// A room where two robots are busy for half a minute of world time.
const ROOM: &str = "e1";
/// Makes a lockstep run of it last for as long as a test needs: 20 ms a tick.
const SLOW: [&str; 2] = ["--delay", "world=20x100000"];
/// A run in real time that lasts for as long as a test needs.
const REAL: [&str; 6] = ["--clock", "real", "--rate", "100", "--speed", "0.1"];

fn signal(pid: u32, signal: i32) {
    let pid = i32::try_from(pid).unwrap();
    // SAFETY: a signal to a process of a run of this test.
    assert_eq!(unsafe { libc::kill(pid, signal) }, 0, "no process {pid}");
}

/// Whether a process is there and not a corpse.
fn is_alive(pid: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    // The name may hold anything; the state follows its closing bracket.
    let state = status.rsplit(") ").next().unwrap_or_default();
    !state.is_empty() && !state.starts_with('Z')
}

/// Files in shared memory with this prefix.
fn segments(prefix: &str) -> Vec<PathBuf> {
    let files = fs::read_dir("/dev/shm").unwrap().flatten();
    let ours = files.filter(|file| file.file_name().to_string_lossy().starts_with(prefix));
    ours.map(|file| file.path()).collect()
}

/// A run of the binary, in a place of its own; killed when dropped.
struct Run {
    place: TempDir,
    child: Option<Child>,
    file: RunFile,
}

impl Run {
    /// Starts a run that lasts, and waits until it has made its first ticks.
    fn start(arguments: &[&str]) -> Self {
        let place = tempfile::Builder::new().prefix("rr").tempdir().unwrap();
        let child = binary(place.path())
            .args(["run", ROOM, "--json"])
            .args(arguments)
            .spawn()
            .unwrap();
        let mut found = None;
        wait_until("a run", || {
            found = runs(place.path()).into_iter().find(is_started);
            found.is_some()
        });
        let run = Self {
            place,
            child: Some(child),
            file: found.unwrap(),
        };
        // The trace has its first chunk, and the world goes on from here.
        std::thread::sleep(Duration::from_millis(500));
        run
    }

    fn pid_of(&self, role: Role) -> u32 {
        let process = self.file.processes.iter().find(|one| one.role == role);
        process.unwrap().pid
    }

    fn supervisor(&self) -> u32 {
        self.child.as_ref().unwrap().id()
    }

    /// Waits for the end; the status and the result.
    fn end(&mut self) -> (i32, Value, String) {
        finish(self.child.take().unwrap())
    }

    /// Nothing of the run is left: no process, no file in shared memory, no directory.
    fn assert_nothing_left(&self) {
        for process in &self.file.processes {
            assert!(!is_alive(process.pid), "{} is still there", process.role);
        }
        assert_eq!(segments(&self.file.prefix), Vec::<PathBuf>::new());
        assert!(!self.file.root.exists(), "{:?}", self.file.root);
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        if let Some(mut child) = self.child.take() {
            let _ = child.kill();
            let _ = child.wait();
            for file in segments(&self.file.prefix) {
                let _ = fs::remove_file(file);
            }
        }
    }
}

/// The runs in a place, started or not.
fn runs(place: &Path) -> Vec<RunFile> {
    let directories = fs::read_dir(place.join("rearrange")).into_iter().flatten();
    let runs = directories.flatten().map(|run| RunFile::read(&run.path()));
    runs.flatten().collect()
}

fn is_started(run: &RunFile) -> bool {
    run.processes.len() == run.robots as usize + 3
}

#[test]
fn ctrl_c_and_sigterm_end_every_process_and_leave_nothing() {
    for (signal_number, arguments) in [
        (libc::SIGINT, &SLOW[..]),
        (libc::SIGTERM, &REAL[..]),
        (libc::SIGTERM, &[SLOW[0], SLOW[1], "--wait", "block"]),
    ] {
        let mut run = Run::start(arguments);
        signal(run.supervisor(), signal_number);
        let (status, result, stderr) = run.end();
        assert_eq!(status, 130, "{} {stderr}", result["reason"]);
        assert_eq!(result["outcome"], "interrupted");
        // The partial result is a whole one, of a checked run, be it of no tick yet.
        assert!(result["ticks"].is_u64());
        assert_eq!(result["checker"]["violations"], 0);
        assert_eq!(result["checker"]["complete"], true);
        run.assert_nothing_left();
    }
}

#[test]
fn ctrl_c_ends_a_run_whose_robot_is_stopped() {
    let mut run = Run::start(&SLOW);
    signal(run.pid_of(Role::Robot(0)), libc::SIGSTOP);
    std::thread::sleep(Duration::from_millis(100));
    signal(run.supervisor(), libc::SIGINT);
    let (status, result, stderr) = run.end();
    assert_eq!(status, 130, "{stderr}");
    assert_eq!(result["outcome"], "interrupted");
    run.assert_nothing_left();
}

#[test]
fn without_restarts_a_process_that_dies_ends_the_run_by_name() {
    for role in [Role::World, Role::Planner, Role::Recorder] {
        let mut run = Run::start(&[SLOW[0], SLOW[1], "--restart", "never"]);
        signal(run.pid_of(role), libc::SIGKILL);
        let (status, result, stderr) = run.end();
        assert_eq!(status, 7, "{role}: {stderr}");
        assert_eq!(result["outcome"], "failed", "{role}");
        let reason = result["reason"].as_str().unwrap();
        assert!(reason.contains(&role.to_string()), "{role}: {reason}");
        run.assert_nothing_left();
    }
}

#[test]
fn nothing_outlives_a_supervisor_that_is_killed() {
    let mut run = Run::start(&SLOW);
    // Even one that could not end by itself.
    signal(run.pid_of(Role::Robot(0)), libc::SIGSTOP);
    signal(run.supervisor(), libc::SIGKILL);
    run.child.take().unwrap().wait().unwrap();
    wait_until("the end of all processes", || {
        !run.file.processes.iter().any(|one| is_alive(one.pid))
    });
    assert!(!segments(&run.file.prefix).is_empty());
    let list = assert_cmd::Command::new(assert_cmd::cargo::cargo_bin!("rearrange"))
        .args(["list", "--json"])
        .env("XDG_RUNTIME_DIR", run.place.path())
        .assert()
        .success();
    let list: Value = serde_json::from_slice(&list.get_output().stdout).unwrap();
    assert_eq!(list[0]["live"], false, "{list}");
    assert_eq!(segments(&run.file.prefix), Vec::<PathBuf>::new());
    assert!(run.file.root.exists(), "it can be resumed");
}

#[test]
fn a_live_run_is_closed_to_others() {
    let run = Run::start(&SLOW);
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode(&run.file.root), 0o700);
    assert_eq!(mode(&run.file.root.join("run.json")), 0o600);
    assert_eq!(mode(&run.file.root.join("scenario.toml")), 0o600);
    let segments = segments(&run.file.prefix);
    assert!(segments.iter().any(|file| file.ends_with_mgmt()));
    for file in segments {
        assert_eq!(mode(&file) & 0o077, 0, "{file:?}");
    }
}

trait IsManagement {
    fn ends_with_mgmt(&self) -> bool;
}

impl IsManagement for PathBuf {
    fn ends_with_mgmt(&self) -> bool {
        self.to_string_lossy().ends_with(".global_mgmt")
    }
}

#[test]
fn processes_inherit_nothing_of_the_supervisor() {
    let run = Run::start(&SLOW);
    let descriptors = |pid: u32| {
        let files = fs::read_dir(format!("/proc/{pid}/fd")).unwrap().flatten();
        let targets = files.filter_map(|file| fs::read_link(file.path()).ok());
        targets.collect::<Vec<_>>()
    };
    let lock = run.file.root.join("lock");
    assert!(descriptors(run.supervisor()).contains(&lock));
    for process in &run.file.processes {
        let theirs = descriptors(process.pid);
        assert!(!theirs.contains(&lock), "{} holds {lock:?}", process.role);
        let stdout = fs::read_link(format!("/proc/{}/fd/1", process.pid)).unwrap();
        assert_eq!(stdout, Path::new("/dev/null"), "{}", process.role);
        // A group of its own: a Ctrl-C at the terminal reaches the supervisor alone.
        let pid = i32::try_from(process.pid).unwrap();
        // SAFETY: takes and returns numbers.
        assert_eq!(unsafe { libc::getpgid(pid) }, pid, "{}", process.role);
    }
}

#[test]
fn in_real_time_a_robot_that_stays_silent_is_declared_gone_and_the_others_go_on() {
    let mut arguments = REAL.to_vec();
    arguments.extend(["--restart", "never"]);
    let mut run = Run::start(&arguments);
    let robot = run.pid_of(Role::Robot(1));
    signal(robot, libc::SIGSTOP);
    wait_until("the end of the silent robot", || !is_alive(robot));
    for process in &run.file.processes {
        let gone = process.role == Role::Robot(1);
        assert_eq!(is_alive(process.pid), !gone, "{}", process.role);
    }
    std::thread::sleep(Duration::from_millis(500));
    signal(run.supervisor(), libc::SIGINT);
    let (status, result, stderr) = run.end();
    assert_eq!(status, 130, "{stderr}");
    assert_eq!(result["checker"]["violations"], 0);
    let notes = result["notes"].to_string();
    assert!(notes.contains("robot-1 was silent"), "{notes}");
    run.assert_nothing_left();
}

#[test]
fn every_way_to_wait_reaches_the_same_state() {
    let hash = |arguments: &[&str]| {
        let place = tempfile::Builder::new().prefix("rr").tempdir().unwrap();
        let mut command = binary(place.path());
        let child = command
            .args(["run", ROOM, "--json"])
            .args(arguments)
            .spawn();
        let (status, result, _) = finish(child.unwrap());
        (status, result["state_hash"].clone())
    };
    let hybrid = hash(&["--wait", "hybrid"]);
    assert_eq!(hybrid.0, 0);
    assert_eq!(hash(&["--wait", "block"]), hybrid);
    assert_eq!(hash(&["--wait", "block", "--realtime", "--pin"]), hybrid);
    let cores = std::thread::available_parallelism().unwrap().get();
    if cores < 5 {
        // World, planner, recorder and two robots would spin on fewer cores.
        assert_eq!(hash(&["--wait", "spin"]).0, 2);
        assert_eq!(hash(&["--wait", "hybrid", "--realtime"]).0, 2);
    } else {
        assert_eq!(hash(&["--wait", "spin"]), hybrid);
    }
}

/// Runs a plan in this process's own directory of runs.
fn supervise(program: &Path, options: RunOptions, deadline: Duration) -> RunReport {
    let scene = scene::parse(scene::builtin(ROOM).unwrap().text, ROOM).unwrap();
    let launcher = Launcher {
        program: program.to_owned(),
        before: Vec::new(),
        inherit_stderr: false,
    };
    let plan = RunPlan {
        setup_deadline: deadline,
        ..RunPlan::new(scene::to_canonical_toml(&scene), options, launcher)
    };
    supervisor::run(&plan, &mut ()).unwrap()
}

#[test]
fn a_process_that_hangs_while_setting_up_is_started_again_and_what_it_left_goes() {
    let place = tempfile::tempdir().unwrap();
    let script = place.path().join("launcher");
    let once = place.path().join("once");
    // The first robot 0 hangs, and leaves a half-made connection as a killed process can.
    let text = format!(
        "#!/bin/sh\n\
         if [ \"$1\" = robot ] && [ \"$5\" = 0 ] && mkdir {once} 2>/dev/null; then\n\
         : > /dev/shm/rr$(basename \"$3\")_half.connection\n\
         exec sleep 1000\n\
         fi\n\
         exec {program} \"$@\"\n",
        once = once.display(),
        program = assert_cmd::cargo::cargo_bin!("rearrange").display(),
    );
    fs::write(&script, text).unwrap();
    fs::set_permissions(&script, fs::Permissions::from_mode(0o700)).unwrap();
    let report = supervise(
        &script,
        RunOptions::new(Settings::default()),
        Duration::from_secs(5),
    );
    assert_eq!(report.outcome, Outcome::Solved, "{:?}", report.notes);
    assert_eq!(report.restarts, 1);
    assert!(
        report.notes.iter().any(|note| note.contains("1 half-made")),
        "{:?}",
        report.notes
    );
}

#[test]
fn a_report_tells_of_every_process_and_its_trace_can_be_read() {
    let delay = Delay {
        role: Role::Robot(1),
        ms: 1,
        ticks: 10,
    };
    let options = RunOptions {
        delays: vec![delay],
        ..RunOptions::new(Settings::default())
    };
    let program = PathBuf::from(assert_cmd::cargo::cargo_bin!("rearrange"));
    let report = supervise(&program, options, Duration::from_secs(60));
    assert_eq!(report.outcome, Outcome::Solved);
    let roles: Vec<_> = report.roles.iter().map(|role| role.role).collect();
    let expected = [
        Role::World,
        Role::Planner,
        Role::Robot(0),
        Role::Robot(1),
        Role::Recorder,
    ];
    assert_eq!(roles, expected);
    for role in &report.roles {
        assert_eq!(role.ticks_answered, report.world.ticks, "{}", role.role);
        assert!(role.cpu_s > 0.0, "{}", role.role);
        assert_eq!(role.lost, 0, "{}", role.role);
    }
    let activity = &report.world.activities[0];
    let sum = activity.moving + activity.computing + activity.waiting;
    let sum = sum + activity.gripping + activity.idle;
    assert_eq!(sum, report.world.ticks, "every tick is accounted for");
    let check = trace::check_file(report.trace.as_deref().unwrap()).unwrap();
    assert!(check.complete && check.violations.is_empty(), "{check:?}");
    assert_eq!(
        segments(&format!("rr{:08x}_", report.run_id)),
        Vec::<PathBuf>::new()
    );
}
