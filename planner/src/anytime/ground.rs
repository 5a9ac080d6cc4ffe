//! The room as the planner of schedules sees it: bodies on the lattice, and when two of them
//! would meet.
//!
//! Responsible for: which steps the walls leave to each class of bodies, which offsets between two
//! bodies mean overlap, distances to a place with the walls alone, the unit of time.
//! Not responsible for: who is where when (`timeline`).
//!
//! Terms: a *mask* is the set of offsets, in lattice steps, at which a body of one class overlaps
//! one of another. Times are whole units of [`STRAIGHT`] a straight step.

#[cfg(test)]
mod tests;

use std::cell::Cell;
use std::collections::HashMap;
use std::rc::Rc;

use scene::{
    Body, ClassId, Lattice, Occupancy, ROBOT_ALONE, Scene, Settings, Shape, Vec2, overlap,
};

use crate::anytime::distances::{Distances, Walls};
use crate::anytime::track::Place;
use crate::frontier::{DIAGONAL, STRAIGHT};
use crate::search::DIRECTIONS;

/// A time, in units of which a straight step takes [`STRAIGHT`].
pub(crate) type Time = u32;
/// After all.
pub(crate) const EVER: Time = Time::MAX;

/// Ticks that a grip takes beyond its own duration at most: it begins with a tick, and robots stop
/// within one.
const TICKS_PER_GRIP: f64 = 1.0;

/// An offset in lattice steps.
pub(crate) type Offset = (i32, i32);

/// Offsets from a body of one class at which one of another overlaps it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mask {
    pub(crate) all: Vec<Offset>,
    /// For each direction: offsets from the end of a step that were none from its start.
    pub(crate) entered: [Vec<Offset>; 8],
    /// For each direction: offsets from the start of a step that are none from its end.
    pub(crate) left: [Vec<Offset>; 8],
    /// For each diagonal: offsets from the start, of what is swept on the way only.
    pub(crate) swept: [Vec<Offset>; 8],
    /// The set as a square of this half width.
    inside: Vec<bool>,
    half: i32,
}

/// Distances that are kept although nobody asks for them any more, 4 bytes each.
const MOST_DISTANCES_KEPT: usize = 1 << 24;

/// Distances to one place, walls only.
pub(crate) type Field = Rc<Distances>;

/// The static part of what is planned with.
pub(crate) struct Ground {
    lattice: Lattice,
    pub(crate) width: i32,
    pub(crate) height: i32,
    pub(crate) classes: usize,
    walls: Vec<Rc<Walls>>,
    /// What stands there for ever and is no wall of the scene.
    pub(crate) obstacles: Vec<(Shape, Vec2)>,
    /// By class that is kept away, then class that is there.
    masks: Vec<Mask>,
    fields: HashMap<(usize, u32), Field>,
    /// So many of these are kept, even if nobody asks for them any more.
    most_fields: usize,
    pub(crate) offsets: [i32; 8],
    /// Class of a robot that carries each object.
    carrying: Vec<Vec<usize>>,
    /// Robot's centre minus object's while grasped, m.
    grasps: Vec<Vec<Vec2>>,
    /// Seconds in a unit of time.
    pub(crate) second_per_unit: f64,
    pub(crate) grasp: Time,
    pub(crate) release: Time,
    /// Lattice points that floods have come to.
    flooded: Rc<Cell<u64>>,
}

