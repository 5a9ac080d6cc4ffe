//! The planner service's step machine: hard constraints on request, or all of them at every
//! event.
//!
//! Responsible for: the queue of requests, when which tests are made (the table before rule 23),
//! versions of the constraint table, answers; for methods that plan ahead, when a schedule is
//! published.
//! Not responsible for: the tests (`hard`), how messages travel (crate `node`).
//!
//! A request is known by its robot, incarnation and failure id: asked again while it waits or is
//! worked on, it is taken once; asked again after that, it gets the same answer once more, at
//! no cost.

use std::task::Poll;

use scene::{Budget, Method, Scene, Settings};
use shm_types::capacity::MAX_CONSTRAINTS;
use shm_types::{
    Checked, ConstraintTable, Counters, HardAnswer, HardRequest, PlannerReport, Schedule,
    StateHash, TaskStatus, Verdict, WorldSnapshot, zeroed,
};

use crate::anytime::{Anytime, Standing};
use crate::hard::{Found, HardConstraints};
use crate::places::Places;
use crate::rollout::BeginRollout;

/// What one step of the planner is given.
#[derive(Clone, Copy)]
pub struct PlannerInput<'a> {
    /// Snapshot of this tick.
    pub snapshot: Checked<'a, WorldSnapshot>,
    /// Requests stamped before this tick, in the order of robots.
    pub requests: &'a [HardRequest],
}

/// What one step of the planner gives.
pub struct PlannerOutput<'a> {
    /// Its report to the world. Its incarnation is left to the shell.
    pub report: PlannerReport,
    /// Answers, to be seen in the next tick.
    pub answers: &'a [HardAnswer],
    /// A new version of the table, to be seen in the next tick, or now and then the newest again.
    pub table: Option<&'a ConstraintTable>,
    /// The same of the schedule. Only of methods that plan ahead.
    pub schedule: Option<&'a Schedule>,
}

/// Ticks after which a schedule that is not in force was refused.
const TICKS_TO_ADOPT: u64 = 10;

/// Ticks after which the newest table and schedule are published once more, for those whom they
/// have not reached.
const TICKS_TO_REPEAT: u64 = 100;

/// Versions that one planner process can publish before the next one starts above them.
const VERSIONS: u32 = 1 << 16;
/// Planner processes whose versions are told apart so.
const MOST_PROCESSES: u32 = (1 << 15) - 1;

/// What is being worked on.
#[derive(Clone, Copy, Debug)]
enum Job {
    /// The pairs of a failed task.
    Task(HardRequest),
    /// The same of one that failed before this process began.
    Again(usize),
    /// All pairs, for the snapshot with this number of events.
    All { events: u64 },
}

/// The planner service.
pub struct Planner {
    settings: Settings,
    /// Tick of the newest snapshot seen.
    tick: u64,
    method: Method,
    tasks: usize,
    hard: HardConstraints,
    /// Requests that wait, oldest first, at most one a robot.
    queue: Vec<HardRequest>,
    /// Tasks whose constraints an earlier process had found.
    lost: Vec<usize>,
    job: Option<Job>,
    /// The newest answer to each robot.
    answered: Vec<Option<HardAnswer>>,
    /// Answers of this step.
    answers: Vec<HardAnswer>,
    table: Box<ConstraintTable>,
    /// The table has to be published anew, whatever is found.
    is_stale: bool,
    /// It has been published as it is.
    is_published: bool,
    /// Constraints it has no room for.
    dropped: u32,
    /// The schedule of a method that plans ahead, once there is one.
    schedule: Option<Box<Schedule>>,
    /// Its version when it was published last; 0 if it never was.
    schedule_version: u32,
    /// It is to be published as it is.
    repeats: bool,
    /// What is published has versions past this one: a planner before may have published some
    /// that are not in force yet.
    versions_past: u32,
    /// Version of the scene that all of this is about.
    scene_version: u32,
    /// Who makes it.
    anytime: Option<Anytime>,
    /// How planning ahead stands.
    standing: Standing,
    counters: Counters,
    /// Everything decided so far, in order.
    journal: StateHash,
}

impl Planner {
    /// A planner with nothing to do yet; all memory it will ever use is allocated here.
    #[must_use]
    pub fn new(scene: &Scene, settings: Settings) -> Self {
        let (robots, tasks) = (scene.homes.len(), scene.objects.len());
        let mut table = zeroed::<ConstraintTable>();
        table.complete_for_events = u64::MAX;
        Self {
            settings: settings.clone(),
            tick: 0,
            method: settings.method,
            tasks,
            hard: HardConstraints::new(scene, &settings),
            queue: Vec::with_capacity(robots),
            lost: Vec::with_capacity(tasks),
            job: None,
            answered: vec![None; robots],
            // The old answer again, that of a job for the robot's last life, and the new one.
            answers: Vec::with_capacity(3 * robots),
            table,
            is_stale: false,
            is_published: false,
            dropped: 0,
            schedule: settings.method.plans_ahead().then(zeroed),
            schedule_version: 0,
            repeats: false,
            versions_past: 0,
            scene_version: 0,
            anytime: (settings.method.plans_ahead()).then(|| Anytime::new(&settings)),
            standing: Standing::Idle(Verdict::Open),
            counters: Counters::default(),
            journal: StateHash::new(),
        }
    }

