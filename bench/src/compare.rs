//! Two results against each other: what got better, what got worse, beyond the noise.
//!
//! Responsible for: matching rows by what was measured, ratios with intervals, the verdict.
//! Not responsible for: reading files (`files`).
//!
//! Terms: a measure is *worse* when the whole 95 % interval of the ratio B / A lies on the bad
//! side of 1 by more than [`TOLERANCE`]; with one repeat on each side there is no interval, and
//! only a difference beyond [`ALONE`] counts.

use crate::results::{Column, Results, Role, Table};
use crate::stats::{Estimate, median, ratio_interval};

/// Share by which a ratio may differ from 1 before it matters at all.
pub const TOLERANCE: f64 = 0.02;
/// Share that matters where there is but one repeat, so that nothing is known of the noise.
pub const ALONE: f64 = 0.10;

/// Why two results cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CompareError {
    /// They are of different benchmarks.
    #[error("A is of benchmark {a}, B of {b}: only results of the same benchmark can be compared")]
    Benchmarks {
        /// Benchmark of A.
        a: String,
        /// Benchmark of B.
        b: String,
    },
    /// Nothing was measured in both.
    #[error("nothing was measured in both results: they have no row in common")]
    Disjoint,
}

/// What became of a measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Better beyond the noise.
    Better,
    /// Within the noise.
    Same,
    /// Worse beyond the noise.
    Worse,
}

/// One measure of one thing, in both results.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Table it is in.
    pub table: String,
    /// What was measured: the cells of the key columns.
    pub what: Vec<String>,
    /// Name of the measure.
    pub measure: String,
    /// Median in A.
    pub a: f64,
    /// Median in B.
    pub b: f64,
    /// B / A.
    pub ratio: Estimate,
    /// What became of it.
    pub verdict: Verdict,
}

/// Everything measured in both, in the order of A.
///
/// # Errors
/// The results are of different benchmarks or have nothing in common.
pub fn compare(a: &Results, b: &Results) -> Result<Vec<Change>, CompareError> {
    if a.benchmark != b.benchmark {
        return Err(CompareError::Benchmarks {
            a: a.benchmark.clone(),
            b: b.benchmark.clone(),
        });
    }
    let mut changes = Vec::new();
    let mut common = false;
    for first in &a.tables {
        let Some(second) = b.table(&first.name) else {
            continue;
        };
        let others = second.groups();
        for (what, rows) in first.groups() {
            let Some((_, other_rows)) = others.iter().find(|(other, _)| *other == what) else {
                continue;
            };
            common = true;
            for column in first
                .columns
                .iter()
                .filter(|column| column.role.is_judged())
            {
                let sides = (
                    numbers(first, column, &rows),
                    numbers(second, column, other_rows),
                );
                changes.extend(change(first, column, &what, &sides));
            }
        }
    }
    if common {
        Ok(changes)
    } else {
        Err(CompareError::Disjoint)
    }
}

fn numbers(table: &Table, column: &Column, rows: &[usize]) -> Vec<f64> {
    let Some(index) = table.position(&column.name) else {
        return Vec::new();
    };
    rows.iter()
        .filter_map(|row| table.rows[*row][index].number())
        .collect()
}

fn change(
    table: &Table,
    column: &Column,
    what: &[String],
    (a, b): &(Vec<f64>, Vec<f64>),
) -> Option<Change> {
    let (before, after) = (median(a)?, median(b)?);
    let ratio = ratio_interval(b, a).or_else(|| from_zero(before, after))?;
    Some(Change {
        table: table.name.clone(),
        what: what.to_vec(),
        measure: column.name.clone(),
        a: before,
        b: after,
        ratio,
        verdict: verdict(column.role, ratio, a.len().min(b.len())),
    })
}

/// A measure that was zero: the same if it still is, else as many times worse as numbers allow.
fn from_zero(before: f64, after: f64) -> Option<Estimate> {
    if before != 0.0 {
        return None;
    }
    let value = if after == 0.0 { 1.0 } else { f64::MAX };
    Some(Estimate {
        value,
        low: value,
        high: value,
    })
}

fn verdict(role: Role, ratio: Estimate, repeats: usize) -> Verdict {
    let margin = if repeats > 1 { TOLERANCE } else { ALONE };
    let (rose, fell) = (ratio.low > 1.0 + margin, ratio.high < 1.0 - margin);
    match (role, rose, fell) {
        (Role::Lower, true, _) | (Role::Higher, _, true) => Verdict::Worse,
        (Role::Lower, _, true) | (Role::Higher, true, _) => Verdict::Better,
        _ => Verdict::Same,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn results(times: &[f64]) -> Results {
        let mut results = Results::new("paper", "");
        let mut table = Table::new("runs", "Runs")
            .key("room", "", "")
            .repeat()
            .lower("time_s", "s", "")
            .higher("rate", "", "");
        for (repeat, time) in times.iter().enumerate() {
            table.push(vec![
                "a".into(),
                repeat.into(),
                (*time).into(),
                (1.0 / time).into(),
            ]);
        }
        results.tables.push(table);
        results
    }

    fn verdicts(a: &[f64], b: &[f64]) -> Vec<Verdict> {
        let changes = compare(&results(a), &results(b)).unwrap();
        changes.iter().map(|change| change.verdict).collect()
    }

    #[test]
    fn slower_is_worse_and_faster_is_better_by_either_measure() {
        let (fast, slow) = ([1.0, 1.01, 1.02, 1.0, 1.01], [1.3, 1.31, 1.29, 1.3, 1.32]);
        assert_eq!(verdicts(&fast, &slow), [Verdict::Worse; 2]);
        assert_eq!(verdicts(&slow, &fast), [Verdict::Better; 2]);
        assert_eq!(verdicts(&fast, &fast), [Verdict::Same; 2]);
    }

    #[test]
    fn a_difference_within_the_spread_is_noise() {
        let (a, b) = ([1.0, 1.5, 0.7, 1.2, 0.9], [1.1, 1.4, 0.8, 1.3, 0.9]);
        assert_eq!(verdicts(&a, &b), [Verdict::Same; 2]);
    }

    #[test]
    fn one_repeat_needs_a_large_difference() {
        assert_eq!(verdicts(&[1.0], &[1.05]), [Verdict::Same; 2]);
        assert_eq!(verdicts(&[1.0], &[1.5]), [Verdict::Worse; 2]);
    }

    #[test]
    fn what_has_nothing_in_common_is_not_compared() {
        let mut other = results(&[1.0]);
        other.tables[0].rows[0][0] = "b".into();
        assert_eq!(
            compare(&results(&[1.0]), &other),
            Err(CompareError::Disjoint)
        );
        other.benchmark = "latency".to_owned();
        assert!(matches!(
            compare(&results(&[1.0]), &other),
            Err(CompareError::Benchmarks { .. })
        ));
    }

    #[test]
    fn a_measure_that_was_zero_is_the_same_or_worse_beyond_all_numbers() {
        let ratio = |before, after| from_zero(before, after).map(|estimate| estimate.value);
        assert_eq!(ratio(0.0, 0.0), Some(1.0));
        assert_eq!(ratio(0.0, 2.0), Some(f64::MAX));
        assert_eq!(ratio(1.0, 2.0), None);
    }
}
