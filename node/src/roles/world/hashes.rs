//! The state hash of each tick, in a file: what two runs are compared by.
//!
//! Responsible for: one line of sixteen hexadecimal digits for each tick from the first on.
//! Not responsible for: what is hashed (crate `world`).

use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::roles::RoleError;

/// Bytes of a line.
const LINE: u64 = 17;

/// A file of hashes.
pub(super) struct HashFile {
    path: PathBuf,
    file: File,
}

impl HashFile {
    /// Keeps the lines of the first `ticks` ticks, of a world process before this one.
    pub(super) fn create(path: &Path, ticks: u64) -> Result<Self, RoleError> {
        let open = || {
            let mut file = OpenOptions::new()
                .write(true)
                .create(true)
                .truncate(false)
                .open(path)?;
            file.set_len(ticks * LINE)?;
            file.seek(SeekFrom::End(0))?;
            Ok(file)
        };
        Ok(Self {
            path: path.to_owned(),
            file: open().map_err(|error| file_error(path, &error))?,
        })
    }

    /// Adds a line, which is in the file when this returns.
    pub(super) fn add(&mut self, hash: u64) -> Result<(), RoleError> {
        let line = format!("{hash:016x}\n");
        (self.file.write_all(line.as_bytes())).map_err(|error| file_error(&self.path, &error))
    }
}

fn file_error(path: &Path, error: &io::Error) -> RoleError {
    RoleError::File {
        path: path.to_owned(),
        reason: error.to_string(),
    }
}
