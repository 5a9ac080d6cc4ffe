//! The first piece of a path: what a robot asks for after a look.
//!
//! Responsible for: cutting a path at the look-ahead.
//! Not responsible for: the path, or whether it is granted.
//! Source: §III.D (look, plan, move along the path, look again); rule 20.

use scene::{Lattice, Vec2, point};
use shm_types::{PathRequest, Point, StateHash, capacity::MAX_PATH_POINTS};

/// Rounding errors forgiven when steps are counted, as a part of a step.
const STEP_TOLERANCE: f64 = 1e-6;

/// The first piece of a path, from the place it starts at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ahead {
    count: usize,
    points: [Point; MAX_PATH_POINTS],
}

impl Ahead {
    /// No path.
    pub(crate) const NOWHERE: Self = Self {
        count: 0,
        points: [Point::new(0.0, 0.0); MAX_PATH_POINTS],
    };

    /// Whether there is no motion in it.
    pub(crate) fn stays(&self) -> bool {
        self.count < 2
    }

    /// Where it starts.
    pub(crate) fn start(&self) -> Option<Vec2> {
        (self.count > 0).then(|| scene::vec(self.points[0]))
    }

    /// The request for it.
    pub(crate) fn request(&self, id: u32) -> PathRequest {
        PathRequest {
            id,
            count: self.count as u32,
            points: self.points,
        }
    }

    /// Takes the first `length_m` of `path` (corner points), rounded up to a whole step of the
    /// lattice, so that the next look starts on the lattice again. A piece that joins a place off
    /// the lattice is taken whole.
    pub(crate) fn cut(&mut self, path: &[Vec2], lattice: &Lattice, length_m: f64) {
        *self = Self::NOWHERE;
        let Some(first) = path.first() else {
            return;
        };
        self.push(*first);
        let mut left_m = length_m;
        for piece in path.windows(2) {
            if self.count == MAX_PATH_POINTS {
                return;
            }
            let (end, used_m) = cut_piece(piece[0], piece[1], lattice, left_m);
            self.push(end);
            left_m -= used_m;
            if left_m <= lattice.pitch_m * STEP_TOLERANCE {
                return;
            }
        }
    }

    /// Adds all of it, in a fixed order.
    pub(crate) fn hash_into(&self, hash: &mut StateHash) {
        hash.add(&(self.count as u64));
        hash.add(&self.points[..self.count]);
    }

    fn push(&mut self, place: Vec2) {
        self.points[self.count] = point(place);
        self.count += 1;
    }
}

/// The part of a straight piece that lies within `left_m`, rounded up to whole steps: where it
/// ends, and its length.
fn cut_piece(from: Vec2, to: Vec2, lattice: &Lattice, left_m: f64) -> (Vec2, f64) {
    let length_m = (to - from).norm();
    let whole = (to, length_m);
    let (Some(a), Some(b)) = (lattice.cell(from), lattice.cell(to)) else {
        return whole;
    };
    let width = i64::from(lattice.width);
    let (a, b) = (i64::from(a), i64::from(b));
    let (right, up) = (b % width - a % width, b / width - a / width);
    let steps = right.abs().max(up.abs());
    let is_straight = right == 0 || up == 0 || right.abs() == up.abs();
    if steps == 0 || !is_straight {
        return whole;
    }
    let step_m = length_m / steps as f64;
    let taken = ((left_m / step_m - STEP_TOLERANCE).ceil() as i64).max(1);
    if taken >= steps {
        return whole;
    }
    let end = a + taken * (right.signum() + up.signum() * width);
    (lattice.at(end as u32), taken as f64 * step_m)
}
