//! All that the world hears.
//!
//! Responsible for: the newest command of each robot, the planner's newest report, the table and
//! the schedule that go with it, how far the recorder has come, requests of control; and whether everybody has
//! answered a tick.
//! Not responsible for: what any of it means to the world (crate `world`).
//!
//! The recorder takes part by a window: the world runs ahead of it by so many batches, then it
//! waits. A message that is no legal one is as good as lost: whoever sends such does not take the
//! world along.

use shm_types::capacity::MAX_ROBOTS;
use shm_types::{
    Checked, Command, ConstraintTable, ControlKind, ControlReply, ControlRequest, Counts,
    PlannerReport, RecorderReport, RoleKind, Schedule, Validate,
};
use world::{PublishedSchedule, World};

use super::changes::{Changes, changes_of, take_part};
use crate::calls::{Question, Server};
use crate::options::Told;
use crate::ports::{Access, Subscriber};
use crate::roles::tables::Tables;
use crate::roles::{RoleError, Seat, refused};
use crate::topics::MOTION_WINDOW;

/// Most requests of control taken in one tick; later ones wait for the next.
pub(super) const MOST_REQUESTS: usize = 16;

/// What is known of one robot's process.
#[derive(Clone, Default)]
struct Robot {
    incarnation: u32,
    /// Whether a command of that process has come at all.
    heard: bool,
    /// There is no process: nobody waits for its answer.
    gone: bool,
    command: Command,
    /// The newest command of a process that nobody has told of yet. It is not repeated.
    early: Option<Command>,
}

/// The world's receiving ports, and the newest of all that came.
pub(super) struct Ears {
    counts: Counts,
    commands: Subscriber<Command>,
    planner: Subscriber<PlannerReport>,
    recorder: Subscriber<RecorderReport>,
    control: Server<ControlRequest, ControlReply>,
    tables: Tables<ConstraintTable>,
    schedules: Option<Tables<Schedule>>,
    robots: Vec<Robot>,
    report: Option<PlannerReport>,
    recorded: Option<RecorderReport>,
    requests: Vec<ControlRequest>,
    /// What is answered once the tick that takes it is safe.
    replies: Vec<(Question<ControlRequest, ControlReply>, ControlReply)>,
    lost_commands: u64,
}

impl Ears {
    /// Those of a world that has just come to be, from the beginning or from its journal.
    pub(super) fn new(seat: &Seat, world: &World) -> Result<Self, RoleError> {
        let (topics, node) = (&seat.topics, &seat.node);
        let schedules = topics.schedule_service(node, Access::Open)?;
        let schedules = schedules.map(|service| Tables::new(&service, seat.counts()));
        let constraints = topics.constraints.service(node, Access::Open)?;
        let mut ears = Self {
            counts: seat.counts(),
            commands: topics.command.service(node, Access::Open)?.subscriber()?,
            planner: topics.planner.service(node, Access::Open)?.subscriber()?,
            recorder: topics.recorder.service(node, Access::Open)?.subscriber()?,
            control: topics.control.service(node, Access::Open)?.server()?,
            tables: Tables::new(&constraints, seat.counts())?,
            schedules: schedules.transpose()?,
            robots: Vec::with_capacity(seat.run.room().robots as usize),
            report: None,
            recorded: None,
            requests: Vec::with_capacity(MOST_REQUESTS),
            replies: Vec::with_capacity(MOST_REQUESTS),
            lost_commands: 0,
        };
        ears.know_robots(world);
        Ok(ears)
    }

    /// Listens to all robots there are.
    fn know_robots(&mut self, world: &World) {
        for robot in self.robots.len()..world.robots() {
            self.robots.push(Robot {
                incarnation: world.incarnation(robot),
                ..Robot::default()
            });
        }
    }

