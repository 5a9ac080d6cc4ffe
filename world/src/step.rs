//! One tick of the world, from commands to hash: the one place where the order is written.
//!
//! Responsible for: the machine, its inputs, the order within a step. Not responsible for: any of
//! the steps themselves.

use scene::{Scene, Settings};
use shm_types::{
    Checked, Command, ConstraintTable, ControlRequest, EventKind, MotionBatch, Outcome,
    PlannerReport, Verdict, WorldSnapshot,
};

use crate::accounts::{self, ActivityTimes, WorldCounters};
use crate::bars::Bars;
use crate::bodies::Bodies;
use crate::change::Next;
use crate::cleared::Cleared;
use crate::constraints::Constraints;
use crate::epoch::Epoch;
use crate::grants::{Grants, Surroundings};
use crate::guards::{Guard, Guards};
use crate::invariants::Violation;
use crate::journal::{Event, Journal};
use crate::motion::{self, Span};
use crate::objects::Objects;
use crate::parts::Saving;
use crate::schedules::{PublishedSchedule, Schedules};
use crate::settled::Overflow;
use crate::state::{Object, Robot};
use crate::track::Track;

/// What one step of the world takes in; by default nothing.
#[derive(Clone, Copy, Default)]
pub struct WorldInput<'a> {
    /// The newest command of each robot, by robot; `None` for one never heard of. A command seen
    /// before does no harm.
    pub commands: &'a [Option<Checked<'a, Command>>],
    /// The planner's newest report.
    pub planner: Option<Checked<'a, PlannerReport>>,
    /// The newest constraint table published.
    pub table: Option<Checked<'a, ConstraintTable>>,
    /// The newest schedule published.
    pub schedule: Option<PublishedSchedule<'a>>,
    /// Control requests since the last step, in the order of their arrival.
    pub control: &'a [ControlRequest],
    /// The version of the scene that is in force from this step on, as [`World::prepare`] made it
    /// since the last step. The only one that allocates.
    pub change: Option<&'a Next>,
}

/// The world's step machine. After construction a step allocates nothing.
pub struct World {
    pub(crate) settings: Settings,
    pub(crate) tick: u64,
    /// World time of `tick`, ns.
    pub(crate) time_ns: u64,
    /// Arc length of one tick at full speed, m.
    pub(crate) tick_m: f64,
    pub(crate) robots: Vec<Robot>,
    pub(crate) objects: Objects,
    pub(crate) bodies: Bodies,
    pub(crate) grants: Grants,
    /// The checks that are made: all of them.
    pub(crate) guards: Guards,
    pub(crate) bars: Bars,
    pub(crate) constraints: Constraints,
    pub(crate) epoch: Epoch,
    pub(crate) schedules: Schedules,
    /// Version of the scene in force.
    pub(crate) scene_version: u32,
    /// What the planner says of the run's end.
    pub(crate) verdict: Verdict,
    pub(crate) busy: u32,
    pub(crate) held: bool,
    pub(crate) stopped: bool,
    pub(crate) overflow: Option<Overflow>,
    pub(crate) settled_ticks: u32,
    pub(crate) outcome: Outcome,
    pub(crate) violation: Option<Violation>,
    pub(crate) counters: WorldCounters,
    /// What the invariants have looked at, by robot.
    pub(crate) cleared: Vec<Cleared>,
    /// What saving keeps from tick to tick.
    pub(crate) saving: Saving,
    /// The snapshot as it will be published.
    pub(crate) wire: Box<WorldSnapshot>,
}

