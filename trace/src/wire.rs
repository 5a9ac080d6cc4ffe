//! From the messages of the run to the words of a trace.
//!
//! Responsible for: translating checked messages.
//! Not responsible for: which of them are written (`writer`).

use shm_types::{
    Checked, EventKind, EventRecord, Invalid, MotionRecord, Outcome, WorldSnapshot, index,
};

use crate::record::{
    BodyKind, ConstraintKind, Event, FailureCause, Happening, Motion, ObjectNow, RobotNow, State,
};

pub(crate) fn motion(record: &MotionRecord) -> Result<Motion, Invalid> {
    let body = match shm_types::BodyKind::decode(record.body)? {
        shm_types::BodyKind::Robot => BodyKind::Robot,
        shm_types::BodyKind::Object => BodyKind::Object,
    };
    Ok(Motion {
        body,
        id: record.id as usize,
        start_ns: record.start_ns,
        end_ns: record.end_ns,
        from: record.from.into(),
        to: record.to.into(),
    })
}

pub(crate) fn event(tick: u64, record: &EventRecord) -> Result<Event, Invalid> {
    Ok(Event {
        tick,
        time_ns: record.time_ns,
        what: happening(record)?,
    })
}

fn happening(record: &EventRecord) -> Result<Happening, Invalid> {
    let named = |what, id| index(id).ok_or(Invalid::Inconsistent { what });
    let robot = || named("an event without its robot", record.robot);
    let task = || named("an event without its task", record.task);
    let code = u32::try_from(record.value).unwrap_or(u32::MAX);
    Ok(match EventKind::decode(record.kind)? {
        EventKind::Started => Happening::Started,
        EventKind::Claimed => Happening::Claimed {
            robot: robot()?,
            task: task()?,
            epoch: record.value,
        },
        EventKind::Unclaimed => Happening::Unclaimed {
            robot: robot()?,
            task: task()?,
        },
        EventKind::GraspStarted => Happening::GraspStarted {
            robot: robot()?,
            task: task()?,
        },
        EventKind::Grasped => Happening::Grasped {
            robot: robot()?,
            task: task()?,
        },
        EventKind::ReleaseStarted => Happening::ReleaseStarted { robot: robot()? },
        EventKind::Released => Happening::Released {
            robot: robot()?,
            task: task()?,
        },
        EventKind::Completed => Happening::Completed { task: task()? },
        EventKind::Failed => Happening::Failed {
            robot: robot()?,
            task: task()?,
            cause: shm_types::FailureCause::decode(code).map(FailureCause::from)?,
            blocker: index(record.other),
        },
        EventKind::Constraint => Happening::Constraint {
            before: task()?,
            after: named("a constraint without its later task", record.other)?,
            test: shm_types::ConstraintKind::decode(code).map(ConstraintKind::from)?,
        },
        EventKind::Epoch => Happening::Epoch {
            epoch: record.value,
        },
        EventKind::RobotUp => Happening::RobotUp {
            robot: robot()?,
            incarnation: record.value,
        },
        EventKind::RobotDown => Happening::RobotDown { robot: robot()? },
        EventKind::Held => Happening::Held,
        EventKind::Resumed => Happening::Resumed,
        EventKind::Ended => Happening::Ended {
            outcome: Outcome::decode(code)?.into(),
        },
        EventKind::Violated => Happening::Violated {
            robot: index(record.robot),
            task: index(record.task),
            other: index(record.other),
            invariant: record.value,
        },
        EventKind::Changed => Happening::Changed {
            version: u64::from(record.other),
        },
        EventKind::Moved => Happening::Moved { task: task()? },
        EventKind::ScheduleRefused => Happening::ScheduleRefused {
            version: record.value & u64::from(u32::MAX),
            why: shm_types::Refusal::decode(record.other)?.into(),
            robot: index(record.robot),
            granted: record.value >> 32,
        },
    })
}

pub(crate) fn state(snapshot: Checked<'_, WorldSnapshot>) -> Result<State, Invalid> {
    let robot = |robot: &shm_types::RobotState| {
        Ok(RobotNow {
            at: robot.position.into(),
            task: index(robot.task),
            holding: index(robot.holding),
            phase: shm_types::Phase::decode(robot.phase)?.into(),
            activity: shm_types::Activity::decode(robot.activity)?.into(),
            grant: robot.grant().iter().map(|&corner| corner.into()).collect(),
        })
    };
    let object = |object: &shm_types::ObjectState| {
        Ok(ObjectNow {
            at: object.position.into(),
            holder: index(object.holder),
            status: shm_types::TaskStatus::decode(object.status)?.into(),
        })
    };
    Ok(State {
        tick: snapshot.header.tick,
        time_ns: snapshot.header.time_ns,
        epoch: snapshot.header.epoch,
        constraints_version: snapshot.header.constraints_version,
        robots: snapshot
            .robots()
            .iter()
            .map(robot)
            .collect::<Result<_, Invalid>>()?,
        objects: snapshot
            .objects()
            .iter()
            .map(object)
            .collect::<Result<_, Invalid>>()?,
    })
}
