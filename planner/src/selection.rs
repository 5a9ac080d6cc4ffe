//! Selection (§III.C.3): who takes which task.
use std::task::Poll;

use scene::{Budget, Scene, Settings};
use shm_types::{Checked, ConstraintTable, Counters, WorldSnapshot};

/// Selection.
#[derive(Debug)]
pub struct Selection;

impl Selection {
    /// Whether the table suffices for a selection at this snapshot: method "all" has to wait
    /// until the planner has completed it.
    #[must_use]
    pub fn is_ready(
        _settings: &Settings,
        _world: Checked<WorldSnapshot>,
        _table: &ConstraintTable,
    ) -> bool {
        todo!()
    }

    /// Room for the scene.
    #[must_use]
    pub fn new(_scene: &Scene, _settings: &Settings) -> Self {
        todo!()
    }

    /// Copies the epoch's frozen inputs.
    pub fn begin(&mut self, _world: Checked<WorldSnapshot>, _table: &ConstraintTable) {
        todo!()
    }

    /// Goes on.
    pub fn advance(
        &mut self,
        _scene: &Scene,
        _budget: &mut Budget,
        _counters: &mut Counters,
    ) -> Poll<()> {
        todo!()
    }

    /// The task that robot takes; none for a robot that was not free at the epoch, or gets none.
    #[must_use]
    pub fn task_of(&self, _robot: usize) -> Option<usize> {
        todo!()
    }

    /// A cycle among unfinished tasks (rule 15), if any.
    #[must_use]
    pub fn cycle(&self) -> &[usize] {
        todo!()
    }
}
