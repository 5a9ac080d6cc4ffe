//! The steps of planning, each timed as a whole with its work counted.
//!
//! Responsible for: setting each step up, which is not timed, and running it once.
//! Not responsible for: how often and in which rooms.

use std::hint::black_box;
use std::time::Instant;

use planner::{
    EasyConstraints, Floods, HardConstraints, Kind, PathSearch, Planner, PlannerInput,
    PriorityGraph, Selection, easy,
};
use scene::{Budget, HardMode, Method, Settings};
use shm_types::{Checked, Constraint, ConstraintTable, Counters, WorldSnapshot, zeroed};
use world::World;

use super::room::Room;

/// Searches in one sample of the path search.
const QUERIES: usize = 40;

/// A step of planning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    Easy,
    EasyPlain,
    HardOfOne,
    HardPlain,
    HardFloods,
    Priority,
    Selection,
    SelectionAgain,
    PathSearch,
    FirstPlan,
}

impl Step {
    /// Those that rooms of the paper's kind are measured with.
    pub(super) const PAPER: [Self; 9] = [
        Self::Easy,
        Self::EasyPlain,
        Self::HardOfOne,
        Self::HardPlain,
        Self::HardFloods,
        Self::Priority,
        Self::Selection,
        Self::SelectionAgain,
        Self::PathSearch,
    ];

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Easy => "easy constraints",
            Self::EasyPlain => "easy constraints, every pair",
            Self::HardOfOne => "hard constraints on one failure",
            Self::HardPlain => "all hard constraints, a plan a test",
            Self::HardFloods => "all hard constraints, floods",
            Self::Priority => "priority graph",
            Self::Selection => "first selection",
            Self::SelectionAgain => "selection, lengths known",
            Self::PathSearch => "path search",
            Self::FirstPlan => "first plan for all robots",
        }
    }

    pub(super) const fn counted(self) -> &'static str {
        match self {
            Self::Easy | Self::EasyPlain => "polygon tests made",
            Self::HardOfOne
            | Self::HardPlain
            | Self::Selection
            | Self::PathSearch
            | Self::FirstPlan => "cells expanded",
            Self::HardFloods => "runs of points",
            Self::Priority => "tasks and edges",
            Self::SelectionAgain => "units",
        }
    }

    /// Cells it will expand, about: searches times the share of the room that they look at.
    pub(super) const fn cells(self, objects: usize, points: usize) -> f64 {
        let (objects, points) = (objects as f64, points as f64);
        match self {
            Self::HardOfOne => 4.0 * objects * 0.2 * points,
            Self::HardPlain => 2.0 * objects * objects * 0.1 * points,
            Self::Selection | Self::SelectionAgain => objects * 0.7 * points,
            Self::Easy
            | Self::EasyPlain
            | Self::HardFloods
            | Self::Priority
            | Self::PathSearch
            | Self::FirstPlan => 0.0,
        }
    }
}

/// What one run of a step came to.
pub(super) struct Sample {
    pub(super) work: u64,
    /// None for a step that no method of the paper is charged for.
    pub(super) charged_units: Option<u64>,
    pub(super) time_s: f64,
}

/// One room, and what its steps share.
pub(super) struct Workbench<'a> {
    room: &'a Room,
    floods: Option<Floods>,
    selection: Option<(Selection, Box<WorldSnapshot>, Box<ConstraintTable>)>,
}

impl<'a> Workbench<'a> {
    pub(super) fn new(room: &'a Room) -> Self {
        Self {
            room,
            floods: None,
            selection: None,
        }
    }

    /// Runs a step once. Which task fails depends on `repeat`.
    pub(super) fn measure(&mut self, step: Step, repeat: usize) -> Sample {
        match step {
            Step::Easy => self.easy(),
            Step::EasyPlain => self.easy_plain(),
            Step::HardOfOne => self.hard(
                Method::GraspingAndRestricted,
                Some(repeat % self.room.objects()),
            ),
            Step::HardPlain => self.hard(Method::Restricted, None),
            Step::HardFloods => self.floods(),
            Step::Priority => self.priority(),
            Step::Selection => {
                self.selection = None;
                let (counters, time_s) = self.select();
                Sample {
                    work: counters.cells_expanded,
                    charged_units: Some(counters.units),
                    time_s,
                }
            }
            Step::SelectionAgain => {
                if self.selection.is_none() {
                    self.select();
                }
                let (counters, time_s) = self.select();
                Sample {
                    work: counters.units,
                    charged_units: Some(counters.units),
                    time_s,
                }
            }
            Step::PathSearch => self.path_search(repeat),
            Step::FirstPlan => self.first_plan(),
        }
    }

    /// From an empty planner to the schedule that robots begin with.
    fn first_plan(&self) -> Sample {
        let scene = &self.room.scene;
        let settings = Settings {
            method: Method::Anytime,
            // Nothing is worth waiting for: the first plan is written down as it is found.
            units_per_second: 1,
            ..Settings::default()
        };
        let mut snapshot = zeroed();
        World::new(scene, settings.clone(), 0).snapshot_into(&mut snapshot);
        let mut planner = Planner::new(scene, settings);
        let (planned, time_s) = timed(|| {
            let snapshot = Checked::new(&*snapshot, scene.counts()).ok()?;
            let input = PlannerInput {
                snapshot,
                requests: &[],
            };
            let output = planner.step(scene, input, u64::MAX);
            output.schedule.map(|_| output.report.counters)
        });
        let counters = planned.unwrap_or_default();
        Sample {
            work: counters.cells_expanded,
            charged_units: Some(counters.units),
            time_s: if planned.is_some() { time_s } else { f64::NAN },
        }
    }

