//! What the world has told the recorder, and keeps until that is in the trace.
//!
//! Responsible for: putting each tick into the journal before anything of it is sent; sending
//! batches from there in order, no more at once than wait for a reader, and again to a recorder
//! that was started again or lacks some.
//! Not responsible for: the journal's form (`journal`), what is in a batch (crate `world`).

use std::time::{Duration, Instant};

use scene::Settings;
use shm_types::capacity::{MAX_CONSTRAINTS, MAX_OBJECTS, MAX_PATH_POINTS};
use shm_types::{Constraint, Counts, MotionBatch, RecorderReport};
use world::World;

use crate::journal::Journal;
use crate::ports::Publisher;
use crate::roles::RoleError;
use crate::topics::MOTION_WINDOW;

/// How long the recorder may lack a batch that was sent before it is sent again.
const AGAIN: Duration = Duration::from_millis(100);
/// Bytes of a state for each robot, object, pair of both, and for whatever else is in a part, at most.
const ROBOT_BYTES: usize = 1_024 + 2 * MAX_PATH_POINTS * 16;
const OBJECT_BYTES: usize = 256;
const PAIR_BYTES: usize = 64;
const OTHER_BYTES: usize = 64 * 1_024;

/// The journal, and who reads from it.
pub(super) struct Outbox {
    journal: Journal,
    motion: Publisher<MotionBatch>,
    /// The batch to be sent next.
    next: u64,
    /// Which recorder process that is so for.
    reader: u32,
    /// What that one expects next, and since when.
    expected: (u64, Instant),
    /// Up to where its file is safe.
    durable: u64,
}

/// Bytes that each part of a state of a run of this size can come to need, in any version of its
/// scene.
pub(super) fn rooms_for(counts: Counts, settings: &Settings) -> Vec<usize> {
    let robots = counts.robots as usize;
    let (bars, tables) = if settings.method.plans_ahead() {
        (0, 0)
    } else {
        (
            robots * MAX_OBJECTS * PAIR_BYTES,
            2 * MAX_CONSTRAINTS * size_of::<Constraint>(),
        )
    };
    let head = OTHER_BYTES + robots * ROBOT_BYTES + bars;
    let objects = std::iter::repeat_n(OBJECT_BYTES * world::PER_PART, world::MAX_PARTS);
    [head, OTHER_BYTES + tables]
        .into_iter()
        .chain(objects)
        .collect()
}

impl Outbox {
    /// Goes on from where `world` is, and keeps that unless it comes from there.
    pub(super) fn new(
        mut journal: Journal,
        motion: Publisher<MotionBatch>,
        world: &mut World,
        is_kept: bool,
    ) -> Result<Self, RoleError> {
        let tick = world.tick();
        journal.go_on_from(tick);
        let mut outbox = Self {
            journal,
            motion,
            next: tick,
            reader: 0,
            expected: (0, Instant::now()),
            durable: 0,
        };
        // Writing a slot anew that others go on from would leave none if this process dies meanwhile.
        if !is_kept {
            outbox.commit(None, world)?;
        }
        Ok(outbox)
    }

    /// Which world process this is, from 1.
    pub(super) const fn generation(&self) -> u32 {
        self.journal.generation()
    }

    /// Keeps the tick that `batch` led to.
    pub(super) fn keep(&mut self, batch: &MotionBatch, world: &mut World) -> Result<(), RoleError> {
        self.commit(Some(batch), world)
    }

    fn commit(&mut self, batch: Option<&MotionBatch>, world: &mut World) -> Result<(), RoleError> {
        let tick = world.tick();
        let saved = (self.journal).commit(tick, batch, |put| world.save_changed(put));
        saved.map_err(|error| RoleError::File {
            path: super::super::JOURNAL_FILE.into(),
            reason: error.to_string(),
        })
    }

    /// Whether another tick can be kept without losing what is in no trace yet.
    pub(super) fn has_room(&self) -> bool {
        self.journal.has_room(self.durable)
    }

    /// Sends what the recorder lacks, as far as there is room for it. There is nobody to send to
    /// before its first report.
    pub(super) fn send(
        &mut self,
        tick: u64,
        report: Option<&RecorderReport>,
    ) -> Result<(), RoleError> {
        let Some(report) = report else {
            return Ok(());
        };
        let now = Instant::now();
        self.durable = report.durable_sequence;
        if self.reader != report.incarnation {
            (self.reader, self.next) = (report.incarnation, report.next_sequence);
            self.expected = (report.next_sequence, now);
        }
        if self.expected.0 != report.next_sequence || self.next <= report.next_sequence {
            self.expected = (report.next_sequence, now);
        } else if now - self.expected.1 > AGAIN {
            self.next = report.next_sequence;
            self.expected.1 = now;
        }
        self.next = self.next.max(report.next_sequence);
        self.next = self.next.max(self.journal.kept_from(tick));
        let until = tick.min(report.next_sequence.saturating_add(MOTION_WINDOW));
        while self.next < until {
            let (journal, next) = (&self.journal, self.next);
            let mut found = false;
            self.motion.send(|out| {
                found = journal.read(next, out);
                if !found {
                    // Nothing, and of a number that nobody waits for.
                    (out.motion_count, out.event_count) = (0, 0);
                    (out.sequence, out.kept_from) = (0, 0);
                }
            })?;
            self.next += 1;
        }
        Ok(())
    }

    /// Lets a recorder in that has come since the last batch.
    pub(super) fn connect(&self) -> Result<(), RoleError> {
        Ok(self.motion.connect()?)
    }
}
