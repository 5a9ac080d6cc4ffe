//! What robots do in a plan: places, deeds, tracks.
//!
//! Responsible for: these words, and what a robot that keeps the beginning of its track goes on
//! from.
//! Not responsible for: committing moves (`plan`).

use std::rc::Rc;

use scene::validate::MAX_GRASPS;
use scene::{Grasp, ROBOT_ALONE, Scene, Vec2};

use crate::anytime::ground::{Ground, Time};
use crate::anytime::situation::Situation;
use crate::frontier::NOWHERE;

/// A place of one object: at rest there, grasped there.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    /// Centre of the object, m.
    pub(crate) at: Vec2,
    /// By which of its grasps it is brought there, or taken from there.
    pub(crate) by: u8,
    /// Where the robot stands then: the lattice point, or the one next to it; [`NOWHERE`] if no
    /// robot can stand there.
    pub(crate) grasp: u32,
    /// The same for every grasp.
    pub(crate) grasps: Rc<[u32]>,
    /// Where it keeps each class of bodies away, sorted.
    pub(crate) cells: Rc<[Vec<u32>]>,
    /// Where it keeps a robot that comes for it away, sorted.
    pub(crate) bare: Rc<[u32]>,
}

/// What a robot does, in order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Deed {
    /// A step in a direction, from when to when.
    Step(u8, Time, Time),
    /// It has grasped this object, which was put down so often before, by this grasp.
    Grasped(u32, u32, Time, u8),
    /// It has put this object down.
    Released(u32, Time),
}

/// What a robot does.
#[derive(Clone, Debug)]
pub(crate) struct Track {
    /// The lattice point where it begins.
    pub(crate) start: u32,
    /// Where it stands then, m.
    pub(crate) from: Vec2,
    /// It takes no part: it is an obstacle.
    pub(crate) is_gone: bool,
    /// It has no way home past those that are gone: it ends where it begins.
    pub(crate) is_cut_off: bool,
    pub(crate) deeds: Vec<Deed>,
    /// Where the object stands at each grip.
    pub(crate) stops: Vec<Rc<Place>>,
    /// Deeds before this one stay as they are, whatever else is planned.
    pub(crate) kept: usize,
    /// Deeds from here on are its tail.
    pub(crate) tail: usize,
    /// Where and when the tail begins.
    pub(crate) free: (u32, Time),
    /// The object in whose room it begins.
    pub(crate) left: Option<Left>,
    /// Where and when it ends.
    pub(crate) end: (u32, Time),
}

/// Where a robot is to be after a move, until its next one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ends {
    AtHome,
    /// At home if there is a way, else anywhere.
    AtHomeIfPossible,
    Anywhere,
}

/// A move: which robot brings which object where.
#[derive(Clone, Debug)]
pub(crate) struct Move {
    pub(crate) robot: usize,
    pub(crate) object: usize,
    pub(crate) to: Rc<Place>,
    /// When it may be grasped, and released, by the user's own order.
    pub(crate) after: (Time, Time),
    /// When the robot has to be home again, if that is its last move; else when it would have to
    /// be, so that its other moves can follow in time.
    pub(crate) home_by: Time,
    pub(crate) ends: Ends,
}

/// What a plan starts from.
#[derive(Clone, Debug)]
pub(crate) struct Start {
    /// By robot, what it does whatever is planned: at first, nothing. It holds nothing after that.
    pub(crate) robots: Vec<Track>,
    /// Where objects stand before that, and how often each was put down.
    pub(crate) objects: Vec<(Rc<Place>, u32)>,
}

/// Where an object is left by the last move of it.
#[derive(Clone, Debug)]
pub(crate) struct Rest {
    pub(crate) place: Rc<Place>,
    pub(crate) since: Time,
    /// How often it has been put down.
    pub(crate) turns: u32,
    /// When it was grasped first.
    pub(crate) grasped: Option<Time>,
}

/// An object that was put down, and not moved since as far as its robot knows.
#[derive(Clone, Debug)]
pub(crate) struct Left {
    pub(crate) object: usize,
    /// How often it had been put down.
    pub(crate) turns: u32,
    pub(crate) place: Rc<Place>,
}

/// A grip in a track.
pub(crate) struct GripAt<'a> {
    pub(crate) time: Time,
    pub(crate) object: usize,
    /// Where the object stands then.
    pub(crate) place: &'a Rc<Place>,
    pub(crate) is_release: bool,
}

