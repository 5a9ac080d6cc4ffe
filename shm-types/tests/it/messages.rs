//! Messages as bytes: every live byte is state, and no byte string can make validation panic.

use std::mem::offset_of;

use proptest::prelude::*;
use shm_types::capacity::{MAX_ACTIONS, MAX_WAITS};
use shm_types::{
    Action, Checked, Command, ConstraintTable, Counts, Grip, Invalid, MotionBatch, NONE,
    ObjectState, PlannerReport, RecorderReport, RobotSchedule, RobotState, Schedule,
    SnapshotHeader, StateHash, Validate, Wait, WorldSnapshot, zeroed,
};
use zerocopy::{FromBytes, IntoBytes};

const COUNTS: Counts = Counts {
    robots: 2,
    objects: 3,
};

fn snapshot() -> Box<WorldSnapshot> {
    crate::snapshot(COUNTS)
}

fn hash(snapshot: &WorldSnapshot) -> u64 {
    let mut hash = StateHash::new();
    snapshot.hash_into(&mut hash);
    hash.finish()
}

/// Byte ranges of the live part of a snapshot with `COUNTS`.
fn live_bytes() -> impl Iterator<Item = usize> {
    let robots = offset_of!(WorldSnapshot, robots);
    let objects = offset_of!(WorldSnapshot, objects);
    (0..size_of::<SnapshotHeader>())
        .chain(robots..robots + COUNTS.robots as usize * size_of::<RobotState>())
        .chain(objects..objects + COUNTS.objects as usize * size_of::<ObjectState>())
}

#[test]
fn flipping_any_live_byte_of_the_state_changes_the_hash() {
    let mut state = snapshot();
    let before = hash(&state);
    // The counts say what is live; changing them is tested below, without reading past the end.
    let counts = offset_of!(SnapshotHeader, robot_count)..offset_of!(SnapshotHeader, outcome);
    let stamp = offset_of!(SnapshotHeader, publish_stamp_ns)..offset_of!(SnapshotHeader, epoch);
    for at in live_bytes().filter(|at| !counts.contains(at)) {
        state.as_mut_bytes()[at] ^= 1;
        if stamp.contains(&at) {
            assert_eq!(
                hash(&state),
                before,
                "byte {at} is the transport's, not state"
            );
        } else {
            assert_ne!(hash(&state), before, "byte {at} is state");
        }
        state.as_mut_bytes()[at] ^= 1;
    }
    state.header.robot_count -= 1;
    assert_ne!(hash(&state), before);
    state.header.robot_count += 1;
    state.header.object_count += 1;
    assert_ne!(hash(&state), before);
}

#[test]
fn what_is_past_the_counts_is_no_state() {
    let mut state = snapshot();
    let before = hash(&state);
    state.robots[COUNTS.robots as usize].position.x = 1.0;
    state.objects[COUNTS.objects as usize].failures = 7;
    assert_eq!(hash(&state), before);
}

#[test]
fn a_snapshot_with_one_bad_value_is_refused() {
    type Plant = fn(&mut WorldSnapshot);
    let plants: [(Plant, &str); 18] = [
        (|s| s.header.magic = 0, "magic"),
        (|s| s.header.layout_version += 1, "layout"),
        (|s| s.header.robot_count = 129, "over capacity"),
        (|s| s.header.object_count = 2, "other run"),
        (|s| s.header.outcome = 99, "outcome"),
        (|s| s.header.held = 2, "held"),
        (|s| s.header.tick = u64::MAX, "tick"),
        (|s| s.header.epoch = u64::MAX, "epoch"),
        (|s| s.header.constraints_version = u32::MAX, "table"),
        (|s| s.header.schedule_version = u32::MAX, "schedule"),
        (|s| s.robots[0].position.x = f64::NAN, "position"),
        (|s| s.robots[0].position.x = -1e300, "position"),
        (|s| s.robots[1].task = 3, "task"),
        (|s| s.robots[1].phase = 8, "phase"),
        (|s| s.robots[1].grant_count = 33, "grant"),
        (|s| s.objects[2].holder = 2, "holder"),
        (|s| s.objects[2].status = 4, "status"),
        (
            |s| {
                s.objects[0].has_goal = 1;
                s.objects[0].goal.y = f64::INFINITY;
            },
            "goal",
        ),
    ];
    assert!(Checked::new(&*snapshot(), COUNTS).is_ok());
    for (plant, what) in plants {
        let mut state = snapshot();
        plant(&mut state);
        assert!(
            Checked::new(&*state, COUNTS).is_err(),
            "{what} was let through"
        );
    }
}