    fn easy(&self) -> Sample {
        let scene = &self.room.scene;
        let mut easy = EasyConstraints::new(scene);
        let (units, time_s) = timed(|| {
            easy.begin(self.room.places.iter().copied());
            finish(|budget, counters| easy.advance(scene, budget, counters).is_ready()).units
        });
        Sample {
            work: easy.tested(),
            charged_units: Some(units),
            time_s,
        }
    }

    fn easy_plain(&self) -> Sample {
        let (scene, places) = (&self.room.scene, &self.room.places);
        let open = || {
            let places = places.iter().enumerate();
            places.filter_map(|(task, places)| Some((task, (*places)?)))
        };
        let mut tests = 0;
        let (_, time_s) = timed(|| {
            let mut held = 0_u32;
            for one in open() {
                for two in open().filter(|two| two.0 != one.0) {
                    for kind in Kind::EASY {
                        held += u32::from(easy::holds(scene, kind, one, two));
                        tests += 1;
                    }
                }
            }
            black_box(held)
        });
        Sample {
            work: tests,
            charged_units: None,
            time_s,
        }
    }

    fn hard(&self, method: Method, task: Option<usize>) -> Sample {
        let scene = &self.room.scene;
        let settings = Settings {
            method,
            hard: HardMode::Cached,
            ..Settings::default()
        };
        let mut hard = HardConstraints::new(scene, &settings);
        let (counters, time_s) = timed(|| {
            hard.update(self.room.places.iter().copied());
            match task {
                Some(task) => hard.begin_task(scene, task),
                None => hard.begin_all(),
            }
            finish(|budget, counters| hard.advance(scene, budget, counters).is_ready())
        });
        Sample {
            work: counters.cells_expanded,
            charged_units: Some(counters.units),
            time_s,
        }
    }

    fn floods(&mut self) -> Sample {
        let room = self.room;
        let (floods, time_s) = timed(|| Floods::of(&room.scene, room.places.iter().copied()));
        let work = floods.work().runs;
        self.floods = Some(floods);
        Sample {
            work,
            charged_units: None,
            time_s,
        }
    }

    /// The graph of all easy and all hard constraints.
    fn priority(&mut self) -> Sample {
        let scene = &self.room.scene;
        let mut easy = EasyConstraints::new(scene);
        easy.begin(self.room.places.iter().copied());
        finish(|budget, counters| easy.advance(scene, budget, counters).is_ready());
        let hard = self.hard_constraints();
        let mut graph = PriorityGraph::new(self.room.objects());
        let mut edges = 0;
        let (_, time_s) = timed(|| {
            graph.clear();
            for task in 0..self.room.objects() {
                graph.add_task(task);
            }
            easy.for_each(|_, before, after| edges += u64::from(graph.add_edge(before, after)));
            for constraint in &hard {
                let (before, after) = (constraint.before as usize, constraint.after as usize);
                edges += u64::from(graph.add_edge(before, after));
            }
            graph.advance(&mut Budget::new(u64::MAX))
        });
        Sample {
            work: self.room.objects() as u64 + edges,
            charged_units: None,
            time_s,
        }
    }

    fn hard_constraints(&mut self) -> Vec<Constraint> {
        if self.floods.is_none() {
            self.floods();
        }
        let floods = self.floods.as_ref();
        floods.map_or_else(Vec::new, |floods| floods.constraints().to_vec())
    }

    /// One selection by one robot, easy constraints included; the first one, or one that follows.
    fn select(&mut self) -> (Counters, f64) {
        let scene = &self.room.scene;
        let settings = Settings {
            method: Method::GraspingAndRestricted,
            ..Settings::default()
        };
        let (selection, snapshot, table) = self.selection.get_or_insert_with(|| {
            let mut snapshot = zeroed();
            World::new(scene, settings.clone(), 0).snapshot_into(&mut snapshot);
            (Selection::new(scene, &settings), snapshot, zeroed())
        });
        let Ok(world) = Checked::new(&**snapshot, scene.counts()) else {
            return (Counters::default(), f64::NAN);
        };
        timed(|| {
            selection.begin(world, table);
            finish(|budget, counters| selection.advance(scene, budget, counters).is_ready())
        })
    }

    /// Transfers among the walls alone; work and time of one, on average.
    fn path_search(&self, repeat: usize) -> Sample {
        let scene = &self.room.scene;
        let mut search = PathSearch::new(scene);
        let mut counters = Counters::default();
        let mut time_s = 0.0;
        for query in 0..QUERIES {
            let object = &scene.objects[(query * 7 + repeat) % scene.objects.len()];
            let Some(goal) = object.goal else { continue };
            search.occupancy().reset(scene, object.class);
            let (one, one_s) = timed(|| {
                search.begin(scene, object.start + object.grasp, goal + object.grasp);
                finish(|budget, counters| search.advance(scene, budget, counters).is_ready())
            });
            counters += one;
            time_s += one_s;
        }
        Sample {
            work: counters.cells_expanded / QUERIES as u64,
            charged_units: Some(counters.units / QUERIES as u64),
            time_s: time_s / QUERIES as f64,
        }
    }
}

/// Runs a computation to its end with an endless budget; what it counted.
fn finish(mut advance: impl FnMut(&mut Budget, &mut Counters) -> bool) -> Counters {
    let mut counters = Counters::default();
    let mut budget = Budget::new(u64::MAX);
    while !advance(&mut budget, &mut counters) {}
    counters.units = budget.spent();
    counters
}

/// The result and the wall time of `work`, s.
pub(super) fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let started = Instant::now();
    let result = work();
    (result, started.elapsed().as_secs_f64())
}
