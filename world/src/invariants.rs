//! Invariants: checked every tick, whatever the grants promised.
//!
//! Responsible for: no two bodies overlap, swept over the tick; each object is held by at most
//! one robot, and both sides agree; objects are neither lost nor doubled; robots move only on
//! grants and no faster than they can; what stays granted is disjoint.
//! Epochs and ticks only ever count up, by construction. Not responsible for: what a broken one
//! means (`step.rs` ends the run), what need not be looked at again (`cleared.rs`). A second,
//! independent check is the trace checker's.
//!
//! Two robots of which neither has left the ways that were found disjoint cannot have met, so only
//! what has changed is held against everything around it.

#[cfg(test)]
mod tests;
mod violation;

use scene::{ClassId, Scene, Vec2};
use shm_types::TaskStatus;

use crate::bodies::Sweep;
use crate::cleared::{Change, Cleared, is_between, is_same};
use crate::path::ARRIVAL_M;
use crate::state::{Robot, id, is_at};
use crate::step::World;

pub use violation::{Checks, Invariant, Violation};

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
            if found.is_none() && !has_moved_well(robot, !has_changed, self.tick_m) {
                found = Some(Violation::Motion { robot: id(i) });
            }
            if let Some(object) = robot.hand.holding() {
                holding += 1;
                if found.is_none() {
                    found = self.check_hand(scene, i, object);
                    if found.is_none() {
                        self.objects.touched().pass(object);
                    }
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

    /// Robot `i` and the `object` that it holds.
    fn check_hand(&self, scene: &Scene, i: usize, object: usize) -> Option<Violation> {
        let robot = &self.robots[i];
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
        let ahead = &robot.grant.points()[change.new_from..];
        let pieces = pieces(robot.class(scene), start, ahead);
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
        for (j, (other, theirs)) in self.robots.iter().zip(cleared).enumerate() {
            if j == i || !region.meets(&theirs.region()) {
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
        let (stand, ahead) = ([change.start], &robot.grant.points()[change.new_from..]);
        let ends = if ahead.is_empty() { &stand } else { ahead };
        pieces(robot.class(scene), change.start, ends)
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

/// Whether a robot has moved on its grant and no faster than it can. One that `followed` its way
/// has gone along it to where what is left of it begins, and has no other path granted: there is
/// nothing to measure.
#[inline]
fn has_moved_well(robot: &Robot, followed: bool, tick_m: f64) -> bool {
    let moved_m = robot.track.moved_m();
    let used_m = || robot.granted_m - robot.grant.length_from(robot.position);
    let on_grant = !robot.moved || followed || (used_m() - moved_m).abs() <= 8.0 * ARRIVAL_M;
    let on_track = is_same(robot.position, robot.track.end());
    on_grant && on_track && moved_m <= tick_m + ARRIVAL_M
}

/// The straight pieces from `start` to point after point of `ends`.
fn pieces(class: ClassId, start: Vec2, ends: &[Vec2]) -> impl Iterator<Item = Sweep> + '_ {
    let mut from = start;
    ends.iter().map(move |&to| {
        let piece = Sweep { class, from, to };
        from = to;
        piece
    })
}
