//! Which lattice points a body cannot be at, and which steps it cannot take, as bits.
//!
//! Responsible for: entering an obstacle, exactly (every step is a swept test, so thin and
//! slanted obstacles between free points are seen), and fast.
//! Not responsible for: what the obstacles are (`cspace`, and the crates above).
//!
//! How: the robot centres at which a part overlaps an obstacle form an open convex region, the
//! Minkowski difference of both. For boxes it is a box: a rectangle of points. Without circles it
//! is bounded by straight sides, so in each row of the lattice it covers one run of points, found
//! in closed form. A step is blocked if the difference, swept backwards along the step, covers
//! its lower end: the same with other sides. Circles are tested point by point.

use crate::body::Body;
use crate::geometry::{CONTACT_M, Region, Vec2, all_normals, regions_overlap};
use crate::lattice::Lattice;
use crate::shape::{MAX_POLYGON_POINTS, Shape};

/// The point itself.
pub(crate) const POINT: u8 = 1;
/// The step to the east (+x).
pub(crate) const EAST: u8 = 1 << 1;
/// The step to the north (+y).
pub(crate) const NORTH: u8 = 1 << 2;
/// Every bit.
const ALL: u8 = POINT | EAST | NORTH;

/// What each bit stands for, as columns and rows away.
const MOVES: [(u8, i8, i8); 3] = [(POINT, 0, 0), (EAST, 1, 0), (NORTH, 0, 1)];

/// Sides of a Minkowski difference: both polygons, both sweeps, the step.
const MAX_SIDES: usize = 2 * MAX_POLYGON_POINTS + 10;

/// One byte a lattice point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Raster {
    pub(crate) bits: Vec<u8>,
}

/// A slanted side of a Minkowski difference: in the row at `y` it is crossed at
/// `offset - slope * y`.
#[derive(Clone, Copy, Default)]
struct Side {
    offset: f64,
    slope: f64,
    /// Whether the inside is to the left (smaller x) of it.
    inside_left: bool,
}

/// Half-planes whose intersection is blocked: a box, and the sides that are not along an axis.
struct Blocked {
    low: Vec2,
    high: Vec2,
    sides: [Side; MAX_SIDES],
    count: usize,
}

impl Raster {
    /// A raster with everything free.
    pub(crate) fn free(lattice: &Lattice) -> Self {
        Self {
            bits: vec![0; lattice.len()],
        }
    }

    /// The walls as one class of bodies meets them, with its clearance. Steps off the lattice
    /// are blocked.
    pub(crate) fn of_walls(lattice: &Lattice, body: &Body, walls: &[(Shape, Vec2)]) -> Self {
        let mut raster = Self::free(lattice);
        for (wall, at) in walls {
            raster.block(lattice, body, &Region::standing(wall, *at), true);
        }
        raster.fence(lattice);
        raster
    }

    /// Blocks every step that leaves the lattice.
    fn fence(&mut self, lattice: &Lattice) {
        let (width, height) = (lattice.width as usize, lattice.height as usize);
        for row in self.bits.chunks_exact_mut(width) {
            row[width - 1] |= EAST;
        }
        for byte in &mut self.bits[width * (height - 1)..] {
            *byte |= NORTH;
        }
    }

    /// Enters one obstacle, met by all parts of a body.
    pub(crate) fn block(
        &mut self,
        lattice: &Lattice,
        body: &Body,
        obstacle: &Region,
        clearance: bool,
    ) {
        for part in &body.parts {
            let region = Region::standing(part.shape(clearance), part.offset);
            if let Some(grid) = BoxOnGrid::of(lattice, &region, obstacle) {
                self.block_box(lattice, &grid);
            } else if region.shape.radius() + obstacle.shape.radius() > 0.0 {
                self.block_round(lattice, &region, obstacle);
            } else {
                self.block_straight(lattice, &region, obstacle);
            }
        }
    }

    /// A box met by a box, which is nearly always: the same as [`Self::block_straight`] finds,
    /// but the points inside all at once, and what begins just outside one by one.
    fn block_box(&mut self, lattice: &Lattice, grid: &BoxOnGrid) {
        let (columns, rows) = (grid.columns.clone(), grid.rows.clone());
        for row in clamp(&rows, lattice.height) {
            let start = (row * lattice.width) as usize;
            let run = clamp(&columns, lattice.width);
            for byte in &mut self.bits[start + run.start as usize..start + run.end as usize] {
                *byte |= ALL;
            }
            let row = i64::from(row);
            self.set(lattice, columns.start - 1, row, EAST);
        }
        let below = rows.start - 1;
        for column in clamp(&columns, lattice.width) {
            self.set(lattice, i64::from(column), below, NORTH);
        }
    }

    /// Sets bits of a point that may lie off the lattice.
    #[inline]
    fn set(&mut self, lattice: &Lattice, column: i64, row: i64, bits: u8) {
        let (width, height) = (i64::from(lattice.width), i64::from(lattice.height));
        if (0..width).contains(&column) && (0..height).contains(&row) {
            self.bits[(row * width + column) as usize] |= bits;
        }
    }

