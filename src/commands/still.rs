//! `rearrange explain --at`: why each robot stood still at a time of a run.
//!
//! Responsible for: the words and the JSON.
//! Not responsible for: finding out (crate `trace`).

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use serde::Serialize;
use trace::{CheckError, Reader, Standing, Story};

use crate::exit::{Exit, Failure, Outcome};
use crate::{output, result};

/// All there is to tell, as JSON has it.
#[derive(Serialize)]
struct Told {
    schema_version: u32,
    trace: PathBuf,
    at_s: f64,
    robots: Vec<Standing>,
}

/// Explains; status 3 if the trace is none, 2 if it ends before.
pub(crate) fn main(trace: &Path, at_s: f64, json: bool) -> Outcome {
    let path = || trace.to_owned();
    let file = File::open(trace).map_err(|source| {
        let path = path();
        Failure::new(Exit::BadInput, CheckError::Open { path, source })
    })?;
    let unreadable = |source| {
        let path = path();
        Failure::new(Exit::BadInput, CheckError::Read { path, source })
    };
    let reader = Reader::new(BufReader::new(file)).map_err(unreadable)?;
    let story = Story::read(reader).map_err(unreadable)?;
    let until_s = story.until_s();
    if at_s > until_s {
        return Err(Failure::new(
            Exit::Usage,
            format!(
                "--at {at_s} is after the end of the trace, {until_s:.3} s: give an earlier time"
            ),
        ));
    }
    let told = Told {
        schema_version: result::SCHEMA_VERSION,
        trace: path(),
        at_s,
        robots: trace::standing(&story, at_s),
    };
    if json {
        output::print_json(&told)?;
    } else {
        let lines: Vec<_> = (told.robots.iter())
            .map(|robot| format!("  {}\n", robot.words))
            .collect();
        let name = &story.scene().name;
        output::print(&format!("{name} at {at_s:.3} s:\n{}", lines.concat()))?;
    }
    Ok(Exit::Success)
}
