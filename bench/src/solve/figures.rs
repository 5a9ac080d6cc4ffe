//! How near R, by robots; how many rooms are solved, by objects.
//!
//! Responsible for: which numbers are drawn.
//! Not responsible for: drawing itself (`figure`), the numbers (`summary`).

use super::rooms::Set;
use super::summary::{GROUPS, SHARES, TARGET_RATIOS, mean_ratio};
use super::{METHODS, Solved};
use crate::figure::{Axis, Figure, FigureError, Scale, Series, lines};
use crate::results::Table;

/// All figures that the rooms allow.
///
/// # Errors
/// A figure cannot be drawn.
pub fn all(solved: &[Solved], tables: &[Table]) -> Result<Vec<Figure>, FigureError> {
    let mut figures = Vec::new();
    figures.extend(ratios(solved)?);
    let shares = tables.iter().find(|table| table.name == SHARES);
    for by in ["objects", "robots"] {
        figures.extend(
            shares
                .map(|table| solved_by(table, by))
                .transpose()?
                .flatten(),
        );
    }
    Ok(figures)
}

/// An axis of numbers in proportion.
const fn linear(label: &str) -> Axis<'_> {
    Axis {
        label,
        scale: Scale::Linear,
    }
}

fn ratios(solved: &[Solved]) -> Result<Option<Figure>, FigureError> {
    let mut series = Vec::new();
    for (name, sets) in GROUPS {
        let mut one = Series {
            name: format!("{name} rooms"),
            ..Series::default()
        };
        for robots in 1..=TARGET_RATIOS.len() {
            if let Some(mean) = mean_ratio(solved, sets, robots) {
                one.points.push((robots as f64, mean.value));
                one.intervals.push((mean.low, mean.high));
            }
        }
        series.extend((!one.points.is_empty()).then_some(one));
    }
    if series.is_empty() {
        return Ok(None);
    }
    series.push(Series {
        name: "target in the paper's and seeded rooms".to_owned(),
        points: (1..).map(f64::from).zip(TARGET_RATIOS).collect(),
        intervals: Vec::new(),
    });
    let caption = "Mean makespan of the default method by R, with 95 % intervals, over the rooms that it solved and whose R is known exactly.";
    let axes = (linear("robots"), linear("makespan by R"));
    lines("Makespan against R", caption, axes, &series).map(Some)
}

/// The share of generated rooms that each method solved.
fn solved_by(shares: &Table, by: &str) -> Result<Option<Figure>, FigureError> {
    let keys = [("set", Set::Generated.word()), ("by", by)];
    let series: Vec<_> = METHODS
        .iter()
        .map(|method| {
            let values = shares.numbers("value", &keys);
            let percent = shares
                .numbers(method.word(), &keys)
                .map(|share| share * 100.0);
            Series {
                name: method.word().to_owned(),
                points: values.zip(percent).collect(),
                intervals: Vec::new(),
            }
        })
        .collect();
    if series.iter().all(|one| one.points.is_empty()) {
        return Ok(None);
    }
    let title = format!("Generated rooms solved, by {by}");
    let caption = "Share of the generated rooms, over all densities and extra moves.";
    let axes = (linear(by), linear("solved, %"));
    lines(&title, caption, axes, &series).map(Some)
}
