//! `rearrange run`: a scenario from its file to a checked result.
//!
//! Responsible for: the order of things — read, look for a proof that it cannot be solved, run,
//! check, say what came out.
//! Not responsible for: any of these steps.

use node::{RunOptions, ToldAt};
use planner::{BoundLimits, Bounds, Proof};
use scene::Scene;
use shm_types::{Outcome as RunOutcome, Verdict};
use trace::CheckReport;

use crate::drivers::{Finished, in_process, processes};
use crate::exit::{Exit, Failure, Outcome};
use crate::progress::Progress;
use crate::result::{Checker, Counts, Ending, Options, RunResult, Times, hex, seconds};
use crate::run_options::{Driver, RunArgs};
use crate::scenario::Loaded;
use crate::{changes, output, result, scenario, table};

/// Violations quoted in the result.
const MOST_QUOTED: usize = 10;

/// Runs, and prints the result.
pub(crate) fn main(args: &RunArgs) -> Outcome {
    args.check()
        .map_err(|error| Failure::new(Exit::Usage, error))?;
    let Loaded { scene, seed } = scenario::load(&args.scenario, args.robots)?;
    let changes = changes_of(args)?;
    let mut options = options(args);
    options.more_robots = options.more_robots.max(changes::more_robots(&changes));
    options.changes = changes;
    let frame = RunResult {
        seed,
        ..frame(&scene, driver(args), &options)
    };
    let result = match planner::certificate(&scene) {
        Some(certificate) => infeasible(frame, &Proof::Certificate(certificate)),
        None => {
            let finished = drive(&scene, args, options)?;
            complete(frame, &scene, finished)
        }
    };
    tell(&result, args.json)
}

/// Prints a result.
pub(crate) fn tell(result: &RunResult, json: bool) -> Outcome {
    if json {
        output::print_json(result)?;
    } else {
        output::print(&table::render(result, output::wants_colour()))?;
    }
    Ok(result.outcome.exit())
}

/// The driver of processes, as results name it.
pub(crate) const PROCESSES: &str = "processes";

const fn driver(args: &RunArgs) -> &'static str {
    match args.process.driver {
        Driver::InProcess => "in-process",
        Driver::Processes => PROCESSES,
    }
}

fn changes_of(args: &RunArgs) -> Result<Vec<ToldAt>, Failure> {
    let file = args.changes.as_deref();
    let told = file.map(|file| changes::read(file, args.tick_ns()));
    let told = told.transpose();
    Ok(told
        .map_err(|error| Failure::new(Exit::BadInput, error))?
        .unwrap_or_default())
}

fn options(args: &RunArgs) -> RunOptions {
    RunOptions {
        clock: args.clock(),
        wait: args.process.wait,
        pin: args.process.pin,
        realtime_scheduling: args.process.realtime,
        monitors: args.process.monitors,
        more_robots: args.process.more_robots,
        delays: args.process.delay.clone(),
        trace: args.trace.clone(),
        hashes: args.hashes.clone(),
        ..RunOptions::new(args.settings())
    }
}

fn drive(scene: &Scene, args: &RunArgs, options: RunOptions) -> Result<Finished, Failure> {
    let goals = scene.objects.iter().filter(|object| object.goal.is_some());
    let mut progress = Progress::new(goals.count());
    let finished = match args.process.driver {
        Driver::InProcess => in_process::run(scene, &options, &progress),
        Driver::Processes => processes::run(scene, &args.process, options, &mut progress),
    };
    progress.clear();
    finished
}

/// A result that says what was asked for, and nothing yet of what came out.
pub(crate) fn frame(scene: &Scene, driver: &'static str, options: &RunOptions) -> RunResult {
    RunResult {
        schema_version: result::SCHEMA_VERSION,
        program_version: env!("CARGO_PKG_VERSION"),
        date: bench::machine::date_utc(),
        scenario: scene.name.clone(),
        scenario_hash: hex(scene.hash),
        seed: None,
        options: Options {
            units_per_tick: options.settings.units_per_tick(1),
            run: options.clone(),
        },
        machine: bench::machine::Machine::current(),
        method: options.settings.method.word().to_owned(),
        robots: scene.homes.len(),
        objects: scene.objects.len(),
        driver,
        outcome: Ending::Failed,
        reason: None,
        makespan_s: None,
        execution_s: None,
        planning_s: None,
        waiting_s: None,
        idle_s: None,
        lower_bound_s: None,
        yardstick_s: None,
        times: None,
        counts: Counts::default(),
        checker: None,
        invariants: None,
        latency: Default::default(),
        roles: Vec::new(),
        ticks: 0,
        state_hash: hex(0),
        wall_s: 0.0,
        oversubscribed: false,
        trace: None,
        notes: Vec::new(),
    }
}

