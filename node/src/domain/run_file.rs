//! `run.json` and the canonical scenario: what every process of a run starts from.
//!
//! Responsible for: what they hold and how they are read.
//! Not responsible for: writing them (`domain`), or what the options mean.

use std::fs;
use std::path::{Path, PathBuf};

use scene::Scene;
use serde::{Deserialize, Serialize};
use shm_types::Counts;
use shm_types::capacity::{LAYOUT_VERSION, MAX_OBJECTS};

use crate::domain::runs::prefix;
use crate::domain::{DomainError, RUN_FILE, SCENARIO_FILE, file_error, put};
use crate::options::{Recovery, Role, RunOptions};

/// `run.json`: what every process of the run starts from, and monitors find it by.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFile {
    /// Layout of the messages.
    pub layout_version: u32,
    /// Eight hexadecimal digits.
    pub id: String,
    /// Its name; the id if none was given.
    pub name: String,
    /// Prefix of its files in shared memory.
    pub prefix: String,
    /// Its directory, and the root of its iceoryx2 domain.
    pub root: PathBuf,
    /// Name of the scenario.
    pub scenario: String,
    /// Hash of the canonical scenario.
    pub scenario_hash: u64,
    /// Robots, as far as the supervisor has seen: some may be added on the way.
    pub robots: u32,
    /// Robots that there is room for in shared memory.
    pub most_robots: u32,
    /// Objects that it began with.
    pub objects: u32,
    /// Bytes of shared memory that all segments can come to hold.
    pub shared_memory_bytes: u64,
    /// Process id of the supervisor.
    pub supervisor_pid: u32,
    /// The processes, once started.
    pub processes: Vec<Process>,
    /// What the run was asked to be.
    pub options: RunOptions,
    /// What is done about processes that die.
    pub recovery: Recovery,
    /// How long a participant may be silent before it is killed, s.
    pub silence_limit_s: f64,
}

/// One process of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Process {
    /// Which participant.
    pub role: Role,
    /// Its process id.
    pub pid: u32,
    /// Which process of this participant it is, from 1.
    pub incarnation: u32,
}

impl RunFile {
    /// Its id as a number; 0 for an id that is none.
    #[must_use]
    pub fn id_number(&self) -> u64 {
        u64::from_str_radix(&self.id, 16).unwrap_or(0)
    }

    /// What it can come to have, and its shared memory has room for.
    #[must_use]
    pub const fn room(&self) -> Counts {
        Counts {
            robots: self.most_robots,
            objects: MAX_OBJECTS as u32,
        }
    }

    /// Reads the run in a directory.
    ///
    /// # Errors
    /// There is none of this version.
    pub fn read(directory: &Path) -> Result<Self, DomainError> {
        let path = directory.join(RUN_FILE);
        let text = fs::read_to_string(&path).map_err(|e| file_error(&path, e))?;
        let foreign = |reason: String| DomainError::Foreign {
            path: path.clone(),
            reason,
        };
        let mut run: Self = serde_json::from_str(&text).map_err(|e| foreign(e.to_string()))?;
        if run.layout_version != LAYOUT_VERSION {
            return Err(foreign(format!(
                "its messages have layout {}, this program's {LAYOUT_VERSION}",
                run.layout_version
            )));
        }
        // What is removed once a run is dead follows from these.
        if run.prefix != prefix(&run.id) {
            return Err(foreign(format!("{:?} is not its prefix", run.prefix)));
        }
        run.root = directory.to_owned();
        Ok(run)
    }

    /// The scene of this hash that is, or was, in force in the run in a directory.
    ///
    /// # Errors
    /// It cannot be read, or is none.
    pub fn read_version(directory: &Path, hash: u64) -> Result<Scene, DomainError> {
        let path = version_path(directory, hash);
        let text = fs::read_to_string(&path).map_err(|e| file_error(&path, e))?;
        let foreign = |reason: String| DomainError::Foreign {
            path: path.clone(),
            reason,
        };
        let scene = scene::parse_version(&text, "scenario.toml").map_err(|e| foreign(e.plain()))?;
        if scene.hash == hash {
            Ok(scene)
        } else {
            Err(foreign(format!("its hash is {:016x}", scene.hash)))
        }
    }

    /// Writes a version of the scene into the directory of a run, at once or not at all.
    ///
    /// # Errors
    /// The system refused.
    pub(crate) fn write_version(directory: &Path, scene: &Scene) -> Result<(), DomainError> {
        let path = version_path(directory, scene.hash);
        put(&path, scene::to_canonical_toml(scene).as_bytes())
    }

    /// The canonical scenario text of the run in a directory.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn read_scenario(directory: &Path) -> Result<String, DomainError> {
        let path = directory.join(SCENARIO_FILE);
        fs::read_to_string(&path).map_err(|e| file_error(&path, e))
    }
}

/// Versions are known by their hash, so that no two processes can mean different ones.
fn version_path(directory: &Path, hash: u64) -> PathBuf {
    directory.join(format!("scenario-{hash:016x}.toml"))
}
