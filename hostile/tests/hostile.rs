//! Hostile input, a bounded share: a fixed seed and a fresh one for each kind of input, and all that
//! was ever found.
//!
//! More of the same: `cargo run --release -p hostile --example hostile 10000000`, and `fuzz/`.

use std::fs;
use std::path::Path;

use hostile::{Got, Target, Targets};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Inputs of each kind for each seed; of files fewer, since they take longer.
const INPUTS: u32 = 2_000;
const FILES: u32 = 300;

#[test]
fn no_input_does_harm_and_most_get_past_the_header() {
    let fresh = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let fresh = fresh.expect("a clock").as_nanos() as u64;
    let targets = Targets::new();
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

#[test]
fn an_input_gives_the_same_whatever_came_before_it() {
    let targets = Targets::new();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let tapes: Vec<[u8; 64]> = (0..20).map(|_| rng.random()).collect();
    for target in Target::ALL {
        let run = |tape: &[u8; 64]| targets.run(target, tape);
        let there: Vec<Got> = tapes.iter().map(run).collect();
        let mut back: Vec<Got> = tapes.iter().rev().map(run).collect();
        back.reverse();
        assert_eq!(there, back, "{target:?}");
    }
}

#[test]
fn what_was_once_found_is_mended() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/regressions");
    let targets = Targets::new();
    let mut found = 0;
    for target in Target::ALL {
        let tapes = folder.join(format!("{target:?}").to_lowercase());
        for tape in fs::read_dir(tapes).into_iter().flatten() {
            let path = tape.expect("an entry").path();
            println!("{}", path.display());
            let _ = targets.run(target, &fs::read(path).expect("a tape"));
            found += 1;
        }
    }
    assert!(found > 0, "no tapes in {}", folder.display());
}
