//! Planning ahead for all robots: the method `anytime`.
//!
//! Responsible for: a first plan, better ones while robots set off with it, the schedule that they
//! follow.
//! Not responsible for: following it (crate `robot`), granting space (crate `world`).
//!
//! How: `sequence` finds moves that can be made one after the other, `order` says who makes which,
//! `plan` commits them in space and time, each around all that was committed before, so that
//! robots move at the same time (rule 31). What takes long is a good order. Robots set off with the
//! first one, and are told no more of it than they need until the next round of looking for better
//! ones is over: all the rest can still change.
//!
//! Unlike what the paper's methods compute with, this allocates while it plans.

mod anew;
mod asides;
mod cuts;
mod distances;
mod greedy;
mod ground;
mod improve;
mod incumbent;
mod joint;
mod keep;
mod known;
mod order;
mod plan;
mod publish;
mod rounds;
mod route;
mod sequence;
mod shortest;
mod situation;
mod solver;
mod timeline;
mod track;
mod tried;

use scene::{Budget, Scene, Settings};
use shm_types::{Checked, Counters, RobotSchedule, RobotState, Schedule, Verdict, WorldSnapshot};

use crate::anytime::anew::DOUBT_NS;
use crate::anytime::incumbent::Rollouts;
use crate::anytime::publish::Script;
use crate::anytime::rounds::{ROUND_S, patience_s};
use crate::anytime::situation::Situation;
use crate::anytime::solver::Solver;
use crate::proof::Proof;
use crate::rollout::BeginRollout;

/// A plan of the fewest steps is looked for until this much is spent before anybody moves, s.
const MOST_BEFORE_MOTION_S: f64 = 1.0;
/// World time after which no first plan is looked for any more, s.
const MOST_S: u64 = 60;
/// Attempts at a first plan before a proof is looked for that there is none.
const ATTEMPTS_BEFORE_PROOF: u64 = 3;
/// The same before the complete search begins.
const ATTEMPTS_BEFORE_SEARCH: u64 = 8;
/// One configuration of the complete search, in work units.
const UNITS_PER_CONFIGURATION: u64 = 40;
/// One configuration of the search for a shortest plan, in work units.
const UNITS_PER_SMALL_CONFIGURATION: u64 = 13;
/// One piece of a way that is reserved again, in work units.
const UNITS_PER_PIECE: u64 = 4;
/// One safe interval expanded, in work units.
const UNITS_PER_INTERVAL: u64 = 7;

/// What comes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Robots follow a plan that an earlier process of the planner made, all of which they know.
    Inherited,
    /// Robots are to go no further than is granted to them, since something has changed.
    Stop,
    /// They stand still, if nothing changes until this tick, as of this number of changes.
    Settle(u64, u64),
    /// Taking in the scene, and where everything stands.
    New,
    /// A first plan: so many attempts were made.
    First(u64),
    /// A proof that there is none.
    Prove,
    /// A first plan by the complete search.
    Search,
    /// A shortest one, of a small room in which everything takes as long.
    Shorten,
    /// Plans out of what the paper's methods come to.
    Rollout,
    /// Better ones, if these come to more: until that many units are spent in all.
    CatchUp(u64),
    /// Writing it down.
    Write,
    /// Robots follow it; better ones are looked for in rounds, until that many units are spent in
    /// all.
    Follow(u64),
    /// A round, until so many units are spent, and the same.
    Round(u64, u64),
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
    /// Where everything stood when planning began.
    situation: Situation,
    /// Whether the next plan is looked for without margins, since there is none with them.
    is_tight: bool,
    /// By robot, 1 if it takes part.
    team: Vec<u32>,
    /// Whether the plan is one for all objects.
    verdict: Verdict,
    stage: Stage,
    /// Units done and not paid for.
    debt: u64,
    /// What was done in all since planning began.
    done: Counters,
    /// What looking for a proof that there is no plan has taken.
    proving: Counters,
    rollouts: Rollouts,
    /// The plan as it is published, once it is.
    script: Option<Script>,
    /// The one before, until the new one is in force.
    replaced: Option<Script>,
    /// When robots began to follow, ns.
    begun_ns: Option<u64>,
    /// The newest number of changes seen, and since when, ns.
    quiet: (u64, u64),
    /// For how long that may go on, ns.
    doubt_ns: u64,
}

