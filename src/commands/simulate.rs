//! `rearrange simulate`: whole runs in process in which things go wrong, seed by seed.
//!
//! Responsible for: sharing the seeds among threads, totals, what people see, the command that
//! replays a seed, making a failing one small. Not responsible for: the runs and what must hold
//! in them (crate `sim`).

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use scene::Scene;
use serde::Serialize;
use shm_types::Outcome as RunOutcome;
use sim::faults::{Cut, Ended, Fault, Finding, Kind, Trial, shrink};

mod onlooker;

use crate::cli::SimulateArgs;
use crate::drivers::interrupt::Interrupt;
use crate::exit::{Exit, Failure, Outcome};
use crate::output;
use onlooker::Checking;

/// Runs spent on making one failing seed small.
const SHRINK_TRIES: usize = 600;
/// Failing seeds that are told one by one.
const MOST_TOLD: usize = 20;

/// All that a campaign found out.
#[derive(Debug, Default, Serialize)]
struct Totals {
    /// Seeds run.
    seeds: u64,
    /// Seeds for which no room was found.
    without_room: u64,
    /// Seeds whose undisturbed run is not solved: only their safety counts.
    unsolved_undisturbed: u64,
    /// Seeds not solved in rooms that the method does not solve whoever is where first: likewise.
    not_robust: u64,
    /// Seeds not solved since the planner found no plan within its limits: likewise.
    no_plan: u64,
    /// Faults that altered something while a task was open.
    faults: u64,
    /// The same by kind.
    by_kind: BTreeMap<&'static str, u64>,
    /// Ticks of the disturbed runs, each looked at for safety.
    ticks: u64,
    /// Runs by method.
    by_method: BTreeMap<&'static str, u64>,
    /// What was found.
    failures: Vec<FailedSeed>,
    /// How many more there were than are told.
    untold_failures: u64,
}

/// A seed that failed.
#[derive(Debug, Serialize)]
struct FailedSeed {
    seed: u64,
    method: &'static str,
    finding: String,
    /// What replays it.
    command: String,
}

/// The result for machines.
#[derive(Debug, Serialize)]
struct SimulateResult {
    schema_version: u32,
    program_version: &'static str,
    first_seed: u64,
    #[serde(flatten)]
    totals: Totals,
    wall_s: f64,
    threads: usize,
    interrupted: bool,
}

/// Runs the campaign, and prints what it found.
pub(crate) fn main(args: &SimulateArgs) -> Outcome {
    let scenes = args
        .scenarios
        .iter()
        .map(|name| Ok(crate::scenario::load(name, None)?.scene))
        .collect::<Result<Vec<Scene>, Failure>>()?;
    let interrupt = Interrupt::watch()
        .map_err(|error| Failure::system(format!("signals cannot be watched: {error}")))?;
    // A panic is a finding, and told as one.
    std::panic::set_hook(Box::new(|_| {}));
    let campaign = Campaign {
        args,
        scenes: &scenes,
        next: AtomicU64::new(args.first_seed),
        totals: Mutex::new(Totals::default()),
        is_over: AtomicBool::new(false),
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = threads.min(args.threads.map_or(usize::MAX, |threads| threads as usize));
    let started = Instant::now();
    let bar = bar(args.seeds);
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|_| scope.spawn(|| campaign.work()))
            .collect();
        while !workers
            .iter()
            .all(std::thread::ScopedJoinHandle::is_finished)
        {
            if interrupt.is_asked() {
                campaign.is_over.store(true, Ordering::Relaxed);
            }
            campaign.show(&bar);
            std::thread::sleep(Duration::from_millis(100));
        }
    });
    bar.finish_and_clear();
    let _ = std::panic::take_hook();
    let mut totals = campaign
        .totals
        .into_inner()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    totals.failures.sort_by_key(|failed| failed.seed);
    let exit = match (totals.failures.is_empty(), interrupt.is_asked()) {
        (false, _) => Exit::Invariant,
        (true, true) => Exit::Interrupted,
        (true, false) => Exit::Success,
    };
    let result = SimulateResult {
        schema_version: 1,
        program_version: env!("CARGO_PKG_VERSION"),
        first_seed: args.first_seed,
        totals,
        wall_s: started.elapsed().as_secs_f64(),
        threads,
        interrupted: interrupt.is_asked(),
    };
    tell(args, &result)?;
    if args.shrink {
        for failed in &result.totals.failures {
            output::complain(&small(args, &scenes, failed.seed));
        }
    }
    Ok(exit)
}

