//! Who makes which move next, when an order is made move by move.
//!
//! Responsible for: serving moves, each with a robot that would be home again the soonest, with the
//! walls alone; of those that are alike, the one that comes first in the sequence, by the first
//! robot.
//! Not responsible for: whether a move can be made among all others (`plan`).
//!
//! How: an offer counts with the least time that it can take until its turn comes. Only then the
//! ways are looked for, so that most are never looked for.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::anytime::ground::{EVER, Time};
use crate::anytime::order::{Clocks, Hops, Item};

/// A move by a robot, in the order in which they are served.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Offer {
    /// When the robot would be home again, or the least that it can be.
    home_by: Time,
    /// Its place in the sequence.
    place: u32,
    robot: u32,
    is_exact: bool,
    /// How many moves the robot had made then.
    moves: u32,
}

/// The moves of a sequence that are left to make.
pub(crate) struct Offers<'a> {
    hops: &'a Hops,
    /// Objects, in turn.
    sequence: &'a [u32],
    /// Only the next move of the sequence is offered.
    in_turn: bool,
    clocks: Clocks,
    /// By place: whether it is made.
    made: Vec<bool>,
    /// By robot: how many it makes.
    moves: Vec<u32>,
    waiting: BinaryHeap<Reverse<Offer>>,
}

impl<'a> Offers<'a> {
    pub(crate) fn new(hops: &'a Hops, sequence: &'a [u32], robots: usize, in_turn: bool) -> Self {
        let mut offers = Self {
            hops,
            sequence,
            in_turn,
            clocks: Clocks::new(hops),
            made: vec![false; sequence.len()],
            moves: vec![0; robots],
            waiting: BinaryHeap::new(),
        };
        for place in offers.open() {
            offers.offer_to_all(place);
        }
        offers
    }

    /// The soonest move for which `commits` holds, which is then made; none if there is none.
    pub(crate) fn take_soonest(&mut self, commits: &mut impl FnMut(Item) -> bool) -> Option<Item> {
        let mut refused = Vec::new();
        let taken = loop {
            let Reverse(mut offer) = self.waiting.pop()?;
            let (place, robot) = (offer.place as usize, offer.robot as usize);
            if self.made[place] || offer.moves != self.moves[robot] {
                continue;
            }
            let object = self.sequence[place];
            if self.clocks.is_early(self.hops, object as usize) {
                refused.push(Reverse(offer));
            } else if !offer.is_exact {
                offer.home_by = self.clocks.home_by(self.hops, object as usize, robot);
                offer.is_exact = true;
                self.waiting
                    .extend((offer.home_by < EVER).then_some(Reverse(offer)));
            } else if commits((object, offer.robot)) {
                break offer;
            } else {
                refused.push(Reverse(offer));
            }
        };
        self.waiting.extend(refused);
        Some(self.make(taken))
    }

    /// The places of moves that may be next: the first of each object that is left.
    fn open(&self) -> Vec<usize> {
        let left = (0..self.sequence.len()).filter(|&place| !self.made[place]);
        if self.in_turn {
            return left.take(1).collect();
        }
        let mut seen = vec![false; self.hops.of.len()];
        left.filter(|&place| !std::mem::replace(&mut seen[self.sequence[place] as usize], true))
            .collect()
    }

    fn make(&mut self, offer: Offer) -> Item {
        let (place, robot) = (offer.place as usize, offer.robot as usize);
        let object = self.sequence[place];
        self.clocks.make(self.hops, object as usize, robot);
        self.made[place] = true;
        self.moves[robot] += 1;
        for open in self.open() {
            // Others have not changed for the other robots.
            if self.in_turn || self.sequence[open] == object {
                self.offer_to_all(open);
            } else {
                self.offer(open, robot);
            }
        }
        (object, offer.robot)
    }

    fn offer_to_all(&mut self, place: usize) {
        for robot in 0..self.moves.len() {
            self.offer(place, robot);
        }
    }

    fn offer(&mut self, place: usize, robot: usize) {
        let object = self.sequence[place] as usize;
        let home_by = self.clocks.home_by_at_least(self.hops, object, robot);
        let offer = Offer {
            home_by,
            place: place as u32,
            robot: robot as u32,
            is_exact: false,
            moves: self.moves[robot],
        };
        self.waiting
            .extend((home_by < EVER).then_some(Reverse(offer)));
    }
}
