//! Ultimate bounds of the closed loop: estimation errors, σ* and output after the transient.
//!
//! The inputs are bounds $\mu_i^{(k)}$ of $|d_i^{(k)}|$ (Eq. (2), (40)). Every bounded quantity is the output of a
//! stable linear system with a bounded input. The largest output for an input bounded by 1 is the L1 norm of the
//! impulse response. A worst-case disturbance *attains* the bounds of the errors. The bounds that follow from them add
//! magnitudes:
//!
//! 1. **Estimation error**, Eq. (52)-(53): let $h_{ik}(t)$ be the entry k + 1 of $\exp(D_i t)E_i$. Then
//!    $\delta_{ik} = \mu_i^{(r)} \int_0^\infty |h_{ik}(t)|dt$ bounds $\tilde d_i^{(k)}$. It equals
//!    $\mu_i^{(r)} l_{ik}/l_{ir}$ ($l_{i0} = 1$) when all poles are real.
//! 2. **σ\***: by Eq. (58) $\dot\sigma^* = -k_l\sigma^* - k_s\mathrm{sat}(\sigma^*/\epsilon) + w$ with $|w| \le N$,
//!    $$ N = \delta_{n0} + \sum_{i<n}\Big|c_i + \sum_{j=i}^{n-1} c_{j+1} l_{i,j-i+1}\Big| \delta_{i0} +
//!    \sum_{i<n} \sum_{j \ge i,\thinspace j-i+1 < r} c_{j+1}\big(\mu_i^{(j-i+1)} + \delta_{i,j-i+1}\big) $$
//!
//!    and $\lambda_2 = N/(k_l + k_s/\epsilon)$ inside the boundary layer ($N \le k_l\epsilon + k_s$), else
//!    $(N - k_s)/k_l$ (Eq. (36)).
//! 3. **Output**: $y^{(n-1)} + c_{n-1}y^{(n-2)} + \dots + c_1 y = \sigma^* + \sum_{i<n}\sum_j c_{j+1}\tilde
//!    d_i^{(j-i)}$, so $\lambda_3 = G(\lambda_2 + \sum_{i<n}\sum_j c_{j+1}\delta_{i,j-i})$, $G$ the L1 norm of the
//!    left side's inverse, $1/c_1$ for real roots (Eq. (37)-(38)).
//!
//! **A channel without observer** has no estimate: $\hat d_i = 0$. Its error is the disturbance itself,
//! $\delta_{ik} = \mu_i^{(k)}$. It enters $N$ as $c_i\mu_i^{(0)}$ alone, because its $\hat d_i$ is neither in σ nor in
//! the law. It enters the output by the smaller of two bounds:
//! * the sum above,
//! * the response of y to $\tilde d_i$ as one input, $(c_n p^{n-1-i} + \dots + c_{i+1})/(p^{n-1} + \dots + c_1)$. This
//!   is a companion response of the surface with its own L1 norm, $c_{i+1}/c_1$ for real roots.
//!
//! The second bound needs no derivative, so it also covers a disturbance that jumps. It does not apply to observed
//! channels: there $\tilde d_i^{(1)}$ is the error of the estimated derivative, not the derivative of the error. By Eq.
//! (52) they differ by $l_{i1}\tilde d_i$. Test `theory::random_chains_stay_within_the_ultimate_bounds` finds a loop
//! that exceeds such a bound by 3 %.
//!
//! The bounds hold for the continuous loop with an exact a(x) and b(x) and no active limit of u. The model error
//! belongs to $d_n$. The sampled loop approaches the bounds at first order in the period. If a disturbance depends on
//! the state, check its $\mu$ on the trajectory.
//!
//! # Deviation
//! * Eq. (28)-(29), (56)-(57) are not bounds as printed. V decreases outside a *ball*, and the error may leave that
//!   ball along the ellipsoid $V = \text{const}$ that touches it. The bound is larger by
//!   $\sqrt{\lambda_{max}(P)/\lambda_{min}(P)}$. For l = (0.5, 100), μ = 1, Q = I the paper gives 2.26, and a
//!   disturbance reaches 2.55 (test `printed_lyapunov_bound_is_exceeded_and_the_corrected_one_holds`).
//! * Eq. (34) has a sign error, and Eq. (36) becomes negative for a large $k_s$. Here the boundary layer then bounds
//!   σ*.
//! * Eq. (58) omits $\tilde d_n$, the largest term of Example 2, and its last inner sum runs over i instead of j.
//! * Eq. (51), (58) print sat σ* for sat(σ*/ε).

use core::fmt;

use crate::config::Config;
use crate::error::ConfigError;
use crate::error_dynamics::{MAX_DEGREE, MAX_ITERATIONS, active, companion, magnitude, roots};
use crate::exponential::exp_minus_identity;
use crate::law::ReachingLaw;
use crate::observer::ObserverGains;
use crate::{MAX_N, MAX_R};
use nalgebra::linalg::SymmetricEigen;
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Bounds of the disturbances and their derivatives, Eq. (40).
///
/// `mu[i - 1][k]` >= $|d_i^{(k)}|$ in the unit of $\dot x_i$ times s^-k. An observer of order r needs k = 0..=r. A
/// channel without an observer needs k = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisturbanceBounds<const N: usize, const K: usize> {
    /// Bounds $\mu_i^{(k)}$. `f64::INFINITY` means that the bound is unknown.
    pub mu: [[f64; K]; N],
}

