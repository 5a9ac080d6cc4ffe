//! What the world knows of each robot and each object.
//!
//! Responsible for: the records, and the enums that keep impossible states from being written.
//! Not responsible for: how they change (one file per idea), how they look on the wire
//! (`wire.rs`).

use std::num::NonZero;

use scene::{ClassId, ROBOT_ALONE, Scene, Vec2};
use shm_types::capacity::ROBOT_WORDS;
use shm_types::{Activity, Grip, Phase, TaskStatus, Wait};

use crate::ActivityTimes;
use crate::control::FIRST_INCARNATION;
use crate::path::Path;
use crate::track::Track;

/// A robot's hold on an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Hand {
    /// Nothing held.
    Empty,
    /// The grip closes around a grounded object; `ticks` are left.
    Closing { object: usize, ticks: u64 },
    /// The object is held.
    Holding { object: usize },
    /// The grip opens; `ticks` are left. The object is held until then.
    Opening { object: usize, ticks: u64 },
}

impl Hand {
    /// The object held.
    pub(crate) const fn holding(self) -> Option<usize> {
        match self {
            Self::Empty | Self::Closing { .. } => None,
            Self::Holding { object } | Self::Opening { object, .. } => Some(object),
        }
    }

    /// The object that moves as part of the robot, or is about to.
    pub(crate) const fn object(self) -> Option<usize> {
        match self {
            Self::Empty => None,
            Self::Closing { object, .. }
            | Self::Holding { object }
            | Self::Opening { object, .. } => Some(object),
        }
    }

    /// Whether the grip itself is moving.
    pub(crate) const fn is_moving(self) -> bool {
        matches!(self, Self::Closing { .. } | Self::Opening { .. })
    }
}

/// A task claimed by a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Claimed {
    pub(crate) task: usize,
    /// Epoch of the selection it comes from.
    pub(crate) epoch: u64,
}

/// Most objects a robot can be leaving at once.
const MAX_LEAVING: usize = 4;

/// Objects that a robot has given up or put down while it, or path granted to it, was still at
/// their place. They stay waived for it until it has left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Leaving([Option<NonZero<u32>>; MAX_LEAVING]);

impl Leaving {
    /// None.
    pub(crate) const NONE: Self = Self([None; MAX_LEAVING]);

    /// As an object is kept here: such slots are compared in one go, in every tick.
    const fn slot(object: usize) -> Option<NonZero<u32>> {
        NonZero::new(id(object) + 1)
    }

    fn object(slot: NonZero<u32>) -> usize {
        slot.get() as usize - 1
    }

    pub(crate) fn contains(&self, object: usize) -> bool {
        self.0.contains(&Self::slot(object))
    }

    pub(crate) fn is_full(&self) -> bool {
        self.0.iter().all(Option::is_some)
    }

    pub(crate) fn add(&mut self, object: usize) {
        if !self.contains(object)
            && let Some(free) = self.0.iter_mut().find(|slot| slot.is_none())
        {
            *free = Self::slot(object);
        }
    }

    /// Forgets those for which `left` holds.
    pub(crate) fn forget(&mut self, mut left: impl FnMut(usize) -> bool) {
        for slot in &mut self.0 {
            if slot.is_some_and(|slot| left(Self::object(slot))) {
                *slot = None;
            }
        }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().copied().flatten().map(Self::object)
    }

    pub(crate) fn slots(&self) -> [Option<usize>; MAX_LEAVING] {
        self.0.map(|slot| slot.map(Self::object))
    }

    pub(crate) fn of(slots: [Option<usize>; MAX_LEAVING]) -> Self {
        Self(slots.map(|object| object.and_then(Self::slot)))
    }
}

/// What the newest command of a robot said, and who may send one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub(crate) live: bool,
    pub(crate) incarnation: u32,
    /// Newest command taken; 0 for none yet.
    pub(crate) sequence: u64,
    pub(crate) valid_until_tick: u64,
    pub(crate) settled_at_change: u64,
    pub(crate) go: bool,
    pub(crate) grip: Grip,
    pub(crate) phase: Phase,
    pub(crate) activity: Activity,
    /// What the next action of its schedule waits for.
    pub(crate) waits_for: Wait,
}

