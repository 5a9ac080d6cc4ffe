//! A plan in the making: moves committed one after the other, each in space and time against all
//! that was committed before (rule 31).
//!
//! Responsible for: committing a move (approach, grasp, transfer, release, the way home), what that
//! reserves, taking back a way home that nothing hangs on.
//! Not responsible for: which move comes next (`order`), searching (`route`), who has to make room
//! (`room`), who grasps later than it could (`late`), laying out plans that are known (`lay`).
//!
//! Terms: a robot's *tail* is its way home after its last release. Everybody else plans around
//! it; when the robot gets another move, its tail is taken back first. Whoever is parked is
//! reserved for ever until its next committed move, so waiting there is always possible.

pub(super) mod late;
pub(super) mod lay;
mod room;

use std::rc::Rc;

use scene::{Event, ROBOT_ALONE, Scene, Vec2};

use crate::anytime::ground::{EVER, Ground, Time};
use crate::anytime::route::{Leg, Piece, Quest, Router, Target, Then, sides};
use crate::anytime::timeline::{Owner, Resting, Timeline};
use crate::anytime::track::{Deed, Ends, Left, Move, Place, Rest, Start, Track};

/// No object.
const NOTHING: Resting = (Owner::MAX, 0);

/// The plan.
pub(crate) struct Plan {
    robots: u32,
    homes: Vec<u32>,
    timeline: Timeline,
    tracks: Vec<Track>,
    rests: Vec<Rest>,
    way: Vec<Piece>,
    /// Whether robots that would hold an object for long grasp it later, if they are done as soon.
    pub(crate) grasps_late: bool,
}

impl Plan {
    pub(crate) fn new(ground: &Ground, homes: Vec<u32>) -> Self {
        Self {
            robots: homes.len() as u32,
            homes,
            timeline: Timeline::new(ground),
            tracks: Vec::new(),
            rests: Vec::new(),
            way: Vec::new(),
            grasps_late: false,
        }
    }

    /// Nothing committed but what is done whatever is planned. That waits for nothing that is
    /// planned now, so it comes first wherever both need the same space.
    pub(crate) fn begin(&mut self, ground: &Ground, start: &Start) {
        self.lay(ground, start);
        if start.robots.iter().any(|track| track.kept > 0) {
            self.timeline.let_pass(self.robots);
        }
    }

    pub(crate) fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    pub(crate) fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// When the last robot is done.
    pub(crate) fn makespan(&self) -> Time {
        self.tracks
            .iter()
            .map(|track| track.end.1)
            .max()
            .unwrap_or(0)
    }

    /// The lattice point of a robot's home.
    pub(crate) fn home(&self, robot: usize) -> u32 {
        self.homes[robot]
    }

    /// Whether a robot ends at home.
    pub(crate) fn ends_at_home(&self, robot: usize) -> bool {
        self.tracks[robot].end.0 == self.homes[robot]
    }

    /// Commits a move; when it is done with the release, or `None` if there is no way. Then
    /// nothing has changed.
    pub(crate) fn commit(
        &mut self,
        ground: &mut Ground,
        router: &mut Router,
        wanted: &Move,
    ) -> Option<Time> {
        let robot = wanted.robot;
        let tail = self.take_tail(ground, robot);
        let found = self.try_from(ground, router, wanted);
        if found.is_none() {
            // From its end there would be no other way: a way along the tail was looked for too.
            self.put_tail_back(ground, robot, tail);
        }
        found
    }

    /// Commits a move the way it was found after the same moves before; when it is done with the
    /// release, or `None` if that is too late. Then nothing has changed.
    pub(crate) fn commit_known(
        &mut self,
        ground: &Ground,
        wanted: &Move,
        way: &[Piece],
    ) -> Option<Time> {
        if way.last()?.end() >= wanted.home_by {
            return None;
        }
        self.take_tail(ground, wanted.robot);
        Some(self.enter_way(ground, wanted.robot, way, Some(wanted)))
    }

