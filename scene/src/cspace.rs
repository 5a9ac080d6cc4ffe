//! The configuration space of one class of bodies on the lattice: where it can be, which steps
//! it can take.
//!
//! Responsible for: answering that for the walls plus whatever was blocked, on the lattice by a
//! look-up and off it by exact tests.
//! Not responsible for: choosing the obstacles, searching paths (crate `planner`).
//!
//! Reused: after [`Occupancy::new`] nothing here allocates, within the capacity stated there.

use shm_types::capacity::MAX_PATH_POINTS;

use crate::body::{ClassId, ROBOT_ALONE};
use crate::geometry::{Region, Vec2, regions_overlap};
use crate::lattice::Connectivity;
use crate::raster::{EAST, NORTH, POINT, Raster};
use crate::scene::Scene;
use crate::shape::Shape;

/// Obstacles beyond objects and robots' granted paths that fit without allocation.
const SPARE_OBSTACLES: usize = 16;
/// Robots whose longest possible granted paths fit without allocation; more robots never all
/// have such paths at once.
const ROBOTS_WITH_LONG_PATHS: usize = 16;

/// One obstacle as it was entered.
#[derive(Clone, Debug)]
struct Obstacle {
    shape: Shape,
    from: Vec2,
    to: Vec2,
    clearance: bool,
}

/// Where a class of bodies can be.
#[derive(Clone, Debug)]
pub struct Occupancy {
    class: ClassId,
    raster: Raster,
    obstacles: Vec<Obstacle>,
    width: u32,
    pitch_m: f64,
    diagonal_m: f64,
    connectivity: Connectivity,
}

