//! The open list of a search over lattice points, and what the search knows of each point.
//!
//! Responsible for: integer path costs, serving points in the order of their keys, remembering
//! how each was reached. Nothing is cleared between searches: a point of an older *round*
//! counts as untouched.
//! Not responsible for: which steps are free, heuristics, budgets (`search`, `field`).
//!
//! Terms: a point's *cost* is that of the best way to it known so far; its *key* is the cost
//! plus a lower bound of what remains. Keys never fall behind the one served last, and never
//! run ahead of it by [`SPAN`], so a ring of buckets serves them in constant time. Within a
//! bucket the point offered last is served first: order depends on nothing but the offers.

/// Cost of a straight step, in fractions of the pitch. With [`DIAGONAL`] it forms a convergent
/// of √2: a path's cost is within 2·10⁻⁶ of its length, equal lengths have equal costs, and no
/// path on the largest lattice overflows 32 bits.
pub(crate) const STRAIGHT: u32 = 408;
/// Cost of a diagonal step.
pub(crate) const DIAGONAL: u32 = 577;

/// Keys in the ring. A step adds at most two diagonals to a key; the keys of the seeds around a
/// configuration off the lattice lie within five.
const SPAN: u32 = 1 << 12;
const _: () = assert!(7 * DIAGONAL < SPAN);
const _: () = assert!(scene::lattice::MAX_LATTICE_POINTS * 2 * (STRAIGHT as u64) < u32::MAX as u64);
const WORDS: usize = SPAN as usize / 64;

/// No point: the end of a list, or "reached from the start".
pub(crate) const NOWHERE: u32 = u32::MAX;

/// What is known of a lattice point: all in one place, since a search jumps about.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// The round it was last reached in, and below that its cost then. Rounds count down, so one
    /// comparison tells whether a point is untouched or reached at a higher cost.
    seen: u64,
    from: u32,
    /// Neighbours in the list of its bucket.
    next: u32,
    previous: u32,
    /// Directions that may lead to something better, as the one who offered it said.
    fresh: u8,
}

const UNTOUCHED: Node = Node {
    seen: u64::MAX,
    from: NOWHERE,
    next: NOWHERE,
    previous: NOWHERE,
    fresh: u8::MAX,
};

/// Open list and costs of one search at a time.
#[derive(Clone, Debug)]
pub(crate) struct Frontier {
    nodes: Vec<Node>,
    round: u32,
    heads: Vec<u32>,
    occupied: [u64; WORDS],
    /// Key served last; before the first, the least key offered.
    current: u32,
    waiting: usize,
    started: bool,
}

impl Frontier {
    /// Room for `points` lattice points.
    pub(crate) fn new(points: usize) -> Self {
        Self {
            nodes: vec![UNTOUCHED; points],
            round: u32::MAX,
            heads: vec![NOWHERE; SPAN as usize],
            occupied: [0; WORDS],
            current: u32::MAX,
            waiting: 0,
            started: false,
        }
    }

    /// Forgets everything.
    pub(crate) fn begin(&mut self) {
        if self.round == 0 {
            self.nodes.fill(UNTOUCHED);
            self.round = u32::MAX;
        }
        self.round -= 1;
        self.occupied.fill(0);
        self.current = u32::MAX;
        self.waiting = 0;
        self.started = false;
    }

    /// Offers a way to `cell` that costs `cost`, reached from `from`; `bound` is a lower bound
    /// of what remains from there, always the same for one point of one search. Kept only if
    /// it is better than what is known; the bound is worked out only then. `fresh` comes back
    /// when the point is served.
    #[inline]
    pub(crate) fn offer(
        &mut self,
        cell: u32,
        from: u32,
        cost: u32,
        fresh: u8,
        bound: impl FnOnce() -> u32,
    ) {
        let stamp = self.stamp(cost);
        let node = &mut self.nodes[cell as usize];
        if stamp >= node.seen {
            return;
        }
        let bound = bound();
        let old = *node;
        node.seen = stamp;
        node.from = from;
        node.fresh = fresh;
        if (old.seen >> 32) as u32 == self.round {
            self.unlink(old, old.seen as u32 + bound);
        }
        let key = cost + bound;
        debug_assert!(key >= self.current || !self.started);
        if !self.started {
            self.current = self.current.min(key);
        }
        self.link(cell, key);
    }

    /// The least key that waits.
    #[inline]
    pub(crate) fn least_key(&mut self) -> Option<u32> {
        if self.waiting == 0 {
            return None;
        }
        self.started = true;
        let bucket = self.current % SPAN;
        let mut word = bucket as usize / 64;
        let mut bits = self.occupied[word] & (u64::MAX << (bucket % 64));
        while bits == 0 {
            word = (word + 1) % WORDS;
            bits = self.occupied[word];
        }
        let found = word as u32 * 64 + bits.trailing_zeros();
        self.current += found.wrapping_sub(bucket) % SPAN;
        Some(self.current)
    }

