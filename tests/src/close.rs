//! Comparison of two signals: the largest difference relative to the largest value.

/// Largest |a - b| and largest |b| of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gap {
    /// max |a - b|.
    pub difference: f64,
    /// max |b|.
    pub scale: f64,
}

impl Gap {
    /// Adds one pair; `expected` sets the scale. A NaN on either side makes the gap infinite.
    pub fn add(&mut self, actual: f64, expected: f64) {
        let difference = (actual - expected).abs();
        self.difference = if difference.is_nan() { f64::INFINITY } else { self.difference.max(difference) };
        self.scale = self.scale.max(expected.abs());
    }

    /// Returns max |a - b| / max |b|.
    pub fn relative(&self) -> f64 {
        if self.difference == 0.0 { 0.0 } else { self.difference / self.scale }
    }
}

/// Returns |actual/expected - 1|.
pub fn relative(actual: f64, expected: f64) -> f64 {
    ((actual - expected) / expected).abs()
}

/// Returns the order of convergence from the errors at two periods; the second period is `ratio` times shorter.
pub fn order(error: f64, error_of_shorter: f64, ratio: f64) -> f64 {
    (error / error_of_shorter).ln() / ratio.ln()
}

/// Returns the value below which the given share of the list lies.
///
/// # Panics
/// On an empty list.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() as f64 * share).ceil() as usize).clamp(1, sorted.len()) - 1]
}
