//! Path search: A* over the lattice points that are free for one class of bodies (rule 8).
//!
//! Responsible for: shortest lattice paths, resumable within a budget, the same path whatever
//! the budgets; exact ends off the lattice.
//! Not responsible for: what is an obstacle to what (`obstacles`), which steps are free
//! (`scene::Occupancy`), time and other robots' motion (crate `world`).
//!
//! Terms: a path is a polyline of robot centres. One unit is one cell expanded. Among equally
//! long paths the one found first counts, and what is found first depends on nothing but the
//! occupancy and the ends.

use std::task::Poll;

use scene::{Budget, Connectivity, Lattice, Occupancy, Scene, Vec2};
use shm_types::Counters;

use crate::frontier::{DIAGONAL, Frontier, NOWHERE, STRAIGHT};
use crate::joints::{Joints, are_close};
use crate::meter::Meter;

/// Two pieces of a path are one when they span less than this area, m²: far below what
/// rounding leaves of a bend between lattice points, far above what it adds to none.
const STRAIGHT_M2: f64 = 1e-12;

/// The directions of `Occupancy::steps`, as columns and rows.
pub(crate) const DIRECTIONS: [(i32, i32); 8] = [
    (1, 0),
    (0, 1),
    (-1, 0),
    (0, -1),
    (1, 1),
    (-1, 1),
    (-1, -1),
    (1, -1),
];

/// What a step in each of these directions costs.
pub(crate) const STEP_COSTS: [u32; 8] = [
    STRAIGHT, STRAIGHT, STRAIGHT, STRAIGHT, DIAGONAL, DIAGONAL, DIAGONAL, DIAGONAL,
];

/// For a step in each direction from a point with these free steps: the directions from its end
/// that lead to none of the points which the first one offered itself. Those are no further from
/// it directly than by way of the end, so offering them again would be in vain.
static FRESH: [[u8; 256]; 8] = fresh();

/// The directions worth trying after a step in `direction` from a point with `free` steps.
#[inline]
pub(crate) fn fresh_after(direction: usize, free: u8) -> u8 {
    FRESH[direction][free as usize]
}

const fn fresh() -> [[u8; 256]; 8] {
    let mut table = [[0; 256]; 8];
    let mut index = 0;
    while index < 8 * 256 * 8 {
        let (step, free, next) = (index / (256 * 8), index / 8 % 256, index % 8);
        let x = DIRECTIONS[step].0 + DIRECTIONS[next].0;
        let y = DIRECTIONS[step].1 + DIRECTIONS[next].1;
        let mut offered = x == 0 && y == 0;
        let mut direction = 0;
        while direction < 8 {
            let is_there = DIRECTIONS[direction].0 == x && DIRECTIONS[direction].1 == y;
            offered |= is_there && free >> direction & 1 == 1;
            direction += 1;
        }
        if !offered {
            table[step][free] |= 1 << next;
        }
        index += 1;
    }
    table
}

/// How a search stands.
#[derive(Clone, Copy, Debug)]
enum State {
    /// Searching; the best way to the goal so far: its cost and its last lattice point.
    Open(Option<(u32, u32)>),
    /// Found (its length, m), or there is none.
    Done(Option<f64>),
}

/// Lattice points that any path to the goal ends at: a rectangle of columns and rows.
#[derive(Clone, Copy, Debug, Default)]
struct Target {
    low: (u32, u32),
    high: (u32, u32),
}

/// A resumable path search with its buffers. Block what stands in the way with
/// [`PathSearch::occupancy`], then [`PathSearch::begin`], then [`PathSearch::advance`] until
/// it is ready.
#[derive(Clone, Debug)]
pub struct PathSearch {
    occupancy: Occupancy,
    frontier: Frontier,
    starts: Joints,
    ends: Joints,
    target: Target,
    from: Vec2,
    to: Vec2,
    state: State,
    path: Vec<Vec2>,
    counted: bool,
    meter: Meter,
}

