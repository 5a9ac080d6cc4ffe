//! The points a path search may visit (rules 8 and 33).
//!
//! Responsible for: choosing the pitch and the origin, and converting between points and cells.
//! Not responsible for: which points are free (`cspace`).
//!
//! Terms: a *contact coordinate* is a coordinate of the robot's centre at which some part of
//! some body just touches something, or at which it must be able to stop. Where all contact
//! coordinates of an axis differ by multiples of one length, a lattice of that pitch through them
//! decides exactly which places can be reached: it is *exact*. Otherwise the lattice runs
//! through the centres of cells of the given resolution, and what lies off it is joined to it by
//! exact straight pieces. A *cell* is the number of a lattice point, row by row from the lower
//! left.

use std::sync::Arc;

use crate::body::Body;
use crate::geometry::{CONTACT_M, Vec2};
use crate::shape::Shape;

/// Finest pitch the rules above may choose by themselves, m.
pub const MIN_EXACT_PITCH_M: f64 = 0.01;
/// Most points the rules above may choose by themselves.
pub const MAX_EXACT_POINTS: u64 = 1_500_000;
/// Most points of any lattice.
pub const MAX_LATTICE_POINTS: u64 = 4_000_000;
/// Most memory that the walls of all classes of bodies may take, bytes: one a lattice point
/// and class.
pub const MAX_RASTER_BYTES: u64 = 1 << 28;
/// Lengths are compared as whole micrometres.
const UM_PER_M: f64 = 1e6;
/// A length is a whole number of micrometres if it is within this of one, µm.
const WHOLE_UM: f64 = 1e-3;

/// Which lattice points are joined by a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Connectivity {
    /// East, north, west, south.
    Four,
    /// These and the diagonals, without cutting corners.
    Eight,
}

impl Connectivity {
    /// The number a scenario file calls it.
    #[must_use]
    pub const fn neighbours(self) -> u8 {
        match self {
            Self::Four => 4,
            Self::Eight => 8,
        }
    }
}

/// The points a path search may visit.
#[derive(Clone, Debug)]
pub struct Lattice {
    /// Lower left point, m.
    pub origin: Vec2,
    /// Distance of neighbouring points along an axis, m.
    pub pitch_m: f64,
    /// Points in a row.
    pub width: u32,
    /// Points in a column.
    pub height: u32,
    /// Which points are joined by a step.
    pub connectivity: Connectivity,
    /// Whether it decides reachability exactly (rule 33).
    pub exact: bool,
    xs: Arc<[f64]>,
    ys: Arc<[f64]>,
}

/// A rectangle as the lattice rules see it: centre and half widths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rect {
    pub(crate) at: Vec2,
    pub(crate) half: Vec2,
}

/// What the choice of a lattice depends on.
pub(crate) struct LatticeInput<'a> {
    pub(crate) bounds: (Vec2, Vec2),
    pub(crate) resolution_m: f64,
    pub(crate) connectivity: Connectivity,
    /// Walls inside the bounds.
    pub(crate) walls: &'a [(Shape, Vec2)],
    /// All classes of bodies.
    pub(crate) classes: &'a [Body],
    /// Objects at rest: at their starts and their goals.
    pub(crate) objects: &'a [(Shape, Vec2)],
    /// Robots at rest: their homes.
    pub(crate) robots: &'a [(Shape, Vec2)],
    /// Where robots' centres must be able to stop.
    pub(crate) stops: &'a [Vec2],
}

/// One axis of an exact lattice, whole micrometres.
struct Axis {
    base: i64,
    pitch: i64,
}

impl Lattice {
    /// The exact lattice where there is one within limits, else that of the given resolution.
    pub(crate) fn choose(input: &LatticeInput) -> Self {
        Self::exact(input).unwrap_or_else(|| Self::of_resolution(input))
    }

    /// Points of the lattice through the centres of cells, before it is built.
    pub(crate) fn points_of_resolution(bounds: (Vec2, Vec2), resolution_m: f64) -> f64 {
        let cells = |length: f64| (length / resolution_m + CONTACT_M).floor().max(1.0);
        let size = bounds.1 - bounds.0;
        cells(size.x) * cells(size.y)
    }

