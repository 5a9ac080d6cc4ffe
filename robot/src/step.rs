//! One step of a robot: from a snapshot to a command.
//!
//! Responsible for: the order of things within a step, and what a restarted robot takes up.
//! Not responsible for: what happens in a phase (one file each).

use scene::{Budget, Scene, Settings};
use shm_types::{
    Checked, Command, ConstraintTable, HardAnswer, HardRequest, StateHash, WorldSnapshot,
};

use crate::account::{Doing, Thinking};
use crate::intent::Intent;
use crate::now::Now;
use crate::phase::{Next, Phase};
use crate::request::Asked;
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
    /// The planner's newest answer to this robot.
    pub answer: Option<HardAnswer>,
}

/// One robot.
pub struct Robot {
    id: usize,
    incarnation: u32,
    phase: Phase,
    intent: Intent,
    thinking: Thinking,
    hash: StateHash,
}

impl Robot {
    /// Robot `id` of the scene, as process `incarnation`. What it is in the middle of it takes
    /// from the first snapshot. All memory it will ever use is allocated here.
    #[must_use]
    pub fn new(scene: &Scene, settings: Settings, id: usize, incarnation: u32) -> Self {
        Self {
            id,
            incarnation,
            phase: Phase::Starting,
            intent: Intent::new(),
            thinking: Thinking::new(scene, settings),
            hash: StateHash::new(),
        }
    }

    /// Answers one snapshot, within `units` of work. Writes the whole command, and returns what
    /// is to be asked of the planner.
    pub fn step(
        &mut self,
        scene: &Scene,
        input: RobotInput<'_>,
        units: u64,
        out: &mut Command,
    ) -> Option<HardRequest> {
        let now = Now {
            scene,
            snapshot: input.snapshot,
            table: input.table,
            answer: input.answer,
            id: self.id,
            incarnation: self.incarnation,
        };
        self.thinking.budget = Budget::new(units);
        self.intent.hard_request = None;
        self.intent.sequence += 1;
        if now.epoch() != self.intent.selected_epoch {
            self.phase = self.phase.reselect(now.is_gripping());
        }
        let doing = loop {
            match self.act(&now) {
                Next::Enter(phase) => self.phase = phase,
                Next::Rest(phase, doing) => {
                    self.phase = phase;
                    break doing;
                }
            }
        };
        self.thinking.counters.units += self.thinking.budget.spent();
        self.write(&now, doing, out);
        self.intent.hard_request
    }

    /// A cycle among the tasks that the newest selection found, each before the next and the last
    /// before the first; empty if there was none (rule 15).
    #[must_use]
    pub fn cycle(&self) -> &[usize] {
        self.thinking.selection.cycle()
    }

    /// What the present phase leads to.
    fn act(&mut self, now: &Now<'_>) -> Next {
        let (thinking, intent) = (&mut self.thinking, &mut self.intent);
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

    fn write(&mut self, now: &Now<'_>, doing: Doing, out: &mut Command) {
        let tick = now.snapshot.header.tick;
        *out = Command {
            robot: self.id as u32,
            incarnation: self.incarnation,
            sequence: self.intent.sequence,
            tick,
            valid_until_tick: tick + self.thinking.settings.command_valid_ticks,
            settled_at_change: doing.settled_at_change,
            state_hash: self.state_hash(),
            phase: self.phase.wire().code(),
            activity: doing.activity.code(),
            go: u32::from(doing.go),
            grip: doing.grip.code(),
            claim: self.intent.claim,
            failure: self.intent.failure,
            path: *self.intent.asked.request(),
            counters: self.thinking.counters,
        };
    }

    /// Hash of the private state: what the next step depends on beside its inputs.
    fn state_hash(&mut self) -> u64 {
        self.hash.reset();
        self.phase.hash_into(&mut self.hash);
        self.intent.hash_into(&mut self.hash);
        self.thinking.hash_into(&mut self.hash);
        self.hash.finish()
    }
}

/// What a robot that has just been started finds itself doing. Also numbers go on from what the
/// world has of an earlier process of this robot.
fn take_up(now: &Now<'_>, intent: &mut Intent) -> Phase {
    intent.sequence = now.me().acknowledged + 1;
    intent.asked = Asked::after(now.me());
    match now.holding() {
        Some(task) => {
            intent.claim = select::claim(now, Some(task));
            transfer::begin(now, intent, task)
        }
        None => Phase::Selecting(Selecting::after(None)),
    }
}
