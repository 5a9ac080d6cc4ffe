//! What the supervisor, and people, tell the world.

use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

use crate::Point;
use crate::capacity::{MAX_ANSWER_BYTES, MAX_CHANGES};
use crate::id::tag;

tag! {
    /// A kind of participant.
    pub enum RoleKind {
        /// Owns the state of all bodies.
        World = 0,
        /// Works out hard constraints.
        Planner = 1,
        /// Moves one robot.
        Robot = 2,
        /// Writes the trace.
        Recorder = 3,
    }
}

tag! {
    /// What is asked of the world.
    pub enum ControlKind {
        /// `role` `index` takes part from now on, as `incarnation`.
        Up = 0,
        /// `role` `index` is gone.
        Down = 1,
        /// End the run.
        Stop = 2,
        /// Hold all motion.
        Hold = 3,
        /// Go on moving.
        Resume = 4,
        /// The scene is to change.
        Change = 5,
        /// Robot `index` takes part no more, but its process `incarnation` is there and can: `Up`
        /// without an incarnation lets it.
        Standby = 6,
    }
}

tag! {
    /// One way in which the scene changes.
    pub enum ChangeKind {
        /// `object` is to go to `to`; nowhere, where `has_goal` is 0.
        Goal = 0,
        /// Somebody has moved `object` to `at`.
        Move = 1,
        /// A new object stands at `at`, of the kind of `object`, and is to go to `to` as for `Goal`.
        Add = 2,
        /// A wall: the box from `at`, its lower left corner, to `to`, its upper right one.
        Close = 3,
        /// The wall at the point `at` is gone.
        Open = 4,
        /// A new robot stands at `at`, its home.
        AddRobot = 5,
    }
}

/// One change of the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct SceneChange {
    /// See [`ChangeKind`], m.
    pub at: Point,
    /// See [`ChangeKind`], m.
    pub to: Point,
    /// A [`ChangeKind`].
    pub kind: u32,
    /// See [`ChangeKind`].
    pub object: u32,
    /// 1 if `to` is a goal.
    pub has_goal: u32,
    /// Always 0.
    pub reserved: u32,
}

/// One request to the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct ControlRequest {
    /// Rises with each request of one sender.
    pub id: u64,
    /// A [`ControlKind`].
    pub kind: u32,
    /// A [`RoleKind`], for `Up` and `Down`.
    pub role: u32,
    /// Which robot, for the role `Robot`.
    pub index: u32,
    /// Incarnation of the process that is up; 0 for the one that was there last.
    pub incarnation: u32,
    /// Live entries of `changes`, for `Change`.
    pub change_count: u32,
    /// Always 0.
    pub reserved: u32,
    /// All of them are made, or none.
    pub changes: [SceneChange; MAX_CHANGES],
}

/// The world's reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct ControlReply {
    /// Echo of the request.
    pub id: u64,
    /// Tick whose snapshot is the first to show it.
    pub effect_tick: u64,
    /// 1 if accepted.
    pub accepted: u32,
    /// Live bytes of `answer`.
    pub answer_bytes: u32,
    /// Why it was not accepted, UTF-8.
    pub answer: [u8; MAX_ANSWER_BYTES],
}

impl ControlRequest {
    /// The changes that are asked for.
    #[must_use]
    pub fn changes(&self) -> &[SceneChange] {
        &self.changes[..(self.change_count as usize).min(MAX_CHANGES)]
    }
}

impl ControlReply {
    /// The answer to request `id`: from which tick on, or why not. Words that are too many are cut.
    #[must_use]
    pub fn new(id: u64, result: Result<u64, &str>) -> Self {
        let mut reply = Self {
            id,
            effect_tick: result.unwrap_or(0),
            accepted: u32::from(result.is_ok()),
            answer_bytes: 0,
            answer: [0; MAX_ANSWER_BYTES],
        };
        let words = result.err().unwrap_or_default();
        let end = words.floor_char_boundary(MAX_ANSWER_BYTES);
        reply.answer[..end].copy_from_slice(&words.as_bytes()[..end]);
        reply.answer_bytes = end as u32;
        reply
    }

    /// The tick from which on it holds, or why it was not accepted.
    ///
    /// # Errors
    /// The world's words.
    pub fn result(&self) -> Result<u64, String> {
        if self.accepted == 1 {
            return Ok(self.effect_tick);
        }
        let words = &self.answer[..(self.answer_bytes as usize).min(MAX_ANSWER_BYTES)];
        Err(String::from_utf8_lossy(words).into_owned())
    }
}

const _: () = assert!(size_of::<ControlReply>() == 512);
