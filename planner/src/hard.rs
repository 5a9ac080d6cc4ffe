//! Hard constraints (§III.B.2, rules 10–12): one transfer path planned for each ordered pair of
//! tasks and each place of the other object.
//!
//! Responsible for: H1 and H2 between one task and all others, or between all, resumable within
//! a budget; remembering what was found for as long as the objects stay where they are.
//! Not responsible for: when that is asked for, and publishing it (`service`).
//!
//! Every test is charged one path plan, as the paper's way costs (rule 23). Methods that compute
//! easy constraints too need no plan for a pair that these decide already (rule 11): robots know
//! them anyway. No constraint follows for a task that has no path even alone (rule 10); that is
//! looked at for the failed task, and for another one once its transfer turns out to have no
//! path.

use std::task::Poll;

use scene::{Budget, HardMode, Scene, Settings, UNITS_PER_POLYGON_TEST};
use shm_types::{Constraint, Counters};

use crate::easy;
use crate::feasibility::Feasibility;
use crate::kind::Kind;
use crate::meter::Meter;
use crate::obstacles::block_for_pair;
use crate::pairs::{Pairs, Tests};
use crate::places::{PlaceBook, Places};
use crate::search::PathSearch;

/// What a computation has found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Constraints that were not known before.
    pub new: u32,
    /// Whether the task asked for has no path even alone (rule 10).
    pub infeasible: bool,
}

/// One test: object `one` stands at its initial place (H1) or goal (H2), `two` is carried.
#[derive(Clone, Copy, Debug)]
struct Test {
    kind: Kind,
    one: usize,
    two: usize,
}

/// What is being worked on.
#[derive(Clone, Copy, Debug)]
enum Stage {
    /// Whether the failed task can be done alone.
    Alone(Feasibility),
    /// Which test comes next.
    Next,
    /// The path of this test.
    Searching(Test),
    /// This test has found no path; whether its mover has one alone.
    Verifying(Test, Feasibility),
    /// All is decided.
    Done,
}

/// The hard constraints known, and the computation of more.
#[derive(Clone, Debug)]
pub struct HardConstraints {
    uses_easy: bool,
    mode: HardMode,
    places: PlaceBook,
    pairs: Pairs,
    /// Whether each task can be done alone, once that is known.
    feasible: Vec<Option<bool>>,
    tests: Tests,
    stage: Stage,
    found: Found,
    search: PathSearch,
    meter: Meter,
}

impl HardConstraints {
    /// Room for the tasks of `scene`.
    #[must_use]
    pub fn new(scene: &Scene, settings: &Settings) -> Self {
        let tasks = scene.objects.len();
        Self {
            uses_easy: settings.method.uses_easy(),
            mode: settings.hard,
            places: PlaceBook::new(scene),
            pairs: Pairs::new(tasks),
            feasible: vec![None; tasks],
            tests: Tests::none(),
            stage: Stage::Done,
            found: Found::default(),
            search: PathSearch::new(scene),
            meter: Meter::default(),
        }
    }

    /// Takes over where the open tasks' objects are: one item a task, none for those that are
    /// finished. Forgets what was known of objects that have moved. Says whether a constraint
    /// between open tasks was lost with it. Not while a computation goes on: it would then mix
    /// two states of the world.
    pub fn update(&mut self, places: impl Iterator<Item = Option<Places>>) -> bool {
        self.places.update(places);
        let mut lost = false;
        for &task in self.places.changed() {
            self.feasible[task] = None;
            let open = self.places.get(task).is_some();
            lost |= self.pairs.forget(task) && open;
        }
        lost
    }

    /// Begins with the tests between `task` and every other open task, in both roles (rule 11).
    pub fn begin_task(&mut self, scene: &Scene, task: usize) {
        self.start(Tests::of_task(task));
        let Some(places) = self.places.get(task) else {
            self.stage = Stage::Done;
            return;
        };
        if self.mode == HardMode::Literal {
            self.pairs.doubt(task);
        }
        match self.feasible[task] {
            None => {
                let test = Feasibility::begin(scene, &mut self.search, task, places);
                self.stage = Stage::Alone(test);
            }
            Some(true) => {}
            Some(false) => {
                self.found.infeasible = true;
                self.stage = Stage::Done;
            }
        }
    }

    /// Begins with the tests between all open tasks.
    pub fn begin_all(&mut self) {
        self.start(Tests::of_all());
        if self.mode == HardMode::Literal {
            self.pairs.doubt_all();
        }
    }