impl PathSearch {
    /// A search in `scene`; all memory it will ever use is allocated here.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let points = scene.lattice.len();
        Self {
            occupancy: Occupancy::new(scene),
            frontier: Frontier::new(points),
            starts: Joints::new(),
            ends: Joints::new(),
            target: Target::default(),
            from: Vec2::zeros(),
            to: Vec2::zeros(),
            state: State::Done(None),
            path: Vec::with_capacity(points + 2),
            counted: true,
            meter: Meter::default(),
        }
    }

    /// What the next search may not touch.
    pub fn occupancy(&mut self) -> &mut Occupancy {
        &mut self.occupancy
    }

    /// Owes `units` for entering obstacles; paid before the search goes on.
    pub fn charge(&mut self, units: u64) {
        self.meter.charge(units);
    }

    /// Begins a search between two robot centres, m, against the occupancy as it is.
    pub fn begin(&mut self, scene: &Scene, from: Vec2, to: Vec2) {
        self.from = from;
        self.to = to;
        self.counted = false;
        self.path.clear();
        self.frontier.begin();
        self.state = State::Open(None);
        self.starts.find(scene, &self.occupancy, from);
        self.ends.find(scene, &self.occupancy, to);
        if let Some(length) = self.straight(scene) {
            self.path.push(from);
            if from != to {
                self.path.push(to);
            }
            self.state = State::Done(Some(length));
            return;
        }
        if self.ends.list().is_empty() {
            self.state = State::Done(None);
            return;
        }
        self.target = Target::around(&self.ends, scene.lattice.width);
        for joint in self.starts.list() {
            let place = split(joint.cell, scene.lattice.width);
            let bound = self.target.bound(place, scene.lattice.connectivity);
            self.frontier
                .offer(joint.cell, NOWHERE, joint.cost, u8::MAX, || bound);
        }
    }

    /// Goes on within `budget`. Ready with the path's length, m, or with `None` when there is
    /// no path; ready again, at no cost, until the next [`PathSearch::begin`].
    pub fn advance(
        &mut self,
        scene: &Scene,
        budget: &mut Budget,
        counters: &mut Counters,
    ) -> Poll<Option<f64>> {
        if !self.counted {
            self.counted = true;
            counters.path_plans += 1;
        }
        if !self.meter.settle(budget) && self.meter.is_owing() {
            return Poll::Pending;
        }
        let State::Open(mut best) = self.state else {
            return self.poll();
        };
        while let Some(key) = self.frontier.least_key() {
            if best.is_some_and(|(cost, _)| cost <= key) {
                break;
            }
            if budget.is_spent() {
                self.state = State::Open(best);
                return Poll::Pending;
            }
            let Some((cell, cost, fresh)) = self.frontier.take() else {
                break;
            };
            if let Some(joint) = self.ends.at(cell) {
                let whole = cost + joint.cost;
                if best.is_none_or(|(least, _)| whole < least) {
                    best = Some((whole, cell));
                }
                if joint.cost == 0 {
                    break;
                }
            }
            budget.spend(1);
            counters.cells_expanded += 1;
            self.open(scene, cell, cost, fresh);
        }
        let length = best.map(|(_, cell)| self.trace(scene, cell));
        self.state = State::Done(length);
        self.poll()
    }

    /// The path found: its corner points, m, from start to end; a single point when both are
    /// the same; empty when there is none or the search still goes on.
    #[must_use]
    pub fn path(&self) -> &[Vec2] {
        &self.path
    }

    fn poll(&self) -> Poll<Option<f64>> {
        match self.state {
            State::Open(_) => Poll::Pending,
            State::Done(length) => Poll::Ready(length),
        }
    }

    /// Offers all free steps from a point.
    #[inline]
    fn open(&mut self, scene: &Scene, cell: u32, cost: u32, fresh: u8) {
        let Lattice {
            width,
            connectivity,
            ..
        } = scene.lattice;
        let (x, y) = split(cell, width);
        let offsets = self.occupancy.offsets();
        let free = self.occupancy.steps(cell);
        let mut steps = free & fresh;
        while steps != 0 {
            let direction = steps.trailing_zeros() as usize;
            steps &= steps - 1;
            let next = cell.wrapping_add_signed(offsets[direction]);
            let cost = cost + STEP_COSTS[direction];
            let fresh = fresh_after(direction, free);
            self.frontier.offer(next, cell, cost, fresh, || {
                let (right, up) = DIRECTIONS[direction];
                let place = (x.wrapping_add_signed(right), y.wrapping_add_signed(up));
                self.target.bound(place, connectivity)
            });
        }
    }

    /// The length of the straight piece from start to end, where that is the whole path.
    fn straight(&self, scene: &Scene) -> Option<f64> {
        let (from, to) = (self.from, self.to);
        let whole = from == to
            || !(self.starts.is_on_lattice() && self.ends.is_on_lattice())
                && are_close(scene.lattice.pitch_m, from, to);
        (whole && self.occupancy.straight_is_free(scene, from, to)).then(|| (to - from).norm())
    }

    /// Writes the path that ends with lattice point `last`; its length, m. The ends stand for
    /// the lattice points they are on.
    fn trace(&mut self, scene: &Scene, last: u32) -> f64 {
        let lattice = &scene.lattice;
        let (mut straight, mut diagonal) = (0_u32, 0_u32);
        add_corner(&mut self.path, self.to);
        let mut cell = last;
        loop {
            let before = self.frontier.from(cell);
            let is_end = cell == last && self.ends.is_on_lattice()
                || before == NOWHERE && self.starts.is_on_lattice();
            if !is_end {
                add_corner(&mut self.path, lattice.at(cell));
            }
            if before == NOWHERE {
                break;
            }
            let step = before.abs_diff(cell);
            if step == 1 || step == lattice.width {
                straight += 1;
            } else {
                diagonal += 1;
            }
            cell = before;
        }
        add_corner(&mut self.path, self.from);
        self.path.reverse();
        let tail_m = self.ends.at(last).map_or(0.0, |joint| joint.length_m);
        let head_m = self.starts.at(cell).map_or(0.0, |joint| joint.length_m);
        let steps = f64::from(straight) + f64::from(diagonal) * std::f64::consts::SQRT_2;
        head_m + steps * lattice.pitch_m + tail_m
    }
}

