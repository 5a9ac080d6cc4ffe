//! The loop around the planner service.
//!
//! Responsible for: bringing the planner its snapshot and the questions it may see, in the order
//! every driver keeps, and carrying off tables, answers and its report.
//! Not responsible for: anything the planner decides (crate `planner`).
//!
//! What a step publishes is sent before its report: whoever has the report has the rest. A schedule
//! is written down before it is sent, for the next process of the planner: robots go on with it when
//! this one dies.

mod last;

use std::path::Path;

use planner::{Planner, PlannerInput};
use shm_types::{
    Checked, ConstraintTable, Counters, HardAnswer, HardRequest, PlannerReport, Schedule,
    SnapshotHeader, Validate, WorldSnapshot,
};

use crate::calls::{OPEN_CALLS, Question, Server};
use crate::clock;
use crate::histograms::Timed;
use crate::options::Role;
use crate::ports::{Access, Publisher};
use crate::roles::follower::{Follower, Next};
use crate::roles::{RoleError, Seat, Telling, refused};
use crate::wakes::Waker;
use last::LastSchedule;

/// Takes part in the run in `run_dir`, as process `incarnation` of the planner, until it ends.
///
/// # Errors
/// Set-up failed, or the run broke off.
pub fn main(run_dir: &Path, incarnation: u32) -> Result<(), RoleError> {
    let mut seat = Seat::take(run_dir, Role::Planner, incarnation)?;
    let robots = seat.run.robots;
    let mut shell = Shell::new(&seat)?;
    let mut follower = Follower::new(&seat, robots, robots + 1)?;
    seat.settle();
    while let Some(next) = follower.next(&mut seat, || shell.connect())? {
        let Next::Snapshot(snapshot) = next else {
            shell.connect()?;
            shell.send()?;
            continue;
        };
        shell.follow(&mut seat, &snapshot.header)?;
        let snapshot = Checked::new(&*snapshot, seat.counts()).map_err(refused("world"))?;
        shell.answer(&mut seat, snapshot)?;
    }
    let telling = Telling {
        deadline_misses: follower.deadline_misses(),
        snapshots_skipped: follower.skipped(),
        counters: shell.counters.into(),
        ..Telling::default()
    };
    seat.leave(telling)
}

/// A question that is not answered yet.
struct Held {
    question: Question<HardRequest, HardAnswer>,
    /// Whether the planner has seen it.
    seen: bool,
}

/// The planner and its ports.
struct Shell {
    /// Once it has seen a snapshot: the scene may have changed since the run began.
    planner: Option<Planner>,
    server: Server<HardRequest, HardAnswer>,
    /// Questions not answered yet, in the order in which they came.
    questions: Vec<Held>,
    /// Those the planner sees in this step, in the order of robots.
    requests: Vec<HardRequest>,
    tables: Publisher<ConstraintTable>,
    schedules: Option<Publisher<Schedule>>,
    last: LastSchedule,
    outlet: Publisher<PlannerReport>,
    waker: Option<Waker>,
    counters: Counters,
    /// As it was sent last.
    report: PlannerReport,
}

impl Shell {
    fn new(seat: &Seat) -> Result<Self, RoleError> {
        let (topics, node) = (&seat.topics, &seat.node);
        let schedules = topics.schedule_service(node, Access::Open)?;
        let most = seat.run.room().robots as usize * (OPEN_CALLS + 1);
        Ok(Self {
            planner: None,
            last: LastSchedule::new(seat.schedule_path()),
            server: topics.hard.service(node, Access::Open)?.server()?,
            questions: Vec::with_capacity(most),
            requests: Vec::with_capacity(most),
            tables: topics
                .constraints
                .service(node, Access::Open)?
                .publisher()?,
            schedules: schedules.map(|service| service.publisher()).transpose()?,
            outlet: topics.planner.service(node, Access::Open)?.publisher()?,
            waker: seat.waker(|| topics.wake_world.service(node, Access::Open)?.waker())?,
            counters: Counters::default(),
            report: PlannerReport::default(),
        })
    }

