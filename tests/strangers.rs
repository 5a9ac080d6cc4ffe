//! Who may enter a run: another user lists, opens, empties and writes every file of it, and is kept
//! out.
//!
//! Needs root and setpriv(1), to become somebody else. Where there is neither it is ignored, and says
//! so; `.ci/run` runs it where it can.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use node::domain::RunFile;

const WATCHDOG: Duration = Duration::from_secs(60);

/// What a shell of another user can do to a file: one word for each thing that worked.
fn tried(path: &Path) -> String {
    let script = "\
        [ -r \"$1\" ] && head -c 1 \"$1\" >/dev/null && echo read\n\
        ( : >> \"$1\" ) 2>/dev/null && echo append\n\
        truncate -s 0 \"$1\" 2>/dev/null && echo empty\n\
        chmod 0666 \"$1\" 2>/dev/null && echo chmod\n\
        mv \"$1\" \"$1.x\" 2>/dev/null && echo rename\n\
        rm -f \"$1\" 2>/dev/null && echo remove\n\
        true";
    let output = as_a_stranger()
        .args(["sh", "-c", script, "sh"])
        .arg(path)
        .output()
        .unwrap();
    String::from_utf8_lossy(&output.stdout)
        .replace('\n', " ")
        .trim()
        .to_owned()
}

fn as_a_stranger() -> Command {
    let mut command = Command::new("setpriv");
    command
        .args(["--reuid", "65534", "--regid", "65534", "--clear-groups"])
        .stdin(Stdio::null())
        .stderr(Stdio::null());
    command
}

#[test]
#[ignore = "needs root and setpriv: it becomes another user"]
fn another_user_can_list_names_in_shared_memory_and_nothing_else() {
    assert!(rustix::process::geteuid().is_root(), "it needs root");
    let place = tempfile::Builder::new().prefix("rr").tempdir().unwrap();
    let mut child = Command::new(assert_cmd::cargo::cargo_bin!("rearrange"))
        .args(["run", "e1", "--json", "--delay", "world=20"])
        .env("XDG_RUNTIME_DIR", place.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let started = Instant::now();
    let run = loop {
        assert!(started.elapsed() < WATCHDOG, "no run");
        let runs = fs::read_dir(place.path().join("rearrange"))
            .into_iter()
            .flatten();
        let mut runs = runs
            .flatten()
            .filter_map(|run| RunFile::read(&run.path()).ok());
        match runs.next() {
            Some(run) if run.processes.len() == 5 => break run,
            _ => std::thread::sleep(Duration::from_millis(5)),
        }
    };
    std::thread::sleep(Duration::from_millis(500));
    // The way to the place is open to all; what is in it is not.
    let open = std::os::unix::fs::PermissionsExt::from_mode(0o755);
    fs::set_permissions(place.path(), open).unwrap();
    let listed = as_a_stranger()
        .args(["ls", "-1", "/dev/shm"])
        .output()
        .unwrap();
    let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
    let segments: Vec<PathBuf> = fs::read_dir("/dev/shm")
        .unwrap()
        .flatten()
        .map(|file| file.path())
        .filter(|path| path.to_string_lossy().contains(&run.prefix))
        .collect();
    let mut broken: Vec<String> = Vec::new();
    let own = fs::read_dir(&run.root)
        .unwrap()
        .flatten()
        .map(|file| file.path());
    let files: Vec<PathBuf> = own
        .chain(segments.iter().cloned())
        .chain([run.root.clone()])
        .collect();
    let count = files.len();
    for file in files {
        let worked = tried(&file);
        if !worked.is_empty() {
            broken.push(format!("{}: {worked}", file.display()));
        }
    }
    let goes_on = child.try_wait().unwrap().is_none();
    let pid = rustix::process::Pid::from_child(&child);
    rustix::process::kill_process(pid, rustix::process::Signal::INT).unwrap();
    child.wait().unwrap();
    assert!(
        listed.contains(&run.prefix),
        "names can be listed, and SECURITY.md says so"
    );
    assert!(segments.len() > 10 && count > segments.len() + 5, "{count}");
    assert_eq!(broken, Vec::<String>::new());
    assert!(goes_on);
    // The trial itself works: on a file that is open to all everything does.
    let open = std::env::temp_dir().join(format!("rr-open-{}", std::process::id()));
    fs::write(&open, b"x").unwrap();
    let all = std::os::unix::fs::PermissionsExt::from_mode(0o666);
    fs::set_permissions(&open, all).unwrap();
    let worked = tried(&open);
    let _ = fs::remove_file(&open);
    assert!(worked.starts_with("read append empty"), "{worked}");
}
