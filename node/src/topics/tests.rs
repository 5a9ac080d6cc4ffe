//! Ports of one process, through shared memory, in a domain of each test's own.

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
        ports::join(self.root.path(), &self.prefix, name, ports::Burial::OfAll).unwrap()
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
    let topics = Topics::of(COUNTS, Method::NoAction, 0);
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
    let topics = Topics::of(COUNTS, Method::NoAction, 0);
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
    let topics = Topics::of(COUNTS, Method::NoAction, 0);
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
    let topics = Topics::of(COUNTS, Method::NoAction, 0);
    let node = domain.node("s");
    let _held = topics.create(&node).unwrap();
    let mistaken: Topic<PlannerReport> = topic(topics.world.name, 1, 1, 1, 1, 1, 2);
    let error = mistaken
        .service(&node, Access::Open)
        .map(|_| ())
        .unwrap_err();
    assert!(error.to_string().contains("open topic world"), "{error}");
}
