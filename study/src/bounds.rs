//! Guaranteed bounds of the outputs of a sampled loop for given disturbances, quantisation and rounding.
//!
//! The loop is the exact closed loop of [`margins`](crate::margins()): plant, hold, delays and tick as one linear map.
//! Disturbances w act on it in continuous time, at any instant inside a tick. Let $w^{(j)}(t_k) = p_j$, and let all
//! derivatives from the m-th on be a known input. One tick from $t_k$ to $t_{k+1}$ is then
//!
//! $$ s^+ = A s + G p + \int_0^T q(\theta)\thinspace w^{(m)}(t_{k+1} - \theta)\thinspace d\theta, \qquad
//!    z = C s + D p_0 $$
//!
//! G, the response q of the plant states, and the propagation N of p are blocks of a matrix exponential. Its matrix is
//! the plant with m integrators before it. $\Pi$ solves $\Pi N = A\Pi + G$ and is the steady response to a polynomial;
//! the remainder $s - \Pi p$ decays. So each output has *error coefficients* $C_j$, the columns of $C\Pi + D$, and a
//! kernel:
//!
//! $$ z(t_k) = \sum_{j<m} C_j w^{(j)}(t_k) + \int_0^\infty h_m(\tau) w^{(m)}(t_k - \tau)\thinspace d\tau, \qquad
//!    h_m(\theta + l T) = C A^l e_m(\theta) $$
//!
//! $$ |z| \le \sum_{j<m} |C_j| \mu_j + \mu_m \int_0^\infty |h_m(\tau)|\thinspace d\tau, \qquad |w^{(j)}| \le \mu_j $$
//!
//! at every tick. This holds for every m, and the smallest value is the bound. $C_j = 0$ for j < r if an observer of
//! order r estimates the disturbance; this applies to the estimates. For σ\* and y the controller removes a constant
//! only.
//!
//! For a single m with $C_j = 0$ the bound is *attained* by $w^{(m)} = \mu_m\thinspace\mathrm{sign}\thinspace h_m$, run
//! backwards (test `a_disturbance_built_of_the_kernel_attains_the_bound`). For m > 0, a jump of w by J adds
//! $J \max|h_1|$. A disturbance that starts at t = 0 jumps there, in each derivative that is not 0. The tail of
//! $h_1, h_2, \ldots$ remains of this jump. Between two ticks y may be larger by at most $\frac{T}{2}|\dot y|$.
//!
//! A sensor error η of at most half a quantum, arbitrary from tick to tick, contributes at most
//! $\frac{q}{2} \big(|D_\eta| + \sum_k |C A^k B_\eta|\big)$. This is the bound of quantisation for any signal.
//!
//! A controller may demand a u that differs from the u of the loop by at most e in each tick and account for it. This
//! acts like a reported actuator error: the sum above with the response to an additional u of 1.
//!
//! Cost: some milliseconds for a kernel, independent of the period and the slowest pole. The sums over ticks take
//! longer strides after the fast modes have decayed (error below 2e-5, test
//! `strides_lose_less_than_the_bounds_are_rounded_up`).

use std::fmt;

use loop_sim::linear::{LawAtRest, LinearPlant, LinearTick, Matrix, slopes};
use loop_sim::solver::SolverError;
use nalgebra::{Complex, DMatrix, DVector};
use scenario::AtRest;

mod gain;
mod run;

pub use gain::Gain;
pub use run::{Advice, Bounds, Knob, Part, bounds, loop_of};

use crate::Error;
use crate::margins::{MarginsError, Stepped, Tick, eigenvalues, heard};

/// Factor by which bounds are rounded up, five times the error of the sums.
const ROUND_UP: f64 = 1.0 + 1e-4;
/// Factor by which kernel maxima are rounded up; a kernel is sampled at every tenth of a radian of its fastest mode.
const PEAK_UP: f64 = 1.002;
/// Decay exponent after which a mode is ignored: e^-40.
const DEAD: f64 = 40.0;
/// Largest stride in units of 1/(fastest remaining mode), and the stride in ticks below which every tick is summed.
const STRIDE: f64 = 0.2;
const LEAST_STRIDE: f64 = 16.0;
/// Gauss-Legendre nodes and weights on (0, 1) for the instants inside a tick; the two ends serve the maxima.
const INSTANTS: [(f64, f64); 8] = [
    (0.0, 0.0),
    (0.033_765_242_898_423_975, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_76, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_56, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_2, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_17),
    (1.0, 0.0),
];

/// Bounded quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Sliding variable σ\*.
    SigmaStar,
    /// Output, or control error with a reference.
    Output,
    /// Controller demand u relative to rest.
    Control,
    /// Estimation error $d_i - \hat d_i$ of a channel, from 0.
    EstimationError(usize),
}

