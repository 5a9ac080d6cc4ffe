//! Invariants: checked every tick, whatever the grants promised.
//!
//! Responsible for: no two bodies overlap, swept over the tick; each object is held by at most
//! one robot, and both sides agree; objects are neither lost nor doubled; robots move only on
//! grants and no faster than they can; what stays granted is disjoint. Epochs and ticks only ever
//! count up, by construction. Not responsible for: what a broken one means (`step.rs` ends the
//! run). A second, independent check is the trace checker's.

use scene::{Scene, Vec2};
use shm_types::{EventKind, TaskStatus};

use crate::bodies::Sweep;
use crate::broad::Aabb;
use crate::journal::Event;
use crate::path::ARRIVAL_M;
use crate::state::{Object, Robot, id, is_at};
use crate::step::World;

/// An invariant found broken. The numbers travel in the `Violated` event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Violation {
    /// Two robots, or what they carry, overlapped.
    Robots {
        /// The one.
        robot: u32,
        /// The other.
        other: u32,
    },
    /// A robot, or what it carries, overlapped a grounded object.
    Object {
        /// The robot.
        robot: u32,
        /// The object.
        object: u32,
    },
    /// A robot, or what it carries, overlapped a wall.
    Wall {
        /// The robot.
        robot: u32,
    },
    /// A robot and an object disagree on who holds what, or where.
    Holding {
        /// The robot.
        robot: u32,
        /// The object.
        object: u32,
    },
    /// An object is neither held nor on the ground where it rests, or both.
    Lost {
        /// The object.
        object: u32,
    },
    /// A robot moved off its grant, or too fast.
    Motion {
        /// The robot.
        robot: u32,
    },
    /// Path granted to two robots overlaps.
    Grants {
        /// The one.
        robot: u32,
        /// The other.
        other: u32,
    },
}

impl Violation {
    /// Its number in the `Violated` event.
    #[must_use]
    pub const fn code(self) -> u64 {
        match self {
            Self::Robots { .. } => 1,
            Self::Object { .. } => 2,
            Self::Wall { .. } => 3,
            Self::Holding { .. } => 4,
            Self::Lost { .. } => 5,
            Self::Motion { .. } => 6,
            Self::Grants { .. } => 7,
        }
    }

    /// The event that tells of it.
    pub(crate) const fn event(self) -> Event {
        let mut event = Event::new(EventKind::Violated).value(self.code());
        match self {
            Self::Robots { robot, other } | Self::Grants { robot, other } => {
                event.robot = robot;
                event.other = other;
            }
            Self::Object { robot, object } | Self::Holding { robot, object } => {
                event.robot = robot;
                event.task = object;
            }
            Self::Wall { robot } | Self::Motion { robot } => event.robot = robot,
            Self::Lost { object } => event.task = object,
        }
        event
    }
}

impl World {
    /// The first invariant broken in the tick that has just been moved, if any.
    pub(crate) fn find_violation(&mut self, scene: &Scene) -> Option<Violation> {
        for (i, robot) in self.robots.iter().enumerate() {
            let class = robot.class(scene);
            let mut region = self
                .bodies
                .region(Sweep::standing(class, robot.track.end()), false);
            for &(_, at) in robot.track.corners() {
                region = region.joined(self.bodies.region(Sweep::standing(class, at), false));
            }
            self.regions[i] = region;
        }
        (0..self.robots.len())
            .find_map(|i| {
                self.check_motion(i)
                    .or_else(|| self.check_hand(scene, i))
                    .or_else(|| self.check_surroundings(scene, i))
                    .or_else(|| self.check_others(scene, i))
            })
            .or_else(|| self.check_objects())
    }

    fn check_motion(&self, i: usize) -> Option<Violation> {
        let robot = &self.robots[i];
        let moved_m = robot.track.moved_m();
        let length_m = robot.grant.length_from(robot.position);
        let used_m = robot.granted_m - length_m;
        let on_grant = !robot.moved || (used_m - moved_m).abs() <= 8.0 * ARRIVAL_M;
        let on_track = robot.position == robot.track.end();
        let in_time = moved_m <= self.tick_m + ARRIVAL_M;
        (!on_grant || !on_track || !in_time).then_some(Violation::Motion { robot: id(i) })
    }

    fn check_hand(&self, scene: &Scene, i: usize) -> Option<Violation> {
        let robot = &self.robots[i];
        let object = robot.hand.holding()?;
        let held = &self.objects[object];
        let place = robot.place_of(scene, object);
        let agreed = held.holder == Some(i)
            && held.position == place
            && held.status == TaskStatus::Held
            && self.bodies.ground.place(object).is_none();
        (!agreed).then_some(Violation::Holding {
            robot: id(i),
            object: id(object),
        })
    }

