//! The last value of each range is accepted and the first one past it is not; what is copied is the
//! same to every reader.

use proptest::prelude::*;
use shm_types::capacity::{MAX_ANSWER_BYTES, MAX_CHANGES, MAX_CONSTRAINTS, MAX_ROBOTS};
use shm_types::{
    BodyKind, ChangeKind, Constraint, ConstraintKind, ConstraintTable, ControlKind, ControlReply,
    ControlRequest, Counts, EventKind, EventRecord, HardAnswer, HardRequest, Invalid, MotionBatch,
    MotionRecord, NONE, ObjectState, PlannerReport, Point, RecorderReport, RoleKind, Schedule,
    StateHash, Validate, Versioned, WorldSnapshot, zeroed,
};
use zerocopy::{FromZeros, IntoBytes};

const COUNTS: Counts = Counts {
    robots: 3,
    objects: 5,
};

/// No limit of a run: a tick, a time or an epoch past it is refused.
const MOST_TICKS: u64 = 1 << 60;
/// Nor a version.
const MOST_VERSIONS: u64 = 1 << 31;

fn snapshot() -> Box<WorldSnapshot> {
    crate::snapshot(COUNTS)
}

/// A field of `message` that `set` sets may be anything up to `last`, and nothing just past it.
fn holds_to<M: Validate>(mut message: Box<M>, what: &str, last: u64, set: impl Fn(&mut M, u64)) {
    for value in [0, last / 2, last] {
        set(&mut message, value);
        assert_eq!(message.validate(COUNTS), Ok(()), "{what} {value}");
    }
    for value in [last + 1, last + 2, last + last / 2 + 2] {
        set(&mut message, value);
        assert!(message.validate(COUNTS).is_err(), "{what} {value}");
    }
}

#[test]
fn snapshots_are_held_to_the_limits_of_a_run() {
    let (robots, objects) = (u64::from(COUNTS.robots), u64::from(COUNTS.objects));
    type Set = fn(&mut WorldSnapshot, u64);
    let limits: [(&str, u64, Set); 12] = [
        ("tick", MOST_TICKS, |s, to| s.header.tick = to),
        ("time", MOST_TICKS, |s, to| s.header.time_ns = to),
        ("epoch", MOST_TICKS, |s, to| s.header.epoch = to),
        ("table", MOST_VERSIONS, |s, to| {
            s.header.constraints_version = to as u32
        }),
        ("table of the epoch", MOST_VERSIONS, |s, to| {
            s.header.epoch_constraints_version = to as u32
        }),
        ("schedule", MOST_VERSIONS, |s, to| {
            s.header.schedule_version = to as u32
        }),
        ("scene", MOST_VERSIONS, |s, to| {
            s.header.scene_version = to as u32
        }),
        ("task", objects - 1, |s, to| s.robots[2].task = to as u32),
        ("held", objects - 1, |s, to| s.robots[0].holding = to as u32),
        ("holder", robots - 1, |s, to| {
            s.objects[4].holder = to as u32
        }),
        ("claimant", robots - 1, |s, to| {
            s.objects[0].claimed_by = to as u32
        }),
        ("live", 1, |s, to| s.robots[1].live = to as u32),
    ];
    for (what, last, set) in limits {
        holds_to(snapshot(), what, last, set);
    }
}

#[test]
fn requests_answers_and_reports_are_held_to_theirs() {
    let (robots, objects) = (u64::from(COUNTS.robots), u64::from(COUNTS.objects));
    let request = || Box::new(HardRequest::new_zeroed());
    holds_to(request(), "robot", robots - 1, |m, to| m.robot = to as u32);
    holds_to(request(), "task", objects - 1, |m, to| m.task = to as u32);
    let answer = || Box::new(HardAnswer::new_zeroed());
    holds_to(answer(), "robot", robots - 1, |m, to| m.robot = to as u32);
    holds_to(answer(), "task", objects - 1, |m, to| m.task = to as u32);
    holds_to(answer(), "infeasible", 1, |m, to| m.infeasible = to as u32);
    let report = || Box::new(PlannerReport::default());
    holds_to(report(), "busy", 1, |m, to| m.busy = to as u32);
    holds_to(report(), "verdict", 3, |m, to| m.verdict = to as u32);
    let recorder = || {
        Box::new(RecorderReport {
            next_sequence: 10,
            ..RecorderReport::default()
        })
    };
    holds_to(recorder(), "lost", 10, |m, to| m.lost = to);
    holds_to(recorder(), "durable", 10, |m, to| m.durable_sequence = to);
}

