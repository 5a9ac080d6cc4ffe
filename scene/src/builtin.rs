//! The shipped scenarios, inside the binary.
//!
//! Responsible for: their names and texts. The texts themselves, each with a comment that says
//! what it is there for, are the files of `scenarios/`; those of the warehouses are generated when
//! they are asked for.

use std::sync::LazyLock;

use crate::warehouse::warehouse;

/// A scenario that comes with the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Builtin {
    /// Its name: the file's without its ending.
    pub name: &'static str,
    /// The whole file.
    pub text: &'static str,
}

impl Builtin {
    /// What it is there for: its opening comment, as one paragraph.
    #[must_use]
    pub fn about(&self) -> String {
        let comment = self.text.lines().map_while(|line| line.strip_prefix('#'));
        let words: Vec<_> = comment.flat_map(str::split_whitespace).collect();
        words.join(" ")
    }
}

/// Lists files of `scenarios/` by name.
macro_rules! builtin {
    ($($name:literal,)+) => {
        &[$(Builtin {
            name: $name,
            text: include_str!(concat!("../../scenarios/", $name, ".toml")),
        },)+]
    };
}

/// Every shipped scenario that is a file.
pub const BUILTIN: &[Builtin] = builtin![
    "paper-17a",
    "paper-17b",
    "paper-41a",
    "paper-41b",
    "paper-68a",
    "paper-68b",
    "e1",
    "e2",
    "e3",
    "e4",
    "h1",
    "h2",
    "blocked-approach",
    "blocked-return",
    "swap",
    "joint-blockers",
    "head-on-corridor",
    "lift-from-below",
    "infeasible-e1-cycle",
    "infeasible-e4-cycle",
    "unreachable-goal",
];

/// Seed of the warehouses.
const SEED: u64 = 1;
static WAREHOUSE_100: LazyLock<String> =
    LazyLock::new(|| warehouse(100, 20, SEED).unwrap_or_default());
static WAREHOUSE_1000: LazyLock<String> =
    LazyLock::new(|| warehouse(1000, 100, SEED).unwrap_or_default());

/// The shipped warehouses: 100 objects with 20 robots, 1,000 with 100.
#[must_use]
pub fn warehouses() -> [Builtin; 2] {
    [
        Builtin {
            name: "warehouse-100",
            text: &WAREHOUSE_100,
        },
        Builtin {
            name: "warehouse-1000",
            text: &WAREHOUSE_1000,
        },
    ]
}

/// The shipped scenario of this name.
#[must_use]
pub fn builtin(name: &str) -> Option<Builtin> {
    let is_it = |scenario: &Builtin| scenario.name == name;
    (BUILTIN.iter().copied().find(is_it)).or_else(|| warehouses().into_iter().find(is_it))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_scenario_reads_and_says_what_it_is_for() {
        for Builtin { name, text } in BUILTIN.iter().copied().chain(warehouses()) {
            let scene = crate::parse(text, name).unwrap_or_else(|e| panic!("{}", e.plain()));
            assert_eq!(scene.name, name);
            assert!(scene.lattice.exact, "{name} has no exact lattice");
            assert!(builtin(name).unwrap().about().len() > 40, "{name}");
        }
        assert_eq!(builtin("nowhere"), None);
    }
}
