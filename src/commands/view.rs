//! `rearrange view`: a run to look at, as a page that plays it or as a still.
//!
//! Responsible for: which files are written, and that they can be before the trace is read: a
//! file that was there stays as it was until what replaces it is ready.
//! Not responsible for: reading the trace, the page or the still (crate `trace`).

use std::fs::{self, File};
use std::io::{BufReader, Write};
use std::path::{Path, PathBuf};

use trace::{CheckError, Reader, Story};

use crate::cli::ViewArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::output;

/// Makes what was asked for; status 3 if the trace is none, 7 if an output cannot be written.
pub(crate) fn main(args: &ViewArgs) -> Outcome {
    if args.clash() {
        return Err(Failure::new(
            Exit::Usage,
            "--output and --svg are the same: give two files",
        ));
    }
    let file = File::open(&args.trace).map_err(|source| {
        let path = args.trace.clone();
        Failure::new(Exit::BadInput, CheckError::Open { path, source })
    })?;
    let unreadable = |source| {
        let path = args.trace.clone();
        Failure::new(Exit::BadInput, CheckError::Read { path, source })
    };
    let reader = Reader::new(BufReader::new(file)).map_err(unreadable)?;
    let page = Target::of(args.output.as_deref(), args)?;
    let still = Target::of(args.svg.as_deref(), args)?;
    let story = Story::read(reader).map_err(unreadable)?;
    let until_s = story.until_s();
    if let Some(at_s) = args.at.filter(|at_s| *at_s > until_s) {
        return Err(Failure::new(
            Exit::Usage,
            format!(
                "--at {at_s} is after the end of the trace, {until_s:.3} s: give an earlier time"
            ),
        ));
    }
    if let Some(page) = page {
        page.write(&trace::page(&story, args.at.unwrap_or(0.0)))?;
    }
    if let Some(still) = still {
        still.write(&trace::still(&story, args.at.unwrap_or(until_s)))?;
    }
    if story.is_cut_short() {
        output::complain(&format!(
            "{} is cut short: what was written shows the run up to {until_s:.3} s of world time",
            args.trace.display()
        ));
    }
    Ok(Exit::Success)
}

/// Where an output goes. Dropped before it was written, it leaves nothing.
enum Target {
    Stdout,
    File {
        path: PathBuf,
        /// Opened without changing what is in it.
        file: File,
        /// Made by this command and not written yet.
        empty: bool,
    },
}

impl Target {
    /// Opens an output; none for none.
    fn of(path: Option<&Path>, args: &ViewArgs) -> Result<Option<Self>, Failure> {
        let Some(path) = path else {
            return Ok(None);
        };
        if path == Path::new("-") {
            return Ok(Some(Self::Stdout));
        }
        let cannot =
            |error| Failure::system(format!("{} cannot be written: {error}", path.display()));
        let empty = !path.exists();
        let file = File::options()
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .map_err(cannot)?;
        let target = Self::File {
            path: path.to_owned(),
            file,
            empty,
        };
        if same(path, &args.trace) {
            let message = format!(
                "{} is the trace itself: give another file to write to",
                path.display()
            );
            return Err(Failure::new(Exit::Usage, message));
        }
        Ok(Some(target))
    }

    fn write(mut self, text: &str) -> Result<(), Failure> {
        match &mut self {
            Self::Stdout => output::print(text),
            Self::File { path, file, empty } => {
                // A pipe or a terminal has no length.
                let regular = file.metadata().is_ok_and(|about| about.is_file());
                let emptied = if regular { file.set_len(0) } else { Ok(()) };
                emptied
                    .and_then(|()| file.write_all(text.as_bytes()))
                    .map_err(|error| {
                        Failure::system(format!("{} cannot be written: {error}", path.display()))
                    })?;
                *empty = false;
                output::complain(&format!("wrote {}", path.display()));
                Ok(())
            }
        }
    }
}

impl Drop for Target {
    fn drop(&mut self) {
        if let Self::File {
            path, empty: true, ..
        } = self
        {
            let _ = fs::remove_file(path);
        }
    }
}

/// Whether two names are of one file.
fn same(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}
