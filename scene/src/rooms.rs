//! Random narrow floor plans: a rectangle, divided again and again by walls with one doorway each.
//!
//! Responsible for: walls, doorways and an exact free floor area.
//! Not responsible for: who and what is in the rooms (`generate`).
//!
//! All lengths here are whole *units* of 0.05 m, so every number of a generated scenario is a
//! multiple of it. Every doorway is just wide enough for the paper's robot with its object, so
//! whatever stands in one cuts the floor in two.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Units in a metre.
pub(crate) const UNITS_PER_M: i32 = 20;
/// Units of area in a square metre.
pub(crate) const UNITS_PER_M2: f64 = (UNITS_PER_M * UNITS_PER_M) as f64;
/// Height of a robot with the object it carries: what a doorway in an upright wall has to let
/// pass.
const COMPOUND_HEIGHT: i32 = 18;
/// Its width: what a doorway in a level wall has to let pass.
const COMPOUND_WIDTH: i32 = 10;
/// Widest doorway beyond what has to pass.
const DOOR_SLACK: i32 = 2;
/// Narrowest side of a room: the compound, and little more.
const ROOM_MIN: i32 = 22;
/// Thinnest and thickest inner wall.
const WALL_THICKNESS: std::ops::RangeInclusive<i32> = 2..=4;
/// Longest side over shortest side of the whole floor, in tenths.
const ASPECT_TENTHS: std::ops::RangeInclusive<i32> = 10..=18;
/// How often one wall is tried in one room before another room is.
const TRIES_PER_WALL: usize = 60;
/// How often the floor is widened until the area fits.
const TRIES_PER_AREA: usize = 200;

/// A rectangle: x0, y0, x1, y1.
pub(crate) type Rect = [i32; 4];

/// A floor plan, lower left corner at 0, 0.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// Width and height.
    pub(crate) size: (i32, i32),
    /// Walls inside.
    pub(crate) walls: Vec<Rect>,
    /// What is between the walls.
    pub(crate) rooms: Vec<Rect>,
    /// Openings in the walls.
    pub(crate) doors: Vec<Rect>,
}

impl Plan {
    /// A random plan of so much free floor, in square units, and so many dividing walls; none
    /// if the dice fall badly.
    pub(crate) fn random(rng: &mut ChaCha8Rng, area: i32, walls: usize) -> Option<Self> {
        let aspect = f64::from(rng.random_range(ASPECT_TENTHS)) / 10.0;
        let height = (f64::from(area) / aspect).sqrt().ceil() as i32;
        if height < ROOM_MIN {
            return None;
        }
        let layout = rng.clone();
        for width in (area / height..).take(TRIES_PER_AREA) {
            // The same dice for each width: the plan only stretches.
            *rng = layout.clone();
            let mut plan = Self::divided(rng, (width, height), walls)?;
            let excess = plan.free_area() - area;
            if excess >= 0 {
                return plan.fill(excess).then_some(plan);
            }
        }
        None
    }

    fn divided(rng: &mut ChaCha8Rng, size: (i32, i32), walls: usize) -> Option<Self> {
        let mut plan = Self {
            size,
            walls: Vec::new(),
            rooms: vec![[0, 0, size.0, size.1]],
            doors: Vec::new(),
        };
        for _ in 0..walls {
            (0..TRIES_PER_WALL).find(|_| plan.divide(rng))?;
        }
        Some(plan)
    }

