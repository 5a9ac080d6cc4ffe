//! The loop around one robot.
//!
//! Responsible for: bringing a robot its snapshot, its constraint table or schedule and its
//! answers, in the order every driver keeps, and carrying off its command and its questions.
//! Not responsible for: anything the robot decides (crate `robot`).
//!
//! The snapshot is read in place. A question is sent before the command of the same tick, so that
//! it is there when the planner steps on the next one.

mod questions;
mod timing;

use std::path::Path;
use std::time::{Duration, Instant};

use crate::clock;
use crate::histograms::Timed;
use crate::options::{Clock, Role};
use crate::ports::{Access, Publisher};
use crate::roles::follower::{Follower, Next};
use crate::roles::tables::Tables;
use crate::roles::{RoleError, Seat, Telling, refused};
use crate::wakes::Waker;
use questions::Questions;
use robot::{Robot, RobotInput};
use shm_types::{Checked, Command, ConstraintTable, Schedule, SnapshotHeader, WorldSnapshot};
use timing::Timing;

/// How long after its start a robot waits to be let in by a planner, which may be dead.
const LET_IN: Duration = Duration::from_secs(2);
/// Sleep between two looks.
const LOOK_AGAIN: Duration = Duration::from_micros(200);

/// Takes part in the run in `run_dir` as process `incarnation` of robot `index` until it ends.
///
/// # Errors
/// Set-up failed, or the run broke off.
pub fn main(run_dir: &Path, index: u32, incarnation: u32) -> Result<(), RoleError> {
    let mut seat = Seat::take(run_dir, Role::Robot(index), incarnation)?;
    let robots = seat.run.robots;
    if index >= robots {
        return Err(RoleError::Index { index, robots });
    }
    let mut shell = Shell::new(&seat, index)?;
    let mut follower = Follower::new(&seat, index, robots + 1)?;
    seat.settle();
    while let Some(next) = follower.next(&mut seat, || Ok(()))? {
        let Next::Snapshot(snapshot) = next else {
            shell.send()?;
            continue;
        };
        let received_ns = clock::now_ns();
        if index >= snapshot.header.robot_count {
            // A world that goes on from before this robot was added knows nothing of it.
            continue;
        }
        shell.follow(&mut seat, &snapshot.header)?;
        let snapshot = Checked::new(&*snapshot, seat.counts()).map_err(refused("world"))?;
        seat.record_since(Timed::SnapshotCheck, received_ns);
        shell.answer(&mut seat, snapshot)?;
    }
    let telling = Telling {
        deadline_misses: follower.deadline_misses(),
        snapshots_skipped: follower.skipped(),
        counters: shell.command.counters.into(),
        ..Telling::default()
    };
    seat.leave(telling)
}

/// A robot and its ports.
struct Shell {
    index: usize,
    /// Once it has seen a snapshot: the scene may have got this robot since the run began.
    robot: Option<Robot>,
    tables: Tables<ConstraintTable>,
    /// The table of version 0.
    empty: Box<ConstraintTable>,
    schedules: Option<Tables<Schedule>>,
    questions: Questions,
    outlet: Publisher<Command>,
    waker: Option<Waker>,
    command: Box<Command>,
    timing: Timing,
    /// When it began to wait to be let in.
    since: Instant,
}

impl Shell {
    fn new(seat: &Seat, index: u32) -> Result<Self, RoleError> {
        let (topics, node) = (&seat.topics, &seat.node);
        let index = index as usize;
        let schedules = topics.schedule_service(node, Access::Open)?;
        let schedules = schedules.map(|service| Tables::new(&service, seat.counts()));
        Ok(Self {
            index,
            robot: None,
            tables: Tables::new(
                &topics.constraints.service(node, Access::Open)?,
                seat.counts(),
            )?,
            empty: ConstraintTable::none(),
            schedules: schedules.transpose()?,
            questions: Questions::new(topics.hard.service(node, Access::Open)?.client()?),
            outlet: topics.command.service(node, Access::Open)?.publisher()?,
            waker: seat.waker(|| topics.wake_world.service(node, Access::Open)?.waker())?,
            command: Box::default(),
            timing: Timing::default(),
            since: Instant::now(),
        })
    }