impl Anytime {
    pub(crate) fn new(settings: &Settings) -> Self {
        Self {
            settings: settings.clone(),
            solver: None,
            situation: Situation::default(),
            is_tight: false,
            team: Vec::new(),
            verdict: Verdict::Open,
            stage: Stage::New,
            debt: 0,
            done: Counters::default(),
            proving: Counters::default(),
            rollouts: Rollouts::new(None),
            script: None,
            replaced: None,
            begun_ns: None,
            quiet: (0, 0),
            doubt_ns: DOUBT_NS,
        }
    }

    /// The same, which begins with what the paper's methods come to if that is better.
    pub(crate) fn with_rollouts(self, begin: BeginRollout) -> Self {
        Self {
            rollouts: Rollouts::new(Some(begin)),
            ..self
        }
    }

    /// Goes on within `budget`; what is to be published is written to `out`, all but its version
    /// and tick. Robots follow what was published before, if anything was.
    pub(crate) fn advance(
        &mut self,
        scene: &Scene,
        snapshot: Checked<WorldSnapshot>,
        budget: &mut Budget,
        counters: &mut Counters,
        out: &mut Schedule,
    ) -> Standing {
        if self.is_other_team(snapshot.robots()) || self.is_doubtful(snapshot) {
            self.replan(snapshot);
        }
        loop {
            let paid = self.debt.min(budget.left());
            budget.spend(paid);
            self.debt -= paid;
            if self.stage == Stage::Inherited {
                return Standing::Idle(Verdict::Open);
            }
            if let Stage::Done(verdict) = self.stage {
                let is_open = verdict == Verdict::Open;
                return Standing::Idle(if is_open { self.verdict } else { verdict });
            }
            if !self.has_settled(snapshot) {
                return Standing::Busy;
            }
            if self.debt > 0 || budget.is_spent() {
                return match self.script {
                    None => Standing::Busy,
                    Some(_) => Standing::Idle(self.verdict),
                };
            }
            if self.work(scene, snapshot, counters, out) {
                return Standing::Written;
            }
        }
    }

    /// Lists the actions that come after those in `out`, if some robot has got through half of
    /// what is listed there and there is more. Whether anything was written.
    pub(crate) fn list_more(&mut self, robots: &[RobotState], out: &mut Schedule) -> bool {
        self.replaced = None;
        let Some(script) = &self.script else {
            return false;
        };
        let is_short = |(robot, (state, listed)): (usize, (&RobotState, &RobotSchedule))| {
            listed.first + listed.count < script.listable(robot)
                && state.actions >= listed.first + listed.count / 2
        };
        // A robot that has come since is in no list.
        let listed = &out.robots[..out.robot_count as usize];
        let is_due = robots.iter().zip(listed).enumerate().any(is_short);
        if is_due {
            script.write(|robot| robots[robot].actions, out);
        }
        is_due
    }

    /// A piece of work. Whether something is to be published.
    fn work(
        &mut self,
        scene: &Scene,
        snapshot: Checked<WorldSnapshot>,
        counters: &mut Counters,
        out: &mut Schedule,
    ) -> bool {
        match self.stage {
            Stage::Stop => {
                self.stop(snapshot, out);
                return true;
            }
            Stage::New => {
                self.situation = Situation::of(&snapshot);
                self.situation.needs_margins = !std::mem::take(&mut self.is_tight)
                    && scene.lattice.exact
                    && self.situation.is_beside(scene);
                let situation = &self.situation;
                self.solver = Solver::new(scene, &self.settings, situation).map(Box::new);
                self.done = Counters::default();
                self.verdict = Verdict::Open;
                self.proving = Counters::default();
                self.rollouts.reset();
                self.stage = Stage::First(0);
                return false;
            }
            _ => {}
        }
        let Some(mut solver) = self.solver.take() else {
            self.stage = Stage::Done(Verdict::NotFound);
            return false;
        };
        let is_written = self.work_with(&mut solver, scene, snapshot, out);
        let done = solver.work() + self.proving + self.rollouts.work();
        let new = done - self.done;
        self.debt += new.units;
        // These are counted as they are paid for.
        *counters += Counters { units: 0, ..new };
        self.done = done;
        self.solver = Some(solver);
        is_written
    }

