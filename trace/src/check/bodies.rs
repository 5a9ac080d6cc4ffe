//! Where every body is, and whether it keeps apart from all others on its way.
//!
//! Responsible for: the straight piece each body is on, exact tests of every two pieces that are
//! near each other in space at one time, walls and bounds.
//! Not responsible for: who may touch whom (`rules`), why a body moves (`checker`).
//!
//! Each body is on one piece at any time, standing or moving. When a piece ends, or the rules for
//! its body are about to change, it is *settled*: tested against every piece under way near it,
//! over the time they share that was not tested before. So each two pieces are tested once, by
//! whichever ends first.

use nalgebra::Vector2;

use super::geometry::Vector;
use super::grid::{Grid, Region};
use super::pairs::{Pair, Pairs, Shape, report};
use super::report::{Findings, Kind, Who};
use super::rules::{Apart, OVERLAP_M, Rules};
use crate::record::{BodyKind, Motion, SceneRecord, State};

/// Two places nearer than this are the same, m: the micrometre within which a grasp is good, the
/// micrometre by which it may put its object right, nothing more.
pub(super) const SAME_PLACE_M: f64 = 2e-6;

/// A straight piece.
#[derive(Clone, Copy, Debug)]
enum Line {
    /// It stands there since this time, ns.
    Rest(Vector, u64),
    /// It moves.
    Moving(Motion),
}

impl Line {
    fn at(&self, time_ns: u64) -> Vector {
        match self {
            Self::Rest(place, _) => *place,
            Self::Moving(motion) => motion.at(time_ns),
        }
    }