/// Reason why there are no bounds.
#[derive(Clone, Debug, PartialEq)]
pub enum NoBounds {
    /// The loop is unstable; the value is its spectral radius.
    Unstable(f64),
    /// The loop has no finite matrices.
    Loop(MarginsError),
}

impl fmt::Display for NoBounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unstable(radius) => write!(
                f,
                "no bound: the linearised loop has a spectral radius of {radius:.6} per tick; details: host-sim design"
            ),
            Self::Loop(error) => error.fmt(f),
        }
    }
}

impl From<NoBounds> for Error {
    fn from(error: NoBounds) -> Self {
        Self::failed(error.to_string())
    }
}

impl From<SolverError> for NoBounds {
    fn from(error: SolverError) -> Self {
        Self::Loop(MarginsError::Solver(error))
    }
}

/// Known bounds of a disturbance.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalBounds {
    /// μ_0, μ_1, ..: bounds of |w|, |w'|, .. between jumps.
    pub mu: Vec<f64>,
    /// Sum of the jump sizes.
    pub jumps: f64,
}

/// Bound of a quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// Value of the bound.
    pub value: f64,
    /// Derivative m that gives the smallest bound.
    pub derivative: usize,
}

/// Closed loop from disturbances and sensors to the bounded quantities.
#[derive(Clone, Debug)]
pub struct SampledLoop {
    period_s: f64,
    a: DMatrix<f64>,
    modes: Vec<Complex<f64>>,
    /// C, a row for each quantity.
    c: DMatrix<f64>,
    quantities: Vec<Quantity>,
    /// Input of an error of each sensor: effect on the state and direct effect on the quantities.
    sensors: Vec<(DVector<f64>, DVector<f64>)>,
    /// Input of an additional u: effect on the state and direct effect on the quantities.
    asked: (DVector<f64>, DVector<f64>),
    /// F of the plant for the states that are kept, and the indices of these states.
    rates: DMatrix<f64>,
    kept: Vec<usize>,
    /// Lumped disturbance d_i of each channel that the loop at rest contains, as a row over x and u.
    lumped: Matrix,
    u: f64,
}

/// Response to a disturbance in one channel by its m-th derivative.
#[derive(Clone, Debug)]
pub struct Kernel {
    /// Error coefficients C_0 .. C_(m-1), a row for each quantity.
    pub coefficients: DMatrix<f64>,
    /// Direct effect D for m = 0, within the tick of w.
    direct: DVector<f64>,
    /// e_m at the instants inside a tick.
    begin: DMatrix<f64>,
    /// ∫|h_m| of each quantity.
    pub norms: Vec<f64>,
    /// Maximum |h_m| of each quantity.
    pub peaks: Vec<f64>,
    /// Maximum |h_m| of each quantity after the given time.
    pub tails: Vec<f64>,
}

/// Result of [`SampledLoop::sums`].
struct Sums {
    norms: Vec<f64>,
    peaks: Vec<f64>,
    tails: Vec<f64>,
}

/// Returns e^M from the series at a 2^-s-th of M, and s squarings.
fn exponential(m: &DMatrix<f64>) -> DMatrix<f64> {
    let norm = m.row_iter().map(|row| row.iter().map(|entry| entry.abs()).sum::<f64>()).fold(0.0, f64::max);
    let squarings = libm::ceil(libm::log2((2.0 * norm).max(1.0))) as i32;
    let m = m * libm::exp2(f64::from(-squarings));
    let one = DMatrix::identity(m.nrows(), m.nrows());
    let mut e = one.clone();
    for k in (1..=18).rev() {
        e = &one + &m * e / f64::from(k);
    }
    for _ in 0..squarings {
        e = &e * &e;
    }
    e
}

