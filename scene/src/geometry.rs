//! Whether two open convex regions overlap, standing or swept along a straight line.
//!
//! Responsible for: the one meaning of "overlap" (a penetration of more than [`CONTACT_M`]), with
//! no allocation. This is the only file that names parry2d.
//! Not responsible for: what counts as an obstacle to whom (crates `planner` and `world`).
//!
//! Terms: *penetration* is the length of the shortest translation that parts two regions. The
//! *core* of a circle is its centre, that of any other shape the shape itself; a region is its
//! core, swept along its motion, with its radius around it.
//!
//! How: without circles, the penetration is the least overlap along the normals of the sides
//! of both swept polygons (separating axes): exact, and the same for boxes as for polygons. With
//! a circle, it is what the sum of radii leaves of the distance between the cores, and parry's
//! GJK finds that distance. GJK alone would say *whether* two shapes meet but not by how much,
//! and its penetration depths come with allocations.

use parry2d_f64::math::{Pose, Vector};
use parry2d_f64::query::details::distance_support_map_support_map;
use parry2d_f64::shape::SupportMap;
use shm_types::Point;

use crate::shape::Shape;

/// A point or an offset of the world frame, m.
pub type Vec2 = nalgebra::Vector2<f64>;

/// What divides touching from overlap, m: a penetration beyond this is overlap, anything less is
/// touching (rule 1).
pub const CONTACT_M: f64 = 1e-6;

/// Nearer than this to a corner point of a path (m), a robot is at it: rounding of lengths must
/// not cost a tick. A thousandth of what divides touching from overlap.
pub const ARRIVAL_M: f64 = CONTACT_M / 1_000.0;

/// A wire point as a vector.
#[must_use]
pub const fn vec(point: Point) -> Vec2 {
    Vec2::new(point.x, point.y)
}

/// A vector as a wire point.
#[must_use]
pub fn point(vector: Vec2) -> Point {
    Point::new(vector.x, vector.y)
}

/// All that a shape covers while its origin moves from `at` to `at + along`, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Region<'a> {
    pub(crate) shape: &'a Shape,
    pub(crate) at: Vec2,
    pub(crate) along: Vec2,
}

impl<'a> Region<'a> {
    /// A shape that stands still.
    pub(crate) fn standing(shape: &'a Shape, at: Vec2) -> Self {
        Self {
            shape,
            at,
            along: Vec2::zeros(),
        }
    }

    /// A shape that moves in a straight line.
    pub(crate) fn swept(shape: &'a Shape, from: Vec2, to: Vec2) -> Self {
        Self {
            shape,
            at: from,
            along: to - from,
        }
    }

    /// The smallest axis-parallel box around it.
    pub(crate) fn extent(&self) -> (Vec2, Vec2) {
        let (low, high) = self.shape.extent();
        let to = self.at + self.along;
        (low + self.at.inf(&to), high + self.at.sup(&to))
    }

    /// Support function of the core, relative to `at`.
    #[inline]
    pub(crate) fn support(&self, normal: Vec2) -> f64 {
        self.shape.core_support(normal) + self.along.dot(&normal).max(0.0)
    }

    /// Unit normal of the two sides that a slanted sweep adds, if it is slanted.
    pub(crate) fn sweep_normal(&self) -> Option<Vec2> {
        if self.along.x == 0.0 || self.along.y == 0.0 {
            return None;
        }
        Some(Vec2::new(self.along.y, -self.along.x) / self.along.norm())
    }
}

/// Calls `test` with the outward normals (seen from `a`) of all sides of the Minkowski
/// difference of both cores, axis directions first; true when it is true for all. Axis
/// directions that are no side do no harm: they only bound the difference.
#[inline]
pub(crate) fn all_normals(a: &Region, b: &Region, mut test: impl FnMut(Vec2) -> bool) -> bool {
    let axes = [Vec2::x(), -Vec2::x(), Vec2::y(), -Vec2::y()];
    if !axes.into_iter().all(&mut test) {
        return false;
    }
    for normal in [a.sweep_normal(), b.sweep_normal()].into_iter().flatten() {
        if !test(normal) || !test(-normal) {
            return false;
        }
    }
    a.shape.side_normals().iter().all(|&normal| test(normal))
        && b.shape.side_normals().iter().all(|&normal| test(-normal))
}

