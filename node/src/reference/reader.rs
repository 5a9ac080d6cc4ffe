//! The reference's readers: they stand for robots, planner and recorder.
//!
//! Responsible for: looking at each snapshot as a robot does, and answering it.
//! Not responsible for: any robot: the answer is always the same.

use std::time::Duration;

use shm_types::{Command, Outcome, PlannerReport, WorldSnapshot};

use crate::clock;
use crate::histograms::Timed;
use crate::options::Role;
use crate::ports::{Access, TopicError, failed};
use crate::reference::{BarePublisher, BareSubscriber, publisher, subscriber};
use crate::roles::{RoleError, Seat, Telling};
use crate::ticker::{Due, Ticker};
use crate::wait::Waiter;
use crate::wakes::Waker;
use crate::wire::in_place;

/// Sleep between two looks of the one that stands for the recorder: as long as the recorder's.
const PERIOD: Duration = Duration::from_micros(500);

/// Where an answer goes.
enum Outlet {
    Robot(u32, BarePublisher<Command>),
    Planner(BarePublisher<PlannerReport>),
}

struct Shell {
    snapshots: BareSubscriber<WorldSnapshot>,
    outlet: Outlet,
    waiter: Waiter,
    waker: Option<Waker>,
    /// Deadline within the period, and the period, ns; `None` in lockstep.
    grid: Option<(u64, u64)>,
    pace: Option<(Ticker, Due)>,
}

pub(super) fn main(mut seat: Seat) -> Result<(), RoleError> {
    let mut shell = Shell::new(&seat)?;
    seat.settle();
    while shell.next(&mut seat)? {}
    let telling = Telling {
        deadline_misses: shell.pace.map_or(0, |(ticker, _)| ticker.misses()),
        ..Telling::default()
    };
    seat.leave(telling)
}

impl Shell {
    fn new(seat: &Seat) -> Result<Self, RoleError> {
        let (topics, node, robots) = (&seat.topics, &seat.node, seat.run.robots);
        let (turn, outlet) = match seat.role {
            Role::Robot(index) => {
                let service = topics.command.service(node, Access::Open)?;
                (index, Outlet::Robot(index, publisher(&service)?))
            }
            _ => {
                let service = topics.planner.service(node, Access::Open)?;
                (robots, Outlet::Planner(publisher(&service)?))
            }
        };
        let grid = seat.options().clock.period_ns().map(|period_ns| {
            let phase_ns = period_ns * u64::from(turn + 1) / u64::from(robots + 2);
            (phase_ns, period_ns)
        });
        Ok(Self {
            snapshots: subscriber(&topics.world.service(node, Access::Open)?)?,
            outlet,
            waiter: seat.waiter(|| {
                let wakes = &topics.wake_participants;
                wakes.service(node, Access::Open)?.sleeper()
            })?,
            waker: seat.waker(|| topics.wake_world.service(node, Access::Open)?.waker())?,
            grid,
            pace: None,
        })
    }

    /// Waits for a snapshot, times it and answers it. `false` at the end.
    fn next(&mut self, seat: &mut Seat) -> Result<bool, RoleError> {
        if let Some((ticker, _)) = &mut self.pace {
            if !seat.is_warm() {
                ticker.forget_misses();
            }
            ticker.wait();
        }
        let sample = loop {
            if seat.is_stopped() {
                return Ok(false);
            }
            let received = self.snapshots.receive();
            match received.map_err(|e| failed("receive from", "world")(&e))? {
                Some(sample) => break sample,
                None => match &mut self.pace {
                    Some((ticker, _)) => {
                        ticker.wait();
                    }
                    None => self.waiter.pause()?,
                },
            }
        };
        let now_ns = clock::now_ns();
        self.waiter.arrived();
        let header = &sample.payload().0.header;
        if header.outcome != Outcome::Running.code() {
            return Ok(false);
        }
        let (tick, stamp_ns) = (header.tick, header.publish_stamp_ns);
        let age = match seat.role {
            Role::Planner => Timed::PlannerSnapshotAge,
            _ => Timed::SnapshotAge,
        };
        seat.latencies.record(age, now_ns.saturating_sub(stamp_ns));
        if let (Some((_, due)), Timed::SnapshotAge) = (&mut self.pace, age) {
            for late_ns in due.came(stamp_ns, now_ns) {
                seat.latencies.record(Timed::SnapshotLateness, late_ns);
            }
        }
        if let (None, Some((phase_ns, period_ns)), 1..) = (&self.pace, self.grid, tick) {
            let ticker = Ticker::aligned(now_ns, period_ns, phase_ns);
            self.pace = Some((ticker, Due::new(period_ns, phase_ns)));
        }
        drop(sample);
        seat.answering();
        self.answer(tick)?;
        Ok(true)
    }

    fn answer(&self, tick: u64) -> Result<(), TopicError> {
        match &self.outlet {
            Outlet::Robot(robot, port) => {
                let mut loan = port
                    .loan_uninit()
                    .map_err(|e| failed("write to", "command")(&e))?;
                *in_place(loan.payload_mut()) = Command {
                    robot: *robot,
                    tick,
                    ..Command::default()
                };
                // SAFETY: `in_place` has shown that the payload is a valid message.
                let loan = unsafe { loan.assume_init() };
                loan.send().map_err(|e| failed("send on", "command")(&e))?;
            }
            Outlet::Planner(port) => {
                let mut loan = port
                    .loan_uninit()
                    .map_err(|e| failed("write to", "planner")(&e))?;
                in_place(loan.payload_mut()).tick = tick;
                // SAFETY: as above.
                let loan = unsafe { loan.assume_init() };
                loan.send().map_err(|e| failed("send on", "planner")(&e))?;
            }
        }
        if let Some(waker) = &self.waker {
            waker.wake()?;
        }
        Ok(())
    }
}

/// In the recorder's place: sleeps between two looks, and answers nothing.
pub(super) fn look_now_and_then(mut seat: Seat) -> Result<(), RoleError> {
    let service = seat.topics.world.service(&seat.node, Access::Open)?;
    let snapshots = subscriber(&service)?;
    let motion = subscriber(&seat.topics.motion.service(&seat.node, Access::Open)?)?;
    seat.settle();
    while !seat.is_stopped() {
        while motion
            .receive()
            .map_err(|e| failed("receive from", "motion")(&e))?
            .is_some()
        {}
        let received = snapshots.receive();
        match received.map_err(|e| failed("receive from", "world")(&e))? {
            Some(sample) if sample.payload().0.header.outcome != Outcome::Running.code() => break,
            Some(_) => seat.answering(),
            None => {}
        }
        std::thread::sleep(PERIOD);
    }
    seat.leave(Telling::default())
}
