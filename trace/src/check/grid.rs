//! Which bodies may be near each other: a grid of cells over the workspace.
//!
//! Responsible for: finding candidates fast; it may name too many, never too few.
//! Not responsible for: whether they really meet (`geometry`).

use super::geometry::Vector;

/// Most cells along one side.
const MOST_CELLS: usize = 256;

/// An axis-parallel box; m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Region {
    pub(super) low: Vector,
    pub(super) high: Vector,
}

impl Region {
    /// What a body of this extent covers on its way from `from` to `to`.
    pub(super) fn swept((low, high): (Vector, Vector), from: Vector, to: Vector) -> Self {
        Self {
            low: low + from.inf(&to),
            high: high + from.sup(&to),
        }
    }

    /// The box with a margin around it.
    pub(super) fn grown(self, margin: f64) -> Self {
        let margin = Vector::new(margin, margin);
        Self {
            low: self.low - margin,
            high: self.high + margin,
        }
    }

    fn meets(&self, other: &Self) -> bool {
        self.low.x <= other.high.x
            && other.low.x <= self.high.x
            && self.low.y <= other.high.y
            && other.low.y <= self.high.y
    }
}

/// Regions under numbers 0, 1, …, found by place. What lies outside of the grid counts to its
/// outermost cells.
pub(super) struct Grid {
    low: Vector,
    cell_m: f64,
    columns: usize,
    rows: usize,
    cells: Vec<Vec<usize>>,
    regions: Vec<Option<Region>>,
    /// Query that has last seen each number, so that none is named twice.
    seen: Vec<u64>,
    queries: u64,
}

impl Grid {
    /// A grid over `bounds` for `count` regions of about `size_m`.
    pub(super) fn new(bounds: Region, count: usize, size_m: f64) -> Self {
        let size = bounds.high - bounds.low;
        let cell_m = size_m.max(size.max() / MOST_CELLS as f64);
        // Casts of lengths saturate, and `min` bounds them.
        let along = |length: f64| ((length / cell_m) as usize + 1).min(MOST_CELLS);
        let (columns, rows) = (along(size.x), along(size.y));
        Self {
            low: bounds.low,
            cell_m,
            columns,
            rows,
            cells: vec![Vec::new(); columns * rows],
            regions: vec![None; count],
            seen: vec![0; count],
            queries: 0,
        }
    }

    fn cells_of(&self, region: Region) -> impl Iterator<Item = usize> + use<> {
        let (low, high) = (
            (region.low - self.low) / self.cell_m,
            (region.high - self.low) / self.cell_m,
        );
        let (columns, rows) = (self.columns, self.rows);
        // A negative number casts to 0.
        let column = move |x: f64| (x as usize).min(columns - 1);
        let row = move |y: f64| (y as usize).min(rows - 1);
        let xs = column(low.x)..=column(high.x);
        (row(low.y)..=row(high.y)).flat_map(move |y| xs.clone().map(move |x| y * columns + x))
    }

    /// Puts region `id` there, wherever it was before.
    pub(super) fn put(&mut self, id: usize, region: Region) {
        if let Some(old) = self.regions[id].replace(region) {
            for cell in self.cells_of(old) {
                self.cells[cell].retain(|&other| other != id);
            }
        }
        for cell in self.cells_of(region) {
            self.cells[cell].push(id);
        }
    }

    /// Appends to `found` all whose regions meet this one, in ascending order.
    pub(super) fn near(&mut self, region: Region, found: &mut Vec<usize>) {
        self.queries += 1;
        let first = found.len();
        for cell in self.cells_of(region) {
            for &id in &self.cells[cell] {
                let is_new = std::mem::replace(&mut self.seen[id], self.queries) != self.queries;
                if is_new && self.regions[id].is_some_and(|other| other.meets(&region)) {
                    found.push(id);
                }
            }
        }
        found[first..].sort_unstable();
    }
}
