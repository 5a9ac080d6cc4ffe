//! One participant of a run, over all its processes.
//!
//! Responsible for: which process of it there is, whether it is starting, ready, down or gone for
//! good, and when the next one is due.
//! Not responsible for: starting and killing (`recovery`).

use std::time::{Duration, Instant};

use crate::children::{Life, Participant};
use crate::options::{GiveUp, Role};
use shm_types::ControlKind;

/// Wait before a process is started again that has failed to answer a tick; twice as long each
/// time more. One that had answered is started at once.
const FIRST_BACK_OFF: Duration = Duration::from_millis(5);
/// Longest such wait.
const LONGEST_BACK_OFF: Duration = Duration::from_millis(500);

/// How long after its first answer a process has failed if it dies of itself.
const PROBATION: Duration = Duration::from_millis(500);

/// How a participant stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum State {
    /// Its process has not answered a tick yet.
    SettingUp {
        /// Since when.
        since: Instant,
    },
    /// It has.
    Ready,
    /// It has none, and gets one.
    Down {
        /// When.
        until: Instant,
    },
    /// Its process has left of its own accord, as at the end of a run.
    Left {
        /// When.
        at: Instant,
    },
    /// It gets none any more.
    Gone,
}

/// What the world has to know of a robot.
#[derive(Clone, Copy, Debug)]
pub(super) struct News {
    pub(super) kind: ControlKind,
    pub(super) incarnation: u32,
    /// Which generation of the world was told, and when.
    pub(super) told: Option<(u32, Instant)>,
}

/// A participant.
pub(super) struct Member {
    pub(super) role: Role,
    /// The newest process, alive or not.
    pub(super) process: Option<Participant>,
    pub(super) state: State,
    /// Which process the newest is, from 1; 0 before the first.
    pub(super) incarnation: u32,
    /// Processes in a row that ended before they had answered a tick, and since when.
    failures: u32,
    failing_since: Option<Instant>,
    /// Those of them, in a row, that ended of themselves: nobody killed them.
    own_failures: u32,
    /// When it answered its first tick.
    answered: Instant,
    pub(super) news: Option<News>,
    /// What it has used of a processor, and since when it has used no more.
    pub(super) idle: (Life, Instant),
}

impl Member {
    pub(super) fn new(role: Role, incarnation: u32) -> Self {
        let now = Instant::now();
        Self {
            role,
            process: None,
            state: State::Down { until: now },
            incarnation,
            failures: 0,
            failing_since: None,
            own_failures: 0,
            answered: now,
            news: None,
            idle: (Life::default(), now),
        }
    }

    /// Whether a process is due.
    pub(super) fn is_due(&self, now: Instant) -> bool {
        matches!(self.state, State::Down { until } if until <= now)
    }

    /// Process id of its living process.
    pub(super) fn pid(&self) -> Option<u32> {
        let lives = matches!(self.state, State::SettingUp { .. } | State::Ready);
        let process = self.process.as_ref()?;
        lives.then(|| process.pid())
    }

    /// Its process is `process` from now on.
    pub(super) fn begin(&mut self, process: Participant) {
        let now = Instant::now();
        self.incarnation = process.incarnation;
        self.process = Some(process);
        self.state = State::SettingUp { since: now };
        self.idle = (Life::default(), now);
    }

    /// It has answered its first tick.
    pub(super) fn answered(&mut self) {
        self.state = State::Ready;
        self.answered = Instant::now();
    }

    /// It has been well for a while: whatever was before is forgiven.
    pub(super) fn forgive(&mut self) {
        if self.state == State::Ready && self.answered.elapsed() > PROBATION {
            (self.failures, self.failing_since) = (0, None);
            self.own_failures = 0;
        }
    }

    /// Its process has died: whether the next one is worth a try. One that dies of itself has
    /// failed, even if it had answered.
    pub(super) fn died(&mut self, give_up: GiveUp) -> bool {
        let now = Instant::now();
        let process = self.process.as_ref();
        let by_itself = process.is_some_and(Participant::has_failed_by_itself);
        if matches!(self.state, State::SettingUp { .. }) || by_itself {
            self.failures += 1;
        } else {
            (self.failures, self.failing_since) = (0, None);
        }
        self.own_failures = if by_itself { self.own_failures + 1 } else { 0 };
        let since = *self.failing_since.get_or_insert(now);
        let enough = match give_up {
            GiveUp::Times(times) => self.failures >= times,
            GiveUp::Seconds(seconds) => (now - since).as_secs_f64() >= seconds,
        };
        let wait = match self.failures {
            0 => Duration::ZERO,
            n => (FIRST_BACK_OFF * (1 << (n - 1).min(16))).min(LONGEST_BACK_OFF),
        };
        self.state = if enough {
            State::Gone
        } else {
            State::Down { until: now + wait }
        };
        !enough
    }

    /// How often in a row it has ended of itself.
    pub(super) const fn own_failures(&self) -> u32 {
        self.own_failures
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait_ms(member: &Member) -> u128 {
        match member.state {
            State::Down { until } => until.saturating_duration_since(Instant::now()).as_millis(),
            _ => panic!("it is not down"),
        }
    }

    #[test]
    fn who_has_answered_is_started_again_at_once_and_who_has_not_later_and_later() {
        let mut member = Member::new(Role::Planner, 0);
        member.answered();
        assert!(member.died(GiveUp::Times(20)));
        assert_eq!(wait_ms(&member), 0);
        let mut before = 0;
        for _ in 0..6 {
            member.state = State::SettingUp {
                since: Instant::now(),
            };
            assert!(member.died(GiveUp::Times(20)));
            let wait = wait_ms(&member);
            assert!(wait > before, "{wait} after {before}");
            before = wait;
        }
        member.answered();
        assert!(member.died(GiveUp::Times(20)));
        assert_eq!(wait_ms(&member), 0);
    }

    #[test]
    fn who_never_answers_is_given_up() {
        let mut member = Member::new(Role::Planner, 0);
        for time in 1..=3 {
            member.state = State::SettingUp {
                since: Instant::now(),
            };
            assert_eq!(member.died(GiveUp::Times(3)), time < 3);
        }
        assert_eq!(member.state, State::Gone);
    }
}
