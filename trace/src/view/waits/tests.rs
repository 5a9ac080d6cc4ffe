//! Whom robots wait for in runs written by hand.

use super::*;
use crate::record::{BodyKind, FORMAT, FailureCause, Object, Outline, Phase, Place, RobotKind};
use crate::view::story::{ObjectStory, RobotStory, TaskDoing};

const SECOND_NS: u64 = 1_000_000_000;

/// Robot 0 waits for two seconds and goes 4 m to the right then; robot 1 stands far away, and holds
/// object 1. Both objects are on robot 0's way, object 1 as the story has it before it was held.
fn story() -> Story {
    let square = |half| Outline::Box {
        half: Place::new(half, half),
    };
    let object = |x| Object {
        shape: square(0.2),
        grasp: Place::new(0.0, -0.45),
        other_grasps: Vec::new(),
        kind: None,
        pass_under: false,
        start: Place::new(x, 1.0),
        goal: Some(Place::new(x, 5.0)),
    };
    let scene = SceneRecord {
        format: FORMAT,
        program_version: "0".to_owned(),
        name: "by hand".to_owned(),
        scenario_hash: "0".to_owned(),
        run_id: "0".to_owned(),
        low: Place::new(0.0, 0.0),
        high: Place::new(10.0, 10.0),
        walls: Vec::new(),
        robot: RobotKind {
            shape: square(0.25),
            speed_m_per_s: 0.5,
            clearance_m: 0.0,
            grasp_ns: 0,
            release_ns: 0,
        },
        homes: vec![Place::new(1.0, 1.0), Place::new(8.0, 8.0)],
        objects: vec![object(3.0), object(2.0)],
        before: Vec::new(),
        settings: serde_json::Value::Null,
    };
    let doing = |activity, holding| RobotDoing {
        phase: Phase::Transit,
        activity,
        task: None,
        holding,
        waits_for: None,
    };
    let way = Motion {
        body: BodyKind::Robot,
        id: 0,
        start_ns: 2 * SECOND_NS,
        end_ns: 10 * SECOND_NS,
        from: Place::new(1.0, 1.0),
        to: Place::new(5.0, 1.0),
    };
    let task = |x, status, robot| ObjectStory {
        since_ns: 0,
        start: Place::new(x, 1.0),
        track: Vec::new(),
        doing: vec![(0, TaskDoing { status, robot })],
    };
    Story {
        versions: vec![(0, scene.clone())],
        scene,
        robots: vec![
            RobotStory {
                track: vec![way],
                doing: vec![
                    (0, doing(Activity::Waiting, None)),
                    (2 * SECOND_NS, doing(Activity::Moving, None)),
                ],
                ..RobotStory::default()
            },
            RobotStory {
                doing: vec![(0, doing(Activity::Idle, Some(1)))],
                ..RobotStory::default()
            },
        ],
        objects: vec![
            task(3.0, TaskStatus::Waiting, None),
            task(2.0, TaskStatus::Held, Some(1)),
        ],
        events: Vec::new(),
        gaps: Vec::new(),
        end: None,
        until_ns: 10 * SECOND_NS,
    }
}

#[test]
fn the_first_object_on_the_ground_in_the_way_is_waited_for() {
    let waited = &waits(&story())[0];
    let expected = [(0, Some(Blocker::Object(0))), (2 * SECOND_NS, None)];
    assert_eq!(*waited, expected);
}

#[test]
fn whom_a_robot_names_when_its_task_fails_it_has_waited_for() {
    let mut story = story();
    story.events.push(Event {
        tick: 150,
        time_ns: 3 * SECOND_NS / 2,
        what: Happening::Failed {
            robot: 0,
            task: 0,
            cause: FailureCause::Robots,
            blocker: Some(1),
        },
    });
    let waited = &waits(&story)[0];
    let expected = [(0, Some(Blocker::Robot(1))), (2 * SECOND_NS, None)];
    assert_eq!(*waited, expected);
}