    fn check_surroundings(&self, scene: &Scene, i: usize) -> Option<Violation> {
        let robot = &self.robots[i];
        let class = robot.class(scene);
        let mut at = robot.track.corners()[0].1;
        for &(_, to) in robot.track.corners() {
            let sweep = Sweep {
                class,
                from: at,
                to,
            };
            at = to;
            if self.bodies.meets_wall(scene, sweep, false) {
                return Some(Violation::Wall { robot: id(i) });
            }
            let waiver = |object| self.bodies.waiver(scene, robot, object);
            if let Some(object) = self.bodies.object_met(scene, sweep, false, waiver) {
                return Some(Violation::Object {
                    robot: id(i),
                    object: id(object),
                });
            }
        }
        None
    }

    /// Robot `i` against those after it: bodies during the tick, granted path after it.
    fn check_others(&self, scene: &Scene, i: usize) -> Option<Violation> {
        let robot = &self.robots[i];
        let class = robot.class(scene);
        for j in i + 1..self.robots.len() {
            let other = &self.robots[j];
            let other_class = other.class(scene);
            let near = self.regions[i].meets(&self.regions[j]);
            let span = (0.0, self.tick_m);
            if near
                && self.bodies.tracks_meet(
                    scene,
                    (class, &robot.track),
                    false,
                    (other_class, &other.track),
                    span,
                )
            {
                return Some(Violation::Robots {
                    robot: id(i),
                    other: id(j),
                });
            }
            if self.grants_meet(scene, robot, other) {
                return Some(Violation::Grants {
                    robot: id(i),
                    other: id(j),
                });
            }
        }
        None
    }

    fn grants_meet(&self, scene: &Scene, robot: &Robot, other: &Robot) -> bool {
        if robot.grant.is_empty() && other.grant.is_empty() {
            return false;
        }
        let region = |r: &Robot| {
            let class = r.class(scene);
            let here = self
                .bodies
                .region(Sweep::standing(class, r.position), false);
            r.grant.points().iter().fold(here, |all: Aabb, &at| {
                all.joined(self.bodies.region(Sweep::standing(class, at), false))
            })
        };
        region(robot).meets(&region(other))
            && pieces(scene, robot).any(|piece| {
                pieces(scene, other)
                    .any(|other| self.bodies.sweeps_meet(scene, piece, false, other))
            })
    }

    fn check_objects(&self) -> Option<Violation> {
        let sound = |(index, object): (usize, &Object)| {
            let place = self.bodies.ground.place(index);
            let gripped = object
                .holder
                .or(object.claimed_by)
                .is_some_and(|i| self.robots[i].hand.object() == Some(index));
            match (object.holder, place) {
                (None, Some(at)) => at == object.position && at == object.rest && !gripped,
                (None, None) => gripped && is_at(object.position, object.rest),
                (Some(i), None) => self.robots[i].hand.holding() == Some(index),
                (Some(_), Some(_)) => false,
            }
        };
        let lost = self.objects.iter().enumerate().find(|o| !sound(*o));
        lost.map(|(index, _)| Violation::Lost { object: id(index) })
    }
}

/// The straight pieces of a robot's remaining grant; standing there if it has none.
fn pieces<'a>(scene: &'a Scene, robot: &'a Robot) -> impl Iterator<Item = Sweep> + 'a {
    let class = robot.class(scene);
    let ends = robot.grant.points();
    let starts = std::iter::once(robot.position).chain(ends.iter().copied());
    let stand: Option<Vec2> = ends.is_empty().then_some(robot.position);
    starts
        .zip(ends.iter().copied().chain(stand))
        .map(move |(from, to)| Sweep { class, from, to })
}

#[cfg(test)]
mod tests {
    use scene::Vec2;
    use shm_types::{EventKind, Outcome};

    use super::*;
    use crate::path::Path;
    use crate::state::Hand;
    use crate::testing::{BELOW, Bench, room};
    use crate::track::Track;

    const OBJECTS: [[[f64; 2]; 2]; 2] = [[[1.0, 1.45], [1.0, 5.0]], [[5.0, 3.0], [5.0, 5.0]]];

    /// Robot 0 holds object 0; robot 1 is on its way.
    fn bench() -> Bench {
        let mut bench = Bench::new(room(&[[1.0, 1.0], [3.0, 1.0]], &OBJECTS, BELOW, ""));
        bench.claim(0, 0);
        bench.step();
        bench.grasp(0);
        bench.ask(1, &[[8.0, 1.0]]);
        bench.steps(3);
        bench
    }

    fn found(bench: &mut Bench) -> Option<Violation> {
        bench.world.find_violation(&bench.scene)
    }

