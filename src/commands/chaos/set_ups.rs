//! How long set-ups last, from what was seen of them.
//!
//! Responsible for: a guess for each role, from one run to the next. A blow that came too late, since
//! it was guessed too long, comes in time in one of the next runs.
//! Not responsible for: what is struck then (`victim`).

use std::collections::BTreeMap;

use crate::cli::Target;

/// What the set-up of a process is taken to last before one was seen, ns; that of a supervisor is
/// over when all of its processes are.
const FIRST_GUESS_NS: u64 = 40_000_000;
const FIRST_GUESS_OF_ALL_NS: u64 = 4 * FIRST_GUESS_NS;

/// How long the set-up of each role usually lasts, ns.
#[derive(Debug, Default)]
pub(crate) struct SetUps(BTreeMap<Target, u64>);

impl SetUps {
    /// One of this role has lasted so long: what the newest did weighs an eighth.
    pub(crate) fn learn(&mut self, target: Target, lasted_ns: u64) {
        let usual = self.0.entry(target).or_insert(lasted_ns);
        *usual = *usual - *usual / 8 + lasted_ns / 8;
    }

    /// How long the next one is taken to last, ns.
    pub(crate) fn usual_ns(&self, target: Target) -> u64 {
        let guess = match target {
            Target::Supervisor => FIRST_GUESS_OF_ALL_NS,
            _ => FIRST_GUESS_NS,
        };
        self.0.get(&target).copied().unwrap_or(guess)
    }
}
