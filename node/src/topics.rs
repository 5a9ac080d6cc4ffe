//! Every topic of a run, in one table.
//!
//! Responsible for: names, patterns, directions and limits, and the memory they add up to.
//! Not responsible for: ports (`ports`, `calls`, `wakes`), who sends when (`roles`), or what
//! messages mean (crate `shm-types`).
//!
//! Limits come from the run, not from the capacities of the messages: a segment holds a sample
//! for each reader there can be.

#[cfg(test)]
mod tests;

use std::marker::PhantomData;

use scene::Method;
use shm_types::{
    Command, ConstraintTable, ControlReply, ControlRequest, Counts, HardAnswer, HardRequest,
    MotionBatch, PlannerReport, RecorderReport, Schedule, WorldSnapshot,
};

use crate::calls::{CallService, Calls};
use crate::ports::{Access, IpcNode, Service, Topic, TopicError};
use crate::wakes::{WakeService, Wakes};

/// Batches of motion that wait for the recorder. In real time a longer pause of it leaves a gap
/// in the trace.
pub(crate) const MOTION_BUFFER: usize = 256;
/// Batches by which the world runs ahead of the recorder in lockstep; then it waits.
pub(crate) const MOTION_WINDOW: u64 = 192;
/// Senders of control requests: the supervisor, and one other program at a time.
const CONTROL_CLIENTS: usize = 2;
/// Participants that are no robots, the supervisor, and one program that tells of a change.
const OTHER_NODES: usize = 5;

const _: () = assert!(MOTION_WINDOW < MOTION_BUFFER as u64);

/// All topics of a run, sized for it.
pub(crate) struct Topics {
    /// World → all: the state, each tick, written and read in place.
    pub(crate) world: Topic<WorldSnapshot>,
    /// Robots → world, and the supervisor until all are ready: their whole intent.
    pub(crate) command: Topic<Command>,
    /// Planner → world, supervisor: its answer to each tick.
    pub(crate) planner: Topic<PlannerReport>,
    /// Planner → robots, world: hard constraints.
    pub(crate) constraints: Topic<ConstraintTable>,
    /// Planner → robots, world, if the method plans ahead: who does what next, after whom.
    pub(crate) schedule: Option<Topic<Schedule>>,
    /// World → recorder: all motion and events.
    pub(crate) motion: Topic<MotionBatch>,
    /// Recorder → world, supervisor: how far it has come.
    pub(crate) recorder: Topic<RecorderReport>,
    /// Robot → planner: a task has failed.
    pub(crate) hard: Calls<HardRequest, HardAnswer>,
    /// Supervisor → world: who takes part, stop, hold.
    pub(crate) control: Calls<ControlRequest, ControlReply>,
    /// World → robots and planner, if they block until it has published.
    pub(crate) wake_participants: Wakes,
    /// All others → world, if it blocks until they have answered.
    pub(crate) wake_world: Wakes,
}

/// Every topic, held so that it exists until the supervisor drops it.
pub(crate) struct HeldTopics {
    pub(crate) world: Service<WorldSnapshot>,
    pub(crate) command: Service<Command>,
    pub(crate) planner: Service<PlannerReport>,
    pub(crate) recorder: Service<RecorderReport>,
    pub(crate) control: CallService<ControlRequest, ControlReply>,
    pub(crate) wake_world: WakeService,
    _constraints: Service<ConstraintTable>,
    _schedule: Option<Service<Schedule>>,
    _motion: Service<MotionBatch>,
    _hard: CallService<HardRequest, HardAnswer>,
    _wake_participants: WakeService,
}

impl Topics {
    /// The table, for a run of this size and method with room for `monitors` watching programs.
    #[must_use]
    pub(crate) const fn of(counts: Counts, method: Method, monitors: u32) -> Self {
        let robots = counts.robots as usize;
        let watch = monitors as usize;
        let readers = robots + 1;
        let all = robots + OTHER_NODES + watch;
        Self {
            //                   name         nodes writers readers          history buffer borrowed
            world: topic("world", all, 1, robots + 3 + watch, 1, 1, 2),
            command: topic("command", all, robots, 2, 0, 2, 2),
            planner: topic("planner", all, 1, 2 + watch, 1, 1, 2),
            constraints: topic("constraints", all, 1, robots + 1 + watch, 2, 2, 3),
            schedule: if method.plans_ahead() {
                Some(topic("schedule", all, 1, readers, 2, 2, 3))
            } else {
                None
            },
            motion: topic("motion", all, 1, 1, 0, MOTION_BUFFER, 2),
            recorder: topic("recorder", all, 1, 2, 1, 1, 2),
            //             name       nodes clients
            hard: calls("hard", all, robots),
            control: calls("control", all, CONTROL_CLIENTS),
            //                          name                nodes sleepers    wakers
            wake_participants: wakes("wake/participants", all, robots + 1, 1),
            wake_world: wakes("wake/world", all, 1, robots + 4),
        }
    }

    /// Bytes of shared memory that all segments of the run can come to hold.
    #[must_use]
    pub(crate) fn bytes(&self) -> u64 {
        self.world.bytes()
            + self.command.bytes()
            + self.planner.bytes()
            + self.constraints.bytes()
            + self.schedule.as_ref().map_or(0, Topic::bytes)
            + self.motion.bytes()
            + self.recorder.bytes()
            + self.hard.bytes()
            + self.control.bytes()
    }

    /// Makes or opens the topic of schedules; nothing if the method does not plan ahead.
    ///
    /// # Errors
    /// As those of the other topics.
    pub(crate) fn schedule_service(
        &self,
        node: &IpcNode,
        access: Access,
    ) -> Result<Option<Service<Schedule>>, TopicError> {
        let topic = self.schedule.as_ref();
        topic.map(|topic| topic.service(node, access)).transpose()
    }

    /// Makes every topic.
    ///
    /// # Errors
    /// The first that could not be made.
    pub(crate) fn create(&self, node: &IpcNode) -> Result<HeldTopics, TopicError> {
        Ok(HeldTopics {
            world: self.world.service(node, Access::Create)?,
            command: self.command.service(node, Access::Create)?,
            planner: self.planner.service(node, Access::Create)?,
            recorder: self.recorder.service(node, Access::Create)?,
            control: self.control.service(node, Access::Create)?,
            wake_world: self.wake_world.service(node, Access::Create)?,
            _constraints: self.constraints.service(node, Access::Create)?,
            _schedule: self.schedule_service(node, Access::Create)?,
            _motion: self.motion.service(node, Access::Create)?,
            _hard: self.hard.service(node, Access::Create)?,
            _wake_participants: self.wake_participants.service(node, Access::Create)?,
        })
    }
}

const fn topic<T>(
    name: &'static str,
    nodes: usize,
    publishers: usize,
    subscribers: usize,
    history: usize,
    buffer: usize,
    borrowed: usize,
) -> Topic<T> {
    Topic {
        name,
        publishers,
        subscribers,
        nodes,
        history,
        buffer,
        borrowed,
        message: PhantomData,
    }
}

const fn calls<Q, A>(name: &'static str, nodes: usize, clients: usize) -> Calls<Q, A> {
    Calls {
        name,
        clients,
        nodes,
        messages: PhantomData,
    }
}

const fn wakes(name: &'static str, nodes: usize, listeners: usize, notifiers: usize) -> Wakes {
    Wakes {
        name,
        listeners,
        notifiers,
        nodes,
    }
}
