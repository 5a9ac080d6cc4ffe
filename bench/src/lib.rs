//! Workloads, histograms, reports.
//!
//! Responsible for: what is measured, how often, and the numbers that follow; the machine they
//! were measured on.
//! Not responsible for: command lines or printing (the binary), or what is correct (tests).

pub mod compare;
pub mod conditions;
pub mod figure;
pub mod files;
pub mod latency;
pub mod machine;
pub mod paper;
pub mod planning;
pub mod progress;
pub mod report;
pub mod results;
pub mod scale;
pub mod solve;
pub mod speed;
pub mod stats;
