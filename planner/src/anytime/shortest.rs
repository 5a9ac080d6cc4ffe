//! A shortest plan of a small room in which every step and every grip takes as long.
//!
//! Responsible for: the least number of steps in which robots that all move at the same time bring
//! every object to its goal, and themselves home; or that there is no plan with fewer steps than
//! one that is known.
//! Not responsible for: rooms of any other kind (`solver`).
//!
//! How: breadth first over joint configurations from both ends, a level of the side with less to do
//! at a time. Every step can be made backwards, so both sides use the same steps. In a step each
//! robot stays, moves to one of four neighbours, grasps or releases. Two robots may be no nearer
//! than their bodies allow at any end of their steps, but robots that go the same way may follow
//! one another closely.
//! Source: rule 34.

mod closed;
#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::rc::Rc;

use foldhash::fast::FixedState;
use scene::{ROBOT_ALONE, Scene};

use crate::anytime::ground::{Ground, Time, duration};
use crate::anytime::joint::JointMove;
use crate::anytime::shortest::closed::{Closed, MOST_CELLS};
use crate::anytime::track::{Place, Start};

/// Most configurations that are kept.
const MOST_CONFIGURATIONS: usize = 2_000_000;
/// Longest a grip may take beside a step, so that both count as one.
const MOST_GRIP_BY_STEP: f64 = 1.1;
/// No cell, no object.
const NONE: u8 = u8::MAX;
/// Bytes of a configuration: by robot its cell and what it holds, then by object its cell.
const BYTES: usize = 16;
/// As many robots fit into them.
const MOST_ROBOTS: usize = BYTES / 2;

type Configuration = [u8; BYTES];

/// What robots do in one step.
pub(crate) type JointStep = Vec<(usize, JointMove)>;

/// What came of the search.
pub(crate) enum Least {
    /// The steps of a shortest plan.
    Plan(Vec<JointStep>),
    /// No plan has fewer steps than the one that is known.
    NoneShorter,
    /// There are too many configurations.
    TooMany,
    /// The search goes on.
    Open,
}

/// Configurations seen from one end.
struct Side {
    /// In the order in which they were seen, each with the number of the one before it.
    list: Vec<(Configuration, u32)>,
    /// The next to look at, and the end of its level.
    next: usize,
    end: usize,
    depth: u32,
}

/// The search.
pub(crate) struct Shortest {
    robots: usize,
    objects: usize,
    /// Plans have to have fewer steps.
    limit: u32,
    closed: Closed,
    sides: [Side; 2],
    /// Which side is being gone on with.
    side: usize,
    /// Twice the number in the list of its side, and one more if that is the second.
    known: HashMap<Configuration, u32, FixedState>,
    /// By robot: directions in which it can step, if no other robot is in the way.
    steps: [u8; MOST_ROBOTS],
    found: Vec<Configuration>,
}

impl Shortest {
    /// None if the room is of another kind, or has too many points, robots or objects. Plans have
    /// to be shorter than `known`.
    pub(crate) fn new(
        scene: &Scene,
        ground: &Ground,
        start: &Start,
        homes: &[u32],
        goals: &[Option<Rc<Place>>],
        known: Time,
    ) -> Option<Self> {
        let (robots, objects) = (homes.len(), goals.len());
        let step = f64::from(duration(0));
        let is_step = |grip: Time| (1.0..MOST_GRIP_BY_STEP).contains(&(f64::from(grip) / step));
        let alone = ground.walls(ROBOT_ALONE.0);
        let has_diagonal = (0..ground.points() as u32).any(|cell| alone.steps(cell) >> 4 != 0);
        let in_steps = !has_diagonal && is_step(ground.grasp) && is_step(ground.release);
        let exact = scene.lattice.exact && scene.robot.clearance_m == 0.0;
        // Otherwise it would matter who came for an object and who has put it down.
        let is_plain = |object: usize| {
            let passes = scene.objects[object].pass_under;
            scene.is_plain(object) && (passes || !scene.lifts_from_below(object))
        };
        let is_plain = scene.before.is_empty() && (0..objects).all(is_plain);
        let fits = ground.points() <= MOST_CELLS && 2 * robots + objects <= BYTES;
        if !(in_steps && exact && is_plain && fits) {
            return None;
        }
        let mut ends = [[NONE; BYTES]; 2];
        for (robot, (track, &home)) in start.robots.iter().zip(homes).enumerate() {
            if track.is_gone || !track.deeds.is_empty() {
                return None;
            }
            ends[0][2 * robot] = track.free.0 as u8;
            ends[1][2 * robot] = home as u8;
        }
        for (object, (goal, (place, _))) in goals.iter().zip(&start.objects).enumerate() {
            // Clutter could end anywhere.
            let goal = goal.as_ref().filter(|goal| goal.is_open())?;
            if !place.is_open() {
                return None;
            }
            ends[0][2 * robots + object] = place.grasp as u8;
            ends[1][2 * robots + object] = goal.grasp as u8;
        }
        let seen = [(ends[0], 0), (ends[1], 1)];
        Some(Self {
            robots,
            objects,
            limit: known / duration(0),
            closed: Closed::new(scene, ground),
            sides: ends.map(Side::new),
            side: 0,
            known: seen.into_iter().collect(),
            steps: [0; MOST_ROBOTS],
            found: Vec::new(),
        })
    }

