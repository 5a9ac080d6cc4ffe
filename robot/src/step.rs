//! One step of a robot: from a snapshot to a command.
//!
//! Responsible for: the order of things within a step, and what a restarted robot takes up.
//! Not responsible for: what happens in a phase (one file each).

use scene::{Budget, Scene, Settings};
use shm_types::{
    Checked, Command, ConstraintTable, Counters, Failure, HardAnswer, HardRequest,
    Phase as WirePhase, Schedule, StateHash, WorldSnapshot,
};

use crate::account::{Doing, Thinking};
use crate::follow::Follower;
use crate::intent::Intent;
use crate::now::Now;
use crate::phase::{Next, Phase};
use crate::select::{self, Selecting};
use crate::{home, release, transfer, transit};

/// What a robot sees in one tick.
#[derive(Clone, Copy)]
pub struct RobotInput<'a> {
    /// The newest snapshot.
    pub snapshot: Checked<'a, WorldSnapshot>,
    /// The table of version `epoch_constraints_version` of that snapshot; for 0 an empty one.
    /// With any other version the robot waits before it selects.
    pub table: Checked<'a, ConstraintTable>,
    /// The schedule of version `schedule_version` of that snapshot, if there is one and it is at
    /// hand.
    pub schedule: Option<Checked<'a, Schedule>>,
    /// The planner's newest answer to this robot.
    pub answer: Option<HardAnswer>,
}

/// One robot.
pub struct Robot {
    id: usize,
    incarnation: u32,
    /// Tick of the newest snapshot seen.
    tick: u64,
    command_valid_ticks: u64,
    mind: Mind,
    intent: Intent,
    hash: StateHash,
}

/// What decides.
enum Mind {
    /// It selects tasks, and plans for itself.
    Selects(Box<Selector>),
    /// It follows the planner service's schedule.
    Follows(Follower),
}

/// A robot that selects.
struct Selector {
    phase: Phase,
    thinking: Thinking,
}

impl Robot {
    /// Robot `id` of the scene, as process `incarnation`. What it is in the middle of it takes
    /// from the first snapshot. All memory it will ever use is allocated here.
    #[must_use]
    pub fn new(scene: &Scene, settings: Settings, id: usize, incarnation: u32) -> Self {
        Self {
            id,
            incarnation,
            tick: 0,
            command_valid_ticks: settings.command_valid_ticks,
            mind: if settings.method.plans_ahead() {
                Mind::Follows(Follower::new(&settings))
            } else {
                Mind::Selects(Box::new(Selector {
                    phase: Phase::Starting,
                    thinking: Thinking::new(scene, settings),
                }))
            },
            intent: Intent::new(),
            hash: StateHash::new(),
        }
    }

    /// Goes on in another version of the scene. One that selects forgets what it was about: the
    /// world has taken its path and its claim back, and it looks again.
    pub fn enter(&mut self, scene: &Scene) {
        let Mind::Selects(selector) = &mut self.mind else {
            return;
        };
        let thinking = &selector.thinking;
        let (settings, counters) = (thinking.settings.clone(), thinking.counters);
        **selector = Selector {
            phase: Phase::Starting,
            thinking: Thinking {
                counters,
                ..Thinking::new(scene, settings)
            },
        };
        self.intent.failure = Failure {
            id: self.intent.failure.id,
            ..Failure::default()
        };
        self.intent.selected_epoch = 0;
    }

    /// Answers one snapshot, within `units` of work. Writes the whole command, and returns what
    /// is to be asked of the planner. To one that is older than the newest seen there is nothing
    /// to say: the command stays as it was.
    pub fn step(
        &mut self,
        scene: &Scene,
        input: RobotInput<'_>,
        units: u64,
        out: &mut Command,
    ) -> Option<HardRequest> {
        if input.snapshot.header.tick < self.tick {
            return None;
        }
        self.tick = input.snapshot.header.tick;
        let now = Now {
            scene,
            snapshot: input.snapshot,
            table: input.table,
            schedule: input.schedule.map(Checked::get),
            answer: input.answer,
            id: self.id,
            incarnation: self.incarnation,
        };
        self.intent.hard_request = None;
        self.intent.sequence = self.intent.sequence.saturating_add(1);
        let (phase, doing) = match &mut self.mind {
            Mind::Selects(selector) => selector.act(&now, units, &mut self.intent),
            Mind::Follows(follower) => follower.act(&now, &mut self.intent),
        };
        self.write(&now, phase, doing, out);
        self.intent.hard_request
    }

