//! When two convex bodies meet while both move in straight lines, in closed form.
//!
//! Responsible for: the checker's own notion of overlap and distance in time.
//! Not responsible for: who may touch whom (`rules`), which pairs are worth a test (`grid`).
//!
//! Seen from one body, the other is a point that moves in a straight line, and the two meet while
//! that point is inside the Minkowski difference of their shapes. The difference is a convex
//! polygon with a disc around it (the discs of circles), so the times at which the point is
//! deeper inside than a given depth, or nearer than a given distance, are one interval, bounded by
//! crossings of a line with sides and circles. Nothing is sampled, nothing iterates.
//!
//! This shares nothing with the geometry that the run itself was planned and granted with.

use nalgebra::Vector2;

use crate::record::Outline;

/// How far what lies outside of a side reaches in, m: more than rounding, far less than matters.
const EDGE_M: f64 = 1e-9;

/// A point, an offset or a direction; m.
pub(crate) type Vector = Vector2<f64>;

/// A convex shape: the hull of its corners with a disc of `radius` around every point of it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Solid {
    corners: Vec<Vector>,
    radius: f64,
}

impl From<&Outline> for Solid {
    fn from(outline: &Outline) -> Self {
        match outline {
            Outline::Box { half } => {
                let (x, y) = (half.x, half.y);
                Self {
                    corners: vec![
                        Vector::new(-x, -y),
                        Vector::new(x, -y),
                        Vector::new(x, y),
                        Vector::new(-x, y),
                    ],
                    radius: 0.0,
                }
            }
            Outline::Circle { radius } => Self {
                corners: vec![Vector::zeros()],
                radius: *radius,
            },
            Outline::Polygon { points } => Self {
                corners: points.iter().map(|&point| point.into()).collect(),
                radius: 0.0,
            },
        }
    }
}

impl Solid {
    /// Lower left and upper right corner of the box around it.
    pub(crate) fn extent(&self) -> (Vector, Vector) {
        let around = Vector::new(self.radius, self.radius);
        let low = self
            .corners
            .iter()
            .fold(self.corners[0], |low, corner| low.inf(corner));
        let high = self
            .corners
            .iter()
            .fold(self.corners[0], |high, corner| high.sup(corner));
        (low - around, high + around)
    }
}

/// One side of a polygon: a corner, the direction and length to the next, the way out.
#[derive(Clone, Copy, Debug)]
struct Side {
    corner: Vector,
    along: Vector,
    length: f64,
    outward: Vector,
}

/// All places of one body's origin, relative to another's, at which the two meet.
#[derive(Clone, Debug)]
pub(crate) struct Meeting {
    sides: Vec<Side>,
    corners: Vec<Vector>,
    radius: f64,
}

/// Part of a straight motion, from 0 at its start to 1 at its end.
pub(crate) type Interval = (f64, f64);

impl Meeting {
    /// Where `moving` meets `standing`.
    pub(crate) fn of(moving: &Solid, standing: &Solid) -> Self {
        let differences = standing
            .corners
            .iter()
            .flat_map(|there| moving.corners.iter().map(move |own| there - own));
        let corners = hull(differences.collect());
        let sides = if corners.len() < 3 {
            Vec::new()
        } else {
            (0..corners.len())
                .map(|i| {
                    let (corner, next) = (corners[i], corners[(i + 1) % corners.len()]);
                    let length = (next - corner).norm();
                    let along = (next - corner) / length;
                    let outward = Vector::new(along.y, -along.x);
                    Side {
                        corner,
                        along,
                        length,
                        outward,
                    }
                })
                .collect()
        };
        Self {
            sides,
            corners,
            radius: moving.radius + standing.radius,
        }
    }

    /// When a motion of the origin from `from` to `to` is nearer to the other body than
    /// `distance`. A negative distance asks when it is deeper inside than that.
    pub(crate) fn nearer_than(&self, distance: f64, from: Vector, to: Vector) -> Option<Interval> {
        let reach = self.radius + distance;
        let line = Line {
            from,
            along: to - from,
        };
        if reach < 0.0 {
            return line.inside(&self.sides, reach);
        }
        // A convex region is the union of these pieces, so the hull of their intervals is its own.
        let core = line.inside(&self.sides, 0.0);
        let sides = self.sides.iter().map(|side| line.beside(side, reach));
        let corners = self
            .corners
            .iter()
            .map(|corner| line.around(*corner, reach));
        std::iter::once(core)
            .chain(sides)
            .chain(corners)
            .flatten()
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }
}

/// A straight motion.
struct Line {
    from: Vector,
    along: Vector,
}

impl Line {
    /// When `normal · position < limit`, within `interval`.
    fn clip(&self, interval: Interval, normal: Vector, limit: f64) -> Option<Interval> {
        let excess = normal.dot(&self.from) - limit;
        let rate = normal.dot(&self.along);
        let (start, end) = if rate == 0.0 {
            if excess >= 0.0 {
                return None;
            }
            interval
        } else if rate > 0.0 {
            (interval.0, interval.1.min(-excess / rate))
        } else {
            (interval.0.max(-excess / rate), interval.1)
        };
        (start <= end).then_some((start, end))
    }

    /// When it is inside the polygon of these sides, each moved outwards by `by`.
    fn inside(&self, sides: &[Side], by: f64) -> Option<Interval> {
        if sides.is_empty() {
            return None;
        }
        sides.iter().try_fold((0.0, 1.0), |interval, side| {
            self.clip(interval, side.outward, side.outward.dot(&side.corner) + by)
        })
    }

    /// When it is straight across from this side, outside of it, and nearer than `reach`. Reaching
    /// in a little leaves nothing between inside and outside for a motion along the side itself.
    fn beside(&self, side: &Side, reach: f64) -> Option<Interval> {
        let start = side.along.dot(&side.corner);
        let height = side.outward.dot(&side.corner);
        let interval = self.clip((0.0, 1.0), side.outward, height + reach)?;
        let interval = self.clip(interval, -side.outward, EDGE_M - height)?;
        let interval = self.clip(interval, side.along, start + side.length)?;
        self.clip(interval, -side.along, -start)
    }

    /// When it is nearer to `centre` than `reach`.
    fn around(&self, centre: Vector, reach: f64) -> Option<Interval> {
        let from = self.from - centre;
        let (a, b, c) = (
            self.along.norm_squared(),
            from.dot(&self.along),
            from.norm_squared() - reach * reach,
        );
        if a == 0.0 {
            return (c < 0.0).then_some((0.0, 1.0));
        }
        let root = (b * b - a * c).max(0.0).sqrt();
        let (start, end) = ((-b - root) / a, (-b + root) / a);
        let interval = (start.max(0.0), end.min(1.0));
        (b * b > a * c && interval.0 <= interval.1).then_some(interval)
    }
}

/// Corners of the convex hull, counter-clockwise; points on its sides are left out.
fn hull(mut points: Vec<Vector>) -> Vec<Vector> {
    /// Twice the area, m², below which three points count as lying on one line.
    const FLAT_M2: f64 = 1e-12;
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut corners: Vec<Vector> = Vec::new();
    let chain = |corners: &mut Vec<Vector>, points: &mut dyn Iterator<Item = &Vector>| {
        let base = corners.len();
        for &point in points {
            while let [.., a, b] = corners[base..]
                && (b - a).perp(&(point - b)) <= FLAT_M2
            {
                corners.pop();
            }
            corners.push(point);
        }
        corners.pop();
    };
    chain(&mut corners, &mut points.iter());
    chain(&mut corners, &mut points.iter().rev());
    corners
}
