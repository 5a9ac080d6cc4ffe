//! Easy constraints (§III.B.1, rule 9): polygon tests between every ordered pair of open tasks.
//!
//! Responsible for: E1–E4, resumable within a budget.
//! Not responsible for: paths (`hard`), what follows for selection (`priority`, `selection`).
//!
//! A result is kept as long as neither object's places change, but every computation is charged
//! all tests, as the paper's way costs (rule 23): four for each ordered pair.

use std::task::Poll;

use scene::{Budget, Scene, UNITS_PER_POLYGON_TEST};
use shm_types::Counters;

use crate::kind::Kind;
use crate::meter::Meter;
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
    /// Bit `k` at `one · tasks + two`: constraint `Kind::EASY[k]` holds.
    found: Vec<u8>,
    /// Tasks whose results are out of date, and the same as a list.
    stale: Vec<bool>,
    stale_list: Vec<usize>,
    /// Open tasks.
    open: u64,
    row: usize,
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
            found: vec![0; tasks * tasks],
            stale: vec![false; tasks],
            stale_list: Vec::with_capacity(tasks),
            open: 0,
            row: 0,
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
                return Poll::Ready(());
            }
            let tests = self.work_row(scene, self.row);
            counters.polygon_tests += tests;
            self.meter.charge(tests * UNITS_PER_POLYGON_TEST);
            self.row += 1;
            if self.row == self.tasks {
                self.stale.fill(false);
                self.stale_list.clear();
            }
        }
        Poll::Pending
    }

    /// Calls `found` for each constraint that holds between open tasks, with its edge: what has
    /// to be completed first, and what later. By pairs, in ascending order.
    pub fn for_each(&self, mut found: impl FnMut(Kind, usize, usize)) {
        for (one, _) in self.places.open() {
            let row = &self.found[one * self.tasks..(one + 1) * self.tasks];
            for (two, bits) in row.iter().enumerate().filter(|(_, bits)| **bits != 0) {
                if self.places.get(two).is_none() {
                    continue;
                }
                for (bit, kind) in Kind::EASY.into_iter().enumerate() {
                    if bits >> bit & 1 == 1 {
                        let (before, after) = kind.edge(one, two);
                        found(kind, before, after);
                    }
                }
            }
        }
    }

    /// Tests object `one` against the robot grasping each other object, where the last results
    /// are out of date. The number of tests that are charged.
    fn work_row(&mut self, scene: &Scene, one: usize) -> u64 {
        let Some(places) = self.places.get(one) else {
            return 0;
        };
        if self.stale[one] {
            for two in 0..self.tasks {
                self.test(scene, (one, places), two);
            }
        } else {
            for index in 0..self.stale_list.len() {
                self.test(scene, (one, places), self.stale_list[index]);
            }
        }
        (self.open - 1) * Kind::EASY.len() as u64
    }

    fn test(&mut self, scene: &Scene, one: (usize, Places), two: usize) {
        let Some(places) = self.places.get(two).filter(|_| two != one.0) else {
            return;
        };
        let mut bits = 0;
        for (bit, kind) in Kind::EASY.into_iter().enumerate() {
            bits |= u8::from(holds(scene, kind, one, (two, places))) << bit;
        }
        self.found[one.0 * self.tasks + two] = bits;
    }
}
