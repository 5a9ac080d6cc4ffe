//! What the invariants have found clear, so that they look again only at what has changed.
//!
//! Responsible for: for each robot the *way* that was looked at last, from where it stood along all
//! that was granted to it, and whether it has left it since. Not responsible for: looking
//! (`invariants.rs`).
//!
//! Nothing tells it of changes: it compares what is with what was looked at, value by value. A way
//! is as good as new while the robot is on it, its grant is no more than what is left of it, and
//! all else that the answer depends on is the same ([`Terms`]).

use scene::{Scene, Vec2};
use shm_types::capacity::MAX_PATH_POINTS;

use crate::bodies::Bodies;
use crate::broad::Aabb;
use crate::path::ARRIVAL_M;
use crate::state::{Hand, Leaving, Robot};

/// As far off a straight line (m) rounding may lead in one tick: over as many ticks as one piece
/// of path takes it stays far below what divides touching from overlap.
const ON_LINE_M: f64 = ARRIVAL_M / 1_000.0;

/// What decides on an overlap besides where the robot is. Short and without ways to be absent,
/// since it is made and compared in every tick.
#[derive(Clone, Copy, Debug)]
struct Terms {
    /// What its hand does, with what, and by which grasp: that is the class of the body.
    hand: (u64, usize),
    grasp: usize,
    /// The rest says what of the objects is an obstacle to it, and that none has come.
    put_downs: u64,
    /// What it claims plus 1, or 0.
    claim: usize,
    leaving: Leaving,
}

impl Terms {
    /// Of no robot: nothing is put down so often.
    const NONE: Self = Self {
        hand: (0, 0),
        grasp: 0,
        put_downs: u64::MAX,
        claim: 0,
        leaving: Leaving::NONE,
    };

    #[inline]
    fn of(bodies: &Bodies, robot: &Robot) -> Self {
        Self {
            hand: match robot.hand {
                Hand::Empty => (0, 0),
                Hand::Closing { object, .. } => (1, object),
                Hand::Holding { object } => (2, object),
                Hand::Opening { object, .. } => (3, object),
            },
            grasp: robot.grasp,
            put_downs: bodies.ground.put_downs(),
            claim: robot.claim.map_or(0, |claim| claim.task + 1),
            leaving: robot.leaving,
        }
    }

    /// Whether they are the same, all compared at once: they mostly are.
    #[inline]
    fn are(&self, other: &Self) -> bool {
        (self.hand.0 == other.hand.0)
            & (self.hand.1 == other.hand.1)
            & (self.grasp == other.grasp)
            & (self.put_downs == other.put_downs)
            & (self.claim == other.claim)
            & (self.leaving == other.leaving)
    }
}

/// What is to be looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Change {
    /// In this tick the robot was where it was not known to be clear.
    pub(crate) strayed: bool,
    /// Number of the first piece of its grant that is not known to be clear.
    pub(crate) new_from: usize,
    /// Where on that piece what is not known begins.
    pub(crate) start: Vec2,
}

/// One robot's way. In this order, so that what every tick reads lies together: after the
/// planner has worked it has to be fetched from far off.
#[derive(Clone, Debug)]
#[repr(C)]
pub(crate) struct Cleared {
    /// On which terms; [`Terms::NONE`] if nothing is clear.
    terms: Terms,
    /// Where the robot is on it.
    at: Vec2,
    /// Whether something has changed since.
    has_changed: bool,
    /// Its corners that are still ahead.
    count: usize,
    corners: [Vec2; MAX_PATH_POINTS],
    /// Box of what the body covers on it.
    region: Aabb,
    /// What has changed, if anything has, and where the robot is now.
    change: Change,
    now: Aabb,
}

impl Cleared {
    /// Nothing is.
    pub(crate) fn nothing() -> Self {
        let nowhere = Aabb::around(Vec2::zeros(), Vec2::zeros());
        Self {
            terms: Terms::NONE,
            at: Vec2::zeros(),
            has_changed: false,
            count: 0,
            corners: [Vec2::zeros(); MAX_PATH_POINTS],
            region: nowhere,
            change: Change {
                strayed: true,
                new_from: 0,
                start: Vec2::zeros(),
            },
            now: nowhere,
        }
    }

