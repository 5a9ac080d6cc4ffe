//! The newest schedule, written down for the next process of the planner.
//!
//! Responsible for: a file that is whole whenever a process dies.
//! Not responsible for: what the next process does with it (crate `planner`).
//!
//! It holds the message as it is in memory: it is read by the program that wrote it, on the same
//! machine. Where it cannot be read the next process plans anew.

use std::fs;
use std::path::PathBuf;

use shm_types::{Checked, Counts, Schedule, zeroed};
use zerocopy::IntoBytes;

use crate::domain::{self, DomainError};

/// Where it is kept.
pub(super) struct LastSchedule {
    path: PathBuf,
    /// Version of the newest one that this process has tried to write.
    version: u32,
}

impl LastSchedule {
    /// In this file.
    pub(super) const fn new(path: PathBuf) -> Self {
        Self { path, version: 0 }
    }

    /// The one that an earlier process has left; `None` if there is none, or what there is, is no
    /// legal schedule of a scene with `counts`.
    pub(super) fn read(&self, counts: Counts) -> Option<Box<Schedule>> {
        let bytes = fs::read(&self.path).ok()?;
        let mut schedule: Box<Schedule> = zeroed();
        let room = schedule.as_mut_bytes();
        if bytes.len() != room.len() {
            return None;
        }
        room.copy_from_slice(&bytes);
        Checked::new(&*schedule, counts).ok()?;
        Some(schedule)
    }

    /// Writes `schedule` down in the place of the one before, once for each version.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn write(&mut self, schedule: &Schedule) -> Result<(), DomainError> {
        if schedule.version == self.version {
            return Ok(());
        }
        self.version = schedule.version;
        domain::put(&self.path, schedule.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use shm_types::RobotSchedule;

    use super::*;

    const COUNTS: Counts = Counts {
        robots: 2,
        objects: 1,
    };

    #[test]
    fn what_was_written_last_is_read_and_nothing_that_is_no_schedule() {
        let directory = tempfile::tempdir().unwrap();
        let mut last = LastSchedule::new(directory.path().join("schedule"));
        assert!(last.read(COUNTS).is_none(), "nothing was written");
        let mut schedule: Box<Schedule> = zeroed();
        schedule.robot_count = 2;
        for version in [3, 4] {
            schedule.version = version;
            last.write(&schedule).unwrap();
            let read = last.read(COUNTS).unwrap();
            assert_eq!((read.version, read.robot_count), (version, 2));
        }
        schedule.version = 5;
        schedule.robots[1] = RobotSchedule {
            count: 1,
            offset: u32::MAX,
            ..RobotSchedule::default()
        };
        last.write(&schedule).unwrap();
        assert!(last.read(COUNTS).is_none(), "it lists what is not there");
        let bytes = fs::read(&last.path).unwrap();
        fs::write(&last.path, &bytes[..bytes.len() - 1]).unwrap();
        assert!(last.read(COUNTS).is_none(), "it is cut off");
    }
}