    /// Closed form, row by row.
    fn block_straight(&mut self, lattice: &Lattice, part: &Region, obstacle: &Region) {
        for (bit, columns, rows) in MOVES {
            let step = Vec2::new(f64::from(columns), f64::from(rows)) * lattice.pitch_m;
            let moving = Region {
                along: step,
                ..*part
            };
            let blocked = Blocked::of(&moving, obstacle);
            let (first, last) = indices(
                blocked.low.y,
                blocked.high.y,
                lattice.origin.y,
                lattice.pitch_m,
                lattice.height,
            );
            for row in first..last {
                let (low, high) = blocked.run(lattice.y(row));
                let (from, to) =
                    indices(low, high, lattice.origin.x, lattice.pitch_m, lattice.width);
                if from < to {
                    let start = row as usize * lattice.width as usize;
                    for byte in &mut self.bits[start + from as usize..start + to as usize] {
                        *byte |= bit;
                    }
                }
            }
        }
    }

    /// Point by point, within the extents.
    fn block_round(&mut self, lattice: &Lattice, part: &Region, obstacle: &Region) {
        let pitch = lattice.pitch_m;
        let (part_low, part_high) = part.extent();
        let (low, high) = obstacle.extent();
        // One step further to each side: where steps into the obstacle begin.
        let margin = Vec2::new(pitch, pitch);
        let (low, high) = (low - part_high - margin, high - part_low + margin);
        let (first_row, last_row) = indices(low.y, high.y, lattice.origin.y, pitch, lattice.height);
        let (first, last) = indices(low.x, high.x, lattice.origin.x, pitch, lattice.width);
        for row in first_row..last_row {
            for column in first..last {
                let index = row as usize * lattice.width as usize + column as usize;
                let at = part.at + Vec2::new(lattice.x(column), lattice.y(row));
                let standing = Region { at, ..*part };
                if regions_overlap(&standing, obstacle) {
                    self.bits[index] |= ALL;
                    continue;
                }
                for (bit, columns, rows) in &MOVES[1..] {
                    if self.bits[index] & bit == 0 {
                        let along = Vec2::new(f64::from(*columns), f64::from(*rows)) * pitch;
                        if regions_overlap(&Region { along, ..standing }, obstacle) {
                            self.bits[index] |= bit;
                        }
                    }
                }
            }
        }
    }
}

/// The Minkowski difference of two boxes, on the lattice.
struct BoxOnGrid {
    /// Columns and rows strictly inside, which may lie off the lattice.
    columns: std::ops::Range<i64>,
    rows: std::ops::Range<i64>,
}

impl BoxOnGrid {
    /// None unless both are boxes, and the obstacle is not swept aslant.
    fn of(lattice: &Lattice, part: &Region, obstacle: &Region) -> Option<Self> {
        let (part_half, obstacle_half) = (part.shape.half_box()?, obstacle.shape.half_box()?);
        if obstacle.along.x != 0.0 && obstacle.along.y != 0.0 {
            return None;
        }
        let pitch = lattice.pitch_m;
        let half = part_half + obstacle_half + obstacle.along.abs() / 2.0;
        let middle = obstacle.at + obstacle.along / 2.0 - part.at - lattice.origin;
        let contact = Vec2::new(CONTACT_M, CONTACT_M);
        let low = (middle - half + contact) / pitch;
        let high = (middle + half - contact) / pitch;
        let inside = |low: f64, high: f64| low.floor() as i64 + 1..high.ceil() as i64;
        Some(Self {
            columns: inside(low.x, high.x),
            rows: inside(low.y, high.y),
        })
    }
}

/// The part of a range that is on the lattice.
fn clamp(range: &std::ops::Range<i64>, count: u32) -> std::ops::Range<u32> {
    let start = range.start.clamp(0, i64::from(count));
    start as u32..range.end.clamp(start, i64::from(count)) as u32
}

impl Blocked {
    /// Where the part's reference point, 0 in `part`, cannot be.
    fn of(part: &Region, obstacle: &Region) -> Self {
        let mut blocked = Self {
            low: Vec2::zeros(),
            high: Vec2::zeros(),
            sides: [Side::default(); MAX_SIDES],
            count: 0,
        };
        let apart = obstacle.at - part.at;
        all_normals(part, obstacle, |normal| {
            // part + r and the obstacle overlap beyond contact along every normal:
            // support + support' + (r − apart)·normal > contact.
            let room =
                part.support(normal) + obstacle.support(-normal) - CONTACT_M - apart.dot(&normal);
            if normal.y == 0.0 {
                if normal.x > 0.0 {
                    blocked.low.x = -room;
                } else {
                    blocked.high.x = room;
                }
            } else if normal.x == 0.0 {
                if normal.y > 0.0 {
                    blocked.low.y = -room;
                } else {
                    blocked.high.y = room;
                }
            } else {
                // (−normal) · r < room, solved for x.
                blocked.sides[blocked.count] = Side {
                    offset: -room / normal.x,
                    slope: normal.y / normal.x,
                    inside_left: normal.x < 0.0,
                };
                blocked.count += 1;
            }
            true
        });
        blocked
    }

    /// The open run of blocked robot centres in the row at `y`; empty when it ends before it
    /// begins.
    fn run(&self, y: f64) -> (f64, f64) {
        let (mut low, mut high) = (self.low.x, self.high.x);
        for side in &self.sides[..self.count] {
            let x = side.offset - side.slope * y;
            if side.inside_left {
                high = high.min(x);
            } else {
                low = low.max(x);
            }
        }
        (low, high)
    }
}

/// Lattice lines strictly between `low` and `high`: the first, and one past the last.
fn indices(low: f64, high: f64, origin: f64, pitch: f64, count: u32) -> (u32, u32) {
    let first = ((low - origin) / pitch).floor() + 1.0;
    let end = ((high - origin) / pitch).ceil();
    let first = first.clamp(0.0, f64::from(count));
    let end = end.clamp(0.0, f64::from(count));
    (first as u32, end as u32)
}
