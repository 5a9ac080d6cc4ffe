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

mod asides;
mod ground;
mod improve;
mod joint;
mod keep;
mod known;
mod order;
mod plan;
mod publish;
mod route;
mod sequence;
mod shortest;
mod situation;
mod solver;
mod timeline;
mod track;

use scene::{Budget, Scene, Settings};
use shm_types::{Checked, Counters, RobotSchedule, RobotState, Schedule, Verdict, WorldSnapshot};

use crate::anytime::ground::Time;
use crate::anytime::keep::kept;
use crate::anytime::publish::Script;
use crate::anytime::situation::{Situation, stands_still};
use crate::anytime::solver::Solver;
use crate::proof::Proof;

/// A plan of the fewest steps is looked for until this much is spent before anybody moves, s.
const MOST_BEFORE_MOTION_S: f64 = 1.0;
/// Share of the makespan for which better plans are looked for while robots follow the first one.
const PATIENCE: f64 = 0.06;
/// At most, s.
const MOST_PATIENCE_S: f64 = 10.0;
/// World time that improving takes between two looks at where robots are, s.
const ROUND_S: f64 = 0.25;
/// From when a round begins until robots may follow what it found, beyond its work, s.
const REACTION_S: f64 = 0.25;
/// World time after which no first plan is looked for any more, s.
const MOST_S: u64 = 60;
/// Attempts at a first plan before a proof is looked for that there is none.
const ATTEMPTS_BEFORE_PROOF: u64 = 3;
/// The same before the complete search begins.
const ATTEMPTS_BEFORE_SEARCH: u64 = 8;
/// Ticks for which nothing may change before it counts as standing still.
const TICKS_TO_SETTLE: u64 = 20;
/// World time for which nothing may change while a plan for all objects is not carried out before
/// it counts as one that robots cannot follow, ns: some process did something else than it says.
/// Each time it comes to that it is doubled.
const DOUBT_NS: u64 = 2_000_000_000;
/// One configuration of the complete search, in work units.
const UNITS_PER_CONFIGURATION: u64 = 40;
/// One configuration of the search for a shortest plan, in work units.
const UNITS_PER_SMALL_CONFIGURATION: u64 = 10;
/// One piece of a way that is reserved again, in work units.
const UNITS_PER_PIECE: u64 = 4;
/// One safe interval expanded, in work units.
const UNITS_PER_INTERVAL: u64 = 7;

/// What comes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Robots follow a plan that an earlier process of the planner made.
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

/// For how long better plans are looked for.
fn patience_s(makespan_s: f64) -> f64 {
    (makespan_s * PATIENCE).min(MOST_PATIENCE_S)
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
    /// By robot, 1 if it takes part.
    team: Vec<u32>,
    /// Whether the plan is one for all objects.
    verdict: Verdict,
    stage: Stage,
    /// Units done and not paid for.
    debt: u64,
    /// Units done in all.
    spent: u64,
    /// What looking for a proof that there is no plan has taken.
    proving: Counters,
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
    /// Cells expanded and ways looked for in all.
    cells: u64,
    ways: u64,
}