    /// Takes over the version of the scene that a snapshot names. With the first, the planner is
    /// made.
    fn follow(&mut self, seat: &mut Seat, header: &SnapshotHeader) -> Result<(), RoleError> {
        seat.follow(header)?;
        self.planner.get_or_insert_with(|| {
            Planner::succeeding(
                &seat.scene,
                seat.options().settings.clone(),
                seat.incarnation,
                self.last.read(seat.counts()).as_deref(),
            )
            .with_rollouts(sim::rollout)
        });
        Ok(())
    }

    /// One tick: from a snapshot to a report. Nothing is answered before there is a planner.
    fn answer(
        &mut self,
        seat: &mut Seat,
        snapshot: Checked<'_, WorldSnapshot>,
    ) -> Result<(), RoleError> {
        let header = &snapshot.header;
        self.receive(seat, header.tick)?;
        let Some(planner) = &mut self.planner else {
            return Ok(());
        };
        let input = PlannerInput {
            snapshot,
            requests: &self.requests,
        };
        let units = seat.options().settings.units_per_tick(header.busy);
        let started_ns = clock::now_ns();
        let output = planner.step(&seat.scene, input, units);
        seat.record_since(Timed::PlannerStep, started_ns);
        seat.answering();
        connect(&self.tables, self.schedules.as_ref())?;
        if let Some(table) = output.table {
            self.tables.send(|out| out.copy_from(table))?;
        }
        if let (Some(schedules), Some(schedule)) = (&self.schedules, output.schedule) {
            if let Err(error) = self.last.write(schedule) {
                // The next process plans anew then.
                seat.note(error.to_string());
            }
            schedules.send(|out| out.copy_from(schedule))?;
        }
        for answer in output.answers {
            let asks = |held: &Held| held.seen && is_answer(&held.question, answer);
            for held in self.questions.iter().filter(|held| asks(held)) {
                held.question.answer(*answer)?;
            }
            self.questions.retain(|held| !asks(held));
        }
        self.counters = output.report.counters;
        self.report = PlannerReport {
            incarnation: seat.incarnation,
            ..output.report
        };
        self.send()
    }

    /// Lets readers in that have come since.
    fn connect(&self) -> Result<(), RoleError> {
        connect(&self.tables, self.schedules.as_ref())
    }

    /// Sends the report as it stands.
    fn send(&self) -> Result<(), RoleError> {
        let report = self.report;
        self.outlet.send(|out| *out = report)?;
        if let Some(waker) = &self.waker {
            waker.wake()?;
        }
        Ok(())
    }

    /// Takes in questions, and shows the planner those stamped before `tick` that it has not
    /// seen.
    fn receive(&mut self, seat: &Seat, tick: u64) -> Result<(), RoleError> {
        while let Some(question) = self.server.receive()? {
            // One that is none is not answered; who asks in earnest asks again.
            if question.validate(seat.counts()).is_err() {
                continue;
            }
            self.give_up_old(question.robot);
            self.questions.push(Held {
                question,
                seen: false,
            });
        }
        self.requests.clear();
        for held in &mut self.questions {
            if !held.seen && held.question.tick < tick {
                held.seen = true;
                self.requests.push(*held.question);
            }
        }
        self.requests
            .sort_unstable_by_key(|request| (request.robot, request.tick));
        Ok(())
    }

    /// Lets the oldest question of a robot go that holds as many as its client may.
    fn give_up_old(&mut self, robot: u32) {
        let theirs = |held: &Held| held.question.robot == robot;
        let count = self.questions.iter().filter(|held| theirs(held)).count();
        if count > OPEN_CALLS
            && let Some(oldest) = self.questions.iter().position(theirs)
        {
            self.questions.remove(oldest);
        }
    }
}

/// Lets readers of tables and schedules in that have come since the last was published.
fn connect(
    tables: &Publisher<ConstraintTable>,
    schedules: Option<&Publisher<Schedule>>,
) -> Result<(), RoleError> {
    tables.connect()?;
    if let Some(schedules) = schedules {
        schedules.connect()?;
    }
    Ok(())
}

fn is_answer(question: &HardRequest, answer: &HardAnswer) -> bool {
    let asked = (question.robot, question.incarnation, question.failure);
    asked == (answer.robot, answer.incarnation, answer.failure)
}
