//! Better plans while robots follow the one before, in rounds.
//!
//! Responsible for: what a round begins from and what comes of it; how much of the plan is listed
//! meanwhile.
//! Not responsible for: what is tried (`improve`), what robots keep (`keep`).
//!
//! How: until the last round is over, robots are told no more of their plan than what begins before
//! the present one can be over. All the rest can still change, so setting off costs next to nothing.

use scene::Scene;
use shm_types::{Checked, Schedule, WorldSnapshot};

use crate::anytime::Anytime;
use crate::anytime::ground::Time;
use crate::anytime::keep::kept;
use crate::anytime::publish::Script;
use crate::anytime::solver::Solver;

/// Share of the makespan for which better plans are looked for while robots follow the first one.
const PATIENCE: f64 = 0.06;
/// At most, s.
pub(super) const MOST_PATIENCE_S: f64 = 10.0;
/// World time that improving takes between two looks at where robots are, s.
pub(super) const ROUND_S: f64 = 0.25;
/// From when a round begins until robots may follow what it found, beyond its work, s.
const REACTION_S: f64 = 0.25;

/// For how long better plans are looked for.
pub(super) fn patience_s(makespan_s: f64) -> f64 {
    (makespan_s * PATIENCE).min(MOST_PATIENCE_S)
}

impl Anytime {
    /// Begins to look for a better plan that goes on from where robots will be by then. False if
    /// there is nothing to improve.
    pub(super) fn begin_round(
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
    pub(super) fn next(&self, solver: &Solver, snapshot: Checked<WorldSnapshot>) -> (Time, u64) {
        let header = &snapshot.header;
        let since_ns = (self.begun_ns).map_or(0, |begun_ns| header.time_ns - begun_ns);
        let ahead_s = ROUND_S + REACTION_S;
        let ticks = (ahead_s * 1e9) as u64 / self.settings.tick_ns.max(1);
        let until = solver.ground.time(since_ns as f64 * 1e-9 + ahead_s);
        (until, header.tick + ticks)
    }

    /// Writes down what a round has found, if that is better: it keeps all that was listed before.
    pub(super) fn take_better(
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
    pub(super) fn list_on(
        &mut self,
        solver: &Solver,
        snapshot: Checked<WorldSnapshot>,
        out: &mut Schedule,
    ) -> bool {
        let until = self.next(solver, snapshot);
        self.list(snapshot, out, |script| {
            script.limit(solver.followed(), until)
        })
    }

    /// Lists all of the plan. Whether it did: it may be listed already.
    pub(super) fn list_all(
        &mut self,
        snapshot: Checked<WorldSnapshot>,
        out: &mut Schedule,
    ) -> bool {
        self.list(snapshot, out, Script::lift_limit)
    }

    fn list(
        &mut self,
        snapshot: Checked<WorldSnapshot>,
        out: &mut Schedule,
        more: impl FnOnce(&mut Script),
    ) -> bool {
        let Some(script) = self.script.as_mut().filter(|script| script.is_limited()) else {
            return false;
        };
        more(script);
        let robots = snapshot.robots();
        script.write(|robot| robots[robot].actions, out);
        true
    }
}
