//! The objects, and which of them may not be what they were when they were saved, or checked, last.
//!
//! Responsible for: noting every object that somebody could have changed. Not responsible for: what
//! an object is (`state.rs`), what is saved (`parts.rs`) or checked (`invariants.rs`).
//!
//! An object can be changed through [`IndexMut`] and [`Objects::iter_mut`] only, and those note it:
//! nobody has to remember to.

use std::ops::{Deref, Index, IndexMut};

use shm_types::capacity::MAX_OBJECTS;

use crate::state::Object;

/// Objects that are saved together, in one part of a state.
pub const PER_PART: usize = 8;
/// Most parts of a state that hold objects.
pub const MAX_PARTS: usize = MAX_OBJECTS.div_ceil(PER_PART);

/// Objects noted for one reader.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noted([u64; MAX_OBJECTS.div_ceil(64)]);

impl Noted {
    /// All of them.
    pub(crate) const ALL: Self = Self([u64::MAX; MAX_OBJECTS.div_ceil(64)]);

    const fn note(&mut self, object: usize) {
        self.0[object / 64] |= 1 << (object % 64);
    }

    /// What was noted; from now on nothing is.
    const fn take(&mut self) -> Self {
        std::mem::replace(self, Self([0; MAX_OBJECTS.div_ceil(64)]))
    }

    /// Whether one of group `part` is among them.
    pub(crate) const fn has(&self, part: usize) -> bool {
        let first = part * PER_PART;
        self.0[first / 64] >> (first % 64) & ((1 << PER_PART) - 1) != 0
    }
}

const _: () = assert!(64_usize.is_multiple_of(PER_PART), "a group is in one word");

/// Objects that somebody could have changed since they were saved, and since they were checked.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touched {
    unsaved: Noted,
    unchecked: Noted,
}

impl Touched {
    /// All of them.
    pub(crate) const ALL: Self = Self {
        unsaved: Noted::ALL,
        unchecked: Noted::ALL,
    };

    /// Notes an object.
    pub(crate) const fn touch(&mut self, object: usize) {
        self.unsaved.note(object);
        self.unchecked.note(object);
    }

    /// Which are to be saved; from now on none is.
    pub(crate) const fn take_unsaved(&mut self) -> Noted {
        self.unsaved.take()
    }

    /// Which of objects 64 `word` to 64 `word` + 63 are to be checked, a bit each; from now on
    /// none is.
    pub(crate) const fn take_unchecked(&mut self, word: usize) -> u64 {
        std::mem::replace(&mut self.unchecked.0[word], 0)
    }

    /// One that has been checked: what a robot holds, with the robot.
    pub(crate) const fn pass(&mut self, object: usize) {
        self.unchecked.0[object / 64] &= !(1 << (object % 64));
    }

    /// All are to be checked.
    pub(crate) const fn check_all(&mut self) {
        self.unchecked = Noted::ALL;
    }
}

/// All objects of a run, by their ids.
#[derive(Clone, Debug)]
pub(crate) struct Objects {
    all: Vec<Object>,
    touched: Touched,
}

impl Objects {
    /// Adds one more.
    pub(crate) fn push(&mut self, object: Object) {
        self.touched.touch(self.all.len());
        self.all.push(object);
    }

    /// All of them, each of which counts as changed.
    pub(crate) fn iter_mut(&mut self) -> std::slice::IterMut<'_, Object> {
        self.touched = Touched::ALL;
        self.all.iter_mut()
    }

    /// Which somebody could have changed.
    pub(crate) const fn touched(&mut self) -> &mut Touched {
        &mut self.touched
    }
}

impl FromIterator<Object> for Objects {
    fn from_iter<I: IntoIterator<Item = Object>>(objects: I) -> Self {
        Self {
            all: objects.into_iter().collect(),
            touched: Touched::ALL,
        }
    }
}

impl Deref for Objects {
    type Target = [Object];

    fn deref(&self) -> &[Object] {
        &self.all
    }
}

impl Index<usize> for Objects {
    type Output = Object;

    fn index(&self, object: usize) -> &Object {
        &self.all[object]
    }
}

impl IndexMut<usize> for Objects {
    fn index_mut(&mut self, object: usize) -> &mut Object {
        self.touched.touch(object);
        &mut self.all[object]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_object_that_is_touched_is_saved_with_its_group_and_no_other() {
        for object in 0..MAX_OBJECTS {
            let mut all = Touched::ALL;
            all.take_unsaved();
            all.touch(object);
            let touched = all.take_unsaved();
            for part in 0..MAX_PARTS {
                let is_its = (part * PER_PART..(part + 1) * PER_PART).contains(&object);
                assert_eq!(touched.has(part), is_its, "{object} {part}");
            }
        }
    }

    #[test]
    fn an_object_that_is_touched_is_checked_once_and_saved_all_the_same() {
        let mut touched = Touched::ALL;
        touched.take_unsaved();
        for word in 0..MAX_OBJECTS / 64 {
            assert_eq!(touched.take_unchecked(word), u64::MAX);
        }
        touched.touch(70);
        assert_eq!(touched.take_unchecked(0), 0);
        assert_eq!(touched.take_unchecked(1), 1 << 6);
        assert_eq!(touched.take_unchecked(1), 0);
        assert!(touched.take_unsaved().has(70 / PER_PART));
    }
}
