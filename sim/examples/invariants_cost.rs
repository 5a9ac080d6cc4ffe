//! What checking the invariants costs, as a share of the world's step.
//!
//! Responsible for: runs of the same room side by side, tick by tick in turn, one with the check
//! and one without, and the time that each world takes. Not responsible for: which rooms matter.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a measurement")]

use std::time::{Duration, Instant};

use scene::{GenerateOptions, Method, Scene, Settings};
use shm_types::Outcome;
use sim::{Participant, Probe, Simulation};
use world::Guard;

/// How often each room is run.
const ROUNDS: usize = 15;

/// Times the world's part of a tick.
#[derive(Default)]
struct Watch {
    since: Option<Instant>,
    all: Duration,
}

impl Probe for Watch {
    fn enter(&mut self, who: Participant) {
        self.since = (who == Participant::World).then(Instant::now);
    }

    fn leave(&mut self) {
        self.all += self
            .since
            .take()
            .map_or(Duration::ZERO, |since| since.elapsed());
    }
}

/// World time with and without the check, of one run each.
fn round(scene: &Scene, settings: &Settings) -> (Duration, Duration) {
    let mut with = Simulation::new(scene, settings, 0);
    let mut without = Simulation::new(scene, settings, 0).without(Guard::Invariants);
    let (mut one, mut other) = (Watch::default(), Watch::default());
    while with.outcome() == Outcome::Running {
        let turn = with.snapshot().header.tick % 2;
        if turn == 0 {
            with.tick_probed(&mut one);
        }
        without.tick_probed(&mut other);
        if turn == 1 {
            with.tick_probed(&mut one);
        }
    }
    (one.all, other.all)
}

fn main() {
    let rooms = [(4, 5, 17.0), (8, 12, 60.0), (16, 30, 150.0)];
    for (robots, objects, area_m2) in rooms {
        let generated = scene::generate(&GenerateOptions {
            seed: 3,
            robots,
            objects,
            area_m2,
            ..GenerateOptions::default()
        });
        let scene = generated.unwrap().scene;
        let settings = Settings {
            method: Method::GraspingAndRestricted,
            ..Settings::default()
        };
        let mut shares: Vec<f64> = (0..ROUNDS)
            .map(|_| {
                let (with, without) = round(&scene, &settings);
                1.0 - without.as_secs_f64() / with.as_secs_f64()
            })
            .collect();
        shares.sort_by(f64::total_cmp);
        let percent = |place: usize| 100.0 * shares[place];
        println!(
            "{robots} robots, {objects} objects: {:.1} % of the world's step (quartiles {:.1} and {:.1})",
            percent(ROUNDS / 2),
            percent(ROUNDS / 4),
            percent(3 * ROUNDS / 4),
        );
    }
}
