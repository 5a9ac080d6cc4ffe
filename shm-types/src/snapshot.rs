//! The world's state as everyone sees it: one snapshot a tick, read in place.

use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

use crate::capacity::{
    LAYOUT_VERSION, MAGIC, MAX_OBJECTS, MAX_PATH_POINTS, MAX_ROBOTS, ROBOT_WORDS,
};
use crate::id::tag;
use crate::{NONE, Point, StateHash};

tag! {
    /// How the run stands.
    pub enum Outcome {
        /// Still going.
        Running = 0,
        /// Every object at its goal, every robot at home (rule 6).
        Solved = 1,
        /// Nothing moves, computes or is pending, and nothing can be selected (rule 22).
        Stuck = 2,
        /// The time limit of world time has passed (rule 22).
        Timeout = 3,
        /// Somebody stopped the run.
        Interrupted = 4,
        /// An invariant is broken: all motion is held.
        Violated = 5,
        /// Something the run needs is gone for good (a capacity overflowed, a role was lost).
        Failed = 6,
    }
}

tag! {
    /// Where an object's task stands.
    pub enum TaskStatus {
        /// Needs transport, nobody has claimed it.
        Waiting = 0,
        /// Claimed by a robot that does not hold the object yet.
        Claimed = 1,
        /// Its object is held.
        Held = 2,
        /// At its goal, or in need of none (rule 18).
        Done = 3,
    }
}

tag! {
    /// What a robot says it is doing.
    pub enum Phase {
        /// No task, at home.
        Idle = 0,
        /// Working out which task to take.
        Selecting = 1,
        /// On its way to grasp, empty.
        Transit = 2,
        /// Closing its grip.
        Grasping = 3,
        /// On its way with its object.
        Transfer = 4,
        /// Opening its grip.
        Releasing = 5,
        /// Its task has failed; it waits for the answer.
        Failing = 6,
        /// No task, on its way home.
        GoingHome = 7,
    }
}

tag! {
    /// What a robot did in one tick; exactly one each (rule 24).
    pub enum Activity {
        /// Its position changed.
        Moving = 0,
        /// It stood still because it, or someone it waits for an answer from, was computing.
        Computing = 1,
        /// It stood still for a grant or for another robot.
        Waiting = 2,
        /// It stood still while its grip closed or opened.
        Gripping = 3,
        /// It had nothing to do.
        Idle = 4,
    }
}

tag! {
    /// What a robot wants of its grip.
    pub enum Grip {
        /// Leave it as it is.
        Keep = 0,
        /// Grasp the claimed task's object.
        Grasp = 1,
        /// Put the held object down here.
        Release = 2,
    }
}

tag! {
    /// Why a task has failed (rule 21).
    pub enum FailureCause {
        /// No failure.
        None = 0,
        /// No manipulation path with the objects as they are.
        Objects = 1,
        /// A path exists without the other robots, and patience has run out.
        Robots = 2,
    }
}

/// What every reader of a snapshot looks at first.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct SnapshotHeader {
    /// [`MAGIC`].
    pub magic: u64,
    /// [`LAYOUT_VERSION`].
    pub layout_version: u32,
    /// Raised each time the world process starts again.
    pub generation: u32,
    /// Hash of the canonical scenario in force: the one all processes start from, or a later version.
    pub scenario_hash: u64,
    /// Identity of the run.
    pub run_id: u64,
    /// Number of this snapshot, from 0.
    pub tick: u64,
    /// Virtual time of this snapshot, ns.
    pub time_ns: u64,
    /// When it was published (`CLOCK_MONOTONIC`, ns). Set by the transport; not part of the hash.
    pub publish_stamp_ns: u64,
    /// Hash of the whole system's state, chained over all ticks up to this one. Not part of
    /// the hash of this snapshot.
    pub state_hash: u64,
    /// Current epoch of selection, from 1 (rules 17, 19).
    pub epoch: u64,
    /// Completions plus answered failures so far: what "just before selection" counts (rule 23).
    pub events: u64,
    /// Raised whenever any body moved or any event happened: a robot that has looked since then
    /// and found nothing to do is settled (rule 22).
    pub change: u64,
    /// Raised at each grasp, release and new constraint: what lifts bars (rule 21).
    pub placements: u64,
    /// Version of the hard-constraint table in force; 0 is the empty table.
    pub constraints_version: u32,
    /// Version of the hard-constraint table when this epoch opened; selection uses this one.
    pub epoch_constraints_version: u32,
    /// Version of the schedule in force; 0 is none.
    pub schedule_version: u32,
    /// Participants that were computing in the tick before (robots and planner): who shares one
    /// computer (rule 24).
    pub busy: u32,
    /// Live robots in `robots`.
    pub robot_count: u32,
    /// Live objects in `objects`.
    pub object_count: u32,
    /// An [`Outcome`].
    pub outcome: u32,
    /// 1 while all motion is held.
    pub held: u32,
    /// Version of the scenario in force: 0 at the start, one more with each change.
    pub scene_version: u32,
    /// Always 0.
    pub reserved: u32,
}

