//! Ways that were found before: what a move comes to, after the same moves in the same order.
//!
//! Responsible for: remembering ways by all the moves that were committed before.
//! Not responsible for: finding ways (`route`), committing them (`plan`).
//!
//! How: orders that are tried one after the other mostly begin alike. What was committed says all
//! about what comes next, so the ways of such a beginning are looked for once.

use std::collections::HashMap;
use std::rc::Rc;

use crate::anytime::order::Item;
use crate::anytime::route::Piece;
use crate::anytime::track::{Move, Place};

/// Most pieces of ways that are kept; then all are forgotten.
const MOST_PIECES: usize = 1 << 21;

/// A move: its object, robot, where to (the bits of both coordinates), by which grasp.
pub(crate) type Key = (u32, u32, [u64; 2], u8);

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
        let after = self.next.get(&(self.at?, key_of(wanted)))?;
        Some(Rc::clone(&self.ways[after - 1]))
    }

    /// A move was committed, with this way.
    pub(crate) fn commit(&mut self, wanted: &Move, way: &[Piece]) {
        let Some(before) = self.at else { return };
        let after = *self
            .next
            .entry((before, key_of(wanted)))
            .or_insert_with(|| {
                self.ways.push(way.into());
                self.pieces += way.len();
                self.ways.len()
            });
        self.at = Some(after);
    }
}

pub(crate) fn key((object, robot): Item, to: &Place) -> Key {
    let bits = [to.at.x.to_bits(), to.at.y.to_bits()];
    (object, robot, bits, to.by)
}

fn key_of(wanted: &Move) -> Key {
    key((wanted.object as u32, wanted.robot as u32), &wanted.to)
}
