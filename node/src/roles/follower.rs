//! Following the world: getting the next snapshot, when it is time for it.
//!
//! Responsible for: in lockstep, waiting for each snapshot; in real time, own absolute deadlines
//! at an own place in the world's period, and the newest snapshot there is at each.
//! Not responsible for: what is done with a snapshot.
//!
//! Terms: a *phase* is where in the world's period a participant's deadline lies, so that not all
//! start at once.

use shm_types::{Outcome, WorldSnapshot};

use crate::clock;
use crate::histograms::Timed;
use crate::options::Clock;
use crate::ports::{Access, Sample, Subscriber};
use crate::roles::{RoleError, Seat};
use crate::ticker::Ticker;
use crate::wait::Waiter;

/// A reader of snapshots.
pub(crate) struct Follower {
    inlet: Subscriber<WorldSnapshot>,
    waiter: Waiter,
    /// Deadline within the period, and the period, ns; `None` in lockstep.
    grid: Option<(u64, u64)>,
    /// The own deadlines, once the world's are known.
    ticker: Option<Ticker>,
}

impl Follower {
    /// A follower that is number `turn` of `turns` in the world's period.
    ///
    /// # Errors
    /// A port cannot be made.
    pub(crate) fn new(seat: &Seat, turn: u32, turns: u32) -> Result<Self, RoleError> {
        let service = seat.topics.world.service(&seat.node, Access::Open)?;
        let waiter = seat.waiter(|| {
            let wakes = &seat.topics.wake_participants;
            wakes.service(&seat.node, Access::Open)?.sleeper()
        })?;
        let grid = match seat.options().clock {
            Clock::Lockstep => None,
            Clock::Real { .. } => seat.options().clock.period_ns().map(|period_ns| {
                let phase_ns = period_ns * u64::from(turn + 1) / u64::from(turns + 1);
                (phase_ns, period_ns)
            }),
        };
        Ok(Self {
            inlet: service.subscriber()?,
            waiter,
            grid,
            ticker: None,
        })
    }

    /// Deadlines that had passed before this participant came to wait for them.
    pub(crate) fn deadline_misses(&self) -> u64 {
        self.ticker.map_or(0, |ticker| ticker.misses())
    }

    /// The next snapshot, once it is time for it; `None` once the run is over or this process is
    /// to end. The sample before it must have been dropped.
    ///
    /// # Errors
    /// Shared memory failed.
    pub(crate) fn next(
        &mut self,
        seat: &mut Seat,
    ) -> Result<Option<Sample<WorldSnapshot>>, RoleError> {
        if let Some(ticker) = &mut self.ticker {
            ticker.wait();
        }
        while !seat.is_stopped() {
            let Some(sample) = self.inlet.receive()? else {
                match &mut self.ticker {
                    Some(ticker) => {
                        ticker.wait();
                    }
                    None => self.waiter.pause()?,
                }
                continue;
            };
            self.waiter.arrived();
            let header = &sample.header;
            if header.outcome != Outcome::Running.code() {
                return Ok(None);
            }
            seat.record_since(Timed::SnapshotAge, header.publish_stamp_ns);
            if header.tick > 0 && self.ticker.is_none() {
                self.start_ticker(header.publish_stamp_ns);
            }
            return Ok(Some(sample));
        }
        Ok(None)
    }

    /// The world keeps its deadlines from its first tick on: so do we, at our phase.
    fn start_ticker(&mut self, world_ns: u64) {
        if let Some((phase_ns, period_ns)) = self.grid {
            let passed = clock::now_ns().saturating_sub(world_ns + phase_ns);
            let start_ns = world_ns + phase_ns + passed.div_ceil(period_ns) * period_ns;
            self.ticker = Some(Ticker::new(start_ns, period_ns));
        }
    }
}
