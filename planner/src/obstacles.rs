//! What is an obstacle to what. The only place that says so for planning.
//!
//! Responsible for: entering walls, objects and robots into the configuration space of a body
//! that is about to move.
//! Not responsible for: how a shape becomes blocked lattice points (`scene::Occupancy`), nor for
//! what the world grants in the end (crate `world`).
//!
//! The rules:
//! - Walls always are.
//! - An object on the ground is, with clearance. To a robot that carries nothing it is not if
//!   robots may pass under it.
//! - A robot's own target may be touched: it counts without clearance, and not at all if it is
//!   lifted from below. The same goes for an object the robot already stands that close to: one
//!   it has just put down.
//! - Another robot is, with what it holds, where it stands and all along what is granted to it
//!   (rule 20).
//! - What a robot carries, or is about to carry, is part of it and no obstacle.

use scene::{
    ClassId, Occupancy, ROBOT_ALONE, Scene, UNITS_PER_OBSTACLE, UNITS_PER_RESET, Vec2, vec,
};
use shm_types::{Checked, NONE, WorldSnapshot, index};

/// The world at one tick.
pub type WorldView<'a> = Checked<'a, WorldSnapshot>;

/// Whether other robots count as obstacles. Without them, a plan tells whether it is robots or
/// objects that block (rule 21).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Robots {
    /// They stand in the way.
    Include,
    /// As if they were not there.
    Ignore,
}

/// Where a robot plans from: the end of what is granted to it, or where it stands. m.
#[must_use]
pub fn plan_from(world: WorldView, robot: usize) -> Vec2 {
    let state = &world.robots()[robot];
    vec(*state.grant().last().unwrap_or(&state.position))
}

/// Where a robot's centre is while it grasps `task`'s object as it stands now, m.
#[must_use]
pub fn grasp_at_rest(scene: &Scene, world: WorldView, task: usize) -> Vec2 {
    vec(world.objects()[task].rest) + scene.objects[task].grasp
}

/// Where a robot's centre is while it holds `task`'s object at its goal, m; none for clutter.
#[must_use]
pub fn grasp_at_goal(scene: &Scene, world: WorldView, task: usize) -> Option<Vec2> {
    let object = &world.objects()[task];
    (object.has_goal == 1).then(|| vec(object.goal) + scene.objects[task].grasp)
}

/// Enters all that stands in the way of `robot`'s transit to `task`'s object. Units it took.
pub fn block_for_approach(
    occupancy: &mut Occupancy,
    scene: &Scene,
    world: WorldView,
    robot: usize,
    task: usize,
    robots: Robots,
) -> u64 {
    let mut obstacles = Obstacles::reset(occupancy, scene, ROBOT_ALONE);
    obstacles.block_objects_to_empty(world, robot, Some(task));
    obstacles.block_robots(world, robot, robots);
    obstacles.units
}

/// Enters all that stands in the way of `robot`'s transfer of `task`'s object, whether it holds
/// it already or not. Units it took.
pub fn block_for_transfer(
    occupancy: &mut Occupancy,
    scene: &Scene,
    world: WorldView,
    robot: usize,
    task: usize,
    robots: Robots,
) -> u64 {
    let mut obstacles = Obstacles::reset(occupancy, scene, scene.objects[task].class);
    for (other, object) in world.objects().iter().enumerate() {
        if other != task && object.holder == NONE {
            obstacles.block_object(other, vec(object.position), true);
        }
    }
    obstacles.block_robots(world, robot, robots);
    obstacles.units
}

/// Enters all that stands in the way of `robot`'s way home. Units it took.
pub fn block_for_home(
    occupancy: &mut Occupancy,
    scene: &Scene,
    world: WorldView,
    robot: usize,
    robots: Robots,
) -> u64 {
    let mut obstacles = Obstacles::reset(occupancy, scene, ROBOT_ALONE);
    obstacles.block_objects_to_empty(world, robot, None);
    obstacles.block_robots(world, robot, robots);
    obstacles.units
}

/// Enters walls and the one object that stands at `at` (m), in the way of a transfer of
/// `task`'s object: the hard constraints' test. Units it took.
pub(crate) fn block_for_pair(
    occupancy: &mut Occupancy,
    scene: &Scene,
    task: usize,
    other: Option<(usize, Vec2)>,
) -> u64 {
    let mut obstacles = Obstacles::reset(occupancy, scene, scene.objects[task].class);
    if let Some((object, at)) = other {
        obstacles.block_object(object, at, true);
    }
    obstacles.units
}

/// Enters walls and the robot's own target at `at` (m): rule 10's first and last leg. Units it
/// took.
pub(crate) fn block_for_own(
    occupancy: &mut Occupancy,
    scene: &Scene,
    task: usize,
    at: Vec2,
) -> u64 {
    let mut obstacles = Obstacles::reset(occupancy, scene, ROBOT_ALONE);
    if !scene.objects[task].pass_under && !scene.lifts_from_below(task) {
        obstacles.block_object(task, at, false);
    }
    obstacles.units
}

struct Obstacles<'a> {
    occupancy: &'a mut Occupancy,
    scene: &'a Scene,
    units: u64,
}

impl<'a> Obstacles<'a> {
    fn reset(occupancy: &'a mut Occupancy, scene: &'a Scene, class: ClassId) -> Self {
        occupancy.reset(scene, class);
        Self {
            occupancy,
            scene,
            units: UNITS_PER_RESET,
        }
    }

    fn block_object(&mut self, object: usize, at: Vec2, clearance: bool) {
        let shape = &self.scene.objects[object].shape;
        self.occupancy.block(self.scene, shape, at, clearance);
        self.units += UNITS_PER_OBSTACLE;
    }

    /// Objects on the ground, in the way of a robot that carries nothing.
    fn block_objects_to_empty(&mut self, world: WorldView, robot: usize, target: Option<usize>) {
        let body = self.scene.body(ROBOT_ALONE);
        let here = plan_from(world, robot);
        for (object, state) in world.objects().iter().enumerate() {
            let spec = &self.scene.objects[object];
            if state.holder != NONE || spec.pass_under {
                continue;
            }
            let at = vec(state.position);
            let own = target == Some(object);
            let meets = |clearance| body.overlaps(here, clearance, &spec.shape, at);
            if own && self.scene.lifts_from_below(object) || meets(false) {
                continue;
            }
            self.block_object(object, at, !own && !meets(true));
        }
    }

    /// Other robots with what they hold, and what is granted to them.
    fn block_robots(&mut self, world: WorldView, robot: usize, robots: Robots) {
        if robots == Robots::Ignore {
            return;
        }
        for (_, state) in world
            .robots()
            .iter()
            .enumerate()
            .filter(|(i, _)| *i != robot)
        {
            let class = self.scene.class_holding(index(state.holding));
            let mut from = vec(state.position);
            if state.grant().is_empty() {
                self.block_body(class, from, from);
            }
            for corner in state.grant() {
                self.block_body(class, from, vec(*corner));
                from = vec(*corner);
            }
        }
    }

    fn block_body(&mut self, class: ClassId, from: Vec2, to: Vec2) {
        let scene = self.scene;
        for part in &scene.body(class).parts {
            let (from, to) = (from + part.offset, to + part.offset);
            if from == to {
                self.occupancy.block(scene, &part.bare, from, true);
            } else {
                self.occupancy.block_swept(scene, &part.bare, from, to);
            }
            self.units += UNITS_PER_OBSTACLE;
        }
    }
}
