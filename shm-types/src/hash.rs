//! The state hash: XXH3 over the live part of messages in canonical order, chained over ticks.

use xxhash_rust::xxh3::Xxh3Default;
use zerocopy::{Immutable, IntoBytes};

/// Collects state and yields a 64-bit hash of it. Equal sequences of values give equal hashes
/// on every machine of the same endianness.
#[derive(Clone, Default)]
pub struct StateHash(Xxh3Default);

impl StateHash {
    /// An empty hash.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Starts over, keeping the memory.
    pub fn reset(&mut self) {
        self.0.reset();
    }

    /// Adds a message, or a slice of messages.
    pub fn add<T: IntoBytes + Immutable + ?Sized>(&mut self, value: &T) {
        self.0.update(value.as_bytes());
    }

    /// The hash of all that was added.
    #[must_use]
    pub fn finish(&self) -> u64 {
        self.0.digest()
    }
}

impl std::fmt::Debug for StateHash {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "StateHash({:016x})", self.finish())
    }
}
