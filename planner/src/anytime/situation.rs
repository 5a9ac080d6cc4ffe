//! Where everything stands when planning begins: as the scene says, or as a run has come to.
//!
//! Responsible for: reading that out of a snapshot, and when a snapshot stands still enough to be
//! planned from.
//! Not responsible for: the plan (`solver`).

use scene::{Body, Scene, Shape, Vec2, vec};
use shm_types::{Activity, WorldSnapshot, index};

/// A robot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RobotAt {
    /// Its centre, m.
    pub(crate) at: Vec2,
    pub(crate) holds: Option<usize>,
    /// One that is not stays where it is, with what it holds.
    pub(crate) is_live: bool,
    /// Actions granted to it so far.
    pub(crate) actions: u32,
}

/// An object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectAt {
    /// Its centre, m.
    pub(crate) at: Vec2,
    /// How often it has been put down.
    pub(crate) put_downs: u32,
    /// Whether anybody can move it: not if a robot holds it that is gone.
    pub(crate) is_movable: bool,
}

/// Where everything stands.
#[derive(Clone, Debug, Default)]
pub(crate) struct Situation {
    pub(crate) robots: Vec<RobotAt>,
    pub(crate) objects: Vec<ObjectAt>,
    /// Whether it is as the scene says.
    pub(crate) is_start: bool,
    /// Whether robots are to keep a step more between them than where they are planned to be says.
    pub(crate) needs_margins: bool,
}

impl Situation {
    /// As the scene says.
    #[cfg(test)]
    pub(crate) fn at_start(scene: &Scene) -> Self {
        let robot = |&at: &Vec2| RobotAt {
            at,
            holds: None,
            is_live: true,
            actions: 0,
        };
        let object = |spec: &scene::ObjectSpec| ObjectAt {
            at: spec.start,
            put_downs: 0,
            is_movable: true,
        };
        Self {
            robots: scene.homes.iter().map(robot).collect(),
            objects: scene.objects.iter().map(object).collect(),
            is_start: true,
            needs_margins: false,
        }
    }

    /// As a snapshot says. It stands still ([`stands_still`]).
    pub(crate) fn of(snapshot: &WorldSnapshot) -> Self {
        let robots = &snapshot.robots[..snapshot.header.robot_count as usize];
        let objects = &snapshot.objects[..snapshot.header.object_count as usize];
        let robot = |state: &shm_types::RobotState| RobotAt {
            at: vec(state.position),
            holds: index(state.holding),
            is_live: state.live == 1,
            actions: state.actions,
        };
        let object = |state: &shm_types::ObjectState| ObjectAt {
            at: vec(state.position),
            put_downs: state.put_downs,
            is_movable: index(state.holder).is_none_or(|robot| robots[robot].live == 1),
        };
        Self {
            robots: robots.iter().map(robot).collect(),
            objects: objects.iter().map(object).collect(),
            is_start: (robots.iter()).all(|robot| robot.live == 1 && robot.actions == 0)
                && objects.iter().all(|object| object.put_downs == 0),
            needs_margins: false,
        }
    }

    /// Whether some robot stands beside the lattice, or would to take an object from where it is.
    pub(crate) fn is_beside(&self, scene: &Scene) -> bool {
        let live = self.robots.iter().filter(|robot| robot.is_live);
        let movable = scene.objects.iter().zip(&self.objects);
        let movable = movable.filter(|(_, state)| state.is_movable);
        let grasps = movable.flat_map(|(object, state)| {
            let grasps = object.grasps.iter();
            grasps.map(|grasp| state.at + grasp.offset)
        });
        let mut stops = live.map(|robot| robot.at).chain(grasps);
        stops.any(|at| scene.lattice.cell(at).is_none())
    }

    /// Whether some robot is gone.
    pub(crate) fn is_short(&self) -> bool {
        self.robots.iter().any(|robot| !robot.is_live)
    }

    /// What stands where robots are gone: shapes, and where.
    pub(crate) fn obstacles(&self, scene: &Scene) -> Vec<(Shape, Vec2)> {
        let gone = self.robots.iter().filter(|robot| !robot.is_live);
        gone.flat_map(|robot| self.bodies(scene, robot)).collect()
    }

    /// A robot and what it holds: shapes, and where.
    fn bodies<'a>(
        &self,
        scene: &'a Scene,
        robot: &RobotAt,
    ) -> impl Iterator<Item = (Shape, Vec2)> + use<'a> {
        let class = robot.holds.map_or(scene::ROBOT_ALONE, |object| {
            let offset = robot.at - self.objects[object].at;
            let by = scene.grasp_by(object, offset).unwrap_or(0);
            scene.objects[object].grasps[by].class
        });
        let body: &Body = scene.body(class);
        let at = robot.at;
        let parts = body.parts.iter();
        parts.map(move |part| (part.bare.clone(), at + part.offset))
    }

    /// Whether a robot that holds nothing would meet another one on its way to `to`, if the others
    /// stay where they are.
    pub(crate) fn meets_robot(&self, scene: &Scene, robot: usize, to: Vec2) -> bool {
        let from = self.robots[robot].at;
        let body = scene.body(scene::ROBOT_ALONE);
        let others = self.robots.iter().enumerate();
        let others = others.filter(|(other, state)| *other != robot && state.is_live);
        others
            .flat_map(|(_, other)| self.bodies(scene, other))
            .any(|(shape, at)| body.sweeps(from, to, true, &shape, at, at))
    }
}

/// Whether every robot that takes part stands, with nothing granted ahead and its grip at rest.
pub(crate) fn stands_still(snapshot: &WorldSnapshot) -> bool {
    let robots = &snapshot.robots[..snapshot.header.robot_count as usize];
    let busy = [Activity::Moving.code(), Activity::Gripping.code()];
    robots
        .iter()
        .all(|robot| robot.live == 0 || robot.grant_count == 0 && !busy.contains(&robot.activity))
}