    /// Serves the point with the least key: the point, the cost of the best way to it, and what
    /// was said to be fresh.
    #[inline]
    pub(crate) fn take(&mut self) -> Option<(u32, u32, u8)> {
        let key = self.least_key()?;
        let cell = self.heads[(key % SPAN) as usize];
        let node = self.nodes[cell as usize];
        self.unlink(node, key);
        Some((cell, node.seen as u32, node.fresh))
    }

    /// Whether nothing waits.
    pub(crate) const fn is_empty(&self) -> bool {
        self.waiting == 0
    }

    /// Cost of the best way to `cell` known, if any is.
    #[inline]
    pub(crate) fn cost(&self, cell: u32) -> Option<u32> {
        let seen = self.nodes[cell as usize].seen;
        ((seen >> 32) as u32 == self.round).then_some(seen as u32)
    }

    /// The point before `cell` on the best way to it, or [`NOWHERE`].
    pub(crate) fn from(&self, cell: u32) -> u32 {
        self.nodes[cell as usize].from
    }

    #[inline]
    fn stamp(&self, cost: u32) -> u64 {
        u64::from(self.round) << 32 | u64::from(cost)
    }

    #[inline]
    fn link(&mut self, cell: u32, key: u32) {
        let bucket = (key % SPAN) as usize;
        let (word, bit) = (bucket / 64, 1 << (bucket % 64));
        let next = if self.occupied[word] & bit == 0 {
            NOWHERE
        } else {
            self.heads[bucket]
        };
        let node = &mut self.nodes[cell as usize];
        node.next = next;
        node.previous = NOWHERE;
        if next != NOWHERE {
            self.nodes[next as usize].previous = cell;
        }
        self.heads[bucket] = cell;
        self.occupied[word] |= bit;
        self.waiting += 1;
    }

    /// Takes a point that waits under `key` out of its bucket's list.
    #[inline]
    fn unlink(&mut self, node: Node, key: u32) {
        let Node { next, previous, .. } = node;
        if next != NOWHERE {
            self.nodes[next as usize].previous = previous;
        }
        if previous == NOWHERE {
            let bucket = (key % SPAN) as usize;
            self.heads[bucket] = next;
            if next == NOWHERE {
                self.occupied[bucket / 64] &= !(1 << (bucket % 64));
            }
        } else {
            self.nodes[previous as usize].next = next;
        }
        self.waiting -= 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_better_of_two_offers_counts() {
        let mut frontier = Frontier::new(3);
        frontier.begin();
        frontier.offer(0, NOWHERE, 500, u8::MAX, || 100);
        frontier.offer(1, NOWHERE, 300, u8::MAX, || 0);
        frontier.offer(0, 1, 150, u8::MAX, || 100);
        frontier.offer(0, 2, 400, u8::MAX, || 100);
        assert_eq!(frontier.take(), Some((0, 150, u8::MAX)));
        assert_eq!(frontier.from(0), 1);
        assert_eq!(frontier.take(), Some((1, 300, u8::MAX)));
        assert_eq!(frontier.take(), None);
        assert_eq!(frontier.cost(2), None);
    }

    #[test]
    fn a_round_forgets_the_one_before() {
        let mut frontier = Frontier::new(2);
        frontier.begin();
        frontier.offer(0, NOWHERE, 7, u8::MAX, || 0);
        frontier.begin();
        assert_eq!(frontier.take(), None);
        assert_eq!(frontier.cost(0), None);
    }

    proptest! {
        /// Against a plain sorted list: keys come out in order, and nothing is lost.
        #[test]
        fn keys_are_served_in_order(
            seeds in proptest::collection::vec((0_u32..64, 0_u32..2885), 1..20),
            steps in proptest::collection::vec((0_u32..64, 0_u32..1155), 0..300),
        ) {
            let mut frontier = Frontier::new(64);
            frontier.begin();
            let mut waiting = std::collections::BTreeMap::new();
            let mut served = std::collections::BTreeSet::new();
            for &(cell, cost) in &seeds {
                frontier.offer(cell, NOWHERE, cost, u8::MAX, || 0);
                let best = waiting.entry(cell).or_insert(cost);
                *best = (*best).min(cost);
            }
            let mut steps = steps.into_iter();
            while let Some((cell, cost, _)) = frontier.take() {
                prop_assert_eq!(waiting.remove(&cell), Some(cost));
                prop_assert!(waiting.values().all(|&other| other >= cost));
                prop_assert!(served.insert(cell));
                for (next, step) in steps.by_ref().take(4) {
                    frontier.offer(next, cell, cost + step, u8::MAX, || 0);
                    if !served.contains(&next) {
                        let best = waiting.entry(next).or_insert(cost + step);
                        *best = (*best).min(cost + step);
                    }
                }
            }
            prop_assert!(waiting.is_empty());
        }
    }
}
