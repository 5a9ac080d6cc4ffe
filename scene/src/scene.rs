//! A scenario that was checked, with all that follows from it. Immutable; every machine of a run
//! reads the same one.
//!
//! Responsible for: bodies by class, the lattice, the walls' configuration space, identity (hash).
//! Not responsible for: reading files (`scenario`), checking (`validate`).

use std::sync::Arc;

use shm_types::Counts;

use crate::body::{Body, ClassId, ROBOT_ALONE};
use crate::build::Sound;
use crate::draft::{Draft, Event, Move, UserOrder};
use crate::geometry::{CONTACT_M, Vec2, overlap};
use crate::lattice::{Lattice, LatticeInput};
use crate::problem::Problems;
use crate::raster::Raster;
use crate::shape::Shape;
use crate::validate::{Starts, validate};

/// The robots' common properties.
#[derive(Clone, Debug)]
pub struct RobotSpec {
    /// Shape around the robot's centre.
    pub shape: Shape,
    /// Speed, m/s.
    pub speed_m_per_s: f64,
    /// Distance kept from everything but what is grasped, m.
    pub clearance_m: f64,
    /// Duration of a grasp, ns.
    pub grasp_ns: u64,
    /// Duration of a release, ns.
    pub release_ns: u64,
}

/// One object, and its task.
#[derive(Clone, Debug)]
pub struct ObjectSpec {
    /// Shape around the object's centre.
    pub shape: Shape,
    /// Robot centre minus object centre while grasped, m (rule 2): the first of its grasps.
    pub grasp: Vec2,
    /// Every grasp.
    pub grasps: Vec<Grasp>,
    /// Whether robots that carry nothing may pass under it while it is on the ground.
    pub pass_under: bool,
    /// Number of its kind: objects of one kind are interchangeable.
    pub kind: Option<usize>,
    /// Where its centre is at the start, m.
    pub start: Vec2,
    /// Where its centre shall be, m; none for clutter. Of a kind's, as they are assigned at the
    /// start.
    pub goal: Option<Vec2>,
    /// Class of a robot that carries it by its first grasp.
    pub class: ClassId,
}

/// One way to hold an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grasp {
    /// Robot centre minus object centre, m.
    pub offset: Vec2,
    /// Class of a robot that carries the object like that.
    pub class: ClassId,
}

/// A scenario that was checked.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Its name.
    pub name: String,
    /// Hash of the canonical text: what identifies it.
    pub hash: u64,
    /// Lower left and upper right corner of the workspace, m.
    pub bounds: (Vec2, Vec2),
    /// The walls, each with its place: those of the file in its order, then four around the
    /// bounds.
    pub walls: Vec<(Shape, Vec2)>,
    /// What the robots have in common.
    pub robot: RobotSpec,
    /// The objects.
    pub objects: Vec<ObjectSpec>,
    /// Where the robots start and return to.
    pub homes: Vec<Vec2>,
    /// The user's own order.
    pub before: Vec<UserOrder>,
    /// Moves that solve it one after the other, where known. Not part of its identity.
    pub certificate: Vec<Move>,
    /// The points a path search may visit.
    pub lattice: Lattice,
    classes: Arc<[Body]>,
    walls_only: Arc<[Raster]>,
    draft: Arc<Draft>,
}

impl Scene {
    /// Checks a draft and works out all that follows from it.
    ///
    /// # Errors
    /// Everything that is wrong with it.
    pub fn new(draft: Draft) -> Result<Self, Problems> {
        Self::make(draft, Starts::Checked)
    }

    /// As [`Self::new`], for a version of a scene under way: where objects start is history.
    ///
    /// # Errors
    /// Everything else that is wrong with it.
    pub fn version(draft: Draft) -> Result<Self, Problems> {
        Self::make(draft, Starts::History)
    }

    fn make(draft: Draft, starts: Starts) -> Result<Self, Problems> {
        let Sound {
            bounds,
            walls,
            robot,
            objects,
            homes,
            classes,
        } = validate(&draft, starts)?;
        let inside = &walls[..draft.walls.len()];
        let mut lattice = choose_lattice(
            &draft, starts, bounds, inside, &robot, &objects, &homes, &classes,
        );
        if starts == Starts::History {
            // Where things happen to stand makes the lattice no coarser, but less than exact.
            let on_it = |object: &ObjectSpec| lattice.cell(object.start + object.grasp).is_some();
            lattice.exact &= objects.iter().all(on_it);
        }
        let walls_only = classes
            .iter()
            .map(|body| Raster::of_walls(&lattice, body, &walls))
            .collect();
        let mut scene = Self {
            name: draft.name.clone(),
            hash: crate::canonical::hash(&draft),
            bounds,
            walls,
            robot,
            objects,
            homes,
            before: draft.before.clone(),
            certificate: draft.certificate.clone(),
            lattice,
            classes: classes.into(),
            walls_only,
            draft: Arc::new(draft),
        };
        crate::kinds::assign(&mut scene);
        Ok(scene)
    }

