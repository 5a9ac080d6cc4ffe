//! Where a robot is during one tick.
//!
//! Responsible for: walking along a path by arc length, across corners, exactly landing on the
//! points themselves. Not responsible for: who may go where (`grants.rs`).
//!
//! Terms: a *track* is a robot's motion within one tick: it moves at full speed from the start of
//! the tick and then stands, so the arc length gone is also the time.

use scene::Vec2;

use crate::path::{ARRIVAL_M, Path};

/// Most straight pieces one robot moves along in one tick: three corners, as the motion batch's
/// capacity says. Arc length beyond is lost to that tick.
pub(crate) const MAX_PIECES: usize =
    shm_types::capacity::MAX_MOTIONS / (2 * shm_types::capacity::MAX_ROBOTS);

/// Motion of one robot within one tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Track {
    corners: [(f64, Vec2); MAX_PIECES + 1],
    pieces: usize,
    used: usize,
}

impl Track {
    /// Standing at `position` all the tick.
    pub(crate) const fn still(position: Vec2) -> Self {
        Self {
            corners: [(0.0, position); MAX_PIECES + 1],
            pieces: 0,
            used: 0,
        }
    }

    /// From `start` along `path`, at most `budget_m` of arc length and [`MAX_PIECES`] pieces.
    /// Lands exactly on the points it reaches.
    pub(crate) fn walk(start: Vec2, path: &Path, budget_m: f64) -> Self {
        let mut track = Self::still(start);
        let mut at = start;
        let mut gone_m = 0.0;
        for &point in path.points() {
            let length_m = (point - at).norm();
            let left_m = budget_m - gone_m;
            if length_m == 0.0 {
                track.used += 1;
                continue;
            }
            if track.pieces == MAX_PIECES || left_m <= ARRIVAL_M {
                break;
            }
            let arrives = length_m <= left_m + ARRIVAL_M;
            if arrives {
                gone_m = (gone_m + length_m).min(budget_m);
                at = point;
                track.used += 1;
            } else {
                gone_m = budget_m;
                at += (point - at) * (left_m / length_m);
            }
            track.pieces += 1;
            track.corners[track.pieces] = (gone_m, at);
            if !arrives {
                break;
            }
        }
        track
    }

    /// This track, going on straight to `to` at the same speed; for one that is not full.
    pub(crate) fn then(mut self, to: Vec2) -> Self {
        if self.pieces < MAX_PIECES {
            let (gone_m, at) = self.corners[self.pieces];
            self.pieces += 1;
            self.corners[self.pieces] = (gone_m + (to - at).norm(), to);
        }
        self
    }

    /// Where the tick ends.
    pub(crate) const fn end(&self) -> Vec2 {
        self.corners[self.pieces].1
    }

    /// Arc length moved in the tick, m.
    pub(crate) const fn moved_m(&self) -> f64 {
        self.corners[self.pieces].0
    }

    /// How many points of the path it walks are reached.
    pub(crate) const fn used(&self) -> usize {
        self.used
    }

    /// Whether it has as many pieces as fit.
    pub(crate) const fn is_full(&self) -> bool {
        self.pieces == MAX_PIECES
    }

    /// The corners with the arc length gone at each, the start included.
    pub(crate) fn corners(&self) -> &[(f64, Vec2)] {
        &self.corners[..=self.pieces]
    }

    /// The straight pieces: from, to, each with the arc length gone there.
    pub(crate) fn pieces(&self) -> impl Iterator<Item = ((f64, Vec2), (f64, Vec2))> + '_ {
        self.corners().windows(2).map(|pair| (pair[0], pair[1]))
    }

    /// Arc length of the first corner past `gone_m`; infinite past the last.
    pub(crate) fn next_corner_m(&self, gone_m: f64) -> f64 {
        let mut corners = self.corners().iter().map(|&(at_m, _)| at_m);
        corners.find(|&at_m| at_m > gone_m).unwrap_or(f64::INFINITY)
    }

    /// Position when `gone_m` of the tick's arc length has passed; past its end it stands.
    pub(crate) fn at(&self, gone_m: f64) -> Vec2 {
        for ((from_m, from), (to_m, to)) in self.pieces() {
            if gone_m < to_m {
                let share = ((gone_m - from_m) / (to_m - from_m)).max(0.0);
                return from + (to - from) * share;
            }
        }
        self.end()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn path(points: &[[f64; 2]]) -> Path {
        let mut path = Path::EMPTY;
        for &[x, y] in points {
            path.push(Vec2::new(x, y));
        }
        path
    }

    #[test]
    fn arc_length_goes_on_across_corners() {
        let ahead = path(&[[1.0, 0.0], [1.0, 1.0], [3.0, 1.0]]);
        let track = Track::walk(Vec2::zeros(), &ahead, 2.5);
        assert_eq!(track.end(), Vec2::new(1.5, 1.0));
        assert_eq!(track.used(), 2);
        assert_eq!(track.at(1.25), Vec2::new(1.0, 0.25));
        assert_eq!(track.moved_m(), 2.5);
        assert_eq!(track.next_corner_m(0.0), 1.0);
        assert_eq!(track.next_corner_m(2.5), f64::INFINITY);
    }

    #[test]
    fn a_track_ends_where_the_path_does() {
        let track = Track::walk(Vec2::zeros(), &path(&[[1.0, 0.0]]), 2.5);
        assert_eq!(track.end(), Vec2::new(1.0, 0.0));
        assert_eq!((track.moved_m(), track.used()), (1.0, 1));
        assert_eq!(track.at(2.0), track.end());
    }

    #[test]
    fn only_so_many_pieces_fit_in_a_tick() {
        let ahead = path(&[[0.1, 0.0], [0.1, 0.1], [0.2, 0.1], [0.2, 0.2], [0.3, 0.2]]);
        let track = Track::walk(Vec2::zeros(), &ahead, 9.0);
        assert_eq!(track.used(), MAX_PIECES);
        assert!(track.is_full());
        assert_eq!(track.end(), Vec2::new(0.2, 0.2));
    }

    proptest! {
        /// However many ticks it takes and wherever the corners are: rounding costs no tick and
        /// the points are reached exactly.
        #[test]
        fn no_arc_length_is_lost_over_many_ticks(
            points in proptest::collection::vec((0_i32..200, 0_i32..200), 1..12),
            tick_mm in 3_u32..40,
        ) {
            let budget_m = f64::from(tick_mm) * 1e-3;
            let mut ahead = Path::EMPTY;
            for (x, y) in points {
                ahead.push(Vec2::new(f64::from(x) * 0.05, f64::from(y) * 0.05));
            }
            let length_m = ahead.length_from(Vec2::zeros());
            let (goal, mut at, mut ticks) = (ahead.last().unwrap(), Vec2::zeros(), 0);
            while !ahead.is_empty() {
                let track = Track::walk(at, &ahead, budget_m);
                prop_assert!(track.moved_m() <= budget_m);
                at = track.end();
                ahead.drop_front(track.used());
                ticks += 1;
            }
            prop_assert_eq!(at, goal);
            let exact = length_m / budget_m;
            prop_assert!((f64::from(ticks) - exact) < 1.0 + 1e-6, "{ticks} ticks for {exact}");
            prop_assert!(f64::from(ticks) > exact - 1e-6);
        }
    }
}