impl Ground {
    /// With what stands where robots are gone, beside the walls.
    pub(crate) fn new(scene: &Scene, settings: &Settings, obstacles: Vec<(Shape, Vec2)>) -> Self {
        let classes = scene.class_count();
        let walls: Vec<Rc<Walls>> = (0..classes)
            .map(|class| {
                let mut walls = Occupancy::new(scene);
                walls.reset(scene, ClassId(class));
                for (shape, at) in &obstacles {
                    walls.block(scene, shape, *at, true);
                }
                Rc::new(Walls::new(&scene.lattice, walls))
            })
            .collect();
        let second_per_unit =
            scene.lattice.pitch_m / scene.robot.speed_m_per_s / f64::from(STRAIGHT);
        let tick_s = settings.tick_ns as f64 * 1e-9;
        let units = |ns: u64| {
            let ticks = (ns as f64 / settings.tick_ns as f64).ceil() + TICKS_PER_GRIP;
            (ticks * tick_s / second_per_unit).ceil() as Time
        };
        let masks = (0..classes * classes)
            .map(|pair| {
                let (kept, there) = (pair / classes, pair % classes);
                let pitch_m = scene.lattice.pitch_m;
                let body = |class| scene.body(ClassId(class));
                Mask::of(offsets_of(body(kept), body(there), pitch_m))
            })
            .collect();
        let mut ground = Self {
            lattice: scene.lattice.clone(),
            width: scene.lattice.width as i32,
            height: scene.lattice.height as i32,
            classes,
            offsets: walls[ROBOT_ALONE.0].steps.offsets(),
            grasps: (scene.objects.iter())
                .map(|object| object.grasps.iter().map(|grasp| grasp.offset).collect())
                .collect(),
            carrying: (scene.objects.iter())
                .map(|object| object.grasps.iter().map(|grasp| grasp.class.0).collect())
                .collect(),
            walls,
            obstacles,
            masks,
            fields: HashMap::new(),
            most_fields: 0,
            second_per_unit,
            grasp: units(scene.robot.grasp_ns),
            release: units(scene.robot.release_ns),
            flooded: Rc::default(),
        };
        if !scene.lattice.exact {
            ground.leave_margins();
        }
        ground
    }

    /// Robots stop beside the lattice, up to a step from where they are planned to be: they keep
    /// others that much further away.
    pub(crate) fn leave_margins(&mut self) {
        for mask in &mut self.masks {
            *mask = Mask::of(grown(&mask.all));
        }
    }

    pub(crate) fn points(&self) -> usize {
        (self.width * self.height) as usize
    }

    /// In how many ways an object can be held.
    pub(crate) fn grasps(&self, object: usize) -> u8 {
        self.grasps[object].len() as u8
    }

    /// Class of a robot that carries an object by one of its grasps.
    #[inline]
    pub(crate) fn carrying(&self, object: usize, by: u8) -> usize {
        self.carrying[object][by as usize]
    }

    /// Where a robot stands that holds an object by the grasp of this place, m.
    pub(crate) fn stand(&self, object: usize, place: &Place) -> Vec2 {
        place.at + self.grasps[object][place.by as usize]
    }

    /// Where a class of bodies can be among the walls alone.
    #[inline]
    pub(crate) fn walls(&self, class: usize) -> &Occupancy {
        &self.walls[class].steps
    }

    /// What a body of class `there` keeps one of class `kept` away from.
    #[inline]
    pub(crate) fn mask(&self, kept: usize, there: usize) -> &Mask {
        &self.masks[kept * self.classes + there]
    }

    /// The cells that a body of class `there` at a cell keeps one of class `kept` away from.
    pub(crate) fn kept_away(&self, kept: usize, there: usize, cell: u32) -> Vec<u32> {
        let at = self.xy(cell);
        let offsets = &self.mask(kept, there).all;
        (offsets.iter().filter_map(|&offset| self.moved(at, offset))).collect()
    }

    /// Where a cell is, m.
    pub(crate) fn at(&self, cell: u32) -> Vec2 {
        self.lattice.at(cell)
    }

    /// Whether two bodies overlap.
    pub(crate) fn meet(&self, kept: usize, at: u32, there: usize, other: u32) -> bool {
        self.mask(kept, there).has(self.offset(at, other))
    }

    /// From one cell to another.
    #[inline]
    pub(crate) fn offset(&self, at: u32, from: u32) -> Offset {
        let (a, b) = (self.xy(at), self.xy(from));
        (a.0 - b.0, a.1 - b.1)
    }

