//! Who makes which move next, when an order is made move by move.
//!
//! Responsible for: serving moves, each with a robot that would be home again the soonest, with the
//! walls alone; of those that are alike, the one that comes first in the sequence, by the first
//! robot.
//! Not responsible for: whether a move can be made among all others (`plan`).
//!
//! How: an offer counts with the least time that it can take until its turn comes. Only then the
//! ways are looked for, so that most are never looked for. Each robot has a heap of its own, which is
//! made anew when the robot has got a move.

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
    /// By robot.
    waiting: Vec<BinaryHeap<Reverse<Offer>>>,
    /// The soonest of each of these, and some that are so no longer.
    soonest: BinaryHeap<Reverse<Offer>>,
}

impl<'a> Offers<'a> {
    pub(crate) fn new(hops: &'a Hops, sequence: &'a [u32], robots: usize, in_turn: bool) -> Self {
        let mut offers = Self {
            hops,
            sequence,
            in_turn,
            clocks: Clocks::new(hops),
            made: vec![false; sequence.len()],
            waiting: vec![BinaryHeap::new(); robots],
            soonest: BinaryHeap::new(),
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
            let mut offer = self.pop_soonest()?;
            let (place, robot) = (offer.place as usize, offer.robot as usize);
            if self.made[place] {
                continue;
            }
            let object = self.sequence[place];
            if self.clocks.is_early(self.hops, object as usize) {
                refused.push(offer);
            } else if !offer.is_exact {
                offer.home_by = self.clocks.home_by(self.hops, object as usize, robot);
                offer.is_exact = true;
                self.wait(offer);
            } else if commits((object, offer.robot)) {
                break offer;
            } else {
                refused.push(offer);
            }
        };
        refused.into_iter().for_each(|offer| self.wait(offer));
        Some(self.make(taken))
    }

    fn pop_soonest(&mut self) -> Option<Offer> {
        loop {
            let soonest = self.soonest.pop()?;
            let waiting = &mut self.waiting[soonest.0.robot as usize];
            if waiting.peek() == Some(&soonest) {
                waiting.pop();
                self.soonest.extend(waiting.peek().copied());
                return Some(soonest.0);
            }
        }
    }

    fn wait(&mut self, offer: Offer) {
        let (robot, offer) = (offer.robot as usize, Reverse(offer));
        if offer.0.home_by < EVER {
            self.waiting[robot].push(offer);
            let is_soonest = self.waiting[robot].peek() == Some(&offer);
            self.soonest.extend(is_soonest.then_some(offer));
        }
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
        let open = self.open();
        // Others have not changed for the other robots.
        for &open in &open {
            if self.in_turn || self.sequence[open] == object {
                self.offer_to_all(open);
            }
        }
        let offers = open.iter().map(|&open| Reverse(self.offer(open, robot)));
        self.waiting[robot] = offers.filter(|offer| offer.0.home_by < EVER).collect();
        self.soonest.extend(self.waiting[robot].peek().copied());
        (object, offer.robot)
    }

    fn offer_to_all(&mut self, place: usize) {
        for robot in 0..self.waiting.len() {
            self.wait(self.offer(place, robot));
        }
    }

    fn offer(&self, place: usize, robot: usize) -> Offer {
        let object = self.sequence[place] as usize;
        Offer {
            home_by: self.clocks.home_by_at_least(self.hops, object, robot),
            place: place as u32,
            robot: robot as u32,
            is_exact: false,
        }
    }
}
