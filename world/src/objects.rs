//! The objects, and which of them may not be what they were when they were saved last.
//!
//! Responsible for: noting every object that somebody could have changed. Not responsible for: what
//! an object is (`state.rs`), what is saved (`parts.rs`).
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

/// Groups of objects of which one may have changed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touched([u64; MAX_PARTS.div_ceil(64)]);

impl Touched {
    /// All of them.
    pub(crate) const ALL: Self = Self([u64::MAX; MAX_PARTS.div_ceil(64)]);

    /// Notes an object.
    pub(crate) const fn touch(&mut self, object: usize) {
        let part = object / PER_PART;
        self.0[part / 64] |= 1 << (part % 64);
    }

    /// What was noted; from now on nothing is.
    pub(crate) const fn take(&mut self) -> Self {
        std::mem::replace(self, Self([0; MAX_PARTS.div_ceil(64)]))
    }

    /// Whether group `part` is among them.
    pub(crate) const fn has(&self, part: usize) -> bool {
        self.0[part / 64] >> (part % 64) & 1 == 1
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

    /// Which may have changed since the last call.
    pub(crate) const fn take_touched(&mut self) -> Touched {
        self.touched.take()
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
            let mut touched = Touched::ALL;
            touched.take();
            touched.touch(object);
            for part in 0..MAX_PARTS {
                let is_its = (part * PER_PART..(part + 1) * PER_PART).contains(&object);
                assert_eq!(touched.has(part), is_its, "{object} {part}");
            }
        }
    }
}
