//! The command line of `rearrange bench`.
//!
//! Responsible for: what clap parses of it. Not responsible for: measuring (crate `bench`).

use std::path::PathBuf;

use clap::{Args, Subcommand};
use node::Wait;

use crate::cli::{MAX_OBJECTS, number};
use crate::exit::STATUSES;
use crate::run_options::MAX_ROBOTS;

#[derive(Debug, Args)]
pub(crate) struct BenchArgs {
    #[command(subcommand)]
    pub(crate) workload: Workload,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Workload {
    /// World time per wall time: in process, and in lockstep with one process per robot
    Speed(SpeedArgs),
    /// The paper's experiment: rooms × robots × methods, and whether its directions hold
    Paper(PaperArgs),
    /// Two results: ratios with intervals, and status 1 where something got worse
    Compare(CompareArgs),
    /// What shared memory costs as robots are added: latencies of real processes, beside bare
    /// iceoryx2, a cache line and Unix datagrams
    Latency(LatencyArgs),
    /// Each step of planning against the number of objects and of lattice points
    Planning(PlanningArgs),
    /// Many robots and objects in one thread: world time per wall time, and who is engaged
    Scale(ScaleArgs),
    /// Rooms of every kind: which are solved, how near the optimum, beside the paper's methods
    Solve(SolveArgs),
}

#[derive(Debug, Args)]
#[command(after_help = format!("\
Modelled times count work units at a stated speed and are the same on every machine; wall times of
the same steps stand beside them.

Examples:
  rearrange bench paper --quick
  rearrange bench paper --rooms 300 --units-per-second 100000,1000000 --out results/

{STATUSES}"))]
pub(crate) struct PaperArgs {
    /// The paper's rooms and a few seeded ones, at two speeds: less than a minute
    #[arg(long)]
    pub(crate) quick: bool,
    /// Seeded rooms beside the paper's six [default: 100, with --quick 3]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub(crate) rooms: Option<u32>,
    /// Seed of the first seeded room
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Numbers of robots [default: 1,2,3,4]
    #[arg(long, value_name = "M,…", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=4))]
    pub(crate) robots: Vec<u32>,
    /// Modelled speeds, work units a second [default: 10000,100000,1000000,10000000]
    #[arg(long, value_name = "N,…", value_delimiter = ',', value_parser = clap::value_parser!(u64).range(1..=1_000_000_000_000))]
    pub(crate) units_per_second: Vec<u64>,
    /// Whose computer it is: own, shared or both [default: own,shared]
    #[arg(long, value_name = "WORD,…", value_delimiter = ',', value_parser = compute)]
    pub(crate) compute: Vec<scene::Compute>,
    /// Make each run so often: modelled times repeat, wall times spread
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000))]
    pub(crate) repeats: u32,
    /// All machines in one process, or one process per robot in lockstep
    #[arg(long, value_enum, default_value = "in-process")]
    pub(crate) driver: crate::run_options::Driver,
    /// Judge and draw the runs of this earlier result again, instead of running
    #[arg(long, value_name = "DIR", conflicts_with_all = ["quick", "rooms", "robots", "units_per_second", "compute"])]
    pub(crate) from: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// Parses whose computer it is, for clap.
