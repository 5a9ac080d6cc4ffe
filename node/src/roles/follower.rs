//! Following the world: getting the next snapshot, when it is time for it.
//!
//! Responsible for: in lockstep, waiting for each snapshot; in real time, own absolute deadlines
//! at an own place in the world's period, and the newest snapshot there is at each; how old it is
//! then.
//! Not responsible for: what is done with a snapshot.
//!
//! Terms: a *phase* is where in the world's period a participant's deadline lies, so that not all
//! start at once.

use shm_types::capacity::MAGIC;
use shm_types::{Outcome, SnapshotHeader, WorldSnapshot};

use crate::clock;
use crate::histograms::Timed;
use crate::options::Role;
use crate::ports::{Access, Sample, Subscriber};
use crate::roles::{RoleError, Seat};
use crate::ticker::{Due, Ticker};
use crate::wait::Waiter;

/// What a follower has come to.
pub(crate) enum Next {
    /// A snapshot that it had not seen.
    Snapshot(Sample<WorldSnapshot>),
    /// The newest it had seen, from another world process: that one lacks the answer to it.
    Again,
}

/// A reader of snapshots.
pub(crate) struct Follower {
    inlet: Subscriber<WorldSnapshot>,
    waiter: Waiter,
    /// Deadline within the period, and the period, ns; `None` in lockstep.
    grid: Option<(u64, u64)>,
    /// The own deadlines, once time has started.
    ticker: Option<Ticker>,
    /// When the state of each period is due, likewise.
    due: Option<Due>,
    /// What the age of a snapshot counts as.
    age: Timed,
    /// Tick of the newest snapshot, and which world process sent it, from 1.
    tick: u64,
    generation: u32,
    skipped: u64,
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
        let grid = seat.options().clock.period_ns().map(|period_ns| {
            let phase_ns = period_ns * u64::from(turn + 1) / u64::from(turns + 1);
            (phase_ns, period_ns)
        });
        Ok(Self {
            inlet: service.subscriber()?,
            waiter,
            grid,
            ticker: None,
            due: None,
            age: match seat.role {
                Role::Planner => Timed::PlannerSnapshotAge,
                _ => Timed::SnapshotAge,
            },
            tick: 0,
            generation: 0,
            skipped: 0,
        })
    }

    /// Deadlines that had passed before this participant came to wait for them.
    pub(crate) fn deadline_misses(&self) -> u64 {
        self.ticker.map_or(0, |ticker| ticker.misses())
    }

    /// Snapshots that were gone before this participant looked, the warm-up not counted.
    pub(crate) const fn skipped(&self) -> u64 {
        self.skipped
    }

    /// The next snapshot, once it is time for it; `None` once the run is over or this process is
    /// to end. The sample before it must have been dropped. Ticks never go back; one comes again
    /// only from a world that was started again, and is then to be answered as before. While it
    /// waits in lockstep, `meanwhile` is done again and again.
    ///
    /// # Errors
    /// Shared memory failed.
    pub(crate) fn next(
        &mut self,
        seat: &mut Seat,
        meanwhile: impl Fn() -> Result<(), RoleError>,
    ) -> Result<Option<Next>, RoleError> {
        if let Some(ticker) = &mut self.ticker {
            if !seat.is_warm() {
                ticker.forget_misses();
            }
            ticker.wait();
        }
        while !seat.is_stopped() {
            let Some(sample) = self.inlet.receive()? else {
                match &mut self.ticker {
                    Some(ticker) => {
                        ticker.wait();
                    }
                    None => {
                        meanwhile()?;
                        self.waiter.pause()?;
                    }
                }
                continue;
            };
            let now_ns = clock::now_ns();
            self.waiter.arrived();
            let header = &sample.header;
            if !self.goes_on(seat, header) {
                continue;
            }
            if header.outcome != Outcome::Running.code() {
                return Ok(None);
            }
            if self.generation > 0 && header.tick == self.tick {
                self.generation = header.generation;
                return Ok(Some(Next::Again));
            }
            self.note(seat, header, now_ns);
            return Ok(Some(Next::Snapshot(sample)));
        }
        Ok(None)
    }

    /// Whether a snapshot is of this run and no older than what came before it. The rest of it is
    /// checked by whoever uses it; how the run stands is used here.
    fn goes_on(&self, seat: &Seat, header: &SnapshotHeader) -> bool {
        let is_of_run = header.magic == MAGIC
            && header.run_id == seat.run.id_number()
            && Outcome::decode(header.outcome).is_ok();
        let now = (header.generation, header.tick);
        is_of_run && now > (self.generation, self.tick) && header.tick >= self.tick
    }

    /// Notes when the snapshot with this header was first looked at.
    fn note(&mut self, seat: &mut Seat, header: &SnapshotHeader, now_ns: u64) {
        let stamp_ns = header.publish_stamp_ns;
        let age_ns = now_ns.saturating_sub(stamp_ns);
        seat.latencies.record(self.age, age_ns);
        if seat.is_warm() && self.generation > 0 {
            self.skipped += header.tick.saturating_sub(self.tick + 1);
        }
        (self.generation, self.tick) = (header.generation, header.tick);
        if let (Some(due), Timed::SnapshotAge) = (&mut self.due, self.age) {
            for late_ns in due.came(stamp_ns, now_ns) {
                seat.latencies.record(Timed::SnapshotLateness, late_ns);
            }
        }
        if header.tick > 0
            && self.ticker.is_none()
            && let Some((phase_ns, period_ns)) = self.grid
        {
            self.ticker = Some(Ticker::aligned(now_ns, period_ns, phase_ns));
            self.due = Some(Due::new(period_ns, phase_ns));
        }
    }
}
