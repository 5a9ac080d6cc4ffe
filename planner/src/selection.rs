//! Selection (§III.C.3): who takes which task.
//!
//! Responsible for: the selection rule (13), the loop of rule 17 with its ties, and what counts
//! as selectable (rule 18), resumable within a budget from inputs that are frozen for the epoch:
//! every robot that selects in an epoch finds the same.
//! Not responsible for: edges (`easy`, `hard`), priorities (`priority`), path lengths
//! (`lengths`); claiming what was selected (crate `robot`).
//!
//! Terms: a task is *open* if it is not finished, *held* if a robot carried its object when the
//! epoch opened, and in the *pool* if it is open and not held. Only tasks of the pool can be
//! selected: one that was claimed but not grasped when the epoch opened is back in it (rules 18
//! and 19). Edges into held tasks neither block nor close a cycle (rule 9): they are left out.

use std::task::Poll;

use scene::{Budget, Method, Scene, Settings, Vec2, vec};
use shm_types::capacity::ROBOT_WORDS;
use shm_types::{Checked, ConstraintTable, Counters, ObjectState, TaskStatus, WorldSnapshot};

use crate::assignment::{Assignment, Candidate};
use crate::easy::EasyConstraints;
use crate::lengths::{Asked, Lengths};
use crate::meter::Meter;
use crate::places::Places;
use crate::priority::PriorityGraph;

/// Pairs of a task and a robot compared for one unit.
const PAIRS_PER_UNIT: u64 = 16;

/// A step of selection, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Path lengths, for the performance values.
    Lengths,
    /// Easy constraints, by the methods that compute them.
    Easy,
    /// Priority values.
    Priorities,
    /// Handing tasks out.
    Assignment,
    /// All is known.
    Done,
}

/// What selection reads of a task, frozen.
#[derive(Clone, Copy, Debug)]
struct Task {
    /// Places, if it is open.
    open: Option<Places>,
    /// Whether its object was held.
    held: bool,
    /// Bit r set: barred for robot r.
    barred: [u64; ROBOT_WORDS],
}

/// One robot's selection, from epoch to epoch.
#[derive(Clone, Debug)]
pub struct Selection {
    method: Method,
    /// The user's own order as edges.
    ordered: Vec<(usize, usize)>,
    tasks: Vec<Task>,
    /// Places of the tasks in the pool.
    pool: Vec<Option<Places>>,
    /// Where the free robots were when the epoch opened, m.
    robots: Vec<Option<Vec2>>,
    lengths: Lengths,
    easy: EasyConstraints,
    graph: PriorityGraph,
    candidates: Vec<Candidate>,
    /// Candidates that had their turn.
    handed: usize,
    assignment: Assignment,
    stage: Stage,
    meter: Meter,
}

impl Selection {
    /// A selection in `scene`; all memory it will ever use is allocated here.
    #[must_use]
    pub fn new(scene: &Scene, settings: &Settings) -> Self {
        let (tasks, robots) = (scene.objects.len(), scene.homes.len());
        let closed = Task {
            open: None,
            held: false,
            barred: [0; ROBOT_WORDS],
        };
        Self {
            method: settings.method,
            ordered: scene
                .before
                .iter()
                .map(|order| (order.first.0, order.then.0))
                .collect(),
            tasks: vec![closed; tasks],
            pool: vec![None; tasks],
            robots: vec![None; robots],
            lengths: Lengths::new(scene, settings),
            easy: EasyConstraints::new(scene),
            graph: PriorityGraph::new(tasks),
            candidates: Vec::with_capacity(tasks),
            handed: 0,
            assignment: Assignment::new(robots),
            stage: Stage::Done,
            meter: Meter::default(),
        }
    }

    /// Whether `table` will do for a selection at this snapshot. Method "all" selects only once
    /// the table in force is complete for every event so far; the robot computes until then.
    #[must_use]
    pub fn is_ready(&self, world: Checked<WorldSnapshot>, table: &ConstraintTable) -> bool {
        self.method != Method::All || table.complete_for_events == world.header.events
    }

    /// Begins a selection: copies what the snapshot froze when the epoch opened. `table` is the
    /// version of the hard constraints that the snapshot names for the epoch.
    pub fn begin(&mut self, world: Checked<WorldSnapshot>, table: &ConstraintTable) {
        debug_assert_eq!(table.version, world.header.epoch_constraints_version);
        for (free, state) in self.robots.iter_mut().zip(world.robots()) {
            *free = (state.epoch_free == 1).then(|| vec(state.epoch_position));
        }
        self.graph.clear();
        for (id, object) in world.objects().iter().enumerate() {
            let task = Task::at_epoch(object);
            self.tasks[id] = task;
            self.pool[id] = task.open.filter(|_| !task.held);
            if task.open.is_some() {
                self.graph.add_task(id);
            }
        }
        for &(before, after) in &self.ordered {
            add_edge(&mut self.graph, &self.tasks, before, after);
        }
        if self.method != Method::NoAction {
            for constraint in table.constraints() {
                let (before, after) = (constraint.before as usize, constraint.after as usize);
                add_edge(&mut self.graph, &self.tasks, before, after);
            }
        }
        self.lengths.begin();
        self.assignment
            .begin(self.robots.iter().map(Option::is_some));
        self.handed = 0;
        self.meter.reset();
        self.stage = Stage::Lengths;
    }

