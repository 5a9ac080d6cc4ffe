//! A complete search beneath all others: over joint configurations of all robots and objects.
//!
//! Responsible for: finding a plan wherever there is one on the lattice, or looking at every
//! configuration that can be reached, as long as there are few enough.
//! Not responsible for: good plans: robots step one at a time. Whoever follows it lets them move
//! at the same time (`publish`).
//!
//! How: greedy best-first over (cell of each robot, what it holds, cell of each object), visited
//! configurations kept. A step of one robot, a grasp and a release are the moves. A configuration
//! in which two bodies touch is one; whether interlocked bodies could move together is not asked.
//!
//! Terms: an object's cell is that of a robot which grasps it there.

#[cfg(test)]
mod tests;

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::rc::Rc;

use scene::{CONTACT_M, ClassId, ROBOT_ALONE, Scene};

use crate::anytime::ground::{Field, Ground, Mask, Time, offsets_of_resting};
use crate::anytime::track::{Place, Start};
use crate::frontier::STRAIGHT;

/// Most configurations that are kept.
pub(crate) const MOST_CONFIGURATIONS: usize = 1_000_000;
/// No cell, no object.
const NONE: u16 = u16::MAX;

/// A move of one robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum JointMove {
    /// A step in a direction.
    Step(u8),
    /// It grasps this object.
    Grasp(u16),
    /// It puts this object down.
    Release(u16),
}

/// What came of a search.
pub(crate) enum Found {
    /// Moves, each of one robot, in turn.
    Plan(Vec<(usize, JointMove)>),
    /// Every configuration that can be reached was looked at: there is no plan on this lattice.
    Exhausted,
    /// There are too many configurations.
    TooMany,
    /// The search goes on.
    Open,
}

/// By robot its cell, what it holds and whose room it is in; by object its cell.
type Configuration = Box<[u16]>;

/// The search.
pub(crate) struct Joint {
    robots: usize,
    width: u32,
    homes: Vec<u16>,
    /// By object: where it shall be; [`NONE`] for one that nobody can move.
    goals: Vec<Option<u16>>,
    /// By class, then cell: closed by objects that nobody can move.
    closed: Vec<Vec<bool>>,
    /// Whether an object that nobody can move, or put there, has to be elsewhere.
    is_hopeless: bool,
    /// By class, then object: offsets from the resting object.
    resting: Vec<Vec<Mask>>,
    /// By object: whether a robot that comes for it may be in its room.
    below: Vec<bool>,
    pass_under: Vec<bool>,
    to_goal: Vec<Option<Field>>,
    to_home: Vec<Field>,
    known: HashMap<Configuration, u32>,
    list: Vec<(Configuration, u32, u8, JointMove)>,
    open: BinaryHeap<Reverse<(Time, u32)>>,
}

