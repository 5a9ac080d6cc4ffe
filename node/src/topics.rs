//! Every topic of a run, in one table.
//!
//! Responsible for: names, patterns, directions and limits, and the memory they add up to.
//! Not responsible for: ports (`ports`, `calls`, `wakes`), who sends when (`roles`), or what
//! messages mean (crate `shm-types`).
//!
//! Limits come from the run, not from the capacities of the messages: a segment holds a sample
//! for each reader there can be.

use std::marker::PhantomData;

use shm_types::{
    Command, ConstraintTable, ControlReply, ControlRequest, Counts, HardAnswer, HardRequest,
    MotionBatch, PlannerReport, RecorderReport, WorldSnapshot,
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
/// Participants that are no robots, and the supervisor.
const OTHER_NODES: usize = 4;

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
    _motion: Service<MotionBatch>,
    _hard: CallService<HardRequest, HardAnswer>,
    _wake_participants: WakeService,
}

impl Topics {
    /// The table, for a run of this size with room for `monitors` watching programs.
    #[must_use]
    pub(crate) const fn of(counts: Counts, monitors: u32) -> Self {
        let robots = counts.robots as usize;
        let watch = monitors as usize;
        let all = robots + OTHER_NODES + watch;
        Self {
            //                   name         nodes writers readers          history buffer borrowed
            world: topic("world", all, 1, robots + 3 + watch, 1, 1, 2),
            command: topic("command", all, robots, 2, 0, 2, 2),
            planner: topic("planner", all, 1, 2 + watch, 1, 1, 2),
            constraints: topic("constraints", all, 1, robots + 1 + watch, 2, 2, 3),
            motion: topic("motion", all, 1, 1, 0, MOTION_BUFFER, 2),
            recorder: topic("recorder", all, 1, 2, 1, 1, 2),
            //             name       nodes clients
            hard: calls("hard", all, robots),
            control: calls("control", all, CONTROL_CLIENTS),
            //                          name                nodes sleepers    wakers
            wake_participants: wakes("wake/participants", all, robots + 1, 1),
            wake_world: wakes("wake/world", all, 1, robots + 3),
        }
    }

