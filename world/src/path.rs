//! Polylines of fixed capacity.
//!
//! Responsible for: corner points still ahead, and their length. Not responsible for: walking
//! along them (`track.rs`), who may go where (`grants.rs`).

use scene::Vec2;
use shm_types::capacity::MAX_PATH_POINTS;

pub(crate) use scene::ARRIVAL_M;

/// Corner points still ahead, nearest first. The start is not among them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Path {
    points: [Vec2; MAX_PATH_POINTS],
    count: usize,
}

impl Path {
    pub(crate) const EMPTY: Self = Self {
        points: [Vec2::new(0.0, 0.0); MAX_PATH_POINTS],
        count: 0,
    };

    pub(crate) fn points(&self) -> &[Vec2] {
        &self.points[..self.count]
    }

    pub(crate) const fn is_empty(&self) -> bool {
        self.count == 0
    }

    pub(crate) const fn is_full(&self) -> bool {
        self.count == MAX_PATH_POINTS
    }

    pub(crate) const fn clear(&mut self) {
        self.count = 0;
    }

    pub(crate) fn first(&self) -> Option<Vec2> {
        self.points().first().copied()
    }

    pub(crate) fn last(&self) -> Option<Vec2> {
        self.points().last().copied()
    }

    /// Adds a point at the end; a full path stays as it is.
    pub(crate) const fn push(&mut self, point: Vec2) {
        if self.count < MAX_PATH_POINTS {
            self.points[self.count] = point;
            self.count += 1;
        }
    }

    /// Moves the last point, of a path that has one.
    pub(crate) const fn replace_last(&mut self, point: Vec2) {
        if self.count > 0 {
            self.points[self.count - 1] = point;
        }
    }

    /// Drops the last point, if there is one.
    pub(crate) const fn drop_last(&mut self) {
        self.count = self.count.saturating_sub(1);
    }

    /// Drops the nearest `count` points.
    pub(crate) fn drop_front(&mut self, count: usize) {
        let count = count.min(self.count);
        self.points.copy_within(count..self.count, 0);
        self.count -= count;
    }

    /// Length from `start` along all points, m.
    pub(crate) fn length_from(&self, start: Vec2) -> f64 {
        let mut at = start;
        let mut length_m = 0.0;
        for &point in self.points() {
            length_m += (point - at).norm();
            at = point;
        }
        length_m
    }
}
