//! Property and message tests of the domain, against its public interface alone.

mod cspace;
mod files;
mod geometry;
mod messages;
mod shipped;
