//! Absolute deadlines on `CLOCK_MONOTONIC`.
//!
//! Responsible for: sleeping to the next deadline of a fixed grid, and counting those it was too
//! late for.
//! Not responsible for: what is done in a period.
//!
//! Deadlines lie on the grid `start + k · period`. Whoever comes too late for one skips to the
//! next that is still ahead: work is never done in a burst to catch up.

use rustix::io::Errno;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec};

use crate::clock::now_ns;

/// A grid of deadlines.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ticker {
    next_ns: u64,
    period_ns: u64,
    misses: u64,
}

impl Ticker {
    /// The grid through `start_ns` (`CLOCK_MONOTONIC`), every `period_ns`.
    pub(crate) const fn new(start_ns: u64, period_ns: u64) -> Self {
        Self {
            next_ns: start_ns,
            period_ns: if period_ns == 0 { 1 } else { period_ns },
            misses: 0,
        }
    }

    /// Deadlines that had passed before anybody waited for them.
    pub(crate) const fn misses(&self) -> u64 {
        self.misses
    }

    /// The deadline to wait for at time `now_ns`; counts those that have passed.
    pub(crate) const fn schedule(&mut self, now_ns: u64) -> u64 {
        if now_ns > self.next_ns {
            let passed = (now_ns - self.next_ns).div_ceil(self.period_ns);
            self.misses += passed;
            self.next_ns += passed * self.period_ns;
        }
        let deadline = self.next_ns;
        self.next_ns += self.period_ns;
        deadline
    }

    /// Sleeps until the next deadline that is still ahead. Returns early, with `false`, when a
    /// signal comes.
    pub(crate) fn wait(&mut self) -> bool {
        let deadline_ns = self.schedule(now_ns());
        let at = Timespec {
            tv_sec: (deadline_ns / 1_000_000_000).cast_signed(),
            tv_nsec: (deadline_ns % 1_000_000_000).cast_signed(),
        };
        clock_nanosleep_absolute(ClockId::Monotonic, &at) != Err(Errno::INTR)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_to_the_grid_while_in_time() {
        let mut ticker = Ticker::new(100, 10);
        assert_eq!(ticker.schedule(95), 100);
        assert_eq!(ticker.schedule(103), 110);
        assert_eq!(ticker.schedule(120), 120);
        assert_eq!(ticker.misses(), 0);
    }

    #[test]
    fn an_overrun_skips_and_is_counted_and_never_bursts() {
        let mut ticker = Ticker::new(100, 10);
        assert_eq!(ticker.schedule(100), 100);
        // 110, 120 and 130 have passed; 140 is ahead.
        assert_eq!(ticker.schedule(131), 140);
        assert_eq!(ticker.misses(), 3);
        assert_eq!(ticker.schedule(141), 150);
        assert_eq!(ticker.misses(), 3);
    }
}
