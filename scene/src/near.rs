//! What is near what: uniform grids over the room, so that a test looks only at what may matter.
//!
//! Responsible for: bounding boxes; things that lie at points, found by place. Never misses one,
//! may name some that are not near. Not responsible for: whether they overlap (`geometry`).
//!
//! Things lie in the cell of their point, in lists threaded through one array, so putting and
//! taking allocate nothing.

use crate::geometry::Vec2;
use crate::scene::Scene;
use crate::shape::Shape;

/// Most cells along one axis; larger rooms get larger cells.
const MAX_CELLS_PER_AXIS: usize = 256;
const NIL: u32 = u32::MAX;

/// An axis-aligned box, closed, world frame or relative to a body's centre, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower left corner.
    pub min: Vec2,
    /// Upper right corner.
    pub max: Vec2,
}

impl Aabb {
    /// The box of `shape` around its own centre.
    #[must_use]
    pub fn of(shape: &Shape) -> Self {
        let (min, max) = shape.extent();
        Self { min, max }
    }

    /// The box of two points. These are numbers, so that one instruction orders two of them.
    #[inline]
    #[must_use]
    pub fn around(a: Vec2, b: Vec2) -> Self {
        let least = |a: f64, b: f64| if a < b { a } else { b };
        let most = |a: f64, b: f64| if a > b { a } else { b };
        Self {
            min: Vec2::new(least(a.x, b.x), least(a.y, b.y)),
            max: Vec2::new(most(a.x, b.x), most(a.y, b.y)),
        }
    }

    /// The box of both.
    #[inline]
    #[must_use]
    pub fn joined(self, other: Self) -> Self {
        Self {
            min: Self::around(self.min, other.min).min,
            max: Self::around(self.max, other.max).max,
        }
    }

    /// This box, centred at `at`.
    #[inline]
    #[must_use]
    pub fn at(self, at: Vec2) -> Self {
        Self {
            min: self.min + at,
            max: self.max + at,
        }
    }

    /// What a body of box `body` covers while its centre is anywhere in this box.
    #[inline]
    #[must_use]
    pub fn swept_by(self, body: Self) -> Self {
        Self {
            min: self.min + body.min,
            max: self.max + body.max,
        }
    }

    /// Whether the two have a point in common. All four are compared at once: which of them
    /// holds nobody can foresee, whether all do mostly. In this order `x` and `y` lie side by side
    /// in memory and are compared in one instruction.
    #[inline]
    #[must_use]
    pub fn meets(&self, other: &Self) -> bool {
        (self.min.x <= other.max.x)
            & (self.min.y <= other.max.y)
            & (other.min.x <= self.max.x)
            & (other.min.y <= self.max.y)
    }
}

/// How the room is cut into cells.
#[derive(Clone, Debug)]
pub struct Cells {
    origin: Vec2,
    cell_m: f64,
    columns: usize,
    rows: usize,
}

impl Cells {
    /// Cells over the bounds of `scene`, at least `least_cell_m` wide.
    #[must_use]
    pub fn over(scene: &Scene, least_cell_m: f64) -> Self {
        let (min, max) = scene.bounds;
        let size = max - min;
        #[expect(clippy::cast_precision_loss, reason = "a small constant")]
        let cell_m = least_cell_m.max(size.max() / MAX_CELLS_PER_AXIS as f64);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 1 and the most cells per axis"
        )]
        let count = |length_m: f64| ((length_m / cell_m) as usize + 1).min(MAX_CELLS_PER_AXIS + 1);
        Self {
            origin: min,
            cell_m,
            columns: count(size.x),
            rows: count(size.y),
        }
    }

    /// How many there are.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.columns * self.rows
    }

    fn column_row(&self, at: Vec2) -> (usize, usize) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "float casts saturate; what lies outside belongs to the nearest cell"
        )]
        let index =
            |offset_m: f64, count: usize| ((offset_m / self.cell_m) as usize).min(count - 1);
        let offset = at - self.origin;
        (index(offset.x, self.columns), index(offset.y, self.rows))
    }

    /// The cell at a point; what lies outside belongs to the nearest.
    #[must_use]
    pub fn cell(&self, at: Vec2) -> usize {
        let (column, row) = self.column_row(at);
        row * self.columns + column
    }

    /// The cells that `region` touches.
    pub fn touched(&self, region: Aabb) -> impl Iterator<Item = usize> + use<> {
        let (left, bottom) = self.column_row(region.min);
        let (right, top) = self.column_row(region.max);
        let columns = self.columns;
        (bottom..=top).flat_map(move |row| (left..=right).map(move |column| row * columns + column))
    }
}

/// Things that lie at points.
#[derive(Clone, Debug)]
pub struct Near {
    cells: Cells,
    heads: Vec<u32>,
    next: Vec<u32>,
    /// Where each lies, if it does.
    places: Vec<Option<Vec2>>,
}

impl Near {
    /// Room for things 0 to `count` − 1; none lies anywhere yet.
    #[must_use]
    pub fn new(scene: &Scene, count: usize, least_cell_m: f64) -> Self {
        let cells = Cells::over(scene, least_cell_m);
        Self {
            heads: vec![NIL; cells.count()],
            next: vec![NIL; count],
            places: vec![None; count],
            cells,
        }
    }

    /// Puts `thing`, which lies nowhere, at `at`.
    pub fn put(&mut self, thing: usize, at: Vec2) {
        debug_assert!(self.places[thing].is_none());
        let cell = self.cells.cell(at);
        self.next[thing] = self.heads[cell];
        self.heads[cell] = thing as u32;
        self.places[thing] = Some(at);
    }

    /// Takes `thing` away from wherever it lies.
    pub fn take(&mut self, thing: usize) {
        let Some(at) = self.places[thing].take() else {
            return;
        };
        let cell = self.cells.cell(at);
        let mut here = self.heads[cell];
        if here as usize == thing {
            self.heads[cell] = self.next[thing];
            return;
        }
        while here != NIL {
            let next = self.next[here as usize];
            if next as usize == thing {
                self.next[here as usize] = self.next[thing];
                return;
            }
            here = next;
        }
    }

    /// Where `thing` lies.
    #[inline]
    #[must_use]
    pub fn place(&self, thing: usize) -> Option<Vec2> {
        self.places[thing]
    }

    /// The first thing in the cells that `region` touches for which `hit(thing, place)` holds.
    pub fn find(&self, region: Aabb, mut hit: impl FnMut(usize, Vec2) -> bool) -> Option<usize> {
        for cell in self.cells.touched(region) {
            let mut here = self.heads[cell];
            while here != NIL {
                let thing = here as usize;
                if let Some(at) = self.places[thing]
                    && hit(thing, at)
                {
                    return Some(thing);
                }
                here = self.next[thing];
            }
        }
        None
    }
}
