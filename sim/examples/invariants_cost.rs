//! What checking the invariants costs, as a share of the world's step.
//!
//! Responsible for: runs of the same room side by side, tick by tick in turn, one with the check
//! and one without, and the time that each world takes. Runs are deterministic, so tick k is the
//! same work in every round, and the least time it took is what other load has added least to.
//! Not responsible for: which rooms matter.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a measurement")]

use std::time::{Duration, Instant};

use scene::{GenerateOptions, Method, Scene, Settings};
use shm_types::Outcome;
use sim::{Participant, Probe, Simulation};
use world::Guard;

/// How often each room is run.
const ROUNDS: usize = 7;
/// Ticks of it.
const TICKS: usize = 1_000;

/// Times the world's part of each tick, and keeps the least.
#[derive(Default)]
struct Watch {
    since: Option<Instant>,
    tick: usize,
    least: Vec<Duration>,
}

impl Watch {
    fn total(&self) -> Duration {
        self.least.iter().sum()
    }
}

impl Probe for Watch {
    fn enter(&mut self, who: Participant) {
        self.since = (who == Participant::World).then(Instant::now);
    }

    fn leave(&mut self) {
        if let Some(taken) = self.since.take().map(|since| since.elapsed()) {
            match self.least.get_mut(self.tick) {
                Some(least) => *least = taken.min(*least),
                None => self.least.push(taken),
            }
            self.tick += 1;
        }
    }
}

/// World time of each tick with and without the check, and the exact tests that it made.
fn measure(scene: &Scene, settings: &Settings) -> (Watch, Watch, u64) {
    let (mut one, mut other) = (Watch::default(), Watch::default());
    let mut tests = 0;
    for _ in 0..ROUNDS {
        (one.tick, other.tick) = (0, 0);
        let mut with = Simulation::new(scene, settings, 0);
        let mut without = Simulation::new(scene, settings, 0).without(Guard::Invariants);
        while with.outcome() == Outcome::Running && one.tick < TICKS {
            let turn = one.tick % 2;
            if turn == 0 {
                with.tick_probed(&mut one);
            }
            without.tick_probed(&mut other);
            if turn == 1 {
                with.tick_probed(&mut one);
            }
        }
        tests = with.world().counters().swept_tests - without.world().counters().swept_tests;
    }
    (one, other, tests)
}

fn main() {
    let rooms = [(2, 4, 12.0), (4, 5, 17.0), (8, 12, 60.0)];
    let generated = rooms.map(|(robots, objects, area_m2)| {
        let options = GenerateOptions {
            seed: 3,
            robots,
            objects,
            area_m2,
            ..GenerateOptions::default()
        };
        scene::generate(&options).unwrap().scene
    });
    let shipped = ["warehouse-100"]
        .map(|name| scene::parse(scene::builtin(name).unwrap().text, name).unwrap());
    for scene in generated.iter().chain(&shipped) {
        for method in [Method::Restricted, Method::Anytime] {
            let settings = Settings {
                method,
                ..Settings::default()
            };
            let (with, without, tests) = measure(scene, &settings);
            let ticks = with.least.len() as f64;
            let per_tick_ns = |watch: &Watch| watch.total().as_nanos() as f64 / ticks;
            let (with_ns, without_ns) = (per_tick_ns(&with), per_tick_ns(&without));
            println!(
                "{} robots, {} objects, {}: {:.1} % of the world's step ({:.0} of {:.0} ns), {:.2} exact tests a tick",
                scene.homes.len(),
                scene.objects.len(),
                method.word(),
                100.0 * (1.0 - without_ns / with_ns),
                with_ns - without_ns,
                with_ns,
                tests as f64 / ticks,
            );
        }
    }
}
