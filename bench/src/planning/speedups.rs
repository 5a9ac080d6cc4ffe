//! What was made faster, before and after, in the same rooms and the same run.
//!
//! Responsible for: taking turns between the two ways, and the ratios that follow.
//! Not responsible for: that both give the same answers (property tests of crate `planner`).

use crate::progress::Progress;
use crate::results::{Finding, Results, Table, Value};
use crate::stats::ratio_interval;

use super::room::{self, Room};
use super::steps::{Step, Workbench};
use super::{Options, PlanningError};

/// Steps of progress.
pub(super) const STEPS: usize = CASES.len();

/// One comparison.
struct Case {
    what: &'static str,
    before: Step,
    after: Step,
    objects: usize,
    area_m2: f64,
    walls: usize,
    /// Runs of each way; of the slower one, if it is very slow.
    after_runs: usize,
    before_runs: usize,
    /// How many times as fast it has to be.
    least: f64,
}

const CASES: [Case; 4] = [
    Case {
        what: "all hard constraints: floods for plans, 68.8 m²",
        before: Step::HardPlain,
        after: Step::HardFloods,
        objects: 100,
        area_m2: 68.8,
        walls: 6,
        before_runs: 3,
        after_runs: 200,
        least: 100.0,
    },
    Case {
        what: "all hard constraints: floods for plans, 137.6 m²",
        before: Step::HardPlain,
        after: Step::HardFloods,
        objects: 100,
        area_m2: 137.6,
        walls: 12,
        before_runs: 2,
        after_runs: 200,
        least: 100.0,
    },
    Case {
        what: "all hard constraints: floods for plans, 340 m²",
        before: Step::HardPlain,
        after: Step::HardFloods,
        objects: 100,
        area_m2: 340.0,
        walls: 60,
        before_runs: 1,
        after_runs: 200,
        least: 100.0,
    },
    Case {
        what: "easy constraints: what is near for every pair",
        before: Step::EasyPlain,
        after: Step::Easy,
        objects: 500,
        area_m2: 1_700.0,
        walls: 300,
        before_runs: 200,
        after_runs: 200,
        least: 5.0,
    },
];

/// Rooms that a quick measurement leaves out.
const TOO_LONG_FOR_QUICK: [usize; 1] = [2];

/// Measures all comparisons.
pub(super) fn measure(
    options: &Options,
    progress: &mut dyn Progress,
    results: &mut Results,
) -> Result<Table, PlanningError> {
    let mut table = Table::new("speedups", "Before and after")
        .key("what", "", "what was made faster")
        .key("objects", "", "objects in the room")
        .info("area_m2", "m²", "free floor")
        .repeat()
        .info("before_wall_s", "s", "wall time of the way before")
        .lower("after_wall_s", "s", "wall time of the way after");
    for (index, case) in CASES.iter().enumerate() {
        if progress.is_interrupted() {
            results.partial = true;
            break;
        }
        progress.step(case.what);
        if options.quick && TOO_LONG_FOR_QUICK.contains(&index) {
            continue;
        }
        let room = room::of_area(case.objects, case.area_m2, case.walls, options.seed, 1)?;
        let before_runs = if options.quick && case.before == Step::HardPlain {
            1
        } else {
            case.before_runs
        };
        let (before, after) = take_turns(&room, case, before_runs, progress);
        for (repeat, &after_s) in after.iter().enumerate() {
            table.push(vec![
                case.what.into(),
                case.objects.into(),
                case.area_m2.into(),
                repeat.into(),
                Value::from(before.get(repeat).copied()),
                after_s.into(),
            ]);
        }
        results.findings.push(finding(case, &before, &after));
    }
    Ok(table)
}

fn take_turns(
    room: &Room,
    case: &Case,
    before_runs: usize,
    progress: &dyn Progress,
) -> (Vec<f64>, Vec<f64>) {
    let (mut before, mut after) = (Vec::new(), Vec::new());
    let mut bench = Workbench::new(room);
    // Once for the caches, not counted.
    bench.measure(case.after, 0);
    for run in 0..case.after_runs {
        if progress.is_interrupted() {
            break;
        }
        if run < before_runs {
            before.push(bench.measure(case.before, 0).time_s);
        }
        after.push(bench.measure(case.after, 0).time_s);
    }
    (before, after)
}

fn finding(case: &Case, before: &[f64], after: &[f64]) -> Finding {
    let ratio = ratio_interval(before, after);
    Finding {
        claim: format!("{}: at least {} times as fast", case.what, case.least),
        held: ratio.map(|ratio| ratio.value >= case.least),
        evidence: ratio.map_or_else(
            || "not measured".to_owned(),
            |ratio| {
                format!(
                    "{:.0} times [{:.0}, {:.0}], medians of {} and {} runs",
                    ratio.value,
                    ratio.low,
                    ratio.high,
                    before.len(),
                    after.len()
                )
            },
        ),
    }
}
