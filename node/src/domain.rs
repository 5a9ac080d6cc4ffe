//! Where a run lives.

use std::path::PathBuf;

use crate::options::Clock;

/// The directory of a run; dropping it removes it.
#[derive(Debug)]
pub struct RunDirectory(PathBuf);

/// A live run, as `list` tells it.
#[derive(Clone, Debug, serde::Serialize)]
pub struct LiveRun {
    /// Its id, in hexadecimal.
    pub id: String,
    /// Its name.
    pub name: String,
    /// Its directory.
    pub directory: PathBuf,
    /// Process id of its supervisor.
    pub supervisor_pid: u32,
    /// Name of its scenario.
    pub scenario: String,
    /// Robots that take part.
    pub robots: u32,
    /// Who sets the pace.
    pub clock: Clock,
}

/// Every live run of this user.
///
/// # Errors
/// The directory of runs cannot be read or is not private.
pub fn list() -> std::io::Result<Vec<LiveRun>> {
    todo!()
}
