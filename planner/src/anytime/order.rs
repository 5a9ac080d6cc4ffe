//! Who moves what, in which order.
//!
//! Responsible for: the moves of a sequence, lengths with the walls alone, what has to come before
//! what, how long an order takes at least, orders near another one.
//! Not responsible for: whether an order can be carried out, and how long that takes (`plan`).
//!
//! Terms: an *order* lists moves as they are committed. What has to be gone before something else
//! can pass comes first in it; robots move at the same time all the same.

use std::rc::Rc;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use scene::{ClassId, Event, Pieces, ROBOT_ALONE, Scene};
use shm_types::capacity::MAX_ROBOTS;

use crate::anytime::distances::Distances;
use crate::anytime::ground::{EVER, Field, Ground, Time};
use crate::anytime::sequence::Step;
use crate::anytime::track::{Place, Rest, Start};
use crate::frontier::NOWHERE;

/// An item of an order: an object, and the robot that moves it. An object that is moved several
/// times goes through its places in turn.
pub(crate) type Item = (u32, u32);

/// A move of one object from one of its places to the next.
#[derive(Clone, Debug)]
pub(crate) struct Hop {
    pub(crate) object: usize,
    /// Class of the robot with the object.
    pub(crate) class: usize,
    pub(crate) from: Rc<Place>,
    pub(crate) to: Rc<Place>,
}

/// The moves that have to be made, and what is known of them.
pub(crate) struct Hops {
    /// By object, its moves one after the other.
    pub(crate) list: Vec<Hop>,
    /// By object: its first move in the list, and the end of its moves.
    pub(crate) of: Vec<(usize, usize)>,
    /// By object, where it stands before its moves.
    rests: Vec<Rc<Place>>,
    /// By robot: when it is free, and where; nowhere if it is gone.
    free: Vec<(Time, Option<u32>)>,
    /// By robot: the object in whose room it is then.
    left: Vec<Option<usize>>,
    homes: Vec<u32>,
    /// By move: to its grasp.
    to_grasp: Vec<Field>,
    /// By robot: to its home.
    to_home: Vec<Field>,
    /// By move: its transfer and both grips.
    transfer: Vec<Time>,
    /// By move: which moves have to come before it.
    before: Vec<Vec<usize>>,
}

impl Hops {
    /// The moves of a sequence; none if no robot has room to hold some object as it is to be moved,
    /// before or after.
    pub(crate) fn new(
        scene: &Scene,
        ground: &mut Ground,
        start: &Start,
        homes: &[u32],
        sequence: &[Step],
    ) -> Option<Self> {
        let mut list = Vec::new();
        let mut of = Vec::new();
        let rests = start.rests();
        for (object, rest) in rests.iter().enumerate() {
            let first = list.len();
            let mut from = Rc::clone(&rest.place);
            for (_, to) in sequence.iter().filter(|(moved, _)| *moved == object) {
                list.push(Hop {
                    object,
                    class: ground.carrying(object, to.by),
                    from: from.held(to.by),
                    to: Rc::clone(to),
                });
                from = Rc::clone(to);
            }
            of.push((first, list.len()));
        }
        let can_hold = |hop: &Hop| hop.from.grasp != NOWHERE && hop.to.grasp != NOWHERE;
        if !list.iter().all(can_hold) {
            return None;
        }
        let alone = ROBOT_ALONE.0;
        let mut transfer = Vec::new();
        let mut to_grasp = Vec::new();
        for hop in &list {
            to_grasp.push(ground.field(alone, hop.from.grasp));
            let field = ground.field(hop.class, hop.to.grasp);
            let way = exact(&field, hop.from.grasp);
            transfer.push(way.saturating_add(ground.grasp + ground.release));
        }
        let to_home = homes
            .iter()
            .map(|&home| ground.field(alone, home))
            .collect();
        let free: Vec<(Time, Option<u32>)> = (start.robots.iter())
            .map(|track| (track.free.1, (!track.is_gone).then_some(track.free.0)))
            .collect();
        let in_room_of = |cell| {
            rests
                .iter()
                .position(|rest| rest.place.has_in_its_room(cell))
        };
        let left = free.iter().map(|&(_, at)| in_room_of(at?)).collect();
        let mut before = precedence(scene, ground, &list, &of, homes, &rests);
        for order in &scene.before {
            let hop = |(object, event): (usize, Event)| {
                let (first, end) = of[object];
                let moves = first < end;
                moves.then(|| {
                    if event != Event::Finish {
                        first
                    } else {
                        end - 1
                    }
                })
            };
            if let (Some(first), Some(then)) = (hop(order.first), hop(order.then))
                && first != then
            {
                before[then].push(first);
            }
        }
        Some(Self {
            list,
            of,
            rests: rests.into_iter().map(|rest| rest.place).collect(),
            free,
            left,
            homes: homes.to_vec(),
            to_grasp,
            to_home,
            transfer,
            before,
        })
    }

