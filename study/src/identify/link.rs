//! Identification of the link equation. Its input is the measured motor angle, so current, friction and ripple of the
//! motor have no effect.
//!
//! $$ \ddot q = k_1 (q_m - q) - b_1 \dot q - g \sin q + c $$
//!
//! c contains a constant load and the offset between the encoders. A damped spring adds $d_1 (\dot q_m - \dot q)$. The
//! state $w = \dot q - d_1 q_m$ avoids differentiating a count:
//! $\dot w = k_1 (q_m - q) - (b_1 + d_1) \dot q - g \sin q + c$.
//!
//! 1. *Start* ([`start`]): modulating functions. Let $p(s) = (1 - s^2)^4$ on ±0.1 s, or ±10 radians of the resonance.
//!    $P_i$ is the convolution of the counts with its i-th derivative; integration by parts avoids differentiating a
//!    count. $P_2 q = k_1 P_0 (q_m - q) - b_1 P_1 q - g P_0 \sin q + c P_0 1$ is linear and needs no initial guess. It
//!    is accurate within 1e-4 at 20 bits.
//! 2. *Output error* ([`fit`]): the equation is integrated over the whole recording from unknown q(0) and q'(0). The
//!    Runge-Kutta step of order 4 covers two ticks, with a sample of the motor angle in the middle. The residual is the
//!    rounding of the encoder, 0.289 counts rms, unless the joint has another equation.
//! 3. *Prediction error*: used if rounding of the motor count moves the link by more than its own rounding
//!    ([`noise_share`]). A stiff spring with little damping responds to rounding for a long time. So each count
//!    corrects the state with stationary Kalman gains ([`Correction`]) for both roundings.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use super::fit::Fit;

/// Largest half width of the modulating function, s, and in radians of the data sheet resonance. A wider function
/// averages out the effect of a stiff spring.
const WIDEST_S: f64 = 0.1;
const HALF_RAD: f64 = 10.0;
/// Ticks between equations of the start.
const EVERY: usize = 5;
/// Ticks between samples of the fit: one integration step with a sample in its middle.
pub(super) const STRIDE: usize = 2;
/// Correlation time of the residuals, s.
const ALIKE_S: f64 = 0.2;

/// Largest number of Riccati steps for the filter gains.
const MOST_RICCATI: usize = 10_000;

/// Parameters k_1, b_1, g, c.
pub(super) type Link = [f64; 4];

/// Returns p, p', p'' for this half width in seconds, normalised to a sum of 1 in p.
pub(super) fn modulating(period_s: f64, half_s: f64) -> [Vec<f64>; 3] {
    let m = (half_s / period_s).round().max(3.0) as i32;
    let half_s = f64::from(m) * period_s;
    let mut rows = [const { Vec::new() }; 3];
    for j in -m..=m {
        let s = f64::from(j) / f64::from(m);
        let a = 1.0 - s * s;
        rows[0].push(a.powi(4));
        rows[1].push(-8.0 * s * a.powi(3) / half_s);
        rows[2].push((-8.0 * a.powi(3) + 48.0 * s * s * a * a) / (half_s * half_s));
    }
    let sum: f64 = rows[0].iter().sum();
    rows.map(|row| row.into_iter().map(|value| value / sum).collect())
}

/// Returns the convolution at every few samples where the kernel lies within the signal.
fn convolved(kernel: &[f64], signal: impl Fn(usize) -> f64, length: usize) -> Vec<f64> {
    let width = kernel.len();
    (0..(length + 1).saturating_sub(width))
        .step_by(EVERY)
        .map(|at| kernel.iter().rev().enumerate().map(|(j, weight)| weight * signal(at + j)).sum())
        .collect()
}

