//! What can be reached on the lattice, with objects as they stand.
//!
//! Responsible for: whether there is a way, and the cheapest one *through* objects (rule 29).
//! Not responsible for: which object moves where (the parent module).

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::rc::Rc;

use crate::anytime::ground::Ground;
use crate::anytime::sequence::{PRICE, Sequencer};
use crate::anytime::track::Place;

impl Sequencer {
    /// Blocks what all objects but one keep a class away from.
    pub(super) fn block(
        &mut self,
        _ground: &Ground,
        places: &[Rc<Place>],
        except: usize,
        class: usize,
    ) {
        self.round += 1;
        for (object, place) in places.iter().enumerate() {
            if object != except {
                for &cell in &place.cells[class] {
                    self.blocked[cell as usize] = self.round;
                }
            }
        }
    }

    pub(super) fn block_cells(&mut self, cells: &[u32]) {
        for &cell in cells {
            self.blocked[cell as usize] = self.round;
        }
    }

    /// Whether `to` can be reached from `from`, as blocked in this round: greedily, from both ends
    /// in turn, since one of them may be shut in.
    pub(super) fn finds(&mut self, ground: &Ground, class: usize, from: u32, to: u32) -> bool {
        self.floods += 1;
        let walls = ground.walls(class);
        let is_blocked = |this: &Self, cell: u32| this.blocked[cell as usize] == this.round;
        if is_blocked(self, from) || is_blocked(self, to) || !walls.is_free(from) {
            return false;
        }
        let ends = [from, to];
        for (side, &end) in ends.iter().enumerate() {
            self.ahead[side].clear();
            self.ahead[side].push((Reverse(0), end));
            self.seen[end as usize] = self.mark(side);
            self.from[end as usize] = u32::MAX;
        }
        self.met = (from, to);
        if from == to {
            return true;
        }
        for side in [0, 1].into_iter().cycle() {
            let Some((_, cell)) = self.ahead[side].pop() else {
                break;
            };
            self.cells += 1;
            let steps = walls.steps(cell);
            for direction in (0..4).filter(|direction| steps >> direction & 1 == 1) {
                let next = cell.wrapping_add_signed(ground.offsets[direction]);
                let seen = self.seen[next as usize];
                if seen == self.mark(1 - side) {
                    self.met = (cell, next);
                    return true;
                }
                if seen != self.mark(side) && !is_blocked(self, next) {
                    self.seen[next as usize] = self.mark(side);
                    self.from[next as usize] = cell;
                    let (dx, dy) = ground.offset(next, ends[1 - side]);
                    self.ahead[side].push((Reverse(dx.abs() + dy.abs()), next));
                }
            }
        }
        false
    }

    /// The same, with these cells blocked and no others.
    pub(crate) fn finds_among<'a>(
        &mut self,
        ground: &Ground,
        class: usize,
        (from, to): (u32, u32),
        blocked: impl Iterator<Item = &'a [u32]>,
    ) -> bool {
        self.round += 1;
        self.met = (from, to);
        blocked.for_each(|cells| self.block_cells(cells));
        self.finds(ground, class, from, to)
    }

    /// Whether what was reached in this round, or an end of the way, is beside or among these
    /// cells.
    pub(crate) fn has_met(&self, ground: &Ground, cells: &[u32]) -> bool {
        let is_seen = |cell: u32| {
            self.seen
                .get(cell as usize)
                .is_some_and(|&seen| seen >= self.mark(0))
        };
        cells.iter().any(|&cell| {
            let mut beside =
                (0..4).map(|direction| cell.wrapping_add_signed(ground.offsets[direction]));
            cell == self.met.0 || cell == self.met.1 || beside.any(is_seen)
        })
    }

    /// The cells of the way that was just found.
    pub(super) fn found(&self, cells: &mut Vec<u32>) {
        for mut cell in [self.met.0, self.met.1] {
            while cell != u32::MAX {
                cells.push(cell);
                cell = self.from[cell as usize];
            }
        }
    }

    /// What a point is marked with that was reached in this round, from either end.
    pub(super) const fn mark(&self, side: usize) -> u32 {
        2 * self.round + side as u32
    }

    /// Whether any of `to` can be reached from any of `from`, as blocked in this round.
    pub(super) fn reaches(
        &mut self,
        ground: &Ground,
        class: usize,
        from: &[u32],
        to: &[u32],
    ) -> bool {
        self.floods += 1;
        self.queue.clear();
        for &cell in from {
            if self.blocked[cell as usize] != self.round && ground.walls(class).is_free(cell) {
                self.seen[cell as usize] = self.mark(0);
                self.from[cell as usize] = u32::MAX;
                self.queue.push_back(cell);
            }
        }
        while let Some(cell) = self.queue.pop_front() {
            self.cells += 1;
            if to.contains(&cell) {
                return true;
            }
            let steps = ground.walls(class).steps(cell);
            for direction in 0..4 {
                let next = cell.wrapping_add_signed(ground.offsets[direction]);
                if steps >> direction & 1 == 1
                    && self.seen[next as usize] != self.mark(0)
                    && self.blocked[next as usize] != self.round
                {
                    self.seen[next as usize] = self.mark(0);
                    self.from[next as usize] = cell;
                    self.queue.push_back(next);
                }
            }
        }
        false
    }

    /// The way with the least price; objects crossed are added to `crossed`.
    #[expect(clippy::too_many_arguments, reason = "one search, of one thing")]
    pub(super) fn cheapest(
        &mut self,
        ground: &Ground,
        places: &[Rc<Place>],
        object: usize,
        class: usize,
        from: &[u32],
        to: u32,
        crossed: &mut Vec<usize>,
    ) -> Option<Vec<u32>> {
        self.block(ground, places, object, class);
        self.floods += 1;
        let mut best = vec![u32::MAX; ground.points()];
        let mut open = BinaryHeap::new();
        for &cell in from {
            if ground.walls(class).is_free(cell) {
                best[cell as usize] = 0;
                self.from[cell as usize] = u32::MAX;
                open.push((Reverse(0), cell));
            }
        }
        while let Some((Reverse(cost), cell)) = open.pop() {
            if cost > best[cell as usize] {
                continue;
            }
            self.cells += 1;
            if cell == to {
                break;
            }
            let steps = ground.walls(class).steps(cell);
            for direction in 0..4 {
                if steps >> direction & 1 == 0 {
                    continue;
                }
                let next = cell.wrapping_add_signed(ground.offsets[direction]);
                let price = if self.blocked[next as usize] == self.round {
                    PRICE
                } else {
                    1
                };
                if cost + price < best[next as usize] {
                    best[next as usize] = cost + price;
                    self.from[next as usize] = cell;
                    open.push((Reverse(cost + price), next));
                }
            }
        }
        if best[to as usize] == u32::MAX {
            return None;
        }
        let mut way = vec![to];
        while self.from[way[way.len() - 1] as usize] != u32::MAX {
            way.push(self.from[way[way.len() - 1] as usize]);
        }
        for (other, place) in places.iter().enumerate() {
            if other != object && place.closes_any(class, &way) {
                crossed.push(other);
            }
        }
        Some(way)
    }
}
