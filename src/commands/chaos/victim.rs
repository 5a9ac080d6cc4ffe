//! One run that is tormented.
//!
//! Responsible for: starting it, reading its diary along, how it ends, and what was left of it.
//! Not responsible for: striking its processes (`blows`), what it all amounts to (`report`).
//!
//! Terms: a process is *in set-up* from its start to its first answer; a supervisor until all of its
//! processes are ready. A run is *steady* while all are.

mod blows;
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
#[derive(Debug)]
pub(crate) enum Ended {
    /// By itself.
    With(ExitStatus),
    /// It showed no sign of life any more, and was put down.
    Wedged,
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

    /// Strikes until the run is over. None if somebody has asked to stop before that.
    pub(crate) fn torment(
        &mut self,
        plan: &mut Plan,
        wedged: Duration,
        interrupt: &Interrupt,
    ) -> Option<Ended> {
        while !interrupt.is_asked() {
            self.read();
            if let Ok(Some(status)) = self.supervisor.try_wait() {
                self.read();
                self.disarm(plan);
                return Some(Ended::With(status));
            }
            if self.alive.elapsed() > wedged {
                self.disarm(plan);
                self.put_down();
                return Some(Ended::Wedged);
            }
            self.wake_stalled();
            self.arm(plan);
            self.strike(plan);
            std::thread::sleep(PERIOD);
        }
        self.disarm(plan);
        self.stop();
        None
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
