//! The command line: every command, its options, their ranges and what the help says.
//!
//! Responsible for: what clap parses. Out-of-range values and unknown names end here, with
//! status 2 and the allowed values.
//! Not responsible for: doing anything (see [`crate::commands`]).

mod benchmarks;
mod stress;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::exit::STATUSES;
use crate::run_options::{MAX_ROBOTS, RunArgs};

pub(crate) use benchmarks::{
    BenchArgs, CompareArgs, LatencyArgs, OutputArgs, PaperArgs, PlanningArgs, ScaleArgs, SolveArgs,
    SpeedArgs, Workload,
};
pub(crate) use stress::{ChaosArgs, ChaosClock, Phase, SimulateArgs, Target};

/// Moves objects to their goals in narrow rooms with several mobile robots.
///
/// Each robot is a process of its own; the world's state lies in shared memory and is read in
/// place. Start with `rearrange run`.
#[derive(Debug, Parser)]
#[command(name = "rearrange", version, propagate_version = true, after_help = OVERVIEW)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

const OVERVIEW: &str = "\
Examples:
  rearrange run                              the built-in room paper-68a, four robot processes
  rearrange run room.toml --robots 2 --json  your own room, the result as JSON
  rearrange scenarios                        the rooms inside this binary
  rearrange validate room.toml               is a scenario file right?
  rearrange explain swap                     what has to come before what, and why

Logs go to stderr: RUST_LOG=debug shows more. NO_COLOR and pipes are respected.";

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Carry all objects of a scenario to their goals, and check what happened
    Run(Box<RunArgs>),
    /// Replay a trace with independent geometry and report what it violates
    Check(CheckArgs),
    /// Make a page that plays a trace, or a still of it
    View(ViewArgs),
    /// Say what has to come before what in a scenario, and why
    Explain(ExplainArgs),
    /// Make a random room that is certain to have a solution
    Generate(GenerateArgs),
    /// Print the JSON Schema of scenario files
    #[command(after_help = "Example:\n  rearrange schema > scenario.schema.json")]
    Schema,
    /// Say whether a scenario file is right, and what is wrong with it
    Validate(ValidateArgs),
    /// List the built-in scenarios, or write them out
    Scenarios(ScenariosArgs),
    /// List the runs that are alive on this machine, and those that can be resumed
    List(ListArgs),
    /// Go on with a run whose supervisor has died, from the newest tick in its journal
    Resume(ResumeArgs),
    /// Remove what dead runs of this user have left; they cannot be resumed any more
    Gc(GcArgs),
    /// Say what is wrong with this machine, and how to mend it
    Doctor(DoctorArgs),
    /// Kill and stall the processes of runs, which have to end as if nothing had been
    Chaos(ChaosArgs),
    /// Tell a live run that something has changed: a goal, an object, a wall, a robot
    Tell(TellArgs),
    /// Run scenarios in which processes die, messages are lost and robots slip, seed by seed
    Simulate(SimulateArgs),
    /// Measure how fast this machine runs a scenario
    Bench(BenchArgs),
    /// Role: the process that owns the state of all bodies
    #[command(hide = true)]
    World(RoleArgs),
    /// Role: the process that works out hard constraints
    #[command(hide = true)]
    Planner(RoleArgs),
    /// Role: the process that moves one robot
    #[command(hide = true)]
    Robot(RoleArgs),
    /// Role: the process that writes the trace
    #[command(hide = true)]
    Recorder(RoleArgs),
    /// Bare iceoryx2 in the place of a role, as what a run is measured against
    #[command(hide = true)]
    Reference(ReferenceArgs),
}

/// What a process of the reference is started with, by `bench latency`.
#[derive(Debug, Args)]
pub(crate) struct ReferenceArgs {
    #[command(subcommand)]
    pub(crate) role: ReferenceRole,
}

/// Whose place it takes.
#[derive(Debug, Subcommand)]
pub(crate) enum ReferenceRole {
    /// The world's
    World(RoleArgs),
    /// The planner's
    Planner(RoleArgs),
    /// A robot's
    Robot(RoleArgs),
    /// The recorder's
    Recorder(RoleArgs),
}

/// What a process of a run is started with, by the supervisor.
#[derive(Debug, Args)]
pub(crate) struct RoleArgs {
    /// Directory of the run
    #[arg(long = "run", value_name = "DIR")]
    pub(crate) run: PathBuf,
    /// Which robot, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..MAX_ROBOTS))]
    pub(crate) index: u32,
    /// Which process of this participant it is, counted from 1
    #[arg(long, value_name = "K", default_value_t = world::FIRST_INCARNATION)]
    pub(crate) incarnation: u32,
}