/// Bounds that hold after the transient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UltimateBounds<const N: usize, const R: usize> {
    /// Bounds $\delta_{ik}$ of $|\tilde d_i^{(k)}|$. The error of a disturbance that no observer estimates is the whole
    /// disturbance: $\mu_i^{(k)}$, or infinite if that bound was not given.
    pub delta: [[f64; R]; N],
    /// Bound N on all terms that drive σ* against the reaching law, in units of σ per second.
    pub n: f64,
    /// Bound $\lambda_2$ of |σ*|. Infinite if `k_l` = 0 and `k_s` cannot hold N.
    pub sigma_star: f64,
    /// Bound $\lambda_3$ of |y|, in the unit of x_1.
    pub y: f64,
}

/// Reason why there is no bound.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum BoundsError {
    /// The configuration is not valid.
    Config(ConfigError),
    /// A $\mu$ is NaN or negative.
    MuInvalid {
        /// The channel, from 1.
        channel: usize,
        /// Order of the derivative of the disturbance.
        derivative: usize,
    },
    /// K is too small for the order of this channel's observer.
    DerivativeMissing {
        /// The channel, from 1.
        channel: usize,
        /// Derivative that Eq. (52) needs: the order r.
        needed: usize,
    },
    /// A damping ratio of the observer or the surface is below 0.001. A bound would exist, but be useless. Also
    /// returned if f64 cannot resolve the extreme poles.
    NearlyUndamped,
    /// Q is not symmetric positive definite, or Eq. (54) has no positive definite solution in f64.
    NotPositiveDefinite,
}

impl fmt::Display for BoundsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Config(error) => error.fmt(f),
            Self::MuInvalid { channel, derivative } => {
                write!(f, "channel {channel}: the bound of derivative {derivative} is NaN or negative (Eq. (40))")
            }
            Self::DerivativeMissing { channel, needed } => write!(
                f,
                "channel {channel}: the bound of derivative {needed} is needed (Eq. (52)): give {} numbers per channel",
                needed + 1
            ),
            Self::NearlyUndamped => f.write_str(
                "a damping ratio of the observer or the surface is below 0.001: choose poles that are better damped",
            ),
            Self::NotPositiveDefinite => f.write_str(
                "Q must be symmetric positive definite and D Hurwitz (Eq. (54)), with gains that f64 can tell apart",
            ),
        }
    }
}

impl core::error::Error for BoundsError {}

impl From<ConfigError> for BoundsError {
    fn from(error: ConfigError) -> Self {
        Self::Config(error)
    }
}

/// Returns the bounds that a worst-case disturbance attains for the estimation error, and the resulting bounds of σ*
/// and y.
///
/// # Errors
/// * [`BoundsError::Config`] for an invalid configuration.
/// * [`BoundsError::MuInvalid`] or [`BoundsError::DerivativeMissing`] for a $\mu$ that is negative, NaN or missing.
/// * [`BoundsError::NearlyUndamped`] for a nearly undamped design.
pub fn ultimate<const N: usize, const R: usize, const K: usize>(
    config: &Config<N, R>,
    disturbance: &DisturbanceBounds<N, K>,
) -> Result<UltimateBounds<N, R>, BoundsError> {
    assemble(config, disturbance, |gains, mu_r| {
        let norms = response_norms(active(gains))?;
        Ok(core::array::from_fn(|k| norms[k] * mu_r))
    })
}

/// Returns the bounds by the method of the paper, Eq. (54)-(58).
///
/// The corrected norm for Q = I bounds every error of a channel. The bounds are valid and loose: for the gains of
/// Example 2 the bound of σ* is 1100 times the bound from [`ultimate`].
///
/// # Errors
/// As [`ultimate`], and [`BoundsError::NotPositiveDefinite`] if Eq. (54) cannot be solved.
pub fn ultimate_by_lyapunov<const N: usize, const R: usize, const K: usize>(
    config: &Config<N, R>,
    disturbance: &DisturbanceBounds<N, K>,
) -> Result<UltimateBounds<N, R>, BoundsError> {
    assemble(config, disturbance, |gains, mu_r| {
        Ok([lyapunov_bound(gains, &SMatrix::identity(), mu_r)?.corrected; MAX_DEGREE])
    })
}

/// Computes the bounds of σ* and y from the bounds of the estimation errors. `error_bounds(gains, mu_r)` returns
/// $\delta_{ik}$ of a channel.
fn assemble<const N: usize, const R: usize, const K: usize>(
    config: &Config<N, R>,
    disturbance: &DisturbanceBounds<N, K>,
    error_bounds: impl Fn(&ObserverGains<R>, f64) -> Result<[f64; MAX_DEGREE], BoundsError>,
) -> Result<UltimateBounds<N, R>, BoundsError> {
    config.validate()?;
    let c = &config.surface.c;
    let last = N - 1;
    // The surface as gains of a companion form: l_k = c_{n-k}.
    let surface: [f64; MAX_N] = core::array::from_fn(|k| if k < last { c[last - 1 - k] } else { 0.0 });
    let surface_norms = response_norms(&surface[..last])?;

    let mut delta = [[0.0; R]; N];
    let mut n = 0.0;
    let mut y_from_errors = 0.0;
    for i in 0..N {
        let channel = i + 1;
        let mu = &disturbance.mu[i];
        if let Some(derivative) = mu.iter().position(|mu| mu.is_nan() || *mu < 0.0) {
            return Err(BoundsError::MuInvalid { channel, derivative });
        }
        // Without an observer l is empty, and so is every sum below that runs over it.
        let (l, estimated) = match &config.observers[i] {
            None => (&[][..], [0.0; MAX_DEGREE]),
            Some(gains) => {
                let needed = gains.order;
                let mu_r = mu.get(needed).ok_or(BoundsError::DerivativeMissing { channel, needed })?;
                (active(gains), error_bounds(gains, *mu_r)?)
            }
        };
        let error = |k: usize| {
            if k < l.len() { estimated[k] } else { mu.get(k).copied().unwrap_or(f64::INFINITY) }
        };
        delta[i] = core::array::from_fn(error);
        if i == last {
            n += error(0);
            continue;
        }
        // m = j - i + 1 = 1..=n-i. Coefficient c_{j+1} of the documentation is c[i + m] here.
        let mut weight = c[i];
        let mut derivatives = 0.0;
        let mut to_output = 0.0;
        for m in 1..N - i {
            if let Some(gain) = l.get(m - 1) {
                weight += c[i + m] * gain;
            }
            if m < l.len() {
                derivatives += c[i + m] * (mu[m] + error(m));
            }
            to_output += c[i + m] * error(m - 1);
        }
        n += weight.abs() * error(0) + derivatives;
        // As one input only if the errors are derivatives of each other: d̂^(1) is not the derivative of d̂.
        let as_one_input = if l.is_empty() { surface_norms[last - channel] * error(0) } else { f64::INFINITY };
        y_from_errors += (surface_norms[0] * to_output).min(as_one_input);
    }
    let sigma_star = held_by(&config.reaching, n);
    Ok(UltimateBounds { delta, n, sigma_star, y: surface_norms[0] * sigma_star + y_from_errors })
}