/// Fits a start by linear least squares from the recording and the approximate resonance. Returns `None` if the
/// recording is too short or the equations are singular.
pub(super) fn start(q: &[f64], motor: &[f64], period_s: f64, resonance_rad_s: f64) -> Option<Link> {
    let [p0, p1, p2] = modulating(period_s, WIDEST_S.min(HALF_RAD / resonance_rad_s));
    let n = q.len();
    let y = convolved(&p2, |k| q[k], n);
    let columns = [
        convolved(&p0, |k| motor[k] - q[k], n),
        convolved(&p1, |k| -q[k], n),
        convolved(&p0, |k| -libm::sin(q[k]), n),
        convolved(&p0, |_| 1.0, n),
    ];
    if y.len() < 8 {
        return None;
    }
    let a = DMatrix::from_columns(&columns.map(DVector::from_vec));
    let found = a.svd(true, true).solve(&DVector::from_vec(y), 1e-12).ok()?;
    let link = [found[0], found[1], found[2], found[3]];
    link.iter().all(|value| value.is_finite()).then_some(link)
}

/// Correction of the predicted link state by a count.
#[derive(Clone, Copy, Debug)]
pub(super) struct Correction {
    /// Gains on q and w.
    gains: [f64; 2],
    /// Ratio of the innovation to rounding alone, standard deviations.
    pub(super) spread: f64,
}

impl Correction {
    pub(super) const NONE: Self = Self { gains: [0.0; 2], spread: 1.0 };

    /// Returns the stationary Kalman gains for a spring with k_1 and b_1 and these rounding steps. Returns no
    /// correction if, over this time, rounding of the motor count moves the link less than its own rounding.
    pub(super) fn of(k_1: f64, b_1: f64, [link, motor]: [f64; 2], period_s: f64, seconds: f64) -> Self {
        let ratio = motor / link;
        if noise_share([k_1, b_1, 0.0], period_s, seconds) * ratio < 1.0 {
            return Self::NONE;
        }
        let h = period_s * STRIDE as f64;
        // q' = v, v' = -k q - b v over one step of the fit.
        let (w, left) = (libm::sqrt(k_1), libm::exp(-0.5 * b_1 * h));
        let [c, s] = [libm::cos(w * h), libm::sin(w * h)];
        let phi = Matrix2::new(c, s / w, -w * s, c) * left;
        // Rounding of two motor samples drives the link; variances relative to the rounding of the link.
        let pushed = Vector2::new(0.5 * h, 1.0) * (k_1 * period_s * libm::sqrt(STRIDE as f64) * ratio);
        let noise = pushed * pushed.transpose();
        let (mut p, mut gains) = (noise, Vector2::zeros());
        for _ in 0..MOST_RICCATI {
            let next = p.column(0) / (p[(0, 0)] + 1.0);
            let corrected = p - next * p.row(0);
            p = phi * corrected * phi.transpose() + noise;
            let is_still = (next - gains).abs().max() <= 1e-12 * next.abs().max();
            gains = next;
            if is_still {
                break;
            }
        }
        Self { gains: [gains[0], gains[1]], spread: libm::sqrt(p[(0, 0)] + 1.0) }
    }
}

/// Returns the link angle at every second of the motor angles, which are `period_s` apart. p = k_1, b_1, g, c, q(0),
/// w(0), d_1.
pub(super) fn simulated(p: &[f64; 7], motor: &[f64], period_s: f64) -> Vec<f64> {
    predicted(p, motor, &[], Correction::NONE, period_s)
}

/// Returns the link angle with each angle corrected by its count, or uncorrected without counts.
fn predicted(p: &[f64; 7], motor: &[f64], counted: &[f64], by: Correction, period_s: f64) -> Vec<f64> {
    let [k, b, g, c, mut x, mut w, d] = *p;
    let h = period_s * STRIDE as f64;
    // q' and w' at an angle of the motor.
    let rates = |motor: f64, x: f64, w: f64| {
        let v = w + d * motor;
        (v, k * (motor - x) - (b + d) * v - g * libm::sin(x) + c)
    };
    let mut out = vec![x];
    for (k, motor) in motor.windows(STRIDE + 1).step_by(STRIDE).enumerate() {
        let &[begin, middle, end] = motor else { break };
        if let Some(counted) = counted.get(k) {
            let innovation = counted - x;
            (x, w) = (x + by.gains[0] * innovation, w + by.gains[1] * innovation);
        }
        let (v1, a1) = rates(begin, x, w);
        let (v2, a2) = rates(middle, x + 0.5 * h * v1, w + 0.5 * h * a1);
        let (v3, a3) = rates(middle, x + 0.5 * h * v2, w + 0.5 * h * a2);
        let (v4, a4) = rates(end, x + h * v3, w + h * a3);
        x += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
        w += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        out.push(x);
    }
    out
}

