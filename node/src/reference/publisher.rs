//! The reference's publisher: it stands for the world.
//!
//! Responsible for: sending a batch of motion and a snapshot in each tick, and in lockstep waiting
//! until every reader has answered.
//! Not responsible for: what comes of it: the world it steps hears of no command, so that its
//! robots stand still. It is stepped, and the batch is sent, so that the publisher comes to send
//! its snapshot with caches that hold other things too, as a world does.

use iceoryx2::port::update_connections::UpdateConnections;
use shm_types::capacity::MAX_ROBOTS;
use shm_types::{Command, MotionBatch, Outcome, PlannerReport, WorldSnapshot};
use world::{World, WorldInput};

use crate::clock;
use crate::histograms::Timed;
use crate::ports::{Access, TopicError, failed};
use crate::reference::{BarePublisher, BareSubscriber, publisher, subscriber};
use crate::roles::{RoleError, Seat, Telling};
use crate::ticker::{Due, Ticker};
use crate::wait::Waiter;
use crate::wakes::Waker;
use crate::wire::in_place;

pub(super) fn main(mut seat: Seat) -> Result<(), RoleError> {
    let mut shell = Shell::new(&seat)?;
    seat.settle();
    let settings = &seat.options().settings;
    let ticks = settings.time_limit_ns / settings.tick_ns.max(1);
    shell.publish(&mut seat, Outcome::Running)?;
    if shell.wait_for_all(&seat)? {
        if let Some(period_ns) = seat.options().clock.period_ns() {
            let mut ticker = Ticker::aligned(clock::now_ns(), period_ns, 0);
            ticker.wait();
            shell.pace = Some((ticker, Due::new(period_ns, 0)));
        }
        shell.run(&mut seat, ticks)?;
    }
    shell.linger(&mut seat)?;
    let telling = Telling {
        deadline_misses: shell.pace.map_or(0, |(ticker, _)| ticker.misses()),
        ..Telling::default()
    };
    seat.leave(telling)
}

struct Shell {
    snapshots: BarePublisher<WorldSnapshot>,
    motion: BarePublisher<MotionBatch>,
    commands: BareSubscriber<Command>,
    planner: BareSubscriber<PlannerReport>,
    waiter: Waiter,
    waker: Option<Waker>,
    /// In real time, the own deadlines.
    pace: Option<(Ticker, Due)>,
    /// What is published.
    world: World,
    tick: u64,
    /// The tick after the newest that each robot has answered, and the planner, last.
    answered: Vec<u64>,
    published_ns: u64,
}

impl Shell {
    fn new(seat: &Seat) -> Result<Self, RoleError> {
        let (topics, node) = (&seat.topics, &seat.node);
        Ok(Self {
            snapshots: publisher(&topics.world.service(node, Access::Open)?)?,
            motion: publisher(&topics.motion.service(node, Access::Open)?)?,
            commands: subscriber(&topics.command.service(node, Access::Open)?)?,
            planner: subscriber(&topics.planner.service(node, Access::Open)?)?,
            waiter: seat.waiter(|| topics.wake_world.service(node, Access::Open)?.sleeper())?,
            waker: seat.waker(|| {
                let wakes = &topics.wake_participants;
                wakes.service(node, Access::Open)?.waker()
            })?,
            pace: None,
            world: World::new(&seat.scene, seat.options().settings.clone(), 0),
            tick: 0,
            answered: vec![0; seat.run.robots as usize + 1],
            published_ns: 0,
        })
    }

    fn run(&mut self, seat: &mut Seat, ticks: u64) -> Result<(), RoleError> {
        while self.tick < ticks {
            self.tick += 1;
            self.step(seat)?;
            seat.answering();
            self.publish(seat, Outcome::Running)?;
            let go_on = match &mut self.pace {
                Some((ticker, _)) => {
                    if !seat.is_warm() {
                        ticker.forget_misses();
                    }
                    ticker.wait();
                    self.listen()?;
                    !seat.is_stopped()
                }
                None => self.wait_for_all(seat)?,
            };
            if !go_on {
                break;
            }
        }
        Ok(())
    }

