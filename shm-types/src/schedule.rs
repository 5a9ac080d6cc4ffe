//! What the planner service publishes for methods that plan ahead: for each robot its next
//! actions, and whom each of them waits for.
//!
//! Terms: an *action* is a straight piece of way and what the grip does at its end. A robot's
//! actions are numbered from 0 over the whole run, whatever the version. An action *waits* for
//! another robot's action if that one is planned to pass first where both need the same space (an
//! action dependency graph): it is asked for once the other is granted. Delays change when things
//! happen, never who passes first.

use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

use crate::capacity::{MAX_ACTIONS, MAX_ROBOTS, MAX_WAITS};
use crate::id::tag;
use crate::{Checked, Counts, NONE, Point, StateHash, zeroed};

tag! {
    /// Why the world refuses a schedule.
    pub enum Refusal {
        /// It is no legal message: a count, an id or a number is out of range.
        Illegal = 0,
        /// A robot's actions begin past what is granted to it, or end before, or are not those
        /// of the version before any more.
        Gap = 1,
        /// What is granted to a robot leads elsewhere than it says.
        Elsewhere = 2,
    }
}

/// A straight piece of way and what the grip does at its end.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Action {
    /// Where it ends: centre of the robot.
    pub to: Point,
    /// A [`crate::Grip`]: what the grip does there.
    pub grip: u32,
    /// Object grasped or released there, or [`crate::NONE`].
    pub object: u32,
    /// For a grasp: how often the object has been put down before. Whoever moves it earlier has
    /// to be done.
    pub turn: u32,
    /// Its waits are `waits` entries of [`Schedule::waits`], from here on.
    pub first_wait: u32,
    /// How many.
    pub waits: u32,
    /// Always 0.
    pub reserved: u32,
}

/// Until then an action is not asked for: `robot` has been granted its first `actions` actions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Wait {
    /// Who goes first.
    pub robot: u32,
    /// How many of its actions are granted by then.
    pub actions: u32,
}

impl Wait {
    /// For nobody.
    pub const NONE: Self = Self {
        robot: NONE,
        actions: 0,
    };
}

/// The part of a schedule that is one robot's.
#[derive(Clone, Copy, Debug, Default, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct RobotSchedule {
    /// Number of its first action listed here. Those before are past, or as an earlier version
    /// had them and granted. When the schedule comes into force, all that is granted must have
    /// been listed, and what is listed of it must lead where it was granted to; an action
    /// granted in part must be listed as it was. List the last one granted as long as its grip
    /// is not done: a process of the robot that is started then knows of it.
    pub first: u32,
    /// How many actions are listed. Where it is none, the robot stops where its grant ends when
    /// the schedule comes into force, be it in the middle of an action.
    pub count: u32,
    /// Where in [`Schedule::actions`] they begin.
    pub offset: u32,
    /// 1 if nothing comes after the last one listed.
    pub complete: u32,
    /// How many of its actions are as the version before had them: where more are granted when the
    /// schedule would come into force, it does not, since who goes first may be another one.
    /// `u32::MAX` where nothing has changed.
    pub kept: u32,
}

/// The next actions of every robot, one version.
#[derive(FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Schedule {
    /// Rises with each schedule; 0 is the empty one nobody publishes.
    pub version: u32,
    /// Robots of the run when it was made.
    pub robot_count: u32,
    /// Live entries of `actions`.
    pub action_count: u32,
    /// Live entries of `waits`.
    pub wait_count: u32,
    /// First tick at which it may be named by a snapshot.
    pub effect_tick: u64,
    /// Until this tick all is listed that begins by then: a robot that has done all that is listed
    /// for it waits for others until then, and for the planner after that. 0 where as much is
    /// listed as there is room for.
    pub listed_until_tick: u64,
    /// Version of the scene that it was made for.
    pub scene_version: u32,
    /// Always 0.
    pub reserved: u32,
    /// The first `robot_count` are live.
    pub robots: [RobotSchedule; MAX_ROBOTS],
    /// The first `action_count` are live.
    pub actions: [Action; MAX_ACTIONS],
    /// The first `wait_count` are live.
    pub waits: [Wait; MAX_WAITS],
}