impl Anytime {
    pub(crate) fn new(settings: &Settings) -> Self {
        Self {
            settings: settings.clone(),
            solver: None,
            situation: Situation::default(),
            team: Vec::new(),
            verdict: Verdict::Open,
            stage: Stage::New,
            debt: 0,
            spent: 0,
            proving: Counters::default(),
            script: None,
            replaced: None,
            begun_ns: None,
            quiet: (0, 0),
            doubt_ns: DOUBT_NS,
            cells: 0,
            ways: 0,
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

    /// What was published was refused: goes back to the plan before, or else plans anew.
    pub(crate) fn take_back(&mut self, snapshot: Checked<WorldSnapshot>, out: &mut Schedule) {
        if self.stage != Stage::Stop
            && let Some(mut script) = self.replaced.take()
        {
            script.lift_limit();
            let robots = snapshot.robots();
            script.write(|robot| robots[robot].actions, out);
            self.script = Some(script);
            self.stage = Stage::Done(Verdict::Open);
        } else {
            self.stop(snapshot, out);
        }
    }

    /// Plans anew from where everything is, since what the plan assumes is no longer so.
    pub(crate) fn replan(&mut self, snapshot: Checked<WorldSnapshot>) {
        self.stage = match snapshot.header.schedule_version {
            // Nothing is followed, nor on its way.
            0 if self.script.is_none() => Stage::New,
            _ => Stage::Stop,
        };
    }

    /// An earlier process made the plan that robots follow, which this one knows nothing of: it
    /// leaves them to it, and plans anew once they stand still.
    pub(crate) fn inherit(&mut self) {
        if self.stage == Stage::New && self.script.is_none() {
            self.stage = Stage::Inherited;
        }
    }

    /// Whether other robots take part than did when this was asked last.
    fn is_other_team(&mut self, robots: &[RobotState]) -> bool {
        let is_same = (self.team.iter()).eq(robots.iter().map(|robot| &robot.live));
        let is_first = self.team.is_empty();
        if !is_same {
            self.team.clear();
            self.team.extend(robots.iter().map(|robot| robot.live));
        }
        !is_same && !is_first
    }

    /// Whether robots stand still although they have a plan that brings all objects to their goals.
    fn is_doubtful(&mut self, snapshot: Checked<WorldSnapshot>) -> bool {
        let header = &snapshot.header;
        let follows = matches!(
            self.stage,
            Stage::Inherited | Stage::Follow(_) | Stage::Round(..) | Stage::Done(Verdict::Open)
        );
        let is_on_its_way =
            header.change != self.quiet.0 || header.held == 1 || !stands_still(&snapshot);
        if !follows || self.verdict != Verdict::Open || is_on_its_way {
            self.quiet = (header.change, header.time_ns);
            return false;
        }
        if header.time_ns < self.quiet.1 + self.doubt_ns {
            return false;
        }
        self.doubt_ns = self.doubt_ns.saturating_mul(2);
        true
    }

    /// Lists nothing: robots go no further than is granted to them.
    fn stop(&mut self, snapshot: Checked<WorldSnapshot>, out: &mut Schedule) {
        let robots = snapshot.robots();
        out.robot_count = robots.len() as u32;
        (out.action_count, out.wait_count) = (0, 0);
        out.listed_until_tick = 0;
        for (listed, state) in out.robots.iter_mut().zip(robots) {
            *listed = RobotSchedule {
                first: state.actions,
                ..RobotSchedule::default()
            };
        }
        self.script = None;
        self.replaced = None;
        self.solver = None;
        self.begun_ns = None;
        self.stage = Stage::Settle(u64::MAX, 0);
    }

    /// Whether everybody stands still, and has for a while.
    fn has_settled(&mut self, snapshot: Checked<WorldSnapshot>) -> bool {
        let header = &snapshot.header;
        let Stage::Settle(until, change) = self.stage else {
            return true;
        };
        if until == u64::MAX || change != header.change || !stands_still(&snapshot) {
            self.stage = Stage::Settle(header.tick + TICKS_TO_SETTLE, header.change);
            return false;
        }
        if header.tick < until {
            return false;
        }
        self.stage = Stage::New;
        true
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
                let situation = &self.situation;
                self.solver = Solver::new(scene, &self.settings, situation).map(Box::new);
                (self.spent, self.cells, self.ways) = (0, 0, 0);
                self.verdict = Verdict::Open;
                self.proving = Counters::default();
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
        let cells = solver.cells() + self.proving.cells_expanded;
        let ways = solver.ways() + self.proving.path_plans;
        counters.cells_expanded += cells - self.cells;
        counters.path_plans += ways - self.ways;
        (self.cells, self.ways) = (cells, ways);
        let spent = solver.units() + self.proving.cells_expanded;
        self.debt += spent - self.spent;
        self.spent = spent;
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
                self.proving = work;
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
            Stage::Shorten => Stage::Write,
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
                    is_written = self.list_all(snapshot.robots(), out);
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
                    is_written = self.list_all(snapshot.robots(), out);
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

    /// Begins to look for a better plan that goes on from where robots will be by then. False if
    /// there is nothing to improve.
    fn begin_round(
        &mut self,
        solver: &mut Solver,
        scene: &Scene,
        snapshot: Checked<WorldSnapshot>,
    ) -> bool {
        self.begun_ns.get_or_insert(snapshot.header.time_ns);
        let (until, _) = self.next(solver, snapshot);
        let Some(script) = &self.script else {
            return false;
        };
        solver.go_on(scene, until, |tracks| kept(script, tracks, until))
    }

    /// Until when robots go on as they were told: a round that begins now is over by then, and what
    /// it found is in force. As time in the plan, and as a tick.
    fn next(&self, solver: &Solver, snapshot: Checked<WorldSnapshot>) -> (Time, u64) {
        let header = &snapshot.header;
        let since_ns = (self.begun_ns).map_or(0, |begun_ns| header.time_ns - begun_ns);
        let ahead_s = ROUND_S + REACTION_S;
        let ticks = (ahead_s * 1e9) as u64 / self.settings.tick_ns.max(1);
        let until = solver.ground.time(since_ns as f64 * 1e-9 + ahead_s);
        (until, header.tick + ticks)
    }

    /// Writes down what a round has found, if that is better: it keeps all that was listed before.
    fn take_better(
        &mut self,
        solver: &mut Solver,
        scene: &Scene,
        snapshot: Checked<WorldSnapshot>,
        out: &mut Schedule,
    ) -> bool {
        let Some(script) = &self.script else {
            return false;
        };
        if !solver.has_better() || solver.restore().is_none() {
            return false;
        }
        let mut better = script.go_on(scene, &solver.ground, &solver.plan);
        let robots = snapshot.robots();
        solver.accept_better();
        better.limit(solver.followed(), self.next(solver, snapshot));
        better.write_new(|robot| robots[robot].actions, out);
        self.replaced = self.script.replace(better);
        true
    }

    /// Lists what robots need of their plan until the end of the next round. Whether it did: all
    /// may be listed.
    fn list_on(
        &mut self,
        solver: &Solver,
        snapshot: Checked<WorldSnapshot>,
        out: &mut Schedule,
    ) -> bool {
        let until = self.next(solver, snapshot);
        let Some(script) = self.script.as_mut().filter(|script| script.is_limited()) else {
            return false;
        };
        script.limit(solver.followed(), until);
        let robots = snapshot.robots();
        script.write(|robot| robots[robot].actions, out);
        true
    }

    /// Lists all of the plan. Whether it did: it may be listed already.
    fn list_all(&mut self, robots: &[RobotState], out: &mut Schedule) -> bool {
        let Some(script) = self.script.as_mut().filter(|script| script.is_limited()) else {
            return false;
        };
        script.lift_limit();
        script.write(|robot| robots[robot].actions, out);
        true
    }
}
