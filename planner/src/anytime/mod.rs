//! Planning ahead for all robots: the method `anytime`.
//!
//! Responsible for: a first plan, better ones for as long as that pays before anybody moves, the
//! schedule that robots follow.
//! Not responsible for: following it (crate `robot`), granting space (crate `world`).
//!
//! How: `sequence` finds moves that can be made one after the other, `order` says who makes which,
//! `plan` commits them in space and time, each around all that was committed before, so that
//! robots move at the same time (rule 31). What takes long is the order: it is searched for as long
//! as what it can still save is worth more than the waiting.
//!
//! Unlike what the paper's methods compute with, this allocates while it plans.

mod ground;
mod joint;
mod order;
mod plan;
mod publish;
mod route;
mod sequence;
mod solver;
mod timeline;

use scene::{Budget, Scene, Settings};
use shm_types::{Counters, RobotSchedule, RobotState, Schedule, Verdict};

use crate::anytime::publish::Script;
use crate::anytime::solver::Solver;

/// Share of the makespan that is spent on improving the plan before anybody moves.
const PATIENCE: f64 = 0.015;
/// World time after which no first plan is looked for any more, s.
const MOST_S: u64 = 60;
/// Sequences looked for before the complete search begins.
const ATTEMPTS_BEFORE_SEARCH: u64 = 3;
/// One configuration of the complete search, in work units.
const UNITS_PER_CONFIGURATION: u64 = 40;
/// One safe interval expanded, in work units.
const UNITS_PER_INTERVAL: u64 = 12;

/// What comes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Taking in the scene.
    New,
    /// A first plan: so many attempts were made.
    First(u64),
    /// A first plan by the complete search.
    Search,
    /// Better ones, until that many units are spent in all.
    Better(u64),
    /// Writing it down.
    Write,
    /// Nothing.
    Done(Verdict),
}

/// How planning stands after a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Standing {
    /// It goes on.
    Busy,
    /// A schedule was written.
    Written,
    /// There is nothing to do.
    Idle(Verdict),
}

/// The planner of schedules as a step machine. A piece of work that is larger than a budget is
/// done at once and paid for over the steps that follow.
pub(crate) struct Anytime {
    settings: Settings,
    solver: Option<Box<Solver>>,
    stage: Stage,
    /// Units done and not paid for.
    debt: u64,
    /// Units done in all.
    spent: u64,
    /// The plan as it is published, once it is.
    script: Option<Script>,
    /// Cells expanded and ways looked for in all.
    cells: u64,
    ways: u64,
}

impl Anytime {
    pub(crate) fn new(settings: &Settings) -> Self {
        Self {
            settings: settings.clone(),
            solver: None,
            stage: Stage::New,
            debt: 0,
            spent: 0,
            script: None,
            cells: 0,
            ways: 0,
        }
    }

    /// Goes on within `budget`; what is to be published is written to `out`, all but its version
    /// and tick.
    pub(crate) fn advance(
        &mut self,
        scene: &Scene,
        budget: &mut Budget,
        counters: &mut Counters,
        out: &mut Schedule,
    ) -> Standing {
        loop {
            let paid = self.debt.min(budget.left());
            budget.spend(paid);
            self.debt -= paid;
            if let Stage::Done(verdict) = self.stage {
                return Standing::Idle(verdict);
            }
            if self.debt > 0 || budget.is_spent() {
                return Standing::Busy;
            }
            let written = self.stage == Stage::Write;
            let before = self.spent;
            self.work(scene, counters, out);
            self.debt += self.spent - before;
            if written && !matches!(self.stage, Stage::Done(Verdict::NotFound)) {
                return Standing::Written;
            }
        }
    }

    /// Lists the actions that come after those in `out`, if some robot has got through half of
    /// what is listed there and there is more. Whether anything was written.
    pub(crate) fn list_more(&self, robots: &[RobotState], out: &mut Schedule) -> bool {
        let Some(script) = &self.script else {
            return false;
        };
        let is_short = |(state, listed): (&RobotState, &RobotSchedule)| {
            listed.complete == 0 && state.actions >= listed.first + listed.count / 2
        };
        let is_due = robots.iter().zip(&out.robots).any(is_short);
        if is_due {
            script.write(|robot| robots[robot].actions, out);
        }
        is_due
    }

    fn work(&mut self, scene: &Scene, counters: &mut Counters, out: &mut Schedule) {
        if self.stage == Stage::New {
            self.solver = Solver::new(scene, &self.settings).map(Box::new);
            self.stage = Stage::First(0);
            return;
        }
        let Some(solver) = self.solver.as_deref_mut() else {
            self.stage = Stage::Done(Verdict::NotFound);
            return;
        };
        let units_per_second = self.settings.units_per_second as f64;
        let better = |solver: &Solver, makespan| {
            let worth_s = solver.ground.seconds(makespan) * PATIENCE;
            Stage::Better(solver.units() + (worth_s * units_per_second) as u64)
        };
        let most = self.settings.units_per_second.saturating_mul(MOST_S);
        self.stage = match self.stage {
            Stage::First(attempt) => match solver.first(scene, attempt) {
                Some(makespan) => better(solver, makespan),
                None if attempt + 1 < ATTEMPTS_BEFORE_SEARCH => Stage::First(attempt + 1),
                None if attempt + 1 == ATTEMPTS_BEFORE_SEARCH => Stage::Search,
                None if solver.units() < most => Stage::First(attempt + 1),
                None => Stage::Done(Verdict::NotFound),
            },
            Stage::Search => match solver.search(scene) {
                None => Stage::Search,
                Some(Ok(makespan)) => better(solver, makespan),
                Some(Err(Verdict::Exhausted)) => Stage::Done(Verdict::Exhausted),
                Some(Err(_)) => Stage::First(ATTEMPTS_BEFORE_SEARCH),
            },
            Stage::Better(until) => {
                if solver.units() < until && solver.improve(scene) {
                    Stage::Better(until)
                } else {
                    Stage::Write
                }
            }
            Stage::Write => {
                let script =
                    (solver.restore()).map(|()| Script::of(scene, &solver.ground, &solver.plan));
                let verdict = if script.is_some() {
                    Verdict::Open
                } else {
                    Verdict::NotFound
                };
                if let Some(script) = &script {
                    script.write(|_| 0, out);
                }
                self.script = script;
                Stage::Done(verdict)
            }
            Stage::New | Stage::Done(_) => self.stage,
        };
        counters.cells_expanded += solver.cells() - self.cells;
        counters.path_plans += solver.ways() - self.ways;
        (self.cells, self.ways) = (solver.cells(), solver.ways());
        self.spent = solver.units();
    }
}
