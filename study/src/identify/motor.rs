//! Identification of the motor equation. Its inputs are the current and the measured link angle.
//!
//! $$ \ddot q_m = k_2 (q - q_m) - b_2 \dot q_m + B_0 (u - F) + d, \qquad
//!    F = f_c \thinspace s(\dot q_m) - a \sin N q_m - b \cos N q_m $$
//!
//! d is any slowly varying torque: load, offsets, a disturbance. A motor with a rigid load has $k_2 = 0$.
//!
//! The *prediction error* is minimised over (k_2, b_2, B_0, f_c, a, b). It is the innovation of an observer of (p, v,
//! d, d') on the motor count with Bessel poles at ω. The observer treats everything slower than ω as a disturbance, so
//! only faster motion counts. Quantisation limits the accuracy above ω. The search starts at the data sheet; no wrong
//! minimum was met from ±50 %.
//!
//! s is the mean over the tick of tanh(q_m'/0.02 rad/s), with the speed from a cubic through seven counts.

use std::f64::consts::TAU;

use controller_core::drive::bessel_poles;
use nalgebra::{Matrix4, RowVector4, Vector4};

use super::fit::Fit;
use crate::commission::highest_hz;
use crate::compare::matrix::{Matrix, exp};

/// Ratio of ω to the resonance of the joint with a free link, and smallest ω, rad/s.
const OVER_RESONANCE: f64 = 1.2;
const LEAST_RAD_S: f64 = 120.0;
/// Speed scale of the friction model, rad/s.
const SMOOTH_RAD_S: f64 = 0.02;
/// Start-up transient of the observer that is discarded, s.
const SKIP_S: f64 = 0.15;
/// Correlation time of the innovations, s.
const ALIKE_S: f64 = 0.06;

/// Savitzky-Golay slope of a cubic over 7 points; weights of the points after the middle.
const SLOPE: [f64; 3] = [58.0 / 252.0, 67.0 / 252.0, -22.0 / 252.0];
/// Number of instants per tick at which friction is averaged.
const POINTS: u32 = 10;

/// Recorded signals and their properties.
pub(super) struct Recorded<'a> {
    /// Damping of the spring over its stiffness, s.
    pub(super) damped: f64,
    /// Angle of the link, rad; `None` for a rigid load.
    pub(super) link: Option<&'a [f64]>,
    /// Angle of the motor, rad.
    pub(super) motor: &'a [f64],
    /// Held current in each tick, A, and the lag of the current loop, s.
    pub(super) held: &'a [f64],
    pub(super) lag_s: f64,
    /// Sampling period, s.
    pub(super) period_s: f64,
    /// Cogging periods N per turn; `None` if unknown.
    pub(super) cogging_per_turn: Option<f64>,
}

/// Returns the mean current behind a lag for each tick, starting at rest.
pub(super) fn behind_lag(held: &[f64], period_s: f64, lag_s: f64) -> Vec<f64> {
    if lag_s <= 0.0 {
        return held.to_vec();
    }
    let left = libm::exp(-period_s / lag_s);
    let share = lag_s / period_s * (1.0 - left);
    let mut current = held.first().copied().unwrap_or(0.0);
    let mean = |&u: &f64| {
        let begin = current;
        current = u + (begin - u) * left;
        u + (begin - u) * share
    };
    held.iter().map(mean).collect()
}

/// Returns ω for a joint with this k_2, or for a rigid load with 0. It lies below the middle of the excitation, unless
/// the period allows the excitation to reach the resonance.
fn bandwidth_rad_s(stiffness: f64, period_s: f64) -> f64 {
    let played = TAU * highest_hz(period_s);
    (OVER_RESONANCE * libm::sqrt(stiffness.max(0.0)).min(played)).max(LEAST_RAD_S)
}

/// Returns the factor that widens k_2, b_2 and B_0 of a joint. If the excitation stays far below the resonance, these
/// parameters have similar effects and rounding dominates.
pub(super) fn vaguer(stiffness: f64, period_s: f64) -> f64 {
    (libm::sqrt(stiffness.max(0.0)) / (TAU * highest_hz(period_s))).max(1.0)
}

/// Exact discretisation of one tick.
struct Tick {
    /// Transition matrix Φ of (p, v, d, d').
    phi: Matrix4<f64>,
    /// Observer gains on the innovation.
    gains: Vector4<f64>,
    /// Effect of a constant acceleration; of the acceleration by the current, for the held value and for the value at
    /// the start; and of the acceleration by the link angle, its slope and its bend in a tick.
    stays: Vector4<f64>,
    held: Vector4<f64>,
    current: Vector4<f64>,
    link: [Vector4<f64>; 3],
    /// Share of the initial current that remains at the end of the tick.
    keeps: f64,
}

