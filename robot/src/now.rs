//! What a robot knows of the present tick.
//!
//! Responsible for: reading the robot's own state off the snapshot.
//! Not responsible for: deciding anything.

use planner::obstacles;
use scene::{CONTACT_M, Scene, Vec2, vec};
use shm_types::{
    Activity, Checked, ConstraintTable, HardAnswer, RobotState, Schedule, WorldSnapshot, index,
};

use crate::look::Counted;

/// The present tick, seen by one robot.
#[derive(Clone, Copy)]
pub(crate) struct Now<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) snapshot: Checked<'a, WorldSnapshot>,
    /// The hard constraints at hand.
    pub(crate) table: Checked<'a, ConstraintTable>,
    /// The schedule in force, if it is at hand.
    pub(crate) schedule: Option<&'a Schedule>,
    /// The planner's newest answer to this robot.
    pub(crate) answer: Option<HardAnswer>,
    /// This robot's id.
    pub(crate) id: usize,
    /// Which process of this robot it is.
    pub(crate) incarnation: u32,
}

impl<'a> Now<'a> {
    /// The robot's own state.
    pub(crate) fn me(&self) -> &'a RobotState {
        &self.snapshot.get().robots[self.id]
    }

    /// Virtual time, ns.
    pub(crate) fn time_ns(&self) -> u64 {
        self.snapshot.header.time_ns
    }

    /// The epoch of selection.
    pub(crate) fn epoch(&self) -> u64 {
        self.snapshot.header.epoch
    }

    /// What tells whether there is anything new to see.
    pub(crate) fn counted(&self) -> Counted {
        Counted {
            change: self.snapshot.header.change,
            placements: self.snapshot.header.placements,
        }
    }

    /// What the robot holds.
    pub(crate) fn holding(&self) -> Option<usize> {
        index(self.me().holding)
    }

    /// Centre of the robot, world frame.
    pub(crate) fn position(&self) -> Vec2 {
        vec(self.me().position)
    }

    /// Whether the robot stands exactly here, with nothing granted.
    pub(crate) fn stands_at(&self, place: Vec2) -> bool {
        self.me().grant_count == 0 && same_place(self.position(), place)
    }

    /// Whether its position changed in the last tick.
    pub(crate) fn has_moved(&self) -> bool {
        self.me().activity == Activity::Moving.code()
    }

    /// Whether its grip was closing or opening in the last tick.
    pub(crate) fn is_gripping(&self) -> bool {
        self.me().activity == Activity::Gripping.code()
    }

    /// Whether the world has taken the command of this number, or a later one.
    pub(crate) fn has_acknowledged(&self, sequence: u64) -> bool {
        self.me().incarnation == self.incarnation && self.me().acknowledged >= sequence
    }

    /// Where the robot will be when it has moved along all that is granted: where a look starts.
    pub(crate) fn grant_end(&self) -> Vec2 {
        obstacles::plan_from(self.snapshot, self.id)
    }

    /// Metres still granted.
    pub(crate) fn granted_m(&self) -> f64 {
        let mut from = self.position();
        let mut length_m = 0.0;
        for to in self.me().grant() {
            length_m += (vec(*to) - from).norm();
            from = vec(*to);
        }
        length_m
    }

    /// Where the robot grasps `object` as it stands now.
    pub(crate) fn grasp_of(&self, object: usize) -> Vec2 {
        self.scene
            .grasp_at(object, vec(self.snapshot.objects()[object].position))
    }

    /// Where the robot puts `object` down: at its goal, or, if it has none, where it is.
    pub(crate) fn goal_of(&self, object: usize) -> Vec2 {
        obstacles::grasp_at_goal(self.scene, self.snapshot, object)
            .unwrap_or_else(|| self.grasp_of(object))
    }

    /// Where the robot goes when it has nothing to do (rule 6).
    pub(crate) fn home(&self) -> Vec2 {
        self.scene.homes[self.id]
    }
}

/// Whether two places are one.
pub(crate) fn same_place(a: Vec2, b: Vec2) -> bool {
    (a - b).norm() <= CONTACT_M
}