    pub(crate) const fn robots(&self) -> usize {
        self.homes.len()
    }

    /// The lattice point of a robot's home.
    pub(crate) fn home_of(&self, robot: usize) -> u32 {
        self.homes[robot]
    }

    /// From where a robot is free to the grasp of a move.
    fn approach(&self, robot: usize, hop: usize, far: impl Fn(&Distances, u32) -> Time) -> Time {
        let at = self.free[robot].1;
        at.map_or(EVER, |at| far(&self.to_grasp[hop], at))
    }

    /// From one move's release to the other's grasp.
    fn between(&self, hop: usize, next: usize, far: impl Fn(&Distances, u32) -> Time) -> Time {
        far(&self.to_grasp[next], self.list[hop].to.grasp)
    }

    /// From a move's release to a robot's home.
    fn back(&self, hop: usize, robot: usize, far: impl Fn(&Distances, u32) -> Time) -> Time {
        far(&self.to_home[robot], self.list[hop].to.grasp)
    }

    /// Home from where a robot is free; nothing if it is gone.
    fn home(&self, robot: usize) -> Time {
        let at = self.free[robot].1;
        at.map_or(0, |at| exact(&self.to_home[robot], at))
    }

    /// The moves of an order, in turn: number of the move, and its robot.
    fn moves_of<'a>(&self, order: &'a [Item]) -> impl Iterator<Item = (usize, usize)> + use<'a> {
        let mut progress = Progress::new(self);
        order
            .iter()
            .map(move |&item| (progress.make(item), item.1 as usize))
    }

    /// The least time that an order takes, with the walls alone; none if something in it comes too
    /// early.
    pub(crate) fn least(&self, order: &[Item]) -> Option<Time> {
        let mut last = [usize::MAX; MAX_ROBOTS];
        let mut busy: Vec<Time> = self.free.iter().map(|&(time, _)| time).collect();
        let mut done = vec![false; self.list.len()];
        for (hop, robot) in self.moves_of(order) {
            if self.before[hop].iter().any(|&before| !done[before]) {
                return None;
            }
            done[hop] = true;
            let way = match last[robot] {
                usize::MAX => self.approach(robot, hop, exact),
                before => self.between(before, hop, exact),
            };
            busy[robot] = busy[robot]
                .saturating_add(way)
                .saturating_add(self.transfer[hop]);
            last[robot] = hop;
        }
        let ends = busy.iter().enumerate().map(|(robot, busy)| {
            busy.saturating_add(match last[robot] {
                usize::MAX => self.home(robot),
                last => self.back(last, robot, exact),
            })
        });
        Some(ends.max().unwrap_or(0))
    }

    /// The least time that this order takes or one that is found from it by so many changes, with the
    /// walls alone.
    pub(crate) fn least_nearby(
        &self,
        order: &[Item],
        changes: usize,
        random: &mut ChaCha8Rng,
    ) -> Time {
        let mut best = order.to_vec();
        let mut known = self.least(order).unwrap_or(EVER);
        for attempt in 0..changes {
            let mut near = best.clone();
            for _ in 0..=attempt % 3 {
                change(&mut near, self.robots(), random);
            }
            if let Some(least) = self.least(&near).filter(|least| *least <= known) {
                (best, known) = (near, least);
            }
        }
        known
    }

    /// By move of an order: when its robot has to be home again, if that is its last one; else when
    /// it would have to be, so that all is done before `limit`.
    pub(crate) fn home_by(&self, order: &[Item], limit: Time) -> Vec<Time> {
        let moves: Vec<(usize, usize)> = self.moves_of(order).collect();
        // By robot: the move that comes next, and what it takes at least from its approach until
        // the robot is home for good, beyond the approach itself.
        let mut later: [Option<(usize, Time)>; MAX_ROBOTS] = [None; MAX_ROBOTS];
        let mut home_by = vec![limit; order.len()];
        for (place, &(hop, robot)) in moves.iter().enumerate().rev() {
            let back = self.back(hop, robot, exact);
            let ahead = later[robot].map_or(back, |(next, takes)| {
                self.between(hop, next, exact).saturating_add(takes)
            });
            home_by[place] = limit.saturating_sub(ahead.saturating_sub(back));
            later[robot] = Some((hop, self.transfer[hop].saturating_add(ahead)));
        }
        home_by
    }
}