/// Seeds, and what came of them.
struct Campaign<'a> {
    args: &'a SimulateArgs,
    scenes: &'a [Scene],
    next: AtomicU64,
    totals: Mutex<Totals>,
    is_over: AtomicBool,
}

impl Campaign<'_> {
    /// Runs seed after seed.
    fn work(&self) {
        while !self.is_over.load(Ordering::Relaxed) {
            let seed = self.next.fetch_add(1, Ordering::Relaxed);
            if seed - self.args.first_seed >= self.args.seeds {
                return;
            }
            let ran = trial(self.args, self.scenes, cut_of(self.args), seed).map(|trial| {
                let ended = run(&trial, plan(self.args, &trial));
                let is_beyond = trial.is_beyond(&ended);
                (trial, ended, is_beyond)
            });
            if let Ok(mut totals) = self.totals.lock() {
                totals.add(self.args, seed, ran);
            }
        }
    }

    fn show(&self, bar: &ProgressBar) {
        if let Ok(totals) = self.totals.lock() {
            bar.set_position(totals.seeds + totals.without_room);
            let failed = totals.failures.len() as u64 + totals.untold_failures;
            bar.set_message(format!("{} faults, {failed} seeds failed", totals.faults));
        }
    }
}

impl Totals {
    fn add(&mut self, args: &SimulateArgs, seed: u64, ran: Option<(Trial, Ended, bool)>) {
        let Some((trial, ended, is_beyond)) = ran else {
            self.without_room += 1;
            return;
        };
        let method = trial.settings.method;
        self.seeds += 1;
        self.ticks += ended.ticks;
        self.faults += ended.counted.len() as u64;
        *self.by_method.entry(method.word()).or_default() += 1;
        for fault in &ended.counted {
            *self.by_kind.entry(fault.kind.word()).or_default() += 1;
        }
        let is_unsolved = trial.undisturbed.outcome != RunOutcome::Solved;
        self.unsolved_undisturbed += u64::from(is_unsolved);
        let is_ahead = method.plans_ahead();
        self.not_robust += u64::from(is_beyond && !is_unsolved && !is_ahead);
        self.no_plan += u64::from(is_beyond && !is_unsolved && is_ahead);
        match ended.finding {
            Some(finding) if !is_beyond && self.failures.len() < MOST_TOLD => {
                output::complain(&format!("seed {seed}, {method}: {finding}"));
                self.failures.push(FailedSeed {
                    seed,
                    method: method.word(),
                    finding: finding.to_string(),
                    command: command(args, seed, cut_of(args), None),
                });
            }
            Some(_) if !is_beyond => self.untold_failures += 1,
            _ => {}
        }
    }
}

fn cut_of(args: &SimulateArgs) -> Cut {
    Cut {
        robots: args.robots.map(|robots| robots as usize),
        objects: args.objects.map(|objects| objects as usize),
    }
}

/// What a seed stands for.
fn trial(args: &SimulateArgs, scenes: &[Scene], cut: Cut, seed: u64) -> Option<Trial> {
    let scene = scenes.get((seed % (scenes.len().max(1) as u64)) as usize);
    match scene {
        None => Trial::random(seed, cut, args.method),
        Some(scene) => Trial::of(scene, seed, cut, args.method).ok(),
    }
}

/// The seed's faults, or those of them that are asked for.
fn plan(args: &SimulateArgs, trial: &Trial) -> Vec<Fault> {
    let mut plan = trial.plan();
    if let Some(only) = &args.only {
        plan.retain(|fault| only.0.contains(&fault.number));
    }
    plan
}

fn run(trial: &Trial, plan: Vec<Fault>) -> Ended {
    let mut checking = Checking::new(&trial.scene, &trial.settings);
    trial.run(plan, &mut checking)
}

/// The command that replays a seed, cut down like this.
fn command(args: &SimulateArgs, seed: u64, cut: Cut, only: Option<&[Fault]>) -> String {
    let mut words = format!("rearrange simulate --seeds 1 --first-seed {seed}");
    let mut add = |option: &str, value: String| words += &format!(" --{option} {value}");
    if let Some(method) = args.method {
        add("method", method.word().to_owned());
    }
    if let Some(robots) = cut.robots {
        add("robots", robots.to_string());
    }
    if let Some(objects) = cut.objects {
        add("objects", objects.to_string());
    }
    if let Some(only) = only {
        let numbers: Vec<String> = only.iter().map(|fault| fault.number.to_string()).collect();
        add("only", format!("{},", numbers.join(",")));
    } else if let Some(only) = &args.only {
        let numbers: Vec<String> = only.0.iter().map(usize::to_string).collect();
        add("only", format!("{},", numbers.join(",")));
    }
    for scenario in &args.scenarios {
        words += &format!(" {scenario}");
    }
    words
}

