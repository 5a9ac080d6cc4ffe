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

    /// The request for it, not numbered yet.
    pub(crate) fn request(&self) -> PathRequest {
        PathRequest {
            count: self.count as u32,
            points: self.points,
            ..PathRequest::default()
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A lattice of pitch 0.05 m.
    fn lattice() -> Lattice {
        let text = r#"
            name = "room"
            [robot]
            shape = { box = [0.5, 0.5] }
            speed = 0.5
            [object]
            shape = { box = [0.4, 0.4] }
            grasp = [0.0, -0.45]
            [workspace]
            bounds = [0.0, 0.0, 4.0, 3.0]
            [[robots]]
            home = [0.5, 0.5]
            [[objects]]
            start = [1.5, 2.0]
            goal = [3.0, 2.0]
        "#;
        scene::parse(text, "room").unwrap().lattice
    }

    fn cut(path: &[[f64; 2]], length_m: f64) -> Vec<[f64; 2]> {
        let path: Vec<_> = path.iter().map(|p| Vec2::new(p[0], p[1])).collect();
        let mut ahead = Ahead::NOWHERE;
        ahead.cut(&path, &lattice(), length_m);
        let request = ahead.request();
        // Places on the lattice are sums of steps: compare them to a nanometre.
        let round = |x: f64| (x * 1e9).round() / 1e9;
        request
            .points()
            .iter()
            .map(|p| [round(p.x), round(p.y)])
            .collect()
    }

    #[test]
    fn a_straight_piece_is_cut_at_a_lattice_point_at_or_after_the_length() {
        let path = [[0.5, 0.5], [2.0, 0.5]];
        assert_eq!(cut(&path, 0.1), [[0.5, 0.5], [0.6, 0.5]]);
        assert_eq!(cut(&path, 0.12), [[0.5, 0.5], [0.65, 0.5]]);
        assert_eq!(cut(&path, 0.01), [[0.5, 0.5], [0.55, 0.5]]);
        let diagonal = [[1.0, 1.0], [0.5, 1.5]];
        assert_eq!(cut(&diagonal, 0.1), [[1.0, 1.0], [0.9, 1.1]]);
    }

    #[test]
    fn a_cut_counts_length_across_corners() {
        let path = [[0.5, 0.5], [0.55, 0.5], [0.55, 1.0]];
        assert_eq!(cut(&path, 0.1), [[0.5, 0.5], [0.55, 0.5], [0.55, 0.55]]);
        assert_eq!(cut(&path, 0.05), [[0.5, 0.5], [0.55, 0.5]]);
    }

    #[test]
    fn pieces_off_the_lattice_are_taken_whole_and_short_paths_entirely() {
        assert_eq!(
            cut(&[[0.52, 0.5], [0.55, 0.5], [2.0, 0.5]], 0.1),
            [[0.52, 0.5], [0.55, 0.5], [0.65, 0.5]]
        );
        assert_eq!(
            cut(&[[0.5, 0.5], [0.55, 0.5]], 0.1),
            [[0.5, 0.5], [0.55, 0.5]]
        );
        let mut ahead = Ahead::NOWHERE;
        ahead.cut(&[Vec2::new(0.5, 0.5)], &lattice(), 0.1);
        assert!(ahead.stays());
        assert_eq!(ahead.start(), Some(Vec2::new(0.5, 0.5)));
    }

    #[test]
    fn a_request_holds_no_more_corners_than_a_message() {
        let zigzag: Vec<_> = (0..100)
            .map(|k| {
                [
                    0.5 + 0.05 * f64::from(k / 2 + k % 2),
                    0.5 + 0.05 * f64::from(k / 2),
                ]
            })
            .collect();
        assert_eq!(cut(&zigzag, 100.0).len(), MAX_PATH_POINTS);
    }
}