    /// What it was made from.
    #[must_use]
    pub fn draft(&self) -> &Draft {
        &self.draft
    }

    /// The body that moves as this class.
    ///
    /// # Panics
    /// When there is no such class: classes come from this scene's objects or are
    /// [`ROBOT_ALONE`].
    #[inline]
    #[must_use]
    pub fn body(&self, class: ClassId) -> &Body {
        &self.classes[class.0]
    }

    /// How many classes there are.
    #[must_use]
    pub fn class_count(&self) -> usize {
        self.classes.len()
    }

    /// The grasp by which a robot `offset` (m) from the centre of an object holds it, if there is
    /// one.
    #[must_use]
    pub fn grasp_by(&self, object: usize, offset: Vec2) -> Option<usize> {
        let grasps = self.objects[object].grasps.iter();
        let mut near = grasps.map(|grasp| (grasp.offset - offset).norm() <= CONTACT_M);
        near.position(|near| near)
    }

    /// Whether an object can be held in one way only, and go to one goal only. Where it is not so,
    /// what hinders one grasp, or keeps it from one goal, proves nothing.
    #[must_use]
    pub fn is_plain(&self, object: usize) -> bool {
        self.objects[object].grasps.len() == 1 && self.objects[object].kind.is_none()
    }

    /// Class of a robot that holds this object by its first grasp, or none.
    #[must_use]
    pub fn class_holding(&self, object: Option<usize>) -> ClassId {
        object.map_or(ROBOT_ALONE, |object| self.objects[object].class)
    }

    /// How many robots and objects there are.
    #[must_use]
    pub fn counts(&self) -> Counts {
        Counts {
            robots: self.homes.len() as u32,
            objects: self.objects.len() as u32,
        }
    }

    /// Where a robot's centre is when it grasps, or has just released, `object` at `at`.
    #[must_use]
    pub fn grasp_at(&self, object: usize, at: Vec2) -> Vec2 {
        at + self.objects[object].grasp
    }

    /// Whether a grasp puts the robot under its object: then the object is no obstacle to the
    /// robot that comes for it, nor to the one that leaves it.
    #[must_use]
    pub fn lifts_from_below(&self, object: usize) -> bool {
        let spec = &self.objects[object];
        let mut grasps = spec.grasps.iter();
        grasps.any(|grasp| overlap(&self.robot.shape, grasp.offset, &spec.shape, Vec2::zeros()))
    }

    /// Whether the user's order lets `event` of a task come only after an event of another:
    /// those others.
    pub fn must_wait_for(&self, task: usize, event: Event) -> impl Iterator<Item = (usize, Event)> {
        self.before
            .iter()
            .filter(move |order| order.then == (task, event))
            .map(|order| order.first)
    }

    /// The same scenario with its first `robots` homes only, and no certificate.
    ///
    /// # Errors
    /// More robots than homes, or none.
    pub fn with_robots(&self, robots: usize) -> Result<Self, Problems> {
        if robots == self.homes.len() {
            return Ok(self.clone());
        }
        crate::validate::enough_homes(robots, self.homes.len())?;
        let mut draft = (*self.draft).clone();
        draft.homes.truncate(robots);
        // Its moves may need a robot that is gone.
        draft.certificate.clear();
        Self::new(draft)
    }

    /// The same scenario with robots of another speed, m/s.
    ///
    /// # Errors
    /// A speed that is not a positive, finite number.
    pub fn with_speed(&self, speed_m_per_s: f64) -> Result<Self, Problems> {
        let mut draft = (*self.draft).clone();
        draft.robot.speed_m_per_s = speed_m_per_s;
        Self::new(draft)
    }

    /// The configuration space of a class with the walls alone.
    pub(crate) fn walls_only(&self, class: ClassId) -> &Raster {
        &self.walls_only[class.0]
    }
}

#[expect(clippy::too_many_arguments, reason = "all that a lattice has to fit")]
fn choose_lattice(
    draft: &Draft,
    starts: Starts,
    bounds: (Vec2, Vec2),
    walls: &[(Shape, Vec2)],
    robot: &RobotSpec,
    objects: &[ObjectSpec],
    homes: &[Vec2],
    classes: &[Body],
) -> Lattice {
    let mut resting = Vec::new();
    let mut stops = homes.to_vec();
    for object in objects {
        let start = (starts == Starts::Checked).then_some(object.start);
        for at in [start, object.goal].into_iter().flatten() {
            resting.push((object.shape.clone(), at));
            stops.extend(object.grasps.iter().map(|grasp| at + grasp.offset));
        }
    }
    let parked: Vec<_> = homes
        .iter()
        .map(|home| (robot.shape.clone(), *home))
        .collect();
    Lattice::choose(&LatticeInput {
        bounds,
        resolution_m: draft.resolution_m,
        connectivity: draft.connectivity,
        walls,
        classes,
        objects: &resting,
        robots: &parked,
        stops: &stops,
    })
}