/// Whether two regions overlap.
pub(crate) fn regions_overlap(a: &Region, b: &Region) -> bool {
    let radius = a.shape.radius() + b.shape.radius();
    if radius > 0.0 {
        return extents_meet(a, b) && core_distance(a, b) < radius - CONTACT_M;
    }
    let apart = a.at - b.at;
    let overlaps_along =
        |normal: Vec2| a.support(normal) + b.support(-normal) + apart.dot(&normal) > CONTACT_M;
    match (a.shape.half_box(), b.shape.half_box()) {
        (Some(a_half), Some(b_half)) => {
            // The axis directions at once, which settles it but for slanted sweeps.
            let room = a_half + b_half + (a.along.abs() + b.along.abs()) / 2.0;
            let between = (apart + (a.along - b.along) / 2.0).abs();
            between.x < room.x - CONTACT_M
                && between.y < room.y - CONTACT_M
                && [a.sweep_normal(), b.sweep_normal()]
                    .into_iter()
                    .flatten()
                    .all(|normal| overlaps_along(normal) && overlaps_along(-normal))
        }
        _ => all_normals(a, b, overlaps_along),
    }
}

fn extents_meet(a: &Region, b: &Region) -> bool {
    let (a_low, a_high) = a.extent();
    let (b_low, b_high) = b.extent();
    a_low.x < b_high.x && b_low.x < a_high.x && a_low.y < b_high.y && b_low.y < a_high.y
}

/// A region's core with the origin of the frame at `origin`, as parry sees it.
struct Core<'a> {
    region: &'a Region<'a>,
    at: Vec2,
}

impl SupportMap for Core<'_> {
    fn local_support_point(&self, dir: Vector) -> Vector {
        let normal = Vec2::new(dir.x, dir.y);
        let mut point = self.at + self.region.shape.core_support_point(normal);
        if self.region.along.dot(&normal) > 0.0 {
            point += self.region.along;
        }
        point.into()
    }
}

/// Distance between the cores, m; 0 when they meet.
fn core_distance(a: &Region, b: &Region) -> f64 {
    let first = Core {
        region: a,
        at: Vec2::zeros(),
    };
    let second = Core {
        region: b,
        at: b.at - a.at,
    };
    distance_support_map_support_map(&Pose::IDENTITY, &first, &second)
}

/// Whether two standing shapes overlap.
#[must_use]
pub fn overlap(a: &Shape, at: Vec2, b: &Shape, bt: Vec2) -> bool {
    regions_overlap(&Region::standing(a, at), &Region::standing(b, bt))
}

/// Whether `a`, moving straight from `from` to `to`, anywhere overlaps `b`, standing at `at`.
///
/// Two bodies that move at once, each straight and uniformly over the same time, overlap at some
/// instant exactly if the motion of one relative to the other does: pass that.
#[must_use]
pub fn swept_overlap(a: &Shape, from: Vec2, to: Vec2, b: &Shape, at: Vec2) -> bool {
    regions_overlap(&Region::swept(a, from, to), &Region::standing(b, at))
}

/// Whether the regions that two straight motions cover overlap, whatever the timing.
#[must_use]
pub fn swept_regions_overlap(
    a: &Shape,
    a_from: Vec2,
    a_to: Vec2,
    b: &Shape,
    b_from: Vec2,
    b_to: Vec2,
) -> bool {
    regions_overlap(
        &Region::swept(a, a_from, a_to),
        &Region::swept(b, b_from, b_to),
    )
}