    /// Configurations seen.
    pub(crate) fn seen(&self) -> usize {
        self.sides.iter().map(|side| side.list.len()).sum()
    }

    /// Looks at so many configurations more.
    pub(crate) fn advance(&mut self, ground: &Ground, count: usize) -> Least {
        for _ in 0..count {
            let side = &self.sides[self.side];
            if side.next == side.end && !self.begin_level() {
                return Least::NoneShorter;
            }
            let side = &mut self.sides[self.side];
            let index = side.next;
            side.next += 1;
            let at = side.list[index].0;
            self.look_around(ground, &at);
            let found = std::mem::take(&mut self.found);
            for then in &found {
                let number = (2 * self.sides[self.side].list.len() + self.side) as u32;
                let seen = *self.known.entry(*then).or_insert(number);
                if seen == number {
                    self.sides[self.side].list.push((*then, index as u32));
                } else if seen as usize % 2 != self.side {
                    return Least::Plan(self.trace(ground, index, seen / 2));
                }
            }
            self.found = found;
            if self.seen() > MOST_CONFIGURATIONS {
                return Least::TooMany;
            }
        }
        Least::Open
    }

    /// Goes on with the side that has less to do. False if no plan can be short enough any more.
    fn begin_level(&mut self) -> bool {
        let width = |side: &Side| side.list.len() - side.end;
        if self.sides[self.side].next > 0 {
            self.sides[self.side].depth += 1;
        }
        self.side = usize::from(width(&self.sides[1]) < width(&self.sides[0]));
        let depth: u32 = self.sides.iter().map(|side| side.depth).sum();
        let side = &mut self.sides[self.side];
        side.end = side.list.len();
        side.next < side.end && depth + 1 < self.limit
    }

    /// Finds all that robots can do in one step.
    fn look_around(&mut self, ground: &Ground, at: &Configuration) {
        for robot in 0..self.robots {
            let (cell, class) = (at[2 * robot], class_of(ground, at[2 * robot + 1]));
            let closed = self.closed.by_objects(class, self.places(at));
            let is_open = |direction: &usize| !closed.has(next_to(ground, cell, *direction));
            let steps = ground.walls(class).steps(u32::from(cell));
            self.steps[robot] = (0..4)
                .filter(|direction| steps >> direction & 1 == 1)
                .filter(is_open)
                .fold(0, |open, direction| open | 1 << direction);
        }
        self.found.clear();
        self.choose(ground, at, at, 0);
    }