    fn put(bench: &mut Bench, robot: usize, x: f64, y: f64) {
        let robot = &mut bench.world.robots[robot];
        robot.position = Vec2::new(x, y);
        robot.track = Track::still(robot.position);
        robot.moved = false;
        robot.grant.clear();
    }

    #[test]
    fn a_sound_world_has_none() {
        assert_eq!(found(&mut bench()), None);
    }

    #[test]
    fn two_robots_in_one_place_are_found() {
        let mut bench = bench();
        put(&mut bench, 1, 1.499, 1.0);
        let violation = Violation::Robots { robot: 0, other: 1 };
        assert_eq!(found(&mut bench), Some(violation));
        put(&mut bench, 1, 1.449, 1.45);
        assert_eq!(found(&mut bench), Some(violation), "by what it holds");
        put(&mut bench, 1, 1.5, 1.0);
        assert_eq!(found(&mut bench), None, "touching");
    }

    #[test]
    fn robots_that_pass_through_each_other_within_the_tick_are_found() {
        let mut bench = bench();
        put(&mut bench, 1, 3.0, 1.0);
        let mut path = Path::EMPTY;
        path.push(Vec2::new(0.4, 1.0));
        bench.world.robots[1].track = Track::walk(Vec2::new(3.0, 1.0), &path, 9.0);
        bench.world.tick_m = 9.0;
        bench.world.robots[1].position = Vec2::new(0.4, 1.0);
        bench.world.robots[1].moved = true;
        bench.world.robots[1].granted_m = 2.6;
        let violation = Violation::Robots { robot: 0, other: 1 };
        assert_eq!(found(&mut bench), Some(violation));
    }

    #[test]
    fn a_robot_in_an_object_or_a_wall_is_found() {
        let mut bench = bench();
        put(&mut bench, 1, 5.0, 2.6);
        let violation = Violation::Object {
            robot: 1,
            object: 1,
        };
        assert_eq!(found(&mut bench), Some(violation));
        put(&mut bench, 1, 5.0, 0.2);
        assert_eq!(found(&mut bench), Some(Violation::Wall { robot: 1 }));
    }

    #[test]
    fn disagreement_on_what_is_held_is_found() {
        let holding = Violation::Holding {
            robot: 0,
            object: 0,
        };
        let mut bench = bench();
        bench.world.objects[0].holder = Some(1);
        assert_eq!(found(&mut bench), Some(holding));
        bench.world.objects[0].holder = Some(0);
        bench.world.objects[0].position.x += 1e-9;
        assert_eq!(found(&mut bench), Some(holding));
    }

    #[test]
    fn a_lost_or_doubled_object_is_found() {
        let mut bench = bench();
        bench.world.bodies.ground.take(1);
        assert_eq!(found(&mut bench), Some(Violation::Lost { object: 1 }));
        bench.world.bodies.ground.put(1, Vec2::new(5.0, 3.0));
        assert_eq!(found(&mut bench), None);
        bench.world.objects[1].position.x += 1e-3;
        assert_eq!(found(&mut bench), Some(Violation::Lost { object: 1 }));
        bench.world.objects[1].position.x = 5.0;
        bench.world.robots[0].hand = Hand::Empty;
        assert_eq!(found(&mut bench), Some(Violation::Lost { object: 0 }));
    }

    #[test]
    fn motion_off_the_grant_or_too_fast_is_found() {
        let mut bench = bench();
        bench.world.robots[1].granted_m += 1e-3;
        assert_eq!(found(&mut bench), Some(Violation::Motion { robot: 1 }));
        bench.world.robots[1].granted_m -= 1e-3;
        assert_eq!(found(&mut bench), None);
        bench.world.tick_m = 0.004;
        assert_eq!(found(&mut bench), Some(Violation::Motion { robot: 1 }));
    }

    #[test]
    fn grants_that_overlap_are_found() {
        let mut bench = bench();
        bench.world.robots[0].grant.push(Vec2::new(6.0, 1.0));
        let violation = Violation::Grants { robot: 0, other: 1 };
        assert_eq!(found(&mut bench), Some(violation));
    }

    #[test]
    fn one_that_is_broken_ends_the_run() {
        let mut bench = bench();
        bench.world.objects[1].position.x += 1e-3;
        bench.step_unsound();
        assert_eq!(bench.header().outcome, Outcome::Violated.code());
        assert_eq!(bench.world.counters().violations, 1);
        let event = bench.events(EventKind::Violated)[0];
        assert_eq!((event.task, event.value), (1, 5));
        let at = bench.at(1);
        bench.step_unsound();
        assert_eq!(bench.at(1), at, "all motion is held");
    }
}