/// Returns $\lambda_2$, the σ* at which the reaching law balances N: Eq. (36), with sat(σ*/ε) instead of sgn.
fn held_by(reaching: &ReachingLaw, n: f64) -> f64 {
    let ReachingLaw { k_l, k_s, epsilon } = *reaching;
    if k_s > 0.0 && n <= k_l * epsilon + k_s {
        // ε = 0 is the ideal sign, which holds σ* at 0.
        if epsilon > 0.0 { n / (k_l + k_s / epsilon) } else { 0.0 }
    } else if k_l > 0.0 {
        (n - k_s.max(0.0)) / k_l
    } else {
        f64::INFINITY
    }
}

/// Companion matrix, padded with zeros. Its exponential has the identity in the padding.
type Companion = SMatrix<f64, MAX_DEGREE, MAX_DEGREE>;

/// Integration step, in units of 1/(fastest pole that has not decayed).
const STEP: f64 = 0.05;
/// Decay exponent at which a mode is dropped: e^-50 = 2e-22.
const DEAD: f64 = 50.0;
/// Smallest damping ratio. It keeps the integration below `DEAD / (STEP * MIN_DAMPING)` = 1e6 steps per mode.
const MIN_DAMPING: f64 = 1e-3;
/// Factor that rounds the norms up, so that they stay bounds: thirty times the integration error. The error was
/// measured as 7e-9 for real poles and 3.4e-8 for complex poles (test
/// `norms_are_above_the_closed_forms_by_no_more_than_their_stated_error`).
const ROUND_UP: f64 = 1.0 + 1e-6;

/// Returns $\int_0^\infty |h_k(t)|dt$ for k = 0..d-1, with h_k the entry k + 1 of exp(Dt)E.
///
/// D is the companion matrix of `l` (Hurwitz, degree d = 1..=5). The response is propagated exactly from step to step,
/// and Simpson's rule integrates inside a step. Where the response changes sign, two triangles replace it. The step
/// follows the fastest mode that has not decayed, so gains with poles decades apart cost no more than others.
fn response_norms(l: &[f64]) -> Result<[f64; MAX_DEGREE], BoundsError> {
    let poles = roots(l).ok_or(BoundsError::NearlyUndamped)?;
    if poles.iter().any(|s| -s.re <= MIN_DAMPING * magnitude(*s)) {
        return Err(BoundsError::NearlyUndamped);
    }
    // In units of the fastest pole all coefficients are of order 1: l_k / unit^k.
    let unit = magnitude(poles[0]);
    let mut scaled = [0.0; MAX_DEGREE];
    let mut power = 1.0;
    for (to, from) in scaled.iter_mut().zip(l) {
        power *= unit;
        *to = from / power;
    }
    if !power.is_normal() {
        return Err(BoundsError::NearlyUndamped);
    }
    let (d, mut response) = companion::<MAX_DEGREE>(&scaled[..l.len()]);

    let mut norms = [0.0; MAX_DEGREE];
    let mut time = 0.0;
    for pole in &poles {
        let until = DEAD * unit / -pole.re;
        if until <= time {
            continue;
        }
        let step = STEP * unit / magnitude(*pole);
        let half_step = exponential(d * (step / 2.0));
        while time < until {
            let middle = half_step * response;
            let end = half_step * middle;
            for k in 0..l.len() {
                norms[k] += area(response[k], middle[k], end[k], step);
            }
            response = end;
            time += step;
        }
    }
    // Back to seconds: component k of the response is of order s^(d-1-k), in units of time^(d-k).
    for norm in norms.iter_mut().take(l.len()) {
        *norm *= ROUND_UP / power;
        power /= unit;
    }
    Ok(norms)
}

/// Returns exp(A). The function of nalgebra needs std.
fn exponential(a: Companion) -> Companion {
    let e = exp_minus_identity(a.transpose().data.0);
    Companion::identity() + Companion::from_fn(|i, j| e[i][j])
}

/// Returns the area under |h| over one step from the values at its start, middle and end.
fn area(begin: f64, middle: f64, end: f64, step: f64) -> f64 {
    if begin * middle >= 0.0 && middle * end >= 0.0 {
        return step / 6.0 * (begin + 4.0 * middle + end).abs();
    }
    let half = |a: f64, b: f64| {
        let (size, height) = (a.abs() + b.abs(), f64::midpoint(a * a, b * b));
        if a * b < 0.0 { height / size } else { size / 2.0 }
    };
    (half(begin, middle) + half(middle, end)) * step / 2.0
}