    /// Takes in all that has come.
    pub(super) fn listen(
        &mut self,
        seat: &Seat,
        world: &World,
        changes: &mut Changes,
    ) -> Result<(), RoleError> {
        while let Some(command) = self.commands.receive()? {
            self.hear(&command);
        }
        if let Some(report) = self.planner.receive()?
            && report.validate(self.counts).is_ok()
        {
            self.report = Some(*report);
        }
        self.tables.receive(0)?;
        if let Some(schedules) = &mut self.schedules {
            schedules.receive(0)?;
        }
        if let Some(report) = self.recorder.receive()?
            && report.validate(self.counts).is_ok()
        {
            self.recorded = Some(*report);
        }
        while self.requests.len() < MOST_REQUESTS
            && let Some(request) = self.control.receive()?
        {
            let result = self.obey(seat, &request, world, changes);
            let words = result.as_ref().map(|tick| *tick).map_err(String::as_str);
            let reply = ControlReply::new(request.id, words);
            // The supervisor asks again until it sees that it is so; and asks more than can be held.
            let is_users =
                self.of_a_process(&request).is_none() && request.kind != ControlKind::Stop.code();
            if result.is_ok() && is_users && self.replies.len() < MOST_REQUESTS {
                self.replies.push((request, reply));
            } else {
                request.answer(reply)?;
            }
        }
        Ok(())
    }

    /// Answers what the tick just made has taken: it will not be forgotten any more.
    pub(super) fn reply(&mut self) -> Result<(), RoleError> {
        for (request, reply) in self.replies.drain(..) {
            request.answer(reply)?;
        }
        Ok(())
    }

    fn hear(&mut self, command: &Command) {
        if command.validate(self.counts).is_err() {
            self.lost_commands += 1;
            return;
        }
        let robot = &mut self.robots[command.robot as usize];
        if command.incarnation > robot.incarnation {
            robot.early = Some(*command);
            return;
        }
        let newer = command.sequence > robot.command.sequence;
        if command.incarnation != robot.incarnation || (robot.heard && !newer) {
            return;
        }
        if robot.heard {
            let lost = command.sequence - robot.command.sequence - 1;
            self.lost_commands = self.lost_commands.saturating_add(lost);
        }
        robot.heard = true;
        robot.command = *command;
    }

    /// Notes what the next step is told, and who takes part from then on: the tick that it holds
    /// from, or why it does not.
    fn obey(
        &mut self,
        seat: &Seat,
        request: &ControlRequest,
        world: &World,
        changes: &mut Changes,
    ) -> Result<u64, String> {
        if let Some(robot) = self.of_a_process(request)
            && request.incarnation >= robot.incarnation
        {
            robot.gone = request.kind == ControlKind::Down.code();
        }
        if (self.requests.iter()).any(|waiting| is_same(waiting, request)) {
            return Ok(world.tick() + 1);
        }
        let tick = world.reply_to(request).result()?;
        if request.kind == ControlKind::Change.code() {
            let asked = changes_of(request.changes());
            let asked = asked.ok_or("this version of the program knows no such change")?;
            // The scene says more clearly than the message what is out of range.
            return changes.ask(seat, world, tick - 1, &asked);
        }
        request
            .validate(self.counts)
            .map_err(|invalid| invalid.to_string())?;
        self.requests.push(*request);
        if let Some(robot) = self.of_a_process(request)
            && request.incarnation > robot.incarnation
        {
            robot.incarnation = request.incarnation;
            let early = (robot.early.take()).filter(|early| early.incarnation == robot.incarnation);
            robot.heard = early.is_some();
            robot.command = early.unwrap_or(robot.command);
        }
        Ok(tick)
    }

    /// The robot that a request says something of the process of. What users say has no number of
    /// a process.
    fn of_a_process(&mut self, request: &ControlRequest) -> Option<&mut Robot> {
        let kinds = [ControlKind::Up, ControlKind::Down, ControlKind::Standby];
        let is_one = kinds.iter().any(|kind| kind.code() == request.kind)
            && request.role == RoleKind::Robot.code()
            && request.incarnation > 0;
        let robot = self.robots.get_mut(request.index as usize);
        robot.filter(|_| is_one)
    }

