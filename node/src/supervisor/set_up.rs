//! The beginning of a run: starting its processes until each has answered a first tick.
//!
//! Responsible for: starting them, the deadline of set-up, and trying again after a process that
//! hangs in it.
//! Not responsible for: what follows once all are ready (`supervisor`).
//!
//! A process killed while it is setting up can leave a half-made file in shared memory, for which
//! everybody after it waits without end. So those that do not get ready in time are killed and
//! reaped, all of them, then half-made files go, then they are started again.

use std::time::Instant;

use crate::children::Participant;
use crate::domain::{DomainError, Process, RunFile};
use crate::options::Role;
use crate::shared_memory;
use crate::supervisor::{End, PERIOD, Run, RunError, names};

/// How often set-up is tried.
const ATTEMPTS: u32 = 3;

impl Run<'_> {
    /// Starts every role, and again those that do not get ready in time: a process killed while
    /// it was setting up can leave a half-made file that blocks everybody after it.
    pub(super) fn set_up(&mut self) -> Result<Option<End>, RunError> {
        for _ in 0..ATTEMPTS {
            self.start_missing()?;
            let deadline = Instant::now() + self.plan.setup_deadline;
            while Instant::now() < deadline {
                self.watch.look()?;
                if self.watch.all_are_ready() {
                    self.watch.set_up_is_over();
                    return Ok(None);
                }
                if self.signals.take() {
                    return Ok(Some(End::Interrupted));
                }
                if let Some(words) = self.lost() {
                    return Err(RunError::SetUp(words));
                }
                std::thread::sleep(PERIOD);
            }
            self.give_up_unready();
        }
        Err(RunError::Unready {
            roles: names(&self.watch.unready()),
            seconds: self.plan.setup_deadline.as_secs_f64(),
            attempts: ATTEMPTS,
        })
    }

    fn start_missing(&mut self) -> Result<(), RunError> {
        for role in Role::all(self.file.robots) {
            if self.participants.iter().any(|one| one.role == role) {
                continue;
            }
            let launcher = &self.plan.launcher;
            let participant = Participant::start(launcher, role, self.directory.path());
            self.participants
                .push(participant.map_err(|source| RunError::Start {
                    role,
                    program: launcher.program.display().to_string(),
                    source,
                })?);
        }
        self.participants.sort_by_key(|one| one.role);
        self.file.processes = self
            .participants
            .iter()
            .map(|one| Process {
                role: one.role,
                pid: one.pid(),
            })
            .collect();
        Ok(self.directory.write_run(&self.file)?)
    }

    /// Kills and reaps every process that is still in set-up, then removes what such a process
    /// can have left half-made.
    fn give_up_unready(&mut self) {
        let unready = self.watch.unready();
        for one in &mut self.participants {
            if unready.contains(&one.role) {
                one.kill();
            }
        }
        self.participants.retain(|one| !unready.contains(&one.role));
        self.restarts += unready.len() as u64;
        self.notes.push(format!(
            "{} did not get ready in time and had to be started again",
            names(&unready)
        ));
        self.node.try_cleanup_dead_nodes();
        match shared_memory::remove_half_made(&self.file.prefix) {
            Ok(0) => {}
            Ok(files) => self.notes.push(format!("{files} half-made files removed")),
            Err(error) => self
                .notes
                .push(format!("half-made files not removed: {error}")),
        }
        if let Err(error) = make_private(&self.file) {
            self.notes.push(error.to_string());
        }
    }
}

/// Takes the run's files in shared memory away from everybody else.
pub(crate) fn make_private(file: &RunFile) -> Result<(), RunError> {
    shared_memory::make_private(&file.prefix)
        .map_err(|source| DomainError::File {
            path: shared_memory::SHARED_MEMORY.into(),
            source,
        })
        .map_err(RunError::from)
}