    fn ends(&self) -> (Vector, Vector) {
        match self {
            Self::Rest(place, _) => (*place, *place),
            Self::Moving(motion) => (motion.from.into(), motion.to.into()),
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Body {
    who: Who,
    shape: Shape,
    line: Line,
    /// Up to when it has been tested, ns.
    settled_ns: u64,
}

/// All bodies of a run.
pub(super) struct Bodies {
    bodies: Vec<Body>,
    robots: usize,
    pairs: Pairs,
    /// Exact tests made in versions of the scene before this one.
    tests_before: u64,
    walls: Vec<(Shape, Vector)>,
    grid: Grid,
    wall_grid: Grid,
    bounds: Region,
    clearance_m: f64,
    found: Vec<usize>,
}

impl Bodies {
    /// All at their starts, time 0.
    pub(super) fn new(scene: &SceneRecord) -> Self {
        let mut pairs = Pairs::new(scene.robot.clearance_m);
        let robot = pairs.add(&scene.robot.shape);
        let robots = scene
            .homes
            .iter()
            .enumerate()
            .map(|(id, home)| (Who::Robot(id), robot, *home));
        let mut placed: Vec<_> = robots.collect();
        for (id, object) in scene.objects.iter().enumerate() {
            placed.push((Who::Object(id), pairs.add(&object.shape), object.start));
        }
        let walls: Vec<(Shape, Vector)> = scene
            .walls
            .iter()
            .map(|wall| (pairs.add(&wall.shape), wall.at.into()))
            .collect();
        let bounds = Region {
            low: scene.low.into(),
            high: scene.high.into(),
        };
        let widths = placed.iter().map(|&(_, shape, _)| {
            let (low, high) = pairs.extent(shape);
            (high - low).max()
        });
        let cell_m = widths.fold(0.0, f64::max);
        let mut wall_grid = Grid::new(bounds, walls.len(), cell_m);
        for (id, &(shape, at)) in walls.iter().enumerate() {
            wall_grid.put(id, Region::swept(pairs.extent(shape), at, at));
        }
        let mut all = Self {
            grid: Grid::new(bounds, placed.len(), cell_m),
            bodies: Vec::new(),
            robots: scene.homes.len(),
            pairs,
            tests_before: 0,
            walls,
            wall_grid,
            bounds,
            clearance_m: scene.robot.clearance_m,
            found: Vec::new(),
        };
        for (id, (who, shape, at)) in placed.into_iter().enumerate() {
            let line = Line::Rest(at.into(), 0);
            all.bodies.push(Body {
                who,
                shape,
                line,
                settled_ns: 0,
            });
            all.put(id);
        }
        all
    }

    /// The same bodies where they are, in another version of the scene from `time_ns` on. Those that
    /// are new stand at their starts.
    pub(super) fn changed(&self, scene: &SceneRecord, time_ns: u64) -> Self {
        let mut next = Self::new(scene);
        next.tests_before = self.tests();
        for id in 0..next.bodies.len() {
            let who = next.bodies[id].who;
            let known = match who {
                Who::Robot(robot) => robot < self.robots,
                Who::Object(object) => object < self.bodies.len() - self.robots,
                Who::Wall(_) | Who::Bounds => false,
            };
            let body = &mut next.bodies[id];
            body.settled_ns = time_ns;
            body.line = if known {
                self.bodies[self.index(who)].line
            } else {
                Line::Rest(body.line.at(time_ns), time_ns)
            };
            next.put(id);
        }
        next
    }

    /// A body, settled just now, stands elsewhere at once.
    pub(super) fn put_down(&mut self, who: Who, at: Vector, time_ns: u64) {
        self.replace(who, Line::Rest(at, time_ns));
    }

    /// Exact tests so far.
    pub(super) const fn tests(&self) -> u64 {
        self.tests_before + self.pairs.tests()
    }

    fn index(&self, who: Who) -> usize {
        match who {
            Who::Robot(id) => id,
            Who::Object(id) => self.robots + id,
            Who::Wall(_) | Who::Bounds => usize::MAX,
        }
    }

    /// Where a body is.
    pub(super) fn at(&self, who: Who, time_ns: u64) -> Vector {
        self.bodies[self.index(who)].line.at(time_ns)
    }

    /// Since when a body has been standing, ns; none while it moves on after `time_ns`.
    pub(super) fn stands_since(&self, who: Who, time_ns: u64) -> Option<u64> {
        match &self.bodies[self.index(who)].line {
            Line::Rest(_, since_ns) => Some(*since_ns),
            Line::Moving(motion) => (motion.end_ns <= time_ns).then_some(motion.end_ns),
        }
    }

    /// A body, settled just now, sets out on a motion.
    pub(super) fn set_out(&mut self, motion: &Motion) {
        self.replace(body_of(motion), Line::Moving(*motion));
    }

    /// Whether a body is on this motion.
    pub(super) fn is_on(&self, motion: &Motion) -> bool {
        let line = &self.bodies[self.index(body_of(motion))].line;
        matches!(line, Line::Moving(present) if present == motion)
    }

    /// A body, settled just now, stands at the end of its motion.
    pub(super) fn arrive(&mut self, motion: &Motion) {
        self.replace(body_of(motion), Line::Rest(motion.to.into(), motion.end_ns));
    }

    fn replace(&mut self, who: Who, line: Line) {
        let id = self.index(who);
        self.bodies[id].line = line;
        self.put(id);
    }

    fn put(&mut self, id: usize) {
        let body = &self.bodies[id];
        let (from, to) = body.line.ends();
        self.grid
            .put(id, Region::swept(self.pairs.extent(body.shape), from, to));
    }

    /// Forgets all that was and takes every place from a state record.
    pub(super) fn resume(&mut self, state: &State) {
        let robots = state.robots.iter().map(|robot| robot.at);
        let places: Vec<_> = robots
            .chain(state.objects.iter().map(|object| object.at))
            .collect();
        for (id, place) in places.into_iter().enumerate() {
            self.bodies[id].line = Line::Rest(place.into(), state.time_ns);
            self.bodies[id].settled_ns = state.time_ns;
            self.put(id);
        }
    }

    /// Settles every body, the present instant included.
    pub(super) fn settle_all(&mut self, time_ns: u64, rules: &Rules, findings: &mut Findings) {
        for id in 0..self.bodies.len() {
            self.settle_until(id, time_ns, true, rules, findings);
        }
    }

    /// Tests a body up to now. Called before anything changes for it.
    pub(super) fn settle(
        &mut self,
        who: Who,
        time_ns: u64,
        rules: &Rules,
        findings: &mut Findings,
    ) {
        self.settle_until(self.index(who), time_ns, false, rules, findings);
    }

    fn settle_until(
        &mut self,
        id: usize,
        time_ns: u64,
        even_an_instant: bool,
        rules: &Rules,
        findings: &mut Findings,
    ) {
        let Body {
            line,
            settled_ns,
            shape,
            who,
        } = self.bodies[id];
        let goes_on = settled_ns < time_ns || even_an_instant;
        if !goes_on {
            return;
        }
        let extent = self.pairs.extent(shape);
        let region =
            Region::swept(extent, line.at(settled_ns), line.at(time_ns)).grown(self.clearance_m);
        let mut found = std::mem::take(&mut self.found);
        found.clear();
        self.grid.near(region, &mut found);
        for &other in &found {
            if other == id {
                continue;
            }
            let other = &self.bodies[other];
            let since_ns = settled_ns.max(other.settled_ns);
            if since_ns < time_ns || even_an_instant && since_ns == time_ns {
                let pair = Pair {
                    who: (who, other.who),
                    shapes: (shape, other.shape),
                    from: line.at(since_ns) - other.line.at(since_ns),
                    to: line.at(time_ns) - other.line.at(time_ns),
                    span_ns: (since_ns, time_ns),
                };
                let moving = is_moving(&line) || is_moving(&other.line);
                self.pairs
                    .test(&pair, rules.apart(who, pair.who.1, moving), findings);
            }
        }
        found.clear();
        self.wall_grid.near(region, &mut found);
        let is_robots = rules.robot_of(who).is_some();
        let apart = if is_robots && is_moving(&line) {
            Apart::Clearance
        } else {
            Apart::Bare
        };
        for &wall in &found {
            let (wall_shape, at) = self.walls[wall];
            let pair = Pair {
                who: (who, Who::Wall(wall)),
                shapes: (shape, wall_shape),
                from: line.at(settled_ns) - at,
                to: line.at(time_ns) - at,
                span_ns: (settled_ns, time_ns),
            };
            self.pairs.test(&pair, apart, findings);
        }
        self.found = found;
        self.test_bounds(id, time_ns, apart, findings);
        self.bodies[id].settled_ns = time_ns;
    }

    /// The bounds are straight, so a body leaves them on its way only if it is outside at an end.
    fn test_bounds(&self, id: usize, time_ns: u64, apart: Apart, findings: &mut Findings) {
        let Body {
            line,
            settled_ns,
            shape,
            who,
        } = self.bodies[id];
        let (low, high) = self.pairs.extent(shape);
        let beyond = |time_ns| {
            let at = line.at(time_ns);
            (self.bounds.low - (at + low))
                .max()
                .max(((at + high) - self.bounds.high).max())
        };
        let (start, end) = (beyond(settled_ns), beyond(time_ns));
        let farthest = start.max(end);
        let margin = if apart == Apart::Clearance {
            self.clearance_m
        } else {
            0.0
        };
        let (kind, limit) = if farthest > OVERLAP_M {
            (Kind::Collision, OVERLAP_M)
        } else if farthest > OVERLAP_M - margin {
            (Kind::Clearance, OVERLAP_M - margin)
        } else {
            return;
        };
        // How far it is beyond is a convex function of time: where the straight line between its
        // ends crosses the limit is the crossing, or a little before where it rounds a corner.
        let part = if start > limit {
            0.0
        } else {
            (limit - start) / (end - start)
        };
        let pair = Pair {
            who: (who, Who::Bounds),
            shapes: (shape, shape),
            from: Vector2::zeros(),
            to: Vector2::zeros(),
            span_ns: (settled_ns, time_ns),
        };
        report(findings, kind, &pair, (part, 1.0), self.clearance_m);
    }

    /// Whether a robot was near an object at some time since it was last settled, and whether it
    /// is at `time_ns`: nearer than the clearance, or overlapping where the grasp is from below.
    pub(super) fn nearness(
        &mut self,
        robot: usize,
        object: usize,
        time_ns: u64,
        rules: &Rules,
    ) -> (bool, bool) {
        let (a, b) = (
            self.index(Who::Robot(robot)),
            self.index(Who::Object(object)),
        );
        let (a, b) = (&self.bodies[a], &self.bodies[b]);
        let since_ns = a.settled_ns.max(b.settled_ns).min(time_ns);
        let from = a.line.at(since_ns) - b.line.at(since_ns);
        let to = a.line.at(time_ns) - b.line.at(time_ns);
        let distance = if rules.lifts_from_below(object) || self.clearance_m > 0.0 {
            self.clearance_m - OVERLAP_M
        } else {
            return (false, false);
        };
        let meeting = self.pairs.meeting(a.shape, b.shape);
        let was = meeting.nearer_than(distance, from, to).is_some();
        (was, meeting.nearer_than(distance, to, to).is_some())
    }
}

fn is_moving(line: &Line) -> bool {
    matches!(line, Line::Moving(_))
}

/// Whose motion it is.
pub(super) fn body_of(motion: &Motion) -> Who {
    match motion.body {
        BodyKind::Robot => Who::Robot(motion.id),
        BodyKind::Object => Who::Object(motion.id),
    }
}
