//! Convex polygons: what makes one legal, its normals, growing it.
//!
//! Responsible for: corners in counter-clockwise order and the outward normals of the sides.
//! Not responsible for: other shapes (`shape`), overlap (`geometry`).

use crate::geometry::Vec2;
use crate::shape::{MAX_POLYGON_POINTS, ShapeError, check_length, check_width};

/// A corner that turns by less than this (sine of the angle) is no corner.
const MIN_TURN: f64 = 1e-6;

/// Corners counter-clockwise; `normals[i]` is the outward unit normal of the side from corner
/// `i` to the next.
#[derive(Debug, PartialEq)]
pub(crate) struct Polygon {
    pub(crate) points: Vec<Vec2>,
    pub(crate) normals: Vec<Vec2>,
    extent: (Vec2, Vec2),
}

/// The z component of the cross product.
fn cross(a: Vec2, b: Vec2) -> f64 {
    a.x * b.y - a.y * b.x
}

impl Polygon {
    /// The smallest axis-parallel box around it.
    pub(crate) const fn extent(&self) -> (Vec2, Vec2) {
        self.extent
    }

    /// The polygon with these corners, in either direction of rotation.
    pub(crate) fn new(corners: &[Vec2]) -> Result<Self, ShapeError> {
        let count = corners.len();
        if count < 3 {
            return Err(ShapeError::TooFewPoints { points: count });
        }
        if count > MAX_POLYGON_POINTS {
            return Err(ShapeError::TooManyPoints { points: count });
        }
        for corner in corners {
            check_length(corner.x)?;
            check_length(corner.y)?;
        }
        let mut points = corners.to_vec();
        let doubled_area: f64 = (0..count)
            .map(|i| cross(points[i], points[(i + 1) % count]))
            .sum();
        let clockwise = doubled_area < 0.0;
        if clockwise {
            points.reverse();
        }
        Self::check_convex(&points).map_err(|corner| ShapeError::NotConvex {
            corner: if clockwise {
                count - 1 - corner
            } else {
                corner
            },
        })?;
        let polygon = Self::of_counter_clockwise(points);
        check_width(polygon.thickness())?;
        Ok(polygon)
    }

    /// Every corner turns left by a real angle, and the turns add up to one round; else the
    /// first corner that does not, or the last.
    fn check_convex(points: &[Vec2]) -> Result<(), usize> {
        let count = points.len();
        let mut turned = 0.0;
        for i in 0..count {
            let before = points[i] - points[(i + count - 1) % count];
            let after = points[(i + 1) % count] - points[i];
            let scale = before.norm() * after.norm();
            let turn = cross(before, after);
            if scale == 0.0 || turn <= MIN_TURN * scale {
                return Err(i);
            }
            turned += turn.atan2(before.dot(&after));
        }
        if turned > std::f64::consts::TAU + MIN_TURN {
            return Err(count - 1);
        }
        Ok(())
    }

    fn of_counter_clockwise(points: Vec<Vec2>) -> Self {
        let count = points.len();
        let normals = (0..count)
            .map(|i| {
                let side = points[(i + 1) % count] - points[i];
                Vec2::new(side.y, -side.x) / side.norm()
            })
            .collect();
        let low = points.iter().fold(points[0], |low, p| low.inf(p));
        let high = points.iter().fold(points[0], |high, p| high.sup(p));
        Self {
            points,
            normals,
            extent: (low, high),
        }
    }

    /// Least width over all directions, attained across one of the sides.
    fn thickness(&self) -> f64 {
        self.points
            .iter()
            .zip(&self.normals)
            .map(|(on_side, normal)| {
                self.points
                    .iter()
                    .map(|p| (on_side - p).dot(normal))
                    .fold(0.0, f64::max)
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// Each corner becomes the crossing of its two sides, both moved out by `m`.
    pub(crate) fn grown(&self, m: f64) -> Self {
        let count = self.points.len();
        let points = (0..count)
            .map(|i| {
                let before = self.normals[(i + count - 1) % count];
                let after = self.normals[i];
                self.points[i] + (before + after) * (m / (1.0 + before.dot(&after)))
            })
            .collect();
        Self::of_counter_clockwise(points)
    }
}
