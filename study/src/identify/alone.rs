//! Identification of the link from the motor alone, by the reaction torque of the spring while the motor moves.
//!
//! $$ u = \frac{1}{B_0} \ddot q_m - \frac{k_2}{B_0} (q - q_m) + \frac{b_2}{B_0} \dot q_m + F,
//!    \qquad \ddot q = k_1 (q_m - q) - b_1 \dot q - g \sin q $$
//!
//! q is not measured, but its equation has the measured input q_m. It is integrated for each k_1, b_1 and initial
//! state; the other parameters are linear. The residual of u from least squares is minimised over these four numbers,
//! from the best of several k_1 within the tolerance. Both sides are convolved with a modulating function of ±20 ms,
//! which avoids differentiating a count. Everything slower than a second is subtracted, including load and offset.
//!
//! k_1 is determined by the *anti-resonance* at $\sqrt{k_1 + g}$, at which the link swings with the motor held. Weight
//! looks like stiffness there and comes from the data sheet. The moves must excite the link around that frequency. A
//! multisine around the resonance does not, because the link stands still there.

use nalgebra::{DMatrix, DVector};

use super::fit::Fit;
use super::link::{modulating, simulated};
use super::motor::shapes;

/// Half width of the modulating function, s.
const HALF_S: f64 = 0.02;
/// Time between equations, s.
const EVERY_S: f64 = 3e-3;
/// Number of start stiffnesses.
const STARTS: u32 = 9;
/// Correlation time of the residuals, s.
const ALIKE_S: f64 = 0.3;

/// Returns the ticks between equations.
fn every(period_s: f64) -> usize {
    (EVERY_S / period_s).round().max(1.0) as usize
}

/// Recording without the link count, prepared for any k_1.
pub(super) struct Alone {
    /// Angle of the motor at every half tick, rad.
    halves: Vec<f64>,
    motor: Vec<f64>,
    period_s: f64,
    kernel: Vec<f64>,
    /// Weights of the subtracted mean, in equations.
    window: Vec<f64>,
    /// Current, and the regressors without the spring.
    current: DVector<f64>,
    columns: Vec<DVector<f64>>,
    weight: f64,
}

/// Link as identified from the motor alone.
pub(super) struct Seen {
    /// Fit of k_1, b_1, q(0), q'(0).
    pub(super) fit: Fit,
    /// Rms of the current that the fit explains, A.
    pub(super) current_a: f64,
    /// Link angle in each tick, rad.
    pub(super) link: Vec<f64>,
    /// Standard deviations of k_1 and b_1.
    pub(super) deviations: Vec<f64>,
}

impl Alone {
    /// Prepares a recording from the motor angle, the mean current of each tick, and g of the data sheet. The mean over
    /// `slow_s` to each side is subtracted. Returns `None` if the recording is too short.
    pub(super) fn of(
        motor: &[f64],
        current: &[f64],
        period_s: f64,
        cogging: Option<f64>,
        weight: f64,
        slow_s: f64,
    ) -> Option<Self> {
        let [p0, p1, p2] = modulating(period_s, HALF_S);
        let every = every(period_s);
        let half = (slow_s / (every as f64 * period_s)).round().max(1.0) as usize;
        if motor.len() < p0.len() + 4 * every * half {
            return None;
        }
        let bell = |j: usize| 1.0 - libm::cos(std::f64::consts::PI * (j as f64 + 1.0) / (half as f64 + 1.0));
        let window: Vec<f64> = (0..=2 * half).map(bell).collect();
        let sum: f64 = window.iter().sum();
        let window = window.into_iter().map(|weight| weight / sum).collect();
        let n = motor.len();
        let mut halves = Vec::with_capacity(2 * n);
        for k in 0..n - 1 {
            let middle = if k == 0 || k + 2 == n {
                0.5 * (motor[k] + motor[k + 1])
            } else {
                (9.0 * (motor[k] + motor[k + 1]) - motor[k - 1] - motor[k + 2]) / 16.0
            };
            halves.extend([motor[k], middle]);
        }
        halves.push(motor[n - 1]);
        let mut alone = Self {
            halves,
            motor: motor.to_vec(),
            period_s,
            kernel: p0,
            window,
            current: DVector::zeros(0),
            columns: Vec::new(),
            weight,
        };
        // A current that is held between ticks has at a tick the mean of the values before and after it.
        let at_ticks = |held: &[f64]| -> Vec<f64> {
            let of = |k: usize| if k == 0 { held[0] } else { 0.5 * (held[k - 1] + held[k.min(held.len() - 1)]) };
            (0..n).map(of).collect()
        };
        alone.current = alone.seen(&alone.kernel, &at_ticks(current));
        let mut columns = vec![alone.seen(&p2, motor), alone.seen(&p1, motor)];
        for shape in shapes(motor, period_s, cogging) {
            columns.push(-alone.seen(&alone.kernel, &at_ticks(&shape)));
        }
        alone.columns = columns;
        Some(alone)
    }