/// Returns every second sample.
pub(super) fn thinned(signal: &[f64]) -> Vec<f64> {
    signal.iter().step_by(STRIDE).copied().collect()
}

/// Fits by output or prediction error from a near start: k_1, b_1, g, c, q(0), w(0), and d_1 of a damped spring.
pub(super) fn fit(
    q: &[f64],
    motor: &[f64],
    period_s: f64,
    from: &Link,
    by: Correction,
    is_damped: bool,
) -> Option<Fit> {
    let [twist, pull] = centre(q, motor);
    let q = thinned(q);
    let [k, b, g, c] = *from;
    let scale = [k.abs(), b.max(0.3), 1.0, 1.0, 0.01, 0.1, 0.3];
    let start = [k, b.max(0.05), g, c + k * twist - g * pull, q[0], 0.0, 0.0];
    let residuals = |p: &[f64]| {
        let mut p: [f64; 7] = std::array::from_fn(|i| p.get(i).copied().unwrap_or(0.0));
        p[3] -= p[0] * twist - p[2] * pull;
        let link = predicted(&p, motor, &q, by, period_s);
        link.iter().zip(&q).map(|(model, q)| model - q).collect()
    };
    let count = if is_damped { 7 } else { 6 };
    let mut fit = Fit::of(residuals, &start[..count], &scale[..count])?;
    fit.values[3] -= fit.values[0] * twist - fit.values[2] * pull;
    Some(fit)
}

/// Returns the means of q_m - q and sin q, the reference of c in the fit. Otherwise a constant twist between the
/// encoders, or a constant weight torque, would be correlated with c.
pub(super) fn centre(q: &[f64], motor: &[f64]) -> [f64; 2] {
    let mean = |sum: f64| sum / q.len().max(1) as f64;
    [mean(q.iter().zip(motor).map(|(q, motor)| motor - q).sum()), mean(q.iter().map(|q| libm::sin(*q)).sum())]
}

/// Returns the residual of a recording with these link parameters, rms in rad. Load, encoder offset, q(0) and w(0) are
/// fitted.
pub(super) fn left_over(q: &[f64], motor: &[f64], period_s: f64, of: &Link, by: Correction, d: f64) -> Option<f64> {
    let q = thinned(q);
    let [k, b, g, c] = *of;
    let residuals = |p: &[f64]| {
        let link = predicted(&[k, b, g, p[0], p[1], p[2], d], motor, &q, by, period_s);
        link.iter().zip(&q).map(|(model, q)| model - q).collect()
    };
    Fit::of(residuals, &[c, q[0], -d * motor[0]], &[1.0, 0.01, 0.1]).map(|fit| fit.rms())
}

/// Returns the ratio of link noise to white noise of the motor angle over this time, for the spring alone.
pub(super) fn noise_share([k, b, ..]: [f64; 3], period_s: f64, seconds: f64) -> f64 {
    libm::sqrt(0.5 * period_s * k.abs() / b.max(1.0 / seconds))
}

/// Returns the largest relative errors of k_1 and b_1 from integration in steps of h: frequency and damping of a spring
/// of $\theta = h \sqrt{k_1}$ under Runge-Kutta.
pub(super) fn integrated(k_1: f64, period_s: f64) -> [f64; 2] {
    let h = period_s * STRIDE as f64;
    let squared = k_1 * h * h;
    [k_1 * squared * squared / 60.0, squared * squared * squared / (72.0 * h)]
}

/// Returns the lags over which the residuals are correlated.
pub(super) fn lags(period_s: f64) -> usize {
    (ALIKE_S / (period_s * STRIDE as f64)).round() as usize
}
