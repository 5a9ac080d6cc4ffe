//! The options of `run`: parsed by clap, turned into the settings of the machines and of the
//! processes.
//!
//! Responsible for: names, ranges and defaults of every option, and which exclude each other.
//! Not responsible for: what the machine can honour (crate `node` refuses that).
//!
//! Terms: world time is what the robots live in, wall time what the user waits.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use node::options::{Clock, DEFAULT_MONITORS, DEFAULT_RATE_HZ, MAX_MONITORS, MAX_RATE_HZ};
use node::options::{
    DEFAULT_MORE_ROBOTS, DEFAULT_SILENCE_LIMIT, Delay, GiveUp, Restart, Role, Wait,
};
use scene::{Compute, HardMode, Method, Performance, Settings};
use serde::de::DeserializeOwned;
use serde::de::value::{Error as NameError, StrDeserializer};

use crate::cli::number;
use crate::exit::STATUSES;

const EXAMPLES: &str = "\
Examples:
  rearrange run
  rearrange run paper-41a --robots 2 --method restricted
  rearrange run room.toml --driver in-process --json > result.json
  rearrange run --clock real --rate 1000 --speed 20 --trace run.mcap";

/// What to run, and how.
#[derive(Debug, Args)]
#[command(after_help = format!("{EXAMPLES}\n\n{STATUSES}"))]
pub(crate) struct RunArgs {
    /// Scenario file (TOML), or the name of a built-in scenario
    #[arg(default_value = crate::scenario::DEFAULT)]
    pub(crate) scenario: String,
    /// Take only the first M robots [default: all]
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=MAX_ROBOTS))]
    pub(crate) robots: Option<u32>,

    #[command(flatten)]
    pub(crate) method: MethodArgs,
    #[command(flatten)]
    pub(crate) time: TimeArgs,
    #[command(flatten)]
    pub(crate) process: ProcessArgs,

    /// Tell the run of changes at stated times, from this file (TOML; docs/changes.md)
    #[arg(long, value_name = "FILE")]
    pub(crate) changes: Option<PathBuf>,

    /// Print the result as one JSON object on stdout
    #[arg(long, help_heading = "Output")]
    pub(crate) json: bool,
    /// Keep the trace in this file
    #[arg(long, value_name = "FILE.mcap", help_heading = "Output")]
    pub(crate) trace: Option<PathBuf>,
    /// Write the state hash of every tick to this file, one a line
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub(crate) hashes: Option<PathBuf>,
}

/// Which constraints are worked out when, and how that is charged.
#[derive(Debug, Args)]
#[command(next_help_heading = "Method")]
pub(crate) struct MethodArgs {
    /// `anytime` plans ahead; the paper's four say which constraints are worked out before a
    /// selection and on a failure
    #[arg(long, default_value = Settings::default().method.word(), value_parser = named::<Method>(&METHODS))]
    pub(crate) method: Method,
    /// Hard constraints: each pair tested once, or anew at every event
    #[arg(long, default_value = "cached", value_parser = named::<HardMode>(&["cached", "literal"]))]
    pub(crate) hard: HardMode,
    /// What a robot's performance value is the inverse of
    #[arg(long, default_value = "transit-and-transfer", value_parser = named::<Performance>(&["transit-and-transfer", "transfer"]))]
    pub(crate) performance: Performance,
    /// One modelled computer for each robot and the planner, or one shared by all that are busy
    #[arg(long, default_value = "own", value_parser = named::<Compute>(&["own", "shared"]))]
    pub(crate) compute: Compute,
    /// Work units (cells expanded) a modelled computer does in a second of world time
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MAX_UNITS))]
    pub(crate) units_per_second: Option<u64>,
}

/// Names of the methods: the paper's as its section IV orders them, then that which plans ahead.
pub(crate) const METHODS: [&str; 5] = [
    "grasping-and-restricted",
    "restricted",
    "all",
    "no-action",
    "anytime",
];
const MAX_UNITS: u64 = 1_000_000_000_000;
/// Most robots, as clap counts.
pub(crate) const MAX_ROBOTS: i64 = shm_types::capacity::MAX_ROBOTS as i64;

