//! Half-made files: removing them before everybody waits for them without end.
//!
//! Responsible for: finding a file that was left half-made by a process that is dead, while others
//! go on, the supervisor included: so on a thread of its own, which touches nothing but files.
//! Not responsible for: anything else that the dead leave (iceoryx2 cleans that up).
//!
//! A file is half-made for some microseconds while a living process makes it, who has it open all
//! that time; whoever waits for it opens it again and again, for a moment each. So a file that is
//! half-made at several looks in a row, and that no process of the run has open at all of them, is
//! nobody's. One whose maker is stopped stays, until the maker has been killed for its silence.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::shared_memory;

/// Sleep between two looks.
const PERIOD: Duration = Duration::from_millis(4);
/// Looks in a row at which a file must be half-made.
const LOOKS: u32 = 5;

/// The thread, until it is dropped.
pub(crate) struct Janitor {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    /// Living processes of the run.
    processes: Mutex<Vec<u32>>,
    over: AtomicBool,
    removed: AtomicU32,
}

impl Janitor {
    /// Begins to look after the files of `prefix`.
    ///
    /// # Errors
    /// No thread can be started.
    pub(crate) fn start(prefix: String) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("janitor".to_owned())
            .spawn(move || theirs.run(&prefix))?;
        Ok(Self {
            shared,
            thread: Some(thread),
        })
    }

    /// Says which processes of the run are alive, this one aside.
    pub(crate) fn know(&self, processes: impl Iterator<Item = u32>) {
        let known = &self.shared.processes;
        let mut known = known.lock().unwrap_or_else(PoisonError::into_inner);
        known.clear();
        known.extend(processes);
    }

    /// Files removed since this was last asked.
    pub(crate) fn take_removed(&self) -> u32 {
        self.shared.removed.swap(0, Ordering::Relaxed)
    }
}

impl Drop for Janitor {
    fn drop(&mut self) {
        self.shared.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn run(&self, prefix: &str) {
        let mut suspects: BTreeMap<PathBuf, Suspect> = BTreeMap::new();
        while !self.over.load(Ordering::Relaxed) {
            let found = shared_memory::half_made(prefix).unwrap_or_default();
            suspects.retain(|path, _| found.contains(path));
            if !found.is_empty() {
                let holders = self.holders();
                for path in found {
                    let suspect = suspects.entry(path.clone()).or_default();
                    if suspect.is_nobodys(&path, &holders) {
                        // Whoever waits for it makes it anew.
                        let removed = std::fs::remove_file(&path).is_ok();
                        self.removed
                            .fetch_add(u32::from(removed), Ordering::Relaxed);
                        suspects.remove(&path);
                    }
                }
            }
            std::thread::sleep(PERIOD);
        }
    }

    /// Who has which files of shared memory open.
    fn holders(&self) -> Vec<(u32, Vec<String>)> {
        let known = self
            .processes
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let own = std::process::id();
        let all: Vec<u32> = known.iter().copied().chain([own]).collect();
        drop(known);
        let opened = |pid| {
            let opened = shared_memory::opened_by(Path::new(&format!("/proc/{pid}")));
            (pid, opened)
        };
        all.into_iter().map(opened).collect()
    }
}

/// A file that was half-made at every look so far.
#[derive(Default)]
struct Suspect {
    looks: u32,
    /// Who had it open at every one of them.
    holders: Vec<u32>,
}

impl Suspect {
    /// Looks once more: whether nobody alive can be making it.
    fn is_nobodys(&mut self, path: &Path, opened: &[(u32, Vec<String>)]) -> bool {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let has = |names: &Vec<String>| names.iter().any(|other| *other == name);
        let now = opened.iter().filter(|(_, names)| has(names));
        let now: Vec<u32> = now.map(|(pid, _)| *pid).collect();
        if self.looks == 0 {
            self.holders = now;
        } else {
            self.holders.retain(|pid| now.contains(pid));
        }
        self.looks += 1;
        self.looks >= LOOKS && self.holders.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_somebody_has_open_at_every_look_is_being_made() {
        let path = Path::new("/dev/shm/rr_x.connection");
        let holds = |pid: u32| (pid, vec!["rr_x.connection".to_owned()]);
        let mut left = Suspect::default();
        let mut made = Suspect::default();
        for look in 1..=LOOKS + 3 {
            // One process waits for it and has it open now and then, by chance.
            let waits = if look % 2 == 0 {
                vec![holds(7)]
            } else {
                Vec::new()
            };
            assert_eq!(left.is_nobodys(path, &waits), look >= LOOKS, "{look}");
            assert!(!made.is_nobodys(path, &[holds(8)]), "{look}");
        }
        assert!(made.is_nobodys(path, &[]), "its maker has died");
    }

    #[test]
    fn a_file_that_nobody_makes_is_removed_and_whole_ones_stay() {
        let prefix = format!("rrjan{}_", std::process::id());
        let at = |name: &str| Path::new("/dev/shm").join(format!("{prefix}{name}"));
        let (half, whole, held) = (at("half"), at("whole"), at("held"));
        std::fs::write(&half, b"").unwrap();
        std::fs::write(&whole, b"x").unwrap();
        let maker = std::fs::File::create(&held).unwrap();
        let janitor = Janitor::start(prefix).unwrap();
        let by = std::time::Instant::now() + Duration::from_secs(20);
        while half.exists() && std::time::Instant::now() < by {
            std::thread::sleep(PERIOD);
        }
        std::thread::sleep(PERIOD * LOOKS * 2);
        let left = (half.exists(), whole.exists(), held.exists());
        drop(maker);
        while held.exists() && std::time::Instant::now() < by {
            std::thread::sleep(PERIOD);
        }
        let removed = janitor.take_removed();
        drop(janitor);
        std::fs::remove_file(&whole).unwrap();
        assert_eq!(left, (false, true, true));
        assert_eq!(removed, 2);
        assert!(!held.exists());
    }
}
