//! Real processes over shared memory: the supervisor of crate `node` does the work.
//!
//! Responsible for: what the supervisor is asked to start, and the check of what it left.
//! Not responsible for: the processes.

use std::env;
use std::fs::File;
use std::time::Duration;

use node::domain::{DomainError, RunFile};
use node::options::Recovery;
use node::{Launcher, RunError, RunOptions, RunPlan, RunReport, supervisor};
use scene::Scene;
use shm_types::Outcome;

use crate::drivers::Finished;
use crate::drivers::recording::keep;
use crate::exit::{Exit, Failure};
use crate::progress::Progress;
use crate::result::RoleLine;
use crate::run_options::ProcessArgs;

/// Runs `scene` to its end, as `process` says.
///
/// # Errors
/// The run cannot be started.
pub(crate) fn run(
    scene: &Scene,
    process: &ProcessArgs,
    options: RunOptions,
    progress: &mut Progress,
) -> Result<Finished, Failure> {
    let plan = RunPlan {
        name: process.name.clone(),
        recovery: Recovery {
            restart: process.restart,
            give_up_after: process.give_up_after,
        },
        silence_limit: Duration::from_secs_f64(process.silence_limit),
        ..plan(scene, options)?
    };
    let is_kept = plan.options.trace.is_some();
    let report = supervisor::run(&plan, progress).map_err(refused)?;
    Ok(checked(report, is_kept))
}

/// Goes on with the run of this id or name; its scene, its options and what came of it.
///
/// # Errors
/// There is none that can be gone on with.
pub(crate) fn resume(
    run: &str,
    progress: &mut Progress,
) -> Result<(Scene, RunOptions, Finished), Failure> {
    let launcher = launcher()?;
    let mut planned = None;
    let plan = |file: &RunFile, scenario: String| {
        let plan = RunPlan {
            name: Some(file.name.clone()),
            recovery: file.recovery,
            silence_limit: Duration::from_secs_f64(file.silence_limit_s),
            ..RunPlan::new(scenario, file.options.clone(), launcher)
        };
        planned = Some((plan.scenario.clone(), plan.options.clone()));
        plan
    };
    let report = supervisor::resume(run, plan, progress).map_err(refused)?;
    let (scenario, options) = planned.ok_or_else(|| Failure::system("the run has no plan"))?;
    let scene = scene::parse(&scenario, "scenario.toml").map_err(Failure::system)?;
    let is_kept = options.trace.is_some();
    Ok((scene, options, checked(report, is_kept)))
}

/// What is left of a run, with what the checker says of its trace. One that shows a broken
/// invariant is kept, though it was not to be.
fn checked(report: RunReport, is_kept: bool) -> Finished {
    let mut notes = Vec::new();
    let (mut check, mut evidence) = (None, None);
    // While there is a report the trace can be read, and not after.
    if let Some(path) = report.trace.as_deref() {
        match trace::check_file(path) {
            Ok(found) => check = Some(found),
            Err(error) => notes.push(format!("the trace cannot be checked: {error}")),
        }
        let found = check.as_ref().is_some_and(|c| !c.violations.is_empty());
        if !is_kept && (found || report.outcome == Outcome::Violated) {
            match File::open(path).map_err(Into::into).and_then(keep) {
                Ok(path) => evidence = Some(path),
                Err(error) => notes.push(error.to_string()),
            }
        }
    }
    let mut finished = finished(report);
    finished.notes.extend(notes);
    Finished {
        check,
        evidence,
        ..finished
    }
}

/// A plan whose roles are this very program.
///
/// # Errors
/// The program cannot find itself.
pub(crate) fn plan(scene: &Scene, options: RunOptions) -> Result<RunPlan, Failure> {
    let text = scene::to_canonical_toml(scene);
    Ok(RunPlan::new(text, options, launcher()?))
}

/// How this very program is started as a role.
///
/// # Errors
/// The program cannot find itself.
pub(crate) fn launcher() -> Result<Launcher, Failure> {
    let program = env::current_exe()
        .map_err(|error| Failure::system(format!("this program cannot find itself: {error}")))?;
    Ok(Launcher {
        program,
        before: Vec::new(),
        inherit_stderr: env::var_os("RUST_LOG").is_some(),
    })
}

/// The failure that a run which could not be started ends in.
pub(crate) fn refused(error: RunError) -> Failure {
    let exit = match error {
        RunError::Options(_) => Exit::Usage,
        RunError::Domain(DomainError::NotResumable { .. } | DomainError::Live(_)) => Exit::BadInput,
        _ => Exit::System,
    };
    Failure::new(exit, error)
}

fn finished(report: RunReport) -> Finished {
    Finished {
        outcome: report.outcome,
        reason: report.reason,
        world: report.world,
        work: report.counters,
        latency: report.latency,
        roles: report.roles.iter().map(RoleLine::from).collect(),
        deadline_misses: report.deadline_misses,
        restarts: report.restarts,
        lost_commands: report.lost_commands,
        wall_s: report.wall_s,
        oversubscribed: report.oversubscribed,
        notes: report.notes,
        check: None,
        evidence: None,
    }
}
