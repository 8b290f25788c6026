//! Statistics of trials: percentiles, bound of a failure rate, histogram.

/// Reported percentiles, in thousandths.
pub const PER_MILLE: [u64; 7] = [10, 50, 500, 950, 990, 999, 1000];
/// Names of the percentiles.
pub const NAMES: [&str; 7] = ["p1", "p5", "p50", "p95", "p99", "p99.9", "max"];

/// Sorts in increasing order. NaN counts as the largest value, since a run without a metric is worse than any run with
/// one.
pub fn sort(values: &mut [f64]) {
    values.iter_mut().filter(|value| value.is_nan()).for_each(|value| *value = f64::NAN);
    values.sort_unstable_by(f64::total_cmp);
}

/// Returns the percentile of sorted values by nearest rank; NaN if there are none.
pub fn percentile(sorted: &[f64], per_mille: u64) -> f64 {
    let rank = (per_mille * sorted.len() as u64).div_ceil(1000).max(1) as usize;
    sorted.get(rank - 1).copied().unwrap_or(f64::NAN)
}

/// Returns the upper confidence bound of a failure probability for independent trials (Clopper and Pearson, one-sided):
/// the p with
///
/// ```text
/// sum over k <= failures of C(trials, k) p^k (1 - p)^(trials - k) = 1 - confidence
/// ```
///
/// The relative error is about 1e-9 (test `the_bound_is_that_of_the_beta_distribution`).
pub fn largest_rate(failures: u64, trials: u64, confidence: f64) -> f64 {
    if failures >= trials {
        return 1.0;
    }
    let (mut low, mut high) = (failures as f64 / trials as f64, 1.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if at_most(failures, trials, middle) > 1.0 - confidence { low = middle } else { high = middle }
    }
    high
}

/// Returns the probability of at most this number of failures, for a p above their share.
fn at_most(failures: u64, trials: u64, p: f64) -> f64 {
    let (x, n) = (failures as f64, trials as f64);
    let choices = libm::lgamma(n + 1.0) - libm::lgamma(x + 1.0) - libm::lgamma(n - x + 1.0);
    let mut term = libm::exp(choices + x * libm::log(p) + (n - x) * libm::log1p(-p));
    let mut sum = term;
    // Starts with the largest term.
    for k in (1..=failures).rev() {
        term *= k as f64 * (1.0 - p) / ((trials - k + 1) as f64 * p);
        sum += term;
        if term <= 1e-18 * sum {
            break;
        }
    }
    sum
}

/// Returns a histogram of sorted values with equal bins: left edges, counts, width. `None` if all values are equal.
pub fn histogram(sorted: &[f64], bins: usize) -> Option<(Vec<(f64, usize)>, f64)> {
    let finite: Vec<f64> = sorted.iter().copied().filter(|value| value.is_finite()).collect();
    let (low, high) = (*finite.first()?, *finite.last()?);
    let width = (high - low) / bins as f64;
    if !(width > 0.0 && width.is_finite()) {
        return None;
    }
    let mut counts: Vec<(f64, usize)> = (0..bins).map(|k| (low + width * k as f64, 0)).collect();
    for value in finite {
        let bin = ((value - low) / width) as usize;
        counts[bin.min(bins - 1)].1 += 1;
    }
    Some((counts, width))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_the_nearest_ranks_and_what_is_no_number_is_the_worst() {
        let mut values: Vec<f64> = (1..=1000).rev().map(f64::from).collect();
        sort(&mut values);
        assert_eq!(PER_MILLE.map(|p| percentile(&values, p)), [10.0, 50.0, 500.0, 950.0, 990.0, 999.0, 1000.0]);
        let mut few = [3.0, -f64::NAN, 1.0, f64::INFINITY];
        sort(&mut few);
        assert_eq!([250, 500, 750].map(|p| percentile(&few, p)), [1.0, 3.0, f64::INFINITY]);
        assert!(percentile(&few, 1000).is_nan() && percentile(&[], 500).is_nan());
    }

    #[test]
    fn the_bound_is_that_of_the_beta_distribution() {
        // SciPy 1.17.1, `beta.ppf(0.95, failures + 1, trials - failures)`.
        let cases = [
            (1, 1000, 0.004_734_993_575_499_777),
            (10, 10_000, 0.001_695_631_453_645_378),
            (500, 1000, 0.526_482_268_764_308_7),
            (999, 1000, 0.999_948_708_021_091),
            (37, 1_000_000, 4.867_520_103_319_077_6e-5),
        ];
        for (failures, trials, expected) in cases {
            let found = largest_rate(failures, trials, 0.95);
            // The logarithms of factorials are about 1e7, with 16 digits.
            assert!((found / expected - 1.0).abs() < 1e-8, "{failures} of {trials}: {found}");
        }
        // Zero failures: the n-th root.
        assert!((largest_rate(0, 1000, 0.95) / (1.0 - 0.05_f64.powf(1e-3)) - 1.0).abs() < 1e-10);
        assert_eq!(largest_rate(7, 7, 0.95), 1.0);
    }

    #[test]
    fn a_histogram_counts_every_number_once() {
        let mut values: Vec<f64> = (0..1000).map(|k| f64::from(k) / 999.0).chain([f64::NAN]).collect();
        sort(&mut values);
        let (bins, width) = histogram(&values, 10).expect("bins");
        assert!(bins.iter().all(|(_, count)| *count == 100), "{bins:?}");
        assert!((width - 0.1).abs() < 1e-12);
        assert_eq!(histogram(&[2.0; 5], 10), None);
    }
}
