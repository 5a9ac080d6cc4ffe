//! What a run is asked to be, parsed once at the edge, and the part of it every process reads.
//!
//! Responsible for: the plan a caller hands to the supervisor, the `run.json` each process of the
//! run starts from, and the refusals that need nothing but the plan.
//! Not responsible for: command lines (the binary's) or limits of the machine (`domain`).
//!
//! Terms: a *role* is a kind of process; a *participant* is one process of a run.

use std::ffi::OsString;
use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use scene::Settings;
use serde::{Deserialize, Serialize};
use shm_types::{Counts, RoleKind};

/// Default period of the world in real time.
pub const DEFAULT_RATE_HZ: u32 = 1_000;
/// Fastest real-time rate accepted: a period shorter than this is all jitter.
pub const MAX_RATE_HZ: u32 = 100_000;
/// Default number of places kept free for programs that watch a run.
pub const DEFAULT_MONITORS: u32 = 4;
/// Most such places.
pub const MAX_MONITORS: u32 = 64;
/// Default rate of whole states in the trace, per second of world time.
pub const DEFAULT_STATE_RATE_HZ: f64 = 10.0;
/// How long all participants together may take to answer their first tick.
pub const DEFAULT_SETUP_DEADLINE: Duration = Duration::from_secs(20);
/// How long a participant may be silent in real time before it is killed.
pub const DEFAULT_SILENCE_LIMIT: Duration = Duration::from_secs(5);

/// Who sets the pace.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Clock {
    /// Virtual time: the world publishes a tick and waits for every live participant's answer.
    Lockstep,
    /// `CLOCK_MONOTONIC`: every participant keeps its own absolute deadlines.
    Real {
        /// Periods of the world per second of wall time.
        rate_hz: u32,
        /// Seconds of world time per second of wall time.
        speed: f64,
    },
}

/// How a lockstep participant waits for the next message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Wait {
    /// Never gives its core away. Only with a core for every process.
    Spin,
    /// Yields some rounds, then sleeps for at most a millisecond at a time.
    Hybrid,
    /// Sleeps until it is woken by an event.
    Block,
}

/// One process of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Owns the state of all bodies.
    World,
    /// Works out hard constraints.
    Planner,
    /// Moves the robot of this number.
    Robot(u32),
    /// Writes the trace.
    Recorder,
}

impl Role {
    /// All participants of a run with `robots` robots, in the order in which they are started.
    pub fn all(robots: u32) -> impl Iterator<Item = Self> {
        [Self::World, Self::Planner, Self::Recorder]
            .into_iter()
            .chain((0..robots).map(Self::Robot))
    }

    /// The subcommand that runs it.
    #[must_use]
    pub const fn subcommand(self) -> &'static str {
        match self {
            Self::World => "world",
            Self::Planner => "planner",
            Self::Robot(_) => "robot",
            Self::Recorder => "recorder",
        }
    }

    /// Its kind on the wire.
    #[must_use]
    pub const fn kind(self) -> RoleKind {
        match self {
            Self::World => RoleKind::World,
            Self::Planner => RoleKind::Planner,
            Self::Robot(_) => RoleKind::Robot,
            Self::Recorder => RoleKind::Recorder,
        }
    }
}

/// `world`, `planner`, `robot-2`, `recorder`: in messages and in file names.
impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Robot(index) => write!(f, "robot-{index}"),
            other => f.write_str(other.subcommand()),
        }
    }
}

/// A text that names no participant.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no role is called {0:?}; roles are world, planner, recorder and robot-N")]
pub struct UnknownRole(pub String);

impl std::str::FromStr for Role {
    type Err = UnknownRole;

    fn from_str(text: &str) -> Result<Self, UnknownRole> {
        match text {
            "world" => Ok(Self::World),
            "planner" => Ok(Self::Planner),
            "recorder" => Ok(Self::Recorder),
            other => other
                .strip_prefix("robot-")
                .and_then(|index| index.parse().ok())
                .map(Self::Robot)
                .ok_or_else(|| UnknownRole(other.to_owned())),
        }
    }
}

/// A participant made slow on purpose: it sleeps this long before it answers each tick. Tests
/// hold with it that timing changes no state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Delay {
    /// Who.
    pub role: Role,
    /// How long, in milliseconds of wall time.
    pub ms: u64,
    /// For how many ticks from the first on.
    pub ticks: u64,
}

