//! Invariants: checked every tick, whatever the grants promised.
//!
//! Responsible for: no two bodies overlap, swept over the tick; each object is held by at most
//! one robot, and both sides agree; objects are neither lost nor doubled; robots move only on
//! grants and no faster than they can; what stays granted is disjoint; how often each was checked.
//! Epochs and ticks only ever count up, by construction. Not responsible for: what a broken one
//! means (`step.rs` ends the run), what need not be looked at again (`cleared.rs`). A second,
//! independent check is the trace checker's.
//!
//! Two robots of which neither has left the ways that were found disjoint cannot have met, so only
//! what has changed is held against everything around it.

use scene::{Scene, Vec2};
use shm_types::{EventKind, TaskStatus};

use crate::bodies::Sweep;
use crate::cleared::{Change, Cleared, is_between, is_same};
use crate::journal::Event;
use crate::path::ARRIVAL_M;
use crate::state::{Robot, id, is_at};
use crate::step::World;

/// What is checked, by what would be found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Invariant {
    /// [`Violation::Robots`], for each pair of robots.
    Robots,
    /// [`Violation::Object`], for each robot.
    Object,
    /// [`Violation::Wall`], for each robot.
    Wall,
    /// [`Violation::Holding`], for each robot that holds something.
    Holding,
    /// [`Violation::Lost`], for each object.
    Lost,
    /// [`Violation::Motion`], for each robot.
    Motion,
    /// [`Violation::Grants`], for each pair of robots.
    Grants,
}

impl Invariant {
    /// Every one, in the order of [`Violation::code`].
    pub const ALL: [Self; 7] = [
        Self::Robots,
        Self::Object,
        Self::Wall,
        Self::Holding,
        Self::Lost,
        Self::Motion,
        Self::Grants,
    ];

    /// Its name in results.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Robots => "robots",
            Self::Object => "object",
            Self::Wall => "wall",
            Self::Holding => "holding",
            Self::Lost => "lost",
            Self::Motion => "motion",
            Self::Grants => "grants",
        }
    }
}

/// How often each invariant was checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Checks {
    pub(crate) made: [u64; Invariant::ALL.len()],
    pub(crate) anew: [u64; Invariant::ALL.len()],
    /// Exact swept tests that took.
    pub swept_tests: u64,
}

impl Checks {
    /// For how many bodies, pairs or objects, summed over the ticks, `invariant` was found to hold
    /// or not.
    #[must_use]
    pub const fn made(&self, invariant: Invariant) -> u64 {
        self.made[invariant as usize]
    }

    /// For how many of these something that it depends on had changed, so that it was looked at
    /// anew; for the others it was seen that nothing had.
    #[must_use]
    pub const fn anew(&self, invariant: Invariant) -> u64 {
        self.anew[invariant as usize]
    }