#[test]
fn what_is_asked_of_the_world_is_held_to_the_scene() {
    let (robots, objects) = (u64::from(COUNTS.robots), u64::from(COUNTS.objects));
    let of = |role: RoleKind, kind: ControlKind| {
        Box::new(ControlRequest {
            role: role.code(),
            kind: kind.code(),
            ..ControlRequest::default()
        })
    };
    let robot = of(RoleKind::Robot, ControlKind::Up);
    holds_to(robot, "robot", robots - 1, |m, to| m.index = to as u32);
    let mut planner = of(RoleKind::Planner, ControlKind::Up);
    planner.index = COUNTS.robots;
    assert_eq!(planner.validate(COUNTS), Ok(()), "only robots are numbered");

    let change = || of(RoleKind::World, ControlKind::Change);
    holds_to(change(), "changes", MAX_CHANGES as u64, |m, to| {
        m.change_count = to as u32
    });
    for (kind, named) in [
        (ChangeKind::Goal, true),
        (ChangeKind::Move, true),
        (ChangeKind::Add, true),
        (ChangeKind::Close, false),
        (ChangeKind::Open, false),
        (ChangeKind::AddRobot, false),
    ] {
        let mut request = change();
        request.change_count = 1;
        request.changes[0].kind = kind.code();
        if named {
            holds_to(request, "object", objects - 1, |m, to| {
                m.changes[0].object = to as u32
            });
        } else {
            request.changes[0].object = NONE;
            assert_eq!(request.validate(COUNTS), Ok(()), "{kind:?} names no object");
        }
    }
}

#[test]
fn motion_is_held_to_the_bodies_there_are_and_to_going_forward_in_time() {
    let (robots, objects) = (u64::from(COUNTS.robots), u64::from(COUNTS.objects));
    let batch = |body: BodyKind| {
        let mut batch: Box<MotionBatch> = zeroed();
        (batch.motion_count, batch.event_count) = (1, 1);
        batch.motions[0].body = body.code();
        (batch.motions[0].start_ns, batch.motions[0].end_ns) = (7, 8);
        batch.events[0] = EventRecord::new(EventKind::Changed, 7);
        batch
    };
    for (body, count) in [(BodyKind::Robot, robots), (BodyKind::Object, objects)] {
        holds_to(batch(body), "body", count - 1, |m, to| {
            m.motions[0].id = to as u32
        });
    }
    let robot = || batch(BodyKind::Robot);
    holds_to(robot(), "start", 7, |m, to| m.motions[0].start_ns = to);
    holds_to(robot(), "event's robot", robots - 1, |m, to| {
        m.events[0].robot = to as u32
    });
    holds_to(robot(), "event's task", objects - 1, |m, to| {
        m.events[0].task = to as u32
    });
    let mut full = robot();
    full.motions.fill(robot().motions[0]);
    full.events.fill(robot().events[0]);
    let (motions, events) = (full.motions.len() as u64, full.events.len() as u64);
    holds_to(full, "motions", motions, |m, to| m.motion_count = to as u32);
    let mut full = robot();
    full.events.fill(robot().events[0]);
    holds_to(full, "events", events, |m, to| m.event_count = to as u32);
}

#[test]
fn a_batch_has_room_for_what_every_robot_and_its_load_do_in_a_tick() {
    let batch: Box<MotionBatch> = zeroed();
    let (bodies, pieces_across_three_corners) = (MAX_ROBOTS * 2, 4);
    let last = bodies * pieces_across_three_corners - 1;
    assert!(batch.motions.get(last).is_some());
}

#[test]
fn a_constraint_stands_once_in_a_table() {
    let mut table: Box<ConstraintTable> = zeroed();
    table.count = 2;
    table.constraints[..2].fill(Constraint {
        before: 0,
        after: 1,
        kind: ConstraintKind::H1.code(),
    });
    let what = "the order of the constraints";
    assert_eq!(table.validate(COUNTS), Err(Invalid::Inconsistent { what }));
    table.constraints[1].kind = ConstraintKind::H2.code();
    assert_eq!(table.validate(COUNTS), Ok(()));
    table.count = MAX_CONSTRAINTS as u32 + 1;
    assert!(matches!(table.validate(COUNTS), Err(Invalid::Count { .. })));
}