/// What every process of a run reads: half of `run.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunOptions {
    /// What the machines are asked to do. `tick_ns` is virtual time per tick, in real time too.
    pub settings: Settings,
    /// Who sets the pace.
    pub clock: Clock,
    /// How participants wait in lockstep.
    pub wait: Wait,
    /// Whether each process is bound to a core.
    pub pin: bool,
    /// Whether to ask for `SCHED_FIFO` and locked memory. Where it is not permitted the run goes
    /// on without, and says so.
    pub realtime_scheduling: bool,
    /// Places kept free for programs that watch.
    pub monitors: u32,
    /// Whole states in the trace, per second of world time.
    pub state_rate_hz: f64,
    /// Participants made slow on purpose.
    pub delays: Vec<Delay>,
    /// Where the recorder writes; if none, in the run's directory, which goes with the report.
    pub trace: Option<PathBuf>,
    /// Where the world writes the state hash of each tick, one line each; nowhere if none.
    pub hashes: Option<PathBuf>,
}

impl RunOptions {
    /// Lockstep, hybrid waiting, nothing special, with these settings.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            clock: Clock::Lockstep,
            wait: Wait::Hybrid,
            pin: false,
            realtime_scheduling: false,
            monitors: DEFAULT_MONITORS,
            state_rate_hz: DEFAULT_STATE_RATE_HZ,
            delays: Vec::new(),
            trace: None,
            hashes: None,
        }
    }
}

/// How the supervisor starts a role: `program before… ROLE --run DIR [--index N]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Launcher {
    /// The executable.
    pub program: PathBuf,
    /// Arguments before the role's name.
    pub before: Vec<OsString>,
    /// Whether the roles' standard error is the supervisor's; otherwise it goes to a file in the
    /// run's directory, whose end is quoted when the role fails.
    pub inherit_stderr: bool,
}

/// All the supervisor is told.
#[derive(Clone, Debug, PartialEq)]
pub struct RunPlan {
    /// Name of the run; a live name is refused. Its id serves if none is given.
    pub name: Option<String>,
    /// The canonical scenario text all processes start from, cut to the robots that take part.
    pub scenario: String,
    /// What every process of the run reads.
    pub options: RunOptions,
    /// How a role is started.
    pub launcher: Launcher,
    /// How long all participants together may take to answer their first tick, per attempt.
    pub setup_deadline: Duration,
    /// How long a participant may be silent in real time before it is killed. Lockstep waits.
    pub silence_limit: Duration,
}

impl RunPlan {
    /// A plan with the default limits.
    #[must_use]
    pub fn new(scenario: String, options: RunOptions, launcher: Launcher) -> Self {
        Self {
            name: None,
            scenario,
            options,
            launcher,
            setup_deadline: DEFAULT_SETUP_DEADLINE,
            silence_limit: DEFAULT_SILENCE_LIMIT,
        }
    }
}

/// An option that no machine could honour as asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OptionError {
    /// Spinning with too few cores.
    #[error(
        "--wait spin needs a core for each process, but there are {processes} processes and \
         {cores} cores; use --wait hybrid"
    )]
    Spin {
        /// Processes that would spin.
        processes: usize,
        /// Cores there are.
        cores: usize,
    },
    /// Real-time priority for processes that never sleep, with too few cores.
    #[error(
        "real-time scheduling with --wait {wait} needs a core for each process, but there are \
         {processes} processes and {cores} cores; use --wait block"
    )]
    Fifo {
        /// The wait asked for.
        wait: &'static str,
        /// Processes there would be.
        processes: usize,
        /// Cores there are.
        cores: usize,
    },
    /// A number out of its range.
    #[error("{what} is {value}, but must be {range}")]
    Range {
        /// Which option.
        what: &'static str,
        /// What was given.
        value: f64,
        /// What is accepted.
        range: &'static str,
    },
    /// A delay for a robot that does not exist.
    #[error("{role} is to be delayed, but there are only {robots} robots, counted from 0")]
    Delay {
        /// Who.
        role: Role,
        /// Robots there are.
        robots: u32,
    },
}

/// Processes that work in every tick: world, planner, recorder and robots.
#[must_use]
pub const fn processes(counts: Counts) -> usize {
    counts.robots as usize + 3
}

impl RunOptions {
    /// Refuses what cannot work with this many processes on this many cores.
    ///
    /// # Errors
    /// The first option that cannot be honoured.
    pub fn check(&self, counts: Counts, cores: usize) -> Result<(), OptionError> {
        let processes = processes(counts);
        if self.clock == Clock::Lockstep && processes > cores {
            let wait = match self.wait {
                Wait::Spin => return Err(OptionError::Spin { processes, cores }),
                Wait::Hybrid => Some("hybrid"),
                Wait::Block => None,
            };
            if let (Some(wait), true) = (wait, self.realtime_scheduling) {
                return Err(OptionError::Fifo {
                    wait,
                    processes,
                    cores,
                });
            }
        }
        if let Clock::Real { rate_hz, speed } = self.clock {
            in_range(
                "--rate",
                f64::from(rate_hz),
                "from 1 to 100000 Hz",
                (1..=MAX_RATE_HZ).contains(&rate_hz),
            )?;
            let fine = speed.is_finite() && speed > 0.0;
            in_range("--speed", speed, "a positive number", fine)?;
        }
        in_range(
            "--monitors",
            f64::from(self.monitors),
            "from 0 to 64",
            self.monitors <= MAX_MONITORS,
        )?;
        let rate = self.state_rate_hz;
        let fine = rate.is_finite() && rate >= 0.0;
        in_range("the state rate", rate, "0 or a positive number", fine)?;
        for delay in &self.delays {
            if let Role::Robot(index) = delay.role
                && index >= counts.robots
            {
                return Err(OptionError::Delay {
                    role: delay.role,
                    robots: counts.robots,
                });
            }
        }
        Ok(())
    }
}