impl Tick {
    fn of(k2: f64, b2: f64, [period_s, lag_s]: [f64; 2], omega: f64) -> Option<Self> {
        // State: (p, v, d, d'), the current and its held value, the link angle over a tick as l_0 + l_1 s + l_2 s².
        const CURRENT: usize = 4;
        const HELD: usize = 5;
        const LINK: usize = 6;
        let mut a = Matrix::zeros(9, 9);
        (a[(0, 1)], a[(1, 2)], a[(2, 3)]) = (1.0, 1.0, 1.0);
        (a[(1, 0)], a[(1, 1)]) = (-k2, -b2);
        if lag_s > 0.0 {
            a[(1, CURRENT)] = 1.0;
            (a[(CURRENT, CURRENT)], a[(CURRENT, HELD)]) = (-1.0 / lag_s, 1.0 / lag_s);
        } else {
            a[(1, HELD)] = 1.0;
        }
        a[(1, LINK)] = 1.0;
        (a[(LINK, LINK + 1)], a[(LINK + 1, LINK + 2)]) = (1.0 / period_s, 2.0 / period_s);
        let whole = exp(&(a * period_s));
        let column = |j: usize| Vector4::from_fn(|i, _| whole[(i, j)]);
        let phi = Matrix4::from_columns(&[column(0), column(1), column(2), column(3)]);
        // In units of a tick the matrix is well scaled.
        let t = period_s;
        let units = Vector4::new(1.0, t, t * t, t * t * t);
        let scaled = Matrix4::from_fn(|i, j| units[i] * phi[(i, j)] / units[j]);
        let (mut polynomial, one) = (Matrix4::identity(), Matrix4::identity());
        for pole in bessel_poles(4) {
            let size = libm::exp(pole.re * omega * t);
            let [twice, squared] = [2.0 * size * libm::cos(pole.im * omega * t), size * size];
            polynomial *= scaled * scaled - scaled * twice + one * squared;
        }
        let mut rows = [RowVector4::zeros(); 4];
        rows[0] = scaled.row(0).into();
        for i in 1..4 {
            rows[i] = rows[i - 1] * scaled;
        }
        // The correction precedes the next prediction: p(Φ) (h Φ; ..)^-1 e_4.
        let gains = polynomial * Matrix4::from_rows(&rows).try_inverse()?.column(3);
        let d = column(2);
        Some(Self {
            phi,
            gains: gains.component_div(&units),
            stays: Vector4::new(d[0], d[1], 0.0, 0.0),
            held: column(HELD),
            current: column(CURRENT),
            link: [column(LINK), column(LINK + 1), column(LINK + 2)],
            keeps: whole[(CURRENT, CURRENT)],
        })
    }
}

/// Returns l_1 and l_2 of the angle l_0 + l_1 s + l_2 s² between sample k and the next, from the neighbouring samples.
fn bent(angle: &[f64], k: usize) -> [f64; 2] {
    let step = angle[k + 1] - angle[k];
    let around = (k > 0).then(|| angle[k] - angle[k - 1]).zip(angle.get(k + 2).map(|next| next - angle[k + 1]));
    let bend = around.map_or(0.0, |(before, after)| 0.25 * (after - before));
    [step - bend, bend]
}

/// Returns q' at every sample from a cubic through seven samples.
fn speed(q: &[f64], period_s: f64) -> Vec<f64> {
    let n = q.len() as isize;
    // Beyond the ends the angle is extrapolated linearly.
    let at = |k: isize| -> f64 {
        let [first, last] = [0, n as usize - 1];
        match k {
            k if k < 0 => q[first] + (q[first + 1] - q[first]) * k as f64,
            k if k >= n => q[last] + (q[last] - q[last - 1]) * (k - n + 1) as f64,
            k => q[k as usize],
        }
    };
    let slope = |k: isize| (1..=3).map(|j| SLOPE[j as usize - 1] * (at(k + j) - at(k - j))).sum::<f64>();
    (0..n).map(|k| slope(k) / period_s).collect()
}

