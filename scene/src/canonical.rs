//! The canonical text of a scenario.

use crate::draft::Draft;

/// Hash of the canonical text.
pub(crate) fn hash(draft: &Draft) -> u64 {
    let _ = draft;
    0
}
