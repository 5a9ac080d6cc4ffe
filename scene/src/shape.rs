//! One convex shape, centred on its own origin.
//!
//! Responsible for: what shapes there are, what makes one legal, growing it by a clearance.
//! Not responsible for: where it stands and what it overlaps (`geometry`), what a scenario file
//! calls it (`file`).
//!
//! Terms: *extent* is the smallest axis-parallel box around a shape. A shape is an open convex
//! region (rule 1).

use std::sync::Arc;

use serde::Serialize;

use crate::geometry::Vec2;
use crate::polygon::Polygon;

/// Smallest width of any shape, m. Anything thinner is taken for a mistake in the units.
pub const MIN_WIDTH_M: f64 = 1e-3;
/// Largest length or coordinate, m. Beyond it a micrometre is no longer safely resolved.
pub const MAX_LENGTH_M: f64 = 1e5;
/// Most corners of a polygon: half-planes of a pair of them fit a fixed array.
pub const MAX_POLYGON_POINTS: usize = 16;

/// Why something is no shape.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A coordinate or length that is NaN or infinite.
    #[error("has a length that is not a finite number")]
    NotFinite,
    /// Zero, negative or thinner than [`MIN_WIDTH_M`].
    #[error("is {width_m} m wide, but a body is at least {MIN_WIDTH_M} m wide")]
    TooSmall {
        /// The offending width.
        width_m: f64,
    },
    /// Beyond [`MAX_LENGTH_M`].
    #[error("reaches {length_m} m, but no length may exceed {MAX_LENGTH_M} m")]
    TooLarge {
        /// The offending length.
        length_m: f64,
    },
    /// Fewer than three corners.
    #[error("is a polygon with {points} corners, but it takes at least three")]
    TooFewPoints {
        /// How many there are.
        points: usize,
    },
    /// More than [`MAX_POLYGON_POINTS`].
    #[error("is a polygon with {points} corners, but {MAX_POLYGON_POINTS} are the most supported")]
    TooManyPoints {
        /// How many there are.
        points: usize,
    },
    /// Turns the wrong way, or not at all, or goes round more than once.
    #[error(
        "is a polygon that is not convex at corner {corner} (counted from 0): split it into convex ones"
    )]
    NotConvex {
        /// The corner, in the order given.
        corner: usize,
    },
    /// The origin, which is the body's reference point, is not inside.
    #[error(
        "is a polygon around its centre [0, 0], but [0, 0] is not inside it: give its corners relative to the body's centre"
    )]
    CentreOutside,
}

/// An open convex region around its own origin: box, circle or convex polygon.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    pub(crate) kind: Kind,
}

/// The three kinds. Cloning never allocates.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Kind {
    /// Axis-parallel, half widths.
    Box { half: Vec2 },
    /// Radius.
    Circle { radius: f64 },
    /// Convex, counter-clockwise.
    Polygon(Arc<Polygon>),
}

/// What a shape looks like, for traces and viewers. Metres, relative to the shape's origin.
#[derive(Clone, Debug, PartialEq, Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ShapeOutline {
    /// Half widths along x and y.
    Box {
        /// Half widths.
        half: [f64; 2],
    },
    /// A disc.
    Circle {
        /// Its radius.
        radius: f64,
    },
    /// Corners, counter-clockwise.
    Polygon {
        /// The corners.
        points: Vec<[f64; 2]>,
    },
}

/// Checks a length or coordinate.
pub(crate) fn check_length(length_m: f64) -> Result<(), ShapeError> {
    if !length_m.is_finite() {
        Err(ShapeError::NotFinite)
    } else if length_m.abs() > MAX_LENGTH_M {
        Err(ShapeError::TooLarge { length_m })
    } else {
        Ok(())
    }
}

/// Checks the width of a body.
pub(crate) fn check_width(width_m: f64) -> Result<(), ShapeError> {
    check_length(width_m)?;
    if width_m < MIN_WIDTH_M {
        return Err(ShapeError::TooSmall { width_m });
    }
    Ok(())
}

impl Shape {
    /// An axis-parallel box of these full widths, m.
    ///
    /// # Errors
    /// A width that is not finite, too small or too large.
    pub fn rectangle(full: Vec2) -> Result<Self, ShapeError> {
        check_width(full.x)?;
        check_width(full.y)?;
        Ok(Self {
            kind: Kind::Box { half: full / 2.0 },
        })
    }