impl Place {
    /// Whether a robot can stand where it is grasped, by one grasp at least.
    pub(crate) fn is_open(&self) -> bool {
        self.open_by().is_some()
    }

    /// Whether it keeps a class of bodies away from a cell.
    #[inline]
    pub(crate) fn closes(&self, class: usize, cell: u32) -> bool {
        let closed = &self.cells[class];
        let is_near = closed.first() <= Some(&cell) && Some(&cell) <= closed.last();
        is_near && closed.binary_search(&cell).is_ok()
    }

    /// Whether it keeps a class of bodies away from any of these cells.
    pub(crate) fn closes_any(&self, class: usize, cells: &[u32]) -> bool {
        cells.iter().any(|&cell| self.closes(class, cell))
    }

    /// Whether a robot without an object that is at this cell is in its room.
    pub(crate) fn has_in_its_room(&self, cell: u32) -> bool {
        self.closes(ROBOT_ALONE.0, cell)
    }

    /// Where robots can stand that grasp it.
    pub(crate) fn open_grasps(&self) -> impl Iterator<Item = u32> + '_ {
        self.grasps.iter().copied().filter(|&cell| cell != NOWHERE)
    }

    /// The first grasp by which a robot can hold it there, if any.
    pub(crate) fn open_by(&self) -> Option<u8> {
        let open = self.grasps.iter().position(|&cell| cell != NOWHERE)?;
        u8::try_from(open).ok()
    }

    /// The same place, where it is held by this grasp.
    pub(crate) fn held(self: &Rc<Self>, by: u8) -> Rc<Self> {
        if by == self.by {
            return Rc::clone(self);
        }
        Rc::new(Self {
            by,
            grasp: self.grasps[by as usize],
            ..(**self).clone()
        })
    }

    /// The place of an object that nobody can move, and that hinders as its holder does.
    pub(crate) fn out_of_reach(ground: &Ground, at: Vec2) -> Rc<Self> {
        Rc::new(Self {
            at,
            by: 0,
            grasp: NOWHERE,
            grasps: [NOWHERE; MAX_GRASPS].into(),
            cells: vec![Vec::new(); ground.classes].into(),
            bare: [].into(),
        })
    }

    /// The place of `object` with its centre at `at`.
    pub(crate) fn of(scene: &Scene, ground: &Ground, object: usize, at: Vec2) -> Rc<Self> {
        let spec = &scene.objects[object];
        let open_to_empty = spec.pass_under;
        let cells = (0..ground.classes)
            .map(|class| {
                if class == ROBOT_ALONE.0 && open_to_empty {
                    return Vec::new();
                }
                ground.around(scene, class, &spec.shape, at, true)
            })
            .collect();
        let bare = if open_to_empty || scene.lifts_from_below(object) {
            Vec::new()
        } else {
            ground.around(scene, ROBOT_ALONE.0, &spec.shape, at, false)
        };
        let stand = |grasp: &Grasp| {
            let classes = [ROBOT_ALONE.0, grasp.class.0];
            let cell = ground.entry(scene, &classes, at + grasp.offset, &bare);
            cell.unwrap_or(NOWHERE)
        };
        let grasps: Rc<[u32]> = spec.grasps.iter().map(stand).collect();
        Rc::new(Self {
            at,
            by: 0,
            grasp: grasps[0],
            grasps,
            cells,
            bare: bare.into(),
        })
    }
}

impl Track {
    /// Nothing done, at this cell, from where it stands.
    pub(crate) fn parked(cell: u32, from: Vec2) -> Self {
        Self {
            start: cell,
            from,
            is_gone: false,
            is_cut_off: false,
            deeds: Vec::new(),
            stops: Vec::new(),
            kept: 0,
            tail: 0,
            free: (cell, 0),
            left: None,
            end: (cell, 0),
        }
    }

    /// Its first `kept` deeds, after which it holds nothing, and goes on no sooner than `until`.
    pub(crate) fn cut(&self, ground: &Ground, kept: usize, until: Time) -> Self {
        let deeds = self.deeds[..kept].to_vec();
        let (mut cell, mut now, mut grips) = (self.start, 0, 0);
        for deed in &deeds {
            if let Some(direction) = deed.direction() {
                cell = cell.wrapping_add_signed(ground.offsets[direction]);
            } else {
                grips += 1;
            }
            now = deed.end();
        }
        Self {
            start: self.start,
            from: self.from,
            is_gone: self.is_gone,
            is_cut_off: self.is_cut_off,
            deeds,
            stops: self.stops[..grips].to_vec(),
            kept,
            tail: kept,
            free: (cell, now.max(until)),
            left: None,
            end: (cell, now),
        }
    }

