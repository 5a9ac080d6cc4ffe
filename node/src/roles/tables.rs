//! What the planner publishes in versions, on its way to those who read it: constraint tables,
//! schedules.
//!
//! Responsible for: holding, in place, the versions that a snapshot may still name, and checking
//! each once.
//! Not responsible for: which version is in force (the world).
//!
//! A snapshot names the newest version or the one before it that came into force.

use std::collections::VecDeque;

use shm_types::{Checked, Counts, Invalid, Versioned};

use crate::ports::{Sample, Service, Subscriber, TopicError};
use crate::wire::Message;

/// Versions held.
const KEPT: usize = 2;

/// The newest of all that was published.
pub(crate) struct Tables<T: Message> {
    inlet: Subscriber<T>,
    counts: Counts,
    /// Oldest first.
    kept: VecDeque<Kept<T>>,
}

/// A version that is held.
pub(crate) struct Kept<T: Message> {
    sample: Sample<T>,
    invalid: Option<Invalid>,
}

impl<T: Message + Versioned> Kept<T> {
    /// Its version, legal or not.
    pub(crate) fn version(&self) -> u32 {
        self.sample.version()
    }

    /// The message, checked.
    ///
    /// # Errors
    /// It is no legal message.
    pub(crate) fn checked(&self) -> Result<Checked<'_, T>, Invalid> {
        match self.invalid {
            // A sample does not change.
            None => Ok(Checked::as_before(&*self.sample)),
            Some(invalid) => Err(invalid),
        }
    }
}

impl<T: Message + Versioned> Tables<T> {
    /// Nothing received yet.
    ///
    /// # Errors
    /// The port cannot be made.
    pub(crate) fn new(service: &Service<T>, counts: Counts) -> Result<Self, TopicError> {
        Ok(Self {
            inlet: service.subscriber()?,
            counts,
            kept: VecDeque::with_capacity(KEPT + 1),
        })
    }

    /// Checks what is held, and what comes, against another version of the scene.
    pub(crate) fn recount(&mut self, counts: Counts) {
        self.counts = counts;
        for kept in &mut self.kept {
            kept.invalid = kept.sample.validate(counts).err();
        }
    }

    /// Takes in what has been published. The version in force is kept, and the newest.
    ///
    /// # Errors
    /// Shared memory failed.
    pub(crate) fn receive(&mut self, in_force: u32) -> Result<(), TopicError> {
        while let Some(sample) = self.inlet.receive()? {
            let invalid = sample.validate(self.counts).err();
            self.kept.push_back(Kept { sample, invalid });
            if self.kept.len() > KEPT {
                let first_is_in_force = self.kept[0].version() == in_force;
                self.kept.remove(usize::from(first_is_in_force));
            }
        }
        Ok(())
    }

    /// The newest; `None` before the first.
    pub(crate) fn newest(&self) -> Option<&Kept<T>> {
        self.kept.back()
    }

    /// The one of this version, if it is held.
    pub(crate) fn version(&self, version: u32) -> Option<&Kept<T>> {
        let mut kept = self.kept.iter();
        kept.find(|kept| version > 0 && kept.version() == version)
    }
}
