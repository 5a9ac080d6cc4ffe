//! The world's saved state, which a world that is started again goes on from.
//!
//! Responsible for: changing it in place and in length. Not responsible for: the file that it is kept
//! in (crate `node`).

use shm_types::{MotionBatch, zeroed};
use world::{CheckpointError, Guard, World, WorldInput};

use crate::bench::Bench;
use crate::{Got, Tape};

/// Bytes at its beginning that say what it is.
const NAME: usize = 32;
/// Ticks that a world makes that goes on from it.
const TICKS: usize = 3;

/// A state that was changed.
pub(crate) fn state(bench: &Bench, tape: &mut Tape<'_>) -> Got {
    let mut saved = bench.saved.clone();
    if tape.once_in(8) {
        saved.truncate(tape.below(saved.len()));
    }
    let from = if tape.once_in(16) { 0 } else { NAME };
    let from = saved.len().min(from);
    tape.change(&mut saved[from..]);
    // Most are taken for whole: the values are to be judged.
    let restored = if tape.once_in(8) {
        World::restore(&bench.scene, bench.settings.clone(), &saved)
    } else {
        World::restore_without(
            &bench.scene,
            bench.settings.clone(),
            &saved,
            Guard::Checksum,
        )
    };
    match restored {
        Ok(mut world) => {
            // Nobody says that such a state is a safe one: only that one can go on from it.
            let mut motion: Box<MotionBatch> = zeroed();
            for _ in 0..TICKS {
                world.step(&bench.scene, WorldInput::default(), &mut motion);
            }
            Got::Accepted
        }
        Err(CheckpointError::Damaged | CheckpointError::Foreign(_)) => Got::Refused,
        Err(_) => Got::Inside,
    }
}