    /// Its grips, in turn.
    pub(crate) fn grips(&self) -> impl Iterator<Item = GripAt<'_>> {
        let grips = self.deeds.iter().filter_map(|deed| match *deed {
            Deed::Step(..) => None,
            Deed::Grasped(object, _, time, _) => Some((time, object as usize, false)),
            Deed::Released(object, time) => Some((time, object as usize, true)),
        });
        let places = grips.zip(&self.stops);
        places.map(|((time, object, is_release), place)| GripAt {
            time,
            object,
            place,
            is_release,
        })
    }
}

impl Start {
    /// As the situation is; what robots hold they put down first. None if some robot cannot be
    /// joined to the lattice.
    pub(crate) fn new(scene: &Scene, ground: &Ground, situation: &Situation) -> Option<Self> {
        let objects = (situation.objects.iter().enumerate())
            .map(|(object, state)| {
                let place = if state.is_movable {
                    Place::of(scene, ground, object, state.at)
                } else {
                    Place::out_of_reach(ground, state.at)
                };
                (place, state.put_downs)
            })
            .collect::<Vec<_>>();
        let robots = situation.robots.iter().enumerate().map(|(number, robot)| {
            if !robot.is_live {
                return Some(Track {
                    is_gone: true,
                    ..Track::parked(0, robot.at)
                });
            }
            let Some(object) = robot.holds else {
                // To a lattice point that it gets to past whatever stands there, if there is one.
                let mut around: Vec<u32> = scene.lattice.around(robot.at).collect();
                around.retain(|&cell| {
                    (objects.iter()).any(|(place, _)| place.has_in_its_room(cell))
                        || situation.meets_robot(scene, number, scene.lattice.at(cell))
                });
                around.sort_unstable();
                let entry = |but: &[u32]| ground.entry(scene, &[ROBOT_ALONE.0], robot.at, but);
                let cell = entry(&around).or_else(|| entry(&[]))?;
                return Some(Track::parked(cell, robot.at));
            };
            let place = &objects[object].0;
            let by = scene.grasp_by(object, robot.at - place.at).unwrap_or(0);
            let place = place.held(by as u8);
            if place.grasp == NOWHERE {
                return None;
            }
            let mut track = Track::parked(place.grasp, robot.at);
            let down = ground.release;
            track.deeds.push(Deed::Released(object as u32, down));
            track.stops.push(place);
            (track.kept, track.tail) = (1, 1);
            (track.free.1, track.end.1) = (down, down);
            Some(track)
        });
        Some(Self {
            robots: robots.collect::<Option<Vec<_>>>()?,
            objects,
        })
    }

    /// Where objects stand after what robots do whatever is planned, and since when.
    pub(crate) fn rests(&self) -> Vec<Rest> {
        let mut rests: Vec<Rest> = (self.objects.iter())
            .map(|(place, turns)| Rest {
                place: Rc::clone(place),
                since: 0,
                turns: *turns,
                grasped: None,
            })
            .collect();
        for grip in grips_in_turn(&self.robots) {
            let rest = &mut rests[grip.object];
            if grip.is_release {
                rest.place = Rc::clone(grip.place);
                rest.since = grip.time;
                rest.turns += 1;
            } else {
                rest.grasped.get_or_insert(grip.time);
            }
        }
        rests
    }
}

/// The grips of all robots, in turn.
pub(crate) fn grips_in_turn(tracks: &[Track]) -> Vec<GripAt<'_>> {
    let mut grips: Vec<GripAt<'_>> = tracks.iter().flat_map(Track::grips).collect();
    grips.sort_by_key(|grip| grip.time);
    grips
}

impl Deed {
    /// Direction of a step.
    pub(crate) fn direction(&self) -> Option<usize> {
        match self {
            Self::Step(direction, _, _) => Some(*direction as usize),
            _ => None,
        }
    }

    /// When it begins; of a grip, when it is done.
    pub(crate) fn begin(&self) -> Time {
        match *self {
            Self::Step(_, time, _) | Self::Grasped(_, _, time, _) | Self::Released(_, time) => time,
        }
    }

    /// When it is done.
    pub(crate) fn end(&self) -> Time {
        match *self {
            Self::Step(_, _, time) | Self::Grasped(_, _, time, _) | Self::Released(_, time) => time,
        }
    }
}
