//! The planner service's step machine.
use scene::{Scene, Settings};
use shm_types::{Checked, ConstraintTable, HardAnswer, HardRequest, PlannerReport, WorldSnapshot};

/// What one step of the planner is given.
pub struct PlannerInput<'a> {
    /// Snapshot of this tick.
    pub snapshot: Checked<'a, WorldSnapshot>,
    /// Requests stamped before this tick, in the order of robots.
    pub requests: &'a [HardRequest],
}

/// What one step of the planner gives.
pub struct PlannerOutput<'a> {
    /// Its report to the world.
    pub report: PlannerReport,
    /// Answers, to be seen in the next tick.
    pub answers: &'a [HardAnswer],
    /// A new version of the table, to be seen in the next tick.
    pub table: Option<&'a ConstraintTable>,
}

/// The planner.
#[derive(Debug)]
pub struct Planner;

impl Planner {
    /// A planner with nothing to do yet.
    #[must_use]
    pub fn new(_scene: &Scene, _settings: Settings) -> Self {
        todo!()
    }

    /// One step with `units` of work.
    pub fn step(&mut self, _scene: &Scene, _input: PlannerInput, _units: u64) -> PlannerOutput<'_> {
        todo!()
    }
}