    #[inline]
    pub(crate) fn xy(&self, cell: u32) -> Offset {
        (cell as i32 % self.width, cell as i32 / self.width)
    }

    /// The cell at an offset from another, if it is on the lattice.
    #[inline]
    pub(crate) fn moved(&self, (x, y): Offset, (dx, dy): Offset) -> Option<u32> {
        let (x, y) = (x + dx, y + dy);
        ((0..self.width).contains(&x) && (0..self.height).contains(&y))
            .then(|| (y * self.width + x) as u32)
    }

    /// Cells at which a body of class `kept` would overlap a shape that stands at `at`; with or
    /// without the body's clearance.
    pub(crate) fn around(
        &self,
        scene: &Scene,
        kept: usize,
        shape: &Shape,
        at: Vec2,
        clearance: bool,
    ) -> Vec<u32> {
        let body = scene.body(ClassId(kept));
        let reach_m = reach_of(body) + shape_reach(shape);
        let lattice = &scene.lattice;
        let index = |m: f64, origin: f64, count: i32| {
            ((m - origin) / lattice.pitch_m).clamp(0.0, f64::from(count - 1))
        };
        let x0 = index(at.x - reach_m, lattice.origin.x, self.width).floor() as i32;
        let x1 = index(at.x + reach_m, lattice.origin.x, self.width).ceil() as i32;
        let y0 = index(at.y - reach_m, lattice.origin.y, self.height).floor() as i32;
        let y1 = index(at.y + reach_m, lattice.origin.y, self.height).ceil() as i32;
        let mut cells = Vec::new();
        for y in y0..=y1 {
            for x in x0..=x1 {
                let cell = (y * self.width + x) as u32;
                if body.overlaps(lattice.at(cell), clearance, shape, at) {
                    cells.push(cell);
                }
            }
        }
        cells
    }

    /// The lattice point by which bodies of these classes come to a place that may lie beside the
    /// lattice, but none of these sorted cells; none if there is none.
    pub(crate) fn entry(
        &self,
        scene: &Scene,
        classes: &[usize],
        at: Vec2,
        but: &[u32],
    ) -> Option<u32> {
        if let Some(cell) = scene.lattice.cell(at) {
            let free = classes.iter().all(|&class| self.walls(class).is_free(cell));
            return free.then_some(cell);
        }
        let joins = |cell: &u32| {
            let end = scene.lattice.at(*cell);
            classes.iter().all(|&class| {
                let walls = self.walls(class);
                walls.is_free(*cell) && walls.straight_is_free(scene, at, end)
            }) && but.binary_search(cell).is_err()
        };
        let far = |cell: &u32| (scene.lattice.at(*cell) - at).norm();
        let near = scene.lattice.around(at).filter(joins);
        near.min_by(|a, b| far(a).total_cmp(&far(b)))
    }

    /// Distances to `to` for a class of bodies, walls only; each is worked out once, unless there
    /// are too many of them.
    pub(crate) fn field(&mut self, class: usize, to: u32) -> Field {
        if self.fields.len() > self.most_fields {
            self.fields.retain(|_, field| Rc::strong_count(field) > 1);
            self.most_fields = (2 * self.fields.len()).max(MOST_DISTANCES_KEPT / self.points());
        }
        let field = self.fields.entry((class, to)).or_insert_with(|| {
            let walls = Rc::clone(&self.walls[class]);
            Rc::new(Distances::new(walls, to, Rc::clone(&self.flooded)))
        });
        Rc::clone(field)
    }

    /// Lattice points that floods have come to.
    pub(crate) fn flooded(&self) -> u64 {
        self.flooded.get()
    }

    pub(crate) fn time(&self, s: f64) -> Time {
        (s / self.second_per_unit) as Time
    }

    pub(crate) fn seconds(&self, time: Time) -> f64 {
        f64::from(time) * self.second_per_unit
    }
}