impl Joint {
    /// None if this lattice is no exact model or has too many points, if there is a user's order, or
    /// an object that can be held in several ways or exchanged for another.
    pub(crate) fn new(
        scene: &Scene,
        ground: &mut Ground,
        start: &Start,
        homes: &[u32],
        goals: &[Option<Rc<Place>>],
    ) -> Option<Self> {
        let exact = scene.lattice.exact && scene.robot.clearance_m == 0.0;
        let is_plain = (0..scene.objects.len()).all(|object| scene.is_plain(object));
        let exact = exact && scene.before.is_empty() && is_plain;
        if !exact || ground.points() >= usize::from(NONE) {
            return None;
        }
        let objects = &scene.objects;
        let body = |class: usize| scene.body(ClassId(class));
        let resting = (0..ground.classes)
            .map(|kept| {
                (objects.iter())
                    .map(|object| {
                        let there = body(object.class.0);
                        let pitch_m = scene.lattice.pitch_m;
                        Mask::of(offsets_of_resting(body(kept), there, pitch_m))
                    })
                    .collect()
            })
            .collect();
        let mut joint = Self {
            robots: homes.len(),
            width: scene.lattice.width,
            homes: homes.iter().map(|&cell| cell as u16).collect(),
            goals: (goals.iter())
                .map(|goal| goal.as_ref().map(|place| place.grasp as u16))
                .collect(),
            closed: vec![vec![false; ground.points()]; ground.classes],
            is_hopeless: false,
            resting,
            below: (0..objects.len())
                .map(|object| scene.lifts_from_below(object))
                .collect(),
            pass_under: objects.iter().map(|object| object.pass_under).collect(),
            to_goal: (goals.iter().enumerate())
                .map(|(object, goal)| {
                    let goal = goal.as_ref().filter(|place| place.is_open())?;
                    Some(ground.field(objects[object].class.0, goal.grasp))
                })
                .collect(),
            to_home: homes
                .iter()
                .map(|&home| ground.field(ROBOT_ALONE.0, home))
                .collect(),
            known: HashMap::new(),
            list: Vec::new(),
            open: BinaryHeap::new(),
        };
        let mut first = vec![NONE; 3 * homes.len() + objects.len()];
        for (robot, track) in start.robots.iter().enumerate() {
            first[3 * robot] = track.free.0 as u16;
        }
        for (object, (place, _)) in start.objects.iter().enumerate() {
            if place.is_open() {
                first[3 * homes.len() + object] = place.grasp as u16;
                continue;
            }
            // Nobody can ever grasp it.
            let goal = objects[object].goal;
            joint.is_hopeless |= goal.is_some_and(|goal| (goal - place.at).norm() > CONTACT_M);
            joint.goals[object] = Some(NONE);
            joint.to_goal[object] = None;
            for (class, cells) in place.cells.iter().enumerate() {
                for &cell in cells {
                    joint.closed[class][cell as usize] = true;
                }
            }
        }
        let shut = |goal: &Option<Rc<Place>>| goal.as_ref().is_some_and(|goal| !goal.is_open());
        let open = |(place, _): &(Rc<Place>, u32)| place.is_open();
        joint.is_hopeless |=
            (goals.iter().zip(&start.objects)).any(|(goal, place)| shut(goal) && open(place));
        joint.offer(first.into(), (u32::MAX, 0, JointMove::Step(0)));
        Some(joint)
    }

    /// Looks at so many configurations more.
    pub(crate) fn advance(&mut self, ground: &Ground, count: usize) -> Found {
        if self.is_hopeless {
            return Found::Exhausted;
        }
        for _ in 0..count {
            let Some(Reverse((_, index))) = self.open.pop() else {
                return Found::Exhausted;
            };
            if self.is_end(&self.list[index as usize].0) {
                return Found::Plan(self.trace(index));
            }
            if self.list.len() > MOST_CONFIGURATIONS {
                return Found::TooMany;
            }
            for robot in 0..self.robots {
                self.expand(ground, index, robot);
            }
        }
        Found::Open
    }

    /// Configurations seen.
    pub(crate) fn seen(&self) -> usize {
        self.list.len()
    }