    /// Takes over the version of the scene that a snapshot names.
    fn follow(&mut self, seat: &mut Seat, header: &SnapshotHeader) -> Result<(), RoleError> {
        let is_other = seat.follow(header)?;
        match &mut self.robot {
            Some(robot) if is_other => robot.enter(&seat.scene),
            Some(_) => {}
            None => {
                let settings = seat.options().settings.clone();
                let (scene, incarnation) = (&seat.scene, seat.incarnation);
                self.robot = Some(Robot::new(scene, settings, self.index, incarnation));
            }
        }
        if is_other {
            self.tables.recount(seat.counts());
            if let Some(schedules) = &mut self.schedules {
                schedules.recount(seat.counts());
            }
        }
        Ok(())
    }

    /// Takes in what the planner has published. In lockstep, one that has come later waits to be let
    /// in: what it does may not depend on when that is. The planner does so while it waits, too.
    fn receive(&mut self, seat: &Seat, header: &SnapshotHeader) -> Result<(), RoleError> {
        loop {
            self.tables.receive(header.epoch_constraints_version)?;
            if let Some(schedules) = &mut self.schedules {
                schedules.receive(header.schedule_version)?;
            }
            let lacks_table = header.constraints_version > 0 && self.tables.newest().is_none();
            let schedules = self.schedules.as_ref();
            let lacks_schedule = header.schedule_version > 0
                && schedules.is_some_and(|schedules| schedules.newest().is_none());
            let may_wait = seat.options().clock == Clock::Lockstep
                && self.since.elapsed() < LET_IN
                && !seat.is_stopped();
            if !(may_wait && (lacks_table || lacks_schedule)) {
                return Ok(());
            }
            std::thread::sleep(LOOK_AGAIN);
        }
    }

    /// One tick: from a snapshot to a command.
    fn answer(
        &mut self,
        seat: &mut Seat,
        snapshot: Checked<'_, WorldSnapshot>,
    ) -> Result<(), RoleError> {
        let header = &snapshot.header;
        self.receive(seat, header)?;
        let Some(robot) = &mut self.robot else {
            return Ok(());
        };
        self.questions.receive(seat, header.tick)?;
        self.timing
            .see(&snapshot.robots()[self.index], &mut seat.latencies);
        // The empty one if it is not held: who wants another sees that, and waits.
        let table = match self.tables.version(header.epoch_constraints_version) {
            Some(kept) => kept.checked(),
            None => Checked::new(&*self.empty, seat.counts()),
        };
        let schedules = self.schedules.as_ref();
        let schedule = schedules.and_then(|kept| kept.version(header.schedule_version));
        let schedule = schedule.map(|kept| kept.checked().map_err(refused("schedule")));
        let input = RobotInput {
            snapshot,
            table: table.map_err(refused("constraints"))?,
            schedule: schedule.transpose()?,
            answer: self.questions.answer(),
        };
        let units = seat.options().settings.units_per_tick(header.busy);
        let started_ns = clock::now_ns();
        let asked = robot.step(&seat.scene, input, units, &mut self.command);
        self.timing
            .stepped(started_ns, &self.command, &mut seat.latencies);
        seat.answering();
        if let Some(question) = asked {
            self.questions.ask(question)?;
        }
        self.send()?;
        self.timing.sent(&self.command);
        Ok(())
    }

    /// Sends the command as it stands.
    fn send(&self) -> Result<(), RoleError> {
        self.outlet.send(|out| *out = *self.command)?;
        if let Some(waker) = &self.waker {
            waker.wake()?;
        }
        Ok(())
    }
}