#[test]
fn a_command_with_one_bad_value_is_refused() {
    type Plant = fn(&mut Command);
    let plants: [(Plant, &str); 9] = [
        (|c| c.robot = 2, "robot"),
        (|c| c.phase = 8, "phase"),
        (|c| c.grip = 3, "grip"),
        (|c| c.go = 2, "go"),
        (|c| c.claim.task = 3, "task"),
        (|c| c.failure.cause = 3, "cause"),
        (
            |c| {
                c.tick = 5;
                c.valid_until_tick = 4;
            },
            "validity",
        ),
        (|c| c.path.count = 33, "points"),
        (
            |c| {
                c.path.count = 1;
                c.path.points[0].x = f64::NAN;
            },
            "point",
        ),
    ];
    assert!(Command::default().validate(COUNTS).is_ok());
    for (plant, what) in plants {
        let mut command = Command::default();
        plant(&mut command);
        assert!(command.validate(COUNTS).is_err(), "{what} was let through");
    }
}

#[test]
fn constraints_must_be_sorted_in_range_and_not_reflexive() {
    let mut table: Box<ConstraintTable> = zeroed();
    table.count = 2;
    table.constraints[0] = shm_types::Constraint {
        before: 0,
        after: 1,
        kind: 1,
    };
    table.constraints[1] = shm_types::Constraint {
        before: 0,
        after: 2,
        kind: 1,
    };
    assert_eq!(table.validate(COUNTS), Ok(()));
    table.constraints.swap(0, 1);
    assert!(matches!(
        table.validate(COUNTS),
        Err(Invalid::Inconsistent { .. })
    ));
    table.constraints[0] = shm_types::Constraint {
        before: 0,
        after: 0,
        kind: 1,
    };
    assert!(table.validate(COUNTS).is_err());
    table.constraints[0] = shm_types::Constraint {
        before: 0,
        after: 3,
        kind: 1,
    };
    assert!(table.validate(COUNTS).is_err());
}

#[test]
fn numbers_that_no_run_comes_to_are_refused() {
    let report = |tick| PlannerReport {
        tick,
        ..PlannerReport::default()
    };
    assert_eq!(report(1 << 40).validate(COUNTS), Ok(()));
    assert!(report(u64::MAX).validate(COUNTS).is_err());
    let mut table: Box<ConstraintTable> = zeroed();
    table.version = u32::MAX;
    assert!(table.validate(COUNTS).is_err());
    let mut batch: Box<MotionBatch> = zeroed();
    assert_eq!(batch.validate(COUNTS), Ok(()));
    batch.sequence = u64::MAX;
    assert!(batch.validate(COUNTS).is_err());
    let recorder = RecorderReport {
        next_sequence: u64::MAX,
        ..RecorderReport::default()
    };
    assert!(recorder.validate(COUNTS).is_err());
}

/// Two robots with two actions and one action, and a wait.
fn schedule() -> Box<Schedule> {
    let mut schedule: Box<Schedule> = zeroed();
    (schedule.version, schedule.robot_count) = (1, COUNTS.robots);
    (schedule.action_count, schedule.wait_count) = (3, 1);
    for (part, (first, count, offset)) in schedule.robots.iter_mut().zip([(5, 2, 0), (0, 1, 2)]) {
        *part = RobotSchedule {
            first,
            count,
            offset,
            complete: 1,
            kept: u32::MAX,
        };
    }
    for action in &mut schedule.actions[..3] {
        action.object = NONE;
    }
    (schedule.actions[1].grip, schedule.actions[1].object) = (Grip::Grasp.code(), 2);
    schedule.actions[2].waits = 1;
    schedule.waits[0] = Wait {
        robot: 0,
        actions: 7,
    };
    schedule
}

#[test]
fn a_schedule_with_one_bad_value_is_refused() {
    type Plant = fn(&mut Schedule);
    let plants: [(Plant, &str); 16] = [
        (|s| s.robot_count += 1, "a robot that is not there"),
        (
            |s| s.action_count = MAX_ACTIONS as u32 + 1,
            "actions over capacity",
        ),
        (|s| s.action_count = 2, "actions past the live ones"),
        (
            |s| s.wait_count = MAX_WAITS as u32 + 1,
            "waits over capacity",
        ),
        (|s| s.wait_count = 0, "waits past the live ones"),
        (|s| s.robots[0].complete = 2, "complete"),
        (|s| s.robots[1].offset = u32::MAX, "offset"),
        (|s| s.robots[1].count = u32::MAX, "count"),
        (|s| s.robots[1].first = u32::MAX, "number"),
        (|s| s.actions[0].to.x = f64::INFINITY, "place"),
        (|s| s.actions[0].grip = 3, "grip"),
        (|s| s.actions[0].object = 3, "object"),
        (|s| s.actions[1].object = NONE, "grasp of nothing"),
        (|s| s.actions[2].first_wait = 1, "range of waits"),
        (|s| s.actions[2].first_wait = u32::MAX, "range of waits"),
        (|s| s.waits[0].robot = 2, "robot waited for"),
    ];
    assert_eq!(schedule().validate(COUNTS), Ok(()));
    for (plant, what) in plants {
        let mut schedule = schedule();
        plant(&mut schedule);
        assert!(schedule.validate(COUNTS).is_err(), "{what} was let through");
    }
}

