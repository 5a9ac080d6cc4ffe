//! Distances to one place with the walls alone, each worked out when somebody asks for it.
//!
//! Responsible for: answering from where the way can be read off; else a flood from the place, that
//! goes on as far as somebody asks. What is answered is exact, in whatever order it is asked for.
//! Not responsible for: which of them are kept (`ground`).
//!
//! Terms: the *box* of two lattice points is that of all points between them. A box is *open* if
//! every step within it is free; the shortest way is then as long as without any walls.

use std::cell::{Cell, RefCell};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::rc::Rc;

use scene::{Connectivity, Lattice, Occupancy};

use crate::anytime::ground::{EVER, Offset, Time, duration};
use crate::frontier::{DIAGONAL, STRAIGHT};

/// Where a class of bodies can be, with the walls alone.
pub(crate) struct Walls {
    pub(crate) steps: Occupancy,
    connectivity: Connectivity,
    width: i32,
    height: i32,
    /// By lattice point: how many of the squares of four neighbouring points that lie left of it
    /// and below have a step that is not free.
    shut: Vec<u32>,
}

/// Distances of a class of bodies to one place.
pub(crate) struct Distances {
    walls: Rc<Walls>,
    to: u32,
    /// Of each lattice point that is known: the time plus one.
    known: Vec<Cell<Time>>,
    flood: RefCell<Flood>,
    /// Lattice points that floods have come to, of all of them.
    flooded: Rc<Cell<u64>>,
}

/// How far a flood has come.
#[derive(Default)]
struct Flood {
    /// The best time known from each lattice point; empty before it begins.
    best: Vec<Time>,
    /// Points to go on from, the nearest first.
    open: BinaryHeap<Reverse<(Time, u32)>>,
}

impl Walls {
    pub(crate) fn new(lattice: &Lattice, steps: Occupancy) -> Self {
        let (width, height) = (lattice.width as i32, lattice.height as i32);
        let mut walls = Self {
            steps,
            connectivity: lattice.connectivity,
            width,
            height,
            shut: vec![0; (width * height) as usize],
        };
        for y in 1..height {
            let mut row = 0;
            for x in 1..width {
                row += u32::from(!walls.is_square_open(x, y));
                let below = walls.shut[walls.cell((x, y - 1))];
                let cell = walls.cell((x, y));
                walls.shut[cell] = below + row;
            }
        }
        walls
    }

    /// Whether all steps between four neighbouring points are free, of which this is the upper
    /// right one.
    fn is_square_open(&self, x: i32, y: i32) -> bool {
        // East, north, west and south, then the diagonals from the north-east on.
        let corners = [
            ((x - 1, y - 1), 0b0001_0011),
            ((x, y - 1), 0b0010_0110),
            ((x, y), 0b0100_1100),
            ((x - 1, y), 0b1000_1001),
        ];
        let asked = match self.connectivity {
            Connectivity::Four => 0b0000_1111,
            Connectivity::Eight => 0b1111_1111,
        };
        corners.into_iter().all(|(at, steps)| {
            let needed = steps & asked;
            self.steps.steps(self.cell(at) as u32) & needed == needed
        })
    }

    /// Whether the box of two points is open.
    fn is_open(&self, a: Offset, b: Offset) -> bool {
        let ((x0, x1), (y0, y1)) = (
            widened(a.0.min(b.0), a.0.max(b.0)),
            widened(a.1.min(b.1), a.1.max(b.1)),
        );
        if x1 >= self.width || y1 >= self.height {
            return false;
        }
        let shut = |x: i32, y: i32| self.shut[self.cell((x, y))];
        shut(x1, y1) + shut(x0, y0) == shut(x0, y1) + shut(x1, y0)
    }

    /// The time from one point to another without any walls.
    fn straight(&self, a: Offset, b: Offset) -> Time {
        let (dx, dy) = (a.0.abs_diff(b.0), a.1.abs_diff(b.1));
        match self.connectivity {
            Connectivity::Four => (dx + dy) * STRAIGHT,
            Connectivity::Eight => dx.min(dy) * DIAGONAL + dx.abs_diff(dy) * STRAIGHT,
        }
    }

    fn cell(&self, (x, y): Offset) -> usize {
        (y * self.width + x) as usize
    }

    fn xy(&self, cell: u32) -> Offset {
        (cell as i32 % self.width, cell as i32 / self.width)
    }
}

/// One side of a box, with a square's width at least.
fn widened(from: i32, to: i32) -> (i32, i32) {
    if from < to {
        (from, to)
    } else if from > 0 {
        (from - 1, to)
    } else {
        (from, to + 1)
    }
}