    /// Compares where `robot` was in this tick, and what is granted to it, with the way. Whether
    /// what is in its hand, on the ground, and waived for it is the same.
    #[inline]
    pub(crate) fn compare(&mut self, scene: &Scene, bodies: &Bodies, robot: &Robot) -> bool {
        let known = self.terms.are(&Terms::of(bodies, robot));
        let strayed = !known || !self.follow(robot.track.corners());
        if strayed || !are_same(self.ahead(), robot.grant.points()) {
            self.find_change(scene, bodies, robot, strayed);
        } else {
            self.has_changed = false;
        }
        known
    }

    /// What is left of the way.
    fn ahead(&self) -> &[Vec2] {
        &self.corners[..self.count]
    }

    /// Says what of the grant is new, and drops what of the way is not part of it: what was given
    /// back is no longer clear, somebody else may get it.
    #[cold]
    fn find_change(&mut self, scene: &Scene, bodies: &Bodies, robot: &Robot, strayed: bool) {
        let points = robot.grant.points();
        let left = if strayed { &[] } else { self.ahead() };
        let same = points
            .iter()
            .zip(left)
            .take_while(|&(&a, &b)| is_same(a, b));
        let new_from = same.count();
        let before = new_from
            .checked_sub(1)
            .map_or(robot.position, |last| points[last]);
        // A piece that goes on beyond where it ended is as clear as it was up to there.
        let ended = (left.get(new_from).zip(points.get(new_from)))
            .filter(|&(&ended, &point)| is_between(before, point, ended));
        let start = ended.map_or(before, |(&ended, _)| ended);
        self.count = new_from;
        self.has_changed = strayed || new_from < points.len();
        if self.has_changed {
            self.change = Change {
                strayed,
                new_from,
                start,
            };
            let places = robot.track.corners().iter().map(|&(_, place)| place);
            let places = places.chain(points.iter().copied());
            self.now = bodies.region_along(robot.class(scene), robot.position, places);
        }
    }

    /// What has changed since the way was looked at, if anything has.
    pub(crate) fn change(&self) -> Option<Change> {
        self.has_changed.then_some(self.change)
    }

    /// Box that holds all that the body has covered in this tick and may cover on its grant.
    pub(crate) fn region(&self) -> Aabb {
        if self.has_changed {
            self.now
        } else {
            self.region
        }
    }

    /// What was compared is clear, of the grant the first `clear` points.
    pub(crate) fn accept(&mut self, bodies: &Bodies, robot: &Robot, clear: usize) {
        self.terms = Terms::of(bodies, robot);
        self.region = self.now;
        self.at = robot.position;
        self.corners[..clear].copy_from_slice(&robot.grant.points()[..clear]);
        self.count = clear;
    }

    /// Goes along the way with a tick's motion, corner by corner, and leaves behind what is
    /// passed; `false` as soon as that is somewhere else.
    #[inline]
    fn follow(&mut self, track: &[(f64, Vec2)]) -> bool {
        let Some((&(_, start), rest)) = track.split_first() else {
            return false;
        };
        is_same(start, self.at) && rest.iter().all(|&(_, place)| self.go_to(place))
    }

    /// Goes on straight to `place`; `false` if the way does not lead there.
    #[inline]
    fn go_to(&mut self, place: Vec2) -> bool {
        let ahead = self.ahead();
        let Some(&corner) = ahead.first() else {
            return false;
        };
        if is_same(corner, place) {
            let passed = ahead.iter().take_while(|&&c| is_same(c, place)).count();
            self.corners.copy_within(passed..self.count, 0);
            self.count -= passed;
        } else if !is_between(self.at, corner, place) {
            return false;
        }
        self.at = place;
        true
    }
}

/// Whether two points are the same: what `==` says, in a tenth of the instructions.
#[inline]
pub(crate) fn is_same(point: Vec2, other: Vec2) -> bool {
    (point.x == other.x) & (point.y == other.y)
}

/// The same of two lists of points.
#[inline]
fn are_same(points: &[Vec2], others: &[Vec2]) -> bool {
    let mut pairs = points.iter().zip(others);
    points.len() == others.len() && pairs.all(|(&a, &b)| is_same(a, b))
}

/// Whether `place` is on the straight line from `from` to `to`.
pub(crate) fn is_between(from: Vec2, to: Vec2, place: Vec2) -> bool {
    if is_same(place, from) || is_same(place, to) {
        return true;
    }
    let (along, off) = (to - from, place - from);
    let square = along.norm_squared();
    let (cross, dot) = (along.perp(&off), along.dot(&off));
    cross * cross <= ON_LINE_M * ON_LINE_M * square && 0.0 < dot && dot < square
}