#[test]
fn actions_have_numbers_over_the_whole_run() {
    let schedule = schedule();
    let waits = |action: &Action| schedule.waits_of(action).len();
    assert!(schedule.action(0, 4).is_none(), "past");
    assert_eq!(schedule.action(0, 5).map(waits), Some(0));
    assert_eq!(schedule.action(0, 6).map(|action| action.object), Some(2));
    assert!(schedule.action(0, 7).is_none(), "robot 1's");
    assert_eq!(schedule.action(1, 0).map(waits), Some(1));
    assert!(schedule.action(2, 0).is_none());
}

#[test]
fn no_id_is_none() {
    assert_eq!(shm_types::index(NONE), None);
    assert_eq!(shm_types::index(5), Some(5));
}

proptest! {
    #[test]
    fn random_bytes_are_checked_without_panic(bytes in proptest::collection::vec(any::<u8>(), size_of::<Command>())) {
        let command = Command::read_from_bytes(&bytes).unwrap();
        if let Ok(command) = Checked::new(&command, COUNTS) {
            prop_assert!(command.path.points().iter().all(|p| p.is_finite()));
        }
    }

    #[test]
    fn a_flipped_snapshot_is_refused_or_sound(flips in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20)) {
        let mut state = snapshot();
        let live: Vec<usize> = live_bytes().collect();
        for (at, value) in flips {
            let at = live[at.index(live.len())];
            state.as_mut_bytes()[at] = value;
        }
        if let Ok(checked) = Checked::new(&*state, COUNTS) {
            prop_assert_eq!(checked.robots().len(), 2);
            prop_assert!(checked.robots().iter().all(|r| r.position.is_finite() && r.grant().len() <= 32));
        }
    }

    #[test]
    fn a_flipped_schedule_is_refused_or_sound(flips in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20)) {
        let mut schedule = schedule();
        let (robots, actions, waits) = (
            offset_of!(Schedule, robots), offset_of!(Schedule, actions), offset_of!(Schedule, waits),
        );
        let live: Vec<usize> = (0..robots + 2 * size_of::<RobotSchedule>())
            .chain(actions..actions + 3 * size_of::<Action>())
            .chain(waits..waits + size_of::<Wait>())
            .collect();
        for (at, value) in flips {
            schedule.as_mut_bytes()[live[at.index(live.len())]] = value;
        }
        if let Ok(checked) = Checked::new(&*schedule, COUNTS) {
            for robot in 0..2 {
                prop_assert_eq!(checked.actions_of(robot).len(), checked.robots[robot].count as usize);
                for action in checked.actions_of(robot) {
                    prop_assert!(action.to.is_finite() && (action.object == NONE || action.object < 3));
                    prop_assert_eq!(checked.waits_of(action).len(), action.waits as usize);
                    prop_assert!(checked.waits_of(action).iter().all(|wait| wait.robot < 2));
                }
            }
        }
    }

    #[test]
    fn random_schedules_are_checked_without_panic(seed in any::<u64>()) {
        let mut schedule: Box<Schedule> = zeroed();
        let mut x = seed | 1;
        for byte in &mut schedule.as_mut_bytes()[..8192] {
            x ^= x << 13; x ^= x >> 7; x ^= x << 17;
            *byte = x as u8;
        }
        // Counts within capacity, so that all that follows is looked at too.
        (schedule.robot_count, schedule.action_count) = (2, MAX_ACTIONS as u32);
        schedule.wait_count %= MAX_WAITS as u32 + 1;
        let _ = Checked::new(&*schedule, COUNTS).map(|s| s.actions_of(0).len());
    }

    #[test]
    fn random_motion_batches_are_checked_without_panic(seed in any::<u64>()) {
        let mut batch: Box<MotionBatch> = zeroed();
        let mut x = seed | 1;
        for byte in &mut batch.as_mut_bytes()[..4096] {
            x ^= x << 13; x ^= x >> 7; x ^= x << 17;
            *byte = x as u8;
        }
        let _ = Checked::new(&*batch, COUNTS).map(|b| b.motions().len() + b.events().len());
    }
}

#[test]
fn a_checked_snapshot_shows_the_live_ones_and_no_more() {
    let mut world = snapshot();
    for (id, robot) in world.robots.iter_mut().enumerate() {
        robot.actions = id as u32;
    }
    for (id, object) in world.objects.iter_mut().enumerate() {
        object.put_downs = id as u32;
    }
    let world = Checked::new(&*world, COUNTS).unwrap();
    let robots: Vec<u32> = world.robots().iter().map(|robot| robot.actions).collect();
    let objects: Vec<u32> = (world.objects().iter())
        .map(|object| object.put_downs)
        .collect();
    assert_eq!((robots, objects), (vec![0, 1], vec![0, 1, 2]));
}
