//! Easy constraints (§III.B.1, rule 9): polygon tests between every ordered pair of open tasks.
//!
//! Responsible for: E1–E4, resumable within a budget.
//! Not responsible for: paths (`hard`), what follows for selection (`priority`, `selection`).
//!
//! A result is kept as long as neither object's places change, and only what stands near a grasp
//! is tested at all (`nearby`). But every computation is charged all tests, as the paper's way
//! costs (rule 23): four for each ordered pair.

use std::task::Poll;

use scene::{Budget, Scene, UNITS_PER_POLYGON_TEST};
use shm_types::Counters;

use crate::kind::Kind;
use crate::meter::Meter;
use crate::nearby::Nearby;
use crate::places::{PlaceBook, Places};

/// Whether an easy constraint holds between tasks `one` and `two`. The robot keeps its
/// clearance from object `one`.
#[must_use]
pub fn holds(scene: &Scene, kind: Kind, one: (usize, Places), two: (usize, Places)) -> bool {
    let spec = &scene.objects[two.0];
    let place = match kind {
        Kind::E1 | Kind::E2 => two.1.initial,
        _ => two.1.goal,
    };
    scene.body(spec.class).overlaps(
        place + spec.grasp,
        true,
        &scene.objects[one.0].shape,
        one.1.at(kind.first_at_goal()),
    )
}

/// All easy constraints between the open tasks.
#[derive(Clone, Debug)]
pub struct EasyConstraints {
    tasks: usize,
    places: PlaceBook,
    nearby: Nearby,
    /// Bit `k` at `one · tasks + two`: constraint `Kind::EASY[k]` holds.
    found: Vec<u8>,
    /// Entries that are not zero, row by row.
    filled: Vec<u32>,
    /// Tasks whose results are out of date, and the same as a list.
    stale: Vec<bool>,
    stale_list: Vec<usize>,
    /// Open tasks.
    open: u64,
    row: usize,
    tested: u64,
    meter: Meter,
}

impl EasyConstraints {
    /// Room for the tasks of `scene`.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let tasks = scene.objects.len();
        Self {
            tasks,
            places: PlaceBook::new(scene),
            nearby: Nearby::new(scene),
            found: vec![0; tasks * tasks],
            filled: vec![0; tasks],
            stale: vec![false; tasks],
            stale_list: Vec::with_capacity(tasks),
            open: 0,
            row: 0,
            tested: 0,
            meter: Meter::default(),
        }
    }

    /// Begins a computation for the open tasks' places: one item a task, none for those that
    /// are finished.
    pub fn begin(&mut self, places: impl Iterator<Item = Option<Places>>) {
        self.places.update(places);
        for &task in self.places.changed() {
            if !self.stale[task] {
                self.stale[task] = true;
                self.stale_list.push(task);
            }
        }
        self.open = self.places.open().count() as u64;
        self.row = 0;
        self.meter.reset();
    }

    /// Goes on within `budget`; ready when every pair is decided.
    pub fn advance(
        &mut self,
        scene: &Scene,
        budget: &mut Budget,
        counters: &mut Counters,
    ) -> Poll<()> {
        while self.meter.settle(budget) {
            if self.row == self.tasks {
                self.refresh(scene);
                return Poll::Ready(());
            }
            if self.places.get(self.row).is_some() {
                let tests = (self.open - 1) * Kind::EASY.len() as u64;
                counters.polygon_tests += tests;
                self.meter.charge(tests * UNITS_PER_POLYGON_TEST);
            }
            self.row += 1;
        }
        Poll::Pending
    }

    /// Calls `found` for each constraint that holds between open tasks, with its edge: what has
    /// to be completed first, and what later. By pairs, in ascending order.
    pub fn for_each(&self, mut found: impl FnMut(Kind, usize, usize)) {
        for (one, _) in self.places.open().filter(|(one, _)| self.filled[*one] > 0) {
            let row = &self.found[one * self.tasks..(one + 1) * self.tasks];
            let mut left = self.filled[one];
            for (two, bits) in row.iter().enumerate().filter(|(_, bits)| **bits != 0) {
                for (bit, kind) in Kind::EASY.into_iter().enumerate() {
                    if bits >> bit & 1 == 1 {
                        let (before, after) = kind.edge(one, two);
                        found(kind, before, after);
                    }
                }
                left -= 1;
                if left == 0 {
                    break;
                }
            }
        }
    }

    /// Tests made so far, which are fewer than those charged.
    #[must_use]
    pub const fn tested(&self) -> u64 {
        self.tested
    }

    /// Decides anew every pair of which a task's places have changed.
    fn refresh(&mut self, scene: &Scene) {
        for index in 0..self.stale_list.len() {
            let task = self.stale_list[index];
            self.forget(task);
            self.nearby.set(scene, task, self.places.get(task));
        }
        for index in 0..self.stale_list.len() {
            let task = self.stale_list[index];
            if let Some(places) = self.places.get(task) {
                self.test_near(scene, task, places);
            }
        }
        for task in self.stale_list.drain(..) {
            self.stale[task] = false;
        }
    }

    /// No constraint with this task holds.
    fn forget(&mut self, task: usize) {
        if self.filled[task] > 0 {
            self.found[task * self.tasks..(task + 1) * self.tasks].fill(0);
            self.filled[task] = 0;
        }
        for (one, filled) in self.filled.iter_mut().enumerate().filter(|(_, f)| **f > 0) {
            let bits = &mut self.found[one * self.tasks + task];
            *filled -= u32::from(*bits != 0);
            *bits = 0;
        }
    }

    /// Tests a task against what is near it: as the object that stands, and as the one grasped.
    fn test_near(&mut self, scene: &Scene, task: usize, places: Places) {
        let Self {
            tasks,
            places: book,
            nearby,
            found,
            filled,
            stale,
            tested,
            ..
        } = self;
        let mut test = |kind: Kind, one: usize, two: usize| {
            let (Some(first), Some(second)) = (book.get(one), book.get(two)) else {
                return;
            };
            if one == two {
                return;
            }
            *tested += 1;
            if holds(scene, kind, (one, first), (two, second)) {
                let bits = &mut found[one * *tasks + two];
                filled[one] += u32::from(*bits == 0);
                *bits |= 1 << kind as u8;
            }
        };
        for goal in [false, true] {
            let at = places.at(goal);
            nearby.for_each_grasped_near(at, 0.0, |other| {
                test(Kind::easy(goal, other.goal), task, other.task);
            });
            let grasp = at + scene.objects[task].grasp;
            nearby.for_each_standing_near(grasp, |other| {
                // What is out of date itself finds this task when its own turn comes.
                if !stale[other.task] {
                    test(Kind::easy(other.goal, goal), other.task, task);
                }
            });
        }
    }
}