#[derive(Debug, Args)]
#[command(after_help = format!("Example:\n  rearrange run --trace run.mcap && rearrange check run.mcap\n\n{STATUSES}"))]
pub(crate) struct CheckArgs {
    /// Trace written by `rearrange run --trace`
    #[arg(value_name = "TRACE.mcap")]
    pub(crate) trace: PathBuf,
    /// Print the report as one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(
    group(clap::ArgGroup::new("outputs").args(["output", "svg"]).required(true).multiple(true)),
    after_help = format!("\
The page is one file that needs no other and no network. It plays, scrubs and zooms; its keys are
listed on it. The still shows where everything is at one time and the ways that led there.

Example:
  rearrange run --trace run.mcap && rearrange view run.mcap -o replay.html --svg still.svg

{STATUSES}")
)]
pub(crate) struct ViewArgs {
    /// Trace written by `rearrange run --trace`
    #[arg(value_name = "TRACE.mcap")]
    pub(crate) trace: PathBuf,
    /// Write a page that plays the run; `-` is stdout
    #[arg(long, short, value_name = "FILE.html")]
    pub(crate) output: Option<PathBuf>,
    /// Write a still with the ways of robots and objects; `-` is stdout
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) svg: Option<PathBuf>,
    /// World time of the still, and where the page opens, s [default: the end, the start]
    #[arg(long, value_name = "S", value_parser = number(0.0, 1e9))]
    pub(crate) at: Option<f64>,
}

impl ViewArgs {
    /// Whether both outputs would go to one place.
    pub(crate) fn clash(&self) -> bool {
        self.output.is_some() && self.output == self.svg
    }
}

#[derive(Debug, Args)]
#[command(after_help = format!("\
Every constraint is told with its reason; then who waits for whom, rings of such waiting, a proof
if one shows that the scenario cannot be solved and what to do about it, and how fast any plan can
be at best. docs/explain.md says how to read it.

Examples:
  rearrange explain swap
  rearrange explain room.toml --robots 2 --json
  rearrange explain --at 12.5 run.mcap       why each robot stood still then

{STATUSES}"))]
pub(crate) struct ExplainArgs {
    /// Scenario file (TOML), or the name of a built-in scenario; with --at a trace
    pub(crate) scenario: String,
    /// Say why each robot stood still at this world time of a trace, s
    #[arg(long, value_name = "S", value_parser = number(0.0, 1e9), conflicts_with_all = ["robots", "searches"])]
    pub(crate) at: Option<f64>,
    /// Take only the first M robots
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=MAX_ROBOTS))]
    pub(crate) robots: Option<u32>,
    /// Make so many path searches for constraints at most
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub(crate) searches: u64,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = format!("\
The room is made by setting the objects at their goals and scrambling them by legal moves of one
robot at a time; the moves in reverse prove that it can be solved, and are kept in the file.

Example:
  rearrange generate --seed 7 --objects 8 --robots 3 --area 40 -o room.toml
  rearrange run room.toml

{STATUSES}"))]
pub(crate) struct GenerateArgs {
    /// Seed: the same one gives the same room
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Number of objects
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=MAX_OBJECTS))]
    pub(crate) objects: u32,
    /// Number of robots
    #[arg(long, value_name = "M", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=MAX_ROBOTS))]
    pub(crate) robots: u32,
    /// Rooms divided by walls, or a warehouse: racks, aisles, robots that lift from below
    #[arg(long, value_enum, default_value_t)]
    pub(crate) layout: Layout,
    /// Rooms: free floor, square metres [default: 17]
    #[arg(long, value_name = "M2", value_parser = number(1.0, 10_000.0))]
    pub(crate) area: Option<f64>,
    /// Rooms: number of dividing walls, each with a doorway [default: 3]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=1_000))]
    pub(crate) walls: Option<u32>,
    /// Rooms: share of places next to other objects or in doorways [default: 0.5]
    #[arg(long, value_name = "SHARE", value_parser = number(0.0, 1.0))]
    pub(crate) crowding: Option<f64>,
    /// Rooms: moves beyond one an object [default: 0]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=10_000))]
    pub(crate) extra_moves: Option<u32>,
    /// Write to this file instead of stdout
    #[arg(long, short, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
}

/// What is generated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Layout {
    /// Rooms divided by walls, objects anywhere
    #[default]
    Rooms,
    /// Racks of pods between aisles, robots that lift them from below
    Warehouse,
}

const MAX_OBJECTS: i64 = shm_types::capacity::MAX_OBJECTS as i64;