    /// The way of the move that was committed last.
    pub(crate) fn way(&self) -> &[Piece] {
        &self.way
    }

    fn try_from(
        &mut self,
        ground: &mut Ground,
        router: &mut Router,
        wanted: &Move,
    ) -> Option<Time> {
        let clear = self.clear_from(ground, wanted.robot, &wanted.to).ok()?;
        let mut legs = self.legs(ground, wanted, clear);
        let mut way = std::mem::take(&mut self.way);
        let mut found = None;
        if wanted.ends != Ends::Anywhere {
            let quest = self.quest(wanted, &legs, 0);
            found = router.find(ground, &self.timeline, &quest, &mut way);
        }
        if found.is_none() && wanted.ends != Ends::AtHome {
            let back = legs[2].ahead(wanted.to.grasp)?;
            legs[2].target = Target::Anywhere(None);
            let mut quest = self.quest(wanted, &legs, 0);
            quest.limit = quest.limit.saturating_sub(back);
            found = router.find(ground, &self.timeline, &quest, &mut way);
        }
        let done = found.map(|end| {
            if self.grasps_late {
                self.grasp_late(ground, router, wanted, &mut legs, end, &mut way);
            }
            self.enter_way(ground, wanted.robot, &way, Some(wanted))
        });
        self.way = way;
        done
    }

    /// The legs of a move that begins where the robot's tail does; its object is put down no
    /// earlier than `clear`.
    fn legs(&self, ground: &mut Ground, wanted: &Move, clear: Time) -> [Leg; 3] {
        let left = self.tracks[wanted.robot].left.as_ref();
        let rest = &self.rests[wanted.object];
        let moved = self.resting(wanted.object, rest.turns);
        let (alone, carrying) = (ROBOT_ALONE.0, ground.carrying(wanted.object, wanted.to.by));
        let mut to = |class: usize, cell: u32| Target::Place(cell, ground.field(class, cell));
        [
            Leg {
                class: alone,
                target: to(alone, rest.place.grasps[wanted.to.by as usize]),
                then: Then::Grasp(rest.since.max(wanted.after.0)),
                closed: closed_by([Some(&rest.place), left.map(|left| &left.place)]),
                own: [moved, self.left_by(wanted.robot)],
            },
            Leg {
                class: carrying,
                target: to(carrying, wanted.to.grasp),
                then: Then::Release(clear.max(wanted.after.1)),
                closed: Vec::new(),
                own: [moved, NOTHING],
            },
            Leg {
                class: alone,
                target: to(alone, self.homes[wanted.robot]),
                then: Then::Stay,
                closed: wanted.to.bare.to_vec(),
                own: [moved, NOTHING],
            },
        ]
    }

