//! What shared memory costs as robots are added: real processes, beside what they are made of.
//!
//! Responsible for: what is asked for, the order of measuring, and what follows from it.
//! Not responsible for: starting processes (crate `node`), command lines or printing.
//!
//! Terms: *ours* is a whole run of this program; *bare* is iceoryx2 with the same message, readers,
//! processes and waits, whose readers do nothing but answer; *cache line* and *datagram* are what lies below and what
//! lies beside. All are measured in turn, again and again, so that whatever the machine does
//! besides meets all of them.
//!
//! In lockstep the next snapshot waits for all answers to the last: a loop that is closed, in which
//! a stall delays everything and is seen once. So lockstep has no intended times, and its ages are
//! those of a system that waits. In real time everybody keeps deadlines of a grid that does not
//! wait: there lateness counts from the deadline, once for each that a stall has swallowed.

mod cache_line;
mod combination;
mod datagram;
mod figures;
mod findings;
mod measure;
mod room;
mod rows;

use std::io;
use std::time::Duration;

use node::{Launcher, Signals, Wait};

use crate::conditions::Conditions;
use crate::figure::Figure;
use crate::files::Tagged;
use crate::progress::Progress;
use crate::results::Results;
pub use combination::{Combination, Place};
use measure::Bench;

/// Fewest objects that are typical, if the list has them.
const TYPICAL_OBJECTS: usize = 100;

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Numbers of robots.
    pub robots: Vec<usize>,
    /// Numbers of objects.
    pub objects: Vec<usize>,
    /// Waits in lockstep.
    pub waits: Vec<Wait>,
    /// How often everything is measured.
    pub repeats: usize,
    /// How long each is measured, each time, about.
    pub measured: Duration,
    /// Every wait with every way to pin and to prioritise.
    pub full: bool,
    /// Fewer of them than by default.
    pub quick: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            robots: vec![1, 2, 4, 8, 16, 32, 64],
            objects: vec![10, 100, 1_000],
            waits: vec![Wait::Spin, Wait::Hybrid, Wait::Block],
            repeats: 5,
            measured: Duration::from_millis(500),
            full: false,
            quick: false,
        }
    }
}

impl Options {
    /// Objects where not they are what is varied.
    fn typical_objects(&self) -> usize {
        let typical = self
            .objects
            .iter()
            .copied()
            .find(|objects| *objects == TYPICAL_OBJECTS);
        typical
            .or_else(|| self.objects.iter().copied().min())
            .unwrap_or(TYPICAL_OBJECTS)
    }

    /// Wall time it will all take, s, about.
    #[must_use]
    pub fn estimate_s(&self) -> f64 {
        let runs: f64 = Combination::all(self)
            .iter()
            .map(|one| one.estimate(self.measured))
            .sum();
        let datagrams = self.robots.len() + self.objects.len();
        let references = (datagrams + 1) as f64 * self.measured.as_secs_f64();
        self.repeats as f64 * (runs + references)
    }
}

/// What was found.
#[derive(Debug)]
pub struct Found {
    /// Rows and findings.
    pub results: Results,
    /// Figures of them.
    pub figures: Vec<Figure>,
    /// All histograms, all repeats together.
    pub histograms: Vec<Tagged>,
}

/// Measures all that is asked for. A run that fails is a row; an interruption ends the measuring
/// and keeps the rows.
///
/// # Errors
/// Signals cannot be watched.
pub fn run(
    options: &Options,
    launcher: &Launcher,
    command: &str,
    progress: &mut dyn Progress,
) -> io::Result<Found> {
    // Held over all runs, so that a signal between two ends the measuring and not the program.
    let _signals = Signals::watch()?;
    let conditions = Conditions::begin();
    let mut bench = Bench::new(options, launcher);
    let partial = bench.run(progress);
    let mut results = Results::new("latency", command);
    results.conditions = conditions.end();
    results.conditions.insert(
        "processes".to_owned(),
        "robots + world, planner and recorder, and a supervisor that sleeps".to_owned(),
    );
    results.partial = partial;
    let (tables, histograms) = bench.into_parts();
    results.tables = tables;
    results.findings = findings::all(&results, options);
    let figures = figures::all(&results, &histograms, options);
    Ok(Found {
        results,
        figures,
        histograms: histograms.into_iter().map(rows::Kept::tagged).collect(),
    })
}