    fn step(&mut self, seat: &Seat) -> Result<(), TopicError> {
        let input = WorldInput {
            commands: &[None; MAX_ROBOTS][..seat.run.robots as usize],
            planner: None,
            table: None,
            schedule: None,
            control: &[],
            change: None,
        };
        let loan = self.motion.loan_uninit();
        let mut loan = loan.map_err(|e| failed("write to", "motion")(&e))?;
        let batch = in_place(loan.payload_mut());
        self.world.step(&seat.scene, input, batch);
        // SAFETY: `in_place` has shown that the payload is a valid message.
        let loan = unsafe { loan.assume_init() };
        loan.send().map_err(|e| failed("send on", "motion")(&e))?;
        Ok(())
    }

    fn publish(&mut self, seat: &mut Seat, outcome: Outcome) -> Result<(), TopicError> {
        let started_ns = clock::now_ns();
        let mut loan = self
            .snapshots
            .loan_uninit()
            .map_err(|e| failed("write to", "world")(&e))?;
        let snapshot = in_place(loan.payload_mut());
        self.world.snapshot_into(snapshot);
        snapshot.header.tick = self.tick;
        snapshot.header.outcome = outcome.code();
        let stamp_ns = clock::now_ns();
        snapshot.header.publish_stamp_ns = stamp_ns;
        // SAFETY: `in_place` has shown that the payload is a valid message.
        let loan = unsafe { loan.assume_init() };
        loan.send().map_err(|e| failed("send on", "world")(&e))?;
        let sent_ns = clock::now_ns();
        let before_ns = std::mem::replace(&mut self.published_ns, sent_ns);
        if self.tick > 1 {
            let latencies = &mut seat.latencies;
            latencies.record(Timed::SnapshotWrite, stamp_ns - started_ns);
            latencies.record(Timed::SnapshotSend, sent_ns - stamp_ns);
            latencies.record(Timed::Tick, sent_ns - before_ns);
        }
        if let Some((_, due)) = &mut self.pace {
            for late_ns in due.came(stamp_ns, stamp_ns) {
                seat.latencies.record(Timed::TickLateness, late_ns);
            }
        }
        if let Some(waker) = &self.waker {
            waker.wake()?;
        }
        Ok(())
    }

    /// Takes in all answers that have come.
    fn listen(&mut self) -> Result<(), TopicError> {
        let refused = |e: &dyn std::fmt::Debug| failed("receive from", "command")(e);
        while let Some(command) = self.commands.receive().map_err(|e| refused(&e))? {
            let Command { robot, tick, .. } = &command.payload().0;
            if let Some(answered) = self.answered.get_mut(*robot as usize) {
                *answered = tick + 1;
            }
        }
        if let Some(report) = self.planner.receive().map_err(|e| refused(&e))?
            && let Some(answered) = self.answered.last_mut()
        {
            *answered = report.payload().0.tick + 1;
        }
        Ok(())
    }

    /// Waits until every reader has answered the present tick. `false` if this process is to end.
    fn wait_for_all(&mut self, seat: &Seat) -> Result<bool, RoleError> {
        loop {
            self.listen()?;
            if self.answered.iter().all(|next| *next > self.tick) {
                self.waiter.arrived();
                return Ok(true);
            }
            if seat.is_stopped() {
                return Ok(false);
            }
            self.connect()?;
            self.waiter.pause()?;
        }
    }

    fn connect(&self) -> Result<(), TopicError> {
        self.snapshots
            .update_connections()
            .and_then(|()| self.motion.update_connections())
            .map_err(|e| failed("connect readers of", "world")(&e))
    }

    /// Says that this is the end, and stays until everybody has seen it.
    fn linger(&mut self, seat: &mut Seat) -> Result<(), RoleError> {
        self.tick += 1;
        self.publish(seat, Outcome::Timeout)?;
        while !seat.is_stopped() {
            self.connect()?;
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        Ok(())
    }
}