#[test]
fn a_reply_says_what_was_decided() {
    assert_eq!(ControlReply::new(3, Ok(0)).result(), Ok(0));
    assert_eq!(ControlReply::new(3, Ok(77)).result(), Ok(77));
    assert_eq!(ControlReply::new(4, Ok(77)).id, 4);
    let words = "there is no such object";
    assert_eq!(ControlReply::new(3, Err(words)).result(), Err(words.into()));
    // Cut between letters, never within one.
    let long = "ü".repeat(MAX_ANSWER_BYTES);
    let cut = ControlReply::new(3, Err(&long)).result().unwrap_err();
    assert_eq!(cut, long[..MAX_ANSWER_BYTES / 2 * 2]);
}

#[test]
fn every_live_byte_of_a_table_counts() {
    let mut table: Box<ConstraintTable> = zeroed();
    table.count = 2;
    let hash = |table: &ConstraintTable| {
        let mut hash = StateHash::new();
        table.hash_into(&mut hash);
        hash.finish()
    };
    let before = hash(&table);
    let live = std::mem::offset_of!(ConstraintTable, constraints) + 2 * size_of::<Constraint>();
    let count = std::mem::offset_of!(ConstraintTable, count);
    for at in (0..live).filter(|at| !(count..count + 4).contains(at)) {
        table.as_mut_bytes()[at] ^= 1;
        assert_ne!(hash(&table), before, "byte {at}");
        table.as_mut_bytes()[at] ^= 1;
    }
    table.as_mut_bytes()[live] ^= 1;
    assert_eq!(hash(&table), before, "past what is live");
    table.count = 3;
    assert_ne!(hash(&table), before);
}

#[test]
fn a_copy_is_the_same_to_every_reader() {
    let mut table: Box<ConstraintTable> = zeroed();
    (table.version, table.count) = (7, 2);
    (table.effect_tick, table.complete_for_events) = (8, 9);
    table.constraints[1].after = 4;
    let mut copy: Box<ConstraintTable> = zeroed();
    Versioned::copy_from(&mut *copy, &table);
    assert_eq!(copy.as_bytes(), table.as_bytes());
    assert_eq!(Versioned::version(&*copy), 7);

    let mut schedule: Box<Schedule> = zeroed();
    (schedule.version, schedule.effect_tick) = (7, 8);
    (schedule.listed_until_tick, schedule.scene_version) = (9, 10);
    (
        schedule.robot_count,
        schedule.action_count,
        schedule.wait_count,
    ) = (2, 3, 4);
    schedule.robots[1].count = 3;
    schedule.actions[2].waits = 4;
    schedule.waits[3].robot = 1;
    let mut copy: Box<Schedule> = zeroed();
    Versioned::copy_from(&mut *copy, &schedule);
    assert_eq!(copy.as_bytes(), schedule.as_bytes());
    assert_eq!(Versioned::version(&*copy), 7);

    let mut batch: Box<MotionBatch> = zeroed();
    (batch.sequence, batch.tick, batch.time_ns, batch.kept_from) = (1, 2, 3, 4);
    (batch.motion_count, batch.event_count) = (2, 3);
    batch.motions[1] = MotionRecord {
        to: Point { x: 1.0, y: 2.0 },
        ..MotionRecord::new_zeroed()
    };
    batch.events[2] = EventRecord::new(EventKind::Moved, 5);
    let mut copy: Box<MotionBatch> = zeroed();
    copy.copy_from(&batch);
    assert_eq!(copy.as_bytes(), batch.as_bytes());
}

proptest! {
    #[test]
    fn who_is_barred_is_a_set_of_robots(barred in proptest::collection::btree_set(0..MAX_ROBOTS, 0..9)) {
        let mut object = ObjectState::default();
        for &robot in &barred {
            object.epoch_barred[robot / 64] |= 1 << (robot % 64);
        }
        for robot in 0..MAX_ROBOTS {
            prop_assert_eq!(object.was_barred(robot), barred.contains(&robot));
        }
    }
}