/// Which moves of an order have been made.
pub(crate) struct Progress {
    /// By object: its next move.
    next: Vec<usize>,
    /// By robot: its last move.
    last: Vec<Option<usize>>,
}

impl Progress {
    pub(crate) fn new(hops: &Hops) -> Self {
        Self {
            next: hops.of.iter().map(|&(first, _)| first).collect(),
            last: vec![None; hops.free.len()],
        }
    }

    /// The number of an object's next move.
    pub(crate) fn next(&self, object: usize) -> usize {
        self.next[object]
    }

    /// Takes note that a robot makes the next move of an object; the number of that move.
    pub(crate) fn make(&mut self, (object, robot): Item) -> usize {
        let next = &mut self.next[object as usize];
        let made = *next;
        self.last[robot as usize] = Some(made);
        *next += 1;
        made
    }

    /// Where an object stands.
    pub(crate) fn place<'a>(&self, hops: &'a Hops, object: usize) -> &'a Rc<Place> {
        let (next, first) = (self.next[object], hops.of[object].0);
        if next == first {
            &hops.rests[object]
        } else {
            &hops.list[next - 1].to
        }
    }

    /// Where a robot begins its next move, and the object in whose room that may be; nowhere if it
    /// is gone.
    pub(crate) fn begins(&self, hops: &Hops, robot: usize) -> Option<(u32, Option<usize>)> {
        match self.last[robot] {
            None => hops.free[robot].1.map(|cell| (cell, hops.left[robot])),
            Some(last) => {
                let hop = &hops.list[last];
                Some((hop.to.grasp, Some(hop.object)))
            }
        }
    }

    /// Where a robot is that has made no move.
    pub(crate) fn unmoved(&self, hops: &Hops, robot: usize) -> Option<u32> {
        let is_moved = self.last[robot].is_some();
        hops.free[robot].1.filter(|_| !is_moved)
    }
}

/// How far an order has come that is made move by move, with the walls alone.
pub(crate) struct Clocks {
    progress: Progress,
    done: Vec<bool>,
    /// By robot: how long it is busy.
    busy: Vec<Time>,
}

impl Clocks {
    pub(crate) fn new(hops: &Hops) -> Self {
        Self {
            progress: Progress::new(hops),
            done: vec![false; hops.list.len()],
            busy: hops.free.iter().map(|&(time, _)| time).collect(),
        }
    }

    /// Whether something has to come before the next move of an object that has not.
    pub(crate) fn is_early(&self, hops: &Hops, object: usize) -> bool {
        let before = &hops.before[self.progress.next(object)];
        before.iter().any(|&before| !self.done[before])
    }

    /// When a robot would be home again after the next move of an object; [`EVER`] if it has no
    /// way.
    pub(crate) fn home_by(&self, hops: &Hops, object: usize, robot: usize) -> Time {
        self.home_by_as(hops, object, robot, exact)
    }

    /// When at the earliest, without a look for ways.
    pub(crate) fn home_by_at_least(&self, hops: &Hops, object: usize, robot: usize) -> Time {
        self.home_by_as(hops, object, robot, Distances::least)
    }

    fn home_by_as(
        &self,
        hops: &Hops,
        object: usize,
        robot: usize,
        far: impl Fn(&Distances, u32) -> Time + Copy,
    ) -> Time {
        let hop = self.progress.next(object);
        let done = self.released_by(hops, hop, robot, far);
        done.saturating_add(hops.back(hop, robot, far))
    }

    fn released_by(
        &self,
        hops: &Hops,
        hop: usize,
        robot: usize,
        far: impl Fn(&Distances, u32) -> Time,
    ) -> Time {
        let busy = self.busy[robot];
        let way = match self.progress.last[robot] {
            None => hops.approach(robot, hop, far),
            Some(before) => hops.between(before, hop, far),
        };
        busy.saturating_add(way).saturating_add(hops.transfer[hop])
    }

