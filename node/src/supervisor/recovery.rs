//! Starting the processes of a run, and starting them again.
//!
//! Responsible for: set-up; noticing who has died, is silent or hangs in set-up; reaping, cleaning up
//! after and replacing them, with back-off; telling the world which process of a robot counts.
//! Not responsible for: when a process is worth another try (`member`), what it takes up (`roles`).
//!
//! Restart = kill, reap, clean up, start: never beside an old process, which may only be stopped. A
//! process killed while it is setting up can leave a half-made file, for which everybody waits
//! without end; the `janitor` removes it. A set-up that takes too long all the same is given up and
//! tried again.

use std::time::{Duration, Instant};

use shm_types::{ControlKind, RoleKind};

use crate::children::Participant;
use crate::domain::{DomainError, Process, RunFile};
use crate::options::{Clock, Restart, Role};
use crate::shared_memory;
use crate::supervisor::diary::Happened;
use crate::supervisor::member::{News, State};
use crate::supervisor::{ASK_AGAIN, End, PERIOD, Run, RunError, names};

/// How often the set-up of a run is tried.
const ATTEMPTS: u32 = 3;
/// Processes in a row that may end of themselves before they have answered, while the run is set
/// up: after that it is no accident, such as a port of a dead process that is still in the way.
const MOST_OWN_FAILURES: u32 = 5;
/// Notes of processes that were started again.
const MOST_NOTES: usize = 20;
/// How long the news of the run's end may take to come to the supervisor.
const NEWS_GRACE: Duration = Duration::from_millis(200);
/// Wall time between two looks at what processes have used of a processor.
const LIFE_EVERY: Duration = Duration::from_millis(100);
/// How many times longer a planner may be silent in real time while it computes.
const THINKING: u32 = 12;

