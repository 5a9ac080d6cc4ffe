//! Tests of what travels between processes, in one program.

#[cfg(test)]
mod limits;
#[cfg(test)]
mod messages;

use shm_types::{Counts, ObjectState, RobotState, SnapshotHeader, WorldSnapshot, zeroed};

/// A good snapshot of so many robots and objects, all at their defaults.
fn snapshot(counts: Counts) -> Box<WorldSnapshot> {
    let mut snapshot: Box<WorldSnapshot> = zeroed();
    snapshot.header = SnapshotHeader {
        robot_count: counts.robots,
        object_count: counts.objects,
        ..SnapshotHeader::default()
    };
    snapshot.robots.fill(RobotState::default());
    snapshot.objects.fill(ObjectState::default());
    snapshot
}