impl Target {
    fn around(ends: &Joints, width: u32) -> Self {
        let mut target = Self {
            low: (u32::MAX, u32::MAX),
            high: (0, 0),
        };
        for joint in ends.list() {
            let (x, y) = split(joint.cell, width);
            target.low = (target.low.0.min(x), target.low.1.min(y));
            target.high = (target.high.0.max(x), target.high.1.max(y));
        }
        target
    }

    /// Least cost from a lattice point to the rectangle, were there no obstacles. It never
    /// falls by more than a step costs, so the first way to a point that is served is the best.
    #[inline]
    fn bound(&self, (x, y): (u32, u32), connectivity: Connectivity) -> u32 {
        let along_x = self
            .low
            .0
            .saturating_sub(x)
            .max(x.saturating_sub(self.high.0));
        let along_y = self
            .low
            .1
            .saturating_sub(y)
            .max(y.saturating_sub(self.high.1));
        match connectivity {
            Connectivity::Four => (along_x + along_y) * STRAIGHT,
            Connectivity::Eight => {
                along_x.max(along_y) * STRAIGHT + along_x.min(along_y) * (DIAGONAL - STRAIGHT)
            }
        }
    }
}

/// Column and row of a lattice point.
#[inline]
fn split(cell: u32, width: u32) -> (u32, u32) {
    (cell % width, cell / width)
}

/// Adds a corner to a polyline, and takes the one before away where the line does not bend.
fn add_corner(path: &mut Vec<Vec2>, point: Vec2) {
    if path.last() == Some(&point) {
        return;
    }
    if let [.., first, middle] = path[..] {
        let (before, after) = (middle - first, point - middle);
        if before.perp(&after).abs() <= STRAIGHT_M2 && before.dot(&after) > 0.0 {
            path.pop();
        }
    }
    path.push(point);
}