/// How long a step in a direction takes.
#[inline]
pub(crate) const fn duration(direction: usize) -> Time {
    if direction < 4 { STRAIGHT } else { DIAGONAL }
}

/// Offsets from where a robot grasps an object at which a body overlaps that object at rest.
pub(crate) fn offsets_of_resting(kept: &Body, resting: &Body, pitch_m: f64) -> Vec<Offset> {
    // A robot with an object has the object for its second part.
    let object = Body {
        parts: resting.parts[1..].to_vec(),
    };
    offsets_of(kept, &object, pitch_m)
}

/// Offsets at which one body overlaps another.
fn offsets_of(kept: &Body, there: &Body, pitch_m: f64) -> Vec<Offset> {
    let steps = ((reach_of(kept) + reach_of(there)) / pitch_m).ceil() as i32;
    let mut all = Vec::new();
    for dy in -steps..=steps {
        for dx in -steps..=steps {
            let offset = Vec2::new(f64::from(dx), f64::from(dy)) * pitch_m;
            let meets = kept.parts.iter().any(|part| {
                there.parts.iter().any(|other| {
                    overlap(&part.grown, offset + part.offset, &other.bare, other.offset)
                })
            });
            if meets {
                all.push((dx, dy));
            }
        }
    }
    all
}

/// These offsets and all next to them.
fn grown(offsets: &[Offset]) -> Vec<Offset> {
    let around =
        |&(dx, dy): &Offset| (-1..=1).flat_map(move |y| (-1..=1).map(move |x| (dx + x, dy + y)));
    let mut all: Vec<Offset> = offsets.iter().flat_map(around).collect();
    all.sort_unstable();
    all.dedup();
    all
}

impl Mask {
    /// Whether an offset is in it.
    #[inline]
    pub(crate) fn has(&self, (dx, dy): Offset) -> bool {
        let half = self.half;
        dx.abs() <= half
            && dy.abs() <= half
            && self.inside[((dy + half) * (2 * half + 1) + dx + half) as usize]
    }

    pub(crate) fn of(all: Vec<Offset>) -> Self {
        let farthest = |(dx, dy): &Offset| dx.abs().max(dy.abs());
        let steps = all.iter().map(farthest).max().unwrap_or(0);
        let side = 2 * steps + 1;
        let mut inside = vec![false; (side * side) as usize];
        for (dx, dy) in &all {
            inside[((dy + steps) * side + dx + steps) as usize] = true;
        }
        let mut mask = Self {
            inside,
            half: steps,
            ..Self::default()
        };
        let whole = mask.clone();
        let has = |offset| whole.has(offset);
        for (direction, &(sx, sy)) in DIRECTIONS.iter().enumerate() {
            // An offset from the start is one less the step from the end.
            let entered = all.iter().filter(|(dx, dy)| !has((dx + sx, dy + sy)));
            mask.entered[direction] = entered.copied().collect();
            let left = all.iter().filter(|(dx, dy)| !has((dx - sx, dy - sy)));
            mask.left[direction] = left.copied().collect();
            if sx != 0 && sy != 0 {
                let mut swept: Vec<Offset> = all
                    .iter()
                    .flat_map(|(dx, dy)| [(dx + sx, *dy), (*dx, dy + sy)])
                    .filter(|&(dx, dy)| !has((dx, dy)) && !has((dx - sx, dy - sy)))
                    .collect();
                swept.sort_unstable();
                swept.dedup();
                mask.swept[direction] = swept;
            }
        }
        mask.all = all;
        mask
    }
}

/// How far a body reaches from the robot's centre along an axis at most, m.
fn reach_of(body: &Body) -> f64 {
    let reach = |part: &scene::Part| part.offset.amax() + shape_reach(&part.grown);
    body.parts.iter().map(reach).fold(0.0, f64::max)
}

fn shape_reach(shape: &Shape) -> f64 {
    let (low, high) = shape.extent();
    low.amax().max(high.amax())
}
