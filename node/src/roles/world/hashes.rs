//! The state hash of each tick, in a file: what two runs are compared by.
//!
//! Responsible for: one line of sixteen hexadecimal digits for each tick from the first on.
//! Not responsible for: what is hashed (crate `world`).

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::roles::RoleError;

/// A file of hashes.
pub(super) struct HashFile {
    path: PathBuf,
    file: BufWriter<File>,
}

impl HashFile {
    pub(super) fn create(path: &Path) -> Result<Self, RoleError> {
        let file = File::create(path).map_err(|error| file_error(path, &error))?;
        Ok(Self {
            path: path.to_owned(),
            file: BufWriter::new(file),
        })
    }

    pub(super) fn add(&mut self, hash: u64) -> Result<(), RoleError> {
        writeln!(self.file, "{hash:016x}").map_err(|error| file_error(&self.path, &error))
    }

    pub(super) fn flush(&mut self) -> Result<(), RoleError> {
        self.file
            .flush()
            .map_err(|error| file_error(&self.path, &error))
    }
}

fn file_error(path: &Path, error: &io::Error) -> RoleError {
    RoleError::File {
        path: path.to_owned(),
        reason: error.to_string(),
    }
}
