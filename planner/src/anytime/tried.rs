//! What was tried: no order is tried again, nor one that begins as one whose last move came too
//! late.
//!
//! Responsible for: remembering beginnings of orders, whatever moves those are of, also while robots
//! carry some of them out.
//! Not responsible for: why a move has no way at all (`cuts`), the ways themselves (`known`).

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use crate::anytime::ground::{EVER, Time};
use crate::anytime::known::{Key, key};
use crate::anytime::order::{Hops, Item, Progress};

/// Most moves of beginnings that are kept; then all are forgotten.
const MOST_MOVES: usize = 1 << 18;

/// Beginnings of orders that lead nowhere, or nowhere new.
#[derive(Default)]
pub(crate) struct Tried {
    /// Each with the time by which its last robot cannot be home; at any time, if it was a whole
    /// order.
    list: Vec<(Vec<Key>, Time)>,
    /// The same by their hashes.
    too_late: HashMap<u64, Time>,
    moves: usize,
}

impl Tried {
    /// Takes note that an order is tried. Whether it is new.
    pub(crate) fn insert(&mut self, hops: &Hops, order: &[Item]) -> bool {
        self.note(keys(hops, order).collect(), EVER)
    }

    /// Takes note that after an order's last move its robot could not be home by this time.
    pub(crate) fn fail(&mut self, hops: &Hops, order: &[Item], home_by: Time) {
        self.note(keys(hops, order).collect(), home_by);
    }

    /// Whether an order was tried, or begins in a way that takes too long to be done before `limit`.
    pub(crate) fn has(&self, hops: &Hops, order: &[Item], limit: Time) -> bool {
        let home_by = hops.home_by(order, limit);
        (hashes(keys(hops, order)).zip(home_by)).any(|(beginning, home_by)| {
            let too_late = self.too_late.get(&beginning);
            too_late.is_some_and(|&known| home_by <= known)
        })
    }

    /// Robots have begun some of the moves: what comes after them is still known.
    pub(crate) fn go_on(&mut self, begun: &Begun) {
        for (order, time) in std::mem::take(self).list {
            let is_whole = time == EVER;
            if let Some(rest) = begun.strip(&order)
                && (is_whole || rest.last() == Some(&(order.len() - 1)))
            {
                self.note(rest.iter().map(|&place| order[place]).collect(), time);
            }
        }
    }

    fn note(&mut self, order: Vec<Key>, time: Time) -> bool {
        if self.moves > MOST_MOVES {
            *self = Self::default();
        }
        let Some(hash) = hashes(order.iter().copied()).last() else {
            return false;
        };
        if (self.too_late.get(&hash)).is_some_and(|&known| known >= time) {
            return false;
        }
        self.too_late.insert(hash, time);
        self.moves += order.len();
        self.list.push((order, time));
        true
    }
}

/// By object, the moves that robots have begun.
pub(crate) struct Begun(Vec<Vec<Key>>);

impl Begun {
    /// So many moves of each object, as in this order.
    pub(crate) fn of(hops: &Hops, order: &[Item], made: &[u32]) -> Self {
        let mut begun = vec![Vec::new(); made.len()];
        for key in keys(hops, order) {
            let object = key.0 as usize;
            if begun[object].len() < made[object] as usize {
                begun[object].push(key);
            }
        }
        Self(begun)
    }

    /// The places in an order of the moves that come after them.
    pub(crate) fn rest(&self, hops: &Hops, order: &[Item]) -> Option<Vec<usize>> {
        self.strip(&keys(hops, order).collect::<Vec<_>>())
    }

