//! The machines of one run, and their tick.
//!
//! Responsible for: stepping everyone in the fixed order, staging messages from tick to tick.
//! Not responsible for: anything a machine decides.

use std::borrow::Cow;
use std::ops::ControlFlow;

use planner::{Planner, PlannerInput};
use robot::{Robot, RobotInput};
use scene::{Change, Scene, Settings};
use shm_types::capacity::MAX_ROBOTS;
use shm_types::{
    Checked, Command, ConstraintTable, ControlKind, ControlRequest, Counters, Counts, HardAnswer,
    HardRequest, Invalid, MotionBatch, Outcome, PlannerReport, RoleKind, Schedule, Validate,
    WorldSnapshot, zeroed,
};
use world::{FIRST_INCARNATION, Guard, Next, NotMade, World, WorldInput};

use crate::report::{Cycle, RobotReport, SimReport};
use crate::rollout::rollout;
use crate::tables::Tables;

/// Watches a run: called after every tick with the snapshot it led to and the motion that led
/// there. `Break` stops the run, as an interruption would.
pub trait Observer {
    /// A tick is over.
    fn ticked(&mut self, snapshot: &WorldSnapshot, motion: &MotionBatch) -> ControlFlow<()>;
}

impl<F: FnMut(&WorldSnapshot, &MotionBatch) -> ControlFlow<()>> Observer for F {
    fn ticked(&mut self, snapshot: &WorldSnapshot, motion: &MotionBatch) -> ControlFlow<()> {
        self(snapshot, motion)
    }
}

/// Is told whose step begins, so that a caller with a clock can time the steps of each.
pub trait Probe {
    /// `who` is about to step.
    fn enter(&mut self, who: Participant);
    /// The tick is over.
    fn leave(&mut self);
}

/// Nobody times the steps.
impl Probe for () {
    fn enter(&mut self, _who: Participant) {}
    fn leave(&mut self) {}
}

/// Whoever steps in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Participant {
    /// The robot of this index.
    Robot(usize),
    /// The planner service.
    Planner,
    /// The world.
    World,
}

/// World, planner and robots of one run. After construction a tick allocates nothing.
pub struct Simulation<'s> {
    scene: Cow<'s, Scene>,
    settings: Settings,
    world: World,
    planner: Planner,
    robots: Vec<Robot>,
    snapshot: Box<WorldSnapshot>,
    motion: Box<MotionBatch>,
    /// The newest command of each robot.
    commands: Vec<Command>,
    /// The planner's newest report.
    report: PlannerReport,
    /// Requests stamped with the present tick, in robot order.
    asked: Vec<HardRequest>,
    /// Requests of the tick before: what the planner sees now.
    staged: Vec<HardRequest>,
    /// The planner's newest answer to each robot, as of the tick before.
    answers: Vec<Option<HardAnswer>>,
    /// Constraint tables that the planner has published.
    tables: Tables<ConstraintTable>,
    /// The table of version 0.
    empty: Box<ConstraintTable>,
    /// Schedules that it has published.
    schedules: Tables<Schedule>,
    /// What the world is told in the next step.
    control: Vec<ControlRequest>,
    control_id: u64,
    /// The version of the scene that the next step brings into force.
    next: Option<Next>,
}

impl Simulation<'static> {
    /// As [`Self::new`], with a scene of its own.
    pub(crate) fn owning(scene: Scene, settings: &Settings, run_id: u64) -> Self {
        Self::of(Cow::Owned(scene), settings, run_id)
    }
}

impl<'s> Simulation<'s> {
    /// A run of all the scene's robots, at tick 0. All memory it will ever use is allocated here.
    #[must_use]
    pub fn new(scene: &'s Scene, settings: &Settings, run_id: u64) -> Self {
        Self::of(Cow::Borrowed(scene), settings, run_id)
    }

    fn of(scene: Cow<'s, Scene>, settings: &Settings, run_id: u64) -> Self {
        let robots = scene.homes.len();
        let world = World::new(&scene, settings.clone(), run_id);
        let mut snapshot = zeroed();
        world.snapshot_into(&mut snapshot);
        Self {
            world,
            planner: Planner::new(&scene, settings.clone()).with_rollouts(rollout),
            robots: (0..robots)
                .map(|id| Robot::new(&scene, settings.clone(), id, FIRST_INCARNATION))
                .collect(),
            scene,
            snapshot,
            motion: zeroed(),
            commands: vec![Command::default(); robots],
            report: PlannerReport {
                incarnation: FIRST_INCARNATION,
                ..PlannerReport::default()
            },
            asked: Vec::with_capacity(robots),
            staged: Vec::with_capacity(robots),
            answers: vec![None; robots],
            tables: Tables::new(),
            empty: ConstraintTable::none(),
            schedules: Tables::new(),
            control: Vec::with_capacity(robots + 1),
            control_id: 0,
            next: None,
            settings: settings.clone(),
        }
    }

    /// Puts another planner in the place of the one there is: one whose plan is made already.
    #[must_use]
    pub fn with_planner(self, planner: Planner) -> Self {
        Self { planner, ..self }
    }

