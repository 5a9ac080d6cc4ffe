//! One run that is tormented.
//!
//! Responsible for: starting it, reading its diary along, striking its processes as the plan says,
//! resuming it when its supervisor was struck, and what was left of it.
//! Not responsible for: what it all amounts to (`report`).
//!
//! Terms: a process is *in set-up* from its start to its first answer; a supervisor until all of its
//! processes are ready. A run is *steady* while all are.

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use node::Role;
use node::domain::{self, LATEST};
use node::roles::TRACE_FILE;
use node::supervisor::{DIARY_FILE, Entry, Happened};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::cli::{ChaosArgs, ChaosClock, Phase, Target};
use crate::commands::chaos::plan::{Blow, How, Plan};
use crate::commands::chaos::set_ups::SetUps;
use crate::drivers::interrupt::Interrupt;

/// Sleep between two looks.
const PERIOD: Duration = Duration::from_micros(500);
/// Longest wait before a blow in steady state.
const STEADY_MS: f64 = 40.0;
/// Longest stall.
const STALL_MS: f64 = 120.0;
/// Blows in set-up after one start of the whole set: enough for one run.
const PER_SET_UP: usize = 24;
/// Blows after which a run is left in peace until its end.
const PER_RUN: usize = 100;
/// Longest that a run may take to stop.
const STOPPING: Duration = Duration::from_secs(10);
/// A blow this close to the end of the last task may have come after it, ns.
const MARGIN_NS: u64 = 5_000_000;

/// A blow that was dealt.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dealt {
    pub(crate) phase: Phase,
    pub(crate) target: Target,
    pub(crate) blow: Blow,
    pub(crate) at_ns: u64,
    /// For one in set-up: how far into it, in set-ups of this role as they usually last.
    pub(crate) into: f64,
    /// Who was struck; nobody for the supervisor.
    pub(crate) role: Option<Role>,
    /// Until the next process had answered a tick, if it was let live so long.
    pub(crate) recovered_ns: Option<u64>,
}

/// A process of the run.
struct Process {
    pid: u32,
    started_ns: u64,
    ready: bool,
    dead: bool,
}

/// A blow that waits for its time.
struct Armed {
    phase: Phase,
    target: Target,
    blow: Blow,
    role: Option<Role>,
    pid: u32,
    started_ns: u64,
    at_ns: u64,
}

/// How a tormented run ended.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Ended {
    /// By itself.
    With(ExitStatus),
    /// It showed no sign of life any more, and was put down.
    Wedged,
    /// It was stopped since somebody has asked for it.
    BrokenOff,
}

/// The run.
pub(crate) struct Victim<'a> {
    name: String,
    pub(crate) number: usize,
    program: PathBuf,
    supervisor: Child,
    supervised_ns: u64,
    out: PathBuf,
    pub(crate) errors: PathBuf,
    directory: Option<PathBuf>,
    pub(crate) id: Option<String>,
    diary: Option<File>,
    unread: Vec<u8>,
    processes: BTreeMap<Role, Process>,
    armed: Vec<Armed>,
    stalled: Vec<(u32, u64)>,
    set_up_blows: usize,
    set_ups: &'a mut SetUps,
    /// Since when no task is open, as far as is known.
    done_ns: Option<u64>,
    pub(crate) dealt: Vec<Dealt>,
    pub(crate) cleared: u64,
    /// Processes that ended by themselves, with their words.
    pub(crate) erred: Vec<String>,
    alive: Instant,
    /// Bytes of its trace, as last seen.
    traced: u64,
    scenario: Vec<String>,
}

impl<'a> Victim<'a> {
    /// Starts run `number`. How long set-ups last it knows from those before it, and tells the next.
    pub(crate) fn start(
        args: &ChaosArgs,
        number: usize,
        set_ups: &'a mut SetUps,
    ) -> io::Result<Self> {
        let mut scenario = vec![args.scenario.clone()];
        if let Some(robots) = args.robots {
            scenario.extend(["--robots".to_owned(), robots.to_string()]);
        }
        // No give-up: whoever is struck again and again is to come back all the same.
        let more = ["--give-up-after", "100000", "--silence-limit", "2"];
        scenario.extend(more.map(str::to_owned));
        match args.clock {
            // A tick a millisecond: a run that lasts long enough to be struck.
            ChaosClock::Lockstep => scenario.extend(["--delay", "world=1"].map(str::to_owned)),
            ChaosClock::Real => {
                scenario.extend(["--clock", "real", "--speed", "10"].map(str::to_owned));
            }
        }
        Self::of(std::env::current_exe()?, scenario, number, set_ups)
    }

