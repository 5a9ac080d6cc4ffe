//! The newest schedule, written down for the next process of the planner.
//!
//! Responsible for: a file that is whole whenever a process dies.
//! Not responsible for: what the next process does with it (crate `planner`).
//!
//! It is read by the program that wrote it, on the same machine. Where it cannot be read the next
//! process plans anew.

use std::fs;
use std::path::PathBuf;

use shm_types::{Counts, Schedule};

use crate::domain::{self, DomainError};

/// Where it is kept.
pub(super) struct LastSchedule {
    path: PathBuf,
    /// Version of the newest one that this process has tried to write.
    version: u32,
    /// Whether that failed.
    has_failed: bool,
}

impl LastSchedule {
    /// In this file.
    pub(super) const fn new(path: PathBuf) -> Self {
        Self {
            path,
            version: 0,
            has_failed: false,
        }
    }

    /// The one that an earlier process has left; `None` if there is none, or what there is was
    /// damaged or is no legal schedule of a scene with `counts`.
    pub(super) fn read(&self, counts: Counts) -> Option<Box<Schedule>> {
        Schedule::unsealed(&fs::read(&self.path).ok()?, counts)
    }

    /// Writes `schedule` down in the place of the one before, once for each version.
    ///
    /// # Errors
    /// It cannot be written, and the one before could: the same is not said again with each version.
    pub(super) fn write(&mut self, schedule: &Schedule) -> Result<(), DomainError> {
        if schedule.version == self.version {
            return Ok(());
        }
        self.version = schedule.version;
        let written = domain::put(&self.path, &schedule.sealed());
        let had_failed = std::mem::replace(&mut self.has_failed, written.is_err());
        if had_failed { Ok(()) } else { written }
    }
}

#[cfg(test)]
mod tests {
    use shm_types::{RobotSchedule, zeroed};

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
        schedule.version = 6;
        schedule.robots[1] = RobotSchedule::default();
        last.write(&schedule).unwrap();
        let bytes = fs::read(&last.path).unwrap();
        for length in [0, 7, bytes.len() / 2, bytes.len() - 1] {
            fs::write(&last.path, &bytes[..length]).unwrap();
            assert!(last.read(COUNTS).is_none(), "{length} bytes are left");
        }
        // The tick from which it holds: whatever is written there is legal.
        let mut altered = bytes.clone();
        altered[std::mem::offset_of!(Schedule, effect_tick) + 5] ^= 1;
        fs::write(&last.path, &altered).unwrap();
        assert!(last.read(COUNTS).is_none(), "it holds from another tick");
        fs::write(&last.path, &bytes).unwrap();
        assert!(last.read(COUNTS).is_some());
    }

    #[test]
    fn what_cannot_be_written_is_said_once_and_tried_again_with_the_next() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("schedule");
        fs::create_dir(&path).unwrap();
        let mut last = LastSchedule::new(path.clone());
        let mut schedule: Box<Schedule> = zeroed();
        let mut write = |version| {
            schedule.version = version;
            last.write(&schedule).is_ok()
        };
        assert!(!write(1), "a directory is in the way");
        assert!(write(2), "as before: nothing new to say");
        fs::remove_dir(&path).unwrap();
        assert!(write(3));
        assert!(path.is_file(), "it was tried again");
        fs::remove_file(&path).unwrap();
        fs::create_dir(&path).unwrap();
        assert!(!write(4), "this is new");
    }
}