    /// The same with a world that makes all its checks but this one.
    #[must_use]
    pub fn without(self, guard: Guard) -> Self {
        Self {
            world: self.world.without(guard),
            ..self
        }
    }

    /// The newest snapshot.
    #[must_use]
    pub fn snapshot(&self) -> &WorldSnapshot {
        &self.snapshot
    }

    /// Motion and events of the tick that led to it.
    #[must_use]
    pub fn motion(&self) -> &MotionBatch {
        &self.motion
    }

    /// Work done by robots and planner so far.
    pub(crate) fn work(&self) -> Counters {
        let robots = self.commands.iter().map(|command| command.counters);
        self.report.counters + robots.sum()
    }

    /// How the run stands.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        self.world.outcome()
    }

    /// Ends the run with the next tick.
    pub fn stop(&mut self) {
        self.tell(ControlKind::Stop, RoleKind::World, 0, FIRST_INCARNATION);
    }

    /// Puts another process in the place of robot `id`'s. It takes part from the next tick on and
    /// knows only what the snapshots say.
    ///
    /// # Panics
    /// When there is no such robot.
    pub fn restart_robot(&mut self, id: usize) {
        let incarnation = self.commands[id].incarnation + 1;
        self.robots[id] = Robot::new(&self.scene, self.settings.clone(), id, incarnation);
        self.commands[id].incarnation = incarnation;
        self.answers[id] = None;
        self.staged.retain(|request| request.robot as usize != id);
        self.tell(ControlKind::Up, RoleKind::Robot, id, incarnation);
    }

    /// Robot `id` takes part no more: it stays where it is, with what it holds.
    ///
    /// # Panics
    /// When there is no such robot.
    pub fn lose_robot(&mut self, id: usize) {
        let incarnation = self.commands[id].incarnation;
        self.tell(ControlKind::Down, RoleKind::Robot, id, incarnation);
    }

    /// Puts another planner in the place of the one there is. It knows what the snapshots say, and
    /// the newest schedule.
    pub fn restart_planner(&mut self) {
        self.report.incarnation += 1;
        let published = self.schedules.newest().and_then(|(_, legal)| legal);
        self.planner = Planner::succeeding(
            &self.scene,
            self.settings.clone(),
            self.report.incarnation,
            published.map(Checked::get),
        )
        .with_rollouts(rollout);
    }

    /// Changes the scene, all of `changes` together: the tick whose snapshot is the first to show
    /// it.
    ///
    /// # Errors
    /// They cannot be made; nothing changes then.
    pub fn change(&mut self, changes: &[Change]) -> Result<u64, NotMade> {
        if self.next.is_some() {
            return Err(NotMade::Busy);
        }
        self.next = Some(self.world.prepare(&self.scene, changes)?);
        Ok(self.snapshot.header.tick + 1)
    }

    /// Lets a robot take part no more (`Down`), or again (`Up`): the tick whose snapshot is the
    /// first to show it.
    ///
    /// # Errors
    /// It cannot, in the world's words.
    pub fn take_part(&mut self, kind: ControlKind, robot: usize) -> Result<u64, String> {
        let request = ControlRequest {
            kind: kind.code(),
            role: RoleKind::Robot.code(),
            index: robot as u32,
            ..ControlRequest::default()
        };
        let tick = self.world.reply_to(&request).result()?;
        self.tell(kind, RoleKind::Robot, robot, 0);
        Ok(tick)
    }

    /// The newest messages: commands, the planner's report, the newest table and schedule.
    #[must_use]
    pub fn messages(
        &self,
    ) -> (
        &[Command],
        &PlannerReport,
        Option<&ConstraintTable>,
        Option<&Schedule>,
    ) {
        let table = self.tables.newest().and_then(|(_, table)| table);
        let schedule = self.schedules.newest().and_then(|(_, schedule)| schedule);
        (
            &self.commands,
            &self.report,
            table.map(Checked::get),
            schedule.map(Checked::get),
        )
    }

    /// The scene in force.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What the world knows beside its snapshot.
    #[must_use]
    pub const fn world(&self) -> &World {
        &self.world
    }

    fn tell(&mut self, kind: ControlKind, role: RoleKind, index: usize, incarnation: u32) {
        self.control_id += 1;
        self.control.push(ControlRequest {
            id: self.control_id,
            kind: kind.code(),
            role: role.code(),
            index: index as u32,
            incarnation,
            ..ControlRequest::default()
        });
    }

    /// Runs until there is an outcome.
    pub fn run(&mut self, observer: &mut dyn Observer) -> SimReport {
        while self.outcome() == Outcome::Running {
            self.tick();
            if observer.ticked(&self.snapshot, &self.motion).is_break() {
                self.stop();
            }
        }
        self.report()
    }

    /// One tick: everyone steps on the present snapshot, the world makes the next one.
    ///
    /// # Panics
    /// When a machine makes a message that is no valid one: that is a bug.
    pub fn tick(&mut self) -> &WorldSnapshot {
        self.tick_probed(&mut ())
    }

    /// As [`Self::tick`], telling `probe` who steps.
    ///
    /// # Panics
    /// As [`Self::tick`].
    pub fn tick_probed(&mut self, probe: &mut impl Probe) -> &WorldSnapshot {
        let units = self.settings.units_per_tick(self.snapshot.header.busy);
        self.step_robots(units, probe);
        probe.enter(Participant::Planner);
        self.step_planner(units);
        probe.enter(Participant::World);
        self.step_world();
        probe.leave();
        &self.snapshot
    }

    fn step_robots(&mut self, units: u64, probe: &mut impl Probe) {
        let counts = self.scene.counts();
        let snapshot = checked(&*self.snapshot, counts);
        // The empty one if it is not kept: who wants another sees that, and waits.
        let table = self
            .tables
            .version(snapshot.header.epoch_constraints_version)
            .unwrap_or_else(|| checked(&*self.empty, counts));
        let schedule = self.schedules.version(snapshot.header.schedule_version);
        self.asked.clear();
        for (id, robot) in self.robots.iter_mut().enumerate() {
            probe.enter(Participant::Robot(id));
            let input = RobotInput {
                snapshot,
                table,
                schedule,
                answer: self.answers[id],
            };
            let asked = robot.step(&self.scene, input, units, &mut self.commands[id]);
            self.asked.extend(asked);
        }
    }

    fn step_planner(&mut self, units: u64) {
        let counts = self.scene.counts();
        let input = PlannerInput {
            snapshot: checked(&*self.snapshot, counts),
            requests: &self.staged,
        };
        let output = self.planner.step(&self.scene, input, units);
        self.report = PlannerReport {
            incarnation: self.report.incarnation,
            ..output.report
        };
        for answer in output.answers {
            self.answers[answer.robot as usize] = Some(*answer);
        }
        let header = &self.snapshot.header;
        if let Some(table) = output.table {
            let in_force = header.epoch_constraints_version;
            self.tables
                .publish(checked(table, counts).get(), counts, in_force);
        }
        if let Some(schedule) = output.schedule {
            self.schedules
                .publish(schedule, counts, header.schedule_version);
        }
        std::mem::swap(&mut self.asked, &mut self.staged);
    }

    fn step_world(&mut self) {
        let counts = self.scene.counts();
        let mut commands = [None; MAX_ROBOTS];
        for (place, command) in commands.iter_mut().zip(&self.commands) {
            *place = Some(checked(command, counts));
        }
        let input = WorldInput {
            commands: &commands[..self.commands.len()],
            planner: Some(checked(&self.report, counts)),
            table: self.tables.newest().and_then(|(_, table)| table),
            schedule: self.schedules.newest(),
            control: &self.control,
            change: self.next.as_ref(),
        };
        self.world.step(&self.scene, input, &mut self.motion);
        self.control.clear();
        if let Some(next) = self.next.take() {
            self.scene = Cow::Owned(next.scene);
            for robot in &mut self.robots {
                robot.enter(&self.scene);
            }
            self.add_robots();
        }
        self.world.snapshot_into(&mut self.snapshot);
    }

    /// Makes machines for robots that the scene has got.
    fn add_robots(&mut self) {
        for id in self.robots.len()..self.scene.homes.len() {
            let settings = self.settings.clone();
            (self.robots).push(Robot::new(&self.scene, settings, id, FIRST_INCARNATION));
            self.commands.push(Command::default());
            self.answers.push(None);
        }
    }

    /// What the machines know now.
    #[must_use]
    pub fn report(&self) -> SimReport {
        let robots = self
            .commands
            .iter()
            .enumerate()
            .map(|(id, command)| RobotReport {
                times: *self.world.times(id),
                counters: command.counters,
            });
        SimReport {
            outcome: self.outcome(),
            verdict: self.world.verdict(),
            reason: self.reason(),
            ticks: self.snapshot.header.tick,
            time_ns: self.snapshot.header.time_ns,
            state_hash: self.world.state_hash(),
            world: *self.world.counters(),
            violation: self.world.violation(),
            refused: self.world.refused_schedule(),
            scene_version: self.world.scene_version(),
            robots: robots.collect(),
            planner: self.report.counters,
        }
    }

    fn reason(&self) -> Option<String> {
        let reason = self.world.reason(&self.scene)?;
        let cycle = self
            .robots
            .iter()
            .map(Robot::cycle)
            .find(|cycle| !cycle.is_empty());
        Some(match cycle {
            Some(cycle) => format!("{reason}; tasks wait for each other in a {}", Cycle(cycle)),
            None => reason,
        })
    }
}

/// A message made by a machine of this process.
pub(crate) fn checked<T: Validate>(message: &T, counts: Counts) -> Checked<'_, T> {
    Checked::new(message, counts).unwrap_or_else(|invalid| bug(invalid))
}

#[expect(clippy::panic, reason = "a machine of this process broke its contract")]
#[cold]
fn bug(invalid: Invalid) -> ! {
    panic!("a machine made an invalid message: {invalid}")
}