    /// A planner in the place of one that is gone, as process `incarnation`, from 1. Nothing it
    /// makes has a version that one before it has used. `published` is the newest schedule of those
    /// before, if it is at hand: it is published once more, for robots that are started now, and
    /// robots are left to it if it is all of a plan for the version of the scene in force, `scene`.
    #[must_use]
    pub fn succeeding(
        scene: &Scene,
        settings: Settings,
        incarnation: u32,
        published: Option<&Schedule>,
    ) -> Self {
        let versions_past = incarnation.saturating_sub(1).min(MOST_PROCESSES) * VERSIONS;
        let mut planner = Self {
            versions_past,
            ..Self::new(scene, settings)
        };
        if let (Some(own), Some(published)) = (&mut planner.schedule, published) {
            own.copy_from(published);
            planner.schedule_version = published.version;
            planner.scene_version = published.scene_version;
            planner.repeats = true;
            if let Some(anytime) = &mut planner.anytime {
                anytime.inherit(published);
            }
        }
        planner
    }

    /// A planner whose plan is made already: it publishes `schedule` in its first step, numbered
    /// and dated as is due then.
    #[must_use]
    pub fn with_schedule(scene: &Scene, settings: Settings, schedule: Box<Schedule>) -> Self {
        Self {
            schedule: Some(schedule),
            anytime: None,
            standing: Standing::Written,
            ..Self::new(scene, settings)
        }
    }

    /// The same planner, which begins with what runs of the paper's methods come to if that is better
    /// than its own first plan. Only of methods that plan ahead.
    #[must_use]
    pub fn with_rollouts(self, begin: BeginRollout) -> Self {
        Self {
            anytime: self.anytime.map(|anytime| anytime.with_rollouts(begin)),
            ..self
        }
    }

