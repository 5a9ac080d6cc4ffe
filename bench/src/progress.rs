//! How a long measurement tells what it is doing, and hears that it should stop.
//!
//! Responsible for: the words between a workload and whoever watches it.
//! Not responsible for: terminals or signals (the binary).

/// Whoever watches a measurement.
pub trait Progress {
    /// So many steps are to come.
    fn begin(&mut self, steps: u64);
    /// The next step begins.
    fn step(&mut self, what: &str);
    /// Whether somebody wants it to end: the rows so far are kept.
    fn is_interrupted(&self) -> bool;
}

/// Nobody watches.
impl Progress for () {
    fn begin(&mut self, _steps: u64) {}
    fn step(&mut self, _what: &str) {}
    fn is_interrupted(&self) -> bool {
        false
    }
}
