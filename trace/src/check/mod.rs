//! The independent checker: replays a trace and says what was not legal in it.
//!
//! Responsible for: what is checked, the report, reading span by span.
//! Not responsible for: geometry in time (`geometry`), who may touch whom (`rules`), where bodies
//! are (`bodies`).
//!
//! It shares no code with what planned, granted or moved: it takes numbers from the trace alone
//! and has its own closed-form geometry, so a fault in one is seen by the other (rule 26).

mod bodies;
mod checker;
mod ending;
mod events;
mod gap;
pub(crate) mod geometry;
mod grid;
mod pairs;
mod report;
mod rules;
#[cfg(test)]
mod tests;

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use crate::reader::{ReadError, Reader};

pub use report::{CheckReport, Kind, Violation, Who};

/// Why a trace file cannot be checked.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// The file cannot be opened.
    #[error("could not open {path}: {source}")]
    Open {
        /// Which file.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The file cannot be read as a trace.
    #[error("{path} {source}")]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why not.
        source: ReadError,
    },
}

/// Checks a trace file.
///
/// # Errors
/// It cannot be opened, is no trace, or is damaged. A file that was merely cut short is checked up
/// to its last whole chunk, and the report says so.
pub fn check_file(path: &Path) -> Result<CheckReport, CheckError> {
    let file = File::open(path).map_err(|source| CheckError::Open {
        path: path.to_owned(),
        source,
    })?;
    check(BufReader::new(file)).map_err(|source| CheckError::Read {
        path: path.to_owned(),
        source,
    })
}

/// Checks a trace from any source.
///
/// # Errors
/// As [`check_file`], but for opening.
pub fn check(source: impl Read) -> Result<CheckReport, ReadError> {
    let mut reader = Reader::new(source)?;
    let mut checker = checker::Checker::new(reader.scene().clone());
    for span in reader.by_ref() {
        checker.span(span?);
    }
    Ok(checker.finish(reader.has_ended()))
}
