//! The connected pieces of a body's free space, among the walls and one obstacle (rule 30).
//!
//! Responsible for: labelling the pieces among the walls once, and telling for one obstacle after
//! another what it leaves of them.
//! Not responsible for: which obstacles are asked about, and what follows for tasks (crate
//! `planner`); configurations off the lattice (`reach::joints`).
//!
//! Terms: a *run* is a longest row of lattice points joined by free steps. A diagonal is free
//! only if both ways around its corner are, so straight steps decide what is connected, whichever
//! steps the scenario allows. A run is *touched* if the obstacle takes away a neighbour of it, or
//! a step to one.
//!
//! How: the obstacle changes the lattice within a small window. Where all touched runs of a
//! piece are still connected inside that window, the piece as a whole still is: any way that
//! used what is gone can go around. Otherwise the obstacle may have cut it, and only then are
//! the runs of the whole lattice joined anew.

use crate::body::ClassId;
use crate::geometry::{Region, Vec2};
use crate::lattice::Lattice;
use crate::raster::{EAST, NORTH, POINT, Raster};
use crate::scene::Scene;
use crate::shape::Shape;

/// Lattice lines around an obstacle: steps into it begin one outside, their other neighbours lie
/// one further, and one more is for rounding.
const MARGIN: f64 = 3.0;

/// What was done, in numbers that do not depend on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PieceWork {
    /// Obstacles entered.
    pub obstacles: u64,
    /// Obstacles of which the window did not show that they cut nothing.
    pub floods: u64,
    /// Runs looked at, in windows and in whole lattices.
    pub runs: u64,
}

/// Points `start..end` of a row.
#[derive(Clone, Copy, Debug)]
struct Run {
    start: u32,
    end: u32,
}

/// The runs of rows that follow one another.
#[derive(Clone, Debug, Default)]
struct Rows {
    runs: Vec<Run>,
    /// `runs[starts[i]..starts[i + 1]]` are those of row `i`.
    starts: Vec<u32>,
}

/// A union-find over numbers; the least of a set stands for it.
#[derive(Clone, Debug, Default)]
struct Sets {
    parents: Vec<u32>,
}

/// Rows and columns that an obstacle may change, and their neighbours.
#[derive(Clone, Copy, Debug)]
struct Window {
    rows: (u32, u32),
    columns: (u32, u32),
}

/// The pieces of one class's free space. Memory grows to what the largest question needs and is
/// then used again.
#[derive(Clone, Debug)]
pub struct Pieces {
    class: ClassId,
    raster: Raster,
    width: u32,
    /// Runs among the walls, of all rows, and for each the run that stands for its piece.
    walls: Rows,
    pieces: Sets,
    /// Runs of the walls that are joined from one row to the next, by the lower row.
    links: Vec<(u32, u32)>,
    link_starts: Vec<u32>,
    window: Option<Window>,
    /// Runs of the window, and sets of them.
    local: Rows,
    local_sets: Sets,
    /// Changed columns of each row of the window.
    changed: Vec<(u32, u32)>,
    /// A piece, and the set of the first touched run of it.
    seen: Vec<(u32, u32)>,
    /// Whether the pieces among the walls no longer hold, but those of `cut` and `cut_sets` do.
    is_cut: bool,
    /// Runs of the window's rows at their full width. Numbered after those of the walls.
    cut: Rows,
    cut_sets: Sets,
    work: PieceWork,
}

impl Pieces {
    /// The pieces among the walls alone.
    #[must_use]
    pub fn new(scene: &Scene, class: ClassId) -> Self {
        let Lattice { width, height, .. } = scene.lattice;
        let raster = scene.walls_only(class).clone();
        let mut walls = Rows::default();
        walls.begin();
        for row in 0..height {
            walls.add_row(row_of(&raster, width, row), (0, width));
        }
        let mut pieces = Sets::default();
        pieces.begin(walls.runs.len());
        let (mut links, mut link_starts) = (Vec::new(), vec![0]);
        for row in 1..height {
            let below = row_of(&raster, width, row - 1);
            let (lower, upper) = (walls.row(row - 1), walls.row(row));
            for_each_contact(below, lower, upper, |a, b| {
                let link = (
                    walls.starts[row as usize - 1] + a,
                    walls.starts[row as usize] + b,
                );
                pieces.join(link.0, link.1);
                links.push(link);
            });
            link_starts.push(links.len() as u32);
        }
        pieces.flatten();
        Self {
            class,
            raster,
            width,
            walls,
            pieces,
            links,
            link_starts,
            window: None,
            local: Rows::default(),
            local_sets: Sets::default(),
            changed: Vec::new(),
            seen: Vec::new(),
            is_cut: false,
            cut: Rows::default(),
            cut_sets: Sets::default(),
            work: PieceWork::default(),
        }
    }

