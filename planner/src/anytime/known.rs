//! Ways that were found before: what a move comes to, after the same moves in the same order.
//!
//! Responsible for: remembering ways by all the moves that were committed before.
//! Not responsible for: finding ways (`route`), committing them (`plan`).
//!
//! How: orders that are tried one after the other mostly begin alike. What was committed says all
//! about what comes next, so the ways of such a beginning are looked for once.

use std::collections::HashMap;
use std::rc::Rc;

use crate::anytime::route::Piece;
use crate::anytime::track::Move;

/// Most pieces of ways that are kept; then all are forgotten.
const MOST_PIECES: usize = 1 << 21;

/// The move: its object, robot, where to (the bits of both coordinates), by which grasp.
type Key = (usize, usize, [u64; 2], u8);

/// The number of a beginning: the moves that were committed. 0 is none.
type Beginning = usize;

/// What is known.
#[derive(Default)]
pub(crate) struct Known {
    /// By a beginning and the next move: the beginning with it.
    next: HashMap<(Beginning, Key), Beginning>,
    /// By beginning, but for the empty one: the way of its last move.
    ways: Vec<Rc<[Piece]>>,
    pieces: usize,
    /// What is committed; none where nothing is remembered.
    at: Option<Beginning>,
}

impl Known {
    /// Forgets everything, and remembers nothing until a beginning.
    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Nothing is committed.
    pub(crate) fn begin(&mut self) {
        if self.pieces > MOST_PIECES {
            self.clear();
        }
        self.at = Some(0);
    }

    /// The way of the move that comes next, if it is known.
    pub(crate) fn way(&self, wanted: &Move) -> Option<Rc<[Piece]>> {
        let after = self.next.get(&(self.at?, key(wanted)))?;
        Some(Rc::clone(&self.ways[after - 1]))
    }

    /// A move was committed, with this way.
    pub(crate) fn commit(&mut self, wanted: &Move, way: &[Piece]) {
        let Some(before) = self.at else { return };
        let after = *self.next.entry((before, key(wanted))).or_insert_with(|| {
            self.ways.push(way.into());
            self.pieces += way.len();
            self.ways.len()
        });
        self.at = Some(after);
    }
}

fn key(wanted: &Move) -> Key {
    let at = wanted.to.at;
    let bits = [at.x.to_bits(), at.y.to_bits()];
    (wanted.object, wanted.robot, bits, wanted.to.by)
}