impl Schedule {
    /// The part that is a robot's; none for one that has come since.
    #[must_use]
    pub fn part(&self, robot: usize) -> Option<&RobotSchedule> {
        let live = self.robots.get(..self.robot_count as usize)?;
        live.get(robot)
    }

    /// The actions listed for a robot; none for one that it does not know.
    #[must_use]
    pub fn actions_of(&self, robot: usize) -> &[Action] {
        let Some(part) = self.part(robot) else {
            return &[];
        };
        let from = part.offset as usize;
        let range = from..from.saturating_add(part.count as usize);
        self.actions.get(range).unwrap_or(&[])
    }

    /// A robot's action of this number, if it is listed.
    #[must_use]
    pub fn action(&self, robot: usize, number: u32) -> Option<&Action> {
        let first = self.part(robot)?.first;
        self.actions_of(robot)
            .get(number.checked_sub(first)? as usize)
    }

    /// What an action of this schedule waits for.
    #[must_use]
    pub fn waits_of(&self, action: &Action) -> &[Wait] {
        let from = action.first_wait as usize;
        let range = from..from.saturating_add(action.waits as usize);
        self.waits.get(range).unwrap_or(&[])
    }

    /// Copies the live part of `other`.
    pub fn copy_from(&mut self, other: &Self) {
        let robots = (other.robot_count as usize).min(MAX_ROBOTS);
        let actions = (other.action_count as usize).min(MAX_ACTIONS);
        let waits = (other.wait_count as usize).min(MAX_WAITS);
        self.version = other.version;
        self.robot_count = other.robot_count;
        self.action_count = other.action_count;
        self.wait_count = other.wait_count;
        self.effect_tick = other.effect_tick;
        self.listed_until_tick = other.listed_until_tick;
        self.scene_version = other.scene_version;
        self.robots[..robots].copy_from_slice(&other.robots[..robots]);
        self.actions[..actions].copy_from_slice(&other.actions[..actions]);
        self.waits[..waits].copy_from_slice(&other.waits[..waits]);
    }

    /// Adds the live part, in canonical order.
    ///
    /// # Panics
    /// When the counts exceed the capacities: hash only what was checked or made here.
    pub fn hash_into(&self, hash: &mut StateHash) {
        hash.add(&[self.version, self.robot_count]);
        hash.add(&[self.action_count, self.wait_count]);
        hash.add(&[self.effect_tick, self.listed_until_tick]);
        hash.add(&self.scene_version);
        hash.add(&self.robots[..self.robot_count as usize]);
        hash.add(&self.actions[..self.action_count as usize]);
        hash.add(&self.waits[..self.wait_count as usize]);
    }

    /// As a planner process writes it down for the next one: the message as it is in memory, and
    /// its hash.
    #[must_use]
    pub fn sealed(&self) -> Vec<u8> {
        let message = self.as_bytes();
        [message, &seal_of(message).to_ne_bytes()].concat()
    }

    /// What was written down; `None` if that is not all there as it was written, or no legal
    /// schedule of a scene with `counts`.
    #[must_use]
    pub fn unsealed(bytes: &[u8], counts: Counts) -> Option<Box<Self>> {
        let (message, seal) = bytes.split_last_chunk()?;
        let mut schedule: Box<Self> = zeroed();
        let room = schedule.as_mut_bytes();
        if message.len() != room.len() || u64::from_ne_bytes(*seal) != seal_of(message) {
            return None;
        }
        room.copy_from_slice(message);
        Checked::new(&*schedule, counts).ok()?;
        Some(schedule)
    }
}

fn seal_of(message: &[u8]) -> u64 {
    let mut hash = StateHash::new();
    hash.add(message);
    hash.finish()
}