/// Bound of $\lVert\tilde e_i\rVert$ by a Lyapunov function, Eq. (22)-(29) and (54)-(57).
///
/// With $D^TP + PD = -Q$ and $V = \tilde e^TP\tilde e$ (Eq. (22)-(23)), $\dot V < 0$ wherever
/// $\lVert\tilde e\rVert > \rho = 2\lVert PE\rVert\mu/\lambda_{min}(Q)$ (Eq. (24)-(27)).
///
/// # Deviation
/// The paper concludes $\lVert\tilde e\rVert \le \rho$ (Eq. (28)-(29), (56)). But V decreases outside a *ball*, and the
/// error may leave that ball along the ellipsoid $V = \text{const}$ that touches it. The bound is
/// $\rho\sqrt{\lambda_{max}(P)/\lambda_{min}(P)}$. For l = (0.5, 100), μ = 1, Q = I the paper gives 2.26, and a
/// disturbance reaches 2.55 (test `printed_lyapunov_bound_is_exceeded_and_the_corrected_one_holds`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LyapunovBound<const R: usize> {
    /// Matrix P of Eq. (22), (54), in the first `order` rows and columns.
    pub p: SMatrix<f64, R, R>,
    /// Printed value ρ of Eq. (29) and (56): *not* a bound.
    pub printed: f64,
    /// Corrected bound, which holds.
    pub corrected: f64,
}

/// Returns P, the printed and the corrected bound for one channel.
///
/// `q` is Q, of which the first `order` rows and columns are read. `mu` bounds $|d^{(r)}|$. The caller has checked that
/// it is not negative. The norm adds $\tilde d$ and its derivatives, so it depends on the unit of time.
///
/// # Errors
/// [`BoundsError::NotPositiveDefinite`] if Q is not symmetric positive definite, or if P is not (the gains are not
/// Hurwitz, or so far apart that f64 cannot resolve them).
pub(crate) fn lyapunov_bound<const R: usize>(
    gains: &ObserverGains<R>,
    q: &SMatrix<f64, R, R>,
    mu: f64,
) -> Result<LyapunovBound<R>, BoundsError> {
    let l = active(gains);
    if l.iter().any(|gain| !gain.is_finite()) {
        return Err(BoundsError::NotPositiveDefinite);
    }
    let order = l.len();
    // Always solved as 3 x 3. A lower order repeats a diagonal entry in the free places. That entry lies between the
    // smallest and the largest eigenvalue, so it changes neither.
    let fill = |i: usize, j: usize, value: f64| if i == j { value } else { 0.0 };
    let q = Matrix3::from_fn(|i, j| if i < order && j < order { q[(i, j)] } else { fill(i, j, q[(0, 0)]) });
    let (mut d, e): (_, Vector3<f64>) = companion(l);
    for k in order..MAX_R {
        d[(k, k)] = -1.0;
    }
    // vec(D'P + PD) = (I x D' + D' x I) vec(P) = -vec(Q).
    let transposed = d.transpose();
    let operator = Matrix3::identity().kronecker(&transposed) + transposed.kronecker(&Matrix3::identity());
    let right: SMatrix<f64, 9, 1> = SMatrix::from_iterator(q.iter().map(|value| -value));
    let solution = operator.lu().solve(&right).ok_or(BoundsError::NotPositiveDefinite)?;
    let solved = Matrix3::from_iterator(solution.iter().copied());
    let p = Matrix3::from_fn(|i, j| {
        if i < order && j < order { f64::midpoint(solved[(i, j)], solved[(j, i)]) } else { fill(i, j, solved[(0, 0)]) }
    });
    let (q_range, p_range) = (spectrum(&q)?, spectrum(&p)?);
    let printed = 2.0 * (p * e).norm() * mu / q_range.0;
    Ok(LyapunovBound {
        p: SMatrix::from_fn(|i, j| if i < order && j < order { p[(i, j)] } else { 0.0 }),
        printed,
        corrected: printed * libm::sqrt(p_range.1 / p_range.0),
    })
}