    fn of(
        program: PathBuf,
        scenario: Vec<String>,
        number: usize,
        set_ups: &'a mut SetUps,
    ) -> io::Result<Self> {
        let own = std::process::id();
        let name = format!("chaos-{own}-{number}");
        let at = |end: &str| std::env::temp_dir().join(format!("rearrange-{name}.{end}"));
        let (out, errors) = (at("json"), at("err"));
        File::create(&errors)?;
        let mut victim = Self {
            supervisor: spawn(&program, &run_arguments(&name, &scenario), &out, &errors)?,
            supervised_ns: node::monotonic_ns(),
            name,
            number,
            program,
            out,
            errors,
            directory: None,
            id: None,
            diary: None,
            unread: Vec::new(),
            processes: BTreeMap::new(),
            armed: Vec::new(),
            stalled: Vec::new(),
            set_up_blows: 0,
            set_ups,
            done_ns: None,
            dealt: Vec::new(),
            cleared: 0,
            erred: Vec::new(),
            alive: Instant::now(),
            traced: 0,
            scenario,
        };
        victim.supervised_ns = node::monotonic_ns();
        Ok(victim)
    }

    /// Strikes until the run is over.
    pub(crate) fn torment(
        &mut self,
        plan: &mut Plan,
        wedged: Duration,
        interrupt: &Interrupt,
    ) -> Ended {
        loop {
            if interrupt.is_asked() {
                self.disarm(plan);
                self.stop();
                return Ended::BrokenOff;
            }
            self.read();
            if let Ok(Some(status)) = self.supervisor.try_wait() {
                self.read();
                self.disarm(plan);
                return Ended::With(status);
            }
            if self.alive.elapsed() > wedged {
                self.disarm(plan);
                self.put_down();
                return Ended::Wedged;
            }
            self.wake_stalled();
            self.arm(plan);
            self.strike(plan);
            std::thread::sleep(PERIOD);
        }
    }

    /// What it printed.
    pub(crate) fn result(&self) -> Option<Value> {
        serde_json::from_slice(&fs::read(&self.out).ok()?).ok()
    }

    /// The last lines that it wrote to stderr.
    pub(crate) fn last_words(&self) -> String {
        let text = fs::read_to_string(&self.errors).unwrap_or_default();
        let from = text.len().saturating_sub(600);
        text[text.ceil_char_boundary(from)..].trim().to_owned()
    }

    /// Takes the blows back that came too late to count: no task was open any more.
    pub(crate) fn discount(&mut self, plan: &mut Plan) {
        let until_ns = self.done_ns.unwrap_or(0).saturating_sub(MARGIN_NS);
        let (counted, late) = (std::mem::take(&mut self.dealt).into_iter())
            .partition(|dealt: &Dealt| dealt.at_ns < until_ns);
        self.dealt = counted;
        for dealt in late {
            plan.give_back(dealt.phase, dealt.target, dealt.blow);
        }
    }

    /// Where what it said can be read.
    pub(crate) fn kept(&self) -> String {
        let (out, errors) = (self.out.display(), self.errors.display());
        format!("its result and messages are in {out} and {errors}")
    }

    /// Removes the files of this process; the run's own are none of ours.
    pub(crate) fn clean_up(&self) {
        let _ = fs::remove_file(&self.out);
        let _ = fs::remove_file(&self.errors);
    }

    fn find_directory(&mut self) {
        if self.diary.is_some() {
            return;
        }
        let Some(directory) = domain::directory_of(&self.name) else {
            return;
        };
        self.id = directory
            .file_name()
            .map(|id| id.to_string_lossy().into_owned());
        self.diary = File::open(directory.join(DIARY_FILE)).ok();
        self.directory = Some(directory);
    }

    /// Reads the diary on, and sees whether the run shows signs of life.
    fn read(&mut self) {
        self.find_directory();
        // Between two tasks, which may be long on a busy machine, only the trace grows.
        let trace = self.directory.as_ref().map(|run| run.join(TRACE_FILE));
        let traced = trace.and_then(|trace| fs::metadata(trace).ok());
        let traced = traced.map_or(0, |trace| trace.len());
        if traced != self.traced {
            (self.traced, self.alive) = (traced, Instant::now());
        }
        let Some(diary) = &mut self.diary else {
            return;
        };
        if diary.read_to_end(&mut self.unread).is_err() || self.unread.is_empty() {
            return;
        }
        let Some(end) = self.unread.iter().rposition(|byte| *byte == b'\n') else {
            return;
        };
        let lines: Vec<u8> = self.unread.drain(..=end).collect();
        for line in lines.split(|byte| *byte == b'\n') {
            if let Ok(entry) = serde_json::from_slice::<Entry>(line) {
                self.alive = Instant::now();
                self.note(entry);
            }
        }
    }