    fn quest<'a>(&self, wanted: &Move, legs: &'a [Leg], ignoring_parked: Owner) -> Quest<'a> {
        let (from, time) = self.tracks[wanted.robot].free;
        Quest {
            robot: wanted.robot as Owner,
            from,
            time,
            legs,
            limit: wanted.home_by,
            ignoring_parked,
        }
    }

    /// When the next move of an object, to a place, may grasp and release it by the user's own
    /// order, as far as what comes first is committed.
    pub(crate) fn user_order(&self, scene: &Scene, object: usize, to: Vec2) -> (Time, Time) {
        let mut after = (0, 0);
        for order in scene.before.iter().filter(|order| order.then.0 == object) {
            let rest = &self.rests[order.first.0];
            let done = match order.first.1 {
                Event::Start | Event::Grasp => rest.grasped.unwrap_or(0),
                Event::Finish => rest.since,
            };
            let is_last = scene.objects[object].goal == Some(to);
            match order.then.1 {
                Event::Start | Event::Grasp => after.0 = after.0.max(done),
                Event::Finish if is_last => after.1 = after.1.max(done),
                Event::Finish => {}
            }
        }
        after
    }

    /// Sends a robot that has no move left to a target, to stay.
    fn go(
        &mut self,
        ground: &Ground,
        router: &mut Router,
        robot: usize,
        target: Target,
    ) -> Option<Time> {
        let tail = self.take_tail(ground, robot);
        let (from, time) = self.tracks[robot].free;
        let left = self.tracks[robot].left.as_ref();
        let legs = [Leg {
            class: ROBOT_ALONE.0,
            target,
            then: Then::Stay,
            closed: closed_by([left.map(|left| &left.place), None]),
            own: [self.left_by(robot), NOTHING],
        }];
        let quest = Quest {
            robot: robot as Owner,
            from,
            time,
            legs: &legs,
            limit: EVER,
            ignoring_parked: 0,
        };
        let mut way = std::mem::take(&mut self.way);
        let found = router.find(ground, &self.timeline, &quest, &mut way);
        if found.is_some() {
            self.enter_way(ground, robot, &way, None);
        } else {
            self.put_tail_back(ground, robot, tail);
        }
        self.way = way;
        found
    }

    /// Sends everybody home who is not to end there.
    pub(crate) fn send_all_home(
        &mut self,
        ground: &mut Ground,
        router: &mut Router,
    ) -> Option<Time> {
        let mut progress = true;
        while progress {
            progress = false;
            let mut away = false;
            for robot in 0..self.tracks.len() {
                if self.ends_at_home(robot) || self.tracks[robot].is_gone {
                    continue;
                }
                let home = self.homes[robot];
                let target = Target::Place(home, ground.field(ROBOT_ALONE.0, home));
                let gone = self.go(ground, router, robot, target).is_some();
                progress |= gone;
                away |= !gone;
            }
            if !away {
                return Some(self.makespan());
            }
        }
        None
    }

    fn resting(&self, object: usize, turns: u32) -> Resting {
        (self.robots + object as u32, turns)
    }

    /// The object in whose room a robot's tail begins.
    fn left_by(&self, robot: usize) -> Resting {
        let left = self.tracks[robot].left.as_ref();
        left.map_or(NOTHING, |left| self.resting(left.object, left.turns))
    }

    /// The earliest time from which an object may stand at a place for ever, or who is parked
    /// there.
    fn clear_from(&self, ground: &Ground, mover: usize, place: &Place) -> Result<Time, usize> {
        let mut clear = 0;
        for (robot, track) in self.tracks.iter().enumerate() {
            if robot == mover || track.is_gone {
                continue;
            }
            let mut class = ROBOT_ALONE.0;
            let mut cell = track.start;
            let meets = |class: usize, cell: u32| place.closes(class, cell);
            let mut was_in = meets(class, cell);
            for deed in &track.deeds {
                let mut beside = None;
                let until = match *deed {
                    Deed::Step(direction, _, arrive) => {
                        beside = sides(ground, cell, direction as usize);
                        cell = cell.wrapping_add_signed(ground.offsets[direction as usize]);
                        arrive
                    }
                    Deed::Grasped(object, _, time, by) => {
                        class = ground.carrying(object as usize, by);
                        time
                    }
                    Deed::Released(_, time) => {
                        class = ROBOT_ALONE.0;
                        time
                    }
                };
                let is_in = meets(class, cell);
                let passes = |beside: [u32; 2]| beside.iter().any(|&side| meets(class, side));
                if was_in || is_in || beside.is_some_and(passes) {
                    clear = clear.max(until);
                }
                was_in = is_in;
            }
            if was_in {
                return Err(robot);
            }
        }
        Ok(clear)
    }

    /// Takes a robot's tail out of the plan.
    fn take_tail(&mut self, ground: &Ground, robot: usize) -> Vec<Deed> {
        let track = &mut self.tracks[robot];
        let tail = track.deeds.split_off(track.tail);
        let (cell, time) = track.free;
        let who = (robot as Owner, ROBOT_ALONE.0);
        let directions = tail.iter().filter_map(Deed::direction);
        self.timeline.take_back(ground, who, cell, directions, time);
        tail
    }

    fn put_tail_back(&mut self, ground: &Ground, robot: usize, tail: Vec<Deed>) {
        let track = &mut self.tracks[robot];
        let (cell, time) = track.free;
        let owner = robot as Owner;
        let mut walker = self
            .timeline
            .enter(ground, owner, ROBOT_ALONE.0, cell, time);
        for deed in tail {
            if let Deed::Step(direction, depart, arrive) = deed {
                let number = track.deeds.len() as u32;
                let span = (depart, arrive);
                self.timeline
                    .step(ground, &mut walker, direction as usize, span, number);
            }
            track.deeds.push(deed);
        }
        let number = track.deeds.len() as u32;
        self.timeline.leave(ground, &walker, EVER, number);
    }

    /// Commits a way that was found: of a move (with its class while carrying), or just a way.
    /// When its object is released, or else when it ends.
    fn enter_way(
        &mut self,
        ground: &Ground,
        robot: usize,
        way: &[Piece],
        wanted: Option<&Move>,
    ) -> Time {
        let owner = robot as Owner;
        let track = &mut self.tracks[robot];
        let (mut cell, begin) = track.free;
        let mut walker = self
            .timeline
            .enter(ground, owner, ROBOT_ALONE.0, cell, begin);
        let mut now = begin;
        let mut holds = false;
        if wanted.is_none() {
            track.tail = track.deeds.len();
        }
        for piece in way {
            let number = track.deeds.len() as u32;
            match *piece {
                Piece::Step(direction, depart, arrive) => {
                    let span = (depart, arrive);
                    self.timeline
                        .step(ground, &mut walker, direction as usize, span, number);
                    cell = cell.wrapping_add_signed(ground.offsets[direction as usize]);
                    track.deeds.push(Deed::Step(direction, depart, arrive));
                    now = arrive;
                }
                Piece::Grip(end) => {
                    let Some(wanted) = wanted else { continue };
                    let object = wanted.object;
                    let id = self.robots + object as u32;
                    let rest = &mut self.rests[object];
                    if holds {
                        self.timeline.leave(ground, &walker, end, number);
                        walker = self.timeline.enter(ground, owner, ROBOT_ALONE.0, cell, end);
                        let down = end - ground.release;
                        rest.place = Rc::clone(&wanted.to);
                        rest.since = end;
                        rest.turns += 1;
                        for (class, cells) in wanted.to.cells.iter().enumerate() {
                            self.timeline.occupy(class, cells, (id, rest.turns), down);
                        }
                        track.stops.push(Rc::clone(&wanted.to));
                        track.deeds.push(Deed::Released(object as u32, end));
                        track.tail = track.deeds.len();
                        track.free = (cell, end);
                        track.left = wanted.to.has_in_its_room(cell).then(|| Left {
                            object,
                            turns: rest.turns,
                            place: Rc::clone(&wanted.to),
                        });
                    } else {
                        let up = end - ground.grasp;
                        self.timeline.leave(ground, &walker, up, number);
                        let by = wanted.to.by;
                        let class = ground.carrying(object, by);
                        walker = self.timeline.enter(ground, owner, class, cell, up);
                        for (class, cells) in rest.place.cells.iter().enumerate() {
                            self.timeline.vacate(class, cells, id, up);
                        }
                        track.stops.push(rest.place.held(by));
                        track
                            .deeds
                            .push(Deed::Grasped(object as u32, rest.turns, end, by));
                        holds = true;
                    }
                    now = end;
                }
            }
        }
        let number = track.deeds.len() as u32;
        self.timeline.leave(ground, &walker, EVER, number);
        track.end = (cell, now);
        if wanted.is_some() { track.free.1 } else { now }
    }
}

/// Cells that a robot may not enter for objects whose reservations are looked at apart.
fn closed_by(places: [Option<&Rc<Place>>; 2]) -> Vec<u32> {
    let places = places.into_iter().flatten();
    places
        .flat_map(|place| place.bare.iter().copied())
        .collect()
}