    /// One step: takes in the requests, then works for at most `units`. On a snapshot older than
    /// the newest seen it does no work.
    pub fn step(&mut self, scene: &Scene, input: PlannerInput, units: u64) -> PlannerOutput<'_> {
        let header = &input.snapshot.header;
        if header.tick < self.tick {
            self.answers.clear();
            for request in input.requests {
                self.take(*request);
            }
            return PlannerOutput {
                report: self.report(input.snapshot),
                answers: &self.answers,
                table: None,
                schedule: None,
            };
        }
        self.tick = header.tick;
        if header.scene_version != self.scene_version {
            self.enter(scene, input.snapshot);
        }
        if header.constraints_version > self.table.version {
            // A planner that was started again goes on where the one before it stopped counting.
            self.table.version = header.constraints_version;
            self.recover(input.snapshot);
        }
        self.answers.clear();
        for request in input.requests {
            self.take(*request);
        }
        let repeated = self.answers.len();
        let mut budget = Budget::new(units);
        let plans_ahead = self.method.plans_ahead();
        let found = !plans_ahead && self.work(scene, input.snapshot, &mut budget);
        let publish = std::mem::take(&mut self.is_stale) || found;
        let reschedule = plans_ahead && self.plan_ahead(scene, input.snapshot, &mut budget);
        self.counters.units += budget.spent();
        if publish {
            self.write_table(header.tick + 1);
        }
        for answer in &mut self.answers[repeated..] {
            answer.constraints_version = self.table.version;
            self.answered[answer.robot as usize] = Some(*answer);
            self.journal.add(answer);
        }
        let is_due = header.tick.is_multiple_of(TICKS_TO_REPEAT);
        let repeat_table = is_due && self.is_published;
        let repeat_schedule = is_due && self.schedule_version > 0 || self.repeats;
        self.repeats = false;
        self.is_published |= publish;
        PlannerOutput {
            report: self.report(input.snapshot),
            answers: &self.answers,
            table: (publish || repeat_table).then_some(&*self.table),
            schedule: (self.schedule.as_deref()).filter(|_| reschedule || repeat_schedule),
        }
    }

    /// The table as last published; version 0 before that.
    #[must_use]
    pub fn table(&self) -> &ConstraintTable {
        &self.table
    }

    /// Goes on planning ahead. Whether a schedule is to be published: it is numbered and dated.
    fn plan_ahead(
        &mut self,
        scene: &Scene,
        snapshot: Checked<WorldSnapshot>,
        budget: &mut Budget,
    ) -> bool {
        let header = &snapshot.header;
        let Some(schedule) = self.schedule.as_deref_mut() else {
            return false;
        };
        let in_force = header.schedule_version;
        let is_due = match &mut self.anytime {
            None => self.standing == Standing::Written && in_force == 0,
            Some(anytime) if self.schedule_version <= in_force => {
                // One that was started again may not know what robots follow.
                let is_known = self.schedule_version == in_force;
                if !is_known {
                    anytime.replan(snapshot);
                }
                is_known && anytime.list_more(snapshot.robots(), schedule) || {
                    let counters = &mut self.counters;
                    self.standing = anytime.advance(scene, snapshot, budget, counters, schedule);
                    self.standing == Standing::Written
                }
            }
            Some(anytime) => {
                let is_late = header.tick > schedule.effect_tick + TICKS_TO_ADOPT;
                if is_late {
                    anytime.take_back(snapshot, schedule);
                }
                is_late
            }
        };
        if !is_due {
            return false;
        }
        self.standing = Standing::Idle(Verdict::Open);
        let last = in_force.max(self.schedule_version);
        schedule.version = last.max(self.versions_past) + 1;
        schedule.effect_tick = header.tick + 1;
        schedule.scene_version = self.scene_version;
        self.schedule_version = schedule.version;
        schedule.hash_into(&mut self.journal);
        true
    }

    /// Everything is about another version of the scene from here on. What was found of the one
    /// before may not be true any more, so the next table is without it, and plans are made anew.
    fn enter(&mut self, scene: &Scene, snapshot: Checked<WorldSnapshot>) {
        let settings = self.settings.clone();
        *self = Self {
            answered: std::mem::take(&mut self.answered),
            table: std::mem::replace(&mut self.table, zeroed()),
            schedule: self.schedule.take(),
            schedule_version: self.schedule_version,
            versions_past: self.versions_past,
            scene_version: snapshot.header.scene_version,
            tick: self.tick,
            anytime: self.anytime.take(),
            standing: self.standing,
            counters: self.counters,
            journal: self.journal.clone(),
            is_stale: !self.method.plans_ahead(),
            ..Self::new(scene, settings)
        };
        self.table.complete_for_events = u64::MAX;
        self.answered.resize(scene.homes.len(), None);
        if let Some(anytime) = &mut self.anytime {
            anytime.replan(snapshot);
        }
    }

    /// Begins to find again what an earlier process of the planner had found, of the tasks that have
    /// failed since. Who starts now cannot get its table, and waits: so there is another in any
    /// case.
    fn recover(&mut self, snapshot: Checked<WorldSnapshot>) {
        let objects = snapshot.objects().iter().enumerate();
        let open = objects.filter(|(_, object)| object.status != TaskStatus::Done.code());
        let failed = open.filter(|(_, object)| object.failures > 0);
        self.lost.clear();
        if self.method.restricts() {
            self.lost.extend(failed.map(|(task, _)| task));
        }
        self.is_stale = self.lost.is_empty() && !self.method.plans_ahead();
    }

    /// Takes a request in: into the queue, unless it is there, was answered, or makes no sense.
    fn take(&mut self, request: HardRequest) {
        let robot = request.robot as usize;
        if robot >= self.answered.len() || request.task as usize >= self.tasks {
            return;
        }
        if let Some(answer) = self.answered[robot]
            && (answer.incarnation, answer.failure) == (request.incarnation, request.failure)
        {
            if self
                .answers
                .iter()
                .all(|other| other.robot != request.robot)
            {
                self.answers.push(answer);
            }
            return;
        }
        if let Some(Job::Task(job)) = self.job
            && is_same(&job, &request)
        {
            return;
        }
        match self
            .queue
            .iter_mut()
            .find(|waiting| waiting.robot == request.robot)
        {
            Some(waiting) if is_same(waiting, &request) => {}
            Some(waiting) => *waiting = request,
            None => self.queue.push(request),
        }
    }

    /// Works until there is nothing to do or the budget is spent. Whether a new version of the
    /// table is due.
    fn work(
        &mut self,
        scene: &Scene,
        snapshot: Checked<WorldSnapshot>,
        budget: &mut Budget,
    ) -> bool {
        let mut publish = false;
        loop {
            if self.is_outdated(snapshot) {
                self.job = None;
            }
            if self.job.is_none() {
                publish |= self.look(snapshot);
                self.job = self.next_job(scene, snapshot);
            }
            let Some(job) = self.job else {
                return publish;
            };
            let Poll::Ready(found) = self.advance(scene, job, budget) else {
                return publish;
            };
            publish |= self.finish(job, found, snapshot.header.tick);
            self.job = None;
        }
    }

    /// Takes over where the objects are. Whether constraints were lost that the table still has.
    fn look(&mut self, snapshot: Checked<WorldSnapshot>) -> bool {
        let lost = self.hard.update(open_places(snapshot));
        if lost && self.method == Method::All {
            self.table.complete_for_events = u64::MAX;
        }
        lost && self.method != Method::All
    }

    /// Whether the job is about a state of the world that is past.
    fn is_outdated(&self, snapshot: Checked<WorldSnapshot>) -> bool {
        matches!(self.job, Some(Job::All { events }) if events != snapshot.header.events)
    }

    fn next_job(&mut self, scene: &Scene, snapshot: Checked<WorldSnapshot>) -> Option<Job> {
        let events = snapshot.header.events;
        if self.method == Method::All && self.table.complete_for_events != events {
            self.hard.begin_all();
            return Some(Job::All { events });
        }
        if let Some(task) = self.lost.pop() {
            self.hard.begin_task(scene, task);
            return Some(Job::Again(task));
        }
        if self.queue.is_empty() {
            return None;
        }
        let request = self.queue.remove(0);
        if self.method.restricts() {
            self.hard.begin_task(scene, request.task as usize);
        }
        Some(Job::Task(request))
    }

    fn advance(&mut self, scene: &Scene, job: Job, budget: &mut Budget) -> Poll<Found> {
        if matches!(job, Job::Task(_)) && !self.method.restricts() {
            // Nothing follows from a failure.
            return Poll::Ready(Found::default());
        }
        self.hard.advance(scene, budget, &mut self.counters)
    }

    /// Notes what a job has found. Whether that makes a new version of the table.
    fn finish(&mut self, job: Job, found: Found, tick: u64) -> bool {
        match job {
            Job::All { events } => {
                self.table.complete_for_events = events;
                true
            }
            Job::Again(_) => self.lost.is_empty(),
            Job::Task(request) => {
                self.answers.push(HardAnswer {
                    robot: request.robot,
                    incarnation: request.incarnation,
                    failure: request.failure,
                    task: request.task,
                    tick,
                    constraints_version: 0,
                    found: found.new,
                    infeasible: u32::from(found.infeasible),
                    reserved: 0,
                });
                found.new > 0
            }
        }
    }

    /// Writes the next version of the table: all that is known now.
    fn write_table(&mut self, effect_tick: u64) {
        let Self {
            hard,
            table,
            dropped,
            versions_past,
            ..
        } = self;
        table.version = table.version.max(*versions_past) + 1;
        table.effect_tick = effect_tick;
        let mut count = 0;
        hard.for_each(|constraint| {
            if let Some(slot) = table.constraints.get_mut(count) {
                *slot = constraint;
            }
            count += 1;
        });
        table.count = count.min(MAX_CONSTRAINTS) as u32;
        *dropped = count.saturating_sub(MAX_CONSTRAINTS) as u32;
        self.table.hash_into(&mut self.journal);
    }

    fn report(&self, snapshot: Checked<WorldSnapshot>) -> PlannerReport {
        let outstanding =
            self.method == Method::All && self.table.complete_for_events != snapshot.header.events;
        PlannerReport {
            tick: self.tick,
            state_hash: self.state_hash(),
            constraints_version: self.table.version,
            schedule_version: self.schedule_version,
            busy: u32::from(
                self.job.is_some()
                    || !self.queue.is_empty()
                    || !self.lost.is_empty()
                    || outstanding
                    || self.standing == Standing::Busy,
            ),
            verdict: match self.standing {
                Standing::Idle(verdict) => verdict.code(),
                Standing::Busy | Standing::Written => Verdict::Open.code(),
            },
            constraints_dropped: self.dropped,
            counters: self.counters,
            ..PlannerReport::default()
        }
    }

    /// Hash of all that is private: what was decided and what waits. How far the job has come
    /// shows in the work done.
    fn state_hash(&self) -> u64 {
        let mut hash = self.journal.clone();
        hash.add(&self.queue[..]);
        match self.job {
            None => {}
            Some(Job::Task(request)) => hash.add(&request),
            Some(Job::Again(task)) => hash.add(&(task as u64)),
            Some(Job::All { events }) => hash.add(&events),
        }
        hash.add(&self.counters);
        hash.finish()
    }
}

fn is_same(a: &HardRequest, b: &HardRequest) -> bool {
    (a.incarnation, a.failure) == (b.incarnation, b.failure)
}

fn open_places(snapshot: Checked<WorldSnapshot>) -> impl Iterator<Item = Option<Places>> {
    snapshot.get().objects[..snapshot.header.object_count as usize]
        .iter()
        .map(|object| Places::of(object, object.status))
}