    /// Tries one random wall with its doorway in one random room, larger rooms first.
    fn divide(&mut self, rng: &mut ChaCha8Rng) -> bool {
        let area = |r: &Rect| (r[2] - r[0]) * (r[3] - r[1]);
        let total: i32 = self.rooms.iter().map(area).sum();
        let mut pick = rng.random_range(0..total);
        let mut index = 0;
        while pick >= area(&self.rooms[index]) {
            pick -= area(&self.rooms[index]);
            index += 1;
        }
        let room = self.rooms[index];
        let (wide, high) = (room[2] - room[0], room[3] - room[1]);
        let upright = rng.random_range(0..wide + high) < wide;
        // Along `a` the wall has its thickness, along `b` its length.
        let (a, b) = if upright { (0, 1) } else { (1, 0) };
        let passage = if upright {
            COMPOUND_HEIGHT
        } else {
            COMPOUND_WIDTH
        };
        let thickness = rng.random_range(WALL_THICKNESS);
        let door = passage + rng.random_range(0..=DOOR_SLACK);
        let (low, high) = (room[a] + ROOM_MIN, room[a + 2] - ROOM_MIN - thickness);
        if low > high || room[b] + door > room[b + 2] {
            return false;
        }
        let at = rng.random_range(low..=high);
        let door_at = rng.random_range(room[b]..=room[b + 2] - door);
        let rect = |b0: i32, b1: i32| {
            let mut rect = [0; 4];
            (rect[a], rect[a + 2], rect[b], rect[b + 2]) = (at, at + thickness, b0, b1);
            rect
        };
        let wall = rect(room[b], room[b + 2]);
        if self.doors.iter().any(|door| touch(door, &wall)) {
            return false;
        }
        for part in [rect(room[b], door_at), rect(door_at + door, room[b + 2])] {
            if part[b] < part[b + 2] {
                self.walls.push(part);
            }
        }
        self.doors.push(rect(door_at, door_at + door));
        let (mut first, mut second) = (room, room);
        first[a + 2] = at;
        second[a] = at + thickness;
        self.rooms[index] = first;
        self.rooms.push(second);
        true
    }

    /// Free floor in square units, walls that overlap counted once.
    pub(crate) fn free_area(&self) -> i32 {
        let height = self.size.1 as usize;
        let mut covered = vec![false; self.size.0 as usize * height];
        for wall in &self.walls {
            let [x0, y0, x1, y1] = wall.map(|unit| unit as usize);
            for column in covered.chunks_exact_mut(height).take(x1).skip(x0) {
                column[y0..y1.min(height)].fill(true);
            }
        }
        covered.iter().filter(|covered| !**covered).count() as i32
    }

    /// Free squares of column `x` below `top`.
    fn free_in_column(&self, x: i32, top: i32) -> i32 {
        let covered = |y: i32| {
            self.walls
                .iter()
                .any(|w| (w[0]..w[2]).contains(&x) && (w[1]..w[3]).contains(&y))
        };
        (0..top).filter(|y| !covered(*y)).count() as i32
    }

    /// Takes exactly so many squares off the free floor, by a strip along the right side; false if
    /// that cannot be.
    fn fill(&mut self, excess: i32) -> bool {
        if excess == 0 {
            return true;
        }
        let x = self.size.0 - 1;
        let top = (1..=self.size.1).find(|top| self.free_in_column(x, *top) == excess);
        let Some(top) = top else { return false };
        let strip = [x, 0, x + 1, top];
        self.walls.push(strip);
        // A doorway at the far right would become too narrow.
        !self.doors.iter().any(|door| touch(door, &strip))
    }
}

/// Whether two rectangles overlap or share a side or a corner.
fn touch(a: &Rect, b: &Rect) -> bool {
    a[0] <= b[2] && b[0] <= a[2] && a[1] <= b[3] && b[1] <= a[3]
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn a_plan_has_exactly_the_free_floor_asked_for() {
        let mut made = 0;
        for seed in 0..60 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let (area, walls) = (6_800 + 37 * seed as i32, seed as usize % 6);
            let Some(plan) = Plan::random(&mut rng, area, walls) else {
                continue;
            };
            made += 1;
            assert_eq!(plan.free_area(), area);
            assert_eq!((plan.rooms.len(), plan.doors.len()), (walls + 1, walls));
            for door in &plan.doors {
                let inside = |w: &&Rect| {
                    w[0] < door[2] && door[0] < w[2] && w[1] < door[3] && door[1] < w[3]
                };
                // The strip that trims the area may narrow nothing but the outer side.
                assert_eq!(plan.walls.iter().find(inside), None, "seed {seed}");
            }
        }
        assert!(made > 40, "{made} plans");
    }

    #[test]
    fn a_wall_reaches_from_side_to_side_but_for_its_doorway() {
        for seed in 0..60 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let size = (90, 80);
            let Some(plan) = Plan::divided(&mut rng, size, 1) else {
                continue;
            };
            let area = |r: &Rect| (r[2] - r[0]) * (r[3] - r[1]);
            let door = plan.doors[0];
            let covered: i32 = plan.walls.iter().chain([&door]).map(area).sum();
            let (upright, flat) = ((door[2] - door[0]) * size.1, (door[3] - door[1]) * size.0);
            assert!(
                covered == upright || covered == flat,
                "{:?}, {door:?}",
                plan.walls
            );
        }
    }
}
