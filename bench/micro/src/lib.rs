//! What the micro-benchmarks share: rooms, queries, and the reference for path search.
//!
//! Responsible for: setting the hot pieces up the same way for criterion and for counting
//! instructions.
//! Not responsible for: the numbers that count (`rearrange bench`), correctness (tests).
#![forbid(unsafe_code)]

pub mod reference;
pub mod rooms;