/// Ticks and clocks.
#[derive(Debug, Args)]
#[command(next_help_heading = "Time")]
pub(crate) struct TimeArgs {
    /// Virtual time that waits for everyone, or the wall clock that waits for nobody
    #[arg(long, value_enum, default_value_t = ClockKind::Lockstep)]
    pub(crate) clock: ClockKind,
    /// World time of a tick in virtual time, ms [default: 10]
    #[arg(long, value_name = "MS", value_parser = number(0.01, 1000.0))]
    pub(crate) tick: Option<f64>,
    /// Ticks per second of wall time, with --clock real [default: 1000]
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_RATE_HZ)))]
    pub(crate) rate: Option<u32>,
    /// Seconds of world time per second of wall time, with --clock real [default: 1]
    #[arg(long, value_name = "X", value_parser = number(0.001, 1000.0))]
    pub(crate) speed: Option<f64>,
    /// Give up after this much world time, s [default: 1800]
    #[arg(long, value_name = "S", value_parser = number(0.001, 1e7))]
    pub(crate) time_limit: Option<f64>,
}

/// Processes and how they wait.
#[derive(Debug, Args)]
#[command(next_help_heading = "Processes")]
pub(crate) struct ProcessArgs {
    /// A process for every robot, or everything in one thread: the states are the same
    #[arg(long, value_enum, default_value_t = Driver::Processes)]
    pub(crate) driver: Driver,
    /// How processes wait for each other in lockstep
    #[arg(long, default_value = "hybrid", value_parser = wait())]
    pub(crate) wait: Wait,
    /// Bind each process to a core
    #[arg(long)]
    pub(crate) pin: bool,
    /// Ask for SCHED_FIFO and locked memory; go on without where not permitted
    #[arg(long)]
    pub(crate) realtime: bool,
    /// Name of the run, for `rearrange list` [default: its id]
    #[arg(long, value_parser = run_name)]
    pub(crate) name: Option<String>,
    /// Places kept free for programs that watch
    #[arg(long, value_name = "N", default_value_t = DEFAULT_MONITORS, value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_MONITORS)))]
    pub(crate) monitors: u32,
    /// Robots that `rearrange tell` can add on the way: shared memory has room for them
    #[arg(long, value_name = "N", default_value_t = DEFAULT_MORE_ROBOTS, value_parser = clap::value_parser!(u32).range(0..MAX_ROBOTS))]
    pub(crate) more_robots: u32,
    /// What follows when a process dies: it is started again and takes up where it was; likewise,
    /// but a robot waits for `rearrange tell release`; or it is gone for good
    #[arg(long, value_name = "WHAT", default_value = "auto", value_parser = named::<Restart>(&["auto", "hold", "never"]))]
    pub(crate) restart: Restart,
    /// Start a process no more that ends so often in a row, or for so many seconds (like 30s),
    /// without answering a tick: a robot is then an obstacle, without anybody else the run ends
    #[arg(long, value_name = "N|SECONDSs", default_value_t)]
    pub(crate) give_up_after: GiveUp,
    /// Kill a process that says and does nothing for so many seconds
    #[arg(long, value_name = "SECONDS", default_value_t = DEFAULT_SILENCE_LIMIT.as_secs_f64(), value_parser = number(0.05, 3_600.0))]
    pub(crate) silence_limit: f64,
    /// Make a process slow on purpose: ROLE=MS or ROLE=MSxTICKS (for tests)
    #[arg(long, value_name = "ROLE=MS[xTICKS]", hide = true, value_parser = delay)]
    pub(crate) delay: Vec<Delay>,
}

/// Who runs the machines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Driver {
    /// One process each, over shared memory.
    Processes,
    /// One thread, no shared memory.
    InProcess,
}

/// Who sets the pace.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ClockKind {
    /// The slowest participant.
    Lockstep,
    /// The wall clock.
    Real,
}

