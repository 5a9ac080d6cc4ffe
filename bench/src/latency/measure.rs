//! Measuring everything in turn, again and again.
//!
//! Responsible for: the order, and a row for whatever comes of it.
//! Not responsible for: what the rows mean (`findings`).

use std::collections::BTreeSet;

use node::{Latencies, Launcher, RoleReport, RunOptions, RunPlan, Timed, reference, supervisor};
use shm_types::Outcome;

use crate::conditions::ProcessorTime;
use crate::latency::combination::{Combination, Place};
use crate::latency::rows::{Kept, Key, Rows, Run, System};
use crate::latency::{Options, cache_line, datagram};
use crate::progress::Progress;
use crate::results::Table;

/// Words of what has no clock, wait, core or priority of ours.
pub(super) const BLOCKING: [&str; 4] = ["lockstep", "block", "free", "normal"];
const SPINNING: [&str; 4] = ["lockstep", "spin", "pinned", "normal"];

/// Something to be measured in each repeat.
enum Step {
    /// A run of processes, ours and bare.
    Runs(Box<(Combination, RunPlan)>),
    /// Datagrams to so many readers, with the payload of so many objects, so many bytes.
    Datagrams(usize, usize, usize),
    CacheLine,
}

/// The measurement.
pub(super) struct Bench<'a> {
    options: &'a Options,
    rows: Rows,
    steps: Vec<Step>,
}

impl<'a> Bench<'a> {
    /// Works out what can run; what cannot is a row at once.
    pub(super) fn new(options: &'a Options, launcher: &Launcher) -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let mut rows = Rows::new(cores);
        let mut steps = Vec::new();
        let mut payloads = BTreeSet::new();
        for one in Combination::all(options) {
            match plan(&one, options, launcher, cores) {
                Ok(plan) => {
                    if one.place == Place::Lanes {
                        payloads.insert((one.robots, one.objects, one.payload()));
                    }
                    steps.push(Step::Runs(Box::new((one, plan))));
                }
                Err(reason) => rows.run(
                    &Key::of(System::Ours, &one),
                    0,
                    &Run {
                        status: "refused",
                        reason,
                        processes: one.processes(),
                        payload: one.payload(),
                        ..Run::default()
                    },
                ),
            }
        }
        let datagrams = payloads.into_iter();
        steps.extend(
            datagrams.map(|(robots, objects, bytes)| Step::Datagrams(robots, objects, bytes)),
        );
        steps.push(Step::CacheLine);
        Self {
            options,
            rows,
            steps,
        }
    }

    /// Measures; whether it was interrupted.
    pub(super) fn run(&mut self, progress: &mut dyn Progress) -> bool {
        progress.begin((self.steps.len() * self.options.repeats) as u64);
        let steps = std::mem::take(&mut self.steps);
        for repeat in 0..self.options.repeats {
            for step in &steps {
                if progress.is_interrupted() {
                    return true;
                }
                progress.step(&name(step, repeat));
                let go_on = match step {
                    Step::Runs(run) => self.runs(&run.0, &run.1, repeat),
                    Step::Datagrams(readers, objects, bytes) => {
                        self.datagrams(*readers, *objects, *bytes, repeat);
                        true
                    }
                    Step::CacheLine => {
                        self.cache_line(repeat);
                        true
                    }
                };
                if !go_on {
                    return true;
                }
            }
        }
        progress.is_interrupted()
    }

    pub(super) fn into_parts(self) -> (Vec<Table>, Vec<Kept>) {
        self.rows.into_parts()
    }

    /// Ours and bare, each first in every other repeat. `false` once somebody has interrupted one.
    fn runs(&mut self, one: &Combination, plan: &RunPlan, repeat: usize) -> bool {
        let turns = match (one.place, repeat % 2) {
            (Place::DeadEnds, _) => &[System::Ours][..],
            (_, 0) => &[System::Ours, System::Bare],
            _ => &[System::Bare, System::Ours],
        };
        turns
            .iter()
            .all(|system| self.once(one, plan, *system, repeat))
    }

    fn once(&mut self, one: &Combination, plan: &RunPlan, system: System, repeat: usize) -> bool {
        let key = Key::of(system, one);
        let before = ProcessorTime::now();
        let run = Run {
            processes: one.processes(),
            payload: one.payload(),
            ..Run::default()
        };
        let (run, latency) = match system {
            System::Ours => ours(run, plan),
            _ => bare(run, plan),
        };
        let run = Run {
            stolen: ProcessorTime::now().stolen_since(before),
            ..run
        };
        self.rows.run(&key, repeat, &run);
        if let Some(latency) = latency.filter(|_| run.status == "ok") {
            for (timed, _) in latency.summaries() {
                let is_hard = timed == Timed::HardRoundTrip;
                if is_hard == (one.place == Place::DeadEnds) {
                    let histogram = latency.histogram(timed);
                    self.rows.time(&key, timed.name(), repeat, histogram);
                }
            }
        }
        run.status != "interrupted"
    }