/// Returns the smallest and the largest eigenvalue of a symmetric positive definite matrix.
fn spectrum(matrix: &Matrix3<f64>) -> Result<(f64, f64), BoundsError> {
    // Divides by the largest entry, because the decomposition squares its entries.
    let unit = matrix.amax();
    if unit.is_normal()
        && *matrix == matrix.transpose()
        && let Some(eigen) = SymmetricEigen::try_new(matrix / unit, f64::EPSILON, MAX_ITERATIONS)
        && eigen.eigenvalues.min() > 0.0
    {
        return Ok((eigen.eigenvalues.min() * unit, eigen.eigenvalues.max() * unit));
    }
    Err(BoundsError::NotPositiveDefinite)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::config::Options;
    use crate::error::{Cause, Field};
    use crate::model::Nominal;
    use crate::observer::Pole;
    use crate::surface::Surface;
    use nalgebra::{SVector, matrix};
    use std::vec::Vec;

    const ERROR: f64 = ROUND_UP - 1.0;

    fn config<const N: usize, const R: usize>(
        c: [f64; N],
        observers: [Option<ObserverGains<R>>; N],
        reaching: ReachingLaw,
    ) -> Config<N, R> {
        Config {
            period_s: 1e-4,
            surface: Surface { c, alpha_per_s: 1.0 },
            observers,
            reaching,
            nominal: Nominal { gradient: [0.0; N], input_gain: 1.0 },
            options: Options::NEUTRAL,
        }
    }

    fn refused(cause: Cause) -> BoundsError {
        BoundsError::Config(ConfigError::new(Field::Observer { channel: 1 }, cause))
    }

    fn linear(k_l: f64) -> ReachingLaw {
        ReachingLaw { k_l, k_s: 0.0, epsilon: 0.0 }
    }

    fn relative(found: f64, expected: f64) -> f64 {
        (found / expected - 1.0).abs()
    }

    /// Returns the state after one classical Runge-Kutta step.
    fn advanced<const S: usize>(
        x: SVector<f64, S>,
        t: f64,
        dt: f64,
        rhs: impl Fn(f64, &SVector<f64, S>) -> SVector<f64, S>,
    ) -> SVector<f64, S> {
        let k1 = rhs(t, &x);
        let k2 = rhs(t + dt / 2.0, &(x + k1 * (dt / 2.0)));
        let k3 = rhs(t + dt / 2.0, &(x + k2 * (dt / 2.0)));
        let k4 = rhs(t + dt, &(x + k3 * dt));
        x + (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (dt / 6.0)
    }

    #[test]
    fn norms_are_above_the_closed_forms_by_no_more_than_their_stated_error() {
        let real = Pole::real;
        // Real poles, coinciding, separate and decades apart: l_k / l_r.
        for gains in [
            ObserverGains::<3>::as_printed([7.0]),
            ObserverGains::as_printed([100.0, 20.0]),
            ObserverGains::from_bandwidth::<2>(50.0),
            ObserverGains::from_bandwidth::<3>(1e4),
            ObserverGains::from_poles([real(-1000.0), real(-30.0), real(-0.5)]),
            ObserverGains::from_poles([real(-1e4), real(-1.0), real(-0.01)]),
            ObserverGains::from_poles([real(-1e5), real(-1e-5)]),
        ] {
            let l = active(&gains);
            let norms = response_norms(l).unwrap();
            for k in 0..l.len() {
                let closed = if k == 0 { 1.0 } else { l[k - 1] } / l[l.len() - 1];
                assert!(norms[k] >= closed, "{gains:?} {k}: not a bound");
                let integration = relative(norms[k] / ROUND_UP, closed);
                assert!(integration < 1e-8, "{gains:?} {k}: {integration:e}");
            }
        }
        // A complex pair: coth(pi zeta / (2 sqrt(1 - zeta^2))) / omega^2.
        for zeta in [0.9, 0.5, 0.025, 0.0011] {
            let omega: f64 = 10.0;
            let norm = response_norms(&[2.0 * zeta * omega, omega * omega]).unwrap()[0];
            let closed =
                1.0 / (omega * omega) / (std::f64::consts::FRAC_PI_2 * zeta / (1.0 - zeta * zeta).sqrt()).tanh();
            assert!(norm >= closed, "{zeta}: not a bound");
            let integration = relative(norm / ROUND_UP, closed);
            assert!(integration < 5e-8, "{zeta}: {integration:e}");
        }
        // Surfaces of degree 4 and 5 with all roots at -5: G = 1/c_1.
        for l in [&[20.0, 150.0, 500.0, 625.0][..], &[25.0, 250.0, 1250.0, 3125.0, 3125.0]] {
            let g = response_norms(l).unwrap()[0] * l[l.len() - 1];
            assert!(g > 1.0 && g < 1.0 + 2.0 * ERROR, "{g}");
        }
    }

    #[test]
    fn norms_of_two_pairs_and_a_real_root_agree_with_a_sum_in_tiny_steps() {
        // (s^2 + s + 100)(s^2 + 0.6 s + 9)(s + 2), multiplied out.
        let l = [3.6, 112.8, 287.6, 1098.0, 1800.0];
        let norms = response_norms(&l).unwrap();
        let (d, mut h) = companion::<5>(&l);
        let dt = 2e-5;
        let mut sum = [0.0; 5];
        // The slowest pole, -0.3, has decayed by e^-18 = 1.5e-8 after 60 s.
        for _ in 0..3_000_000 {
            let next = h + d * h * dt + d * d * h * (dt * dt / 2.0) + d * d * d * h * (dt * dt * dt / 6.0);
            for k in 0..5 {
                sum[k] += (h[k].abs() + next[k].abs()) * dt / 2.0;
            }
            h = next;
        }
        for k in 0..5 {
            // The trapezoids themselves are accurate to 1e-6.
            assert!(relative(norms[k], sum[k]) < 3.0 * ERROR, "{k}: {} {}", norms[k], sum[k]);
        }
    }

    /// Returns the largest error that a disturbance with |d^(r)| <= 1 reaches after `span`. Its sign follows the
    /// impulse response.
    fn reached<const S: usize>(gains: &ObserverGains<S>, k: usize, span: f64, dt: f64) -> SVector<f64, S> {
        let (d, e) = companion::<S>(active(gains));
        let steps = (span / dt) as usize;
        let mut response = e;
        let mut signs: Vec<f64> = (0..steps)
            .map(|_| {
                let middle = advanced(response, 0.0, dt / 2.0, |_, h| d * h)[k];
                response = advanced(response, 0.0, dt, |_, h| d * h);
                middle.signum()
            })
            .collect();
        signs.reverse();
        signs.iter().fold(SVector::zeros(), |error, w| advanced(error, 0.0, dt, |_, x| d * x + e * *w))
    }

    #[test]
    fn a_worst_case_disturbance_attains_the_bound_of_every_error() {
        let pair = |re, im| [Pole { re, im }, Pole { re, im: -im }];
        let [a, b] = pair(-2.0, 9.0);
        for gains in [ObserverGains::<3>::from_poles([a, b, Pole::real(-5.0)]), ObserverGains::from_bandwidth::<3>(8.0)]
        {
            let norms = response_norms(active(&gains)).unwrap();
            for k in 0..3 {
                let share = reached(&gains, k, 12.0, 1e-3)[k] / norms[k];
                // Steps of 1 ms match the switching instants to 0.5 ms, for half periods of 350 ms.
                assert!(share > 0.999 && share <= 1.0, "{gains:?} {k}: {share}");
            }
        }
    }

    #[test]
    fn printed_lyapunov_bound_is_exceeded_and_the_corrected_one_holds() {
        let gains = ObserverGains::<2>::as_printed([0.5, 100.0]);
        let bound = lyapunov_bound(&gains, &SMatrix::identity(), 1.0).unwrap();
        let error = reached(&gains, 1, 60.0, 1e-3);
        let norm = error.norm();
        assert!(relative(bound.printed, 2.26) < 0.002, "{}", bound.printed);
        assert!(relative(norm, 2.55) < 0.002, "{norm}");
        assert!(norm > 1.12 * bound.printed && norm <= bound.corrected, "{norm} {bound:?}");
        // The L1 bound of this component is attained: after 60 s the response has decayed to e^-15.
        let share = error[1] / response_norms(active(&gains)).unwrap()[1];
        assert!(share > 0.999 && share <= 1.0, "{share}");
    }

    #[test]
    fn p_solves_the_lyapunov_equation_for_every_order_and_weight() {
        let q = matrix![3.0, 0.5, 0.1; 0.5, 1.0, -0.2; 0.1, -0.2, 2.0];
        for gains in [
            ObserverGains::<3>::as_printed([7.0]),
            ObserverGains::as_printed([100.0, 20.0]),
            ObserverGains::as_printed([1000.0, 300.0, 30.0]),
        ] {
            let bound = lyapunov_bound(&gains, &q, 2.0).unwrap();
            let (d, _) = companion::<3>(active(&gains));
            let residual = d.transpose() * bound.p + bound.p * d;
            let order = gains.order;
            for i in 0..order {
                for j in 0..order {
                    // P of the printed third order reaches 1e2 and D 1e3: rounding 1e-11.
                    assert!((residual[(i, j)] + q[(i, j)]).abs() < 1e-9, "{gains:?} {residual}");
                }
            }
            assert!(bound.corrected >= bound.printed);
        }
        // r = 1 by hand: P = q/(2 l), |e| <= 2 P mu/q = mu/l. One dimension needs no correction.
        let one = lyapunov_bound(&ObserverGains::<3>::as_printed([7.0]), &q, 2.0).unwrap();
        assert!(relative(one.printed, 2.0 / 7.0) < 1e-14 && relative(one.corrected, 2.0 / 7.0) < 1e-14, "{one:?}");
    }

    #[test]
    fn lyapunov_refuses_what_has_no_positive_definite_answer() {
        let identity = SMatrix::<f64, 3, 3>::identity();
        let good = ObserverGains::<3>::as_printed([100.0, 20.0]);
        let refused = Err(BoundsError::NotPositiveDefinite);
        for bad in [ObserverGains::as_printed([1.0, 1.0, 2.0]), ObserverGains::as_printed([f64::NAN, 1.0])] {
            assert_eq!(lyapunov_bound(&bad, &identity, 1.0), refused, "{bad:?}");
        }
        let indefinite = matrix![1.0, 2.0, 0.0; 2.0, 1.0, 0.0; 0.0, 0.0, 1.0];
        let lopsided = matrix![1.0, 0.5, 0.0; 0.0, 1.0, 0.0; 0.0, 0.0, 1.0];
        for q in [indefinite, lopsided, -identity, identity * f64::NAN] {
            assert_eq!(lyapunov_bound(&good, &q, 1.0), refused, "{q}");
        }
    }

    #[test]
    fn section_four_is_the_case_n_two_of_the_general_bound() {
        let gains = ObserverGains::<2>::as_printed([100.0, 20.0]);
        let (c1, l11, mu, k_l, k_s) = (5.0, 100.0, 1.5, 50.0, 0.7);
        let config = config([c1, 1.0], [Some(gains), None], ReachingLaw { k_l, k_s, epsilon: 0.01 });
        // d_2 = 0, as in those equations.
        let found = ultimate_by_lyapunov(&config, &DisturbanceBounds { mu: [[mu; 3], [0.0; 3]] }).unwrap();
        let lambda_1 = lyapunov_bound(&gains, &SMatrix::identity(), mu).unwrap().corrected;
        // Eq. (36) and (38).
        let lambda_2 = (lambda_1 * (c1 + l11 + 1.0) + mu - k_s) / k_l;
        let lambda_3 = (lambda_1 + lambda_2) / c1;
        assert!(relative(found.sigma_star, lambda_2) < 1e-14, "{found:?}");
        assert!(relative(found.y, lambda_3) < 2.0 * ERROR, "{found:?}");
    }

    #[test]
    fn example_two_follows_the_formula_written_out_by_hand() {
        let gains = ObserverGains::<2>::as_printed([100.0, 20.0]);
        let config = config([125.0, 75.0, 15.0, 1.0], [None, Some(gains), None, Some(gains)], linear(10.0));
        let mu = [[0.0; 3], [1.0, 2.0, 3.0], [0.0; 3], [7.0, 8.0, 9.0]];
        let found = ultimate(&config, &DisturbanceBounds { mu }).unwrap();
        // delta = mu'' (1/20, 100/20); N = d40 + (75 + 15 * 100 + 1 * 20) d20 + 15 (mu2' + d21).
        let (d20, d21, d40) = (3.0 / 20.0, 15.0, 9.0 / 20.0);
        let n = d40 + 1595.0 * d20 + 15.0 * (2.0 + d21);
        assert!(relative(found.n, n) < 2.0 * ERROR, "{found:?}");
        assert!(relative(found.sigma_star, n / 10.0) < 2.0 * ERROR, "{found:?}");
        // Real roots. The observed channel 2 has one bound only: (15 d20 + d21)/c_1.
        let lambda_3 = (n / 10.0 + 15.0 * d20 + d21) / 125.0;
        assert!(relative(found.y, lambda_3) < 3.0 * ERROR, "{found:?}");
        assert!(relative(found.delta[1][1], d21) < 2.0 * ERROR && found.delta[0] == [0.0; 2], "{found:?}");
        // The ratio in the documentation of `ultimate_by_lyapunov`.
        let norms = ultimate_by_lyapunov(&config, &DisturbanceBounds { mu }).unwrap();
        let ratio = norms.sigma_star / found.sigma_star;
        assert!((1100.0..1200.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn switching_holds_sigma_star_inside_the_layer_or_takes_k_s_from_the_drive() {
        let law = |k_l, k_s, epsilon| ReachingLaw { k_l, k_s, epsilon };
        // Inside: k_l s + k_s s/eps = N; outside: k_l s + k_s = N; both agree at s = eps.
        assert_eq!(held_by(&law(10.0, 1.0, 0.5), 3.0), 3.0 / 12.0);
        assert_eq!(held_by(&law(10.0, 1.0, 0.5), 6.0), 0.5);
        assert_eq!(held_by(&law(10.0, 1.0, 0.5), 8.0), 0.7);
        // Without switching epsilon is not read. The ideal sign holds 0. k_s alone fails beyond its strength.
        assert_eq!(held_by(&law(10.0, 0.0, 0.0), 3.0), 0.3);
        assert_eq!(held_by(&law(10.0, 1.0, 0.0), 0.9), 0.0);
        assert_eq!(held_by(&law(0.0, 1.0, 0.5), 0.5), 0.25);
        assert_eq!(held_by(&law(0.0, 1.0, 0.5), 1.1), f64::INFINITY);
        assert_eq!(held_by(&law(0.0, 0.0, 0.5), 0.0), f64::INFINITY);
    }

    /// Returns the largest |d_tilde_i|, |sigma*| and |y| in the second half of `span` of the continuous loop, for n =
    /// 3, r = 2.
    ///
    /// The loop is Eq. (39), (44), (51). State: x, the estimates of three channels (0 if unobserved), W.
    fn simulated(config: &Config<3, 2>, span: f64, d: impl Fn(f64) -> [f64; 3]) -> ([f64; 3], f64, f64) {
        let c = config.surface.c;
        let ReachingLaw { k_l, k_s, epsilon } = config.reaching;
        let estimate = |x: &SVector<f64, 10>, i: usize, k: usize| x[3 + 2 * i + k];
        let sigma_star = |x: &SVector<f64, 10>| {
            let sigma: f64 = (0..3).map(|i| c[i] * x[i]).sum();
            sigma + c[1] * estimate(x, 0, 0) + c[2] * (estimate(x, 0, 1) + estimate(x, 1, 0)) - x[9]
        };
        let rhs = |t: f64, x: &SVector<f64, 10>| {
            let (d, mut out) = (d(t), SVector::<f64, 10>::zeros());
            let s = sigma_star(x);
            let switching = if k_s > 0.0 { k_s * (s / epsilon).clamp(-1.0, 1.0) } else { 0.0 };
            // Input channel a + b u with a = 0, b = 1.
            let mut u = -estimate(x, 2, 0) - config.surface.alpha_per_s * x[9] - k_l * s - switching;
            for i in 0..2 {
                u -= c[i] * (x[i + 1] + estimate(x, i, 0));
                out[i] = x[i + 1] + d[i];
            }
            out[2] = u + d[2];
            for i in 0..3 {
                if let Some(gains) = &config.observers[i] {
                    let l2 = if gains.order == 2 { gains.l[1] } else { 0.0 };
                    let error = d[i] - estimate(x, i, 0);
                    out[3 + 2 * i] = gains.l[0] * error + estimate(x, i, 1);
                    out[4 + 2 * i] = l2 * error;
                }
            }
            out[9] = -config.surface.alpha_per_s * x[9];
            out
        };
        let mut x = SVector::<f64, 10>::zeros();
        x[0] = 0.3;
        x[9] = c[0] * x[0];
        let dt = 1e-3;
        let steps = (span / dt) as usize;
        let (mut error, mut sigma, mut y) = ([0.0_f64; 3], 0.0_f64, 0.0_f64);
        for step in 0..steps {
            x = advanced(x, step as f64 * dt, dt, rhs);
            if step > steps / 2 {
                let now = d((step + 1) as f64 * dt);
                for i in 0..3 {
                    error[i] = error[i].max((now[i] - estimate(&x, i, 0)).abs());
                }
                sigma = sigma.max(sigma_star(&x).abs());
                y = y.max(x[0].abs());
            }
        }
        (error, sigma, y)
    }

    #[test]
    fn the_simulated_loop_stays_within_the_bounds_and_not_absurdly_far() {
        let [fast, ringing] = [
            ObserverGains::<2>::from_bandwidth::<2>(30.0),
            ObserverGains::from_poles([Pole { re: -4.0, im: 15.0 }, Pole { re: -4.0, im: -15.0 }]),
        ];
        let order_one = ObserverGains::<2>::from_bandwidth::<1>(20.0);
        let switched = ReachingLaw { k_l: 5.0, k_s: 2.0, epsilon: 0.05 };
        // Surfaces with a double real root and with a complex pair.
        for c in [[25.0, 10.0, 1.0], [29.0, 4.0, 1.0]] {
            for reaching in [linear(10.0), switched] {
                for observers in [
                    [Some(fast), Some(ringing), Some(fast)],
                    [Some(ringing), Some(order_one), Some(order_one)],
                    [None, Some(fast), Some(order_one)],
                    [Some(fast), None, None],
                ] {
                    let config = config(c, observers, reaching);
                    // d_i = A_i sin(w_i t + i): mu^(k) = A w^k. Near the resonances of `ringing` and of the second
                    // surface.
                    let (amplitude, omega) = ([0.2_f64, 0.5, 1.0], [5.0_f64, 15.0, 3.0]);
                    let mu = core::array::from_fn(|i| [0, 1, 2].map(|k| amplitude[i] * omega[i].powi(k)));
                    let bounds = ultimate(&config, &DisturbanceBounds::<3, 3> { mu }).unwrap();
                    let d = |t: f64| core::array::from_fn(|i| amplitude[i] * (omega[i] * t + i as f64).sin());
                    let (error, sigma_star, y) = simulated(&config, 20.0, d);
                    let mut shares = [0.0; 5];
                    for i in 0..3 {
                        shares[i] = error[i] / bounds.delta[i][0];
                    }
                    (shares[3], shares[4]) = (sigma_star / bounds.sigma_star, y / bounds.y);
                    // An unobserved channel attains its own amplitude. RK4 at 1 ms is accurate to 1e-6.
                    assert!(shares.iter().all(|share| *share <= 1.0 + 1e-6), "{observers:?} {shares:?}");
                    assert!(shares.iter().all(|share| *share > 0.01), "{observers:?} {shares:?}");
                }
            }
        }
    }

    #[test]
    fn a_constant_disturbance_in_an_unobserved_channel_attains_the_bounds_of_sigma_star_and_output() {
        let gains = ObserverGains::<2>::from_bandwidth::<2>(30.0);
        for (channel, amplitude) in [(0, 0.4), (1, 0.4), (2, 3.0)] {
            let mut observers = [Some(gains); 3];
            observers[channel] = None;
            let config = config([25.0, 10.0, 1.0], observers, linear(10.0));
            // Only mu^(0) of the channel is given: no derivative is used.
            let mut mu = [[0.0; 3]; 3];
            mu[channel] = [amplitude, f64::INFINITY, f64::INFINITY];
            let bounds = ultimate(&config, &DisturbanceBounds { mu }).unwrap();
            let mut d = [0.0; 3];
            d[channel] = amplitude;
            let (_, sigma_star, y) = simulated(&config, 60.0, |_| d);
            assert!(relative(sigma_star, bounds.sigma_star) < 2.0 * ERROR, "{channel}: {sigma_star} {bounds:?}");
            // sigma* and the direct response add with equal sign for real roots.
            assert!(relative(y, bounds.y) < 3.0 * ERROR, "{channel}: {y} {bounds:?}");
            assert_eq!(bounds.delta[channel], [amplitude, f64::INFINITY]);
        }
    }

    #[test]
    fn bounds_are_refused_rather_than_guessed() {
        let gains = ObserverGains::<2>::as_printed([100.0, 20.0]);
        let with = |gains| config([5.0, 1.0], [Some(gains), None], linear(10.0));
        let mu = |mu: f64| DisturbanceBounds { mu: [[mu; 3]; 2] };
        assert_eq!(
            ultimate(&with(gains), &DisturbanceBounds { mu: [[1.0; 2]; 2] }),
            Err(BoundsError::DerivativeMissing { channel: 1, needed: 2 })
        );
        let invalid = Err(BoundsError::MuInvalid { channel: 1, derivative: 0 });
        assert_eq!(ultimate(&with(gains), &mu(-1.0)), invalid);
        assert_eq!(ultimate(&with(gains), &mu(f64::NAN)), invalid);
        // Both methods report the channel of the invalid number.
        let second = config([5.0, 1.0], [None, Some(gains)], linear(10.0));
        let last = DisturbanceBounds { mu: [[1.0; 3], [1.0, 1.0, -1.0]] };
        let invalid = Err(BoundsError::MuInvalid { channel: 2, derivative: 2 });
        assert_eq!(ultimate(&second, &last), invalid);
        assert_eq!(ultimate_by_lyapunov(&second, &last), invalid);
        let undamped = ObserverGains::as_printed([1e-3, 100.0]);
        assert_eq!(ultimate(&with(undamped), &mu(1.0)), Err(BoundsError::NearlyUndamped));
        let not_hurwitz = refused(Cause::ObserverNotHurwitz);
        assert_eq!(ultimate(&with(ObserverGains::as_printed([-1.0, 2.0])), &mu(1.0)), Err(not_hurwitz));
        // An unknown bound is infinite, never a NaN.
        let unknown = ultimate(&with(gains), &mu(f64::INFINITY)).unwrap();
        assert_eq!((unknown.n, unknown.sigma_star, unknown.y), (f64::INFINITY, f64::INFINITY, f64::INFINITY));
        // Gains whose powers leave the range of f64 must return too.
        for l in [[1e200, 1e300], [1e-200, 1e-300], [1e308, 1e308]] {
            let _ = response_norms(&l);
            let _ = lyapunov_bound(&ObserverGains::<2>::as_printed(l), &SMatrix::identity(), 1.0);
        }
    }
}
