//! What is left of a run in process.
//!
//! Responsible for: gathering what the machines know at the end.
//! Not responsible for: turning it into a result (the binary does).

use std::fmt;

use shm_types::{Counters, Outcome, Verdict};
use world::{ActivityTimes, Refused, Violation, WorldCounters};

/// One robot's account.
#[derive(Clone, Copy, Debug)]
pub struct RobotReport {
    /// Ticks by activity; they sum up to the ticks of the run (rule 24).
    pub times: ActivityTimes,
    /// Work done.
    pub counters: Counters,
}

/// How a run ended.
#[derive(Clone, Debug)]
pub struct SimReport {
    /// How it ended.
    pub outcome: Outcome,
    /// What the planner said of the run's end.
    pub verdict: Verdict,
    /// Why, where the outcome alone does not say.
    pub reason: Option<String>,
    /// Ticks made.
    pub ticks: u64,
    /// World time at the end, ns.
    pub time_ns: u64,
    /// Hash of everybody's state, chained over all ticks.
    pub state_hash: u64,
    /// What the world counted.
    pub world: WorldCounters,
    /// The invariant that it found broken, if it did.
    pub violation: Option<Violation>,
    /// The newest schedule that it refused.
    pub refused: Option<Refused>,
    /// How often the scene was changed.
    pub scene_version: u32,
    /// The robots.
    pub robots: Vec<RobotReport>,
    /// Work done by the planner service.
    pub planner: Counters,
}

impl SimReport {
    /// Work done by robots and planner together.
    #[must_use]
    pub fn counters(&self) -> Counters {
        let robots = self.robots.iter().map(|robot| robot.counters);
        self.planner + robots.sum()
    }
}

/// Tasks each of which comes before the next, and the last before the first (rule 15).
pub(crate) struct Cycle<'a>(pub(crate) &'a [usize]);

impl fmt::Display for Cycle<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cycle: ")?;
        self.0.iter().try_for_each(|task| write!(f, "{task} → "))?;
        self.0.first().map_or(Ok(()), |first| write!(f, "{first}"))
    }
}
