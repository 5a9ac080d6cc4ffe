//! What is known of each ordered pair of tasks: one byte each.
//!
//! Responsible for: remembering and forgetting, listing constraints in the table's order, and
//! the order in which tests are made.
//! Not responsible for: making the tests (`hard`).

use shm_types::{Constraint, ConstraintKind};

use crate::kind::Kind;
use crate::places::PlaceBook;

const H1_KNOWN: u8 = 1;
const H1_HOLDS: u8 = 1 << 1;
const H2_KNOWN: u8 = 1 << 2;
const H2_HOLDS: u8 = 1 << 3;
/// Whether E1 or E3, which give the same edge as H1, is known.
const E13_KNOWN: u8 = 1 << 4;
const E13_HOLDS: u8 = 1 << 5;
/// The same of E2, E4 and H2.
const E24_KNOWN: u8 = 1 << 6;
const E24_HOLDS: u8 = 1 << 7;

/// Everything known, at `one · tasks + two`.
#[derive(Clone, Debug)]
pub(crate) struct Pairs {
    tasks: usize,
    bits: Vec<u8>,
}

impl Pairs {
    pub(crate) fn new(tasks: usize) -> Self {
        Self {
            tasks,
            bits: vec![0; tasks * tasks],
        }
    }

    /// Whether the hard test of this kind needs no plan any more.
    pub(crate) fn is_known(&self, kind: Kind, one: usize, two: usize) -> bool {
        self.bits[one * self.tasks + two] & known(kind) != 0
    }

    /// Notes the outcome of a hard test; whether it is a constraint not known before.
    pub(crate) fn decide(&mut self, kind: Kind, one: usize, two: usize, holds: bool) -> bool {
        let bits = &mut self.bits[one * self.tasks + two];
        let before = *bits & known(kind) << 1 != 0;
        *bits |= known(kind);
        *bits &= !(known(kind) << 1);
        if holds {
            *bits |= known(kind) << 1;
        }
        holds && !before
    }

    /// Whether an easy constraint with the same edge as this hard one holds, if that is known.
    pub(crate) fn easy(&self, kind: Kind, one: usize, two: usize) -> Option<bool> {
        let bits = self.bits[one * self.tasks + two];
        (bits & easy_known(kind) != 0).then_some(bits & easy_known(kind) << 1 != 0)
    }

    /// Notes whether such an easy constraint holds.
    pub(crate) fn set_easy(&mut self, kind: Kind, one: usize, two: usize, holds: bool) {
        let known = easy_known(kind);
        self.bits[one * self.tasks + two] |= if holds { known | known << 1 } else { known };
    }

    /// Forgets every pair with this task; whether a hard constraint was among them.
    pub(crate) fn forget(&mut self, task: usize) -> bool {
        let mut lost = 0;
        for other in 0..self.tasks {
            lost |= std::mem::take(&mut self.bits[task * self.tasks + other]);
            lost |= std::mem::take(&mut self.bits[other * self.tasks + task]);
        }
        lost & (H1_HOLDS | H2_HOLDS) != 0
    }

    /// Makes every hard test with this task necessary again; constraints stay in force.
    pub(crate) fn doubt(&mut self, task: usize) {
        for other in 0..self.tasks {
            self.bits[task * self.tasks + other] &= !(H1_KNOWN | H2_KNOWN);
            self.bits[other * self.tasks + task] &= !(H1_KNOWN | H2_KNOWN);
        }
    }

    /// Makes every hard test necessary again; constraints stay in force.
    pub(crate) fn doubt_all(&mut self) {
        for bits in &mut self.bits {
            *bits &= !(H1_KNOWN | H2_KNOWN);
        }
    }

    /// Calls `visit` with every hard constraint, sorted.
    pub(crate) fn for_each(&self, mut visit: impl FnMut(Constraint)) {
        for before in 0..self.tasks {
            for after in 0..self.tasks {
                let mut emit = |kind: ConstraintKind| {
                    visit(Constraint {
                        before: before as u32,
                        after: after as u32,
                        kind: kind.code(),
                    });
                };
                if self.bits[before * self.tasks + after] & H1_HOLDS != 0 {
                    emit(ConstraintKind::H1);
                }
                if self.bits[after * self.tasks + before] & H2_HOLDS != 0 {
                    emit(ConstraintKind::H2);
                }
            }
        }
    }
}

const fn known(kind: Kind) -> u8 {
    if kind.first_at_goal() {
        H2_KNOWN
    } else {
        H1_KNOWN
    }
}

const fn easy_known(kind: Kind) -> u8 {
    if kind.first_at_goal() {
        E24_KNOWN
    } else {
        E13_KNOWN
    }
}

const _: () = assert!(H1_HOLDS == H1_KNOWN << 1 && H2_HOLDS == H2_KNOWN << 1);
const _: () = assert!(E13_HOLDS == E13_KNOWN << 1 && E24_HOLDS == E24_KNOWN << 1);

/// The tests of a computation, one after the other: for each pair of tasks both roles, and for
/// each role H1 and H2.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tests {
    /// The one task whose pairs are tested, or all.
    only: Option<usize>,
    first: usize,
    second: usize,
    /// 0 to 3: which role and kind of this pair comes next.
    step: usize,
}

impl Tests {
    /// No tests.
    pub(crate) const fn none() -> Self {
        Self {
            only: Some(usize::MAX),
            first: usize::MAX,
            second: usize::MAX,
            step: 0,
        }
    }

    /// One task with each other.
    pub(crate) const fn of_task(task: usize) -> Self {
        Self {
            only: Some(task),
            first: task,
            second: 0,
            step: 0,
        }
    }

    /// Each task with each.
    pub(crate) const fn of_all() -> Self {
        Self {
            only: None,
            first: 0,
            second: 1,
            step: 0,
        }
    }

    /// The next test between open tasks: its kind, the object that stands, the one carried.
    pub(crate) fn next(&mut self, places: &PlaceBook) -> Option<(Kind, usize, usize)> {
        let tasks = places.len();
        while self.first < tasks {
            let open = |task| places.get(task).is_some();
            if self.second >= tasks || !open(self.first) {
                if self.only.is_some() {
                    break;
                }
                self.first += 1;
                self.second = self.first + 1;
            } else if self.step == 4 || self.second == self.first || !open(self.second) {
                self.second += 1;
                self.step = 0;
            } else {
                let kind = Kind::HARD[self.step % 2];
                let swap = self.step >= 2;
                self.step += 1;
                let (a, b) = (self.first, self.second);
                return Some(if swap { (kind, b, a) } else { (kind, a, b) });
            }
        }
        None
    }
}
