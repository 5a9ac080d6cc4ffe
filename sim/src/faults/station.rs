//! One process of a simulated run: what has reached it, and whether it lives.
//!
//! Responsible for: what a reader holds of each topic, as the process shell does (crate `node`).
//! Not responsible for: who steps when (`driver.rs`).

use std::collections::VecDeque;
use std::rc::Rc;

use robot::Robot;
use shm_types::{
    Checked, Command, ConstraintTable, ControlRequest, Counts, HardAnswer, HardRequest, Schedule,
    Versioned, WorldSnapshot,
};
use world::FIRST_INCARNATION;

use super::line::Line;

/// A message that many read: boxed, since moving it into an `Rc` would copy all its capacity.
pub(crate) type Shared<T> = Rc<Box<T>>;
/// A snapshot on its way to its readers.
pub(crate) type Shot = Shared<WorldSnapshot>;

/// Versions of a table or schedule that a reader holds, and that wait for it.
const KEPT: usize = 2;

/// Versions on their way to one reader, and what it holds of them.
pub(crate) struct Inbox<T> {
    line: Line<Shared<T>>,
    /// Arrived and not looked at: the newest two.
    unread: VecDeque<Shared<T>>,
    /// Oldest first, with whether each is a legal message.
    kept: Vec<(Shared<T>, bool)>,
}

impl<T: Versioned> Inbox<T> {
    pub(crate) fn new() -> Self {
        Self {
            line: Line::new(),
            unread: VecDeque::new(),
            kept: Vec::new(),
        }
    }

    pub(crate) fn line(&mut self) -> &mut Line<Shared<T>> {
        &mut self.line
    }

    /// Lets arrive what is due; the reader need not look.
    pub(crate) fn arrive(&mut self, now: u64) {
        self.unread.extend(self.line.arrived(now));
        while self.unread.len() > KEPT {
            self.unread.pop_front();
        }
    }

    /// The reader looks: it keeps the version in force and the newest.
    pub(crate) fn look(&mut self, counts: Counts, in_force: u32) {
        for message in self.unread.drain(..) {
            let legal = message.validate(counts).is_ok();
            self.kept.push((message, legal));
            if self.kept.len() > KEPT {
                let first_is_in_force = self.kept[0].0.version() == in_force;
                self.kept.remove(usize::from(first_is_in_force));
            }
        }
    }

    /// The newest: its version, and the message if it is a legal one.
    pub(crate) fn newest(&self) -> Option<(u32, Option<Checked<'_, T>>)> {
        let (message, legal) = self.kept.last()?;
        let checked = legal.then(|| Checked::as_before(&***message));
        Some((message.version(), checked))
    }

    /// The message of this version, if it is held and legal.
    pub(crate) fn version(&self, version: u32) -> Option<Checked<'_, T>> {
        let mut kept = self.kept.iter();
        let found = kept.find(|(kept, _)| version > 0 && kept.version() == version);
        found
            .filter(|(_, legal)| *legal)
            .map(|(message, _)| Checked::as_before(&***message))
    }

    /// The reader is another process: it gets what the topic keeps for those who come late.
    pub(crate) fn reset(&mut self, history: &[Shared<T>]) {
        self.line.clear();
        self.kept.clear();
        self.unread = history.iter().cloned().collect();
    }
}

/// Whether a robot's process lives.
pub(crate) enum Life {
    /// It does.
    Up(Box<Robot>),
    /// It has gone mad: sends legal rubbish until it dies at this tick.
    Babbling { until: u64, back_at: u64 },
    /// It is dead, and started again at this tick.
    Dead { back_at: u64 },
}

/// A robot's process, and what is on its way to and from it.
pub(crate) struct Station {
    pub(crate) life: Life,
    pub(crate) incarnation: u32,
    pub(crate) snapshots: Line<Shot>,
    /// Arrived while the process stood still.
    pub(crate) unread: Option<Shot>,
    pub(crate) tables: Inbox<ConstraintTable>,
    pub(crate) schedules: Inbox<Schedule>,
    pub(crate) answers: Line<HardAnswer>,
    pub(crate) answer: Option<HardAnswer>,
    /// The newest that the process has sent.
    pub(crate) command: Command,
    pub(crate) commands: Line<Command>,
    /// The newest that the world has heard.
    pub(crate) heard: Option<Command>,
    pub(crate) requests: Line<HardRequest>,
    pub(crate) controls: Line<ControlRequest>,
    /// The world is told that this process is gone, but only after it was told of the next.
    pub(crate) is_given_up: bool,
    /// When the supervisor last told the world of this process.
    pub(crate) told_at: u64,
}

impl Station {
    pub(crate) fn new(robot: Robot) -> Self {
        Self {
            life: Life::Up(Box::new(robot)),
            incarnation: FIRST_INCARNATION,
            snapshots: Line::new(),
            unread: None,
            tables: Inbox::new(),
            schedules: Inbox::new(),
            answers: Line::new(),
            answer: None,
            command: Command::default(),
            commands: Line::new(),
            heard: None,
            requests: Line::new(),
            controls: Line::new(),
            is_given_up: false,
            told_at: 0,
        }
    }

    /// The process dies: what was on its way to it is lost with it.
    pub(crate) fn die(&mut self, back_at: u64) {
        self.life = Life::Dead { back_at };
        self.snapshots.clear();
        self.unread = None;
        self.answers.clear();
        self.answer = None;
    }
}