impl SampledLoop {
    /// Builds the loop at rest with this controller. `output` is the controlled state, `observed` are the channels with
    /// an observer; all count from 0.
    ///
    /// # Errors
    /// The loop is unstable or has no finite matrices.
    pub fn of(
        at_rest: &AtRest,
        law: &dyn LawAtRest,
        period_s: f64,
        output: usize,
        observed: &[usize],
    ) -> Result<Self, NoBounds> {
        let is_by_count = law.steps().iter().any(|step| *step > 0.0);
        let law = LinearTick::of(law, at_rest.report);
        let linear = LinearPlant::of(at_rest.plant.as_ref(), law.u, period_s)?;
        let (tick, states) = (Tick::of(at_rest, &linear, &law, is_by_count), at_rest.plant.order());
        let rates = slopes(states, law.u, |x, u, dx| at_rest.plant.rhs(0.0, x, u, dx));
        let lumped = slopes(states, law.u, |x, u, d| at_rest.plant.lumped(0.0, x, u, d));

        let order = tick.order();
        let unit = |n: usize, at: Option<usize>| -> Vec<f64> {
            (0..n).map(|i| if at == Some(i) { 1.0 } else { 0.0 }).collect()
        };
        let sensors = at_rest.sensed.len();
        let step = |state: Option<usize>, sensor| tick.step(&unit(order, state), 0.0, &unit(sensors, sensor), true);
        let mut quantities = Vec::new();
        if !law.told.is_empty() {
            quantities.push(Quantity::SigmaStar);
        }
        quantities.extend([Quantity::Output, Quantity::Control]);
        quantities.extend(observed.iter().filter(|i| *i + 1 < law.told.len()).map(|&i| Quantity::EstimationError(i)));
        let of = |quantity: &Quantity, x: &dyn Fn(usize) -> f64, stepped: &Stepped| match *quantity {
            Quantity::SigmaStar => stepped.told[0],
            Quantity::Output => x(output),
            Quantity::Control => stepped.asked,
            Quantity::EstimationError(i) => {
                let of_x: f64 = (0..states).map(|j| lumped[i][j] * x(j)).sum();
                of_x + lumped[i][states] * stepped.held - stepped.told[i + 1]
            }
        };
        let columns: Vec<Stepped> = (0..order).map(|j| step(Some(j), None)).collect();
        let value = |quantity: &Quantity, j: usize| of(quantity, &|i| f64::from(u8::from(i == j)), &columns[j]);
        let is_heard = |j: usize| quantities.iter().any(|quantity| value(quantity, j) != 0.0);
        let kept = heard(order, is_heard, |i, j| columns[j].next[i]);
        let n = kept.len();
        let a = DMatrix::from_fn(n, n, |i, j| columns[kept[j]].next[kept[i]]);
        if !a.iter().all(|entry| entry.is_finite()) {
            return Err(NoBounds::Loop(MarginsError::NoNumbers));
        }
        let modes = eigenvalues(a.clone()).map_err(NoBounds::Loop)?;
        let radius = modes.first().map_or(0.0, |z| libm::hypot(z.re, z.im));
        if radius >= 1.0 {
            return Err(NoBounds::Unstable(radius));
        }
        let c = DMatrix::from_fn(quantities.len(), n, |i, j| value(&quantities[i], kept[j]));
        let sensors = (0..sensors).map(|i| {
            let stepped = step(None, Some(i));
            let direct = quantities.iter().map(|quantity| of(quantity, &|_| 0.0, &stepped));
            (DVector::from_iterator(n, kept.iter().map(|&j| stepped.next[j])), DVector::from_vec(direct.collect()))
        });
        let sensors = sensors.collect();
        let asked = tick.asked_beside();
        let of_asked = quantities.iter().map(|quantity| f64::from(u8::from(*quantity == Quantity::Control)));
        let asked = (DVector::from_iterator(n, kept.iter().map(|&j| asked[j])), DVector::from_vec(of_asked.collect()));
        let rates = DMatrix::from_fn(states, states, |i, j| rates[i][j]);
        Ok(Self { period_s, a, modes, c, quantities, sensors, asked, rates, kept, lumped, u: law.u })
    }

    /// Returns the bounded quantities in the order of all results.
    pub fn quantities(&self) -> &[Quantity] {
        &self.quantities
    }

    /// Returns u at rest.
    pub const fn rest(&self) -> f64 {
        self.u
    }

    /// Returns the part of d_i that the loop at rest does not contain and that acts as an external disturbance.
    pub fn outside(&self, channel: usize, d: f64, x: &[f64], u: f64) -> f64 {
        let row = &self.lumped[channel];
        let states = row.len() - 1;
        d - row[..states].iter().zip(x).map(|(a, x)| a * x).sum::<f64>() - row[states] * (u - self.u)
    }

    /// Returns whether all of d_i of this channel is external to the loop at rest.
    pub fn is_outside(&self, channel: usize) -> bool {
        self.lumped[channel].iter().all(|slope| *slope == 0.0)
    }

    /// Propagates the plant with m integrators before one of its channels over a time.
    fn pushed(&self, channel: usize, m: usize, time_s: f64) -> DMatrix<f64> {
        let states = self.rates.nrows();
        let mut all = DMatrix::zeros(states + m, states + m);
        all.view_mut((0, 0), (states, states)).copy_from(&self.rates);
        if m > 0 {
            all[(channel, states)] = 1.0;
        }
        for j in 1..m {
            all[(states + j - 1, states + j)] = 1.0;
        }
        exponential(&(all * time_s))
    }