    /// The class of bodies they are about.
    #[must_use]
    pub const fn class(&self) -> ClassId {
        self.class
    }

    /// Enters one standing obstacle in the place of the last; with or without the body's
    /// clearance. `scene` is the one these are the pieces of.
    pub fn block(&mut self, scene: &Scene, shape: &Shape, at: Vec2, clearance: bool) {
        self.unblock(scene);
        self.work.obstacles += 1;
        let obstacle = Region::standing(shape, at);
        let Some(window) = Window::around(scene, self.class, &obstacle, clearance) else {
            return;
        };
        let body = scene.body(self.class);
        self.raster
            .block(&scene.lattice, body, &obstacle, clearance);
        self.window = Some(window);
        if self.may_cut(scene, window) {
            self.is_cut = true;
            self.work.floods += 1;
            self.join_all(scene, window);
        }
    }

    /// Takes the obstacle away: the walls alone.
    pub fn unblock(&mut self, scene: &Scene) {
        self.is_cut = false;
        let Some(window) = self.window.take() else {
            return;
        };
        let walls = scene.walls_only(self.class);
        for row in window.rows.0..window.rows.1 {
            let start = (row * self.width) as usize;
            let range = start + window.columns.0 as usize..start + window.columns.1 as usize;
            self.raster.bits[range.clone()].copy_from_slice(&walls.bits[range]);
        }
    }

    /// Whether the obstacle may have cut a piece in two. If not, two cells that are both free
    /// still lie in the same piece exactly if they did among the walls alone.
    #[must_use]
    pub const fn may_be_cut(&self) -> bool {
        self.is_cut
    }

    /// Whether the body can be at a cell.
    #[must_use]
    pub fn is_free(&self, cell: u32) -> bool {
        self.raster.bits[cell as usize] & POINT == 0
    }

    /// The piece that a cell lies in; none if the body cannot be there. Numbers of pieces are
    /// comparable until the next obstacle.
    #[must_use]
    pub fn piece(&self, cell: u32) -> Option<u32> {
        if !self.is_free(cell) {
            return None;
        }
        let (row, column) = (cell / self.width, cell % self.width);
        match self.window {
            Some(Window { rows, .. }) if self.is_cut => {
                let run = if (rows.0..rows.1).contains(&row) {
                    self.cut.find(row - rows.0, column)? + self.walls.runs.len() as u32
                } else {
                    self.walls.find(row, column)?
                };
                Some(self.cut_sets.root(run))
            }
            _ => Some(self.pieces.root(self.walls.find(row, column)?)),
        }
    }

    /// What was done so far.
    #[must_use]
    pub const fn work(&self) -> PieceWork {
        self.work
    }

    /// Whether touched runs of one piece are not connected inside the window.
    fn may_cut(&mut self, scene: &Scene, window: Window) -> bool {
        self.note_changes(scene, window);
        self.join_window(window);
        self.seen.clear();
        for row in window.rows.0..window.rows.1 {
            let index = row - window.rows.0;
            let Some((from, to)) = self.touched(index) else {
                continue;
            };
            let first = self.local.starts[index as usize];
            for (offset, run) in self.local.row(index).iter().enumerate() {
                if run.end <= from || to <= run.start {
                    continue;
                }
                let set = self.local_sets.root(first + offset as u32);
                let Some(old) = self.walls.find(row, run.start) else {
                    continue;
                };
                let piece = self.pieces.root(old);
                match self.seen.iter().find(|(seen, _)| *seen == piece) {
                    None => self.seen.push((piece, set)),
                    Some((_, other)) if *other != set => return true,
                    Some(_) => {}
                }
            }
        }
        false
    }