    fn of_resolution(input: &LatticeInput) -> Self {
        let pitch = input.resolution_m;
        let line = |low: f64, high: f64| -> Arc<[f64]> {
            let count = ((high - low) / pitch + CONTACT_M).floor().max(1.0) as u32;
            (0..count)
                .map(|i| low + (f64::from(i) + 0.5) * pitch)
                .collect()
        };
        let (low, high) = input.bounds;
        let (xs, ys) = (line(low.x, high.x), line(low.y, high.y));
        Self::through(xs, ys, pitch, input.connectivity, false)
    }

    fn exact(input: &LatticeInput) -> Option<Self> {
        let walls = rects(input.walls)?;
        let objects = rects(input.objects)?;
        let robots = rects(input.robots)?;
        let bounds = Rect {
            at: (input.bounds.0 + input.bounds.1) / 2.0,
            half: (input.bounds.1 - input.bounds.0) / 2.0,
        };
        let still: Vec<Rect> = walls
            .into_iter()
            .chain(objects)
            .chain(robots)
            .chain([bounds])
            .collect();
        let x = Axis::of(input, &still, |v| v.x)?;
        let y = Axis::of(input, &still, |v| v.y)?;
        let narrowest = input
            .classes
            .iter()
            .flat_map(|body| &body.parts)
            .map(|part| part.bare.width_m())
            .fold(f64::INFINITY, f64::min);
        let pitch = capped(gcd(x.pitch, y.pitch), micrometres(narrowest)?)?;
        if (pitch as f64) < MIN_EXACT_PITCH_M * UM_PER_M {
            return None;
        }
        let (low, high) = input.bounds;
        let columns = line(x.base, pitch, micrometres(low.x)?, micrometres(high.x)?)?;
        let rows = line(y.base, pitch, micrometres(low.y)?, micrometres(high.y)?)?;
        let points = columns.1 * rows.1;
        if points > MAX_EXACT_POINTS || points * input.classes.len() as u64 > MAX_RASTER_BYTES {
            return None;
        }
        let coordinates = |(first, count): (i64, u64)| -> Arc<[f64]> {
            (0..count)
                .map(|i| (first + i as i64 * pitch) as f64 / UM_PER_M)
                .collect()
        };
        Some(Self::through(
            coordinates(columns),
            coordinates(rows),
            pitch as f64 / UM_PER_M,
            input.connectivity,
            true,
        ))
    }

    fn through(
        xs: Arc<[f64]>,
        ys: Arc<[f64]>,
        pitch_m: f64,
        connectivity: Connectivity,
        exact: bool,
    ) -> Self {
        Self {
            origin: Vec2::new(xs[0], ys[0]),
            pitch_m,
            width: xs.len() as u32,
            height: ys.len() as u32,
            connectivity,
            exact,
            xs,
            ys,
        }
    }

    /// Number of points.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Whether there is no point at all: never, for a lattice of a scene.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where a cell is, m.
    ///
    /// # Panics
    /// When there is no such cell.
    #[must_use]
    #[inline]
    pub fn at(&self, cell: u32) -> Vec2 {
        Vec2::new(
            self.xs[(cell % self.width) as usize],
            self.ys[(cell / self.width) as usize],
        )
    }

    /// Coordinate of a column, m.
    #[inline]
    pub(crate) fn x(&self, column: u32) -> f64 {
        self.xs[column as usize]
    }

    /// Coordinate of a row, m.
    #[inline]
    pub(crate) fn y(&self, row: u32) -> f64 {
        self.ys[row as usize]
    }

    /// The cell at a point, if the point is on the lattice (within half of [`CONTACT_M`]).
    #[must_use]
    pub fn cell(&self, p: Vec2) -> Option<u32> {
        let column = nearest(p.x - self.origin.x, self.pitch_m, self.width)?;
        let row = nearest(p.y - self.origin.y, self.pitch_m, self.height)?;
        let off = (Vec2::new(self.x(column), self.y(row)) - p).amax();
        (off <= CONTACT_M / 2.0).then_some(row * self.width + column)
    }