    /// Returns the loop state of a plant state.
    fn in_loop(&self, x: impl Fn(usize) -> f64) -> DVector<f64> {
        let states = self.rates.nrows();
        DVector::from_iterator(self.kept.len(), self.kept.iter().map(|&i| if i < states { x(i) } else { 0.0 }))
    }

    /// Returns the response to a disturbance of a channel (from 0) by its m-th derivative. The tails start at
    /// `after_s`.
    ///
    /// # Errors
    /// The loop has no finite response to a polynomial.
    pub fn kernel(&self, channel: usize, m: usize, after_s: f64) -> Result<Kernel, NoBounds> {
        let (n, states, t) = (self.kept.len(), self.rates.nrows(), self.period_s);
        let of_error = |quantity: &Quantity| f64::from(u8::from(*quantity == Quantity::EstimationError(channel)));
        let direct = DVector::from_iterator(self.quantities.len(), self.quantities.iter().map(of_error));
        let tick = self.pushed(channel, m, t);
        let mut driven_to = DMatrix::zeros(n, m);
        let solver = (DMatrix::identity(n, n) - &self.a).full_piv_lu();
        for j in 0..m {
            let mut right = self.in_loop(|i| tick[(i, states + j)]);
            for i in 0..j {
                right -= driven_to.column(i) * tick[(states + i, states + j)];
            }
            let column = solver.solve(&right).ok_or(NoBounds::Loop(MarginsError::NoNumbers))?;
            driven_to.set_column(j, &column);
        }
        let mut coefficients = &self.c * &driven_to;
        if m > 0 {
            let first = coefficients.column(0) + &direct;
            coefficients.set_column(0, &first);
        }
        let begin = self.begin(channel, m, &driven_to, &INSTANTS.map(|(share, _)| share * t));
        let Sums { norms, peaks, tails } = self.sums(&begin, &INSTANTS.map(|(_, weight)| weight * t), after_s / t);
        let direct = if m == 0 { direct } else { DVector::zeros(self.quantities.len()) };
        Ok(Kernel { coefficients, direct, begin, norms, peaks, tails })
    }

    /// Returns e_m at these times before the end of a tick.
    fn begin(&self, channel: usize, m: usize, driven_to: &DMatrix<f64>, times_s: &[f64]) -> DMatrix<f64> {
        let states = self.rates.nrows();
        let columns: Vec<DVector<f64>> = times_s
            .iter()
            .map(|&time_s| {
                let moved = self.pushed(channel, m, time_s);
                // An impulse in w^(m) is a step of w^(m-1); for m = 0 it is a step of the state.
                let from = if m == 0 { channel } else { states + m - 1 };
                let p = moved.view((states, from), (m, 1)).into_owned();
                self.in_loop(|i| moved[(i, from)]) - driven_to * p
            })
            .collect();
        DMatrix::from_columns(&columns)
    }

    /// Returns h_m at θ + l T for l = 0 .. ticks - 1 and each share θ/T of [`instants`]: one matrix per tick, one row
    /// per quantity.
    pub fn course(&self, kernel: &Kernel, ticks: usize) -> Vec<DMatrix<f64>> {
        let mut state = kernel.begin.clone();
        let step = |_| {
            let now = &self.c * &state;
            state = &self.a * &state;
            now
        };
        (0..ticks).map(step).collect()
    }

