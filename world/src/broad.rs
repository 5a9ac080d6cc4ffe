//! Broad phase: which grounded objects, which walls lie near a box. Never misses one, may name
//! some that are not near.
//!
//! Responsible for: keeping them by place (`scene::near`): grounded objects in the cell of their
//! centre, so that grasping and releasing allocate nothing; walls, which never move, in every cell
//! they touch. Not responsible for: whether they overlap.

use scene::near::{Cells, Near};
use scene::{Scene, Vec2};

pub(crate) use scene::near::Aabb;

use crate::objects::Touched;

/// No more things than this are gone through one by one, which takes less than finding cells.
const FEW: usize = 16;

/// Least size of a cell of objects, m.
const LEAST_OBJECT_CELL_M: f64 = 0.1;

/// A box that meets no other.
const NOWHERE: Aabb = Aabb {
    min: Vec2::new(f64::INFINITY, f64::INFINITY),
    max: Vec2::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
};

/// The grounded objects, by place.
#[derive(Clone, Debug)]
pub(crate) struct Ground {
    near: Near,
    /// Boxes of the objects around their centres.
    boxes: Vec<Aabb>,
    /// Their boxes where they lie; [`NOWHERE`] for those that do not.
    here: Vec<Aabb>,
    /// How far any object reaches from its centre.
    reach: Aabb,
    put_downs: u64,
    touched: Touched,
}

impl Ground {
    /// Each object at its place, if it is on the ground.
    pub(crate) fn with(scene: &Scene, place: impl Fn(usize) -> Option<Vec2>) -> Self {
        let boxes: Vec<Aabb> = scene.objects.iter().map(|o| Aabb::of(&o.shape)).collect();
        let nothing = Aabb::around(Vec2::zeros(), Vec2::zeros());
        let reach = boxes.iter().fold(nothing, |all, b| all.joined(*b));
        let cell_m = (reach.max - reach.min).max().max(LEAST_OBJECT_CELL_M);
        let mut ground = Self {
            near: Near::new(scene, boxes.len(), cell_m),
            here: vec![NOWHERE; boxes.len()],
            boxes,
            reach,
            put_downs: 0,
            touched: Touched::ALL,
        };
        for object in 0..scene.objects.len() {
            if let Some(at) = place(object) {
                ground.put(object, at);
            }
        }
        ground
    }

    /// Puts `object`, which is not on the ground, down at `at`.
    pub(crate) fn put(&mut self, object: usize, at: Vec2) {
        self.near.put(object, at);
        self.here[object] = self.boxes[object].at(at);
        self.touched.touch(object);
        self.put_downs += 1;
    }

    /// Another number whenever something has come to lie somewhere.
    pub(crate) const fn put_downs(&self) -> u64 {
        self.put_downs
    }

    /// Counts on from where `before`, the ground of another version of the scene, stopped.
    pub(crate) const fn comes_after(&mut self, before: &Self) {
        self.put_downs += before.put_downs + 1;
    }

    /// Takes `object` off the ground.
    pub(crate) fn take(&mut self, object: usize) {
        self.near.take(object);
        self.here[object] = NOWHERE;
        self.touched.touch(object);
    }

    /// Which objects may not lie where they lay.
    pub(crate) const fn touched(&mut self) -> &mut Touched {
        &mut self.touched
    }

    /// Where `object` lies on the ground.
    pub(crate) fn place(&self, object: usize) -> Option<Vec2> {
        self.near.place(object)
    }

    /// An object whose box meets `region` and for which `hit(object, place)` holds.
    pub(crate) fn find_near(
        &self,
        region: Aabb,
        mut hit: impl FnMut(usize, Vec2) -> bool,
    ) -> Option<usize> {
        if self.here.len() <= FEW {
            let mut is_hit = |o: usize| self.near.place(o).is_some_and(|at| hit(o, at));
            let is_met = |(o, here): (usize, &Aabb)| here.meets(&region) && is_hit(o);
            return self.here.iter().enumerate().position(is_met);
        }
        let wide = Aabb {
            min: region.min - self.reach.max,
            max: region.max - self.reach.min,
        };
        let is_met = |object: usize, at| self.here[object].meets(&region) && hit(object, at);
        self.near.find(wide, is_met)
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
        let mut lists = vec![Vec::new(); cells.count()];
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
        let mut is_met = |wall: usize| self.boxes[wall].meets(&region) && hit(wall);
        if self.boxes.len() <= FEW {
            return (0..self.boxes.len()).any(is_met);
        }
        self.cells.touched(region).any(|cell| {
            let here = self.starts[cell]..self.starts[cell + 1];
            self.walls[here].iter().any(|&wall| is_met(wall))
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{BELOW, room, room_text};

    /// With few objects, or with so many that they are kept in cells.
    fn scene(objects: u32) -> Scene {
        let homes = [[9.0, 0.5]];
        let objects: Vec<_> = (0..objects)
            .map(|i| {
                let (column, row) = (f64::from(i % 12), f64::from(i / 12));
                let (x, y) = (0.5 + 0.7 * column, 0.7 + 2.7 * row + 0.3 * (column % 4.0));
                [[x, y], [x, y + 1.0]]
            })
            .collect();
        room(&homes, &objects, BELOW, "")
    }

    /// As many walls as make cells worth while.
    fn pillars() -> Scene {
        let pillars = (0..FEW).map(|i| {
            let (x, y) = (1.0 + (i % 8) as f64, 2.0 + (i / 8) as f64);
            format!(
                "{{ box = [{x:.1}, {y:.1}, {:.1}, {:.1}] }}",
                x + 0.2,
                y + 0.7
            )
        });
        let walls = format!(
            "walls = [{}]\n[[robots]]",
            pillars.collect::<Vec<_>>().join(", ")
        );
        let text = room_text(&[[9.0, 0.5]], &[], BELOW, "").replacen("[[robots]]", &walls, 1);
        scene::parse(&text, "pillars.toml").unwrap()
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
            more in proptest::bool::ANY,
            taken in proptest::collection::vec(0_usize..12, 0..12),
            put in proptest::collection::vec((0_usize..12, 0.3..9.7, 0.3..5.7), 0..12),
        ) {
            let scene = scene(if more { 20 } else { 12 });
            let mut ground = Ground::with(&scene, |object| Some(scene.objects[object].start));
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
        fn no_wall_near_is_missed(
            x in -1.0..11.0, y in -1.0..7.0, size in 0.0..4.0, more in proptest::bool::ANY,
        ) {
            let scene = if more { pillars() } else { scene(1) };
            prop_assert_eq!(scene.walls.len() > FEW, more);
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