    /// Takes note that a robot makes the next move of an object.
    pub(crate) fn make(&mut self, hops: &Hops, object: usize, robot: usize) {
        let hop = self.progress.next(object);
        self.busy[robot] = self.released_by(hops, hop, robot, exact);
        self.progress.make((object as u32, robot as u32));
        self.done[hop] = true;
    }
}

/// How far it is from a lattice point; [`EVER`] if there is no way.
fn exact(field: &Distances, from: u32) -> Time {
    field.time(from).unwrap_or(EVER)
}

/// Which moves have to come before which: single objects that are in the way where they start, or
/// where they end.
fn precedence(
    scene: &Scene,
    ground: &Ground,
    list: &[Hop],
    of: &[(usize, usize)],
    homes: &[u32],
    rests: &[Rest],
) -> Vec<Vec<usize>> {
    let mut before = vec![Vec::new(); list.len()];
    for (number, hop) in list.iter().enumerate() {
        if number > of[hop.object].0 {
            before[number].push(number - 1);
        }
    }
    for class in 0..ground.classes {
        let mut pieces = Pieces::new(scene, ClassId(class));
        for (shape, at) in &ground.obstacles {
            pieces.block(scene, shape, *at, true);
        }
        let alone = class == ROBOT_ALONE.0;
        let hinders = |pieces: &Pieces, hop: &Hop| {
            if alone {
                let at_home = |cell: u32| {
                    let piece = pieces.piece(cell);
                    piece.is_some() && homes.iter().any(|&home| pieces.piece(home) == piece)
                };
                !at_home(hop.from.grasp) || !at_home(hop.to.grasp)
            } else {
                let piece = pieces.piece(hop.from.grasp);
                piece.is_none() || piece != pieces.piece(hop.to.grasp)
            }
        };
        let concerned: Vec<usize> = (0..list.len())
            .filter(|&number| {
                let hop = &list[number];
                alone || hop.class == class
            })
            .filter(|&number| !hinders(&pieces, &list[number]))
            .collect();
        for (object, &(first, end)) in of.iter().enumerate() {
            let spec = &scene.objects[object];
            if alone && spec.pass_under {
                continue;
            }
            let shape = &spec.shape;
            let mut note = |at, is_start: bool| {
                pieces.block(scene, shape, at, true);
                for &number in &concerned {
                    if list[number].object == object || !hinders(&pieces, &list[number]) {
                        continue;
                    }
                    if is_start && first < end {
                        before[number].push(first);
                    } else if !is_start {
                        before[end - 1].push(number);
                    }
                }
            };
            note(rests[object].place.at, true);
            if first < end {
                note(list[end - 1].to.at, false);
            }
        }
    }
    for row in &mut before {
        row.sort_unstable();
        row.dedup();
    }
    before
}

/// Changes an order a little: moves an item elsewhere, exchanges two, or gives one to another
/// robot.
pub(crate) fn change(order: &mut Vec<Item>, robots: usize, random: &mut ChaCha8Rng) {
    let count = order.len();
    if count == 0 {
        return;
    }
    match random.random_range(0..if robots > 1 { 4 } else { 2 }) {
        0 => {
            let item = order.remove(random.random_range(0..count));
            order.insert(random.random_range(0..count), item);
        }
        1 => order.swap(random.random_range(0..count), random.random_range(0..count)),
        2 => order[random.random_range(0..count)].1 = random.random_range(0..robots) as u32,
        _ => {
            let mut item = order.remove(random.random_range(0..count));
            item.1 = random.random_range(0..robots) as u32;
            order.insert(random.random_range(0..count), item);
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::anytime::solver::testing::planned;

    #[test]
    fn an_order_in_which_one_robot_does_everything_is_far_from_the_least_nearby() {
        let (_, solver, _) = planned(&scene::GenerateOptions {
            robots: 4,
            area_m2: 60.0,
            crowding: 0.2,
            ..scene::GenerateOptions::default()
        });
        let (hops, order) = solver.current.clone().unwrap();
        let by_one: Vec<Item> = order.iter().map(|&(object, _)| (object, 0)).collect();
        let random = || ChaCha8Rng::seed_from_u64(1);
        let alone = hops.least(&by_one).unwrap();
        assert_eq!(hops.least_nearby(&by_one, 0, &mut random()), alone);
        let nearby = hops.least_nearby(&by_one, 400, &mut random());
        assert!(nearby < alone * 3 / 4, "{nearby} and {alone}");
        // No order is found that the moves do not allow.
        assert!(nearby >= *hops.transfer.iter().max().unwrap());
    }
}
