//! What happened to the processes of a run, as lines of JSON in its directory.
//!
//! Responsible for: one line each time a process is started, ready, ended or given up, and when
//! tasks are done, with the time; it goes on when the run is resumed.
//! Not responsible for: what happened in the run itself (its trace).
//!
//! `rearrange chaos` reads along: it is how somebody outside sees who recovers and how fast.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::clock;
use crate::options::Role;

/// Its name in a run's directory.
pub const DIARY_FILE: &str = "diary.jsonl";

/// What happened.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "what")]
pub enum Happened {
    /// A supervisor has begun its work, or taken it over.
    Supervised {
        /// Its process id.
        pid: u32,
    },
    /// A process was started.
    Started {
        /// As what.
        role: Role,
        /// Its process id.
        pid: u32,
        /// Which process of this participant it is, from 1.
        incarnation: u32,
    },
    /// It has answered its first tick.
    Ready {
        /// Who.
        role: Role,
        /// Its process id.
        pid: u32,
    },
    /// It has ended before the run.
    Ended {
        /// Who.
        role: Role,
        /// Its process id.
        pid: u32,
        /// `signal 9`, `status 7`.
        how: String,
        /// Its last words, if it ended by itself.
        words: Option<String>,
    },
    /// It was silent for too long, and was killed.
    Silent {
        /// Who.
        role: Role,
        /// Its process id.
        pid: u32,
    },
    /// It is not started again.
    Gone {
        /// Who.
        role: Role,
    },
    /// Half-made files were removed.
    Cleared {
        /// How many.
        files: u32,
    },
    /// So many tasks are open from here on.
    Open {
        /// How many.
        tasks: usize,
    },
    /// The run is over.
    Over,
}

/// A line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// When, `CLOCK_MONOTONIC`, ns.
    pub at_ns: u64,
    /// What.
    #[serde(flatten)]
    pub happened: Happened,
}

/// The file.
pub(crate) struct Diary(File);

impl Diary {
    /// Goes on with the diary of the run in `directory`, or begins it.
    ///
    /// # Errors
    /// The system refused.
    pub(crate) fn open(directory: &Path) -> io::Result<Self> {
        let mut options = OpenOptions::new();
        let options = options.append(true).create(true).mode(0o600);
        Ok(Self(options.open(directory.join(DIARY_FILE))?))
    }

    /// Adds a line. One that cannot be written is lost: nothing depends on it.
    pub(crate) fn note(&mut self, happened: Happened) {
        let entry = Entry {
            at_ns: clock::now_ns(),
            happened,
        };
        if let Ok(mut line) = serde_json::to_vec(&entry) {
            line.push(b'\n');
            let _ = self.0.write_all(&line);
        }
    }
}

/// Who was started in the run in `directory` so far, and as which process.
pub(crate) fn started(directory: &Path) -> Vec<(Role, u32)> {
    let text = std::fs::read_to_string(directory.join(DIARY_FILE)).unwrap_or_default();
    let entries = text
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok());
    let started = entries.filter_map(|entry: Entry| match entry.happened {
        Happened::Started {
            role, incarnation, ..
        } => Some((role, incarnation)),
        _ => None,
    });
    started.collect()
}
