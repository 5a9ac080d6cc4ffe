//! The options of a run that the machines read: method, time, patience, planning speed.
//!
//! Responsible for: names, defaults and limits of these options, each in one place.
//! Not responsible for: options of the process shell (waiting, pinning) or of the command line.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

const NS_PER_MS: u64 = 1_000_000;
const NS_PER_S: u64 = 1_000_000_000;

/// Work units in one second of world time, by default. One core of the machine this was measured
/// on (Intel Xeon, Sapphire Rapids, 2 cores under load) expands 14 to 18 million cells a second
/// in `paper-68a` and a winding room of the same size, 29,865 points, 8-connected
/// (`planner/tests/it/speed.rs`): rounded down to a power of ten.
pub const DEFAULT_UNITS_PER_SECOND: u64 = 10_000_000;

/// A word that names no value of an option.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{given}\" is no {what}; allowed are {allowed}")]
pub struct UnknownWord {
    what: &'static str,
    given: String,
    allowed: String,
}

/// Defines an option that is one of several words, spelt alike on the command line, in files
/// and in results.
macro_rules! words {
    ($(#[$meta:meta])* pub enum $name:ident ($what:literal) { $($(#[$vmeta:meta])* $variant:ident = $word:literal,)+ }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        pub enum $name { $($(#[$vmeta])* #[serde(rename = $word)] $variant,)+ }

        impl $name {
            /// Every value.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)+];

            /// The word for it.
            #[must_use]
            pub const fn word(self) -> &'static str {
                match self { $(Self::$variant => $word,)+ }
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(self.word())
            }
        }

        impl FromStr for $name {
            type Err = UnknownWord;

            fn from_str(given: &str) -> Result<Self, UnknownWord> {
                Self::ALL.iter().copied().find(|value| value.word() == given).ok_or_else(|| UnknownWord {
                    what: $what,
                    given: given.to_owned(),
                    allowed: [$($word,)+].join(", "),
                })
            }
        }
    };
}

words! {
    /// Which constraints are computed when (§IV and the table before rule 23).
    pub enum Method ("method") {
        /// The paper's: all easy constraints before each selection, hard ones of a failed task.
        GraspingAndRestricted = "grasping-and-restricted",
        /// No easy constraints, hard ones of a failed task.
        Restricted = "restricted",
        /// All easy and all hard constraints before each selection.
        All = "all",
        /// None at all.
        NoAction = "no-action",
        /// None of the paper's: the planner service plans ahead for all robots, and goes on
        /// improving the plan while they move.
        Anytime = "anytime",
    }
}

impl Method {
    /// The paper's four (§IV).
    pub const PAPERS: [Self; 4] = [
        Self::GraspingAndRestricted,
        Self::Restricted,
        Self::All,
        Self::NoAction,
    ];

    /// Whether robots follow the planner service's schedule instead of selecting tasks.
    #[must_use]
    pub const fn plans_ahead(self) -> bool {
        matches!(self, Self::Anytime)
    }

    /// Whether easy constraints are computed before each selection.
    #[must_use]
    pub const fn uses_easy(self) -> bool {
        matches!(self, Self::GraspingAndRestricted | Self::All)
    }

    /// Whether a failure is followed by hard constraints of the failed task.
    #[must_use]
    pub const fn restricts(self) -> bool {
        matches!(self, Self::GraspingAndRestricted | Self::Restricted)
    }
}

words! {
    /// Whether hard constraints are computed anew at every event (rule 23).
    pub enum HardMode ("mode of computing hard constraints") {
        /// What is known of two placements is not computed again.
        Cached = "cached",
        /// Recomputed at every event, as the paper may be read.
        Literal = "literal",
    }
}

words! {
    /// What the performance value of a task is the inverse of (rule 16).
    pub enum Performance ("performance value") {
        /// Length of transit from where the robot is, plus transfer.
        TransitAndTransfer = "transit-and-transfer",
        /// Length of the transfer alone, as the paper has it.
        Transfer = "transfer",
    }
}

words! {
    /// Who computes how fast (rule 24).
    pub enum Compute ("way of computing") {
        /// One computer each.
        Own = "own",
        /// One computer, shared equally by all that are busy: the paper's simulator.
        Shared = "shared",
    }
}

/// What the machines need to know of a run besides the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Which constraints are computed when.
    pub method: Method,
    /// Whether hard constraints are cached.
    pub hard: HardMode,
    /// What performance means.
    pub performance: Performance,
    /// World time of one tick, ns.
    pub tick_ns: u64,
    /// Work units in a second of world time.
    pub units_per_second: u64,
    /// Who computes how fast.
    pub compute: Compute,
    /// How much path a robot asks for at a time, m.
    pub look_ahead_m: f64,
    /// How often a robot that waits for another looks again (L of rule 21), ns.
    pub look_again_ns: u64,
    /// How long it waits before it gives the task up (P of rule 21), ns.
    pub patience_ns: u64,
    /// Robot-caused failures of one robot and task that count (B of rule 21).
    pub robot_failures: u32,
    /// World time after which a run counts as failed (rule 22), ns.
    pub time_limit_ns: u64,
    /// Ticks a command stays good after the tick it answers.
    pub command_valid_ticks: u64,
    /// World time within which a hard-constraint request is answered; past it selection goes on
    /// without the answer, ns.
    pub answer_deadline_ns: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: Method::Anytime,
            hard: HardMode::Cached,
            performance: Performance::TransitAndTransfer,
            tick_ns: 10 * NS_PER_MS,
            units_per_second: DEFAULT_UNITS_PER_SECOND,
            compute: Compute::Own,
            look_ahead_m: 0.1,
            look_again_ns: NS_PER_S,
            patience_ns: 5 * NS_PER_S,
            robot_failures: 3,
            time_limit_ns: 1_800 * NS_PER_S,
            command_valid_ticks: 50,
            answer_deadline_ns: 600 * NS_PER_S,
        }
    }
}

impl Settings {
    /// Work units a participant may spend in one tick while `busy` participants compute; at
    /// least 1, so that computing always comes to an end.
    #[must_use]
    pub fn units_per_tick(&self, busy: u32) -> u64 {
        let units =
            u128::from(self.units_per_second) * u128::from(self.tick_ns) / u128::from(NS_PER_S);
        let share = match self.compute {
            Compute::Own => units,
            Compute::Shared => units / u128::from(busy.max(1)),
        };
        u64::try_from(share).unwrap_or(u64::MAX).max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_read_back_and_unknown_ones_name_the_allowed() {
        for method in Method::ALL {
            assert_eq!(method.word().parse::<Method>().unwrap(), *method);
        }
        let error = "everything".parse::<Method>().unwrap_err().to_string();
        assert!(
            error.contains("everything") && error.contains("no-action"),
            "{error}"
        );
    }

    #[test]
    fn one_computer_is_shared_equally() {
        let own = Settings {
            units_per_second: 1_000,
            ..Settings::default()
        };
        assert_eq!(own.units_per_tick(4), 10);
        let shared = Settings {
            compute: Compute::Shared,
            ..own
        };
        assert_eq!(shared.units_per_tick(4), 2);
        assert_eq!(shared.units_per_tick(0), 10);
        assert_eq!(shared.units_per_tick(1_000), 1);
    }
}
