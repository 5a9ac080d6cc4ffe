//! Planning anew, where what the plan assumes is no longer so.
//!
//! Responsible for: noticing it, stopping robots, waiting until they stand still.
//! Not responsible for: planning, which then begins as at the start (the parent module).

use shm_types::{Checked, RobotSchedule, RobotState, Schedule, Verdict, WorldSnapshot};

use crate::anytime::situation::stands_still;
use crate::anytime::{Anytime, Stage};

/// Ticks for which nothing may change before it counts as standing still.
const TICKS_TO_SETTLE: u64 = 20;
/// World time for which nothing may change while a plan for all objects is not carried out before
/// it counts as one that robots cannot follow, ns: some process did something else than it says.
/// Each time it comes to that it is doubled.
pub(super) const DOUBT_NS: u64 = 2_000_000_000;

impl Anytime {
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
        let is_on_its_way = matches!(self.stage, Stage::Inherited | Stage::Stop);
        self.stage = match snapshot.header.schedule_version {
            // Nothing is followed, nor on its way.
            0 if self.script.is_none() && !is_on_its_way => Stage::New,
            _ => Stage::Stop,
        };
        // No more of it is listed.
        self.script = None;
    }

    /// Robots follow what an earlier process has published. If that is all of its plan they are left
    /// to it; else nobody knows what comes after.
    pub(crate) fn inherit(&mut self, published: &Schedule) {
        let robots = &published.robots[..published.robot_count as usize];
        let is_all = robots.iter().all(|part| part.complete == 1);
        self.stage = if is_all {
            Stage::Inherited
        } else {
            Stage::Stop
        };
    }

    /// Whether other robots take part than did when this was asked last.
    pub(super) fn is_other_team(&mut self, robots: &[RobotState]) -> bool {
        let is_same = (self.team.iter()).eq(robots.iter().map(|robot| &robot.live));
        let is_first = self.team.is_empty();
        if !is_same {
            self.team.clear();
            self.team.extend(robots.iter().map(|robot| robot.live));
        }
        !is_same && !is_first
    }

    /// Whether robots stand still although they have a plan that brings all objects to their goals.
    pub(super) fn is_doubtful(&mut self, snapshot: Checked<WorldSnapshot>) -> bool {
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
    pub(super) fn stop(&mut self, snapshot: Checked<WorldSnapshot>, out: &mut Schedule) {
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
        self.rollouts.reset();
        self.begun_ns = None;
        self.stage = Stage::Settle(u64::MAX, 0);
    }

    /// Whether everybody stands still, and has for a while.
    pub(super) fn has_settled(&mut self, snapshot: Checked<WorldSnapshot>) -> bool {
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
}