    /// Goes on within `budget`; ready when every robot's task is known, and again at no cost
    /// until the next [`Selection::begin`].
    pub fn advance(
        &mut self,
        scene: &Scene,
        budget: &mut Budget,
        counters: &mut Counters,
    ) -> Poll<()> {
        loop {
            self.stage = match self.stage {
                Stage::Lengths => {
                    let asked = Asked {
                        tasks: &self.pool,
                        robots: &self.robots,
                    };
                    if self
                        .lengths
                        .advance(scene, &asked, budget, counters)
                        .is_pending()
                    {
                        return Poll::Pending;
                    }
                    self.begin_easy()
                }
                Stage::Easy => {
                    if self.easy.advance(scene, budget, counters).is_pending() {
                        return Poll::Pending;
                    }
                    self.add_easy(counters);
                    Stage::Priorities
                }
                Stage::Priorities => {
                    if !self.graph.advance(budget) {
                        return Poll::Pending;
                    }
                    self.begin_assignment();
                    Stage::Assignment
                }
                Stage::Assignment => {
                    if !self.meter.settle(budget) {
                        return Poll::Pending;
                    }
                    if self.hand_out_class() {
                        Stage::Assignment
                    } else {
                        counters.selections += 1;
                        Stage::Done
                    }
                }
                Stage::Done => return Poll::Ready(()),
            }
        }
    }

    /// The task that `robot` gets; none if it gets none, or held an object when the epoch
    /// opened (it keeps that task, rule 19), or selection still goes on.
    #[must_use]
    pub fn task_of(&self, robot: usize) -> Option<usize> {
        if self.stage == Stage::Done {
            self.assignment.task_of(robot)
        } else {
            None
        }
    }

    /// A cycle among the open tasks, each before the next and the last before the first; empty
    /// if there is none (rule 15).
    #[must_use]
    pub fn cycle(&self) -> &[usize] {
        self.graph.cycle()
    }

    fn begin_easy(&mut self) -> Stage {
        if !self.method.uses_easy() {
            return Stage::Priorities;
        }
        self.easy.begin(self.tasks.iter().map(|task| task.open));
        Stage::Easy
    }

    fn add_easy(&mut self, counters: &mut Counters) {
        let Self {
            easy, graph, tasks, ..
        } = self;
        easy.for_each(|_, before, after| {
            counters.easy_constraints += 1;
            add_edge(graph, tasks, before, after);
        });
    }

    /// Lists the selectable tasks (rules 13, 15, 18), highest priority first.
    fn begin_assignment(&mut self) {
        let Self {
            graph,
            pool,
            tasks,
            candidates,
            ..
        } = self;
        candidates.clear();
        for task in 0..pool.len() {
            let free = !graph.is_blocked(task) && !graph.is_unselectable(task);
            if pool[task].is_some() && free {
                candidates.push(Candidate::new(task, tasks[task].barred));
            }
        }
        candidates.sort_unstable_by(|a, b| {
            graph
                .priority(b.task)
                .cmp(graph.priority(a.task))
                .then(a.task.cmp(&b.task))
        });
    }

    /// Hands out the candidates of the next priority; whether there were any, and a robot.
    fn hand_out_class(&mut self) -> bool {
        let Self {
            graph,
            lengths,
            candidates,
            assignment,
            handed,
            meter,
            ..
        } = self;
        let rest = &mut candidates[*handed..];
        let Some(first) = rest.first().filter(|_| assignment.any_free()) else {
            return false;
        };
        let value = graph.priority(first.task);
        let end = rest.partition_point(|candidate| graph.priority(candidate.task) == value);
        let pairs =
            assignment.hand_out(&mut rest[..end], |task, robot| lengths.length(task, robot));
        meter.charge(pairs.div_ceil(PAIRS_PER_UNIT));
        *handed += end;
        true
    }
}

impl Task {
    fn at_epoch(object: &ObjectState) -> Self {
        Self {
            open: Places::of(object, object.epoch_status),
            held: object.epoch_status == TaskStatus::Held.code(),
            barred: object.epoch_barred,
        }
    }
}

/// Adds an edge unless it leads into a held task (rule 9).
fn add_edge(graph: &mut PriorityGraph, tasks: &[Task], before: usize, after: usize) {
    if !tasks[after].held {
        graph.add_edge(before, after);
    }
}