impl Occupancy {
    /// A configuration space with room for every object and every robot's granted path of the
    /// scene; a robot alone among the walls.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let robots = scene.homes.len();
        let paths = robots.min(ROBOTS_WITH_LONG_PATHS) * MAX_PATH_POINTS + robots;
        let capacity = scene.objects.len() + 2 * paths + SPARE_OBSTACLES;
        Self {
            class: ROBOT_ALONE,
            raster: scene.walls_only(ROBOT_ALONE).clone(),
            obstacles: Vec::with_capacity(capacity),
            width: scene.lattice.width,
            pitch_m: scene.lattice.pitch_m,
            diagonal_m: scene.lattice.pitch_m * std::f64::consts::SQRT_2,
            connectivity: scene.lattice.connectivity,
        }
    }

    /// Takes up another class of bodies, among the walls alone.
    pub fn reset(&mut self, scene: &Scene, class: ClassId) {
        self.class = class;
        self.raster
            .bits
            .copy_from_slice(&scene.walls_only(class).bits);
        self.obstacles.clear();
    }

    /// The class of bodies it is about.
    #[must_use]
    pub const fn class(&self) -> ClassId {
        self.class
    }

    /// Enters a standing obstacle; with or without the body's clearance.
    pub fn block(&mut self, scene: &Scene, shape: &Shape, at: Vec2, clearance: bool) {
        self.block_path(scene, shape, at, at, clearance);
    }

    /// Enters all that a shape covers moving straight from `from` to `to`, with the body's
    /// clearance.
    pub fn block_swept(&mut self, scene: &Scene, shape: &Shape, from: Vec2, to: Vec2) {
        self.block_path(scene, shape, from, to, true);
    }

    fn block_path(&mut self, scene: &Scene, shape: &Shape, from: Vec2, to: Vec2, clearance: bool) {
        self.raster.block(
            &scene.lattice,
            scene.body(self.class),
            &Region::swept(shape, from, to),
            clearance,
        );
        self.obstacles.push(Obstacle {
            shape: shape.clone(),
            from,
            to,
            clearance,
        });
    }

    /// Whether the body can be at a cell.
    #[must_use]
    #[inline]
    pub fn is_free(&self, cell: u32) -> bool {
        self.raster.bits[cell as usize] & POINT == 0
    }

    /// Calls `visit` with each cell one free step away, and the step's length in metres:
    /// east, north, west, south, then the diagonals counter-clockwise from the north-east. A
    /// diagonal is free only if both ways around its corner are.
    #[inline]
    pub fn for_each_step(&self, cell: u32, mut visit: impl FnMut(u32, f64)) {
        let steps = self.steps(cell);
        let offsets = self.offsets();
        for (direction, offset) in offsets.iter().enumerate() {
            if steps >> direction & 1 == 1 {
                let length = if direction < 4 {
                    self.pitch_m
                } else {
                    self.diagonal_m
                };
                visit(cell.wrapping_add_signed(*offset), length);
            }
        }
    }

    /// Cell offsets of the directions, in the order of [`Self::steps`].
    #[must_use]
    #[inline]
    pub const fn offsets(&self) -> [i32; 8] {
        let width = self.width as i32;
        [
            1,
            width,
            -1,
            -width,
            width + 1,
            width - 1,
            -width - 1,
            -width + 1,
        ]
    }

    /// The free steps from a cell as bits, in the order of [`Self::for_each_step`]: E, N, W, S,
    /// NE, NW, SW, SE.
    #[must_use]
    #[inline]
    pub fn steps(&self, cell: u32) -> u8 {
        let bits = &self.raster.bits;
        let width = self.width as usize;
        let here = cell as usize;
        if self.connectivity == Connectivity::Eight && is_open(bits, width, here) {
            return u8::MAX;
        }
        let own = bits[here];
        if own & POINT != 0 {
            return 0;
        }
        // Steps that leave the lattice to the east and the north are blocked. So at the start of
        // a row, where the byte before belongs to the end of another, that byte says so too.
        let west = if here > 0 { bits[here - 1] } else { u8::MAX };
        let south = if here >= width {
            bits[here - width]
        } else {
            u8::MAX
        };
        let free = |byte: u8, bit: u8| byte & bit == 0;
        let (e, n) = (free(own, EAST), free(own, NORTH));
        let (w, s) = (free(west, EAST), free(south, NORTH));
        let mut steps = u8::from(e) | u8::from(n) << 1 | u8::from(w) << 2 | u8::from(s) << 3;
        if self.connectivity == Connectivity::Four {
            return steps;
        }
        // Each diagonal: both ways around its corner. What meets it but neither of these would have
        // to lie between them, and nothing is as small: a cell is no wider than the narrowest body.
        if e && n && free(bits[here + 1], NORTH) && free(bits[here + width], EAST) {
            steps |= 1 << 4;
        }
        if w && n && free(west, NORTH) && free(bits[here + width - 1], EAST) {
            steps |= 1 << 5;
        }
        if w && s {
            let corner = bits[here - width - 1];
            if free(corner, NORTH | EAST) {
                steps |= 1 << 6;
            }
        }
        if e && s {
            let corner = bits[here - width + 1];
            if free(corner, NORTH) && free(south, EAST) {
                steps |= 1 << 7;
            }
        }
        steps
    }

    /// Whether the body can move straight from `from` to `to`: exact, on the lattice or off it,
    /// against the walls and all that was blocked.
    #[must_use]
    pub fn straight_is_free(&self, scene: &Scene, from: Vec2, to: Vec2) -> bool {
        let (low, high) = scene.bounds;
        let within = |p: Vec2| low.x <= p.x && low.y <= p.y && p.x <= high.x && p.y <= high.y;
        if !within(from) || !within(to) {
            return false;
        }
        let meets = |shape: &Shape, at: Vec2, at_to: Vec2, clearance: bool| {
            scene.body(self.class).parts.iter().any(|part| {
                let moving =
                    Region::swept(part.shape(clearance), from + part.offset, to + part.offset);
                regions_overlap(&moving, &Region::swept(shape, at, at_to))
            })
        };
        !scene
            .walls
            .iter()
            .any(|(wall, at)| meets(wall, *at, *at, true))
            && !self
                .obstacles
                .iter()
                .any(|o| meets(&o.shape, o.from, o.to, o.clearance))
    }

    /// Whether the body can be at a point: exact, on the lattice or off it.
    #[must_use]
    pub fn at_is_free(&self, scene: &Scene, at: Vec2) -> bool {
        self.straight_is_free(scene, at, at)
    }
}

/// Whether nothing at all is blocked at a cell and the eight around it: then all of these are on
/// the lattice, since steps that leave it are blocked. Most cells are like that.
#[inline]
fn is_open(bits: &[u8], width: usize, here: usize) -> bool {
    if here <= width || here + width + 3 > bits.len() {
        return false;
    }
    let around = |middle: usize| {
        let word: [u8; 4] = [bits[middle - 1], bits[middle], bits[middle + 1], 0];
        u32::from_le_bytes(word)
    };
    around(here - width) | around(here) | around(here + width) == 0
}
