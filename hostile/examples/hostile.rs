//! Feeds all targets from a seed and counts: executions, how many a second, how many got past the
//! header.
//!
//! Responsible for: sharing executions among targets and threads. Not responsible for: the targets
//! (crate `hostile`).
//!
//! `cargo run --release -p hostile --example hostile EXECUTIONS [SEED [THREADS]]`. A panic ends it,
//! with the tape that led there.

#![expect(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a loop that counts, and ends where something is wrong"
)]

use std::time::Instant;

use hostile::{Got, Target, Targets};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Bytes of a tape.
const TAPE: usize = 64;

/// Of 1000 executions so many are of this target: files take longest.
const fn share(target: Target) -> u64 {
    match target {
        Target::Scenario | Target::Trace => 10,
        Target::Snapshot | Target::Question => 40,
        Target::Control | Target::Journal | Target::Schedule | Target::Table => 100,
        Target::Command | Target::Motion => 150,
        Target::Report => 200,
    }
}

fn main() {
    let mut numbers = std::env::args().skip(1).map(|word| word.parse::<u64>());
    let mut number = |default| match numbers.next() {
        Some(Ok(number)) => number,
        Some(Err(error)) => panic!("hostile EXECUTIONS [SEED [THREADS]]: {error}"),
        None => default,
    };
    let (executions, seed, threads) = (number(1_000_000), number(1), number(1).max(1));
    let mut all = 0;
    for target in Target::ALL {
        let count = executions * share(target) / 1_000 / threads;
        let begun = Instant::now();
        let got = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..threads)
                .map(|thread| scope.spawn(move || feed(target, seed + (thread << 32), count)))
                .collect();
            workers.into_iter().fold([0; 3], |sum, worker| {
                let got = worker.join().unwrap_or_else(|_| std::process::exit(1));
                [0, 1, 2].map(|i| sum[i] + got[i])
            })
        });
        let sum: u64 = got.iter().sum();
        all += sum;
        println!(
            "{target:?}: {sum} executions, {:.0} a second, {:.1} % past the header, {:.1} % accepted",
            sum as f64 / begun.elapsed().as_secs_f64(),
            100.0 * (sum - got[Got::Refused as usize]) as f64 / sum.max(1) as f64,
            100.0 * got[Got::Accepted as usize] as f64 / sum.max(1) as f64,
        );
    }
    println!("{all} executions");
}

fn feed(target: Target, seed: u64, count: u64) -> [u64; 3] {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let targets = Targets::new();
    let mut got = [0; 3];
    for execution in 0..count {
        let tape: [u8; TAPE] = rng.random();
        let run =
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| targets.run(target, &tape)));
        match run {
            Ok(how) => got[how as usize] += 1,
            Err(panic) => {
                eprintln!("{target:?}, seed {seed}, execution {execution}: {tape:?}");
                std::panic::resume_unwind(panic);
            }
        }
    }
    got
}
