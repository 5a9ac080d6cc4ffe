//! The world's step machine.
