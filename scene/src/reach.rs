//! What can be reached at all: one flood of the free space, and what its gaps prove (rule 10).
//!
//! Responsible for: tasks that walls alone make infeasible, and the words for infeasibility.
//! Not responsible for: cycles of easy constraints, which are found in crate `planner`.
//!
//! On a lattice that is not exact (rule 33) "unreachable" means at this resolution, and the
//! message says so.

use std::fmt;

use crate::body::ROBOT_ALONE;
use crate::cspace::Occupancy;
use crate::geometry::Vec2;
use crate::scene::Scene;

/// Which configurations a cycle of easy constraints is about (rules 27 and 28).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CycleKind {
    /// E1: each stands where the next one's robot must stand to grasp.
    Starts,
    /// E4: each one's goal is where the next one's robot must stand to release.
    Goals,
}

/// A proof that a scenario has no solution.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Infeasible {
    /// No robot gets from its home to the object's grasp, among the walls and the object itself.
    Approach {
        /// The object.
        object: usize,
        /// Whether that holds for certain, and not at the given resolution only.
        exact: bool,
    },
    /// The object cannot be carried to its goal, among the walls alone.
    Transfer {
        /// The object.
        object: usize,
        /// Whether that holds for certain, and not at the given resolution only.
        exact: bool,
    },
    /// No robot gets home from the object's goal, among the walls and the object itself.
    Return {
        /// The object.
        object: usize,
        /// Whether that holds for certain, and not at the given resolution only.
        exact: bool,
    },
    /// Each of these must be moved before the next, and the last before the first.
    Cycle {
        /// Which configurations.
        kind: CycleKind,
        /// The objects, in the order of the edges.
        objects: Vec<usize>,
    },
}

impl fmt::Display for Infeasible {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at_resolution = |exact: bool| if exact { "" } else { ", at this resolution" };
        match self {
            Self::Approach { object, exact } => write!(
                f,
                "no robot can reach the grasp of object {object} from its home{}",
                at_resolution(*exact)
            ),
            Self::Transfer { object, exact } => write!(
                f,
                "object {object} cannot be carried to its goal, even with no other object in the room{}",
                at_resolution(*exact)
            ),
            Self::Return { object, exact } => write!(
                f,
                "no robot can get home once it has put object {object} down at its goal{}",
                at_resolution(*exact)
            ),
            Self::Cycle { kind, objects } => {
                let what = match kind {
                    CycleKind::Starts => "stands in the way of grasping",
                    CycleKind::Goals => "at its goal stands in the way of releasing",
                };
                f.write_str("in a ring, each object ")?;
                write!(f, "{what} the next: ")?;
                for (i, object) in objects.iter().chain(objects.first()).enumerate() {
                    if i > 0 {
                        f.write_str(" → ")?;
                    }
                    write!(f, "{object}")?;
                }
                Ok(())
            }
        }
    }
}

/// All places one body reaches from one place: a flood over a configuration space.
#[derive(Clone, Debug)]
pub struct Flood {
    reached: Vec<bool>,
    stack: Vec<u32>,
}

impl Flood {
    /// A flood that has not started; reusable.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let len = scene.lattice.len();
        Self {
            reached: vec![false; len],
            stack: Vec::with_capacity(len),
        }
    }

    /// Forgets everything and floods the free space that is connected to `from`, on the lattice
    /// or off it.
    pub fn run(&mut self, scene: &Scene, space: &Occupancy, from: Vec2) {
        self.reached.fill(false);
        self.stack.clear();
        if !space.at_is_free(scene, from) {
            return;
        }
        for cell in joints(scene, space, from) {
            if !self.reached[cell as usize] {
                self.reached[cell as usize] = true;
                self.stack.push(cell);
            }
        }
        while let Some(cell) = self.stack.pop() {
            space.for_each_step(cell, |next, _| {
                if !self.reached[next as usize] {
                    self.reached[next as usize] = true;
                    self.stack.push(next);
                }
            });
        }
    }

    /// Whether the flood came to a cell.
    #[must_use]
    pub fn reached(&self, cell: u32) -> bool {
        self.reached[cell as usize]
    }

    /// Whether the flood came to a point, on the lattice or off it.
    #[must_use]
    pub fn reached_at(&self, scene: &Scene, space: &Occupancy, to: Vec2) -> bool {
        space.at_is_free(scene, to) && joints(scene, space, to).any(|cell| self.reached(cell))
    }
}

/// The cells a configuration is joined to: itself on the lattice, off it those around it that a
/// straight free piece leads to.
pub fn joints(scene: &Scene, space: &Occupancy, at: Vec2) -> impl Iterator<Item = u32> {
    let own = scene.lattice.cell(at);
    let around = own.is_none().then(|| {
        scene.lattice.around(at).filter(move |cell| {
            space.is_free(*cell) && space.straight_is_free(scene, at, scene.lattice.at(*cell))
        })
    });
    own.filter(|cell| space.is_free(*cell))
        .into_iter()
        .chain(around.into_iter().flatten())
}

/// The first task that the walls alone make infeasible (rule 10), if any. Objects that can be held
/// in several ways are left out: they may be held in one way first, then in another. So are those
/// that may go to several goals.
///
/// Cycles of easy constraints (rule 28) are another reason; they are found in crate `planner`.
#[must_use]
pub fn certificate(scene: &Scene) -> Option<Infeasible> {
    let mut space = Occupancy::new(scene);
    let mut flood = Flood::new(scene);
    let exact = scene.lattice.exact;
    for (object, spec) in scene.objects.iter().enumerate() {
        let Some(goal) = spec.goal else { continue };
        if (goal - spec.start).amax() <= crate::CONTACT_M || !scene.is_plain(object) {
            continue;
        }
        if !some_home_reached(scene, &mut space, &mut flood, object, spec.start) {
            return Some(Infeasible::Approach { object, exact });
        }
        space.reset(scene, spec.class);
        flood.run(scene, &space, scene.grasp_at(object, spec.start));
        if !flood.reached_at(scene, &space, scene.grasp_at(object, goal)) {
            return Some(Infeasible::Transfer { object, exact });
        }
        if !some_home_reached(scene, &mut space, &mut flood, object, goal) {
            return Some(Infeasible::Return { object, exact });
        }
    }
    None
}

/// Whether a robot at the grasp of `object`, standing at `at`, and some home are connected, among
/// the walls and the object itself. Motion is reversible, so this is approach and return alike.
fn some_home_reached(
    scene: &Scene,
    space: &mut Occupancy,
    flood: &mut Flood,
    object: usize,
    at: Vec2,
) -> bool {
    space.reset(scene, ROBOT_ALONE);
    let spec = &scene.objects[object];
    if !spec.pass_under && !scene.lifts_from_below(object) {
        space.block(scene, &spec.shape, at, false);
    }
    flood.run(scene, space, scene.grasp_at(object, at));
    scene
        .homes
        .iter()
        .any(|home| flood.reached_at(scene, space, *home))
}
