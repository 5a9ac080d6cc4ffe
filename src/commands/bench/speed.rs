//! `rearrange bench speed`: how fast this machine runs a scenario.
//!
//! Responsible for: handing real processes to the workload, printing what it measured.
//! Not responsible for: the measurement (crate `bench`).

use bench::speed::{self, Report, Run, Speed, Workload};
use node::options::processes;
use node::{RunOptions, RunPlan, supervisor};
use scene::{Method, Settings};
use shm_types::Outcome as RunOutcome;

use crate::cli::SpeedArgs;
use crate::drivers::processes::{plan, refused};
use crate::exit::{Exit, Failure, Outcome};
use crate::{output, scenario, table};

/// Measures world time per wall time with both drivers.
pub(crate) fn main(args: &SpeedArgs) -> Outcome {
    let scene = scenario::load(&args.scenario, args.robots)?.scene;
    if let Some(proof) = planner::certificate(&scene) {
        let message = format!("{} cannot be solved: {proof}", scene.name);
        return Err(Failure::new(Exit::Infeasible, message));
    }
    let settings = Settings {
        method: Method::GraspingAndRestricted,
        ..Settings::default()
    };
    let workload = Workload {
        scene: &scene,
        settings: &settings,
        ticks: args.ticks,
    };
    let plan = plan(&scene, RunOptions::new(settings.clone()))?;
    let in_process = speed::in_process(&workload);
    let lockstep = speed::lockstep(&workload, processes(scene.counts()), || once(&plan))?;
    let report = Report::new(&workload, vec![in_process, lockstep]);
    if args.json {
        output::print_json(&report)?;
    } else {
        output::print(&text(&report))?;
    }
    Ok(Exit::Success)
}

/// One run of real processes.
fn once(plan: &RunPlan) -> Result<Run, Failure> {
    let report = supervisor::run(plan, &mut ()).map_err(refused)?;
    match report.outcome {
        RunOutcome::Solved | RunOutcome::Stuck | RunOutcome::Timeout => Ok(Run {
            ticks: report.world.ticks,
            world_s: report.world.time_ns as f64 / 1e9,
            wall_s: report.wall_s,
            moving: report
                .world
                .activities
                .iter()
                .map(|robot| robot.moving)
                .sum(),
        }),
        RunOutcome::Interrupted => Err(Failure::new(Exit::Interrupted, "interrupted")),
        outcome => {
            let reason = report.reason.unwrap_or_default();
            Err(Failure::system(format!(
                "a run ended as {outcome:?}: {reason}"
            )))
        }
    }
}

fn text(report: &Report) -> String {
    let mut table = table::plain();
    table.set_header([
        "DRIVER",
        "PROCESSES",
        "RUNS",
        "TICKS",
        "WORLD s",
        "WALL s",
        "WORLD/WALL",
        "µs/TICK",
        "MOVING",
    ]);
    for row in &report.rows {
        table.add_row(cells(row));
    }
    format!(
        "{}: {}, {}, tick {} ms, {}\n{}\n{}\n{}",
        report.scenario,
        output::count(report.robots as u64, "robot"),
        output::count(report.objects as u64, "object"),
        report.settings.tick_ns as f64 / 1e6,
        report.settings.method,
        report.machine,
        report.date,
        table::finish(&table)
    )
}

fn cells(row: &Speed) -> [String; 9] {
    [
        row.driver.to_owned(),
        row.processes.to_string(),
        row.runs.to_string(),
        row.ticks.to_string(),
        format!("{:.2}", row.world_s),
        format!("{:.3}", row.wall_s),
        format!("{:.0}", row.ratio),
        format!("{:.2}", row.us_per_tick),
        format!("{:.2}", row.moving_robots),
    ]
}
