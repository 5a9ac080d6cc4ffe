//! Absolute deadlines on `CLOCK_MONOTONIC`.
//!
//! Responsible for: sleeping to the next deadline of a fixed grid, and counting those it was too
//! late for.
//! Not responsible for: what is done in a period.
//!
//! Deadlines lie on the grid `start + k · period`. Whoever comes too late for one skips to the
//! next that is still ahead: work is never done in a burst to catch up.
//!
//! The world's grid goes through the zero of `CLOCK_MONOTONIC`, and a follower's lies a fixed
//! *phase* behind it. So everybody knows everybody's deadlines, without a message.

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

    /// The grid `k · period + phase`, from the first deadline after `now_ns` on.
    pub(crate) const fn aligned(now_ns: u64, period_ns: u64, phase_ns: u64) -> Self {
        let passed = now_ns.saturating_sub(phase_ns) / period_ns + 1;
        Self::new(passed * period_ns + phase_ns, period_ns)
    }

    /// Forgets the misses so far: the warm-up is over.
    pub(crate) const fn forget_misses(&mut self) {
        self.misses = 0;
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

/// Periods that one message can be for: further back there was no run, or no clock that could be
/// believed.
const MOST_PERIODS: u64 = 100_000;

/// What was due in each period of the world, and when it came: for times that no stall can hide,
/// since every period it swallowed counts, from its own deadline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Due {
    period_ns: u64,
    phase_ns: u64,
    /// First period that nothing has come for yet.
    next: Option<u64>,
}

impl Due {
    /// Due at `k · period + phase`, for each k.
    pub(crate) const fn new(period_ns: u64, phase_ns: u64) -> Self {
        Self {
            period_ns,
            phase_ns,
            next: None,
        }
    }

    /// At time `now_ns` there came what was published at `published_ns`: the lateness of each
    /// period that this is for, the oldest first. Nothing is due before the first. A stamp that is
    /// no past time counts as now, and none leads back.
    pub(crate) fn came(&mut self, published_ns: u64, now_ns: u64) -> impl Iterator<Item = u64> {
        let period = published_ns.min(now_ns) / self.period_ns;
        let next = self.next.unwrap_or(period);
        let from = next.max((period + 1).saturating_sub(MOST_PERIODS));
        self.next = Some(next.max(period + 1));
        let Self {
            period_ns,
            phase_ns,
            ..
        } = *self;
        (from..=period).map(move |k| now_ns.saturating_sub(k * period_ns + phase_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_of_the_world_is_known_to_all() {
        let mut world = Ticker::aligned(1_234, 100, 0);
        let mut follower = Ticker::aligned(1_234, 100, 30);
        assert_eq!(world.schedule(1_234), 1_300);
        assert_eq!(follower.schedule(1_234), 1_330);
        assert_eq!(Ticker::aligned(1_229, 100, 30).schedule(1_229), 1_230);
    }

    #[test]
    fn a_stall_counts_for_every_period_it_swallowed() {
        let mut due = Due::new(100, 30);
        let mut came = |published, now| due.came(published, now).collect::<Vec<_>>();
        assert_eq!(came(1_001, 1_031), [1]);
        assert_eq!(came(1_105, 1_135), [5]);
        // Nobody looked at 1 230 and 1 330: the look at 1 431 ends three waits.
        assert_eq!(came(1_402, 1_431), [201, 101, 1]);
        // Had before it was due, and the same again.
        assert_eq!(came(1_500, 1_510), [0]);
        assert_eq!(came(1_500, 1_520), [0; 0]);
    }

    #[test]
    fn a_stamp_that_cannot_be_is_soon_over() {
        let mut due = Due::new(100, 30);
        let mut came = |published, now| due.came(published, now).count();
        assert_eq!(came(u64::MAX, 1_031), 1, "as if it were of now");
        assert_eq!(came(0, 1_135), 0);
        assert_eq!(came(1_205, 1_235), 2);
        let years = 1 << 60;
        assert_eq!(came(years, years), MOST_PERIODS as usize);
    }

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