    /// Notes the columns in which points or straight steps are gone, row by row.
    fn note_changes(&mut self, scene: &Scene, window: Window) {
        let walls = scene.walls_only(self.class);
        let (from, to) = (window.columns.0 as usize, window.columns.1 as usize);
        self.changed.clear();
        for row in window.rows.0..window.rows.1 {
            let before = &row_of(walls, self.width, row)[from..to];
            let after = &row_of(&self.raster, self.width, row)[from..to];
            let differ = |(a, b): (&u8, &u8)| (a ^ b) & (POINT | EAST | NORTH) != 0;
            let first = before.iter().zip(after).position(differ);
            let last = before.iter().zip(after).rposition(differ);
            self.changed.push(match (first, last) {
                (Some(first), Some(last)) => ((from + first) as u32, (from + last) as u32 + 1),
                _ => (u32::MAX, 0),
            });
        }
    }

    /// The columns in which runs of a row of the window are touched.
    fn touched(&self, index: u32) -> Option<(u32, u32)> {
        let index = index as usize;
        let near = &self.changed[index.saturating_sub(1)..(index + 2).min(self.changed.len())];
        let from = near.iter().map(|(from, _)| *from).min()?;
        let to = near.iter().map(|(_, to)| *to).max()?;
        (from < to).then(|| (from.saturating_sub(1), to + 1))
    }

    /// Finds the runs of the window and joins those that are connected inside it.
    fn join_window(&mut self, window: Window) {
        self.local.begin();
        for row in window.rows.0..window.rows.1 {
            self.local
                .add_row(row_of(&self.raster, self.width, row), window.columns);
        }
        let Self {
            local, local_sets, ..
        } = self;
        local_sets.begin(local.runs.len());
        for row in window.rows.0 + 1..window.rows.1 {
            let index = row - window.rows.0;
            let below = row_of(&self.raster, self.width, row - 1);
            let first = (
                local.starts[index as usize - 1],
                local.starts[index as usize],
            );
            for_each_contact(below, local.row(index - 1), local.row(index), |a, b| {
                local_sets.join(first.0 + a, first.1 + b);
            });
        }
        self.work.runs += local.runs.len() as u64;
    }

    /// Joins the runs of the whole lattice: the walls' own, and in the rows of the window those
    /// that the obstacle leaves.
    fn join_all(&mut self, scene: &Scene, window: Window) {
        self.cut.begin();
        for row in window.rows.0..window.rows.1 {
            self.cut
                .add_row(row_of(&self.raster, self.width, row), (0, self.width));
        }
        let Self {
            walls,
            cut,
            cut_sets,
            raster,
            ..
        } = self;
        let walls_runs = walls.runs.len();
        cut_sets.begin(walls_runs + cut.runs.len());
        let inside = |row: u32| (window.rows.0..window.rows.1).contains(&row);
        let runs_of = |row: u32| {
            if inside(row) {
                let index = row - window.rows.0;
                let first = walls_runs as u32 + cut.starts[index as usize];
                (first, cut.row(index))
            } else {
                (walls.starts[row as usize], walls.row(row))
            }
        };
        for row in 1..scene.lattice.height {
            if inside(row - 1) || inside(row) {
                let ((first, lower), (second, upper)) = (runs_of(row - 1), runs_of(row));
                let below = row_of(raster, self.width, row - 1);
                for_each_contact(below, lower, upper, |a, b| {
                    cut_sets.join(first + a, second + b);
                });
            } else {
                let links = self.link_starts[row as usize - 1]..self.link_starts[row as usize];
                for &(a, b) in &self.links[links.start as usize..links.end as usize] {
                    cut_sets.join(a, b);
                }
            }
        }
        self.work.runs += cut_sets.parents.len() as u64;
    }
}