/// What is left of a failing seed when all is left out that it fails without.
fn small(args: &SimulateArgs, scenes: &[Scene], seed: u64) -> String {
    let fails = |trial: &Trial, plan: &[Fault], like: &Finding| {
        let finding = run(trial, plan.to_vec()).finding;
        finding.filter(|finding| finding.is_like(like))
    };
    let mut cut = cut_of(args);
    let Some(mut best) = trial(args, scenes, cut, seed) else {
        return format!("seed {seed} has no room any more");
    };
    let mut faults = plan(args, &best);
    let Some(mut finding) = run(&best, faults.clone()).finding else {
        return format!("seed {seed} does not fail when it is run again: that is a fault itself");
    };
    faults = shrink(&faults, SHRINK_TRIES, |part| {
        fails(&best, part, &finding).is_some()
    });
    loop {
        let (robots, objects) = (best.scene.homes.len(), best.scene.objects.len());
        let fewer = [
            Cut {
                robots: robots.checked_sub(1).filter(|robots| *robots > 0),
                ..cut
            },
            Cut {
                objects: objects.checked_sub(1).filter(|objects| *objects > 0),
                ..cut
            },
        ];
        let smaller = fewer
            .into_iter()
            .filter(|fewer| *fewer != cut)
            .find_map(|fewer| {
                let trial = trial(args, scenes, fewer, seed)?;
                let plan = plan(args, &trial);
                let found = fails(&trial, &plan, &finding).filter(|_| {
                    !matches!(finding, Finding::NotLive(_))
                        || !trial.is_beyond(&run(&trial, plan.clone()))
                })?;
                Some((fewer, trial, plan, found))
            });
        let Some((fewer, trial, plan, found)) = smaller else {
            break;
        };
        (cut, best, finding) = (fewer, trial, found);
        faults = shrink(&plan, SHRINK_TRIES, |part| {
            fails(&best, part, &finding).is_some()
        });
    }
    let listed: Vec<String> = faults.iter().map(|fault| format!("  {fault}")).collect();
    format!(
        "seed {seed} made small: {} with {} and {}, {}\n{}\n{}\n  {}",
        best.settings.method,
        output::count(best.scene.homes.len() as u64, "robot"),
        output::count(best.scene.objects.len() as u64, "object"),
        output::count(faults.len() as u64, "fault"),
        listed.join("\n"),
        run(&best, faults.clone())
            .finding
            .map_or_else(String::new, |finding| finding.to_string()),
        command(args, seed, cut, Some(&faults)),
    )
}

fn tell(args: &SimulateArgs, result: &SimulateResult) -> Result<(), Failure> {
    if args.json {
        return output::print_json(result);
    }
    let totals = &result.totals;
    let mut text = format!(
        "{} from {}, {} in {} ticks, {:.1} s with {}\n",
        output::count(totals.seeds, "seed"),
        result.first_seed,
        output::count(totals.faults, "fault"),
        totals.ticks,
        result.wall_s,
        output::count(result.threads as u64, "thread"),
    );
    for kind in Kind::ALL {
        let count = totals.by_kind.get(kind.word()).copied().unwrap_or(0);
        let percent = 100.0 * count as f64 / totals.faults.max(1) as f64;
        text += &format!("  {kind:14} {count:>9}  {percent:4.1} %\n");
    }
    let failed = totals.failures.len() as u64 + totals.untold_failures;
    text += &format!(
        "held to safety alone: {} not solved undisturbed, {} where the method hangs on who is first, \
         {} for which the planner found no plan within its limits\n",
        totals.unsolved_undisturbed, totals.not_robust, totals.no_plan
    );
    for failure in &totals.failures {
        let FailedSeed {
            seed,
            method,
            finding,
            command,
        } = failure;
        text += &format!("seed {seed}, {method}: {finding}\n  {command}\n");
    }
    text += &match failed {
        0 => "no seed failed\n".to_owned(),
        failed => format!("{} failed\n", output::count(failed, "seed")),
    };
    output::print(&text)
}

fn bar(seeds: u64) -> ProgressBar {
    let target = if output::is_watched() {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    };
    let bar = ProgressBar::with_draw_target(Some(seeds), target);
    if let Ok(style) = ProgressStyle::with_template("[{bar:20}] {pos}/{len} seeds  {wide_msg}") {
        bar.set_style(style.progress_chars("=> "));
    }
    bar
}
