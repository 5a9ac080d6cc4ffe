//! The end of a run: letting the processes go, and gathering what they leave.
//!
//! Responsible for: the order in which processes leave, killing those that do not, one report.
//! Not responsible for: deciding that the run is over (`supervisor`).

use std::fs::File;
use std::os::fd::AsRawFd;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use shm_types::Outcome;

use crate::children::Participant;
use crate::histograms::Latencies;
use crate::options::Role;
use crate::report::{RoleReport, RunReport, WorkReport, WorldReport};
use crate::roles::TRACE_FILE;
use crate::supervisor::member::{Member, State};
use crate::supervisor::{End, PERIOD, Run, names};

/// How long participants may take to leave by themselves. The recorder has a file to finish.
const LEAVE_GRACE: Duration = Duration::from_secs(10);
/// How long they may take to leave when asked.
const TERMINATE_GRACE: Duration = Duration::from_secs(2);

impl Run<'_> {
    /// Lets everybody go, and gathers what they leave. Nothing of the run is left when this
    /// returns, but the trace if it was to be kept.
    pub(super) fn wind_up(mut self, end: End) -> RunReport {
        let (outcome, reason) = match end {
            End::Outcome(outcome) => {
                self.await_others();
                (outcome, None)
            }
            End::Interrupted => (Outcome::Interrupted, None),
            End::Lost(words) => (Outcome::Failed, Some(words)),
        };
        self.end_all();
        let roles = self.reports();
        let world = self.world_report(&roles);
        let mut counters = WorkReport::default();
        let mut latency = Latencies::new();
        for role in &roles {
            counters.add(&role.counters);
            if let Ok(own) = Latencies::read(&Latencies::path(self.directory.path(), role.role)) {
                latency.merge(&own);
            }
        }
        let mut notes = std::mem::take(&mut self.notes);
        if self.cleared > 0 {
            notes.push(format!("{} half-made files removed", self.cleared));
        }
        notes.extend(joined_notes(&roles));
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let makers = roles.iter().find(|role| role.role == Role::World);
        let (lost_commands, wall_s) = makers.map_or((0, 0.0), |world| (world.lost, world.wall_s));
        let (trace, kept) = self.keep_trace();
        RunReport {
            run_id: self.file.id_number(),
            name: self.file.name.clone(),
            outcome,
            reason: reason.or_else(|| world.reason.clone()),
            counters,
            latency,
            deadline_misses: roles.iter().map(|role| role.deadline_misses).sum(),
            snapshots_skipped: roles.iter().map(|role| role.snapshots_skipped).sum(),
            lost_commands,
            restarts: self.restarts,
            wall_s,
            oversubscribed: self.members.len() > cores,
            trace,
            notes,
            world,
            roles,
            _trace: kept,
        }
    }

    /// Everybody but the world leaves by itself once it has seen the end. A recorder that dies
    /// before the trace is whole is started again; nobody else is missed.
    fn await_others(&mut self) {
        let by = Instant::now() + LEAVE_GRACE;
        while Instant::now() < by {
            let _ = self.watch.look();
            let is_failed = |one: &mut Member| {
                let vital = matches!(one.role, Role::World | Role::Recorder);
                let process = one.process.as_mut().filter(|_| vital);
                process.is_some_and(|one| one.ended().is_some_and(|status| !status.success()))
                    || (vital && matches!(one.state, State::Down { .. }))
            };
            if self.members.iter_mut().any(is_failed) && !matches!(self.recover_at_end(), Ok(true))
            {
                return;
            }
            let mut others = self
                .members
                .iter_mut()
                .filter(|one| one.role != Role::World && one.state != State::Gone)
                .filter_map(|one| one.process.as_mut());
            if others.all(|one| one.ended().is_some()) {
                return;
            }
            // Not in their own time, if somebody is in a hurry.
            if self.signals.take() {
                return;
            }
            std::thread::sleep(PERIOD);
        }
    }

    /// Asks those that are left to leave, then kills them.
    fn end_all(&mut self) {
        let mut processes: Vec<&mut Participant> = (self.members.iter_mut())
            .filter_map(|one| one.process.as_mut())
            .collect();
        for one in &mut processes {
            one.terminate();
        }
        let by = Instant::now() + TERMINATE_GRACE;
        while Instant::now() < by && !processes.iter_mut().all(|one| one.ended().is_some()) {
            std::thread::sleep(PERIOD);
        }
        for one in processes {
            let killed = one.ended().is_none();
            one.kill();
            if killed {
                self.notes
                    .push(format!("{} did not leave and was killed", one.role));
            } else if one.has_failed_by_itself() {
                self.notes.push(one.last_words());
            }
        }
    }

    /// What each process has left; what is known of one that has left nothing.
    fn reports(&self) -> Vec<RoleReport> {
        let processes = self.file.processes.iter();
        processes
            .map(|process| {
                RoleReport::read(self.directory.path(), process.role)
                    .unwrap_or_else(|_| RoleReport::missing(process.role, process.pid))
            })
            .collect()
    }

    fn world_report(&self, roles: &[RoleReport]) -> WorldReport {
        let told = roles.iter().find_map(|role| role.world.clone());
        told.or_else(|| {
            let header = self.watch.header()?;
            Some(WorldReport {
                outcome: header.outcome,
                ticks: header.tick,
                time_ns: header.time_ns,
                state_hash: header.state_hash,
                ..WorldReport::default()
            })
        })
        .unwrap_or_default()
    }

    /// Where the trace can be read: where it was asked for, or through a descriptor, so that it
    /// outlives the run's directory and is gone with the report.
    fn keep_trace(&self) -> (Option<PathBuf>, Option<File>) {
        if let Some(path) = &self.plan.options.trace {
            return (path.exists().then(|| path.clone()), None);
        }
        match File::open(self.directory.path().join(TRACE_FILE)) {
            Ok(file) => {
                let path = PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd()));
                (Some(path), Some(file))
            }
            Err(_) => (None, None),
        }
    }
}

/// What the participants note, each once, with the names of all that note it.
fn joined_notes(roles: &[RoleReport]) -> Vec<String> {
    let mut texts: Vec<(&str, Vec<Role>)> = Vec::new();
    for role in roles {
        for note in &role.notes {
            match texts.iter_mut().find(|(text, _)| text == note) {
                Some((_, who)) => who.push(role.role),
                None => texts.push((note, vec![role.role])),
            }
        }
    }
    let lines = texts.into_iter().map(|(text, who)| {
        let everybody = who.len() == roles.len();
        let who = if everybody {
            "all".to_owned()
        } else {
            names(&who)
        };
        format!("{who}: {text}")
    });
    lines.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_all_note_is_told_once() {
        let mut roles =
            [Role::World, Role::Planner, Role::Robot(1)].map(|role| RoleReport::missing(role, 1));
        for role in &mut roles {
            role.notes.push("is slow".to_owned());
        }
        for role in &mut roles[1..] {
            role.notes.push("is late".to_owned());
        }
        let expected = ["all: is slow", "planner, robot-1: is late"];
        assert_eq!(joined_notes(&roles), expected);
    }
}