    fn datagrams(&mut self, readers: usize, objects: usize, bytes: usize, repeat: usize) {
        let key = Key {
            system: System::Datagram,
            words: BLOCKING,
            robots: readers,
            objects,
        };
        match datagram::measure(readers, bytes, self.options.measured) {
            Ok(measured) => {
                let times = [
                    (Timed::SnapshotAge, &measured.age),
                    (Timed::SnapshotSend, &measured.send),
                    (Timed::Tick, &measured.tick),
                ];
                for (timed, histogram) in times {
                    self.rows.time(&key, timed.name(), repeat, histogram);
                }
            }
            Err(error) => self.failed(&key, repeat, error.to_string()),
        }
    }

    fn cache_line(&mut self, repeat: usize) {
        let key = Key {
            system: System::CacheLine,
            words: SPINNING,
            robots: 1,
            objects: 0,
        };
        match cache_line::measure(self.options.measured) {
            Ok(histogram) => self.rows.time(&key, "one_way", repeat, &histogram),
            Err(reason) => self.failed(&key, repeat, reason),
        }
    }

    fn failed(&mut self, key: &Key, repeat: usize, reason: String) {
        let run = Run {
            status: "failed",
            reason,
            ..Run::default()
        };
        self.rows.run(key, repeat, &run);
    }
}

fn name(step: &Step, repeat: usize) -> String {
    let what = match step {
        Step::Runs(run) => {
            let one = &run.0;
            let words = one.words().join(", ");
            format!("{} robots, {} objects, {words}", one.robots, one.objects)
        }
        Step::Datagrams(readers, _, bytes) => format!("{readers} × {bytes} bytes by datagram"),
        Step::CacheLine => "a cache line to and fro".to_owned(),
    };
    format!("repeat {}: {what}", repeat + 1)
}

/// What is to run; the reason if it cannot.
fn plan(
    one: &Combination,
    options: &Options,
    launcher: &Launcher,
    cores: usize,
) -> Result<RunPlan, String> {
    if let Some(reason) = one.contradiction() {
        return Err(reason);
    }
    let scene = one.scene(options.measured)?;
    let run: RunOptions = one.options(options.measured);
    if let Some(reason) = one.refusal(&run, &scene, cores) {
        return Err(reason);
    }
    let text = scene::to_canonical_toml(&scene);
    Ok(RunPlan::new(text, run, launcher.clone()))
}

fn ours(run: Run, plan: &RunPlan) -> (Run, Option<Latencies>) {
    let report = match supervisor::run(plan, &mut ()) {
        Ok(report) => report,
        Err(error) => return (failed(run, error.to_string()), None),
    };
    let is_real = plan.options.clock.period_ns().is_some();
    let run = Run {
        status: status(report.outcome),
        reason: reason(report.reason, &report.notes),
        ticks: report.world.ticks,
        wall_s: report.wall_s,
        cpu_s: cpu_s(&report.roles),
        missed: is_real.then_some(report.deadline_misses),
        skipped: Some(report.snapshots_skipped),
        ..run
    };
    (run, Some(report.latency))
}

fn bare(run: Run, plan: &RunPlan) -> (Run, Option<Latencies>) {
    let report = match reference::run(plan) {
        Ok(report) => report,
        Err(error) => return (failed(run, error.to_string()), None),
    };
    let missed = report.roles.iter().map(|role| role.deadline_misses).sum();
    let is_real = plan.options.clock.period_ns().is_some();
    let run = Run {
        status: status(report.outcome),
        reason: reason(report.reason, &[]),
        ticks: report.ticks,
        wall_s: report.wall_s,
        cpu_s: cpu_s(&report.roles),
        missed: is_real.then_some(missed),
        ..run
    };
    (run, Some(report.latency))
}

fn failed(run: Run, reason: String) -> Run {
    Run {
        status: "failed",
        reason,
        ..run
    }
}

/// Running out of time is what is asked for, and being done early is no harm.
const fn status(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Timeout | Outcome::Solved => "ok",
        Outcome::Interrupted => "interrupted",
        _ => "failed",
    }
}

/// Why, and what was not permitted.
fn reason(reason: Option<String>, notes: &[String]) -> String {
    let parts: Vec<_> = reason.into_iter().chain(notes.iter().cloned()).collect();
    parts.join("; ")
}

fn cpu_s(roles: &[RoleReport]) -> f64 {
    roles.iter().map(|role| role.cpu_s).sum()
}