    /// A disc of this radius, m.
    ///
    /// # Errors
    /// A radius that is not finite, too small or too large.
    pub fn circle(radius: f64) -> Result<Self, ShapeError> {
        check_width(2.0 * radius)?;
        Ok(Self {
            kind: Kind::Circle { radius },
        })
    }

    /// A convex polygon with these corners, in either direction of rotation, m.
    ///
    /// # Errors
    /// Too few or too many corners, not finite, not strictly convex, too thin or too large.
    pub fn polygon(corners: &[Vec2]) -> Result<Self, ShapeError> {
        Ok(Self {
            kind: Kind::Polygon(Arc::new(Polygon::new(corners)?)),
        })
    }

    /// The same shape with every side moved outwards by `m` metres; corners stay sharp. A
    /// growth of 0 gives the shape itself.
    #[must_use]
    pub fn grown(&self, m: f64) -> Self {
        if m <= 0.0 {
            return self.clone();
        }
        let kind = match &self.kind {
            Kind::Box { half } => Kind::Box {
                half: half + Vec2::new(m, m),
            },
            Kind::Circle { radius } => Kind::Circle { radius: radius + m },
            Kind::Polygon(polygon) => Kind::Polygon(Arc::new(polygon.grown(m))),
        };
        Self { kind }
    }

    /// Half widths, if it is a box.
    #[must_use]
    #[inline]
    pub fn half_box(&self) -> Option<Vec2> {
        match self.kind {
            Kind::Box { half } => Some(half),
            _ => None,
        }
    }

    /// The smallest axis-parallel box around it: lower left and upper right corner, m.
    #[must_use]
    pub fn extent(&self) -> (Vec2, Vec2) {
        match &self.kind {
            Kind::Box { half } => (-half, *half),
            Kind::Circle { radius } => (-Vec2::new(*radius, *radius), Vec2::new(*radius, *radius)),
            Kind::Polygon(polygon) => polygon.extent(),
        }
    }

    /// The smaller of its two widths, m.
    #[must_use]
    pub fn width_m(&self) -> f64 {
        let (low, high) = self.extent();
        (high - low).min()
    }

    /// Whether its own origin is inside.
    #[must_use]
    pub fn contains_origin(&self) -> bool {
        match &self.kind {
            Kind::Box { .. } | Kind::Circle { .. } => true,
            Kind::Polygon(polygon) => polygon
                .points
                .iter()
                .zip(&polygon.normals)
                .all(|(point, normal)| point.dot(normal) > 0.0),
        }
    }

    /// What it looks like.
    #[must_use]
    pub fn outline(&self) -> ShapeOutline {
        match &self.kind {
            Kind::Box { half } => ShapeOutline::Box {
                half: [half.x, half.y],
            },
            Kind::Circle { radius } => ShapeOutline::Circle { radius: *radius },
            Kind::Polygon(polygon) => ShapeOutline::Polygon {
                points: polygon.points.iter().map(|p| [p.x, p.y]).collect(),
            },
        }
    }

    /// Radius of the disc its core is swept with: 0 for all but circles.
    #[inline]
    pub(crate) fn radius(&self) -> f64 {
        match self.kind {
            Kind::Circle { radius } => radius,
            _ => 0.0,
        }
    }

    /// Largest `normal · p` over the core's points `p`: the support function. The core of a
    /// circle is its centre.
    #[inline]
    pub(crate) fn core_support(&self, normal: Vec2) -> f64 {
        match &self.kind {
            Kind::Box { half } => half.x * normal.x.abs() + half.y * normal.y.abs(),
            Kind::Circle { .. } => 0.0,
            Kind::Polygon(polygon) => polygon
                .points
                .iter()
                .map(|p| p.dot(&normal))
                .fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// A point of the core where the support function is attained.
    pub(crate) fn core_support_point(&self, normal: Vec2) -> Vec2 {
        match &self.kind {
            Kind::Box { half } => Vec2::new(half.x.copysign(normal.x), half.y.copysign(normal.y)),
            Kind::Circle { .. } => Vec2::zeros(),
            Kind::Polygon(polygon) => {
                let mut best = polygon.points[0];
                for point in &polygon.points[1..] {
                    if point.dot(&normal) > best.dot(&normal) {
                        best = *point;
                    }
                }
                best
            }
        }
    }

    /// Outward normals of the slanted or straight sides that the axis directions do not cover.
    pub(crate) fn side_normals(&self) -> &[Vec2] {
        match &self.kind {
            Kind::Polygon(polygon) => &polygon.normals,
            _ => &[],
        }
    }
}
