//! The trace of a run in this process, and its check.
//!
//! Responsible for: the file: the one asked for, or one without a name that is gone when the
//! program is.
//! Not responsible for: what is in a trace, or what makes it a legal one (crate `trace`).

use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Seek};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use shm_types::{Checked, MotionBatch, WorldSnapshot};
use trace::{CheckReport, Ending, SceneRecord, WriteError, Writer};

/// Why there is no trace, or no check of it.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RecordingError {
    /// The file cannot be made.
    #[error("could not make the trace {}: {source}", path.display())]
    Create {
        /// Which.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The file cannot be read again.
    #[error("could not read the trace back: {0}")]
    Reread(#[from] io::Error),
    /// What was written is no trace.
    #[error("could not check the trace: {0}")]
    Check(#[from] trace::ReadError),
}

/// A trace that is being written.
pub(crate) struct Recording {
    /// Whether it was asked for.
    kept: bool,
    writer: Writer<BufWriter<File>>,
}

impl Recording {
    /// Starts a trace at `path`, or in a file without a name.
    ///
    /// # Errors
    /// The file cannot be made or written.
    pub(crate) fn start(
        path: Option<&Path>,
        scene: &SceneRecord,
        state_every_ns: u64,
    ) -> Result<Self, RecordingError> {
        let file = match path {
            Some(path) => create(path, false)?,
            None => nameless()?,
        };
        Ok(Self {
            kept: path.is_some(),
            writer: Writer::new(BufWriter::new(file), scene, state_every_ns)?,
        })
    }

    /// From here on another version of the scene holds.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn change(&mut self, scene: &SceneRecord) -> Result<(), RecordingError> {
        Ok(self.writer.change(scene)?)
    }

    /// Adds the motion and events of a tick.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn motion(&mut self, motion: &MotionBatch) -> Result<(), RecordingError> {
        Ok(self.writer.batch(motion)?)
    }

    /// Offers a state: those that are due are kept.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn state(
        &mut self,
        snapshot: Checked<'_, WorldSnapshot>,
    ) -> Result<(), RecordingError> {
        Ok(self.writer.snapshot(snapshot)?)
    }

    /// Ends the trace and checks it. If something is wrong in one that was not to be kept, it is
    /// kept all the same, and this says where.
    ///
    /// # Errors
    /// The file cannot be written, or not read again.
    pub(crate) fn finish(
        self,
        ending: Ending,
    ) -> Result<(CheckReport, Option<PathBuf>), RecordingError> {
        let mut file = self
            .writer
            .finish(ending)?
            .into_inner()
            .map_err(io::IntoInnerError::into_error)?;
        file.rewind()?;
        let report = trace::check(BufReader::new(&file))?;
        let wanted = !self.kept && !report.violations.is_empty();
        let evidence = wanted.then(|| keep(file)).transpose()?;
        Ok((report, evidence))
    }
}

/// Copies a trace that has no name to where somebody can look at it.
///
/// # Errors
/// The file cannot be read or the copy not written.
pub(crate) fn keep(mut file: File) -> Result<PathBuf, RecordingError> {
    let (path, mut copy) = temporary("rearrange-violation")?;
    file.rewind()?;
    io::copy(&mut file, &mut copy)?;
    Ok(path)
}

/// A file that has no name any more: nothing is left of it whatever happens.
fn nameless() -> Result<File, RecordingError> {
    let (path, file) = temporary("rearrange")?;
    fs::remove_file(&path).map_err(|source| RecordingError::Create { path, source })?;
    Ok(file)
}

/// A new file in the directory for temporary ones, which only its owner can read.
fn temporary(first: &str) -> Result<(PathBuf, File), RecordingError> {
    let since = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    let name = format!("{first}-{}-{}.mcap", std::process::id(), since.as_nanos());
    let path = std::env::temp_dir().join(name);
    let file = create(&path, true)?;
    Ok((path, file))
}

fn create(path: &Path, new: bool) -> Result<File, RecordingError> {
    let mut options = File::options();
    options.read(true).write(true);
    if new {
        options.create_new(true).mode(0o600);
    } else {
        options.create(true).truncate(true);
    }
    options.open(path).map_err(|source| RecordingError::Create {
        path: path.to_owned(),
        source,
    })
}