#[derive(Debug, Args)]
#[command(after_help = format!("Example:\n  rearrange validate room.toml\n\n{STATUSES}"))]
pub(crate) struct ValidateArgs {
    /// Scenario file (TOML), or the name of a built-in scenario
    pub(crate) scenario: String,
    /// Take only the first M robots
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=MAX_ROBOTS))]
    pub(crate) robots: Option<u32>,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  rearrange scenarios\n  rearrange scenarios --write rooms/\n  \
                        rearrange scenarios paper-17a > mine.toml"
)]
pub(crate) struct ScenariosArgs {
    /// Print this scenario
    #[arg(value_name = "NAME", conflicts_with = "write")]
    pub(crate) name: Option<String>,
    /// Write all of them as NAME.toml into this directory, made if need be
    #[arg(long, value_name = "DIR")]
    pub(crate) write: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = format!("\
What was in the trace and in the journal goes on, so the result is that of the whole run.

Examples:
  rearrange list
  rearrange resume night --json

{STATUSES}"))]
pub(crate) struct ResumeArgs {
    /// Id or name of the run, or latest for the one started last
    #[arg(default_value = node::domain::LATEST)]
    pub(crate) run: String,
    /// Print the result as one JSON object on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct GcArgs {
    /// Only say what would be removed
    #[arg(long)]
    pub(crate) dry_run: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "Exit status: 0 if runs work here, warnings or not; 7 if they do not.")]
pub(crate) struct DoctorArgs {
    /// Print a JSON array
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ListArgs {
    /// Print a JSON array
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = format!("\
The change is made whole, from one tick on, or not at all; the answer names the tick or says why
not. Robots drive what is granted to them, then go on by a new plan. Lengths are metres, objects
and robots are counted from 0.

Examples:
  rearrange tell goal 2 4.0 1.5
  rearrange tell goal 0 4.0 1.5 1 none      two at once; object 1 is to go nowhere
  rearrange tell --run night close 3.0 0.0 3.2 1.4
  rearrange tell lose 1

{STATUSES}"))]
pub(crate) struct TellArgs {
    /// Name or id of the run, as `rearrange list` shows it; `latest` is the one started last
    #[arg(long, value_name = "RUN", default_value = node::domain::LATEST, global = true)]
    pub(crate) run: String,
    #[command(subcommand)]
    pub(crate) what: What,
}

/// What a run can be told.
#[derive(Debug, Subcommand)]
pub(crate) enum What {
    /// Objects are to go elsewhere: OBJECT X Y, or OBJECT none; several are changed together
    Goal {
        /// Number of the object, and where its centre shall be
        #[arg(value_name = "OBJECT X Y", num_args = 2.., required = true, allow_negative_numbers = true)]
        goals: Vec<String>,
    },
    /// Somebody else has moved an object that no robot holds
    Move {
        /// Number of the object
        object: usize,
        /// Where its centre is now
        #[arg(value_names = ["X", "Y"], num_args = 2, required = true, allow_negative_numbers = true, value_parser = number(-1e5, 1e5))]
        to: Vec<f64>,
    },
    /// There is one more object; it gets the next number
    AddObject {
        /// Where its centre is
        #[arg(value_names = ["X", "Y"], num_args = 2, required = true, allow_negative_numbers = true, value_parser = number(-1e5, 1e5))]
        at: Vec<f64>,
        /// Where it is to go [default: nowhere]
        #[arg(long, value_names = ["X", "Y"], num_args = 2, allow_negative_numbers = true, value_parser = number(-1e5, 1e5))]
        goal: Option<Vec<f64>>,
        /// It has the shape and the grasp of this object
        #[arg(long, value_name = "OBJECT", default_value_t = 0)]
        like: usize,
    },
    /// A wall stands where there was none: a box from its lower left to its upper right corner
    Close {
        /// The two corners
        #[arg(value_names = ["X0", "Y0", "X1", "Y1"], num_args = 4, required = true, allow_negative_numbers = true, value_parser = number(-1e5, 1e5))]
        corners: Vec<f64>,
    },
    /// A wall is gone
    Open {
        /// A point that this wall alone covers
        #[arg(value_names = ["X", "Y"], num_args = 2, required = true, allow_negative_numbers = true, value_parser = number(-1e5, 1e5))]
        at: Vec<f64>,
    },
    /// There is one more robot, at home; it gets the next number, and a process of its own
    AddRobot {
        /// Where its centre is: its home
        #[arg(value_names = ["X", "Y"], num_args = 2, required = true, allow_negative_numbers = true, value_parser = number(-1e5, 1e5))]
        at: Vec<f64>,
    },
    /// A robot takes part no more: it stays where it is, with what it holds, as an obstacle
    Lose {
        /// Number of the robot
        robot: u32,
    },
    /// A robot that was started again with `--restart hold` may move again
    Release {
        /// Number of the robot
        robot: u32,
    },
    /// A robot that was lost takes part again
    Back {
        /// Number of the robot
        robot: u32,
    },
}

/// Parses a finite number within the closed range, for clap.
pub(crate) fn number(
    least: f64,
    most: f64,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text| match text.parse::<f64>() {
        Ok(value) if value >= least && value <= most => Ok(value),
        Ok(_) => Err(format!("must be from {least} to {most}")),
        Err(_) => Err(format!("must be a number from {least} to {most}")),
    }
}