impl Distances {
    /// Nothing known yet.
    pub(crate) fn new(walls: Rc<Walls>, to: u32, flooded: Rc<Cell<u64>>) -> Self {
        let points = walls.shut.len();
        Self {
            walls,
            to,
            known: vec![Cell::new(0); points],
            flood: RefCell::default(),
            flooded,
        }
    }

    /// How long it takes from a lattice point; none if there is no way.
    #[inline]
    pub(crate) fn time(&self, from: u32) -> Option<Time> {
        match self.known[from as usize].get() {
            0 => self.look_for(from),
            known => Some(known - 1),
        }
    }

    /// At least how long, without a look for ways.
    pub(crate) fn least(&self, from: u32) -> Time {
        match self.known[from as usize].get() {
            0 => self.straight(from),
            known => known - 1,
        }
    }

    fn straight(&self, from: u32) -> Time {
        let walls = &self.walls;
        walls.straight(walls.xy(from), walls.xy(self.to))
    }

    #[cold]
    fn look_for(&self, from: u32) -> Option<Time> {
        let walls = &self.walls;
        if !walls.steps.is_free(from) {
            return None;
        }
        if !walls.is_open(walls.xy(from), walls.xy(self.to)) {
            return self.flood_to(from);
        }
        let time = self.straight(from);
        self.known[from as usize].set(time + 1);
        Some(time)
    }

    /// Goes on with the flood until it comes to `from`.
    fn flood_to(&self, from: u32) -> Option<Time> {
        let steps = &self.walls.steps;
        let Flood { best, open } = &mut *self.flood.borrow_mut();
        if best.is_empty() {
            best.resize(self.known.len(), EVER);
            if steps.is_free(self.to) {
                best[self.to as usize] = 0;
                open.push(Reverse((0, self.to)));
            }
        }
        let offsets = steps.offsets();
        while let Some(Reverse((time, cell))) = open.pop() {
            if time > best[cell as usize] {
                continue;
            }
            self.known[cell as usize].set(time + 1);
            self.flooded.set(self.flooded.get() + 1);
            let mut free = steps.steps(cell);
            while free != 0 {
                let direction = free.trailing_zeros() as usize;
                free &= free - 1;
                let next = cell.wrapping_add_signed(offsets[direction]);
                let then = time + duration(direction);
                if then < best[next as usize] {
                    best[next as usize] = then;
                    open.push(Reverse((then, next)));
                }
            }
            if cell == from {
                return Some(time);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use scene::{Budget, ClassId, GenerateOptions, Scene};
    use shm_types::Counters;

    use super::*;
    use crate::field::DistanceField;

    fn all_by_flood(scene: &Scene, class: usize, to: u32) -> Vec<Option<Time>> {
        let mut field = DistanceField::new(scene);
        field.occupancy().reset(scene, ClassId(class));
        field.begin(scene, scene.lattice.at(to));
        let mut budget = Budget::new(u64::MAX);
        assert!(
            field
                .advance(&mut budget, &mut Counters::default())
                .is_ready()
        );
        let mut costs = vec![0; scene.lattice.len()];
        field.keep(&mut costs);
        costs.iter().map(|cost| cost.checked_sub(1)).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Against a whole flood, whatever is asked for first.
        #[test]
        fn every_answer_is_the_shortest_time(
            seed in 0_u64..40,
            four in any::<bool>(),
            class in 0_usize..2,
            place in any::<prop::sample::Index>(),
            asked in proptest::collection::vec(any::<prop::sample::Index>(), 1..200),
        ) {
            let options = GenerateOptions { seed, ..GenerateOptions::default() };
            let mut draft = scene::scatter(&options).unwrap();
            if four {
                draft.connectivity = Connectivity::Four;
            }
            let scene = Scene::new(draft).unwrap();
            let points = scene.lattice.len();
            let to = place.index(points) as u32;
            let exact = all_by_flood(&scene, class, to);
            let mut steps = Occupancy::new(&scene);
            steps.reset(&scene, ClassId(class));
            let walls = Rc::new(Walls::new(&scene.lattice, steps));
            let distances = Distances::new(walls, to, Rc::default());
            for cell in asked.iter().map(|cell| cell.index(points)) {
                let least = distances.least(cell as u32);
                prop_assert!(exact[cell].is_none_or(|time| least <= time));
                prop_assert_eq!(distances.time(cell as u32), exact[cell]);
            }
        }
    }
}