    fn work_with(
        &mut self,
        solver: &mut Solver,
        scene: &Scene,
        snapshot: Checked<WorldSnapshot>,
        out: &mut Schedule,
    ) -> bool {
        let units_per_second = self.settings.units_per_second;
        let units = |s: f64| (s * units_per_second as f64) as u64;
        let mut is_written = false;
        self.stage = match self.stage {
            Stage::First(attempt) => match solver.first(scene, attempt) {
                Some(_) => Stage::Shorten,
                None => self.go_on_after(attempt + 1, solver, scene),
            },
            Stage::Prove => {
                let (proof, work) = Proof::search(scene);
                self.proving = Counters {
                    units: work.cells_expanded,
                    ..work
                };
                match proof {
                    Some(_) => Stage::Done(Verdict::Proved),
                    None => Stage::First(ATTEMPTS_BEFORE_PROOF),
                }
            }
            Stage::Search => match solver.search(scene) {
                None => Stage::Search,
                Some(Ok(_)) => Stage::Shorten,
                Some(Err(Verdict::Exhausted)) => Stage::Done(Verdict::Exhausted),
                Some(Err(_)) => Stage::First(ATTEMPTS_BEFORE_SEARCH),
            },
            Stage::Shorten
                if solver.units() < units(MOST_BEFORE_MOTION_S) && solver.shorten(scene) =>
            {
                Stage::Shorten
            }
            Stage::Shorten | Stage::Rollout
                if self.rollouts.advance(scene, &self.settings, solver) =>
            {
                Stage::Rollout
            }
            Stage::Shorten | Stage::Rollout => {
                Stage::CatchUp(solver.units() + units(self.rollouts.catching_up_s()))
            }
            Stage::CatchUp(until)
                if solver.units() < until
                    && self.rollouts.lags(solver)
                    && solver.improve(scene) =>
            {
                Stage::CatchUp(until)
            }
            Stage::CatchUp(_) => Stage::Write,
            Stage::Write => match solver.restore() {
                None => Stage::Done(Verdict::NotFound),
                Some(makespan) => {
                    let (ground, plan) = (&solver.ground, &solver.plan);
                    let mut script = Script::of(scene, ground, plan, &self.situation);
                    script.limit(plan.tracks(), self.next(solver, snapshot));
                    let robots = snapshot.robots();
                    script.write(|robot| robots[robot].actions, out);
                    self.script = Some(script);
                    is_written = true;
                    let most_s = patience_s(solver.ground.seconds(makespan));
                    Stage::Follow(solver.units() + units(most_s))
                }
            },
            Stage::Follow(last) => {
                if solver.units() < last && self.begin_round(solver, scene, snapshot) {
                    Stage::Round(solver.units() + units(ROUND_S), last)
                } else {
                    is_written = self.list_all(snapshot, out);
                    Stage::Done(Verdict::Open)
                }
            }
            Stage::Round(until, last) if solver.units() < until && solver.improve(scene) => {
                Stage::Round(until, last)
            }
            Stage::Round(until, last) => {
                let is_exhausted = solver.units() < until;
                let is_better = self.take_better(solver, scene, snapshot, out);
                if is_exhausted && !is_better {
                    is_written = self.list_all(snapshot, out);
                    Stage::Done(Verdict::Open)
                } else {
                    is_written = is_better || self.list_on(solver, snapshot, out);
                    Stage::Follow(last)
                }
            }
            Stage::Inherited | Stage::Stop | Stage::Settle(..) | Stage::New | Stage::Done(_) => {
                self.stage
            }
        };
        is_written
    }

    /// What comes after so many attempts at a first plan that found none.
    fn go_on_after(&mut self, attempts: u64, solver: &mut Solver, scene: &Scene) -> Stage {
        let most = self.settings.units_per_second.saturating_mul(MOST_S);
        match attempts {
            ATTEMPTS_BEFORE_PROOF if self.situation.needs_margins => {
                self.is_tight = true;
                Stage::New
            }
            ATTEMPTS_BEFORE_PROOF if solver.is_short => self.most(solver, scene),
            ATTEMPTS_BEFORE_PROOF if solver.is_start => Stage::Prove,
            ATTEMPTS_BEFORE_SEARCH => Stage::Search,
            _ if solver.units() < most => Stage::First(attempts),
            _ => self.most(solver, scene),
        }
    }

    /// There is no plan for all objects: as many as possible are brought to their goals.
    fn most(&mut self, solver: &mut Solver, scene: &Scene) -> Stage {
        self.verdict = Verdict::NotFound;
        match solver.most(scene) {
            Some(_) => Stage::Write,
            None => Stage::Done(Verdict::NotFound),
        }
    }
}
