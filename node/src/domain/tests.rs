//! Places of runs, each test in a directory of its own.

use super::runs::{Runs, check_name, default_path, prefix};
use super::*;
use rustix::fs::{FlockOperation, flock};
use scene::Settings;
use std::os::unix::fs::PermissionsExt;

fn runs() -> tempfile::TempDir {
    tempfile::Builder::new().prefix("rr").tempdir().unwrap()
}

fn create(runs: &Path, name: Option<&str>) -> Result<(RunDirectory, RunFile), DomainError> {
    let new = NewRun {
        name,
        scenario_text: "name = \"x\"",
        scenario: "x",
        scenario_hash: 7,
        counts: Counts {
            robots: 1,
            objects: 2,
        },
        shared_memory_bytes: 3,
        options: &RunOptions::new(Settings::default()),
        recovery: Recovery::default(),
        silence_limit_s: 1.0,
    };
    RunDirectory::create_in(runs.join("runs"), &new)
}

fn live(runs: &Path) -> Vec<RunFile> {
    Runs::open(runs.join("runs")).unwrap().all().unwrap().live
}

#[test]
fn a_run_is_private_found_by_others_and_gone_with_its_directory() {
    let runs = runs();
    let (directory, run) = create(runs.path(), None).unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode(directory.path()), 0o700);
    assert_eq!(mode(&directory.path().join(RUN_FILE)), 0o600);
    assert_eq!(RunFile::read(directory.path()).unwrap(), run);
    assert_eq!(live(runs.path()), std::slice::from_ref(&run));
    let segment = Path::new(shared_memory::SHARED_MEMORY).join(format!("{}x", run.prefix));
    fs::write(&segment, b"x").unwrap();
    let path = directory.path().to_owned();
    drop(directory);
    assert!(!path.exists() && !segment.exists());
    assert_eq!(live(runs.path()), []);
}

#[test]
fn a_live_name_is_refused_and_free_afterwards() {
    let runs = runs();
    let (first, _) = create(runs.path(), Some("mine")).unwrap();
    let refused = create(runs.path(), Some("mine"));
    assert!(matches!(refused, Err(DomainError::NameLive { .. })));
    create(runs.path(), Some("other")).unwrap();
    drop(first);
    create(runs.path(), Some("mine")).unwrap();
}

#[test]
fn what_a_dead_run_has_in_shared_memory_is_swept_away_and_nothing_else() {
    let runs = runs();
    let (alive, _) = create(runs.path(), None).unwrap();
    let (dead, run) = create(runs.path(), None).unwrap();
    let foreign = runs.path().join("runs/not-a-run");
    fs::create_dir(&foreign).unwrap();
    let segment = Path::new(shared_memory::SHARED_MEMORY).join(format!("{}x", run.prefix));
    fs::write(&segment, b"x").unwrap();
    let path = dead.path().to_owned();
    // A supervisor that is killed lets go of its lock and does nothing else.
    let RunDirectory { _lock, .. } = &dead;
    flock(_lock, FlockOperation::Unlock).unwrap();
    assert_eq!(live(runs.path()).len(), 1);
    assert!(path.exists() && !segment.exists(), "it can be resumed");
    let all = Runs::open(runs.path().join("runs")).unwrap().all().unwrap();
    assert_eq!(all.dead, [run]);
    assert!(alive.path().exists() && foreign.exists());
}

#[test]
fn a_directory_of_runs_that_others_may_enter_is_refused() {
    let runs = runs();
    let path = runs.path().join("runs");
    fs::create_dir(&path).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    assert!(matches!(
        Runs::open(path.clone()),
        Err(DomainError::NotPrivate { .. })
    ));
    fs::remove_dir(&path).unwrap();
    std::os::unix::fs::symlink(runs.path(), &path).unwrap();
    assert!(matches!(
        Runs::open(path),
        Err(DomainError::NotPrivate { .. })
    ));
}

#[test]
fn names_that_could_be_mistaken_are_refused() {
    for name in ["", "latest", "0123abcd", "a/b", "..", ".x", "a b", "é"] {
        let refused = check_name(name);
        assert!(matches!(refused, Err(DomainError::BadName(_))), "{name:?}");
    }
    for name in ["a", "paper-68a_2.b", "0123abcdx"] {
        check_name(name).unwrap();
    }
}

#[test]
fn a_run_of_another_version_is_refused() {
    let runs = runs();
    let (directory, mut run) = create(runs.path(), None).unwrap();
    run.layout_version += 1;
    directory.write_run(&run).unwrap();
    let error = RunFile::read(directory.path()).unwrap_err();
    assert!(matches!(error, DomainError::Foreign { .. }), "{error}");
}

#[test]
fn what_is_removed_later_does_not_hang_on_what_a_file_says() {
    let runs = runs();
    let (directory, mut run) = create(runs.path(), None).unwrap();
    run.root = "/home".into();
    directory.write_run(&run).unwrap();
    let read = RunFile::read(directory.path()).unwrap();
    assert_eq!(read.root, directory.path());
    run.prefix = String::new();
    directory.write_run(&run).unwrap();
    let error = RunFile::read(directory.path()).unwrap_err();
    assert!(matches!(error, DomainError::Foreign { .. }), "{error}");
}

#[test]
fn roots_and_prefixes_stay_short_enough_for_sockets() {
    let path = default_path().join("0123abcd");
    let length = path.as_os_str().len() + prefix("0123abcd").len();
    assert!(length <= MAX_ROOT_AND_PREFIX, "{length}");
}