/// Returns the regressors of the amplitudes of F in each tick: friction, then sine and cosine of the cogging if N is
/// known.
pub(super) fn shapes(motor: &[f64], period_s: f64, cogging_per_turn: Option<f64>) -> Vec<Vec<f64>> {
    let v = speed(motor, period_s);
    let rubs = |pair: &[f64]| {
        let at = |i: u32| (f64::from(i) + 0.5) / f64::from(POINTS);
        let tanh = |i: u32| libm::tanh(((1.0 - at(i)) * pair[0] + at(i) * pair[1]) / SMOOTH_RAD_S);
        -(0..POINTS).map(tanh).sum::<f64>() / f64::from(POINTS)
    };
    let mut shapes = vec![v.windows(2).map(rubs).collect()];
    if let Some(n) = cogging_per_turn {
        for wave in [libm::sin, libm::cos] {
            shapes.push(motor.windows(2).map(|pair| wave(n * 0.5 * (pair[0] + pair[1]))).collect());
        }
    }
    shapes
}

impl Recorded<'_> {
    /// Fits by prediction error from this k_2, b_2, B_0. The parameters are these three and the amplitudes of F in A;
    /// for a rigid load b_2, B_0 and the amplitudes.
    pub(super) fn fit(&self, sheet: [f64; 3]) -> Option<Fit> {
        let shapes = shapes(self.motor, self.period_s, self.cogging_per_turn);
        let is_rigid = self.link.is_none();
        let omega = bandwidth_rad_s(if is_rigid { 0.0 } else { sheet[0] }, self.period_s);
        let skip = (SKIP_S / self.period_s).round() as usize;
        if self.motor.len() < skip + 100 {
            return None;
        }
        let residuals = |p: &[f64]| {
            let (k2, p) = if is_rigid { (0.0, p) } else { (p[0], &p[1..]) };
            self.innovations([k2, p[0], p[1]], &p[2..], &shapes, omega, skip)
        };
        let [k2, b2, b0] = sheet;
        // Damping of a fifth of the critical one, relative to the resonance or to ω.
        let damping = if is_rigid { 0.2 * omega } else { 0.2 * libm::sqrt(k2) };
        let amplitudes = shapes.len();
        let (mut start, mut scale) = (vec![b2, b0, 0.5], vec![b2.max(damping), b0, 1.0]);
        start.resize(2 + amplitudes, 0.0);
        scale.resize(2 + amplitudes, 1.0);
        if !is_rigid {
            start.insert(0, k2);
            scale.insert(0, k2);
        }
        Fit::of(residuals, &start, &scale)
    }

    /// Returns the motion due to the current: rms of the innovations without any current, rad, with the other fitted
    /// parameters.
    pub(super) fn by_current(&self, sheet_k2: f64, values: &[f64]) -> f64 {
        let is_rigid = self.link.is_none();
        let omega = bandwidth_rad_s(if is_rigid { 0.0 } else { sheet_k2 }, self.period_s);
        let skip = (SKIP_S / self.period_s).round() as usize;
        let [k2, b2] = if is_rigid { [0.0, values[0]] } else { [values[0], values[1]] };
        let left = self.innovations([k2, b2, 0.0], &[], &[], omega, skip);
        libm::sqrt(left.iter().map(|e| e * e).sum::<f64>() / left.len().max(1) as f64)
    }

    /// Returns the innovations of the observer from tick `skip` on, rad.
    fn innovations(
        &self,
        [k2, b2, b0]: [f64; 3],
        amplitudes: &[f64],
        shapes: &[Vec<f64>],
        omega: f64,
        skip: usize,
    ) -> Vec<f64> {
        let n = self.motor.len();
        let Some(tick) = Tick::of(k2, b2, [self.period_s, self.lag_s], omega) else { return vec![f64::NAN; n - skip] };
        let mut current = self.held[0];
        let mut x = Vector4::new(self.motor[0], 0.0, 0.0, 0.0);
        let mut out = Vec::with_capacity(n - skip);
        for i in 0..n - 1 {
            let rubs: f64 = amplitudes.iter().zip(shapes).map(|(amplitude, shape)| amplitude * shape[i]).sum();
            let held = self.held[i];
            let mut push = (tick.stays * rubs + tick.held * held + tick.current * current) * b0;
            current = held + (current - held) * tick.keeps;
            if let Some(link) = self.link {
                let [slope, bend] = bent(link, i);
                push += (tick.link[0] * link[i] + tick.link[1] * slope + tick.link[2] * bend) * k2;
                // The speed of the link is slope + 2 bend s in a tick.
                push += (tick.stays * slope + tick.link[1] * (2.0 * bend)) * (self.damped * k2 / self.period_s);
            }
            x = tick.phi * x + push;
            let e = self.motor[i + 1] - x[0];
            x += tick.gains * e;
            if i + 1 >= skip {
                out.push(e);
            }
        }
        out
    }

    /// Returns the lags over which the innovations are correlated.
    pub(super) fn lags(&self) -> usize {
        (ALIKE_S / self.period_s).round() as usize
    }
}
