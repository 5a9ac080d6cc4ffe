//! Broad phase: uniform grids over the room, so that a test looks only at what is near.
//!
//! Responsible for: bounding boxes; which grounded objects, which walls lie near a box. Never
//! misses one, may name some that are not near. Not responsible for: whether they overlap.
//!
//! Grounded objects lie in the cell of their centre, in lists threaded through one array, so
//! grasping and releasing allocate nothing; walls never move and lie in every cell they touch.

use scene::{Scene, Shape, Vec2};

/// Most cells along one axis; larger rooms get larger cells.
const MAX_CELLS_PER_AXIS: usize = 256;
const NIL: u32 = u32::MAX;

/// An axis-aligned box, closed, world frame or relative to a body's centre, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Aabb {
    pub(crate) min: Vec2,
    pub(crate) max: Vec2,
}

impl Aabb {
    /// The box of `shape` around its own centre.
    pub(crate) fn of(shape: &Shape) -> Self {
        let (min, max) = shape.extent();
        Self { min, max }
    }

    /// The box of two points.
    pub(crate) fn around(a: Vec2, b: Vec2) -> Self {
        Self {
            min: a.inf(&b),
            max: a.sup(&b),
        }
    }

    pub(crate) fn joined(self, other: Self) -> Self {
        Self {
            min: self.min.inf(&other.min),
            max: self.max.sup(&other.max),
        }
    }

    /// This box, centred at `at`.
    pub(crate) fn at(self, at: Vec2) -> Self {
        Self {
            min: self.min + at,
            max: self.max + at,
        }
    }

    /// What a body of box `body` covers while its centre is anywhere in this box.
    pub(crate) fn swept_by(self, body: Self) -> Self {
        Self {
            min: self.min + body.min,
            max: self.max + body.max,
        }
    }

    pub(crate) fn meets(&self, other: &Self) -> bool {
        self.min.x <= other.max.x
            && other.min.x <= self.max.x
            && self.min.y <= other.max.y
            && other.min.y <= self.max.y
    }
}

/// How the room is cut into cells.
#[derive(Clone, Debug)]
struct Cells {
    origin: Vec2,
    cell_m: f64,
    columns: usize,
    rows: usize,
}

impl Cells {
    fn over(scene: &Scene, least_cell_m: f64) -> Self {
        let (min, max) = scene.bounds;
        let size = max - min;
        #[expect(clippy::cast_precision_loss, reason = "a small constant")]
        let cell_m = least_cell_m.max(size.max() / MAX_CELLS_PER_AXIS as f64);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 1 and the most cells per axis"
        )]
        let count = |length_m: f64| ((length_m / cell_m) as usize + 1).min(MAX_CELLS_PER_AXIS + 1);
        Self {
            origin: min,
            cell_m,
            columns: count(size.x),
            rows: count(size.y),
        }
    }

    const fn len(&self) -> usize {
        self.columns * self.rows
    }

    fn column_row(&self, at: Vec2) -> (usize, usize) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "float casts saturate; what lies outside belongs to the nearest cell"
        )]
        let index =
            |offset_m: f64, count: usize| ((offset_m / self.cell_m) as usize).min(count - 1);
        let offset = at - self.origin;
        (index(offset.x, self.columns), index(offset.y, self.rows))
    }

    fn cell(&self, at: Vec2) -> usize {
        let (column, row) = self.column_row(at);
        row * self.columns + column
    }

    /// The cells that `region` touches.
    fn touched(&self, region: Aabb) -> impl Iterator<Item = usize> + use<> {
        let (left, bottom) = self.column_row(region.min);
        let (right, top) = self.column_row(region.max);
        let columns = self.columns;
        (bottom..=top).flat_map(move |row| (left..=right).map(move |column| row * columns + column))
    }
}

/// The grounded objects, by place.
#[derive(Clone, Debug)]
pub(crate) struct Ground {
    cells: Cells,
    /// Boxes of the objects around their centres.
    boxes: Vec<Aabb>,
    /// How far any object reaches from its centre.
    reach: Aabb,
    heads: Vec<u32>,
    next: Vec<u32>,
    /// Where each lies, if it does.
    places: Vec<Option<Vec2>>,
}

impl Ground {
    /// All objects at their starts.
    pub(crate) fn new(scene: &Scene) -> Self {
        let boxes: Vec<Aabb> = scene.objects.iter().map(|o| Aabb::of(&o.shape)).collect();
        let nothing = Aabb::around(Vec2::zeros(), Vec2::zeros());
        let reach = boxes.iter().fold(nothing, |all, b| all.joined(*b));
        let cells = Cells::over(scene, (reach.max - reach.min).max().max(0.1));
        let mut ground = Self {
            heads: vec![NIL; cells.len()],
            next: vec![NIL; boxes.len()],
            places: vec![None; boxes.len()],
            cells,
            boxes,
            reach,
        };
        for (object, spec) in scene.objects.iter().enumerate() {
            ground.put(object, spec.start);
        }
        ground
    }