/// One robot.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct RobotState {
    /// Centre of the robot.
    pub position: Point,
    /// Where it was when this epoch opened.
    pub epoch_position: Point,
    /// Sequence number of the newest command taken.
    pub acknowledged: u64,
    /// Claimed task, or [`NONE`].
    pub task: u32,
    /// Held object, or [`NONE`].
    pub holding: u32,
    /// A [`Phase`], as the robot's newest command said.
    pub phase: u32,
    /// An [`Activity`]: what it did in the tick that led here.
    pub activity: u32,
    /// 1 if it was free (no held object) when this epoch opened and alive.
    pub epoch_free: u32,
    /// 1 while its process takes part.
    pub live: u32,
    /// Incarnation of its process whose commands are taken.
    pub incarnation: u32,
    /// Id of the newest path request taken, 0 for none yet.
    pub request: u32,
    /// 1 while part of that request is not granted yet.
    pub request_open: u32,
    /// Live points in `grant`.
    pub grant_count: u32,
    /// Actions of its schedule that are granted to it, counted from the start of the run.
    pub actions: u32,
    /// Always 0.
    pub reserved: u32,
    /// Corner points of the granted path still ahead, from the next one on: `position`, then
    /// these, is the polyline it will move along. Unused points are zero.
    pub grant: [Point; MAX_PATH_POINTS],
}

/// One object, and the task that brings it to its goal.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct ObjectState {
    /// Centre of the object.
    pub position: Point,
    /// Where it last stood on the ground: its "initial" configuration (rule 9).
    pub rest: Point,
    /// Its goal; meaningless where `has_goal` is 0.
    pub goal: Point,
    /// 1 if it has a goal.
    pub has_goal: u32,
    /// Robot that holds it, or [`NONE`].
    pub holder: u32,
    /// Robot that has claimed its task, or [`NONE`].
    pub claimed_by: u32,
    /// A [`TaskStatus`].
    pub status: u32,
    /// A [`TaskStatus`]: as it was when this epoch opened.
    pub epoch_status: u32,
    /// Failures reported of this task so far.
    pub failures: u32,
    /// How often it has been put down so far.
    pub put_downs: u32,
    /// Always 0.
    pub reserved: u32,
    /// Bit r set: barred for robot r (rule 21).
    pub barred: [u64; ROBOT_WORDS],
    /// `barred` as it was when this epoch opened.
    pub epoch_barred: [u64; ROBOT_WORDS],
}

/// The world's state at one tick. Too large for the stack: written in place in a loan, or made
/// with [`crate::zeroed`].
#[derive(FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct WorldSnapshot {
    /// Tick, versions, counts.
    pub header: SnapshotHeader,
    /// The first `header.robot_count` are live.
    pub robots: [RobotState; MAX_ROBOTS],
    /// The first `header.object_count` are live.
    pub objects: [ObjectState; MAX_OBJECTS],
}

impl SnapshotHeader {
    /// Adds all that is state: everything but the transport's stamp and the hash itself.
    pub fn hash_into(&self, hash: &mut StateHash) {
        hash.add(&Self {
            publish_stamp_ns: 0,
            state_hash: 0,
            ..*self
        });
    }
}

impl Default for SnapshotHeader {
    fn default() -> Self {
        Self {
            magic: MAGIC,
            layout_version: LAYOUT_VERSION,
            ..zerocopy::FromZeros::new_zeroed()
        }
    }
}

impl Default for RobotState {
    fn default() -> Self {
        Self {
            task: NONE,
            holding: NONE,
            ..zerocopy::FromZeros::new_zeroed()
        }
    }
}

impl Default for ObjectState {
    fn default() -> Self {
        Self {
            holder: NONE,
            claimed_by: NONE,
            ..zerocopy::FromZeros::new_zeroed()
        }
    }
}

impl RobotState {
    /// Corner points of the granted path still ahead.
    #[must_use]
    pub fn grant(&self) -> &[Point] {
        &self.grant[..(self.grant_count as usize).min(MAX_PATH_POINTS)]
    }
}

impl ObjectState {
    /// Whether the task was barred for `robot` when this epoch opened.
    #[must_use]
    pub fn was_barred(&self, robot: usize) -> bool {
        self.epoch_barred[robot / 64] >> (robot % 64) & 1 == 1
    }
}

impl WorldSnapshot {
    /// Adds the live part, in canonical order.
    ///
    /// # Panics
    /// When the counts exceed the capacities: hash only what was checked or made here.
    pub fn hash_into(&self, hash: &mut StateHash) {
        self.header.hash_into(hash);
        hash.add(&self.robots[..self.header.robot_count as usize]);
        hash.add(&self.objects[..self.header.object_count as usize]);
    }
}

const _: () = assert!(size_of::<RobotState>() == 88 + 16 * MAX_PATH_POINTS);
const _: () = assert!(size_of::<ObjectState>() == 112);
const _: () = assert!(size_of::<WorldSnapshot>() < 200 * 1024);
