//! `rearrange resume`: a run whose supervisor has died is gone on with, to the result it would have
//! had.
//!
//! Responsible for: the result of the whole run, from what its directory says.
//! Not responsible for: how it goes on (crate `node`).

use crate::cli::ResumeArgs;
use crate::commands::run;
use crate::drivers::processes;
use crate::exit::Outcome;
use crate::progress::Progress;

/// Goes on with it, and prints the result.
pub(crate) fn main(args: &ResumeArgs) -> Outcome {
    let mut progress = Progress::new(0);
    let resumed = processes::resume(&args.run, &mut progress);
    progress.clear();
    let (scene, options, finished) = resumed?;
    let frame = run::frame(&scene, run::PROCESSES, &options);
    run::tell(&run::complete(frame, &scene, finished), args.json)
}
