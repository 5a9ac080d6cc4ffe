//! What follows from the rows: growth exponents, lines, findings.
//!
//! Responsible for: choosing the points a power law is fitted to, drawing them.
//! Not responsible for: the fit (`stats`), the drawing (`figure`).

use crate::figure::{Axis, Figure, FigureError, Scale, Series, lines};
use crate::results::{Finding, Results, Table};
use crate::stats::{growth_exponent, median};

use super::steps::Step;

/// Rooms with fewer objects are all the same size: growth is told from here on.
const LEAST_OBJECTS: f64 = 7.0;
/// An exponent up to here is called near-linear: neighbours of cells, caches and the logarithm
/// of a sort take what is beyond 1.
const NEAR_LINEAR: f64 = 1.25;
/// What the work of first plans of warehouses is to grow with at most.
const PLAN_EXPONENT: f64 = 1.5;
/// The largest task set of the paper's own kind of question, and what is asked of it.
const LARGE: usize = 1_000;
const SECONDS: f64 = 10.0;

/// The growth exponent of each step's work and time, with what each table is swept over.
pub(super) fn table(swept: [(&Table, &str); 3]) -> Table {
    let mut table = Table::new(
        "growth",
        "Growth: exponent b of a·xᵇ, with its 95 % interval",
    )
    .key("step", "", "what was computed")
    .key("against", "", "what x is")
    .key("measure", "", "what grows")
    .info("sizes", "", "different x")
    .lower(
        "exponent",
        "",
        "b, by least squares of the logarithms over all rows",
    )
    .info("low", "", "lower end of its interval")
    .info("high", "", "upper end");
    for (rows, against) in swept {
        for step in Step::PAPER.into_iter().chain([Step::FirstPlan]) {
            for measure in ["work", "step_wall_s"] {
                let points = points(rows, step, against, measure);
                let mut sizes: Vec<_> = points.iter().map(|(x, _)| *x).collect();
                sizes.sort_by(f64::total_cmp);
                sizes.dedup();
                if let Some(growth) = growth_exponent(&points)
                    && sizes.len() >= 3
                {
                    table.push(vec![
                        step.name().into(),
                        against.into(),
                        measure.into(),
                        sizes.len().into(),
                        growth.value.into(),
                        growth.low.into(),
                        growth.high.into(),
                    ]);
                }
            }
        }
    }
    table
}

fn points(rows: &Table, step: Step, against: &str, measure: &str) -> Vec<(f64, f64)> {
    let keys = [("step", step.name())];
    let xs = rows.numbers(against, &keys);
    xs.zip(rows.numbers(measure, &keys))
        .filter(|(x, _)| *x >= LEAST_OBJECTS)
        .collect()
}

/// Time and work of every step against objects, and time against points.
pub(super) fn figures(by_objects: &Table, by_points: &Table) -> Result<Vec<Figure>, FigureError> {
    let drawn = [
        (
            by_objects,
            "objects",
            "objects",
            "step_wall_s",
            "wall time, s",
        ),
        (
            by_objects,
            "objects",
            "objects",
            "work",
            "work, in units of each step's own",
        ),
        (
            by_points,
            "points",
            "lattice points",
            "step_wall_s",
            "wall time, s",
        ),
    ];
    let mut figures = Vec::new();
    for (rows, against, x_label, measure, y_label) in drawn {
        let series: Vec<_> = Step::PAPER
            .into_iter()
            .map(|step| series(rows, step, against, measure))
            .filter(|series| !series.points.is_empty())
            .collect();
        if series.is_empty() {
            continue;
        }
        let axis = |label| Axis {
            label,
            scale: Scale::Log,
        };
        let title = format!("Planning against {x_label}: {y_label}");
        let caption = "Medians over rooms, with the range. On these axes a straight line is a \
                       power law, and its slope is the exponent.";
        figures.push(lines(
            &title,
            caption,
            (axis(x_label), axis(y_label)),
            &series,
        )?);
    }
    Ok(figures)
}

fn series(rows: &Table, step: Step, against: &str, measure: &str) -> Series {
    let mut series = Series {
        name: step.name().to_owned(),
        ..Series::default()
    };
    let all = points(rows, step, against, measure);
    let mut sizes: Vec<_> = all.iter().map(|(x, _)| *x).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.dedup();
    for size in sizes {
        let at: Vec<_> = (all.iter().filter(|(x, y)| *x == size && *y > 0.0))
            .map(|(_, y)| *y)
            .collect();
        if let Some(middle) = median(&at) {
            let low = at.iter().copied().fold(f64::INFINITY, f64::min);
            let high = at.iter().copied().fold(0.0, f64::max);
            series.points.push((size, middle));
            series.intervals.push((low, high));
        }
    }
    series
}

/// What is claimed of growth.
pub(super) fn findings(growth: &Table, by_objects: &Table, results: &mut Results) {
    let easy = Step::Easy.name();
    let keys = [("step", easy), ("against", "objects"), ("measure", "work")];
    let exponent = growth.numbers("exponent", &keys).next();
    results.findings.push(Finding {
        claim: "the work of easy constraints grows near-linearly with objects that lie apart"
            .to_owned(),
        held: exponent.map(|exponent| exponent <= NEAR_LINEAR),
        evidence: exponent.map_or_else(
            || "not enough sizes".to_owned(),
            |exponent| format!("tests made grow as objects to the power of {exponent:.2}"),
        ),
    });
    for measure in ["work", "step_wall_s"] {
        let keys = [("step", Step::FirstPlan.name()), ("measure", measure)];
        let exponent = growth.numbers("exponent", &keys).next();
        results.findings.push(Finding {
            claim: format!(
                "first plans of warehouses: {measure} grows at most as objects to the power of \
                 {PLAN_EXPONENT}, at fixed density and objects per robot"
            ),
            held: exponent.map(|exponent| exponent <= PLAN_EXPONENT),
            evidence: exponent.map_or_else(
                || "not enough sizes".to_owned(),
                |exponent| format!("the exponent is {exponent:.2}"),
            ),
        });
    }
    let objects = LARGE.to_string();
    let keys = [("step", Step::HardFloods.name()), ("objects", &*objects)];
    let times: Vec<_> = by_objects.numbers("step_wall_s", &keys).collect();
    let time_s = median(&times);
    let points = by_objects
        .numbers("points", &keys)
        .next()
        .unwrap_or(f64::NAN);
    let tests = 2 * LARGE * (LARGE - 1);
    results.findings.push(Finding {
        claim: format!("all {tests} hard tests of {LARGE} objects take seconds"),
        held: time_s.map(|time_s| time_s <= SECONDS),
        evidence: time_s.map_or_else(
            || format!("rooms of {LARGE} objects were not measured"),
            |time_s| format!("{time_s:.3} s on {points} lattice points, median"),
        ),
    });
}