impl World {
    /// The initial state: robots at home and taking part, objects at their starts, epoch 1.
    #[must_use]
    pub fn new(scene: &Scene, settings: Settings, run_id: u64) -> Self {
        let robots: Vec<Robot> = scene.homes.iter().map(|&h| Robot::at_home(h)).collect();
        let objects: Objects = scene
            .objects
            .iter()
            .map(|o| Object {
                kind: o.kind,
                ..Object::at_start(o.start, o.goal)
            })
            .collect();
        #[expect(clippy::cast_precision_loss, reason = "a tick is far below 2^53 ns")]
        let tick_m = scene.robot.speed_m_per_s * (settings.tick_ns as f64 * 1e-9);
        let mut wire: Box<WorldSnapshot> = shm_types::zeroed();
        wire.header.run_id = run_id;
        wire.header.scenario_hash = scene.hash;
        wire.header.generation = 1;
        let mut world = Self {
            tick: 0,
            time_ns: 0,
            tick_m,
            bodies: Bodies::new(scene),
            grants: Grants::new(robots.len(), tick_m),
            guards: Guards::default(),
            bars: Bars::new(robots.len(), objects.len()),
            constraints: Constraints::none(),
            epoch: Epoch::first(),
            schedules: Schedules::default(),
            scene_version: 0,
            verdict: Verdict::Open,
            busy: 0,
            held: false,
            stopped: false,
            overflow: None,
            settled_ticks: 0,
            outcome: Outcome::Running,
            violation: None,
            counters: WorldCounters::default(),
            cleared: vec![Cleared::nothing(); robots.len()],
            saving: Saving::default(),
            settings,
            robots,
            objects,
            wire,
        };
        world.write_wire();
        world.chain(None);
        world
    }

    /// Writes the present snapshot: every live field, unused grant points zero. Leaves
    /// `publish_stamp_ns` to the transport.
    pub fn snapshot_into(&self, out: &mut WorldSnapshot) {
        out.header = self.wire.header;
        let (robots, objects) = (self.robots.len(), self.objects.len());
        out.robots[..robots].copy_from_slice(&self.wire.robots[..robots]);
        out.objects[..objects].copy_from_slice(&self.wire.objects[..objects]);
    }

    /// Advances one tick, and writes all its motion and events to `motion`. Once the outcome is
    /// no longer [`Outcome::Running`] nothing changes any more and the batch stays empty.
    pub fn step(&mut self, scene: &Scene, input: WorldInput<'_>, motion: &mut MotionBatch) {
        let mut journal = Journal::begin(motion, self.tick, self.time_ns);
        if self.outcome != Outcome::Running {
            journal.finish(self.tick, self.time_ns);
            return;
        }
        if self.tick == 0 {
            journal.event(Event::new(EventKind::Started));
            journal.event(Event::new(EventKind::Epoch).value(self.epoch.number));
        }
        let planner = accounts::report(input.planner);
        let published = input.table.map(Checked::get);
        self.begin_tick();
        if let Some(next) = input.change {
            self.take_change(next, &mut journal);
        }
        let scene = input.change.map_or(scene, |next| &next.scene);
        self.take_control(input.control, &mut journal);
        self.take_commands(&input, published, &mut journal);
        self.adopt_constraints(published, &mut journal);
        self.count_failures(&mut journal);
        self.act(scene, &input, &mut journal);
        self.lift_bars_of_parked();
        self.open_epoch(&mut journal);
        self.watch(scene, &mut journal);
        let robots_compute = !self.settings.method.plans_ahead();
        self.busy = accounts::settle(
            &mut self.robots,
            planner,
            robots_compute,
            self.tick,
            self.held,
        );
        let rescheduled = self.adopt_schedule(input.schedule, &mut journal);
        self.end_tick(scene, planner, rescheduled, &mut journal);
        self.write_wire();
        self.chain(Some(&input));
    }

    fn begin_tick(&mut self) {
        for robot in &mut self.robots {
            robot.told = false;
            robot.moved = false;
            robot.gripped = false;
            robot.track = Track::still(robot.position);
            robot.granted_m = 0.0;
        }
    }

    /// Grips, grants and motion: all that takes world time.
    fn act(&mut self, scene: &Scene, input: &WorldInput<'_>, journal: &mut Journal<'_>) {
        let (start_ns, tick_ns) = (self.time_ns, self.settings.tick_ns);
        if !self.held {
            self.begin_grips(scene, journal);
        }
        self.take_requests(scene, input);
        if !self.held {
            let around = Surroundings {
                scene,
                bodies: &self.bodies,
                guards: self.guards,
            };
            self.counters.grants_refused += self.grants.extend(around, &mut self.robots, self.tick);
            let span = Span {
                start_ns,
                tick_ns,
                tick_m: self.tick_m,
            };
            motion::advance(scene, &mut self.robots, &mut self.objects, span, journal);
        }
        journal.set_time(start_ns + tick_ns);
        if !self.held {
            self.advance_grips(scene, journal);
        }
    }

