//! Plans that are known, laid out in space and time.
//!
//! Responsible for: reserving what robots do in a plan, or in the part of it that they keep, and
//! what objects do with it.
//! Not responsible for: committing further moves (the parent module).

use std::rc::Rc;

use scene::{ROBOT_ALONE, Scene};

use crate::anytime::ground::{EVER, Ground, duration};
use crate::anytime::joint::JointMove;
use crate::anytime::plan::Plan;
use crate::anytime::shortest::JointStep;
use crate::anytime::timeline::{Owner, Timeline};
use crate::anytime::track::{Deed, Left, Place, Rest, Start, Track, grips_in_turn};

impl Plan {
    /// Lays out what robots do whatever is planned.
    pub(super) fn lay(&mut self, ground: &Ground, start: &Start) {
        self.timeline.clear();
        self.tracks.clone_from(&start.robots);
        self.excuse_starts(ground);
        for (robot, track) in self.tracks.iter().enumerate() {
            if !track.is_gone {
                enter(&mut self.timeline, ground, robot as Owner, track);
            }
        }
        let mut turns: Vec<u32> = start.objects.iter().map(|(_, turns)| *turns).collect();
        for (object, (place, _)) in start.objects.iter().enumerate() {
            let resting = (self.robots + object as u32, turns[object]);
            for (class, cells) in place.cells.iter().enumerate() {
                self.timeline.occupy(class, cells, resting, 0);
            }
        }
        for grip in grips_in_turn(&start.robots) {
            let owner = self.robots + grip.object as u32;
            turns[grip.object] += u32::from(grip.is_release);
            for (class, cells) in grip.place.cells.iter().enumerate() {
                if grip.is_release {
                    let down = grip.time - ground.release;
                    let resting = (owner, turns[grip.object]);
                    // Who held it from the beginning has it where it stands then.
                    self.timeline.vacate(class, cells, owner, down);
                    self.timeline.occupy(class, cells, resting, down);
                } else {
                    let up = grip.time - ground.grasp;
                    self.timeline.vacate(class, cells, owner, up);
                }
            }
        }
        self.rests = start.rests();
        for track in &mut self.tracks {
            let (cell, time) = track.free;
            let is_around = |rest: &Rest| rest.since <= time && rest.place.has_in_its_room(cell);
            let around = self.rests.iter().position(is_around);
            track.left = around.map(|object| Left {
                object,
                turns: self.rests[object].turns,
                place: Rc::clone(&self.rests[object].place),
            });
        }
    }

    /// Robots can be where they stand at first, also where that counts as too near to others.
    fn excuse_starts(&mut self, ground: &Ground) {
        let live = || (self.tracks.iter().enumerate()).filter(|(_, track)| !track.is_gone);
        for (robot, track) in live() {
            for (other, near) in live().filter(|(other, _)| *other != robot) {
                for class in classes_at_start(ground, track) {
                    let meets = |as_class| ground.meet(class, track.start, as_class, near.start);
                    if classes_at_start(ground, near).any(meets) {
                        let owner = other as Owner;
                        self.timeline.excuse(class, track.start, owner, near.start);
                    }
                }
            }
        }
    }

    /// Takes steps over that are made one after the other, each by some robots at the same time.
    pub(crate) fn replay(
        &mut self,
        scene: &Scene,
        ground: &Ground,
        start: &Start,
        steps: &[JointStep],
    ) {
        let mut start = start.clone();
        let mut rests = start.rests();
        let ends = start.robots.iter().map(|track| track.end.1);
        let mut now = ends.max().unwrap_or(0);
        for step in steps {
            let before = now;
            for &(robot, made) in step {
                let track = &mut start.robots[robot];
                let cell = &mut track.end.0;
                let done = before
                    + match made {
                        JointMove::Step(direction) => duration(direction as usize),
                        JointMove::Grasp(_) => ground.grasp,
                        JointMove::Release(_) => ground.release,
                    };
                let deed = match made {
                    JointMove::Step(direction) => {
                        *cell = cell.wrapping_add_signed(ground.offsets[direction as usize]);
                        Deed::Step(direction, before, done)
                    }
                    JointMove::Grasp(object) => {
                        let rest = &rests[object as usize];
                        track.stops.push(rest.place.held(0));
                        Deed::Grasped(u32::from(object), rest.turns, done, 0)
                    }
                    JointMove::Release(object) => {
                        let rest = &mut rests[object as usize];
                        let at = ground.at(*cell) - scene.objects[object as usize].grasp;
                        rest.place = Place::of(scene, ground, object as usize, at);
                        rest.turns += 1;
                        track.stops.push(Rc::clone(&rest.place));
                        Deed::Released(u32::from(object), done)
                    }
                };
                track.deeds.push(deed);
                track.end.1 = done;
                now = now.max(done);
            }
        }
        self.lay(ground, &start);
    }

    /// Takes a plan over that began at `start`.
    pub(crate) fn take_over(&mut self, ground: &Ground, start: &Start, tracks: Vec<Track>) {
        let objects = start.objects.clone();
        let whole = Start {
            robots: tracks,
            objects,
        };
        self.lay(ground, &whole);
    }
}

/// The classes of a robot where it begins: alone, and with what it puts down first.
fn classes_at_start(ground: &Ground, track: &Track) -> impl Iterator<Item = usize> {
    let first = track.deeds.first().zip(track.stops.first());
    let held = first.and_then(|(deed, place)| match *deed {
        Deed::Released(object, _) => Some(ground.carrying(object as usize, place.by)),
        _ => None,
    });
    std::iter::once(ROBOT_ALONE.0).chain(held)
}

/// Enters all that a robot does.
pub(crate) fn enter(timeline: &mut Timeline, ground: &Ground, owner: Owner, track: &Track) {
    let alone = ROBOT_ALONE.0;
    let mut walker = timeline.enter(ground, owner, alone, track.start, 0);
    let mut cell = track.start;
    for (number, deed) in track.deeds.iter().enumerate() {
        let number = number as u32;
        match *deed {
            Deed::Step(direction, depart, arrive) => {
                let direction = direction as usize;
                let span = (depart, arrive);
                timeline.step(ground, &mut walker, direction, span, number);
                cell = cell.wrapping_add_signed(ground.offsets[direction]);
            }
            Deed::Grasped(object, _, time, by) => {
                let class = ground.carrying(object as usize, by);
                let up = time - ground.grasp;
                timeline.leave(ground, &walker, up, number);
                walker = timeline.enter(ground, owner, class, cell, up);
            }
            Deed::Released(_, time) => {
                timeline.leave(ground, &walker, time, number);
                walker = timeline.enter(ground, owner, alone, cell, time);
            }
        }
    }
    let number = track.deeds.len() as u32;
    timeline.leave(ground, &walker, EVER, number);
}
