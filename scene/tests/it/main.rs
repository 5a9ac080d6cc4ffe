//! Property and message tests of the domain, against its public interface alone.
#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "helpers of tests, which fail by panicking"
)]

mod cspace;
mod files;
mod geometry;
mod messages;
mod near;
mod reach;
mod shipped;