    /// Finds what `robot` and those after it can do; `then` is what those before it have done.
    fn choose(&mut self, ground: &Ground, at: &Configuration, then: &Configuration, robot: usize) {
        if robot == self.robots {
            self.found.push(*then);
            return;
        }
        let (cell, held) = (at[2 * robot], at[2 * robot + 1]);
        let go_on = |this: &mut Self, next: &Configuration| {
            if (0..robot).all(|other| this.are_clear(ground, at, next, robot, other)) {
                this.choose(ground, at, next, robot + 1);
            }
        };
        go_on(self, then);
        let steps = self.steps[robot];
        for direction in (0..4).filter(|direction| steps >> direction & 1 == 1) {
            let mut next = *then;
            next[2 * robot] = next_to(ground, cell, direction);
            go_on(self, &next);
        }
        let objects = 2 * self.robots;
        let mut next = *then;
        if held == NONE {
            let Some(object) = self.places(at).iter().position(|&place| place == cell) else {
                return;
            };
            next[2 * robot + 1] = object as u8;
            next[objects + object] = NONE;
            let carrying = ground.carrying(object, 0);
            if ground.walls(carrying).is_free(u32::from(cell))
                && !(self.closed.by_objects(carrying, self.places(&next))).has(cell)
            {
                go_on(self, &next);
            }
        } else {
            next[2 * robot + 1] = NONE;
            next[objects + usize::from(held)] = cell;
            go_on(self, &next);
        }
    }

    /// Where objects are.
    fn places<'a>(&self, at: &'a Configuration) -> &'a [u8] {
        &at[2 * self.robots..][..self.objects]
    }

    /// Whether two robots are clear of each other from one configuration to the next.
    fn are_clear(
        &self,
        ground: &Ground,
        at: &Configuration,
        then: &Configuration,
        robot: usize,
        other: usize,
    ) -> bool {
        let ends = |robot: usize| [at, then].map(|at| at[2 * robot]);
        // Who grips counts as carrying all the while.
        let class = |robot: usize| {
            let held = at[2 * robot + 1].min(then[2 * robot + 1]);
            class_of(ground, held)
        };
        let (mine, others) = (ends(robot), ends(other));
        let closed = |cell: u8| self.closed.by_robot(class(robot), class(other), cell);
        let way = |[from, to]: [u8; 2]| i16::from(to) - i16::from(from);
        if way(mine) == way(others) {
            return !closed(others[1]).has(mine[1]);
        }
        !others
            .iter()
            .any(|&cell| mine.iter().any(|&at| closed(cell).has(at)))
    }

    /// The plan that goes through a configuration and the next one, which is one of the other side.
    fn trace(&self, ground: &Ground, index: usize, then: u32) -> Vec<JointStep> {
        let (near, far) = (&self.sides[self.side], &self.sides[1 - self.side]);
        let mut path = near.back_from(index as u32);
        path.reverse();
        path.extend(far.back_from(then));
        if self.side == 1 {
            path.reverse();
        }
        let steps = path.windows(2).map(|pair| {
            let made = |robot: usize| Some((robot, self.made(ground, &pair[0], &pair[1], robot)?));
            (0..self.robots).filter_map(made).collect()
        });
        steps.collect()
    }

    /// What a robot does from one configuration to the next, if anything.
    fn made(
        &self,
        ground: &Ground,
        at: &Configuration,
        then: &Configuration,
        robot: usize,
    ) -> Option<JointMove> {
        let held = |at: &Configuration| at[2 * robot + 1];
        match (held(at), held(then)) {
            (NONE, object) if object != NONE => Some(JointMove::Grasp(u16::from(object))),
            (object, NONE) if object != NONE => Some(JointMove::Release(u16::from(object))),
            _ => {
                let offset = i32::from(then[2 * robot]) - i32::from(at[2 * robot]);
                let direction = ground.offsets.iter().position(|&step| step == offset)?;
                Some(JointMove::Step(direction as u8))
            }
        }
    }
}

/// The class of a robot that holds this, or nothing.
fn class_of(ground: &Ground, held: u8) -> usize {
    match held {
        NONE => ROBOT_ALONE.0,
        object => ground.carrying(usize::from(object), 0),
    }
}

/// The cell next to another one.
fn next_to(ground: &Ground, cell: u8, direction: usize) -> u8 {
    u32::from(cell).wrapping_add_signed(ground.offsets[direction]) as u8
}

impl Side {
    fn new(end: Configuration) -> Self {
        Self {
            list: vec![(end, u32::MAX)],
            next: 0,
            end: 0,
            depth: 0,
        }
    }

    /// From a configuration back to the end where this side began.
    fn back_from(&self, mut index: u32) -> Vec<Configuration> {
        let mut path = Vec::new();
        while index != u32::MAX {
            let (at, before) = self.list[index as usize];
            path.push(at);
            index = before;
        }
        path
    }
}