    /// The cells around a point, at most two columns and two rows to each side: where a
    /// configuration off the lattice may join it. Row by row from the lower left.
    pub fn around(&self, p: Vec2) -> impl Iterator<Item = u32> + use<> {
        let (first_column, columns) = beside(p.x - self.origin.x, self.pitch_m, self.width);
        let (first_row, rows) = beside(p.y - self.origin.y, self.pitch_m, self.height);
        let width = self.width;
        (first_row..first_row + rows).flat_map(move |row| {
            (first_column..first_column + columns).map(move |column| row * width + column)
        })
    }
}

/// The whole number of pitches nearest to `offset`, if it is within the line.
fn nearest(offset: f64, pitch: f64, count: u32) -> Option<u32> {
    let index = (offset / pitch).round();
    (index >= 0.0 && index < f64::from(count)).then_some(index as u32)
}

/// Up to two lattice lines to each side of `offset`: the first and how many.
fn beside(offset: f64, pitch: f64, count: u32) -> (u32, u32) {
    let last = f64::from(count) - 1.0;
    let below = (offset / pitch).floor();
    let first = (below - 1.0).clamp(0.0, last);
    let end = (below + 2.0).clamp(first, last);
    (first as u32, (end - first) as u32 + 1)
}

/// Boxes only.
fn rects(shapes: &[(Shape, Vec2)]) -> Option<Vec<Rect>> {
    shapes
        .iter()
        .map(|(shape, at)| shape.half_box().map(|half| Rect { at: *at, half }))
        .collect()
}

/// A length as whole micrometres, if it is one.
fn micrometres(length_m: f64) -> Option<i64> {
    let um = length_m * UM_PER_M;
    let whole = um.round();
    ((um - whole).abs() <= WHOLE_UM).then_some(whole as i64)
}

fn gcd(a: i64, b: i64) -> i64 {
    let (mut a, mut b) = (a.abs(), b.abs());
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// The largest whole part of `length` that does not exceed `cap`.
fn capped(length: i64, cap: i64) -> Option<i64> {
    if length <= 0 || cap <= 0 {
        return None;
    }
    let least = (length + cap - 1) / cap;
    (least..=length)
        .find(|parts| length % parts == 0)
        .map(|parts| length / parts)
}

/// First coordinate on the line within bounds, and how many.
fn line(base: i64, pitch: i64, low: i64, high: i64) -> Option<(i64, u64)> {
    let first = low + (base - low).rem_euclid(pitch);
    (first <= high).then(|| (first, ((high - first) / pitch) as u64 + 1))
}

impl Axis {
    /// Collects every contact coordinate of this axis.
    fn of(input: &LatticeInput, still: &[Rect], axis: impl Fn(Vec2) -> f64) -> Option<Self> {
        // (half width, offset) of each part, with and without clearance, each once.
        let mut parts = Vec::new();
        for part in input.classes.iter().flat_map(|body| &body.parts) {
            for clearance in [false, true] {
                let half = micrometres(axis(part.shape(clearance).half_box()?))?;
                parts.push((half, micrometres(axis(part.offset))?));
            }
        }
        parts.sort_unstable();
        parts.dedup();
        let mut edges = Vec::new();
        for rect in still {
            let at = micrometres(axis(rect.at) - axis(rect.half))?;
            edges.extend([at, micrometres(axis(rect.at) + axis(rect.half))?]);
        }
        edges.sort_unstable();
        edges.dedup();
        let mut stops = Vec::new();
        for stop in input.stops {
            stops.push(micrometres(axis(*stop))?);
        }
        let base = *stops.first()?;
        let mut pitch = 0;
        for stop in &stops {
            pitch = gcd(pitch, stop - base);
        }
        for (half, offset) in &parts {
            for edge in &edges {
                pitch = gcd(gcd(pitch, edge - half - offset - base), 2 * half);
            }
            // Two bodies that meet, each on the lattice.
            for (other_half, other_offset) in &parts {
                pitch = gcd(pitch, half + other_half + offset - other_offset);
            }
        }
        Some(Self { base, pitch })
    }
}