    /// The same; none if the order is not one in which they are begun.
    fn strip(&self, order: &[Key]) -> Option<Vec<usize>> {
        let mut seen = vec![0; self.0.len()];
        let mut rest = Vec::with_capacity(order.len());
        for (place, key) in order.iter().enumerate() {
            let object = key.0 as usize;
            match self.0[object].get(seen[object]) {
                None => rest.push(place),
                Some(begun) if begun == key => seen[object] += 1,
                Some(_) => return None,
            }
        }
        let is_all = self
            .0
            .iter()
            .zip(&seen)
            .all(|(all, &seen)| all.len() == seen);
        is_all.then_some(rest)
    }
}

/// The moves of an order.
fn keys(hops: &Hops, order: &[Item]) -> impl Iterator<Item = Key> {
    let mut progress = Progress::new(hops);
    order.iter().map(move |&item| {
        let hop = progress.make(item);
        key(item, &hops.list[hop].to)
    })
}

/// By each move, a hash of it and all before it.
fn hashes(order: impl Iterator<Item = Key>) -> impl Iterator<Item = u64> {
    order.scan(DefaultHasher::new(), |hasher, key| {
        key.hash(hasher);
        Some(hasher.finish())
    })
}

#[cfg(test)]
mod tests {
    use std::rc::Rc;

    use scene::GenerateOptions;

    use super::*;
    use crate::anytime::solver::testing::planned;

    /// Moves of a room with two robots, and an order of them.
    fn moves() -> (Rc<Hops>, Vec<Item>) {
        let options = GenerateOptions {
            objects: 4,
            robots: 2,
            ..GenerateOptions::default()
        };
        let (_, solver, _) = planned(&options);
        solver.current.unwrap()
    }

    #[test]
    fn what_begins_as_what_came_too_late_is_known_unless_there_is_more_time() {
        let (hops, order) = moves();
        let limit = 2 * hops.least(&order).unwrap();
        let mut tried = Tried::default();
        tried.fail(&hops, &order[..2], hops.home_by(&order, limit)[1]);
        assert!(tried.has(&hops, &order, limit));
        assert!(tried.has(&hops, &order, limit - 1));
        assert!(!tried.has(&hops, &order, limit + 1));
        let (mut other_end, mut other_beginning) = (order.clone(), order.clone());
        other_end.swap(2, 3);
        other_beginning.swap(0, 1);
        assert!(tried.has(&hops, &other_end, limit / 2));
        assert!(!tried.has(&hops, &other_beginning, limit));
        assert!(tried.insert(&hops, &other_beginning));
        assert!(tried.has(&hops, &other_beginning, EVER));
        assert!(!tried.insert(&hops, &other_beginning));
    }

    #[test]
    fn what_comes_after_moves_that_have_begun_is_still_known() {
        let (hops, order) = moves();
        let made = |objects: &[u32]| -> Vec<u32> {
            (0..4)
                .map(|object| u32::from(objects.contains(&object)))
                .collect()
        };
        let [first, second, third, last] = order[..] else {
            panic!("{order:?}");
        };
        let other = |(object, robot): Item| (object, 1 - robot);
        let mut tried = Tried::default();
        tried.insert(&hops, &[second, first, third, last]);
        tried.insert(&hops, &[other(first), last, third, second]);
        tried.fail(&hops, &[second, first, last], 7);
        tried.fail(&hops, &[second, third], 8);
        tried.fail(&hops, &[second, first], 9);
        let begun = Begun::of(&hops, &order, &made(&[first.0]));
        tried.go_on(&begun);
        let mut known: Vec<(Vec<Key>, Time)> = tried.list.clone();
        known.sort_by_key(|(_, time)| *time);
        let rest = |order: &[Item]| -> Vec<Key> {
            keys(&hops, order).filter(|key| key.0 != first.0).collect()
        };
        let expected = [
            (rest(&[second, last]), 7),
            (rest(&[second, third, last]), EVER),
        ];
        assert_eq!(known, expected);
        assert_eq!(begun.rest(&hops, &order), Some(vec![1, 2, 3]));
        let by_another = [other(first), second, third, last];
        assert_eq!(begun.rest(&hops, &by_another), None);
    }
}