    fn note(&mut self, entry: Entry) {
        let at_ns = entry.at_ns;
        match entry.happened {
            Happened::Supervised { .. } => {}
            Happened::Started { role, pid, .. } => {
                let process = Process {
                    pid,
                    started_ns: at_ns,
                    ready: false,
                    dead: false,
                };
                self.processes.insert(role, process);
            }
            Happened::Ready { role, pid } => self.greet(role, pid, at_ns),
            Happened::Ended {
                role, pid, words, ..
            } => {
                if let Some(process) = self.processes.get_mut(&role)
                    && process.pid == pid
                {
                    process.dead = true;
                }
                self.erred.extend(words);
            }
            Happened::Open { tasks } => self.done_ns = (tasks == 0).then_some(at_ns),
            Happened::Over => self.done_ns = Some(self.done_ns.unwrap_or(at_ns)),
            Happened::Cleared { files } => self.cleared += u64::from(files),
            Happened::Silent { .. } | Happened::Gone { .. } => {}
        }
    }

    fn greet(&mut self, role: Role, pid: u32, at_ns: u64) {
        let Some(process) = self.processes.get_mut(&role).filter(|one| one.pid == pid) else {
            return;
        };
        process.ready = true;
        let lasted_ns = at_ns - process.started_ns;
        self.set_ups.learn(target_of(role), lasted_ns);
        let last = self
            .dealt
            .iter_mut()
            .rev()
            .find(|dealt| dealt.role == Some(role));
        recovered(last, at_ns);
        if self.is_steady() {
            let lasted_ns = at_ns.saturating_sub(self.supervised_ns);
            self.set_ups.learn(Target::Supervisor, lasted_ns);
            let last = self
                .dealt
                .iter_mut()
                .rev()
                .find(|dealt| dealt.role.is_none());
            recovered(last, at_ns);
        }
    }

    fn is_steady(&self) -> bool {
        !self.processes.is_empty() && self.processes.values().all(|one| one.ready && !one.dead)
    }

    /// Chooses who is struck next, and when.
    fn arm(&mut self, plan: &mut Plan) {
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
    fn strike(&mut self, plan: &mut Plan) {
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
            match (is_ready, phase) {
                _ if self.done_ns.is_some() => plan.give_back(phase, target, blow),
                (Some(false), Phase::Setup) | (Some(true), Phase::Steady) => {
                    self.deal(&armed, plan)
                }
                (Some(true), Phase::Setup) => plan.bring_forward(phase, target, blow),
                _ => plan.give_back(phase, target, blow),
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

    fn wake_stalled(&mut self) {
        let now_ns = node::monotonic_ns();
        self.stalled.retain(|&(pid, until_ns)| {
            if until_ns <= now_ns {
                signal(pid, Signal::CONT);
            }
            until_ns > now_ns
        });
    }

    fn disarm(&mut self, plan: &mut Plan) {
        for armed in self.armed.drain(..).rev() {
            plan.give_back(armed.phase, armed.target, armed.blow);
        }
        for (pid, _) in self.stalled.drain(..) {
            signal(pid, Signal::CONT);
        }
    }

    /// Has it stop by itself, as long as it does so soon.
    fn stop(&mut self) {
        signal(self.supervisor.id(), Signal::TERM);
        let asked = Instant::now();
        while asked.elapsed() < STOPPING && matches!(self.supervisor.try_wait(), Ok(None)) {
            std::thread::sleep(PERIOD);
        }
    }

    fn put_down(&mut self) {
        let _ = self.supervisor.kill();
        let _ = self.supervisor.wait();
    }
}

impl Drop for Victim<'_> {
    fn drop(&mut self) {
        self.put_down();
    }
}

fn recovered(last: Option<&mut Dealt>, at_ns: u64) {
    if let Some(dealt) = last
        && dealt.blow.how != How::Stall
    {
        dealt.recovered_ns = dealt
            .recovered_ns
            .or(Some(at_ns.saturating_sub(dealt.at_ns)));
    }
}

fn target_of(role: Role) -> Target {
    match role {
        Role::World => Target::World,
        Role::Planner => Target::Planner,
        Role::Robot(_) => Target::Robots,
        Role::Recorder => Target::Recorder,
    }
}

fn run_arguments(name: &str, scenario: &[String]) -> Vec<String> {
    let mut arguments = vec!["run".to_owned()];
    arguments.extend_from_slice(scenario);
    arguments.extend(["--name", name, "--json"].map(str::to_owned));
    debug_assert_ne!(name, LATEST);
    arguments
}

fn spawn(
    program: &PathBuf,
    arguments: &[String],
    out: &PathBuf,
    errors: &PathBuf,
) -> io::Result<Child> {
    Command::new(program)
        .args(arguments)
        .env_remove("RUST_LOG")
        .stdin(Stdio::null())
        .stdout(File::create(out)?)
        .stderr(File::options().append(true).create(true).open(errors)?)
        .spawn()
}

fn signal(pid: u32, signal: Signal) {
    if let Some(pid) = i32::try_from(pid).ok().and_then(Pid::from_raw) {
        // It may have ended by itself.
        let _ = kill_process(pid, signal);
    }
}
