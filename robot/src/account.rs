//! What a robot did in a step: the account of its time, its work, and the hash of its state.
//!
//! Responsible for: what a command says of the robot's activity (rule 24) and of its work.
//! Not responsible for: summing activities up (the world does).

use planner::{PathSearch, Selection};
use scene::{Budget, Scene, Settings};
use shm_types::{Activity, Counters, Grip, StateHash};

use crate::ahead::Ahead;

/// What a robot computes with: options, buffers, the step's budget, the account of its work.
pub(crate) struct Thinking {
    pub(crate) settings: Settings,
    pub(crate) selection: Selection,
    pub(crate) search: PathSearch,
    /// First piece of the way that the newest look found.
    pub(crate) ahead: Ahead,
    pub(crate) budget: Budget,
    pub(crate) counters: Counters,
    /// Motion in one tick, m.
    pub(crate) step_m: f64,
}

impl Thinking {
    /// All memory that a robot's computations will ever use.
    pub(crate) fn new(scene: &Scene, settings: Settings) -> Self {
        let tick_s = settings.tick_ns as f64 * 1e-9;
        Self {
            selection: Selection::new(scene, &settings),
            search: PathSearch::new(scene),
            ahead: Ahead::NOWHERE,
            budget: Budget::new(0),
            counters: Counters::default(),
            step_m: scene.robot.speed_m_per_s * tick_s,
            settings,
        }
    }

    /// Adds what the next step depends on, in a fixed order. How far a computation has come shows
    /// in the work it has done.
    pub(crate) fn hash_into(&self, hash: &mut StateHash) {
        self.ahead.hash_into(hash);
        hash.add(&self.counters);
    }
}

/// What a robot does at the end of a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Doing {
    /// What it counts as doing if it does not move.
    pub(crate) activity: Activity,
    /// Whether it moves along what is granted.
    pub(crate) go: bool,
    pub(crate) grip: Grip,
    /// Value of `change` since which it has nothing to do, or `u64::MAX`.
    pub(crate) settled_at_change: u64,
}

impl Doing {
    /// A computation, its own or one it waits for, is not done: it stands still.
    pub(crate) const COMPUTING: Self = Self {
        activity: Activity::Computing,
        go: false,
        grip: Grip::Keep,
        settled_at_change: u64::MAX,
    };

    /// It moves along what is granted, or waits for a grant or for others.
    pub(crate) const fn waiting(settled_at_change: u64) -> Self {
        Self {
            activity: Activity::Waiting,
            go: true,
            grip: Grip::Keep,
            settled_at_change,
        }
    }

    /// Its grip closes or opens.
    pub(crate) const fn gripping(grip: Grip) -> Self {
        Self {
            activity: Activity::Gripping,
            go: false,
            grip,
            settled_at_change: u64::MAX,
        }
    }

    /// It has nothing to do until something changes.
    pub(crate) const fn idle(settled_at_change: u64) -> Self {
        Self {
            activity: Activity::Idle,
            go: true,
            grip: Grip::Keep,
            settled_at_change,
        }
    }
}
