//! Nonlinear least squares for a few parameters, with confidence.
//!
//! $$ \min_p \Vert r(p) \Vert^2, \qquad (J^T J + \mu \thinspace \mathrm{diag} J^T J) \thinspace s = J^T r $$
//!
//! Gauss-Newton with Levenberg damping. J is computed from differences of 1e-5 in the scales of the parameters, and all
//! computations use these scales. A fit of 4600 residuals in 6 parameters takes about 30 runs of the model, a few
//! milliseconds each.
//!
//! The covariance is the sandwich estimate with the Bartlett window over L lags, because residuals of a recorded motion
//! are correlated:
//!
//! $$ C = (J^T J)^{-1} \left( \sum_{|l| \le L} \left(1 - \frac{|l|}{L + 1}\right) \sum_k J_k r_k r_{k+l} J_{k+l}^T
//!    \right) (J^T J)^{-1} $$

use nalgebra::{DMatrix, DVector};

/// Largest number of Gauss-Newton iterations; valid recordings need 2 to 5.
const MOST_STEPS: usize = 25;
/// Damping above which no step reduces the sum.
const STIFFEST: f64 = 1e8;
/// Difference for the Jacobian, in scales.
const STEP: f64 = 1e-5;

/// Result of a fit.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    /// Parameters.
    pub(super) values: Vec<f64>,
    /// Residuals r.
    pub(super) residuals: DVector<f64>,
    /// Jacobian J, times the scales.
    jacobian: DMatrix<f64>,
    scale: Vec<f64>,
    /// Number of Gauss-Newton iterations.
    pub(super) steps: usize,
}

/// Returns residuals and Jacobian, in scales; `None` if a residual is not a number.
fn around(
    model: &impl Fn(&[f64]) -> Vec<f64>,
    values: &[f64],
    scale: &[f64],
) -> Option<(DVector<f64>, DMatrix<f64>, f64)> {
    let at = DVector::from_vec(model(values));
    let columns: Vec<DVector<f64>> = (0..values.len())
        .map(|j| {
            let mut moved = values.to_vec();
            moved[j] += STEP * scale[j];
            (DVector::from_vec(model(&moved)) - &at) / STEP
        })
        .collect();
    let sum = at.norm_squared();
    let jacobian = DMatrix::from_columns(&columns);
    (sum.is_finite() && jacobian.iter().all(|entry| entry.is_finite())).then_some((at, jacobian, sum))
}