fn compute(text: &str) -> Result<scene::Compute, String> {
    text.parse::<scene::Compute>()
        .map_err(|unknown| unknown.to_string())
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rearrange bench compare before/ after/\n\nStatus 1 where something \
                        got worse beyond the noise, 0 where nothing did."
)]
pub(crate) struct CompareArgs {
    /// The result before: a directory of results, or its results.json
    pub(crate) a: PathBuf,
    /// The result after
    pub(crate) b: PathBuf,
    /// List what stayed the same too
    #[arg(long)]
    pub(crate) all: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rearrange bench speed paper-68a --ticks 100000 --json\n\n\
                        The scenario is run again and again until that many ticks are measured; \
                        setting up is not timed."
)]
pub(crate) struct SpeedArgs {
    /// Scenario file (TOML), or the name of a built-in scenario
    #[arg(default_value = crate::scenario::DEFAULT)]
    pub(crate) scenario: String,
    /// Measure at least this many ticks with each driver
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub(crate) ticks: u64,
    /// Take only the first M robots
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=MAX_ROBOTS))]
    pub(crate) robots: Option<u32>,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rearrange bench latency --robots 1,4 --quick\n\n\
                  Everything is measured in turn, again and again. docs/benchmarks.md says what \
                  each number means."
)]
pub(crate) struct LatencyArgs {
    /// Numbers of robots, each a process [default: 1,2,4,8,16,32,64]
    #[arg(long, value_name = "M,…", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=MAX_ROBOTS))]
    pub(crate) robots: Vec<u32>,
    /// Numbers of objects; with 100 the robots are varied, with the others nothing else
    /// [default: 10,100,1000]
    #[arg(long, value_name = "N,…", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=MAX_OBJECTS))]
    pub(crate) objects: Vec<u32>,
    /// How processes wait for each other in lockstep [default: spin,hybrid,block]
    #[arg(long, value_name = "WAIT,…", value_delimiter = ',', value_parser = crate::run_options::wait())]
    pub(crate) wait: Vec<Wait>,
    /// How often everything is measured [default: 5]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000))]
    pub(crate) repeats: Option<u32>,
    /// Measure each for a short time only, and without SCHED_FIFO
    #[arg(long, conflicts_with = "full")]
    pub(crate) quick: bool,
    /// Pin and prioritise with every wait, not with one only
    #[arg(long)]
    pub(crate) full: bool,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  rearrange bench planning --quick\n\n\
                        Every step is timed in several rooms of each size, at a fixed \
                        density, and its work is counted; growth exponents follow. The complete \
                        measurement takes about a quarter of an hour.")]
pub(crate) struct PlanningArgs {
    /// Numbers of objects, separated by commas
    #[arg(long, value_name = "N,…", value_delimiter = ',', value_parser = objects)]
    pub(crate) objects: Vec<usize>,
    /// Less of everything, within a minute
    #[arg(long)]
    pub(crate) quick: bool,
    /// Seed of the rooms
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  rearrange bench scale --quick\n  rearrange bench scale --objects 500 \
                  --robots 64\n\nHalls in which the objects stand in rows; the largest, 1,000 objects \
                  and 100 robots, takes about two minutes."
)]
pub(crate) struct ScaleArgs {
    /// Small halls only: seconds
    #[arg(long, conflicts_with = "objects")]
    pub(crate) quick: bool,
    /// Objects of the one hall to run [default: halls up to 1,000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MAX_OBJECTS))]
    pub(crate) objects: Option<u32>,
    /// Robots in that hall
    #[arg(long, value_name = "M", default_value_t = 10, requires = "objects", value_parser = clap::value_parser!(u32).range(1..=MAX_ROBOTS))]
    pub(crate) robots: u32,
    /// Seed of the goals
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

#[derive(Debug, Args)]
#[command(after_help = format!("\
Every room is run in process with the default method and with the paper's four. R is the optimum were
nothing ever in the way. Rooms are listed where they are not solved, or where one of the four is faster.
The complete measurement takes the better part of an hour.

Examples:
  rearrange bench solve --quick
  rearrange bench solve --sets generated --rooms 2000 --out results/

{STATUSES}"))]
pub(crate) struct SolveArgs {
    /// The paper's rooms and a few generated ones: about a minute
    #[arg(long)]
    pub(crate) quick: bool,
    /// Generated rooms: densities, 1 to 4 robots, 3 to 12 objects, 0 or 2 extra moves in turn
    /// [default: 1000, with --quick 24]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    pub(crate) rooms: Option<u32>,
    /// Seeded rooms of the paper's sizes, each with 1 to 4 robots [default: 100, with --quick 0]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub(crate) seeded: Option<u32>,
    /// Which rooms: paper (the six, with 1 to 4 robots), seeded, generated [default: all]
    #[arg(long, value_name = "SET,…", value_delimiter = ',', value_parser = room_set)]
    pub(crate) sets: Vec<bench::solve::rooms::Set>,
    /// Seed of the first generated room, and of the first seeded one
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(0..=1_000_000_000_000))]
    pub(crate) seed: u64,
    /// World time after which a run counts as failed, s
    #[arg(long, value_name = "S", default_value_t = 1800.0, value_parser = number(0.01, 1e7))]
    pub(crate) max_time: f64,
    /// Wall time after which a run is given up, between two ticks, s
    #[arg(long, value_name = "S", default_value_t = 60.0, value_parser = number(0.001, 1e6))]
    pub(crate) wall_cap: f64,
    /// The same in rooms that are not known to have a solution: those of the paper's sizes, with
    /// fewer robots than they were made with
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = number(0.001, 1e6))]
    pub(crate) unknown_cap: f64,
    /// Rooms of unit cells, whose shortest plans are known [default: 200, with --quick 10]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub(crate) unit_cells: Option<u32>,
    /// Rooms of 16 by 16 unit cells with 4 robots and 20 objects [default: 5, with --quick 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=1_000))]
    pub(crate) halls: Option<u32>,
    /// Rooms that are run at the same time: results do not depend on it, wall times do
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=1_024))]
    pub(crate) threads: u32,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// Parses the name of a set of rooms, for clap.
fn room_set(text: &str) -> Result<bench::solve::rooms::Set, String> {
    use bench::solve::rooms::Set;
    let found = Set::ALL.into_iter().find(|set| set.word() == text);
    found.ok_or_else(|| format!("must be one of {}", Set::ALL.map(Set::word).join(", ")))
}

/// Parses a number of objects, for clap.
fn objects(text: &str) -> Result<usize, String> {
    use shm_types::capacity::MAX_OBJECTS;
    match text.parse() {
        Ok(count) if (1..=MAX_OBJECTS).contains(&count) => Ok(count),
        _ => Err(format!("must be a whole number from 1 to {MAX_OBJECTS}")),
    }
}

/// Where a benchmark's results go.
#[derive(Debug, Args)]
pub(crate) struct OutputArgs {
    /// Write JSON, CSV and the HTML report into this directory, made if need be
    /// [default: target/bench/ and the workload's name]
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print the results as one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}