fn infeasible(frame: RunResult, proof: &Proof) -> RunResult {
    RunResult {
        outcome: Ending::Infeasible,
        reason: Some(proof.to_string()),
        ..frame
    }
}

/// The result of a run that has taken place.
pub(crate) fn complete(frame: RunResult, scene: &Scene, finished: Finished) -> RunResult {
    let world = &finished.world;
    let times = Times::new(&world.activities, frame.options.run.settings.tick_ns);
    let mut notes = finished.notes.clone();
    notes.extend(world.refused_schedule.clone());
    let mean = times.as_ref().map(|times| times.mean);
    let checker = finished.check.as_ref().map(checker);
    let (outcome, reason) = ending(scene, &finished, checker.as_ref());
    let trace = frame.options.run.trace.as_ref();
    let trace = trace.or(finished.evidence.as_ref());
    if finished.evidence.is_some() {
        notes.push("the trace was kept, since an invariant is broken in it".to_owned());
    }
    // Another scene has other bounds.
    let is_same = world.scene_changes == 0;
    let bounds = Bounds::of(scene, BoundLimits::default()).filter(|_| is_same);
    RunResult {
        date: bench::machine::date_utc(),
        robots: world.activities.len().max(frame.robots),
        outcome,
        reason,
        makespan_s: Some(seconds(world.time_ns)),
        execution_s: mean.map(|mean| mean.moving_s + mean.gripping_s),
        planning_s: mean.map(|mean| mean.computing_s),
        waiting_s: mean.map(|mean| mean.waiting_s),
        idle_s: mean.map(|mean| mean.idle_s),
        lower_bound_s: bounds.as_ref().map(Bounds::best_s),
        yardstick_s: bounds.as_ref().and_then(Bounds::r_s),
        times,
        counts: counts(&finished),
        checker,
        invariants: Some(world.invariants.clone()),
        latency: finished
            .latency
            .summaries()
            .map(|(timed, summary)| (timed.name(), summary))
            .collect(),
        roles: finished.roles,
        ticks: world.ticks,
        state_hash: hex(world.state_hash),
        wall_s: finished.wall_s,
        oversubscribed: finished.oversubscribed,
        trace: trace.map(|path| path.display().to_string()),
        notes,
        ..frame
    }
}

fn counts(finished: &Finished) -> Counts {
    let world = &finished.world;
    let mut counts = Counts {
        hard_constraints: world.hard_constraints,
        task_failures: world.task_failures,
        selection_conflicts: world.selection_conflicts,
        grants_refused: world.grants_refused,
        invalid_requests: world.invalid_requests,
        schedules_refused: world.schedules_refused,
        scene_changes: world.scene_changes,
        deadline_misses: finished.deadline_misses,
        restarts: finished.restarts,
        lost_commands: finished.lost_commands,
        ..Counts::default()
    };
    counts.add_work(&finished.work);
    counts
}

fn checker(report: &CheckReport) -> Checker {
    let first = report.violations.iter().take(MOST_QUOTED);
    Checker {
        violations: report.violations.len() as u64 + report.unlisted_violations,
        swept_tests: report.swept_tests,
        complete: report.complete,
        first: first.map(ToString::to_string).collect(),
    }
}

/// How it ended, in view of what the checker found.
fn ending(
    scene: &Scene,
    finished: &Finished,
    checker: Option<&Checker>,
) -> (Ending, Option<String>) {
    let reason = finished.reason.clone();
    let violations = checker.map_or(0, |checker| checker.violations);
    if violations > 0 && finished.outcome != RunOutcome::Violated {
        let found = format!(
            "the checker found {}",
            output::count(violations, "violation")
        );
        return (Ending::Violated, Some(found));
    }
    match finished.outcome {
        RunOutcome::Solved if checker.is_none() => {
            let reason = "solved, but there is no trace to check".to_owned();
            (Ending::Failed, Some(reason))
        }
        RunOutcome::Solved => (Ending::Solved, reason),
        // What is proved of the scenario is not proved of what it has become.
        RunOutcome::Stuck if finished.world.scene_changes > 0 => (Ending::Stuck, reason),
        RunOutcome::Stuck => match Proof::search(scene).0 {
            Some(proof) => (Ending::Infeasible, Some(proof.to_string())),
            None if finished.world.verdict == Verdict::Exhausted.code() => {
                (Ending::Infeasible, reason)
            }
            None => (Ending::Stuck, reason),
        },
        RunOutcome::Timeout => (Ending::Timeout, reason),
        RunOutcome::Interrupted => (Ending::Interrupted, reason),
        RunOutcome::Violated => (Ending::Violated, reason),
        RunOutcome::Running | RunOutcome::Failed => (Ending::Failed, reason),
    }
}
