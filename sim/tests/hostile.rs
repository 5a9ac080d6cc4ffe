//! Hostile input, a bounded share: a fixed seed and a fresh one for each kind of input.
//!
//! More of the same: `cargo run --release -p sim --example hostile 10000000`.

#![expect(clippy::expect_used, reason = "a test may fail")]

#[path = "hostile/targets.rs"]
mod targets;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use targets::{Got, Target, Targets};

/// Inputs of each kind for each seed; of files fewer, since they take longer.
const INPUTS: u32 = 3_000;
const FILES: u32 = 300;

#[test]
fn no_input_does_harm_and_most_get_past_the_header() {
    let fresh = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let fresh = fresh.expect("a clock").as_nanos() as u64;
    let mut targets = Targets::new();
    for seed in [1, fresh] {
        for target in Target::ALL {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let inputs = match target {
                Target::Scenario | Target::Trace => FILES,
                _ => INPUTS,
            };
            let mut got = [0_u32; 3];
            for input in 0..inputs {
                let tape: [u8; 64] = rng.random();
                println!("{target:?} {seed} {input}");
                got[targets.run(target, &tape) as usize] += 1;
            }
            let inside = inputs - got[Got::Refused as usize];
            assert!(2 * inside >= inputs, "{target:?}, seed {seed}: {got:?}");
            assert!(got[Got::Accepted as usize] > 0, "{target:?}: {got:?}");
        }
    }
}