    /// Returns for each quantity Σ_j weight_j Σ_k |C A^k b_j|, the maximum |C A^k b_j|, and this maximum from `after`
    /// on.
    fn sums(&self, columns: &DMatrix<f64>, weights: &[f64], after: f64) -> Sums {
        let mut powers = vec![self.a.clone()];
        let zeros = vec![0.0_f64; self.quantities.len()];
        let mut found = Sums { norms: zeros.clone(), peaks: zeros.clone(), tails: zeros };
        // For each mode its rate and the tick at which it has decayed.
        let modes: Vec<(f64, f64)> = self
            .modes
            .iter()
            .map(|z| {
                let decay = -libm::log(libm::hypot(z.re, z.im).max(f64::MIN_POSITIVE));
                (libm::hypot(decay, libm::atan2(z.im, z.re)), DEAD / decay)
            })
            .collect();
        let mut state = columns.clone();
        let mut at = 0.0;
        loop {
            let alive = modes.iter().filter(|(_, until)| *until > at);
            let fastest = alive.map(|(rate, _)| *rate).fold(0.0, f64::max);
            // A delayed effect appears only within these first ticks.
            let is_beginning = at < self.kept.len() as f64;
            if fastest == 0.0 && !is_beginning {
                break;
            }
            let ticks = STRIDE / fastest;
            let doublings = if is_beginning || ticks < LEAST_STRIDE { 0 } else { libm::log2(ticks) as usize };
            while powers.len() <= doublings {
                let last = &powers[powers.len() - 1];
                powers.push(last * last);
            }
            let here = &self.c * &state;
            let stride = if doublings == 0 { 1.0 } else { libm::exp2(doublings as f64) };
            let mut add = |of: &dyn Fn(usize, usize) -> (f64, f64)| {
                for i in 0..self.quantities.len() {
                    for (j, weight) in weights.iter().enumerate() {
                        let (sum, peak) = of(i, j);
                        found.norms[i] += weight * sum;
                        found.peaks[i] = found.peaks[i].max(peak);
                        if at + stride > after {
                            found.tails[i] = found.tails[i].max(peak);
                        }
                    }
                }
            };
            if doublings == 0 {
                add(&|i, j| (here[(i, j)].abs(), here[(i, j)].abs()));
                state = &self.a * state;
            } else {
                let half = &powers[doublings - 1] * &state;
                let next = &powers[doublings - 1] * &half;
                let (middle, end) = (&self.c * &half, &self.c * &next);
                add(&|i, j| {
                    let [from, through, to] = [&here, &middle, &end].map(|it| it[(i, j)]);
                    let sum = area(from, through, to, stride) + 0.5 * (from.abs() - to.abs());
                    (sum, from.abs().max(through.abs()))
                });
                state = next;
            }
            at += stride;
        }
        found
    }

    /// Returns the bounds of each quantity from `after_s` on. The disturbance of the channel (from 0) starts at t = 0.
    ///
    /// # Errors
    /// The loop has no finite response to a polynomial.
    pub fn of_disturbance(&self, channel: usize, known: &SignalBounds, after_s: f64) -> Result<Vec<Bound>, NoBounds> {
        let none = Bound { value: f64::INFINITY, derivative: 0 };
        let mut least = vec![none; self.quantities.len()];
        let mut kernels = Vec::new();
        for (m, mu) in known.mu.iter().enumerate() {
            kernels.push(self.kernel(channel, m, after_s)?);
            let kernel = &kernels[m];
            for (i, least) in least.iter_mut().enumerate() {
                let mut value = ROUND_UP * mu * (kernel.norms[i] + kernel.direct[i]);
                for j in 0..m {
                    // w^(j) jumps at the start if its first value is not 0.
                    let of_start = PEAK_UP * kernels[j + 1].tails[i];
                    value += (kernel.coefficients[(i, j)].abs() + of_start) * known.mu[j];
                }
                if m > 0 {
                    value += PEAK_UP * kernels[1].peaks[i] * known.jumps;
                }
                if value < least.value {
                    *least = Bound { value, derivative: m };
                }
            }
        }
        Ok(least)
    }

    /// Returns the bounds of each quantity for a sensor error of at most `error` in each tick.
    pub fn of_sensor(&self, sensor: usize, error: f64) -> Vec<f64> {
        self.of_errors(&self.sensors[sensor], error)
    }

    /// Returns the bounds of each quantity if the demanded u differs by at most `error` in each tick.
    pub fn of_asked(&self, error: f64) -> Vec<f64> {
        self.of_errors(&self.asked, error)
    }

    fn of_errors(&self, (state, direct): &(DVector<f64>, DVector<f64>), error: f64) -> Vec<f64> {
        let Sums { norms, .. } = self.sums(&DMatrix::from_columns(std::slice::from_ref(state)), &[1.0], 0.0);
        norms.iter().zip(direct.iter()).map(|(norm, direct)| ROUND_UP * error * (norm + direct.abs())).collect()
    }
}

/// Returns the shares θ/T of a tick at which a kernel is sampled, and their weights.
pub fn instants() -> [(f64, f64); 8] {
    INSTANTS
}

/// Returns the area under |h| over a stride by Simpson's rule, with triangles at a change of sign.
fn area(from: f64, middle: f64, to: f64, stride: f64) -> f64 {
    if from * middle >= 0.0 && middle * to >= 0.0 {
        return stride / 6.0 * (from + 4.0 * middle + to).abs();
    }
    let half = |a: f64, b: f64| {
        let (size, height) = (a.abs() + b.abs(), f64::midpoint(a * a, b * b));
        if a * b < 0.0 { height / size } else { size / 2.0 }
    };
    (half(from, middle) + half(middle, to)) * stride / 2.0
}