impl Link {
    /// A participant that has said nothing yet.
    pub(crate) const fn new(incarnation: u32) -> Self {
        Self {
            live: true,
            incarnation,
            sequence: 0,
            valid_until_tick: 0,
            settled_at_change: u64::MAX,
            go: false,
            grip: Grip::Keep,
            phase: Phase::Idle,
            activity: Activity::Idle,
            waits_for: Wait::NONE,
        }
    }

    /// Whether the newest command still counts at `tick`.
    pub(crate) const fn is_fresh(&self, tick: u64) -> bool {
        self.live && self.sequence > 0 && self.valid_until_tick >= tick
    }
}

/// A failure reported and not counted yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PendingFailure {
    pub(crate) report: shm_types::Failure,
    /// World time at which it was first reported, ns.
    pub(crate) since_ns: u64,
}

/// One robot.
#[derive(Clone, Debug)]
pub(crate) struct Robot {
    pub(crate) position: Vec2,
    pub(crate) hand: Hand,
    /// Which of its grasps the object in its hand is held by; 0 while there is none.
    pub(crate) grasp: usize,
    pub(crate) claim: Option<Claimed>,
    /// Newest claim refused, so that repeating it is not counted again.
    pub(crate) refused_claim: Option<Claimed>,
    pub(crate) leaving: Leaving,
    pub(crate) link: Link,
    /// Path granted and still ahead.
    pub(crate) grant: Path,
    /// Share of its full speed that its drive gives it; less than 1 only in simulated faults.
    pub(crate) drive: f64,
    /// Path asked for and not granted.
    pub(crate) rest: Path,
    /// The last granted point lies on the way to `rest`'s first.
    pub(crate) cut: bool,
    /// Newest path request taken.
    pub(crate) request: u32,
    /// Tick at which it was taken: its age in the queue.
    pub(crate) request_tick: u64,
    /// Actions of its schedule that are granted once all that is asked for is.
    pub(crate) actions: u32,
    /// Where the last action granted ends; `None` if the robot gave up path before it got there.
    pub(crate) action_end: Option<Vec2>,
    /// Whether that request has been counted as refused.
    pub(crate) refused: bool,
    pub(crate) failure: Option<PendingFailure>,
    /// Newest failure counted or dismissed.
    pub(crate) last_failure: u32,
    pub(crate) epoch_position: Vec2,
    pub(crate) epoch_free: bool,
    /// Where it is during the present tick.
    pub(crate) track: Track,
    /// Length of the grant just before the tick's motion, m.
    pub(crate) granted_m: f64,
    /// A new command of it was taken in the tick.
    pub(crate) told: bool,
    /// Its position changed in the tick.
    pub(crate) moved: bool,
    /// Its grip was moving in the tick.
    pub(crate) gripped: bool,
    pub(crate) activity: Activity,
    pub(crate) times: ActivityTimes,
}

impl Robot {
    pub(crate) fn at_home(home: Vec2) -> Self {
        Self {
            position: home,
            hand: Hand::Empty,
            grasp: 0,
            claim: None,
            refused_claim: None,
            leaving: Leaving::default(),
            link: Link::new(FIRST_INCARNATION),
            grant: Path::EMPTY,
            drive: 1.0,
            rest: Path::EMPTY,
            cut: false,
            request: 0,
            request_tick: 0,
            actions: 0,
            action_end: Some(home),
            refused: false,
            failure: None,
            last_failure: 0,
            epoch_position: home,
            epoch_free: true,
            track: Track::still(home),
            granted_m: 0.0,
            told: false,
            moved: false,
            gripped: false,
            activity: Activity::Idle,
            times: ActivityTimes::default(),
        }
    }

    /// The class of the body that moves.
    pub(crate) fn class(&self, scene: &Scene) -> ClassId {
        self.hand.object().map_or(ROBOT_ALONE, |object| {
            scene.objects[object].grasps[self.grasp].class
        })
    }

    /// Where an object in its hand is.
    pub(crate) fn place_of(&self, scene: &Scene, object: usize) -> Vec2 {
        self.position - scene.objects[object].grasps[self.grasp].offset
    }

    /// Where its granted path ends: where it may have to stay.
    pub(crate) fn grant_end(&self) -> Vec2 {
        self.grant.last().unwrap_or(self.position)
    }

