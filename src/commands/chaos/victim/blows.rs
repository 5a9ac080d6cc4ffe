//! Striking the processes of a run.
//!
//! Responsible for: who is struck next and when, whether a blow still comes in time, dealing it.
//! Not responsible for: what is known of the run (`victim`), which blows there are (`plan`).

use std::time::Instant;

use node::Role;
use rustix::process::Signal;

use crate::cli::{Phase, Target};
use crate::commands::chaos::plan::{How, Plan};
use crate::commands::chaos::victim::{
    Armed, Dealt, Victim, run_arguments, signal, spawn, target_of,
};

/// Longest wait before a blow in steady state.
const STEADY_MS: f64 = 40.0;
/// Longest stall.
const STALL_MS: f64 = 120.0;
/// Blows in set-up after one start of the whole set: enough for one run.
const PER_SET_UP: usize = 24;
/// Blows after which a run is left in peace until its end.
const PER_RUN: usize = 100;

impl Victim<'_> {
    /// Chooses who is struck next, and when.
    pub(super) fn arm(&mut self, plan: &mut Plan) {
        if self.done_ns.is_some() || self.dealt.len() >= PER_RUN {
            return;
        }
        if self.set_up_blows < PER_SET_UP {
            self.arm_in_set_up(plan);
        }
        let is_calm = self.armed.is_empty() && self.stalled.is_empty();
        if is_calm && self.is_steady() {
            self.arm_steady(plan);
        }
    }

    fn arm_in_set_up(&mut self, plan: &mut Plan) {
        let mut free: Vec<(Option<Role>, u32, u64)> = Vec::new();
        for (role, process) in &self.processes {
            if !process.ready && !process.dead {
                free.push((Some(*role), process.pid, process.started_ns));
            }
        }
        if !self.is_steady() || self.processes.is_empty() {
            free.push((None, self.supervisor.id(), self.supervised_ns));
        }
        for (role, pid, started_ns) in free {
            let is_armed = |armed: &Armed| armed.pid == pid;
            if self.armed.iter().any(is_armed) || self.set_up_blows >= PER_SET_UP {
                continue;
            }
            let target = role.map_or(Target::Supervisor, target_of);
            if let Some(blow) = plan.next(Phase::Setup, target) {
                let after_ns = (blow.at * self.set_ups.usual_ns(target) as f64) as u64;
                self.set_up_blows += 1;
                self.armed.push(Armed {
                    phase: Phase::Setup,
                    target,
                    blow,
                    role,
                    pid,
                    started_ns,
                    at_ns: started_ns + after_ns,
                });
            }
        }
    }

    fn arm_steady(&mut self, plan: &mut Plan) {
        // Whoever has had the fewest so far comes next.
        let mut targets = plan.targets.clone();
        let had = |target: &Target| {
            let dealt = self.dealt.iter();
            dealt
                .filter(|one| one.phase == Phase::Steady && one.target == *target)
                .count()
        };
        targets.sort_by_key(had);
        // Not always the same one at the beginning of a run.
        if self.dealt.is_empty() {
            let first = self.number % targets.len();
            targets.rotate_left(first);
        }
        for target in targets {
            let Some(blow) = plan.next(Phase::Steady, target) else {
                continue;
            };
            let role = self.role_of(target, blow.which);
            let pid = match role {
                None => Some(self.supervisor.id()),
                Some(role) => self.processes.get(&role).map(|one| one.pid),
            };
            let now_ns = node::monotonic_ns();
            self.armed.push(Armed {
                phase: Phase::Steady,
                target,
                blow,
                role,
                pid: pid.unwrap_or_default(),
                started_ns: now_ns,
                at_ns: now_ns + (blow.at * STEADY_MS * 1e6) as u64,
            });
            return;
        }
    }

    fn role_of(&self, target: Target, which: f64) -> Option<Role> {
        match target {
            Target::Supervisor => None,
            Target::World => Some(Role::World),
            Target::Planner => Some(Role::Planner),
            Target::Recorder => Some(Role::Recorder),
            Target::Robots => {
                let is_robot = |role: &&Role| matches!(role, Role::Robot(_));
                let robots: Vec<&Role> = self.processes.keys().filter(is_robot).collect();
                let at = (which * robots.len() as f64) as usize;
                robots.get(at).map(|role| **role)
            }
        }
    }

    /// Deals the blows whose time has come.
    pub(super) fn strike(&mut self, plan: &mut Plan) {
        let now_ns = node::monotonic_ns();
        let (due, waiting): (Vec<Armed>, Vec<Armed>) =
            (std::mem::take(&mut self.armed).into_iter()).partition(|armed| armed.at_ns <= now_ns);
        self.armed = waiting;
        for armed in due {
            let is_ready = match armed.role {
                None => (armed.pid == self.supervisor.id()).then(|| self.is_steady()),
                Some(role) => (self.processes.get(&role))
                    .filter(|one| one.pid == armed.pid && !one.dead)
                    .map(|one| one.ready),
            };
            let (phase, target, blow) = (armed.phase, armed.target, armed.blow);
            if is_ready == Some(phase == Phase::Steady) && self.done_ns.is_none() {
                self.deal(&armed, plan);
            } else if is_ready == Some(true) && phase == Phase::Setup {
                plan.bring_forward(phase, target, blow);
            } else {
                plan.give_back(phase, target, blow);
            }
        }
    }

    fn deal(&mut self, armed: &Armed, plan: &mut Plan) {
        let at_ns = node::monotonic_ns();
        let usual_ns = self.set_ups.usual_ns(armed.target).max(1);
        self.dealt.push(Dealt {
            phase: armed.phase,
            target: armed.target,
            blow: armed.blow,
            at_ns,
            into: (at_ns - armed.started_ns) as f64 / usual_ns as f64,
            role: armed.role,
            recovered_ns: None,
        });
        match (armed.blow.how, armed.role) {
            (How::Stall, _) => {
                signal(armed.pid, Signal::STOP);
                let for_ns = (armed.blow.which * STALL_MS * 1e6) as u64;
                self.stalled.push((armed.pid, at_ns + for_ns));
            }
            (_, None) => self.kill_supervisor(plan),
            (How::Kill, Some(role)) => self.kill(role),
            (How::Set, Some(_)) => {
                let all: Vec<Role> = self.processes.keys().copied().collect();
                all.into_iter().for_each(|role| self.kill(role));
            }
        }
    }

    fn kill(&mut self, role: Role) {
        if let Some(process) = self.processes.get_mut(&role)
            && !process.dead
        {
            signal(process.pid, Signal::KILL);
            process.dead = true;
        }
    }

    /// Kills the supervisor, and goes on with its run; or begins anew if there was none yet.
    fn kill_supervisor(&mut self, plan: &mut Plan) {
        let _ = self.supervisor.kill();
        let _ = self.supervisor.wait();
        self.disarm(plan);
        self.stalled.clear();
        self.read();
        self.processes.clear();
        self.set_up_blows = 0;
        self.find_directory();
        let arguments = match &self.id {
            Some(id) => vec!["resume".to_owned(), id.clone(), "--json".to_owned()],
            None => run_arguments(&self.name, &self.scenario),
        };
        let started = spawn(&self.program, &arguments, &self.out, &self.errors);
        if let Ok(started) = started {
            self.supervisor = started;
        }
        self.supervised_ns = node::monotonic_ns();
        self.alive = Instant::now();
    }

    pub(super) fn wake_stalled(&mut self) {
        let now_ns = node::monotonic_ns();
        self.stalled.retain(|&(pid, until_ns)| {
            if until_ns <= now_ns {
                signal(pid, Signal::CONT);
            }
            until_ns > now_ns
        });
    }

    pub(super) fn disarm(&mut self, plan: &mut Plan) {
        for armed in self.armed.drain(..).rev() {
            plan.give_back(armed.phase, armed.target, armed.blow);
        }
        for (pid, _) in self.stalled.drain(..) {
            signal(pid, Signal::CONT);
        }
    }
}