    /// Checks the invariants; a broken one ends the run.
    fn watch(&mut self, scene: &Scene, journal: &mut Journal<'_>) {
        let is_watched = !self.guards.holds(Guard::Invariants, false);
        if is_watched && let Some(violation) = self.find_violation(scene) {
            self.counters.violations += 1;
            self.violation = Some(violation);
            journal.event(violation.event());
        }
        for robot in &mut self.robots {
            let mut leaving = robot.leaving;
            leaving.forget(|object| !self.bodies.is_around(scene, robot, object));
            robot.leaving = leaving;
        }
        self.counters.swept_tests = self.bodies.tests();
    }

    fn end_tick(
        &mut self,
        scene: &Scene,
        planner: Option<&PlannerReport>,
        rescheduled: bool,
        journal: &mut Journal<'_>,
    ) {
        let eventful = journal.is_eventful() || rescheduled;
        self.note_overflow(planner, journal);
        let said = planner.and_then(|report| Verdict::decode(report.verdict).ok());
        self.verdict = said.unwrap_or(self.verdict);
        let outcome = self.judge_outcome(scene, planner, eventful);
        if eventful {
            self.epoch.change += 1;
            self.epoch.changed_tick = self.tick + 1;
        }
        self.tick += 1;
        self.time_ns += self.settings.tick_ns;
        self.outcome = outcome;
        if outcome != Outcome::Running {
            let event = Event::new(EventKind::Ended);
            journal.event(event.value(u64::from(outcome.code())));
        }
        journal.finish(self.tick, self.time_ns);
    }

    fn note_overflow(&mut self, planner: Option<&PlannerReport>, journal: &Journal<'_>) {
        let dropped = planner.map_or(0, |report| report.constraints_dropped);
        let events = journal.overflowed().then_some(Overflow::Events);
        let constraints = (dropped > 0).then_some(Overflow::Constraints(dropped));
        self.overflow = self.overflow.or(events).or(constraints);
    }

    /// From the next step on `robot` moves with this share of its speed, from 0 to 1: for
    /// simulated faults. The robots of a run move as they should.
    ///
    /// # Panics
    /// When there is no such robot.
    pub fn set_drive(&mut self, robot: usize, share: f64) {
        self.robots[robot].drive = share.clamp(0.0, 1.0);
    }

    /// Number of the newest snapshot.
    #[must_use]
    pub const fn tick(&self) -> u64 {
        self.tick
    }

    /// How many robots there are.
    #[must_use]
    pub const fn robots(&self) -> usize {
        self.robots.len()
    }

    /// How the run stands.
    #[must_use]
    pub const fn outcome(&self) -> Outcome {
        self.outcome
    }

    /// Which process of `robot` is listened to.
    ///
    /// # Panics
    /// When there is no such robot.
    #[must_use]
    pub fn incarnation(&self, robot: usize) -> u32 {
        self.robots[robot].link.incarnation
    }

    /// How often the scene was changed.
    #[must_use]
    pub const fn scene_version(&self) -> u32 {
        self.scene_version
    }

    /// What the planner has said of the run's end.
    #[must_use]
    pub const fn verdict(&self) -> Verdict {
        self.verdict
    }

    /// What the world has counted so far.
    #[must_use]
    pub const fn counters(&self) -> &WorldCounters {
        &self.counters
    }

    /// Ticks of `robot` by activity (rule 24); they sum up to the ticks so far. Those before it was
    /// added count as idle.
    ///
    /// # Panics
    /// When there is no such robot.
    #[must_use]
    pub fn times(&self, robot: usize) -> &ActivityTimes {
        &self.robots[robot].times
    }

    /// The invariant that ended the run, if one did.
    #[must_use]
    pub const fn violation(&self) -> Option<Violation> {
        self.violation
    }

    /// The hash of everybody's state at every tick so far, chained.
    #[must_use]
    pub const fn state_hash(&self) -> u64 {
        self.wire.header.state_hash
    }
}
