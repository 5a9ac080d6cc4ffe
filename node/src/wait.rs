//! How a lockstep participant waits.
//!
//! Responsible for: spinning, yielding or sleeping between two looks, without losing a wake-up.
//! Not responsible for: what is looked for (`roles`), or whether a wait is allowed with so many
//! processes (`options`).
//!
//! A wait is a loop of look and [`Waiter::pause`]. While messages come quickly `Spin` and `Hybrid`
//! make no other system call than `sched_yield`.

use std::time::Duration;

use crate::options::Wait;
use crate::ports::TopicError;
use crate::wakes::Sleeper;

/// Yields before a hybrid wait sleeps: about a millisecond when nobody else wants the core.
const YIELD_ROUNDS: u32 = 2_000;
/// First sleep of a hybrid wait; each one is twice the one before.
const FIRST_SLEEP: Duration = Duration::from_micros(50);
/// Longest sleep of a hybrid wait.
const LONGEST_SLEEP: Duration = Duration::from_millis(1);
/// Longest sleep of a blocking wait: a wake-up ends it, this is for signals and late joiners.
const LONGEST_BLOCK: Duration = Duration::from_millis(20);

/// The state of one wait.
pub(crate) struct Waiter {
    wait: Wait,
    sleeper: Option<Sleeper>,
    rounds: u32,
    sleep: Duration,
}

impl Waiter {
    /// A participant's way to wait. `sleeper` is what it is woken by; without one a blocking wait
    /// sleeps a millisecond at a time.
    pub(crate) const fn new(wait: Wait, sleeper: Option<Sleeper>) -> Self {
        Self {
            wait,
            sleeper,
            rounds: 0,
            sleep: FIRST_SLEEP,
        }
    }

    /// What was waited for has come: the next wait starts afresh.
    pub(crate) const fn arrived(&mut self) {
        self.rounds = 0;
        self.sleep = FIRST_SLEEP;
    }

    /// Nothing has come yet: gives others time.
    ///
    /// # Errors
    /// The topic of wake-ups is in no state to be waited on.
    pub(crate) fn pause(&mut self) -> Result<(), TopicError> {
        match (self.wait, &self.sleeper) {
            (Wait::Spin, _) => std::hint::spin_loop(),
            (Wait::Hybrid, _) if self.rounds < YIELD_ROUNDS => {
                self.rounds += 1;
                std::thread::yield_now();
            }
            (Wait::Hybrid, _) => {
                std::thread::sleep(self.sleep);
                self.sleep = (self.sleep * 2).min(LONGEST_SLEEP);
            }
            (Wait::Block, Some(sleeper)) => sleeper.sleep(LONGEST_BLOCK)?,
            (Wait::Block, None) => std::thread::sleep(LONGEST_SLEEP),
        }
        Ok(())
    }
}
