//! Which cells of a small room bodies keep each other out of.
//!
//! Responsible for: looking it up, for objects at rest and for robots, cell by cell.
//! Not responsible for: walls (`ground`), what robots do (`shortest`).

use scene::{ClassId, ROBOT_ALONE, Scene};

use crate::anytime::ground::{Ground, Offset, offsets_of_resting};

/// As many fit into a set, and into a byte beside one value for none.
pub(super) const MOST_CELLS: usize = 255;

/// A set of cells.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cells([u64; 4]);

/// By where a body is: the cells at which another one would overlap it.
type Table = Vec<Cells>;

/// The tables of all pairs of bodies.
pub(super) struct Closed {
    classes: usize,
    objects: usize,
    /// By class that is kept out, then object at rest.
    by_objects: Vec<Table>,
    /// By class that is kept out, then class of the other robot.
    by_robots: Vec<Table>,
}

impl Cells {
    #[inline]
    pub(super) fn has(&self, cell: u8) -> bool {
        self.0[usize::from(cell / 64)] >> (cell % 64) & 1 == 1
    }
}

impl Closed {
    /// For a room of at most [`MOST_CELLS`] cells.
    pub(super) fn new(scene: &Scene, ground: &Ground) -> Self {
        let (classes, objects) = (ground.classes, scene.objects.len());
        let of_object = |pair: usize| {
            let (kept, spec) = (pair / objects, &scene.objects[pair % objects]);
            if kept == ROBOT_ALONE.0 && spec.pass_under {
                return table(ground, &[]);
            }
            let [body, there] = [kept, spec.class.0].map(|class| scene.body(ClassId(class)));
            table(
                ground,
                &offsets_of_resting(body, there, scene.lattice.pitch_m),
            )
        };
        let of_robot =
            |pair: usize| table(ground, &ground.mask(pair / classes, pair % classes).all);
        Self {
            classes,
            objects,
            by_objects: (0..classes * objects).map(of_object).collect(),
            by_robots: (0..classes * classes).map(of_robot).collect(),
        }
    }

    /// Where objects that rest at these places, by object, leave no room for a body; one that is
    /// held is at none.
    #[inline]
    pub(super) fn by_objects(&self, kept: usize, places: &[u8]) -> Cells {
        let mut closed = Cells::default();
        let tables = &self.by_objects[kept * self.objects..];
        for (table, &place) in tables.iter().zip(places) {
            let cells = table.get(usize::from(place)).copied().unwrap_or_default();
            for (all, more) in closed.0.iter_mut().zip(cells.0) {
                *all |= more;
            }
        }
        closed
    }

    /// Where a robot leaves no room for another one.
    #[inline]
    pub(super) fn by_robot(&self, kept: usize, there: usize, cell: u8) -> &Cells {
        &self.by_robots[kept * self.classes + there][usize::from(cell)]
    }
}

fn table(ground: &Ground, offsets: &[Offset]) -> Table {
    let cells = (0..ground.points() as u32).map(|cell| {
        let at = ground.xy(cell);
        let mut closed = Cells::default();
        for cell in offsets
            .iter()
            .filter_map(|&offset| ground.moved(at, offset))
        {
            closed.0[cell as usize / 64] |= 1 << (cell % 64);
        }
        closed
    });
    cells.collect()
}
