//! `rearrange bench`: one file per workload, and what they share: where results go, who watches.
//!
//! Responsible for: making the output directory before anything is measured, progress on a
//! terminal, Ctrl-C, what is printed at the end.
//! Not responsible for: the measurements (crate `bench`).

mod compare;
mod latency;
mod paper;
mod planning;
mod scale;
mod solve;
mod speed;

use std::path::{Path, PathBuf};

use bench::figure::Figure;
use bench::files::{Output, PAGE, Tagged};
use bench::results::Results;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::cli::{OutputArgs, Workload};
use crate::drivers::interrupt::Interrupt;
use crate::exit::{Exit, Failure, Outcome};
use crate::output;

/// Measures what the command line asks for.
pub(crate) fn main(workload: &Workload) -> Outcome {
    match workload {
        Workload::Speed(args) => speed::main(args),
        Workload::Paper(args) => paper::main(args),
        Workload::Compare(args) => compare::main(args),
        Workload::Latency(args) => latency::main(args),
        Workload::Planning(args) => planning::main(args),
        Workload::Scale(args) => scale::main(args),
        Workload::Solve(args) => solve::main(args),
    }
}

/// The command line as it was typed, to stand in results.
pub(crate) fn command_line() -> String {
    let arguments = std::env::args().skip(1);
    std::iter::once("rearrange".to_owned())
        .chain(arguments)
        .collect::<Vec<_>>()
        .join(" ")
}

/// Where one benchmark's results go.
pub(crate) struct Destination {
    dir: PathBuf,
    output: Output,
    json: bool,
}

impl Destination {
    /// Makes the directory, before anything is measured.
    ///
    /// # Errors
    /// It cannot be made or written.
    pub(crate) fn create(benchmark: &str, args: &OutputArgs) -> Result<Self, Failure> {
        let default = || Path::new("target/bench").join(benchmark);
        let dir = args.out.clone().unwrap_or_else(default);
        let output = Output::create(&dir).map_err(Failure::system)?;
        Ok(Self {
            dir,
            output,
            json: args.json,
        })
    }

    /// Writes the files, prints the results as JSON if asked for and `text` if not, and says
    /// where the files are.
    ///
    /// # Errors
    /// A file cannot be written.
    pub(crate) fn finish(
        &self,
        results: &Results,
        figures: &[Figure],
        histograms: &[Tagged],
        text: &str,
    ) -> Outcome {
        self.output
            .write(results, figures, histograms)
            .map_err(Failure::system)?;
        if self.json {
            output::print_json(results)?;
        } else {
            output::print(text)?;
            output::print(&format!("\n{}\n", self.dir.join(PAGE).display()))?;
        }
        Ok(if results.partial {
            Exit::Interrupted
        } else {
            Exit::Success
        })
    }
}

/// A measurement's progress on a terminal, and Ctrl-C.
pub(crate) struct Watch {
    bar: ProgressBar,
    interrupt: Interrupt,
}

impl Watch {
    /// # Errors
    /// Signals cannot be watched.
    pub(crate) fn start() -> Result<Self, Failure> {
        let interrupt = Interrupt::watch()
            .map_err(|error| Failure::system(format!("signals cannot be watched: {error}")))?;
        let target = if output::is_watched() {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(None, target);
        let style = "[{bar:20}] {pos}/{len}  {elapsed} (about {eta} to go)  {wide_msg}";
        if let Ok(style) = ProgressStyle::with_template(style) {
            bar.set_style(style.progress_chars("=> "));
        }
        Ok(Self { bar, interrupt })
    }
}

impl bench::progress::Progress for Watch {
    fn begin(&mut self, steps: u64) {
        self.bar.set_length(steps);
        self.bar.set_position(0);
    }

    fn step(&mut self, what: &str) {
        self.bar.set_message(what.to_owned());
        self.bar.inc(1);
    }

    fn is_interrupted(&self) -> bool {
        self.interrupt.is_asked()
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