/// Options that contradict each other.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Contradiction {
    /// An option of the wall clock without it.
    #[error("{0} is about wall time: give --clock real with it")]
    NeedsRealClock(&'static str),
    /// The tick of the wall clock follows from rate and speed.
    #[error("with --clock real a tick lasts --speed / --rate: leave --tick out")]
    TickOfRealClock,
    /// The wall clock without processes.
    #[error("--driver in-process has no wall clock: leave --clock real out")]
    RealInProcess,
    /// An option of processes without processes.
    #[error("{0} is about processes: it has no meaning with --driver in-process")]
    NeedsProcesses(&'static str),
    /// A period that no process can keep.
    #[error("--speed / --rate gives a tick of {0} ms of world time; the most is 1000 ms")]
    TickTooLong(u64),
}

impl RunArgs {
    /// Refuses options that contradict each other.
    ///
    /// # Errors
    /// The first contradiction.
    pub(crate) fn check(&self) -> Result<(), Contradiction> {
        let real = self.time.clock == ClockKind::Real;
        if self.process.driver == Driver::InProcess {
            if real {
                return Err(Contradiction::RealInProcess);
            }
            let given = [
                ("--pin", self.process.pin),
                ("--realtime", self.process.realtime),
                ("--name", self.process.name.is_some()),
                ("--delay", !self.process.delay.is_empty()),
                ("--restart", self.process.restart != Restart::Auto),
                (
                    "--give-up-after",
                    self.process.give_up_after != GiveUp::default(),
                ),
                ("--wait spin", self.process.wait == Wait::Spin),
                ("--wait block", self.process.wait == Wait::Block),
            ];
            if let Some((option, _)) = given.into_iter().find(|(_, given)| *given) {
                return Err(Contradiction::NeedsProcesses(option));
            }
        }
        match (real, self.time.rate, self.time.speed, self.time.tick) {
            (false, Some(_), _, _) => Err(Contradiction::NeedsRealClock("--rate")),
            (false, _, Some(_), _) => Err(Contradiction::NeedsRealClock("--speed")),
            (true, _, _, Some(_)) => Err(Contradiction::TickOfRealClock),
            _ if self.tick_ns() > 1_000_000_000 => {
                Err(Contradiction::TickTooLong(self.tick_ns() / 1_000_000))
            }
            _ => Ok(()),
        }
    }

    /// Who sets the pace.
    pub(crate) fn clock(&self) -> Clock {
        match self.time.clock {
            ClockKind::Lockstep => Clock::Lockstep,
            ClockKind::Real => Clock::Real {
                rate_hz: self.time.rate.unwrap_or(DEFAULT_RATE_HZ),
                speed: self.time.speed.unwrap_or(1.0),
            },
        }
    }

    /// World time of a tick, ns.
    pub(crate) fn tick_ns(&self) -> u64 {
        let lockstep = self
            .time
            .tick
            .map_or(Settings::default().tick_ns, |ms| ns(ms / 1e3));
        self.clock().tick_ns(lockstep)
    }

    /// What the machines are asked to do.
    pub(crate) fn settings(&self) -> Settings {
        let default = Settings::default();
        Settings {
            method: self.method.method,
            hard: self.method.hard,
            performance: self.method.performance,
            compute: self.method.compute,
            units_per_second: self
                .method
                .units_per_second
                .unwrap_or(default.units_per_second),
            tick_ns: self.tick_ns(),
            time_limit_ns: self.time.time_limit.map_or(default.time_limit_ns, ns),
            ..default
        }
    }
}

/// Whole nanoseconds in `seconds`.
fn ns(seconds: f64) -> u64 {
    (seconds * 1e9).round() as u64
}

/// A parser of the ways to wait.
pub(crate) fn wait() -> impl TypedValueParser<Value = Wait> {
    named(&["spin", "hybrid", "block"])
}

/// A parser of one of `names` into the value that serde knows by it.
pub(crate) fn named<T>(names: &'static [&'static str]) -> impl TypedValueParser<Value = T>
where
    T: DeserializeOwned + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names)
        .try_map(|name| T::deserialize(StrDeserializer::<NameError>::new(&name)))
}

/// Longest name of a run, in bytes: it is part of paths.
const MAX_NAME: usize = 32;

fn run_name(text: &str) -> Result<String, String> {
    let fine = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if text.is_empty() || text.len() > MAX_NAME || !text.chars().all(fine) {
        return Err(format!(
            "must be 1 to {MAX_NAME} letters, digits, '-' and '_'"
        ));
    }
    Ok(text.to_owned())
}

fn delay(text: &str) -> Result<Delay, String> {
    let (role, duration) = text
        .split_once('=')
        .ok_or("must be ROLE=MS or ROLE=MSxTICKS")?;
    let role: Role = role.parse().map_err(|error| format!("{error}"))?;
    let (ms, ticks) = duration.split_once('x').unwrap_or((duration, ""));
    let ms = ms
        .parse()
        .map_err(|error| format!("{ms:?} is no number of milliseconds: {error}"))?;
    let ticks = match ticks {
        "" => u64::MAX,
        ticks => ticks
            .parse()
            .map_err(|error| format!("{ticks:?} is no number of ticks: {error}"))?,
    };
    Ok(Delay { role, ms, ticks })
}