    /// Claims nothing, holds nothing, grips nothing, takes part.
    pub(crate) const fn is_idle(&self) -> bool {
        self.link.live && matches!(self.hand, Hand::Empty) && self.claim.is_none()
    }

    /// Whether the grip it asks for is not made: nothing past it is granted.
    pub(crate) const fn awaits_grip(&self) -> bool {
        matches!(
            (self.link.grip, self.hand),
            (Grip::Grasp, Hand::Empty) | (Grip::Release, Hand::Holding { .. })
        )
    }

    /// Actions of its schedule that are granted to it: each point asked for ends one.
    pub(crate) fn granted_actions(&self) -> u32 {
        self.actions.saturating_sub(self.rest.points().len() as u32)
    }

    /// Gives up all path, granted or asked for, and stays where it is. Actions it has not got to
    /// the end of are no longer granted.
    pub(crate) fn give_up_path(&mut self) {
        let part = usize::from(self.cut);
        let whole = self.grant.points().len().saturating_sub(part);
        self.drop_rest();
        self.grant.clear();
        if whole > 0 {
            self.actions = self.actions.saturating_sub(id(whole));
            self.action_end = None;
        }
    }

    /// Keeps the path granted as far as it ends actions, and drops all else.
    pub(crate) fn keep_whole_actions(&mut self) {
        if self.cut {
            self.grant.drop_last();
        }
        self.drop_rest();
    }

    /// Keeps the path granted to its end, wherever that is, and drops all else. What comes next
    /// begins there: also where an earlier process left the robot between the ends of actions.
    pub(crate) fn keep_path(&mut self) {
        self.action_end = Some(self.grant_end());
        self.drop_rest();
    }

    /// Drops what was asked for and not granted.
    pub(crate) fn drop_rest(&mut self) {
        self.actions = self.granted_actions();
        self.rest.clear();
        self.cut = false;
    }
}

/// One object and its task.
#[derive(Clone, Debug)]
pub(crate) struct Object {
    pub(crate) position: Vec2,
    /// Where it last stood on the ground.
    pub(crate) rest: Vec2,
    pub(crate) goal: Option<Vec2>,
    /// Number of its kind: objects of one kind exchange goals.
    pub(crate) kind: Option<usize>,
    pub(crate) holder: Option<usize>,
    pub(crate) claimed_by: Option<usize>,
    pub(crate) status: TaskStatus,
    pub(crate) epoch_status: TaskStatus,
    pub(crate) failures: u32,
    /// How often it has been put down.
    pub(crate) put_downs: u32,
    pub(crate) barred: [u64; ROBOT_WORDS],
    pub(crate) epoch_barred: [u64; ROBOT_WORDS],
}

impl Object {
    pub(crate) fn at_start(start: Vec2, goal: Option<Vec2>) -> Self {
        let mut object = Self {
            position: start,
            rest: start,
            goal,
            kind: None,
            holder: None,
            claimed_by: None,
            status: TaskStatus::Waiting,
            epoch_status: TaskStatus::Waiting,
            failures: 0,
            put_downs: 0,
            barred: [0; ROBOT_WORDS],
            epoch_barred: [0; ROBOT_WORDS],
        };
        object.status = object.status_on_ground();
        object.epoch_status = object.status;
        object
    }

    /// How its task stands while nobody holds or claims it: done at its goal or without one.
    pub(crate) fn status_on_ground(&self) -> TaskStatus {
        match self.goal {
            Some(goal) if !is_at(self.position, goal) => TaskStatus::Waiting,
            _ => TaskStatus::Done,
        }
    }

    pub(crate) const fn is_barred(&self, robot: usize) -> bool {
        self.barred[robot / 64] >> (robot % 64) & 1 == 1
    }
}

/// Whether a place counts as another: the same tolerance as touching (rule 18).
pub(crate) fn is_at(place: Vec2, other: Vec2) -> bool {
    (place - other).norm() <= scene::CONTACT_M
}

/// An index as it travels.
#[expect(
    clippy::cast_possible_truncation,
    reason = "counts are checked against capacities when the scene is read"
)]
pub(crate) const fn id(index: usize) -> u32 {
    index as u32
}