impl Run<'_> {
    /// Starts every role, until each has answered a tick.
    pub(super) fn set_up(&mut self) -> Result<Option<End>, RunError> {
        let mut deadline = Instant::now() + self.plan.setup_deadline;
        let mut attempts = 1;
        loop {
            self.watch.look()?;
            self.note_tasks();
            if let Some(end) = self.recover()? {
                return Ok(Some(end));
            }
            if self.members.iter().all(|one| one.state == State::Ready) {
                return Ok(None);
            }
            // A run that is resumed may be over already.
            if let Some(outcome) = self.watch.outcome() {
                return Ok(Some(End::Outcome(outcome)));
            }
            if self.signals.take() {
                return Ok(Some(End::Interrupted));
            }
            self.refuse_own_failures()?;
            if Instant::now() > deadline {
                if attempts == ATTEMPTS {
                    return Err(RunError::Unready {
                        roles: names(&self.unready()),
                        seconds: self.plan.setup_deadline.as_secs_f64(),
                        attempts,
                    });
                }
                self.give_up_unready();
                attempts += 1;
                deadline = Instant::now() + self.plan.setup_deadline;
            }
            std::thread::sleep(PERIOD);
        }
    }

    fn unready(&self) -> Vec<Role> {
        let unready = self.members.iter().filter(|one| one.state != State::Ready);
        unready.map(|one| one.role).collect()
    }

    /// A process that ends by itself again and again before it has answered a tick will not do
    /// better the next time.
    fn refuse_own_failures(&self) -> Result<(), RunError> {
        for one in &self.members {
            let process = one.process.as_ref();
            if one.own_failures() >= MOST_OWN_FAILURES
                && matches!(one.state, State::Down { .. })
                && let Some(process) = process.filter(|process| process.has_failed_by_itself())
            {
                return Err(RunError::SetUp(process.last_words()));
            }
        }
        Ok(())
    }

    /// Kills and reaps every process that is still in set-up, then removes what such a process
    /// can have left half-made.
    fn give_up_unready(&mut self) {
        let unready = self.unready();
        for role in &unready {
            self.kill(*role);
        }
        self.notes.push(format!(
            "{} did not get ready in time and had to be started again",
            names(&unready)
        ));
        self.node.try_cleanup_dead_nodes();
        match shared_memory::remove_half_made(&self.file.prefix) {
            Ok(0) => {}
            Ok(files) => self.cleared += files,
            Err(error) => self
                .notes
                .push(format!("half-made files not removed: {error}")),
        }
    }

    /// The run is over, but its world or recorder died before everything was written. Whether they
    /// have been, or are being, started again.
    pub(super) fn recover_at_end(&mut self) -> Result<bool, RunError> {
        if self.plan.recovery.restart == Restart::Never {
            return Ok(false);
        }
        for at in 0..self.members.len() {
            let one = &mut self.members[at];
            if !matches!(one.role, Role::World | Role::Recorder) {
                continue;
            }
            let ended = one.process.as_mut().and_then(Participant::ended);
            let is_dead = ended.is_some_and(|status| !status.success());
            let is_on = matches!(one.state, State::SettingUp { .. } | State::Ready);
            if is_dead && is_on && self.mourn(at).is_some() {
                return Ok(false);
            }
        }
        let now = Instant::now();
        for at in 0..self.members.len() {
            let one = &self.members[at];
            if matches!(one.role, Role::World | Role::Recorder) && one.is_due(now) {
                self.node.try_cleanup_dead_nodes();
                self.start(at)?;
            }
        }
        Ok(true)
    }

    /// Notices who has answered, died or fallen silent, and starts who is due. The end, if one is
    /// lost without whom the run cannot go on.
    pub(super) fn recover(&mut self) -> Result<Option<End>, RunError> {
        self.welcome()?;
        self.greet();
        if let Some(end) = self.bury()? {
            return Ok(Some(end));
        }
        self.kill_silent();
        self.start_due()?;
        self.tell_news()?;
        let files = self.janitor.take_removed();
        if files > 0 {
            self.cleared += files;
            self.diary.note(Happened::Cleared { files });
        }
        Ok(None)
    }

    /// Robots that were added get a process.
    fn welcome(&mut self) -> Result<(), RunError> {
        let robots = self.watch.header().map_or(0, |header| header.robot_count);
        if robots <= self.file.robots {
            return Ok(());
        }
        for index in self.file.robots..robots {
            self.enlist(Role::Robot(index));
        }
        self.file.robots = robots;
        Ok(self.directory.write_run(&self.file)?)
    }

    /// Who has answered a first tick is ready.
    fn greet(&mut self) {
        for one in &mut self.members {
            one.forgive();
            if let State::SettingUp { .. } = one.state
                && self.watch.is_ready(one.role)
                && let Some(pid) = one.pid()
            {
                one.answered();
                let role = one.role;
                self.diary.note(Happened::Ready { role, pid });
            }
        }
    }

    /// Notices who has died.
    fn bury(&mut self) -> Result<Option<End>, RunError> {
        let mut lost = Vec::new();
        for at in 0..self.members.len() {
            let one = &mut self.members[at];
            match one.state {
                State::SettingUp { .. } | State::Ready => {
                    let Some(process) = &mut one.process else {
                        continue;
                    };
                    match process.ended() {
                        None => {}
                        // It has seen an end that is yet to come to us.
                        Some(status) if status.success() => {
                            one.state = State::Left { at: Instant::now() };
                        }
                        Some(_) => lost.push(at),
                    }
                }
                State::Left { at: left } if left.elapsed() > NEWS_GRACE => lost.push(at),
                _ => {}
            }
        }
        if lost.is_empty() {
            return Ok(None);
        }
        // What the dead have sent counts; the end may be among it.
        self.watch.look()?;
        if let Some(outcome) = self.watch.outcome() {
            return Ok(Some(End::Outcome(outcome)));
        }
        Ok(lost.into_iter().find_map(|at| self.mourn(at)))
    }

    /// What follows from a death.
    fn mourn(&mut self, at: usize) -> Option<End> {
        let recovery = self.plan.recovery;
        let one = &mut self.members[at];
        let role = one.role;
        let process = one.process.as_ref()?;
        let (words, by_itself) = (process.last_words(), process.has_failed_by_itself());
        self.diary.note(Happened::Ended {
            role,
            pid: process.pid(),
            how: process.how(),
            words: by_itself.then(|| words.clone()),
        });
        let again = one.died(recovery.give_up_after) && recovery.restart != Restart::Never;
        if again {
            if by_itself && self.notes.len() < MOST_NOTES {
                self.notes.push(format!("{words}; it was started again"));
            }
            return None;
        }
        one.state = State::Gone;
        self.diary.note(Happened::Gone { role });
        let Role::Robot(_) = role else {
            return Some(End::Lost(words));
        };
        one.news = Some(News {
            kind: ControlKind::Down,
            incarnation: one.incarnation.max(1),
            told: None,
        });
        self.notes.push(format!("{role} is gone for good: {words}"));
        None
    }

    /// Kills who has been silent for too long.
    fn kill_silent(&mut self) {
        for at in 0..self.members.len() {
            let one = &self.members[at];
            let (role, pid) = match (one.role, one.pid()) {
                (role, Some(pid)) => (role, pid),
                _ => continue,
            };
            if !self.is_silent(at) {
                continue;
            }
            self.diary.note(Happened::Silent { role, pid });
            let seconds = self.plan.silence_limit.as_secs_f64();
            self.notes
                .push(format!("{role} was silent for {seconds} s and was killed"));
            self.kill(role);
        }
    }

    /// Whether a living process is silent: for too long in set-up; or it does nothing at all, as
    /// one that is stopped, while the run stands still or it should have spoken.
    fn is_silent(&mut self, at: usize) -> bool {
        let limit = self.plan.silence_limit;
        let is_real = self.file.options.clock != Clock::Lockstep;
        let one = &mut self.members[at];
        let set_up_for = match one.state {
            State::SettingUp { since } => since.elapsed(),
            _ => Duration::ZERO,
        };
        let now = Instant::now();
        if now.duration_since(one.idle.1) > LIFE_EVERY
            && let Some(life) = one.process.as_ref().and_then(Participant::life)
            && life.goes_on_since(one.idle.0)
        {
            one.idle = (life, now);
        }
        let is_idle = now.duration_since(one.idle.1) > limit;
        if set_up_for > Duration::ZERO {
            return set_up_for > self.plan.setup_deadline || (is_idle && set_up_for > limit);
        }
        if !is_real {
            return is_idle && self.watch.standstill() > limit;
        }
        let silence = self.watch.silence(one.role);
        match one.role {
            Role::Planner if !is_idle => silence > limit * THINKING,
            // A recorder says nothing while there is nothing to write.
            Role::Recorder => silence > limit && is_idle,
            _ => silence > limit,
        }
    }

    fn kill(&mut self, role: Role) {
        let one = self.members.iter_mut().find(|one| one.role == role);
        if let Some(process) = one.and_then(|one| one.process.as_mut()) {
            process.kill();
        }
    }

    /// Starts a process for everybody who is due one.
    fn start_due(&mut self) -> Result<(), RunError> {
        let now = Instant::now();
        let due: Vec<usize> = (0..self.members.len())
            .filter(|&at| self.members[at].is_due(now))
            .collect();
        if due.is_empty() {
            return Ok(());
        }
        if due.iter().any(|&at| self.members[at].process.is_some()) {
            // The ports of the dead are in the way of the next ones.
            self.node.try_cleanup_dead_nodes();
            make_private(&self.file)?;
        }
        for &at in &due {
            self.start(at)?;
        }
        self.janitor
            .know(self.members.iter().filter_map(super::Member::pid));
        self.file.processes = self
            .members
            .iter()
            .filter_map(|one| {
                let process = one.process.as_ref()?;
                Some(Process {
                    role: one.role,
                    pid: process.pid(),
                    incarnation: one.incarnation,
                })
            })
            .collect();
        self.file.processes.sort_by_key(|process| process.role);
        Ok(self.directory.write_run(&self.file)?)
    }

    fn start(&mut self, at: usize) -> Result<(), RunError> {
        let launcher = &self.plan.launcher;
        let one = &mut self.members[at];
        let (role, incarnation) = (one.role, one.incarnation + 1);
        self.restarts += u64::from(one.process.is_some());
        one.process = None;
        let started = Participant::start(launcher, role, incarnation, self.directory.path());
        let process = started.map_err(|source| RunError::Start {
            role,
            program: launcher.program.display().to_string(),
            source,
        })?;
        let pid = process.pid();
        one.begin(process);
        self.watch.expect(role, incarnation);
        self.diary.note(Happened::Started {
            role,
            pid,
            incarnation,
        });
        if let Role::Robot(index) = role
            && incarnation > 1
        {
            // One that takes part no more does not begin to by dying.
            let is_out = self.watch.robot(index).is_some_and(|state| state.live == 0)
                && self.watch.header().is_some();
            let holds = self.plan.recovery.restart == Restart::Hold;
            one.news = Some(News {
                kind: if is_out || holds {
                    ControlKind::Standby
                } else {
                    ControlKind::Up
                },
                incarnation,
                told: None,
            });
        }
        Ok(())
    }

    /// Tells the world which process of each robot counts, until it is seen to know.
    fn tell_news(&mut self) -> Result<(), RunError> {
        let Some(generation) = self.watch.header().map(|header| header.generation) else {
            return Ok(());
        };
        for at in 0..self.members.len() {
            let one = &self.members[at];
            let (Role::Robot(index), Some(news)) = (one.role, one.news) else {
                continue;
            };
            let told_this_one = news.told.is_some_and(|(told, _)| told == generation);
            let state = self.watch.robot(index);
            let is_known = state.is_some_and(|state| match news.kind {
                ControlKind::Down => state.live == 0 && told_this_one,
                _ => state.incarnation == news.incarnation,
            });
            if is_known {
                // That nobody is there is in no snapshot: each world process has to be told.
                if news.kind != ControlKind::Down {
                    self.members[at].news = None;
                }
                continue;
            }
            let is_fresh = news
                .told
                .is_some_and(|(_, when)| when.elapsed() < ASK_AGAIN);
            if (told_this_one && is_fresh) || !self.watch.may_ask() {
                continue;
            }
            let told = Some((generation, Instant::now()));
            self.members[at].news = Some(News { told, ..news });
            self.ask(news.kind, RoleKind::Robot, index, news.incarnation)?;
        }
        Ok(())
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
