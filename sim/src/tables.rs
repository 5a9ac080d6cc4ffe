//! Constraint tables on their way from the planner to those who read them.
//!
//! Responsible for: keeping the versions that a snapshot may still name.
//! Not responsible for: which version is in force (the world).

use shm_types::{ConstraintTable, zeroed};

/// Versions kept. An epoch opens with every version that comes into force, so that a snapshot
/// names one of the newest two; the rest is for versions that are published faster than the world
/// can bring them into force.
const KEPT: usize = 4;

/// The newest tables.
pub(crate) struct Tables {
    /// Version 0.
    empty: Box<ConstraintTable>,
    kept: [Box<ConstraintTable>; KEPT],
    /// Where the newest is; `None` before the first.
    newest: Option<usize>,
}

impl Tables {
    /// Nothing published yet.
    pub(crate) fn new() -> Self {
        Self {
            empty: ConstraintTable::none(),
            kept: std::array::from_fn(|_| zeroed()),
            newest: None,
        }
    }

    /// Takes a new version.
    pub(crate) fn publish(&mut self, table: &ConstraintTable) {
        let place = self.newest.map_or(0, |newest| (newest + 1) % KEPT);
        self.kept[place].copy_from(table);
        self.newest = Some(place);
    }

    /// The newest table; `None` before the first.
    pub(crate) fn newest(&self) -> Option<&ConstraintTable> {
        self.newest.map(|newest| &*self.kept[newest])
    }

    /// The table of this version. The empty one if it is not kept: its reader sees that it is not
    /// the one it wants, and waits.
    pub(crate) fn version(&self, version: u32) -> &ConstraintTable {
        let kept = self
            .kept
            .iter()
            .find(|table| version > 0 && table.version == version);
        kept.unwrap_or(&self.empty)
    }
}
