//! The tick's motion and events, as they go to the recorder.
//!
//! Responsible for: numbering, times, and never writing past a capacity.
//! Not responsible for: what happened.

use scene::Vec2;
use shm_types::capacity::{MAX_EVENTS, MAX_MOTIONS, MAX_ROBOTS};
use shm_types::{BodyKind, EventKind, EventRecord, MotionBatch, MotionRecord, NONE};

use crate::state::id;

/// Events kept free for everything but constraints: more than all robots together can cause.
const RESERVED_EVENTS: usize = 8 * MAX_ROBOTS;

/// Who an event names; see [`EventKind`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Event {
    pub(crate) kind: EventKind,
    pub(crate) robot: u32,
    pub(crate) task: u32,
    pub(crate) other: u32,
    pub(crate) value: u64,
}

impl Event {
    pub(crate) const fn new(kind: EventKind) -> Self {
        Self {
            kind,
            robot: NONE,
            task: NONE,
            other: NONE,
            value: 0,
        }
    }

    pub(crate) const fn robot(mut self, robot: usize) -> Self {
        self.robot = id(robot);
        self
    }

    pub(crate) const fn task(mut self, task: usize) -> Self {
        self.task = id(task);
        self
    }

    pub(crate) const fn other(mut self, other: u32) -> Self {
        self.other = other;
        self
    }

    pub(crate) const fn value(mut self, value: u64) -> Self {
        self.value = value;
        self
    }
}

/// Writes one tick's batch in place.
pub(crate) struct Journal<'a> {
    batch: &'a mut MotionBatch,
    /// World time that events carry, ns.
    now_ns: u64,
    overflowed: bool,
}

impl<'a> Journal<'a> {
    /// Starts the batch of the tick that begins at `now_ns`.
    pub(crate) const fn begin(batch: &'a mut MotionBatch, sequence: u64, now_ns: u64) -> Self {
        batch.sequence = sequence;
        batch.motion_count = 0;
        batch.event_count = 0;
        Self {
            batch,
            now_ns,
            overflowed: false,
        }
    }

    /// Events from here on carry `now_ns`.
    pub(crate) const fn set_time(&mut self, now_ns: u64) {
        self.now_ns = now_ns;
    }

    /// Names the snapshot the batch leads to.
    pub(crate) const fn finish(&mut self, tick: u64, time_ns: u64) {
        self.batch.tick = tick;
        self.batch.time_ns = time_ns;
    }

    pub(crate) fn event(&mut self, event: Event) {
        let at = self.batch.event_count as usize;
        if at >= MAX_EVENTS {
            self.overflowed = true;
            return;
        }
        self.batch.events[at] = EventRecord {
            time_ns: self.now_ns,
            value: event.value,
            kind: event.kind.code(),
            robot: event.robot,
            task: event.task,
            other: event.other,
        };
        self.batch.event_count += 1;
    }

    /// A straight piece of motion between two instants of world time, ns.
    pub(crate) fn motion(
        &mut self,
        body: BodyKind,
        index: usize,
        from: (u64, Vec2),
        to: (u64, Vec2),
    ) {
        let at = self.batch.motion_count as usize;
        if at >= MAX_MOTIONS {
            self.overflowed = true;
            return;
        }
        self.batch.motions[at] = MotionRecord {
            start_ns: from.0,
            end_ns: to.0,
            body: body.code(),
            id: id(index),
            from: scene::point(from.1),
            to: scene::point(to.1),
        };
        self.batch.motion_count += 1;
    }

    /// Whether anything happened so far in this tick.
    pub(crate) const fn is_eventful(&self) -> bool {
        self.batch.event_count > 0 || self.batch.motion_count > 0
    }

    /// Whether there is room for one more constraint beside what robots can cause.
    pub(crate) const fn has_room_for_constraints(&self) -> bool {
        (self.batch.event_count as usize) < MAX_EVENTS - RESERVED_EVENTS
    }

    /// Whether something had to be left out.
    pub(crate) const fn overflowed(&self) -> bool {
        self.overflowed
    }
}
