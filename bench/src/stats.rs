//! Statistics of small samples.
//!
//! Responsible for: quantiles, bootstrap intervals, growth exponents.
//! Not responsible for: which rows belong together (`results`).
//!
//! Source: B. Efron, "Bootstrap methods: another look at the jackknife" (1979): percentile
//! intervals from resamples drawn with a fixed seed, so the same rows give the same interval.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Resamples of a bootstrap interval.
const RESAMPLES: usize = 2_000;
/// Seed of the resampling: any number does, always the same one gives the same interval.
const SEED: u64 = 0x5eed;
/// Share of the resamples that lie outside an interval.
const OUTSIDE: f64 = 0.05;

/// An estimate with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The estimate itself.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Quantile `share` (0–1) of `sample`, between neighbours in proportion; none of nothing.
#[must_use]
pub fn quantile(sample: &[f64], share: f64) -> Option<f64> {
    let mut sorted = sample.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(last);
    Some(sorted[below] + (sorted[above] - sorted[below]) * (place - below as f64))
}

/// Median of `sample`; none of nothing.
#[must_use]
pub fn median(sample: &[f64]) -> Option<f64> {
    quantile(sample, 0.5)
}

/// Mean of `sample`; none of nothing.
#[must_use]
pub fn mean(sample: &[f64]) -> Option<f64> {
    (!sample.is_empty()).then(|| sample.iter().sum::<f64>() / sample.len() as f64)
}

/// Mean of `sample` with its interval; none of nothing.
#[must_use]
pub fn mean_interval(sample: &[f64]) -> Option<Estimate> {
    interval(sample, mean)
}

/// Median of `sample` with its interval; none of nothing.
#[must_use]
pub fn median_interval(sample: &[f64]) -> Option<Estimate> {
    interval(sample, median)
}

fn interval<T: Copy>(sample: &[T], statistic: impl Fn(&[T]) -> Option<f64>) -> Option<Estimate> {
    let value = statistic(sample)?;
    let mut draw = Draw::new();
    let resamples: Vec<_> = (0..RESAMPLES)
        .filter_map(|_| statistic(&draw.of(sample)))
        .collect();
    between(value, &resamples)
}

/// Ratio of the medians, `over` by `under`, with its interval; none if either is empty or the
/// lower median is not positive.
#[must_use]
pub fn ratio_interval(over: &[f64], under: &[f64]) -> Option<Estimate> {
    let ratio = |over: &[f64], under: &[f64]| {
        let under = median(under).filter(|median| *median > 0.0)?;
        Some(median(over)? / under)
    };
    let value = ratio(over, under)?;
    let mut draw = Draw::new();
    let resamples: Vec<_> = (0..RESAMPLES)
        .filter_map(|_| ratio(&draw.of(over), &draw.of(under)))
        .collect();
    between(value, &resamples)
}

/// Ratio of the means of pairs, first by second, with its interval over resampled pairs; none
/// without a pair or if the second mean is not positive.
#[must_use]
pub fn ratio_of_means_interval(pairs: &[(f64, f64)]) -> Option<Estimate> {
    let ratio = |pairs: &[(f64, f64)]| {
        let over: f64 = pairs.iter().map(|pair| pair.0).sum();
        let under: f64 = pairs.iter().map(|pair| pair.1).sum();
        (under > 0.0).then(|| over / under)
    };
    interval(pairs, ratio)
}

/// Exponent b of y = a·xᵇ through the points, by least squares of the logarithms, with its
/// interval over resampled points; points that are not positive do not count. None of fewer than
/// two different x.
#[must_use]
pub fn growth_exponent(points: &[(f64, f64)]) -> Option<Estimate> {
    let logs: Vec<_> = points
        .iter()
        .filter(|(x, y)| *x > 0.0 && *y > 0.0)
        .map(|(x, y)| (x.ln(), y.ln()))
        .collect();
    interval(&logs, slope)
}

fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let xs: Vec<_> = points.iter().map(|(x, _)| *x).collect();
    let ys: Vec<_> = points.iter().map(|(_, y)| *y).collect();
    let (x, y) = (mean(&xs)?, mean(&ys)?);
    let spread: f64 = xs.iter().map(|one| (one - x).powi(2)).sum();
    let product: f64 = points.iter().map(|(a, b)| (a - x) * (b - y)).sum();
    (spread > 1e-12).then(|| product / spread)
}

/// An estimate with the interval that its resamples span, but for those outside.
fn between(value: f64, resamples: &[f64]) -> Option<Estimate> {
    Some(Estimate {
        value,
        low: quantile(resamples, OUTSIDE / 2.0)?,
        high: quantile(resamples, 1.0 - OUTSIDE / 2.0)?,
    })
}

/// Draws resamples, with replacement.
struct Draw(ChaCha8Rng);

impl Draw {
    fn new() -> Self {
        Self(ChaCha8Rng::seed_from_u64(SEED))
    }

    fn of<T: Copy>(&mut self, sample: &[T]) -> Vec<T> {
        (0..sample.len())
            .map(|_| sample[self.0.random_range(0..sample.len())])
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_neighbours() {
        assert_eq!(quantile(&[3.0, 1.0, 2.0], 0.5), Some(2.0));
        assert_eq!(quantile(&[0.0, 10.0], 0.25), Some(2.5));
        assert_eq!(quantile(&[7.0], 0.99), Some(7.0));
        assert_eq!(median(&[]), None);
    }

    #[test]
    fn an_interval_holds_its_estimate_and_narrows_with_the_sample() {
        let few: Vec<_> = (0..8).map(|i| f64::from(i % 4)).collect();
        let many: Vec<_> = (0..800).map(|i| f64::from(i % 4)).collect();
        let (few, many) = (mean_interval(&few).unwrap(), mean_interval(&many).unwrap());
        for estimate in [few, many] {
            assert!(estimate.low <= 1.5 && 1.5 <= estimate.high);
        }
        assert!(many.high - many.low < (few.high - few.low) / 4.0);
    }

    #[test]
    fn equal_numbers_have_no_spread() {
        let estimate = ratio_interval(&[6.0; 5], &[3.0; 5]).unwrap();
        assert_eq!(
            (estimate.low, estimate.value, estimate.high),
            (2.0, 2.0, 2.0)
        );
        assert_eq!(ratio_interval(&[1.0], &[0.0]), None);
    }

    #[test]
    fn the_exponent_of_a_power_law_is_found() {
        let points: Vec<_> = (1..20).map(f64::from).map(|x| (x, 3.0 * x * x)).collect();
        let exponent = growth_exponent(&points).unwrap();
        assert!((exponent.value - 2.0).abs() < 1e-9 && (exponent.high - 2.0).abs() < 1e-9);
        assert_eq!(growth_exponent(&[(2.0, 1.0), (2.0, 3.0)]), None);
    }
}