    /// A cycle among the tasks that the newest selection found, each before the next and the last
    /// before the first; empty if there was none (rule 15).
    #[must_use]
    pub fn cycle(&self) -> &[usize] {
        match &self.mind {
            Mind::Selects(selector) => selector.thinking.selection.cycle(),
            Mind::Follows(_) => &[],
        }
    }

    fn write(&mut self, now: &Now<'_>, phase: WirePhase, doing: Doing, out: &mut Command) {
        let tick = now.snapshot.header.tick;
        *out = Command {
            robot: self.id as u32,
            incarnation: self.incarnation,
            sequence: self.intent.sequence,
            tick,
            valid_until_tick: tick + self.command_valid_ticks,
            settled_at_change: doing.settled_at_change,
            state_hash: self.state_hash(),
            phase: phase.code(),
            activity: doing.activity.code(),
            go: u32::from(doing.go),
            grip: doing.grip.code(),
            waits_for: self.intent.waits_for,
            claim: self.intent.claim,
            failure: self.intent.failure,
            path: *self.intent.asked.request(),
            counters: match &self.mind {
                Mind::Selects(selector) => selector.thinking.counters,
                Mind::Follows(_) => Counters::default(),
            },
        };
    }

    /// Hash of the private state: what the next step depends on beside its inputs.
    fn state_hash(&mut self) -> u64 {
        let hash = &mut self.hash;
        hash.reset();
        match &self.mind {
            Mind::Selects(selector) => {
                selector.phase.hash_into(hash);
                self.intent.hash_into(hash);
                selector.thinking.hash_into(hash);
            }
            Mind::Follows(follower) => {
                self.intent.hash_into(hash);
                follower.hash_into(hash);
            }
        }
        hash.finish()
    }
}

impl Selector {
    /// Goes from phase to phase until this tick's work is done or spent.
    fn act(&mut self, now: &Now<'_>, units: u64, intent: &mut Intent) -> (WirePhase, Doing) {
        self.thinking.budget = Budget::new(units);
        match now.holding() {
            None if now.epoch() != intent.selected_epoch => {
                self.phase = self.phase.reselect(now.is_gripping());
            }
            Some(task) if !self.phase.may_hold() => self.phase = carry(now, intent, task),
            _ => {}
        }
        let doing = loop {
            match self.next(now, intent) {
                Next::Enter(phase) => self.phase = phase,
                Next::Rest(phase, doing) => {
                    self.phase = phase;
                    break doing;
                }
            }
        };
        self.thinking.counters.units += self.thinking.budget.spent();
        (self.phase.wire(), doing)
    }

    /// What the present phase leads to.
    fn next(&mut self, now: &Now<'_>, intent: &mut Intent) -> Next {
        let thinking = &mut self.thinking;
        match self.phase {
            Phase::Starting => Next::Enter(take_up(now, intent)),
            Phase::Selecting(selecting) => selecting.act(now, thinking, intent),
            Phase::Idle => home::stay(now),
            Phase::Transit(trip) => transit::act(trip, now, thinking, intent),
            Phase::Grasping(grasping) => grasping.act(now, thinking, intent),
            Phase::Transfer(trip) => transfer::act(trip, now, thinking, intent),
            Phase::Releasing => release::act(now, intent),
            Phase::Failing(failing) => failing.act(now, thinking, intent),
            Phase::GoingHome(trip) => home::act(trip, now, thinking, intent),
        }
    }
}

/// What a robot that has just been started finds itself doing. Also numbers go on from what the
/// world has of an earlier process of this robot.
fn take_up(now: &Now<'_>, intent: &mut Intent) -> Phase {
    intent.take_up(now);
    match now.holding() {
        Some(task) => carry(now, intent, task),
        None => Phase::Selecting(Selecting::after(None)),
    }
}

/// A robot that finds itself holding an object brings it to its goal (rule 19).
fn carry(now: &Now<'_>, intent: &mut Intent, task: usize) -> Phase {
    intent.claim = select::claim(now, Some(task));
    transfer::begin(now, intent, task)
}