    /// Puts `object`, which is not on the ground, down at `at`.
    pub(crate) fn put(&mut self, object: usize, at: Vec2) {
        let cell = self.cells.cell(at);
        self.next[object] = self.heads[cell];
        #[expect(
            clippy::cast_possible_truncation,
            reason = "ids fit the wire's 32 bits"
        )]
        {
            self.heads[cell] = object as u32;
        }
        self.places[object] = Some(at);
    }

    /// Takes `object` off the ground.
    pub(crate) fn take(&mut self, object: usize) {
        let Some(at) = self.places[object].take() else {
            return;
        };
        let cell = self.cells.cell(at);
        let mut here = self.heads[cell];
        if here as usize == object {
            self.heads[cell] = self.next[object];
            return;
        }
        while here != NIL {
            let next = self.next[here as usize];
            if next as usize == object {
                self.next[here as usize] = self.next[object];
                return;
            }
            here = next;
        }
    }

    /// Where `object` lies on the ground.
    pub(crate) fn place(&self, object: usize) -> Option<Vec2> {
        self.places[object]
    }

    /// An object whose box meets `region` and for which `hit(object, place)` holds.
    pub(crate) fn find_near(
        &self,
        region: Aabb,
        mut hit: impl FnMut(usize, Vec2) -> bool,
    ) -> Option<usize> {
        let wide = Aabb {
            min: region.min - self.reach.max,
            max: region.max - self.reach.min,
        };
        for cell in self.cells.touched(wide) {
            let mut here = self.heads[cell];
            while here != NIL {
                let object = here as usize;
                if let Some(at) = self.places[object]
                    && self.boxes[object].at(at).meets(&region)
                    && hit(object, at)
                {
                    return Some(object);
                }
                here = self.next[object];
            }
        }
        None
    }
}

/// The walls, by place.
#[derive(Clone, Debug)]
pub(crate) struct Walls {
    cells: Cells,
    boxes: Vec<Aabb>,
    /// `walls[starts[c]..starts[c + 1]]` touch cell `c`.
    starts: Vec<usize>,
    walls: Vec<usize>,
}

/// Least size of a cell of walls, m.
const WALL_CELL_M: f64 = 0.5;

impl Walls {
    pub(crate) fn new(scene: &Scene) -> Self {
        let cells = Cells::over(scene, WALL_CELL_M);
        let boxes: Vec<Aabb> = scene
            .walls
            .iter()
            .map(|(shape, at)| Aabb::of(shape).at(*at))
            .collect();
        let mut lists = vec![Vec::new(); cells.len()];
        for (wall, region) in boxes.iter().enumerate() {
            for cell in cells.touched(*region) {
                lists[cell].push(wall);
            }
        }
        let mut starts = vec![0];
        let mut walls = Vec::new();
        for list in lists {
            walls.extend(list);
            starts.push(walls.len());
        }
        Self {
            cells,
            boxes,
            starts,
            walls,
        }
    }

    /// Whether `hit(wall)` holds for any wall whose box meets `region`. A wall may be asked about
    /// more than once.
    pub(crate) fn any_near(&self, region: Aabb, mut hit: impl FnMut(usize) -> bool) -> bool {
        self.cells.touched(region).any(|cell| {
            self.walls[self.starts[cell]..self.starts[cell + 1]]
                .iter()
                .any(|&wall| self.boxes[wall].meets(&region) && hit(wall))
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{BELOW, room};

    fn scene() -> Scene {
        let homes = [[9.0, 0.5]];
        let objects: Vec<_> = (0..12)
            .map(|i| {
                let (x, y) = (0.5 + 0.7 * f64::from(i), 1.0 + 0.3 * f64::from(i % 4));
                [[x, y], [x, y + 2.0]]
            })
            .collect();
        room(&homes, &objects, BELOW, "")
    }

    fn all(scene: &Scene, ground: &Ground, region: Aabb) -> Vec<usize> {
        (0..scene.objects.len())
            .filter(|&o| {
                let shape = Aabb::of(&scene.objects[o].shape);
                ground
                    .place(o)
                    .is_some_and(|at| shape.at(at).meets(&region))
            })
            .collect()
    }

    proptest! {
        #[test]
        fn none_near_is_missed(
            x in -1.0..11.0, y in -1.0..7.0, width in 0.0..4.0, height in 0.0..4.0,
            taken in proptest::collection::vec(0_usize..12, 0..12),
            put in proptest::collection::vec((0_usize..12, 0.3..9.7, 0.3..5.7), 0..12),
        ) {
            let scene = scene();
            let mut ground = Ground::new(&scene);
            for object in taken {
                ground.take(object);
                prop_assert_eq!(ground.place(object), None);
            }
            for (object, px, py) in put {
                ground.take(object);
                ground.put(object, Vec2::new(px, py));
            }
            let corner = Vec2::new(x, y);
            let region = Aabb::around(corner, corner + Vec2::new(width, height));
            let mut found = Vec::new();
            let stopped = ground.find_near(region, |object, _| {
                found.push(object);
                false
            });
            found.sort_unstable();
            prop_assert_eq!(stopped, None);
            prop_assert_eq!(found, all(&scene, &ground, region));
        }

        #[test]
        fn no_wall_near_is_missed(x in -1.0..11.0, y in -1.0..7.0, size in 0.0..4.0) {
            let scene = scene();
            let walls = Walls::new(&scene);
            let corner = Vec2::new(x, y);
            let region = Aabb::around(corner, corner + Vec2::new(size, size));
            for wall in 0..scene.walls.len() {
                let (shape, at) = &scene.walls[wall];
                let near = Aabb::of(shape).at(*at).meets(&region);
                prop_assert_eq!(walls.any_near(region, |w| w == wall), near);
            }
        }
    }
}
