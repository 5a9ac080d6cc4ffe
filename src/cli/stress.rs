//! The command lines of `rearrange simulate` and `rearrange chaos`.
//!
//! Responsible for: what clap parses of them. Not responsible for: what goes wrong (crate `sim`,
//! `commands/chaos`).

use clap::{Args, ValueEnum};

use crate::cli::MAX_OBJECTS;
use crate::exit::STATUSES;
use crate::run_options::MAX_ROBOTS;

#[derive(Debug, Args)]
#[command(after_help = format!("\
Everything runs in this process, on all cores. A seed stands for a room, a method and a plan of
faults, and fails in the same way whenever it is run. docs/simulate.md says what can go wrong and
what must hold all the same.

Examples:
  rearrange simulate --seeds 1000
  rearrange simulate --seeds 200 --method anytime room.toml other.toml
  rearrange simulate --seeds 1 --first-seed 4711 --shrink

{STATUSES}"))]
pub(crate) struct SimulateArgs {
    /// Scenario files, or names of built-in scenarios, in turn [default: seeded random rooms]
    #[arg(value_name = "SCENARIO")]
    pub(crate) scenarios: Vec<String>,
    /// How many seeds to run
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub(crate) seeds: u64,
    /// The first of them
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=1_000_000_000_000))]
    pub(crate) first_seed: u64,
    /// Make each seed that fails small: fewer faults, robots and objects
    #[arg(long)]
    pub(crate) shrink: bool,
    /// The method of all runs [default: the seed says]
    #[arg(long, value_parser = crate::run_options::named::<scene::Method>(&crate::run_options::METHODS))]
    pub(crate) method: Option<scene::Method>,
    /// Take only the first M robots
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=MAX_ROBOTS))]
    pub(crate) robots: Option<u32>,
    /// Take only the first N objects
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MAX_OBJECTS))]
    pub(crate) objects: Option<u32>,
    /// Let only the faults of these numbers happen, as `--shrink` prints them
    #[arg(long, value_name = "NUMBERS")]
    pub(crate) only: Option<sim::faults::Numbers>,
    /// Seeds that are run at the same time [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_024))]
    pub(crate) threads: Option<u32>,
    /// Print the totals as one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

/// When a process is struck.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Phase {
    /// From its start to its first answer.
    Setup,
    /// While all processes of the run are ready.
    Steady,
}

/// Who is struck.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Target {
    /// Any robot.
    Robots,
    /// The planner.
    Planner,
    /// The world.
    World,
    /// The one who starts and watches the others; all of them die with it.
    Supervisor,
    /// The writer of the trace.
    Recorder,
}

impl std::fmt::Display for Phase {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(&name_of(self))
    }
}

impl std::fmt::Display for Target {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(&name_of(self))
    }
}

/// As it is written on the command line.
fn name_of(value: &impl ValueEnum) -> String {
    let value = value.to_possible_value();
    value.map_or_else(String::new, |value| value.get_name().to_owned())
}

/// Who sets the pace of the runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ChaosClock {
    /// The slowest participant.
    Lockstep,
    /// The wall clock.
    Real,
}

#[derive(Debug, Args)]
#[command(after_help = "\
As many runs are made as the kills need. A kill counts only while a task is open. The exit status is
0 only if every run ended solved, with nothing violated and nothing left; 6 if something was
violated, 7 for anything else. See docs/chaos.md.

Examples:
  rearrange chaos --kills 200
  rearrange chaos room.toml --kills 1000 --seed 7 --during setup --targets robots,world --json")]
pub(crate) struct ChaosArgs {
    /// Scenario file (TOML), or the name of a built-in scenario
    #[arg(default_value = crate::scenario::DEFAULT)]
    pub(crate) scenario: String,
    /// Take only the first M robots [default: all]
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=MAX_ROBOTS))]
    pub(crate) robots: Option<u32>,
    /// How many processes are killed, in equal shares of phases and roles; some are stalled besides
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub(crate) kills: usize,
    /// What decides who is struck how; the instants are not the same twice
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub(crate) seed: u64,
    /// When they are struck
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        default_value = "setup,steady"
    )]
    pub(crate) during: Vec<Phase>,
    /// Who is struck
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        default_value = "robots,planner,world,supervisor"
    )]
    pub(crate) targets: Vec<Target>,
    /// Who sets the pace of the runs
    #[arg(long, value_enum, default_value_t = ChaosClock::Lockstep)]
    pub(crate) clock: ChaosClock,
    /// Print the report as one JSON object on stdout
    #[arg(long)]
    pub(crate) json: bool,
}