    const fn add(&mut self, invariant: Invariant, made: u64, anew: u64) {
        self.made[invariant as usize] += made;
        self.anew[invariant as usize] += anew;
    }
}

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
    /// What it is a violation of.
    #[must_use]
    pub const fn invariant(self) -> Invariant {
        match self {
            Self::Robots { .. } => Invariant::Robots,
            Self::Object { .. } => Invariant::Object,
            Self::Wall { .. } => Invariant::Wall,
            Self::Holding { .. } => Invariant::Holding,
            Self::Lost { .. } => Invariant::Lost,
            Self::Motion { .. } => Invariant::Motion,
            Self::Grants { .. } => Invariant::Grants,
        }
    }

    /// Its number in the `Violated` event, from 1.
    #[must_use]
    pub const fn code(self) -> u64 {
        self.invariant() as u64 + 1
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
    /// The first invariant broken in the tick that has just been moved, if any: what every robot
    /// shows by itself comes before what has changed between them.
    pub(crate) fn find_violation(&mut self, scene: &Scene) -> Option<Violation> {
        let before = self.bodies.tests();
        let mut cleared = std::mem::take(&mut self.cleared);
        let mut found = None;
        let (mut changed, mut holding) = (0, 0);
        for (i, (robot, cleared)) in self.robots.iter().zip(&mut cleared).enumerate() {
            let known = cleared.compare(scene, &self.bodies, robot);
            if !known {
                self.objects.touched().check_all();
            }
            let has_changed = cleared.change().is_some();
            changed += u64::from(has_changed);
            holding += u64::from(robot.hand.holding().is_some());
            if found.is_none() {
                found = self.check_motion(i, !has_changed);
                found = found.or_else(|| self.check_hand(scene, i));
                if found.is_none()
                    && let Some(object) = robot.hand.holding()
                {
                    self.objects.touched().pass(object);
                }
            }
        }
        self.count_checks(changed, holding);
        if changed > 0 && found.is_none() {
            let mut all = 0..self.robots.len();
            found = all.find_map(|i| self.check_changed(scene, i, &mut cleared));
        }
        found = found.or_else(|| self.check_objects());
        self.cleared = cleared;
        self.counters.checks.swept_tests += self.bodies.tests() - before;
        found
    }

    /// What has changed of robot `i` against everything around.
    fn check_changed(&self, scene: &Scene, i: usize, cleared: &mut [Cleared]) -> Option<Violation> {
        let change = cleared[i].change()?;
        let start = self.straight_from(i, change);
        let clear = self.clear_ahead(scene, i, start, change);
        let seen = clear > 0 && start != self.robots[i].position;
        let found = self
            .check_surroundings(scene, i, change, usize::from(seen))
            .or_else(|| self.check_others(scene, i, change, cleared));
        if found.is_none() {
            cleared[i].accept(&self.bodies, &self.robots[i], clear);
        }
        found
    }

    /// Notes what was looked at: `changed` robots with each other and with all others.
    fn count_checks(&mut self, changed: u64, holding: u64) {
        let (robots, objects) = (self.robots.len() as u64, self.objects.len() as u64);
        let changed_pairs = changed * (2 * robots - changed).saturating_sub(1) / 2;
        let pairs = robots * robots.saturating_sub(1) / 2;
        let checks = &mut self.counters.checks;
        checks.add(Invariant::Robots, pairs, changed_pairs);
        checks.add(Invariant::Object, robots, changed);
        checks.add(Invariant::Wall, robots, changed);
        checks.add(Invariant::Holding, holding, holding);
        checks.add(Invariant::Lost, objects, 0);
        checks.add(Invariant::Motion, robots, robots);
        checks.add(Invariant::Grants, pairs, changed_pairs);
    }

    /// A robot that `followed` its way has gone along it to where what is left of it begins, and
    /// has no other path granted: there is nothing to measure.
    fn check_motion(&self, i: usize, followed: bool) -> Option<Violation> {
        let robot = &self.robots[i];
        let moved_m = robot.track.moved_m();
        let used_m = || robot.granted_m - robot.grant.length_from(robot.position);
        let on_grant = !robot.moved || followed || (used_m() - moved_m).abs() <= 8.0 * ARRIVAL_M;
        let on_track = is_same(robot.position, robot.track.end());
        let in_time = moved_m <= self.tick_m + ARRIVAL_M;
        (!on_grant || !on_track || !in_time).then_some(Violation::Motion { robot: id(i) })
    }

    fn check_hand(&self, scene: &Scene, i: usize) -> Option<Violation> {
        let robot = &self.robots[i];
        let object = robot.hand.holding()?;
        let held = &self.objects[object];
        let place = robot.place_of(scene, object);
        let agreed = held.holder == Some(i)
            && is_same(held.position, place)
            && held.status == TaskStatus::Held
            && self.bodies.ground.place(object).is_none();
        (!agreed).then_some(Violation::Holding {
            robot: id(i),
            object: id(object),
        })
    }

    /// Where robot `i` was during the tick, unless that was found clear before: all of it, but for
    /// the last `seen` straight pieces.
    fn check_surroundings(
        &self,
        scene: &Scene,
        i: usize,
        change: Change,
        seen: usize,
    ) -> Option<Violation> {
        if !change.strayed {
            return None;
        }
        let robot = &self.robots[i];
        let class = robot.class(scene);
        let corners = robot.track.corners();
        if corners.len() == 1 {
            return self.obstacle(scene, i, Sweep::standing(class, robot.track.end()));
        }
        let mut pieces = robot.track.pieces().take(corners.len() - 1 - seen);
        pieces.find_map(|((_, from), (_, to))| self.obstacle(scene, i, Sweep { class, from, to }))
    }

    /// Where what is new of robot `i`'s way begins: where its last straight motion did, if it
    /// goes straight on, so that both are looked at in one.
    fn straight_from(&self, i: usize, change: Change) -> Vec2 {
        let robot = &self.robots[i];
        let ahead = robot.grant.first().filter(|_| change.strayed);
        let last = ahead.zip(robot.track.pieces().last());
        last.filter(|&(ahead, ((_, from), _))| is_between(from, ahead, robot.position))
            .map_or(change.start, |(_, ((_, from), _))| from)
    }

    /// What robot `i` would overlap on a sweep: a wall or a grounded object.
    fn obstacle(&self, scene: &Scene, i: usize, sweep: Sweep) -> Option<Violation> {
        if self.bodies.meets_wall(scene, sweep, false) {
            return Some(Violation::Wall { robot: id(i) });
        }
        let robot = &self.robots[i];
        let waiver = |object| self.bodies.waiver(scene, robot, object);
        let met = self.bodies.object_met(scene, sweep, false, waiver);
        met.map(|object| Violation::Object {
            robot: id(i),
            object: id(object),
        })
    }

    /// How many points of robot `i`'s grant it can go on to without overlapping anything that
    /// stands, the new ones from `start`: from there on its motion is looked at tick by tick.
    fn clear_ahead(&self, scene: &Scene, i: usize, start: Vec2, change: Change) -> usize {
        let robot = &self.robots[i];
        let ahead = robot.grant.points().len() - change.new_from;
        let pieces = pieces_from(scene, robot, start, change.new_from).take(ahead);
        let clear = pieces.take_while(|piece| self.obstacle(scene, i, *piece).is_none());
        change.new_from + clear.count()
    }

    /// What has changed of robot `i` against every other: bodies during the tick, granted path
    /// after it.
    fn check_others(
        &self,
        scene: &Scene,
        i: usize,
        change: Change,
        cleared: &[Cleared],
    ) -> Option<Violation> {
        let robot = &self.robots[i];
        let class = robot.class(scene);
        let region = if change.strayed {
            cleared[i].region()
        } else {
            let points = robot.grant.points()[change.new_from..].iter();
            (self.bodies).region_along(class, change.start, points.copied())
        };
        for (j, other) in self.robots.iter().enumerate() {
            if j == i || !region.meets(&cleared[j].region()) {
                continue;
            }
            let (first, second) = (id(i.min(j)), id(i.max(j)));
            let tracks_meet = || {
                let other = (other.class(scene), &other.track);
                let (track, span) = ((class, &robot.track), (0.0, self.tick_m));
                self.bodies.tracks_meet(scene, track, false, other, span)
            };
            if change.strayed && tracks_meet() {
                return Some(Violation::Robots {
                    robot: first,
                    other: second,
                });
            }
            if self.grants_meet(scene, robot, change, other) {
                return Some(Violation::Grants {
                    robot: first,
                    other: second,
                });
            }
        }
        None
    }

    /// Whether what is new of `robot`'s grant meets what is granted to `other`.
    fn grants_meet(&self, scene: &Scene, robot: &Robot, change: Change, other: &Robot) -> bool {
        if robot.grant.is_empty() && other.grant.is_empty() {
            return false;
        }
        let (at, path) = ((other.class(scene), other.position), other.grant.points());
        pieces_from(scene, robot, change.start, change.new_from)
            .any(|piece| self.bodies.meets_path(scene, piece, false, at, path))
    }

    /// The objects of which something could have changed: they are noted wherever they can be, and
    /// all are looked at when a hand is not what it was.
    fn check_objects(&mut self) -> Option<Violation> {
        for word in 0..self.objects.len().div_ceil(64) {
            let mut unchecked = self.objects.touched().take_unchecked(word);
            unchecked |= self.bodies.ground.touched().take_unchecked(word);
            while unchecked != 0 {
                let index = 64 * word + unchecked.trailing_zeros() as usize;
                unchecked &= unchecked - 1;
                if index >= self.objects.len() {
                    break;
                }
                self.counters.checks.add(Invariant::Lost, 0, 1);
                if !self.is_sound(index) {
                    self.objects.touched().check_all();
                    return Some(Violation::Lost { object: id(index) });
                }
            }
        }
        None
    }

    /// Whether an object is in one place only, and whoever has it knows.
    fn is_sound(&self, index: usize) -> bool {
        let object = &self.objects[index];
        let hand = |robot: usize| self.robots[robot].hand;
        let gripped =
            (object.holder.or(object.claimed_by)).is_some_and(|i| hand(i).object() == Some(index));
        match (object.holder, self.bodies.ground.place(index)) {
            (None, Some(at)) => {
                is_same(at, object.position) && is_same(at, object.rest) && !gripped
            }
            (None, None) => gripped && is_at(object.position, object.rest),
            (Some(i), None) => hand(i).holding() == Some(index),
            (Some(_), Some(_)) => false,
        }
    }
}