    /// Does what the run was given for this tick.
    ///
    /// # Errors
    /// Why it does not.
    pub(super) fn obey_timed(
        &mut self,
        seat: &Seat,
        told: &Told,
        world: &World,
        changes: &mut Changes,
    ) -> Result<u64, String> {
        let request = match told {
            Told::Change(asked) => {
                let tick = world.reply_to(&ControlRequest {
                    kind: ControlKind::Change.code(),
                    ..ControlRequest::default()
                });
                return changes.ask(seat, world, tick.result()? - 1, asked);
            }
            Told::Lose(robot) => take_part(ControlKind::Down, *robot),
            Told::Back(robot) => take_part(ControlKind::Up, *robot),
        };
        self.obey(seat, &request, world, changes)
    }

    /// Another version of the scene is in force.
    pub(super) fn recount(&mut self, counts: Counts, world: &World) {
        self.counts = counts;
        self.know_robots(world);
        self.tables.recount(counts);
        if let Some(schedules) = &mut self.schedules {
            schedules.recount(counts);
        }
    }

    /// Whether every participant has answered `tick`. A robot that takes part no more has, too, as
    /// long as there is a process of it: so that it may take part again, and is where the others
    /// are then.
    pub(super) fn have_answered(&self, tick: u64) -> bool {
        let robots = self
            .robots
            .iter()
            .all(|robot| robot.gone || (robot.heard && robot.command.tick >= tick));
        let planner = self.report.is_some_and(|report| report.tick >= tick);
        let recorder = self
            .recorded
            .is_some_and(|report| tick < report.next_sequence.saturating_add(MOTION_WINDOW));
        // Nobody has answered the first tick before it has said so.
        robots && planner && recorder
    }

    /// How far the recorder has come.
    pub(super) const fn recorded(&self) -> Option<&RecorderReport> {
        self.recorded.as_ref()
    }

    /// Whether somebody has asked for the end.
    pub(super) fn stop_is_asked(&self) -> bool {
        let stop = ControlKind::Stop.code();
        self.requests.iter().any(|request| request.kind == stop)
    }

    /// Hands over the requests of control that the next step is told.
    pub(super) fn take_control(&mut self, requests: &mut Vec<ControlRequest>) {
        requests.clear();
        requests.append(&mut self.requests);
    }

    /// The newest command of each robot.
    pub(super) fn commands<'a>(
        &'a self,
        commands: &mut [Option<Checked<'a, Command>>; MAX_ROBOTS],
    ) -> Result<(), RoleError> {
        for (place, robot) in commands.iter_mut().zip(&self.robots) {
            if robot.heard {
                let command = Checked::new(&robot.command, self.counts);
                *place = Some(command.map_err(refused("command"))?);
            }
        }
        Ok(())
    }

    /// The planner's newest report.
    pub(super) fn report(&self) -> Result<Option<Checked<'_, PlannerReport>>, RoleError> {
        let report = self.report.as_ref();
        report
            .map(|report| Checked::new(report, self.counts).map_err(refused("planner")))
            .transpose()
    }

    /// The newest constraint table, if it is a legal one.
    pub(super) fn table(&self) -> Option<Checked<'_, ConstraintTable>> {
        self.tables.newest()?.checked().ok()
    }

    /// The newest schedule.
    pub(super) fn schedule(&self) -> Option<PublishedSchedule<'_>> {
        let newest = self.schedules.as_ref()?.newest()?;
        Some((newest.version(), newest.checked().ok()))
    }

    /// Commands that never came, or were no legal ones.
    pub(super) const fn lost_commands(&self) -> u64 {
        self.lost_commands
    }
}

/// Whether two requests ask for the same of the same process.
fn is_same(one: &ControlRequest, other: &ControlRequest) -> bool {
    let of = |request: &ControlRequest| {
        let ControlRequest {
            kind,
            role,
            index,
            incarnation,
            ..
        } = *request;
        (kind, role, index, incarnation)
    };
    one.incarnation > 0 && of(one) == of(other)
}
