//! A robot's process that has gone mad: commands that are legal messages and make no sense.
//!
//! Responsible for: drawing them. Not responsible for: what the world makes of them.
//!
//! It does not say that it has nothing to do, that a task has failed, or put anything down: that
//! it may, and others could not tell.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use shm_types::capacity::MAX_PATH_POINTS;
use shm_types::{
    Activity, Claim, Command, Counts, Grip, NONE, PathRequest, Phase, Point, Wait, WorldSnapshot,
};

/// How far its paths lead, m.
const REACH_M: f64 = 2.0;

/// Writes the next of them, from robot `id` as it stands in `snapshot`.
pub(crate) fn command(
    rng: &mut ChaCha8Rng,
    snapshot: &WorldSnapshot,
    counts: Counts,
    id: usize,
    out: &mut Command,
) {
    let header = &snapshot.header;
    let task = rng.random_range(0..counts.objects + 1);
    let drift = |rng: &mut ChaCha8Rng| rng.random_range(0..3_u64);
    *out = Command {
        robot: id as u32,
        sequence: out.sequence + drift(rng),
        tick: header.tick,
        valid_until_tick: header.tick + rng.random_range(0..60),
        phase: any(rng, Phase::ALL).code(),
        activity: any(rng, Activity::ALL).code(),
        go: rng.random_range(0..2),
        grip: any(rng, &[Grip::Keep, Grip::Grasp]).code(),
        waits_for: Wait {
            robot: rng.random_range(0..counts.robots),
            actions: rng.random_range(0..50),
        },
        claim: Claim {
            task: if task < counts.objects { task } else { NONE },
            constraints_version: (header.epoch_constraints_version + 1)
                .saturating_sub(drift(rng) as u32),
            epoch: (header.epoch + 1).saturating_sub(drift(rng)),
        },
        path: path(rng, snapshot, id, &out.path),
        ..Command::default()
    };
}

/// A path that mostly starts where it should, and leads anywhere.
fn path(
    rng: &mut ChaCha8Rng,
    snapshot: &WorldSnapshot,
    id: usize,
    last: &PathRequest,
) -> PathRequest {
    let robot = &snapshot.robots[id];
    let mut path = PathRequest {
        id: last.id.max(robot.request) + rng.random_range(0..2),
        count: rng.random_range(0..MAX_PATH_POINTS as u32 / 4),
        actions: robot.actions + rng.random_range(0..4),
        schedule_version: snapshot.header.schedule_version,
        ..PathRequest::default()
    };
    let mut at = robot.grant().last().copied().unwrap_or(robot.position);
    for point in &mut path.points[..path.count as usize] {
        *point = at;
        at.x += rng.random_range(-REACH_M..REACH_M);
        at.y += rng.random_range(-REACH_M..REACH_M);
    }
    if rng.random_bool(0.1) {
        path.points[0] = Point::new(0.0, 0.0);
    }
    path
}

fn any<T: Copy>(rng: &mut ChaCha8Rng, all: &[T]) -> T {
    all[rng.random_range(0..all.len())]
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use rand::SeedableRng;
    use scene::{GenerateOptions, Settings};
    use shm_types::{Checked, zeroed};
    use world::World;

    use super::*;

    /// What is of this epoch, of the one before and of the one to come the world looks at.
    #[test]
    fn it_is_legal_and_claims_in_every_epoch_that_could_be_meant() {
        let scene = scene::generate(&GenerateOptions::default()).unwrap().scene;
        let mut snapshot: Box<WorldSnapshot> = zeroed();
        World::new(&scene, Settings::default(), 0).snapshot_into(&mut snapshot);
        snapshot.header.epoch = 7;
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut said = Command::default();
        let mut epochs = BTreeSet::new();
        for _ in 0..200 {
            command(&mut rng, &snapshot, scene.counts(), 0, &mut said);
            Checked::new(&said, scene.counts()).unwrap();
            epochs.insert(said.claim.epoch);
        }
        assert!(epochs.into_iter().eq([6, 7, 8]));
    }
}
