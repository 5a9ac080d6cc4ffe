//! Runs that a planner carries out beforehand.
//!
//! Responsible for: who grasps what in such a run, what the run takes to carry out.
//! Not responsible for: which runs, and what is made of them (crate `planner`).

use planner::{Rollout, Transfer, UNITS_PER_ROBOT_AND_TICK};
use scene::{Scene, Settings};
use shm_types::{Counters, NONE, Outcome};

use crate::simulation::Simulation;

/// What it takes to put a world, a planner and robots in place, in work units.
const UNITS_PER_RUN: u64 = 12_000;
/// What a tick takes, beside what it takes for each robot and the machines' own work, in work units.
const UNITS_PER_TICK: u64 = 3;
/// Units of the machines' own work that take as long as two of planning ahead.
const OWN_UNITS_PER_TWO: u64 = 7;

/// A run in process, and what was grasped in it.
struct InProcess {
    simulation: Simulation<'static>,
    /// By robot, what it held after the newest tick.
    held: Vec<u32>,
    transfers: Vec<Transfer>,
}

/// Begins a run of all robots of `scene` as `settings` say.
#[must_use]
pub fn rollout(scene: &Scene, settings: &Settings) -> Box<dyn Rollout> {
    Box::new(InProcess {
        simulation: Simulation::owning(scene.clone(), settings, 0),
        held: vec![NONE; scene.homes.len()],
        transfers: Vec::with_capacity(scene.objects.len()),
    })
}

impl Rollout for InProcess {
    fn tick(&mut self) -> Outcome {
        let outcome = self.simulation.outcome();
        if outcome != Outcome::Running {
            return outcome;
        }
        let snapshot = self.simulation.tick();
        for (robot, (state, held)) in snapshot.robots.iter().zip(&mut self.held).enumerate() {
            if state.holding != *held && state.holding != NONE {
                self.transfers.push(Transfer {
                    object: state.holding,
                    robot: robot as u32,
                    grasp: state.grasp as u8,
                });
            }
            *held = state.holding;
        }
        self.simulation.outcome()
    }

    fn time_ns(&self) -> u64 {
        self.simulation.snapshot().header.time_ns
    }

    fn work(&self) -> Counters {
        let ticks = self.simulation.snapshot().header.tick;
        let robots = self.held.len() as u64;
        let per_tick = UNITS_PER_TICK + robots * UNITS_PER_ROBOT_AND_TICK;
        let work = self.simulation.work();
        Counters {
            units: UNITS_PER_RUN + ticks * per_tick + 2 * work.units / OWN_UNITS_PER_TWO,
            ..work
        }
    }

    fn transfers(&self) -> &[Transfer] {
        &self.transfers
    }
}
