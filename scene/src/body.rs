//! What moves as one: a robot alone, or a robot with what it carries (rule 3).
//!
//! Responsible for: the parts of such a body and where they are.
//! Not responsible for: which obstacles it meets (`cspace`), who carries what (crate `world`).
//!
//! Terms: a *class* is what bodies that behave alike have in common. Class 0 is the robot alone;
//! each distinct pair of object shape and grasp makes one more.

use crate::geometry::{Region, Vec2, regions_overlap};
use crate::shape::Shape;

/// Number of a class of bodies: 0 is the robot alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClassId(pub usize);

/// The class of a robot that carries nothing.
pub const ROBOT_ALONE: ClassId = ClassId(0);

/// One convex part of a body.
#[derive(Clone, Debug)]
pub struct Part {
    /// The part itself.
    pub bare: Shape,
    /// The part with the clearance around it.
    pub grown: Shape,
    /// Centre of the part minus centre of the robot, m.
    pub offset: Vec2,
}

impl Part {
    /// The part with or without its clearance.
    #[must_use]
    pub const fn shape(&self, clearance: bool) -> &Shape {
        if clearance { &self.grown } else { &self.bare }
    }
}

/// The rigid union of its parts (rule 3), placed by the centre of the robot.
#[derive(Clone, Debug)]
pub struct Body {
    /// The robot, then what it carries.
    pub parts: Vec<Part>,
}

impl Body {
    /// A robot alone.
    #[must_use]
    pub fn robot(robot: &Shape, clearance_m: f64) -> Self {
        Self {
            parts: vec![Part {
                bare: robot.clone(),
                grown: robot.grown(clearance_m),
                offset: Vec2::zeros(),
            }],
        }
    }

    /// A robot that carries an object, its centre `grasp` away from the object's.
    #[must_use]
    pub fn carrying(robot: &Shape, object: &Shape, grasp: Vec2, clearance_m: f64) -> Self {
        let mut body = Self::robot(robot, clearance_m);
        body.parts.push(Part {
            bare: object.clone(),
            grown: object.grown(clearance_m),
            offset: -grasp,
        });
        body
    }

    /// Whether this body, moving straight from `from` to `to` (robot centres), overlaps a shape
    /// that moves from `at` to `at_to`, whatever the timing; with or without its clearance.
    #[must_use]
    pub fn sweeps(
        &self,
        from: Vec2,
        to: Vec2,
        clearance: bool,
        shape: &Shape,
        at: Vec2,
        at_to: Vec2,
    ) -> bool {
        let obstacle = Region::swept(shape, at, at_to);
        self.parts.iter().any(|part| {
            let region = Region::swept(part.shape(clearance), from + part.offset, to + part.offset);
            regions_overlap(&region, &obstacle)
        })
    }

    /// Whether this body, standing at `at` (robot centre), overlaps a standing shape.
    #[must_use]
    pub fn overlaps(&self, at: Vec2, clearance: bool, shape: &Shape, shape_at: Vec2) -> bool {
        self.sweeps(at, at, clearance, shape, shape_at, shape_at)
    }
}