    /// Bytes of shared memory that all segments of the run can come to hold.
    #[must_use]
    pub(crate) fn bytes(&self) -> u64 {
        self.world.bytes()
            + self.command.bytes()
            + self.planner.bytes()
            + self.constraints.bytes()
            + self.motion.bytes()
            + self.recorder.bytes()
            + self.hard.bytes()
            + self.control.bytes()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ports;
    use crate::shared_memory;
    use shm_types::{Checked, Outcome};

    const COUNTS: Counts = Counts {
        robots: 2,
        objects: 3,
    };

    /// An iceoryx2 domain of one test, gone when it is dropped.
    struct Domain {
        root: tempfile::TempDir,
        prefix: String,
    }

    impl Domain {
        fn new(name: &str) -> Self {
            Self {
                root: tempfile::Builder::new()
                    .prefix("rr")
                    .tempdir_in("/tmp")
                    .unwrap(),
                prefix: format!("rrt{}{name}_", std::process::id()),
            }
        }

        fn node(&self, name: &str) -> IpcNode {
            ports::join(self.root.path(), &self.prefix, name).unwrap()
        }
    }

    impl Drop for Domain {
        fn drop(&mut self) {
            shared_memory::remove_all(&self.prefix).unwrap();
        }
    }

    fn write_snapshot(snapshot: &mut WorldSnapshot, tick: u64) {
        snapshot.header = shm_types::SnapshotHeader {
            tick,
            robot_count: COUNTS.robots,
            object_count: COUNTS.objects,
            outcome: Outcome::Running.code(),
            ..Default::default()
        };
        snapshot.robots[..2].fill(shm_types::RobotState::default());
        snapshot.objects[..3].fill(shm_types::ObjectState::default());
    }

    #[test]
    fn a_late_joiner_gets_the_newest_snapshot_and_reads_it_in_place() {
        let domain = Domain::new("late");
        let topics = Topics::of(COUNTS, 0);
        let (supervisor, world, robot) = (domain.node("s"), domain.node("w"), domain.node("r"));
        let _held = topics.create(&supervisor).unwrap();
        let publisher = topics
            .world
            .service(&world, Access::Open)
            .unwrap()
            .publisher()
            .unwrap();
        for tick in 0..3 {
            publisher
                .send(|snapshot| write_snapshot(snapshot, tick))
                .unwrap();
        }
        let subscriber = topics
            .world
            .service(&robot, Access::Open)
            .unwrap()
            .subscriber()
            .unwrap();
        assert!(subscriber.receive().unwrap().is_none());
        publisher.connect().unwrap();
        let sample = subscriber.receive().unwrap().unwrap();
        assert_eq!(Checked::new(&*sample, COUNTS).unwrap().header.tick, 2);
        publisher
            .send(|snapshot| write_snapshot(snapshot, 3))
            .unwrap();
        assert_eq!(sample.header.tick, 2, "a held sample does not change");
        drop(sample);
        assert_eq!(subscriber.receive().unwrap().unwrap().header.tick, 3);
    }

    #[test]
    fn questions_are_answered_while_the_next_is_open() {
        let domain = Domain::new("hard");
        let topics = Topics::of(COUNTS, 0);
        let (supervisor, planner, robot) = (domain.node("s"), domain.node("p"), domain.node("r"));
        let _held = topics.create(&supervisor).unwrap();
        let server = topics
            .hard
            .service(&planner, Access::Open)
            .unwrap()
            .server()
            .unwrap();
        let client = topics
            .hard
            .service(&robot, Access::Open)
            .unwrap()
            .client()
            .unwrap();
        let question = |failure| HardRequest {
            robot: 1,
            incarnation: 0,
            failure,
            task: 2,
            tick: 7,
            epoch: 1,
        };
        let calls = [1, 2].map(|failure| client.call(question(failure)).unwrap());
        let questions = [(); 2].map(|()| server.receive().unwrap().unwrap());
        assert_eq!(questions[0].failure, 1);
        assert!(server.receive().unwrap().is_none());
        for question in &questions {
            let answer = HardAnswer {
                robot: 1,
                incarnation: 0,
                failure: question.failure,
                task: 2,
                tick: 8,
                constraints_version: 0,
                found: 0,
                infeasible: 0,
                reserved: 0,
            };
            question.answer(answer).unwrap();
        }
        for (call, failure) in calls.iter().zip([1, 2]) {
            assert_eq!(call.answer().unwrap().unwrap().failure, failure);
            assert!(call.answer().unwrap().is_none());
        }
    }

    #[test]
    fn a_wake_up_before_the_sleep_is_not_lost() {
        let domain = Domain::new("wake");
        let topics = Topics::of(COUNTS, 0);
        let node = domain.node("s");
        let _held = topics.create(&node).unwrap();
        let service = topics.wake_world.service(&node, Access::Open).unwrap();
        let (sleeper, waker) = (service.sleeper().unwrap(), service.waker().unwrap());
        waker.wake().unwrap();
        // Would sleep for ever if the wake-up were lost: the test's own limit is the witness.
        sleeper.sleep(std::time::Duration::from_secs(3600)).unwrap();
    }

    #[test]
    fn a_topic_of_another_layout_is_refused() {
        let domain = Domain::new("layout");
        let topics = Topics::of(COUNTS, 0);
        let node = domain.node("s");
        let _held = topics.create(&node).unwrap();
        let mistaken: Topic<PlannerReport> = topic(topics.world.name, 1, 1, 1, 1, 1, 2);
        let error = mistaken
            .service(&node, Access::Open)
            .map(|_| ())
            .unwrap_err();
        assert!(error.to_string().contains("open topic world"), "{error}");
    }
}