fn in_range(
    what: &'static str,
    value: f64,
    range: &'static str,
    fine: bool,
) -> Result<(), OptionError> {
    if fine {
        Ok(())
    } else {
        Err(OptionError::Range { what, value, range })
    }
}

impl Clock {
    /// Wall time of a real-time period, ns; `None` in lockstep.
    #[must_use]
    pub fn period_ns(self) -> Option<u64> {
        match self {
            Self::Lockstep => None,
            Self::Real { rate_hz, .. } => Some(1_000_000_000 / u64::from(rate_hz.max(1))),
        }
    }

    /// Virtual time of a tick, ns, for this clock: `lockstep_ns` in lockstep, speed over rate in
    /// real time (at least 1 ns).
    #[must_use]
    pub fn tick_ns(self, lockstep_ns: u64) -> u64 {
        match self {
            Self::Lockstep => lockstep_ns,
            Self::Real { rate_hz, speed } => {
                ((speed * 1e9 / f64::from(rate_hz.max(1))).round() as u64).max(1)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNTS: Counts = Counts {
        robots: 4,
        objects: 5,
    };

    fn options() -> RunOptions {
        RunOptions::new(Settings::default())
    }

    #[test]
    fn spinning_takes_a_core_for_each_process() {
        let spin = RunOptions {
            wait: Wait::Spin,
            ..options()
        };
        assert_eq!(spin.check(COUNTS, 7), Ok(()));
        let refused = spin.check(COUNTS, 6);
        let expected = OptionError::Spin {
            processes: 7,
            cores: 6,
        };
        assert_eq!(refused, Err(expected));
        assert_eq!(options().check(COUNTS, 2), Ok(()), "hybrid may share cores");
    }

    #[test]
    fn real_time_priority_with_yielding_takes_a_core_for_each_process() {
        let asked = |wait, clock| RunOptions {
            wait,
            clock,
            realtime_scheduling: true,
            ..options()
        };
        let real = Clock::Real {
            rate_hz: 1_000,
            speed: 1.0,
        };
        assert!(
            asked(Wait::Hybrid, Clock::Lockstep)
                .check(COUNTS, 2)
                .is_err()
        );
        assert_eq!(
            asked(Wait::Hybrid, Clock::Lockstep).check(COUNTS, 7),
            Ok(())
        );
        assert_eq!(asked(Wait::Block, Clock::Lockstep).check(COUNTS, 2), Ok(()));
        // In real time everybody sleeps to a deadline.
        assert_eq!(asked(Wait::Hybrid, real).check(COUNTS, 2), Ok(()));
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        for (rate_hz, speed) in [(0, 1.0), (MAX_RATE_HZ + 1, 1.0), (1, 0.0), (1, f64::NAN)] {
            let clock = Clock::Real { rate_hz, speed };
            let options = RunOptions { clock, ..options() };
            let refused = options.check(COUNTS, 8);
            assert!(matches!(refused, Err(OptionError::Range { .. })));
        }
        let delay = Delay {
            role: Role::Robot(4),
            ms: 1,
            ticks: 1,
        };
        let options = RunOptions {
            delays: vec![delay],
            ..options()
        };
        let refused = options.check(COUNTS, 8);
        assert!(matches!(refused, Err(OptionError::Delay { .. })));
    }

    #[test]
    fn roles_are_read_as_they_are_written() {
        for role in Role::all(3) {
            assert_eq!(role.to_string().parse(), Ok(role));
        }
        for text in ["", "robot", "robot-", "robot-x", "World"] {
            assert_eq!(text.parse::<Role>(), Err(UnknownRole(text.to_owned())));
        }
    }

    #[test]
    fn virtual_time_of_a_period_is_speed_over_rate() {
        let real = Clock::Real {
            rate_hz: 1_000,
            speed: 20.0,
        };
        assert_eq!(real.tick_ns(7), 20_000_000);
        assert_eq!(real.period_ns(), Some(1_000_000));
        assert_eq!(Clock::Lockstep.tick_ns(7), 7);
        assert_eq!(Clock::Lockstep.period_ns(), None);
    }
}