    /// Convolves a signal with a kernel and removes slow parts.
    fn seen(&self, kernel: &[f64], signal: &[f64]) -> DVector<f64> {
        let smooth: Vec<f64> = signal
            .windows(kernel.len())
            .step_by(every(self.period_s))
            .map(|part| part.iter().zip(kernel.iter().rev()).map(|(value, weight)| value * weight).sum())
            .collect();
        let half = self.window.len() / 2;
        let fast = smooth
            .windows(self.window.len())
            .map(|part| part[half] - part.iter().zip(&self.window).map(|(value, weight)| value * weight).sum::<f64>());
        DVector::from_vec(fast.collect())
    }

    /// Returns the link angle in each tick for k_1, b_1, q(0), q'(0).
    fn link(&self, &[k, b, q, v]: &[f64; 4]) -> Vec<f64> {
        simulated(&[k, b, self.weight, 0.0, q, v, 0.0], &self.halves, 0.5 * self.period_s)
    }

    /// Returns the residual of the current with this link, A.
    fn left(&self, p: &[f64]) -> Vec<f64> {
        let &[k, b, q, v] = p else { return Vec::new() };
        let twist: Vec<f64> = self.link(&[k, b, q, v]).iter().zip(&self.motor).map(|(q, motor)| motor - q).collect();
        let mut columns = self.columns.clone();
        columns.push(self.seen(&self.kernel, &twist));
        for column in &mut columns {
            let norm = column.norm();
            *column /= norm.max(1e-300);
        }
        let a = DMatrix::from_columns(&columns);
        let solved = a.tr_mul(&a).cholesky().map(|factors| factors.solve(&a.tr_mul(&self.current)));
        solved.map_or_else(|| vec![f64::NAN; self.current.len()], |x| (a * x - &self.current).as_slice().to_vec())
    }

    /// Fits the link from start values of k_1 within this share and b_1 of the data sheet.
    pub(super) fn fit(&self, [k_1, b_1]: [f64; 2], tolerance: f64) -> Option<Seen> {
        let b_1 = b_1.max(0.05);
        let tried =
            (0..STARTS).map(|i| k_1 * (1.0 + tolerance * 0.95 * (2.0 * f64::from(i) / f64::from(STARTS - 1) - 1.0)));
        let size = |k: f64| self.left(&[k, b_1, self.motor[0], 0.0]).iter().map(|left| left * left).sum::<f64>();
        let sized = tried.filter(|k| *k > 0.0).map(|k| (size(k), k)).filter(|(size, _)| size.is_finite());
        let (_, from) = sized.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let fit =
            Fit::of(|p: &[f64]| self.left(p), &[from, b_1, self.motor[0], 0.0], &[from, b_1.max(0.3), 0.01, 0.1])?;
        let &[k, b, q, v] = fit.values.as_slice() else { return None };
        let deviations = fit.deviations((ALIKE_S / (every(self.period_s) as f64 * self.period_s)).round() as usize);
        let current_a = self.current.norm() / libm::sqrt(self.current.len() as f64);
        Some(Seen { link: self.link(&[k, b, q, v]), fit, current_a, deviations })
    }
}