    fn objects<'a>(&self, at: &'a [u16]) -> &'a [u16] {
        &at[3 * self.robots..]
    }

    fn is_end(&self, at: &[u16]) -> bool {
        let home = |robot: usize| at[3 * robot] == self.homes[robot] && at[3 * robot + 1] == NONE;
        (0..self.robots).all(home)
            && (self.objects(at).iter().zip(&self.goals))
                .all(|(cell, goal)| goal.map_or(*cell != NONE, |goal| goal == *cell))
    }

    fn expand(&mut self, ground: &Ground, index: u32, robot: usize) {
        let at = self.list[index as usize].0.clone();
        let (cell, held) = (at[3 * robot], at[3 * robot + 1]);
        let class = match held {
            NONE => ROBOT_ALONE.0,
            object => ground.carrying(object as usize, 0),
        };
        let steps = ground.walls(class).steps(u32::from(cell));
        for direction in 0..4_u8 {
            if steps >> direction & 1 == 0 {
                continue;
            }
            let next = u32::from(cell).wrapping_add_signed(ground.offsets[direction as usize]);
            let Some(room) = self.room(ground, &at, robot, class, next) else {
                continue;
            };
            // Under an object one comes for it, or has just put it down: nobody passes.
            let was_in = at[3 * robot + 2];
            let came = was_in != NONE && was_in & 1 == 0;
            if came && room != was_in >> 1 {
                continue;
            }
            let mut then = at.clone();
            then[3 * robot] = next as u16;
            then[3 * robot + 2] = match (room, was_in) {
                (NONE, _) => NONE,
                (room, was_in) if was_in != NONE && was_in >> 1 == room => was_in,
                (room, _) => room << 1,
            };
            self.offer(then, (index, robot as u8, JointMove::Step(direction)));
        }
        if held == NONE {
            for object in 0..self.objects(&at).len() {
                if self.objects(&at)[object] == cell {
                    let mut then = at.clone();
                    then[3 * robot + 1] = object as u16;
                    then[3 * robot + 2] = NONE;
                    then[3 * self.robots + object] = NONE;
                    let class = ground.carrying(object, 0);
                    // With the object its body may meet who is under it.
                    if self
                        .room(ground, &then, robot, class, u32::from(cell))
                        .is_some()
                    {
                        self.offer(then, (index, robot as u8, JointMove::Grasp(object as u16)));
                    }
                }
            }
        } else {
            let mut then = at.clone();
            then[3 * robot + 1] = NONE;
            then[3 * robot + 2] = if self.below[held as usize] {
                held << 1 | 1
            } else {
                NONE
            };
            then[3 * self.robots + held as usize] = cell;
            self.offer(then, (index, robot as u8, JointMove::Release(held)));
        }
    }

    /// Whether a body can be at a cell: the object in whose room it then is, or [`NONE`] for
    /// nobody's; nothing if it cannot be there.
    fn room(
        &self,
        ground: &Ground,
        at: &[u16],
        robot: usize,
        class: usize,
        cell: u32,
    ) -> Option<u16> {
        if self.closed[class][cell as usize] {
            return None;
        }
        for other in 0..self.robots {
            if other == robot {
                continue;
            }
            let there = match at[3 * other + 1] {
                NONE => ROBOT_ALONE.0,
                object => ground.carrying(object as usize, 0),
            };
            if ground.meet(class, cell, there, u32::from(at[3 * other])) {
                return None;
            }
        }
        let mut room = NONE;
        for (object, &place) in self.objects(at).iter().enumerate() {
            if place == NONE || class == ROBOT_ALONE.0 && self.pass_under[object] {
                continue;
            }
            let offset = ground.offset(cell, u32::from(place));
            if self.resting[class][object].has(offset) {
                if class != ROBOT_ALONE.0 || !self.below[object] || room != NONE {
                    return None;
                }
                room = object as u16;
            }
        }
        Some(room)
    }

    fn offer(&mut self, then: Configuration, from: (u32, u8, JointMove)) {
        if self.known.contains_key(&then) {
            return;
        }
        let Some(ahead) = self.ahead(&then) else {
            return;
        };
        let index = self.list.len() as u32;
        self.known.insert(then.clone(), index);
        self.list.push((then, from.0, from.1, from.2));
        self.open.push(Reverse((ahead, index)));
    }

    /// How much is left to do, roughly; none if an object can never get to its goal from there.
    fn ahead(&self, at: &[u16]) -> Option<Time> {
        let mut ahead: Time = 0;
        for (object, field) in self.to_goal.iter().enumerate() {
            let Some(field) = field else { continue };
            let held = (0..self.robots).find(|&robot| at[3 * robot + 1] == object as u16);
            let cell = held.map_or(self.objects(at)[object], |robot| at[3 * robot]);
            ahead = ahead.saturating_add(4 * field.time(cell.into())?);
            let is_there = self.goals[object] == Some(cell);
            if held.is_none() && !is_there {
                // Somebody has yet to come.
                let far = |robot: usize| {
                    let (a, b) = (u32::from(at[3 * robot]), u32::from(cell));
                    let (w, up) = (self.width, (a / self.width).abs_diff(b / self.width));
                    (up + (a % w).abs_diff(b % w)) * STRAIGHT
                };
                let nearest = (0..self.robots).map(far).min().unwrap_or(0);
                ahead = ahead.saturating_add(nearest).saturating_add(STRAIGHT);
            }
        }
        if ahead == 0 {
            for robot in 0..self.robots {
                let field = &self.to_home[robot];
                ahead = ahead.saturating_add(field.time(at[3 * robot].into()).unwrap_or(0) / 8);
            }
        }
        Some(ahead)
    }

    fn trace(&self, mut index: u32) -> Vec<(usize, JointMove)> {
        let mut moves = Vec::new();
        loop {
            let (_, parent, robot, made) = &self.list[index as usize];
            if *parent == u32::MAX {
                break;
            }
            moves.push((*robot as usize, *made));
            index = *parent;
        }
        moves.reverse();
        moves
    }
}