/// The straight pieces of a robot's grant from `start` on, but the first `passed`; standing there
/// if that are all.
fn pieces_from<'a>(
    scene: &'a Scene,
    robot: &'a Robot,
    start: Vec2,
    passed: usize,
) -> impl Iterator<Item = Sweep> + 'a {
    let class = robot.class(scene);
    let ends = &robot.grant.points()[passed..];
    let starts = std::iter::once(start).chain(ends.iter().copied());
    let stand: Option<Vec2> = ends.is_empty().then_some(start);
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
        for hand in [
            Hand::Empty,
            Hand::Closing {
                object: 0,
                ticks: 1,
            },
        ] {
            bench.world.robots[0].hand = hand;
            assert_eq!(found(&mut bench), Some(Violation::Lost { object: 0 }));
            bench.world.robots[0].hand = Hand::Holding { object: 0 };
            assert_eq!(found(&mut bench), None);
        }
    }

    #[test]
    fn motion_off_the_grant_or_too_fast_is_found() {
        let mut bench = bench();
        bench.world.cleared[1] = Cleared::nothing();
        bench.world.robots[1].granted_m += 1e-3;
        assert_eq!(found(&mut bench), Some(Violation::Motion { robot: 1 }));
        bench.world.robots[1].granted_m -= 1e-3;
        assert_eq!(found(&mut bench), None);
        bench.step();
        let at = bench.world.robots[1].position;
        let mut path = Path::EMPTY;
        path.push(at + Vec2::new(0.003, 0.001));
        bench.world.robots[1].track = Track::walk(at, &path, 9.0);
        bench.world.robots[1].position = bench.world.robots[1].track.end();
        bench.world.robots[1].granted_m = bench.world.robots[1].grant.length_from(at);
        let motion = Violation::Motion { robot: 1 };
        assert_eq!(found(&mut bench), Some(motion), "beside its way");
        bench.world.robots[1].position = at;
        bench.world.robots[1].track = Track::still(at);
        bench.world.robots[1].moved = false;
        assert_eq!(found(&mut bench), None);
        bench.world.robots[1].moved = true;
        bench.world.robots[1].track = Track::walk(at, &bench.world.robots[1].grant, 0.005);
        bench.world.robots[1].position = bench.world.robots[1].track.end();
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
    fn a_grant_that_goes_on_into_another_is_found() {
        let mut bench = bench();
        let at = bench.world.robots[0].position;
        bench.world.robots[0].grant.push(Vec2::new(at.x, 4.0));
        bench.world.robots[0].grant.push(Vec2::new(8.0, 4.0));
        assert_eq!(found(&mut bench), None);
        bench.world.robots[0].grant.push(Vec2::new(8.0, 2.0));
        assert_eq!(found(&mut bench), None);
        for (y, meets) in [(1.55, false), (1.45, true), (1.55, false), (0.9, true)] {
            bench.world.robots[0].grant.replace_last(Vec2::new(8.0, y));
            let violation = Violation::Grants { robot: 0, other: 1 };
            assert_eq!(found(&mut bench), meets.then_some(violation), "{y}");
        }
    }

    #[test]
    fn path_that_was_given_back_and_taken_again_is_looked_at_again() {
        let mut bench = bench();
        let ahead = bench.world.robots[1].grant;
        let at = bench.world.robots[1].position;
        put(&mut bench, 1, at.x, at.y);
        bench.world.robots[1].grant = ahead;
        assert_eq!(found(&mut bench), None);
        bench.world.robots[1].grant.clear();
        assert_eq!(found(&mut bench), None);
        // Robot 0 is granted a place on it meanwhile, and has it to itself.
        let at = bench.world.robots[0].position;
        bench.world.robots[0].grant.push(Vec2::new(at.x, 3.0));
        bench.world.robots[0].grant.push(Vec2::new(6.0, 3.0));
        bench.world.robots[0].grant.push(Vec2::new(6.0, 1.0));
        assert_eq!(found(&mut bench), None);
        bench.world.robots[1].grant = ahead;
        let violation = Violation::Grants { robot: 0, other: 1 };
        assert_eq!(found(&mut bench), Some(violation));
    }

    #[test]
    fn what_has_not_changed_is_not_looked_at_again() {
        let mut bench = bench();
        bench.steps(3);
        let anew = |bench: &Bench| bench.world.counters().checks.anew(Invariant::Robots);
        let (made, before) = (bench.world.counters().checks, anew(&bench));
        bench.steps(10);
        let checks = bench.world.counters().checks;
        assert_eq!(anew(&bench), before, "one holds, one goes straight on");
        for (invariant, count) in [
            (Invariant::Robots, 10),
            (Invariant::Wall, 20),
            (Invariant::Motion, 20),
            (Invariant::Holding, 10),
            (Invariant::Lost, 20),
        ] {
            let more = checks.made(invariant) - made.made(invariant);
            assert_eq!(more, count, "{invariant:?}");
        }
        bench.ask(0, &[[1.0, 2.0]]);
        bench.step();
        assert_eq!(anew(&bench), before + 1);
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

    #[test]
    fn each_look_at_two_bodies_is_counted() {
        let mut bench = bench();
        let tests = |bench: &Bench| bench.world.counters().checks.swept_tests;
        let before = tests(&bench);
        // The two robots touch: whether they overlap has to be looked at.
        put(&mut bench, 1, 1.5, 1.0);
        assert_eq!(found(&mut bench), None);
        let after = tests(&bench);
        assert!(after > before, "{before} {after}");
        assert!(bench.world.bodies.tests() >= after);
    }
}
