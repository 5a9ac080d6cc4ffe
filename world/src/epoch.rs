//! Epochs: the spans between two selections (rules 17–19).
//!
//! Responsible for: opening an epoch, at most one a tick, and freezing what selection reads, so
//! that all robots find the same. Not responsible for: selecting.
//!
//! What opens one: a completion; a failure counted; a new constraint version; and **(ours)** an
//! object put down short of its goal, a bar lifted for an idle robot, a robot that takes part
//! again or no more. Without these a task could be free and a robot idle, and neither know.

use shm_types::{EventKind, TaskStatus};

use crate::journal::{Event, Journal};
use crate::state::Hand;
use crate::step::World;

/// The counts that everybody's waiting and selecting hangs on; see `SnapshotHeader`.
#[derive(Clone, Debug)]
pub(crate) struct Epoch {
    pub(crate) number: u64,
    pub(crate) events: u64,
    pub(crate) change: u64,
    /// Tick whose snapshot is the first to show the newest change.
    pub(crate) changed_tick: u64,
    pub(crate) placements: u64,
    /// Constraint version when the epoch opened.
    pub(crate) constraints_version: u32,
    /// Something in this tick opens an epoch.
    pub(crate) due: bool,
}

impl Epoch {
    /// Epoch 1, open from the start.
    pub(crate) const fn first() -> Self {
        Self {
            number: 1,
            events: 0,
            change: 0,
            changed_tick: 0,
            placements: 0,
            constraints_version: 0,
            due: false,
        }
    }
}

impl World {
    /// Opens an epoch if one is due.
    pub(crate) fn open_epoch(&mut self, journal: &mut Journal<'_>) {
        if !std::mem::take(&mut self.epoch.due) {
            return;
        }
        self.epoch.number += 1;
        self.epoch.constraints_version = self.constraints.in_force.version;
        for robot in &mut self.robots {
            robot.epoch_position = robot.position;
            robot.epoch_free = robot.link.live && robot.hand == Hand::Empty;
        }
        for i in 0..self.objects.len() {
            let object = &self.objects[i];
            // An object around which a grip closes is as good as held.
            let grip = object.claimed_by.map(|i| self.robots[i].hand);
            let status = match grip {
                Some(Hand::Closing { .. }) => TaskStatus::Held,
                _ => object.status,
            };
            if (object.epoch_status, object.epoch_barred) != (status, object.barred) {
                let object = &mut self.objects[i];
                (object.epoch_status, object.epoch_barred) = (status, object.barred);
            }
        }
        journal.event(Event::new(EventKind::Epoch).value(self.epoch.number));
    }
}

#[cfg(test)]
mod tests {
    use shm_types::{EventKind, FailureCause, Grip, NONE, Point, TaskStatus};

    use crate::testing::{BELOW, Bench, room};

    const OBJECTS: [[[f64; 2]; 2]; 2] = [[[1.0, 1.45], [1.0, 5.0]], [[5.0, 3.0], [5.0, 5.0]]];

    fn bench(more: &str) -> Bench {
        Bench::new(room(&[[1.0, 1.0], [8.0, 1.0]], &OBJECTS, BELOW, more))
    }

    #[test]
    fn what_selection_reads_is_frozen_until_the_next_epoch() {
        let mut bench = bench("");
        bench.step();
        assert_eq!(
            bench.events(EventKind::Epoch)[0].value,
            1,
            "epoch 1 opens at once"
        );
        bench.claim(0, 0);
        bench.drive(1, &[[8.0, 2.0]]);
        bench.grasp(0);
        assert_eq!(bench.header().epoch, 1, "neither start nor grasp opens one");
        assert_eq!(bench.robot(1).epoch_position, Point::new(8.0, 1.0));
        assert_eq!(bench.robot(0).epoch_free, 1);
        assert_eq!(bench.object(0).epoch_status, TaskStatus::Waiting.code());
        bench.fail(1, 1, FailureCause::Objects, NONE);
        bench.step();
        assert_eq!(bench.header().epoch, 2);
        assert_eq!(bench.events(EventKind::Epoch)[0].value, 2);
        assert_eq!(bench.robot(1).epoch_position, Point::new(8.0, 2.0));
        assert_eq!(
            (bench.robot(0).epoch_free, bench.robot(1).epoch_free),
            (0, 1)
        );
        assert_eq!(bench.object(0).epoch_status, TaskStatus::Held.code());
        assert_eq!(bench.object(1).epoch_barred, [0b10, 0]);
    }

    #[test]
    fn a_closing_grip_counts_as_held() {
        let mut bench = bench("grasp_s = 1.0");
        bench.claim(0, 0);
        bench.step();
        bench.grip(0, Grip::Grasp);
        bench.step();
        bench.fail(1, 1, FailureCause::Objects, NONE);
        bench.step();
        assert_eq!((bench.header().epoch, bench.robot(0).holding), (2, NONE));
        assert_eq!(bench.object(0).epoch_status, TaskStatus::Held.code());
        assert_eq!(bench.object(0).status, TaskStatus::Claimed.code());
        assert_eq!(bench.robot(0).epoch_free, 0);
    }
}