    /// Goes on within `budget`; ready when all tests asked for are decided.
    pub fn advance(
        &mut self,
        scene: &Scene,
        budget: &mut Budget,
        counters: &mut Counters,
    ) -> Poll<Found> {
        loop {
            if !self.meter.settle(budget) && !matches!(self.stage, Stage::Done) {
                return Poll::Pending;
            }
            self.stage = match self.stage {
                Stage::Alone(mut test) => {
                    match test.advance(scene, &mut self.search, budget, counters) {
                        Poll::Pending => {
                            self.stage = Stage::Alone(test);
                            return Poll::Pending;
                        }
                        Poll::Ready(feasible) => self.end_alone(test.task, feasible),
                    }
                }
                Stage::Next => self.next(scene, counters),
                Stage::Searching(test) => match self.search.advance(scene, budget, counters) {
                    Poll::Pending => return Poll::Pending,
                    Poll::Ready(path) => self.end_search(scene, test, path.is_some()),
                },
                Stage::Verifying(test, mut alone) => {
                    match alone.advance(scene, &mut self.search, budget, counters) {
                        Poll::Pending => {
                            self.stage = Stage::Verifying(test, alone);
                            return Poll::Pending;
                        }
                        Poll::Ready(feasible) => {
                            self.feasible[test.two] = Some(feasible);
                            self.decide(test, feasible)
                        }
                    }
                }
                Stage::Done => return Poll::Ready(self.found),
            }
        }
    }

    /// Calls `visit` with every constraint known between open tasks, in the order of the table.
    pub fn for_each(&self, visit: impl FnMut(Constraint)) {
        self.pairs.for_each(visit);
    }

    fn start(&mut self, tests: Tests) {
        self.tests = tests;
        self.found = Found::default();
        self.meter.reset();
        self.stage = Stage::Next;
    }

    fn end_alone(&mut self, task: usize, feasible: bool) -> Stage {
        self.feasible[task] = Some(feasible);
        self.found.infeasible = !feasible;
        if feasible { Stage::Next } else { Stage::Done }
    }

    /// Finds the next test that is not decided yet, and begins its search.
    fn next(&mut self, scene: &Scene, counters: &mut Counters) -> Stage {
        while let Some((kind, one, two)) = self.tests.next(&self.places) {
            let test = Test { kind, one, two };
            if self.pairs.is_known(kind, one, two) {
                continue;
            }
            let (Some(first), Some(second)) = (self.places.get(one), self.places.get(two)) else {
                continue;
            };
            if self.is_decided_by_easy(scene, test, first, second, counters) {
                // What that took is paid before the next test.
                return Stage::Next;
            }
            if self.feasible[two] == Some(false) {
                self.decide(test, false);
                continue;
            }
            let at = first.at(kind.first_at_goal());
            let units = block_for_pair(self.search.occupancy(), scene, two, Some((one, at)));
            self.search.charge(units);
            let grasp = scene.objects[two].grasp;
            self.search
                .begin(scene, second.initial + grasp, second.goal + grasp);
            return Stage::Searching(test);
        }
        Stage::Done
    }

    /// Whether an easy constraint gives the same edge, so that no plan is needed.
    fn is_decided_by_easy(
        &mut self,
        scene: &Scene,
        test: Test,
        first: Places,
        second: Places,
        counters: &mut Counters,
    ) -> bool {
        if !self.uses_easy {
            return false;
        }
        let Test { kind, one, two } = test;
        if let Some(decided) = self.pairs.easy(kind, one, two) {
            return decided;
        }
        let kinds = Kind::EASY.into_iter();
        let decided = kinds
            .filter(|easy| easy.first_at_goal() == kind.first_at_goal())
            .any(|easy| {
                counters.polygon_tests += 1;
                self.meter.charge(UNITS_PER_POLYGON_TEST);
                easy::holds(scene, easy, (one, first), (two, second))
            });
        self.pairs.set_easy(kind, one, two, decided);
        decided
    }

    fn end_search(&mut self, scene: &Scene, test: Test, path: bool) -> Stage {
        if path {
            return self.decide(test, false);
        }
        match (self.feasible[test.two], self.places.get(test.two)) {
            (None, Some(places)) => {
                let alone = Feasibility::begin(scene, &mut self.search, test.two, places);
                Stage::Verifying(test, alone)
            }
            (feasible, _) => self.decide(test, feasible == Some(true)),
        }
    }

    fn decide(&mut self, test: Test, holds: bool) -> Stage {
        let new = self.pairs.decide(test.kind, test.one, test.two, holds);
        self.found.new += u32::from(new);
        Stage::Next
    }
}
