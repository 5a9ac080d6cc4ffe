//! Grips: closing around an object and opening again, each of which takes its time.
//!
//! Responsible for: when a grip may begin, how long it takes, when it ends. Not responsible for:
//! what its end means to the task (`tasks.rs`).
//!
//! A grip begins only where the robot stands; it gives up what is granted ahead of it. From the
//! first moment of closing the object counts as part of the robot, so that nobody is granted path
//! under it. Grips take whole ticks, rounded up; one of no duration takes place at once.

use scene::Scene;
use shm_types::{EventKind, Grip, TaskStatus};

use crate::bodies::Sweep;
use crate::broad::Aabb;
use crate::journal::{Event, Journal};
use crate::state::{Hand, Robot, is_at};
use crate::step::World;

impl World {
    /// Begins the grips that are asked for and possible.
    pub(crate) fn begin_grips(&mut self, scene: &Scene, journal: &mut Journal<'_>) {
        for i in 0..self.robots.len() {
            if !self.robots[i].link.is_fresh(self.tick) {
                continue;
            }
            match (self.robots[i].hand, self.robots[i].link.grip) {
                (Hand::Empty, Grip::Grasp) => match self.graspable(scene, i) {
                    Some(object) => self.begin_grasp(scene, i, object, journal),
                    None => self.counters.grips_refused += 1,
                },
                (Hand::Holding { object }, Grip::Release) => {
                    self.begin_release(scene, i, object, journal);
                }
                _ => {}
            }
        }
    }

    /// The object robot `i` may grasp where it stands: its claim under the current epoch, with
    /// nobody else in the place of what it will then carry.
    fn graspable(&self, scene: &Scene, i: usize) -> Option<usize> {
        let robot = &self.robots[i];
        let claim = robot.claim.filter(|c| c.epoch == self.epoch.number)?;
        let spec = &scene.objects[claim.task];
        let place = self.bodies.ground.place(claim.task)?;
        (is_at(robot.position, place + spec.grasp) && self.may_carry(scene, i, claim.task))
            .then_some(claim.task)
    }

    /// Whether robot `i` with `object` in its grip would stand clear of walls, other objects, and
    /// every other robot's body and granted path.
    fn may_carry(&self, scene: &Scene, i: usize, object: usize) -> bool {
        let robot = &self.robots[i];
        let stand = Sweep::standing(scene.objects[object].class, robot.position);
        let meets_object = |region: Aabb| {
            let met = self.bodies.ground.find_near(region, |other, at| {
                let shape = &scene.objects[other].shape;
                other != object
                    && scene
                        .body(stand.class)
                        .overlaps(stand.from, false, shape, at)
            });
            met.is_some()
        };
        let meets_robot = |j: usize, other: &Robot| {
            j != i && {
                let class = other.class(scene);
                let mut from = other.position;
                let here = Sweep::standing(class, from);
                let mut ahead = other.grant.points().iter();
                self.bodies.sweeps_meet(scene, stand, false, here)
                    || ahead.any(|&to| {
                        let piece = Sweep { class, from, to };
                        from = to;
                        self.bodies.sweeps_meet(scene, stand, false, piece)
                    })
            }
        };
        !self.bodies.meets_wall(scene, stand, false)
            && !meets_object(self.bodies.region(stand, false))
            && !self
                .robots
                .iter()
                .enumerate()
                .any(|(j, r)| meets_robot(j, r))
    }

    fn begin_grasp(&mut self, scene: &Scene, i: usize, object: usize, journal: &mut Journal<'_>) {
        self.bodies.ground.take(object);
        let ticks = self.ticks_of(scene.robot.grasp_ns);
        self.stand_for_grip(i, Hand::Closing { object, ticks });
        journal.event(Event::new(EventKind::GraspStarted).robot(i).task(object));
        if ticks == 0 {
            self.finish_grip(scene, i, journal);
        }
    }

    fn begin_release(&mut self, scene: &Scene, i: usize, object: usize, journal: &mut Journal<'_>) {
        let ticks = self.ticks_of(scene.robot.release_ns);
        self.stand_for_grip(i, Hand::Opening { object, ticks });
        journal.event(Event::new(EventKind::ReleaseStarted).robot(i).task(object));
        if ticks == 0 {
            self.finish_grip(scene, i, journal);
        }
    }

    fn stand_for_grip(&mut self, i: usize, hand: Hand) {
        let robot = &mut self.robots[i];
        robot.hand = hand;
        robot.gripped = true;
        robot.grant.clear();
        robot.drop_rest();
    }

    const fn ticks_of(&self, duration_ns: u64) -> u64 {
        duration_ns.div_ceil(self.settings.tick_ns)
    }

    /// Lets a tick pass for every grip that moves, and ends those whose time is up.
    pub(crate) fn advance_grips(&mut self, scene: &Scene, journal: &mut Journal<'_>) {
        for i in 0..self.robots.len() {
            let robot = &mut self.robots[i];
            let (Hand::Closing { ticks, .. } | Hand::Opening { ticks, .. }) = &mut robot.hand
            else {
                continue;
            };
            *ticks = ticks.saturating_sub(1);
            let over = *ticks == 0;
            robot.gripped = true;
            if over {
                self.finish_grip(scene, i, journal);
            }
        }
    }

    fn finish_grip(&mut self, scene: &Scene, i: usize, journal: &mut Journal<'_>) {
        match self.robots[i].hand {
            Hand::Closing { object, .. } => {
                self.robots[i].hand = Hand::Holding { object };
                let grasped = &mut self.objects[object];
                grasped.holder = Some(i);
                grasped.status = TaskStatus::Held;
                grasped.position = self.robots[i].position - scene.objects[object].grasp;
                journal.event(Event::new(EventKind::Grasped).robot(i).task(object));
                self.placed();
            }
            Hand::Opening { object, .. } => {
                self.robots[i].hand = Hand::Empty;
                self.put_down(i, object, journal);
            }
            Hand::Empty | Hand::Holding { .. } => {}
        }
    }

    /// Undoes a grip that robot `i` cannot finish: closing leaves the object on the ground,
    /// opening keeps it held.
    pub(crate) fn abort_grip(&mut self, i: usize) {
        let robot = &mut self.robots[i];
        match robot.hand {
            Hand::Closing { object, .. } => {
                robot.hand = Hand::Empty;
                self.bodies
                    .ground
                    .put(object, self.objects[object].position);
            }
            Hand::Opening { object, .. } => robot.hand = Hand::Holding { object },
            Hand::Empty | Hand::Holding { .. } => {}
        }
    }
}
