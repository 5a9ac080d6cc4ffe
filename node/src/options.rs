//! What every process of a run is told, parsed once at the edge.
//!
//! Responsible for: the options each process of the run starts from, their limits, and the
//! refusals that need nothing but them.
//! Not responsible for: command lines (the binary's), limits of the machine (`shared_memory`), or
//! what the supervisor alone is told (`plan`).

mod plan;
mod role;
#[cfg(test)]
mod tests;

use std::path::PathBuf;

use scene::{Change, Settings};
use serde::{Deserialize, Serialize};
use shm_types::Counts;
use shm_types::capacity::{MAX_OBJECTS, MAX_ROBOTS};

pub use plan::{DEFAULT_GIVE_UP_AFTER, DEFAULT_SETUP_DEADLINE, DEFAULT_SILENCE_LIMIT};
pub use plan::{GiveUp, Launcher, Recovery, Restart, RunPlan};
pub use role::{Role, UnknownRole};

/// Default period of the world in real time.
pub const DEFAULT_RATE_HZ: u32 = 1_000;
/// Fastest real-time rate accepted: a period shorter than this is all jitter.
pub const MAX_RATE_HZ: u32 = 100_000;
/// Default number of places kept free for programs that watch a run.
pub const DEFAULT_MONITORS: u32 = 4;
/// Most such places.
pub const MAX_MONITORS: u32 = 64;
/// Default number of robots that can be added to a run.
pub const DEFAULT_MORE_ROBOTS: u32 = 2;
/// Default rate of whole states in the trace, per second of world time.
pub const DEFAULT_STATE_RATE_HZ: f64 = 10.0;

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

/// Something that a run is told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Told {
    /// The scene changes, all of it together.
    Change(Vec<Change>),
    /// A robot takes part no more.
    Lose(u32),
    /// It takes part again.
    Back(u32),
}

/// What a run is told in a stated tick: the snapshot after it shows it first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToldAt {
    /// The tick.
    pub tick: u64,
    /// What it is told.
    pub what: Told,
}

impl ToldAt {
    /// That it could not be made, as one sentence.
    #[must_use]
    pub fn not_made(&self, why: &str) -> String {
        format!("what tick {} was to bring was not made: {why}", self.tick)
    }
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
    /// Robots that can be added on the way: shared memory has room for them.
    pub more_robots: u32,
    /// Whole states in the trace, per second of world time.
    pub state_rate_hz: f64,
    /// Ticks from the first on whose latencies are not kept.
    pub warm_up_ticks: u64,
    /// Participants made slow on purpose.
    pub delays: Vec<Delay>,
    /// What the run is told on its way.
    pub changes: Vec<ToldAt>,
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
            more_robots: DEFAULT_MORE_ROBOTS,
            state_rate_hz: DEFAULT_STATE_RATE_HZ,
            warm_up_ticks: 0,
            delays: Vec::new(),
            changes: Vec::new(),
            trace: None,
            hashes: None,
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
    #[error("{role} is to be delayed, but there is only room for {robots} robots, counted from 0")]
    Delay {
        /// Who.
        role: Role,
        /// Robots there can be.
        robots: u32,
    },
}

/// Processes that work in every tick: world, planner, recorder and robots.
#[must_use]
pub const fn processes(counts: Counts) -> usize {
    counts.robots as usize + 3
}

impl RunOptions {
    /// What a run that begins with `counts` can come to have.
    #[must_use]
    pub fn room(&self, counts: Counts) -> Counts {
        let robots = counts.robots.saturating_add(self.more_robots);
        Counts {
            robots: robots.min(MAX_ROBOTS as u32),
            objects: MAX_OBJECTS as u32,
        }
    }

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
        let robots = self.room(counts).robots;
        for delay in &self.delays {
            if let Role::Robot(index) = delay.role
                && index >= robots
            {
                return Err(OptionError::Delay {
                    role: delay.role,
                    robots,
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