impl Fit {
    /// Fits from a start with the typical size of each parameter; `None` if the model is not finite there.
    pub(super) fn of(model: impl Fn(&[f64]) -> Vec<f64>, start: &[f64], scale: &[f64]) -> Option<Self> {
        let mut values = start.to_vec();
        let (mut residuals, mut jacobian, mut sum) = around(&model, &values, scale)?;
        let (mut damping, mut steps) = (1e-3, 0);
        while steps < MOST_STEPS {
            let (normal, gradient) = (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&residuals));
            let next = loop {
                let mut damped = normal.clone();
                for j in 0..values.len() {
                    damped[(j, j)] += damping * (normal[(j, j)] + 1e-30);
                }
                let step = damped.cholesky().map(|factors| factors.solve(&gradient));
                let better = step.and_then(|step| {
                    let moved: Vec<f64> = (0..values.len()).map(|j| values[j] - step[j] * scale[j]).collect();
                    let found = around(&model, &moved, scale).filter(|found| found.2 <= sum * (1.0 + 1e-12));
                    found.map(|found| (step.amax(), moved, found))
                });
                if better.is_some() || damping > STIFFEST {
                    break better;
                }
                damping *= 10.0;
            };
            let Some((moved_by, moved, found)) = next else { break };
            steps += 1;
            let is_done = moved_by < 1e-6 || sum - found.2 < 1e-10 * sum;
            (values, (residuals, jacobian, sum), damping) = (moved, found, (damping / 10.0).max(1e-12));
            if is_done {
                break;
            }
        }
        Some(Self { values, residuals, jacobian, scale: scale.to_vec(), steps })
    }

    /// Returns the rms of the residuals.
    pub(super) fn rms(&self) -> f64 {
        self.residuals.norm() / libm::sqrt(self.residuals.len() as f64)
    }

    /// Returns the condition number of the Jacobian with normalised columns: the similarity of two parameters in this
    /// recording. It is infinite if a parameter has no effect.
    pub(super) fn condition(&self) -> f64 {
        let mut unit = self.jacobian.clone();
        for mut column in unit.column_iter_mut() {
            let norm = column.norm();
            if norm == 0.0 {
                return f64::INFINITY;
            }
            column /= norm;
        }
        let found = unit.tr_mul(&unit).symmetric_eigenvalues();
        let least = found.min();
        if least > 0.0 { libm::sqrt(found.max() / least) } else { f64::INFINITY }
    }

    /// Returns one standard deviation of each parameter, by the sandwich estimate over this number of lags.
    pub(super) fn deviations(&self, lags: usize) -> Vec<f64> {
        let n = self.values.len();
        let Some(inverse) = self.jacobian.tr_mul(&self.jacobian).try_inverse() else { return vec![f64::INFINITY; n] };
        let mut scores = self.jacobian.clone();
        for mut column in scores.column_iter_mut() {
            column.component_mul_assign(&self.residuals);
        }
        let mut sum = scores.tr_mul(&scores);
        let rows = scores.nrows();
        for lag in 1..=lags.min(rows.saturating_sub(1)) {
            let weight = 1.0 - lag as f64 / (lags as f64 + 1.0);
            let crossed = scores.rows(lag, rows - lag).tr_mul(&scores.rows(0, rows - lag));
            sum += (&crossed + crossed.transpose()) * weight;
        }
        let covariance = &inverse * sum * &inverse;
        (0..n).map(|j| libm::sqrt(covariance[(j, j)].max(0.0)) * self.scale[j]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use loop_sim::random::Random;

    /// Fits a decay a e^(-bt) + c from a distant start.
    #[test]
    fn a_decay_is_found_and_the_steps_are_few() {
        let times: Vec<f64> = (0..200).map(|k| 0.02 * f64::from(k)).collect();
        let decay = |p: &[f64], t: f64| p[0] * (-p[1] * t).exp() + p[2];
        let truth = [2.0, 1.5, -0.3];
        let model = |p: &[f64]| times.iter().map(|&t| decay(p, t) - decay(&truth, t)).collect();
        let fit = Fit::of(model, &[1.0, 0.5, 0.0], &[1.0; 3]).expect("numbers");
        assert!(fit.steps <= 8 && fit.rms() < 1e-9, "{} steps, {:e}", fit.steps, fit.rms());
        for (found, expected) in fit.values.iter().zip(truth) {
            assert!((found - expected).abs() < 1e-8, "{:?}", fit.values);
        }
        assert!(Fit::of(|_: &[f64]| vec![f64::NAN; 5], &[1.0], &[1.0]).is_none());
    }

    /// Mean of numbers with a moving average over 20. The standard deviation belongs to the slow part: 20 times the
    /// white variance, with the scatter of the sandwich estimate.
    #[test]
    fn the_sandwich_knows_that_coloured_residuals_say_less() {
        let (mut inside, runs) = (0, 400);
        for run in 0..runs {
            let mut random = Random::new(7, run);
            let white: Vec<f64> = (0..1019).map(|_| random.uniform() - 0.5).collect();
            let coloured: Vec<f64> = white.windows(20).map(|window| window.iter().sum()).collect();
            let fit =
                Fit::of(|p: &[f64]| coloured.iter().map(|y| y - p[0]).collect(), &[0.3], &[1.0]).expect("numbers");
            let deviation = fit.deviations(60)[0];
            inside += usize::from(fit.values[0].abs() < 2.0 * deviation);
            let as_white = fit.deviations(0)[0];
            assert!(deviation > 2.0 * as_white, "{deviation} {as_white}");
        }
        // 95 % for a normal mean; the window slightly reduces the variance.
        assert!((0.88..0.98).contains(&(inside as f64 / runs as f64)), "{inside} of {runs}");
    }

    #[test]
    fn what_is_not_seen_has_no_condition() {
        let fit = Fit::of(|p: &[f64]| vec![p[0] - 1.0, p[0] - 2.0, 0.5], &[0.0, 0.0], &[1.0; 2]).expect("numbers");
        assert_eq!(fit.condition(), f64::INFINITY);
        let fit = Fit::of(|p: &[f64]| vec![p[0] - 1.0, p[1] - 2.0], &[0.0, 0.0], &[1.0; 2]).expect("numbers");
        assert!((fit.condition() - 1.0).abs() < 1e-9);
    }
}