impl Window {
    /// None where the obstacle is nowhere near the lattice.
    fn around(scene: &Scene, class: ClassId, obstacle: &Region, clearance: bool) -> Option<Self> {
        let lattice = &scene.lattice;
        let (low, high) = obstacle.extent();
        let mut extent: Option<(Vec2, Vec2)> = None;
        for part in &scene.body(class).parts {
            let region = Region::standing(part.shape(clearance), part.offset);
            let (part_low, part_high) = region.extent();
            let (low, high) = (low - part_high, high - part_low);
            extent = Some(extent.map_or((low, high), |(l, h)| (l.inf(&low), h.sup(&high))));
        }
        let (low, high) = extent?;
        let lines = |low: f64, high: f64, origin: f64, count: u32| {
            let count = f64::from(count);
            let first = ((low - origin) / lattice.pitch_m).floor() - MARGIN;
            let end = ((high - origin) / lattice.pitch_m).ceil() + MARGIN + 1.0;
            (first.clamp(0.0, count) as u32, end.clamp(0.0, count) as u32)
        };
        let rows = lines(low.y, high.y, lattice.origin.y, lattice.height);
        let columns = lines(low.x, high.x, lattice.origin.x, lattice.width);
        (rows.0 < rows.1 && columns.0 < columns.1).then_some(Self { rows, columns })
    }
}

impl Rows {
    fn begin(&mut self) {
        self.runs.clear();
        self.starts.clear();
        self.starts.push(0);
    }

    /// Adds the runs that a row has within `columns`.
    fn add_row(&mut self, bits: &[u8], columns: (u32, u32)) {
        let mut start = None;
        for (column, byte) in (columns.0..columns.1).zip(&bits[columns.0 as usize..]) {
            if byte & (POINT | EAST) == 0 {
                start = start.or(Some(column));
                continue;
            }
            let (free, end) = if byte & POINT == 0 {
                (start.or(Some(column)), column + 1)
            } else {
                (start, column)
            };
            self.runs.extend(free.map(|start| Run { start, end }));
            start = None;
        }
        let end = columns.1;
        self.runs.extend(start.map(|start| Run { start, end }));
        self.starts.push(self.runs.len() as u32);
    }

    fn row(&self, index: u32) -> &[Run] {
        let index = index as usize;
        &self.runs[self.starts[index] as usize..self.starts[index + 1] as usize]
    }

    /// Number of the run of a row that a column lies in.
    fn find(&self, index: u32, column: u32) -> Option<u32> {
        let row = self.row(index);
        let after = row.partition_point(|run| run.end <= column);
        (row.get(after)?.start <= column).then(|| self.starts[index as usize] + after as u32)
    }
}

impl Sets {
    /// Every number below `count` is a set of its own.
    fn begin(&mut self, count: usize) {
        self.parents.clear();
        self.parents.extend(0..count as u32);
    }

    fn root(&self, mut of: u32) -> u32 {
        while self.parents[of as usize] != of {
            of = self.parents[of as usize];
        }
        of
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.shortened(a), self.shortened(b));
        let (low, high) = (a.min(b), a.max(b));
        self.parents[high as usize] = low;
    }

    /// The root, and the way to it cut in half.
    fn shortened(&mut self, mut of: u32) -> u32 {
        loop {
            let parent = self.parents[of as usize];
            if parent == of {
                return of;
            }
            let above = self.parents[parent as usize];
            self.parents[of as usize] = above;
            of = above;
        }
    }

    /// Makes every root one look away. Parents have lower numbers.
    fn flatten(&mut self) {
        for index in 0..self.parents.len() {
            self.parents[index] = self.parents[self.parents[index] as usize];
        }
    }
}

fn row_of(raster: &Raster, width: u32, row: u32) -> &[u8] {
    let start = (row * width) as usize;
    &raster.bits[start..start + width as usize]
}

/// Calls `visit` with the places in their rows of all runs that a free step joins, from the row
/// `below` to the next.
fn for_each_contact(below: &[u8], lower: &[Run], upper: &[Run], mut visit: impl FnMut(u32, u32)) {
    let (mut a, mut b) = (0, 0);
    while let (Some(low), Some(high)) = (lower.get(a), upper.get(b)) {
        let (start, end) = (low.start.max(high.start), low.end.min(high.end));
        if start < end {
            let steps = &below[start as usize..end as usize];
            if steps.iter().any(|byte| byte & NORTH == 0) {
                visit(a as u32, b as u32);
            }
        }
        if low.end <= high.end {
            a += 1;
        } else {
            b += 1;
        }
    }
}
