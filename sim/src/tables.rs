//! What the planner publishes in versions, on its way to those who read it: constraint tables,
//! schedules.
//!
//! Responsible for: keeping the versions that a snapshot may still name.
//! Not responsible for: which version is in force (the world).

use shm_types::{Checked, Counts, Versioned, zeroed};

/// Versions kept. A snapshot names one of the newest two; the rest is for versions that are
/// published faster than the world can bring them into force.
const KEPT: usize = 4;

/// The newest of all that was published.
pub(crate) struct Tables<T> {
    kept: [Box<T>; KEPT],
    /// Whether each is a legal message.
    legal: [bool; KEPT],
    /// Where the newest is; `None` before the first.
    newest: Option<usize>,
}

impl<T: Versioned> Tables<T> {
    /// Nothing published yet.
    pub(crate) fn new() -> Self {
        Self {
            kept: std::array::from_fn(|_| zeroed()),
            legal: [false; KEPT],
            newest: None,
        }
    }

    /// Takes a new version. It takes the place of the oldest, but not of the one in force.
    pub(crate) fn publish(&mut self, message: &T, counts: Counts, in_force: u32) {
        let next = |place: usize| (place + 1) % KEPT;
        let mut place = self.newest.map_or(0, next);
        if in_force > 0 && self.kept[place].version() == in_force {
            place = next(place);
        }
        self.kept[place].copy_from(message);
        self.legal[place] = message.validate(counts).is_ok();
        self.newest = Some(place);
    }

    /// The newest: its version, and the message unless it is no legal one. `None` before the
    /// first.
    pub(crate) fn newest(&self) -> Option<(u32, Option<Checked<'_, T>>)> {
        let place = self.newest?;
        Some((self.kept[place].version(), self.checked(place)))
    }

    /// The message of this version, if it is kept.
    pub(crate) fn version(&self, version: u32) -> Option<Checked<'_, T>> {
        let mut kept = self.kept.iter();
        let place = kept.position(|kept| version > 0 && kept.version() == version)?;
        self.checked(place)
    }

    fn checked(&self, place: usize) -> Option<Checked<'_, T>> {
        self.legal[place].then(|| Checked::as_before(&*self.kept[place]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shm_types::ConstraintTable;

    const COUNTS: Counts = Counts {
        robots: 1,
        objects: 1,
    };

    fn table(version: u32) -> Box<ConstraintTable> {
        let mut table = ConstraintTable::none();
        table.version = version;
        table
    }

    #[test]
    fn the_one_in_force_is_kept_whatever_comes_after_it() {
        let mut tables = Tables::new();
        let in_force = 2;
        for version in 1..20 {
            tables.publish(&*table(version), COUNTS, in_force);
            let kept = |version| {
                tables
                    .version(version)
                    .is_some_and(|it| it.version == version)
            };
            assert_eq!(tables.newest().map(|(newest, _)| newest), Some(version));
            assert!(kept(version) && (version < in_force || kept(in_force)));
        }
        // All others give way to newer ones.
        assert!(tables.version(1).is_none());
    }

    #[test]
    fn version_0_names_none() {
        let mut tables = Tables::new();
        tables.publish(&*table(0), COUNTS, 0);
        assert!(tables.version(0).is_none());
    }
}
