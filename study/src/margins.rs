//! Poles, stability margins and noise gain of a sampled loop at rest, from its matrices.
//!
//! One tick of plant, controller and all delays is a linear map ([`loop_sim::linear`]). v is the input of the plant and
//! u the held output of the actuator. The loop broken at the plant input has the gain L. In the closed loop v = u + w:
//!
//! ```text
//! x(k+1) = A x(k) + B v(k)    u(k) = C x(k)    L(z) = -C (z I - A)^-1 B    S(z) = 1/(1 + L(z))    z = e^(i w T)
//! ```
//!
//! * *Poles* are ln(z)/T of the eigenvalues z of the closed loop, rad/s. The loop is stable if all |z| < 1.
//! * *Gain margins*: the loop is stable while the plant gain is multiplied by a factor between these two. They are -1/L
//!   where L is real and negative, the nearest on either side of 1.
//! * *Phase margin*: the smallest phase that makes L = -1 where |L| = 1. *Delay margin*: the smallest delay that makes
//!   L = -1, exact for a whole number of ticks.
//! * *Noise gain*: rms of u for white noise of rms 1 on one sensor, from the sum of A^k B B' A'^k of the closed loop.
//!
//! Controller states without an effect on u, such as the innovation gate, are left out of the loop. Angles are stored
//! relative to the last count. Otherwise a speed loop would appear unstable in its angle. Cost: some milliseconds.

use std::f64::consts::PI;
use std::fmt;

use loop_sim::linear::{LawAtRest, LinearPlant, LinearTick};
use loop_sim::plant::Plant;
use loop_sim::port::drive::DriveDesign;
use loop_sim::solver::SolverError;
use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::linalg::{Hessenberg, Schur};
use nalgebra::{Complex, DMatrix, DVector, Normed};
use scenario::{AtRest, Corner, Experiment};
use serde::Serialize;

use crate::Error;
use crate::gain_sets::fast;

/// Root or pole, rad/s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Root {
    /// Real part; negative if stable.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
}

/// Stability margins at the plant input.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Margins {
    /// Highest frequency with |L| = 1, rad/s; `None` if |L| < 1 everywhere.
    pub crossover_rad_s: Option<f64>,
    /// Phase margin, degrees; `None` if unlimited.
    pub phase_deg: Option<f64>,
    /// Frequency of the phase margin, rad/s: with several crossovers not always the highest.
    pub phase_rad_s: Option<f64>,
    /// Delay margin, s; `None` if unlimited.
    pub delay_s: Option<f64>,
    /// Largest factor of the plant gain; `None` if unlimited.
    pub gain_up: Option<f64>,
    /// Smallest factor of the plant gain; 0 if unlimited.
    pub gain_down: f64,
    /// Sensitivity peak, largest |S|.
    pub sensitivity_peak: f64,
    /// Frequency of the sensitivity peak, rad/s.
    pub peak_rad_s: f64,
}

/// Matrices of a loop.
#[derive(Clone, Debug)]
pub struct Loop {
    period_s: f64,
    /// Matrix of the closed loop, and the open loop from the plant input to the held output.
    closed: DMatrix<f64>,
    open: Response,
    /// Input vector of the plant input.
    input: DVector<f64>,
    /// Input of the noise on each sensor: effect on the state and direct effect on u.
    noise: Vec<(DVector<f64>, f64)>,
    /// States of the tick that affect the output: the states of the loop.
    kept: Vec<usize>,
    /// Output rows of the held value and of the controller demand. In the open loop u depends on the state alone.
    held: DVector<f64>,
    asked: DVector<f64>,
}

/// Sampled loop as matrices: x(k+1) = A x(k) + B w(k), y(k) = C x(k).
///
/// The open loop has the transfer function L. The closed loop goes from w, which is added to u at the plant input, to
/// u; its transfer function is S - 1 = -L/(1 + L).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Matrices {
    /// Matrix A, row by row.
    pub a: Vec<Vec<f64>>,
    /// Column B.
    pub b: Vec<f64>,
    /// Row C.
    pub c: Vec<f64>,
}

/// Reason why a loop has no margins.
#[derive(Clone, Debug, PartialEq)]
pub enum MarginsError {
    /// The plant cannot be integrated.
    Solver(SolverError),
    /// A matrix entry is not finite.
    NoNumbers,
    /// The eigenvalues were not found.
    NoPoles,
    /// The margins contradict the poles of the loop.
    Contradicted(Margins),
}

/// Factor of the plant gain that counts as unlimited.
const BY_ANY: f64 = 100.0;

impl fmt::Display for MarginsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Solver(error) => error.fmt(f),
            Self::NoPoles => f.write_str("the poles of the loop were not found: the iteration came to no end"),
            Self::Contradicted(found) => write!(
                f,
                "no margins: those that were found (gain from {:.3e} to {:.3e}, peak of |S| {:.3e}) contradict the \
                 poles of the loop, which has numbers too far apart for f64; another period, or a time constant of the \
                 current loop that is 0 or nearer to the period, may tell",
                found.gain_down,
                found.gain_up.unwrap_or(f64::INFINITY),
                found.sensitivity_peak
            ),
            Self::NoNumbers => f.write_str("the loop has numbers that are too large for f64: no poles were found"),
        }
    }
}

impl std::error::Error for MarginsError {}

impl From<MarginsError> for Error {
    fn from(error: MarginsError) -> Self {
        Self::failed(error.to_string())
    }
}

/// Returns the margins of a scenario's loop at rest.
///
/// # Errors
/// The scenario has no loop at rest; the loop is unstable, or has no finite matrices.
pub fn margins(experiment: &Experiment) -> Result<Margins, Error> {
    margins_and_noise(experiment).map(|it| it.0)
}

/// Returns the margins of a scenario's loop at rest, and the rms of u from the noise of its sensors.
///
/// # Errors
/// As [`margins`].
pub fn margins_and_noise(experiment: &Experiment) -> Result<(Margins, f64), Error> {
    let at_rest = experiment.at_rest.as_ref()?;
    let it = Loop::of(at_rest, at_rest.law.as_ref(), experiment.period_s)?;
    if it.spectral_radius(1.0)? >= 1.0 {
        return Err(Error::failed("the loop at rest is unstable: it has no margins"));
    }
    Ok((it.margins()?, noise_of(&it.noise_gains(), at_rest)))
}

/// Plant under a constant u whose input is the acceleration of its first shaft by a load, rad/s².
struct Loaded<'a> {
    plant: &'a dyn Plant,
    u: f64,
}

impl Plant for Loaded<'_> {
    fn order(&self) -> usize {
        self.plant.order()
    }
    fn rhs(&self, t_s: f64, x: &[f64], load: f64, dx: &mut [f64]) {
        self.plant.rhs(t_s, x, self.u, dx);
        dx[1] += load;
    }
    fn lumped(&self, _: f64, _: &[f64], _: f64, d: &mut [f64]) {
        d.fill(0.0);
    }
    fn fastest_rad_s(&self, t_s: f64, x: &[f64], _: f64) -> f64 {
        self.plant.fastest_rad_s(t_s, x, self.u)
    }
    fn jumps_s(&self) -> &[f64] {
        self.plant.jumps_s()
    }
}

/// One tick as a map of the combined state, in the order of its fields.
pub(crate) struct Tick<'a> {
    plant: &'a LinearPlant,
    law: &'a LinearTick,
    sensed: Vec<usize>,
    sensor_delay: usize,
    actuator_delay: usize,
    /// Number of leading entries of the controller memory that are angles of the last sample.
    angles: usize,
}

/// Result of a tick.
pub(crate) struct Stepped {
    pub(crate) next: Vec<f64>,
    /// Controller demand and held output of the actuator.
    pub(crate) asked: f64,
    pub(crate) held: f64,
    /// Further outputs of the controller: [`Ticked::told`](loop_sim::linear::Ticked::told).
    pub(crate) told: Vec<f64>,
}

/// Returns Σ row[j] x[j].
fn dot(row: &[f64], x: &[f64]) -> f64 {
    row.iter().zip(x).map(|(a, b)| a * b).sum()
}

impl<'a> Tick<'a> {
    pub(crate) fn of(at_rest: &AtRest, plant: &'a LinearPlant, law: &'a LinearTick, is_by_count: bool) -> Self {
        let sensed: Vec<usize> = at_rest.sensed.iter().map(|sensed| sensed.state).collect();
        Self {
            plant,
            law,
            angles: if is_by_count { sensed.len() } else { 0 },
            sensed,
            sensor_delay: at_rest.sensor_delay_ticks,
            actuator_delay: at_rest.actuator_delay_ticks,
        }
    }

    pub(crate) fn order(&self) -> usize {
        self.plant.gamma.len() + self.law.c.len() + self.sensed.len() * self.sensor_delay + self.actuator_delay
    }

    /// Returns the state after a tick from rest with a demand of 1 in addition to the controller. It is held now or
    /// after the delay, and the controller receives the held value.
    pub(crate) fn asked_beside(&self) -> Vec<f64> {
        let order = self.order();
        if self.actuator_delay > 0 {
            // The newest demand in the delay queue.
            return (0..order).map(|i| f64::from(u8::from(i + 1 == order))).collect();
        }
        let mut next = self.step(&vec![0.0; order], 1.0, &vec![0.0; self.sensed.len()], true).next;
        let memory = self.plant.gamma.len()..;
        for (next, told) in next[memory].iter_mut().zip(&self.law.e).skip(self.angles) {
            *next += told;
        }
        next
    }

    /// Computes one tick. `v` replaces the held output at the plant input; in a closed loop `v` is added to it.
    pub(crate) fn step(&self, state: &[f64], v: f64, noise: &[f64], is_closed: bool) -> Stepped {
        let (x, rest) = state.split_at(self.plant.gamma.len());
        let (memory, rest) = rest.split_at(self.law.c.len());
        let (samples, demands) = rest.split_at(self.sensed.len() * self.sensor_delay);
        let now: Vec<f64> = self.sensed.iter().zip(noise).map(|(&i, noise)| x[i] + noise).collect();
        let mut memory = memory.to_vec();
        for (last, &i) in memory.iter_mut().zip(&self.sensed).take(self.angles) {
            *last = x[i] - *last;
        }
        let mut samples: Vec<f64> = samples.iter().chain(&now).copied().collect();
        let sample: Vec<f64> = samples.drain(..now.len()).collect();
        let of_tick = |c: &[f64], d: &[f64]| dot(c, &memory) + dot(d, &sample);
        let asked = of_tick(&self.law.c, &self.law.d);
        let told = self.law.told.iter().map(|[c, d]| of_tick(c, d)).collect();
        let mut demands: Vec<f64> = demands.iter().copied().chain([asked]).collect();
        let held = demands.remove(0);
        let mut next: Vec<f64> = (0..memory.len())
            .map(|i| dot(&self.law.a[i], &memory) + dot(&self.law.b[i], &sample) + self.law.e[i] * held)
            .collect();
        let felt = if is_closed { held + v } else { v };
        let x: Vec<f64> = (0..x.len()).map(|i| dot(&self.plant.phi[i], x) + self.plant.gamma[i] * felt).collect();
        for (last, &i) in next.iter_mut().zip(&self.sensed).take(self.angles) {
            *last = x[i] - *last;
        }
        Stepped { next: x.into_iter().chain(next).chain(samples).chain(demands).collect(), asked, held, told }
    }
}

impl Loop {
    /// Builds the loop of a scenario at rest with this controller, which may be another one for the same sample.
    ///
    /// # Errors
    /// The plant cannot be integrated, or the loop has no finite matrices.
    pub fn of(at_rest: &AtRest, law: &dyn LawAtRest, period_s: f64) -> Result<Self, MarginsError> {
        Self::with(at_rest, at_rest.plant.as_ref(), law, period_s)
    }

    /// Builds the loop with another plant.
    pub(crate) fn with(
        at_rest: &AtRest,
        plant: &dyn Plant,
        law: &dyn LawAtRest,
        period_s: f64,
    ) -> Result<Self, MarginsError> {
        let is_by_count = law.steps().iter().any(|step| *step > 0.0);
        let law = LinearTick::of(law, at_rest.report);
        let plant = LinearPlant::of(plant, law.u, period_s).map_err(MarginsError::Solver)?;
        let tick = Tick::of(at_rest, &plant, &law, is_by_count);
        Self::assembled(&tick, period_s)
    }

    fn assembled(tick: &Tick<'_>, period_s: f64) -> Result<Self, MarginsError> {
        let (order, sensors) = (tick.order(), tick.sensed.len());
        let unit = |n: usize, at: Option<usize>| -> Vec<f64> {
            (0..n).map(|i| if at == Some(i) { 1.0 } else { 0.0 }).collect()
        };
        let quiet = unit(sensors, None);
        let columns: Vec<[Stepped; 2]> = (0..order)
            .map(|j| [true, false].map(|is_closed| tick.step(&unit(order, Some(j)), 0.0, &quiet, is_closed)))
            .collect();
        let is_heard = |j: usize| columns[j][0].asked != 0.0 || columns[j][0].held != 0.0;
        let kept = heard(order, is_heard, |i, j| columns[j][0].next[i]);
        let n = kept.len();
        let matrix = |form: usize| DMatrix::from_fn(n, n, |i, j| columns[kept[j]][form].next[kept[i]]);
        let column = |state: &[f64]| DVector::from_iterator(n, kept.iter().map(|&i| state[i]));
        let noise = (0..sensors).map(|i| {
            let Stepped { next, asked, .. } = tick.step(&unit(order, None), 0.0, &unit(sensors, Some(i)), true);
            (column(&next), asked)
        });
        let (closed, open) = (matrix(0), matrix(1));
        if !closed.iter().chain(&open).all(|entry| entry.is_finite()) {
            return Err(MarginsError::NoNumbers);
        }
        let input = column(&tick.step(&unit(order, None), 1.0, &quiet, true).next);
        let held = DVector::from_iterator(n, kept.iter().map(|&j| columns[j][0].held));
        Ok(Self {
            period_s,
            closed,
            open: Response::of(open, &input, &held),
            noise: noise.collect(),
            asked: DVector::from_iterator(n, kept.iter().map(|&j| columns[j][0].asked)),
            input,
            held,
            kept,
        })
    }

    /// Returns the open and the closed loop as matrices.
    pub fn matrices(&self) -> [Matrices; 2] {
        let rows = |of: &DMatrix<f64>| of.row_iter().map(|row| row.iter().copied().collect()).collect();
        let all = |of: &DVector<f64>| of.iter().copied().collect::<Vec<_>>();
        let Response { a, b, c } = &self.open;
        // L is minus the response of u to v.
        let open = Matrices { a: rows(a), b: all(b), c: c.iter().map(|entry| -entry).collect() };
        [open, Matrices { a: rows(&self.closed), b: all(&self.input), c: all(&self.held) }]
    }

    /// Returns the eigenvalues of the closed loop, slowest (largest magnitude) first.
    ///
    /// # Errors
    /// [`MarginsError::NoNumbers`], [`MarginsError::NoPoles`].
    pub fn eigenvalues(&self) -> Result<Vec<Complex<f64>>, MarginsError> {
        eigenvalues(self.closed.clone())
    }

    /// Returns the spectral radius with the plant gain multiplied by `factor`: stable below 1.
    ///
    /// # Errors
    /// [`MarginsError::NoNumbers`], [`MarginsError::NoPoles`].
    pub fn spectral_radius(&self, factor: f64) -> Result<f64, MarginsError> {
        let scaled = &self.closed + &self.input * self.held.transpose() * (factor - 1.0);
        Ok(eigenvalues(scaled)?.first().map_or(0.0, Normed::norm))
    }

    /// Returns the poles of these eigenvalues without the pole of the offset, which decays independently of the loop.
    pub fn poles_beside(&self, values: Vec<Complex<f64>>, offset_per_s: f64) -> Vec<Root> {
        let offset = libm::exp(-offset_per_s * self.period_s);
        without_nearest(values, offset).into_iter().map(|z| self.pole(z)).collect()
    }

    /// Returns the continuous pole ln z/T.
    pub fn pole(&self, z: Complex<f64>) -> Root {
        let s = Complex::new(libm::log(z.norm()), libm::atan2(z.im, z.re)) / self.period_s;
        Root { re: s.re, im: s.im }
    }

    /// Returns L at a frequency up to the Nyquist rate, rad/s.
    pub fn gain(&self, omega_rad_s: f64) -> Complex<f64> {
        let phase = omega_rad_s * self.period_s;
        -self.open.at(Complex::new(libm::cos(phase), libm::sin(phase)))
    }

    /// Returns the margins of a stable loop.
    ///
    /// # Errors
    /// [`MarginsError::NoNumbers`], [`MarginsError::NoPoles`].
    pub fn margins(&self) -> Result<Margins, MarginsError> {
        let mut found = Margins {
            crossover_rad_s: None,
            phase_deg: None,
            phase_rad_s: None,
            delay_s: None,
            gain_up: None,
            gain_down: 0.0,
            sensitivity_peak: 0.0,
            peak_rad_s: 0.0,
        };
        let grid = self.frequencies()?;
        let gains: Vec<Complex<f64>> = grid.iter().map(|&omega| self.gain(omega)).collect();
        for k in 1..grid.len() {
            let (ends, [from, to]) = ([grid[k - 1], grid[k]], [gains[k - 1], gains[k]]);
            if (from.norm() > 1.0) != (to.norm() > 1.0) {
                let omega = self.crossing(ends, |l| l.norm() - 1.0);
                found.crosses_one(omega, self.gain(omega));
            }
            if (from.im > 0.0) != (to.im > 0.0) {
                let omega = self.crossing(ends, |l| l.im);
                found.critical(-self.gain(omega).re);
            }
        }
        // At both ends of the circle L is real, so no sign change shows a crossing.
        for end in [0.0, PI / self.period_s] {
            found.critical(-self.gain(end).re);
        }
        let sensitivity = |l: Complex<f64>| -> f64 { 1.0 / (l + 1.0).norm() };
        let peaks = (0..grid.len()).max_by(|&i, &j| sensitivity(gains[i]).total_cmp(&sensitivity(gains[j])));
        if let Some(k) = peaks {
            let (mut low, mut high) = (grid[k.saturating_sub(1)], grid[(k + 1).min(grid.len() - 1)]);
            for _ in 0..60 {
                let [left, right] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
                if sensitivity(self.gain(left)) < sensitivity(self.gain(right)) { low = left } else { high = right }
            }
            found.peak_rad_s = 0.5 * (low + high);
            found.sensitivity_peak = sensitivity(self.gain(found.peak_rad_s));
        }
        self.check(&found)?;
        Ok(found)
    }

    /// Returns the largest |angle| of the first shaft after a step of its acceleration by 1 rad/s², for a stable loop
    /// whose first states are the angle and the speed of this shaft.
    ///
    /// # Errors
    /// The plant cannot be integrated.
    pub(crate) fn deflection(&self, at_rest: &AtRest, law: &dyn LawAtRest) -> Result<f64, MarginsError> {
        const MOST: usize = 100_000;
        let loaded = Loaded { plant: at_rest.plant.as_ref(), u: law.rest().1 };
        let is_by_count = law.steps().iter().any(|step| *step > 0.0);
        let law = LinearTick::of(law, at_rest.report);
        let plant = LinearPlant::of(&loaded, 0.0, self.period_s).map_err(MarginsError::Solver)?;
        let tick = Tick::of(at_rest, &plant, &law, is_by_count);
        let next = tick.step(&vec![0.0; tick.order()], 1.0, &vec![0.0; tick.sensed.len()], false).next;
        let load = DVector::from_iterator(self.kept.len(), self.kept.iter().map(|&i| next[i]));
        let (mut state, mut next, mut largest) = (DVector::zeros(load.len()), load.clone(), 0.0_f64);
        for k in 0..MOST {
            self.closed.mul_to(&state, &mut next);
            next += &load;
            std::mem::swap(&mut state, &mut next);
            let moved = state.iter().zip(&next).fold(0.0, |most, (now, then)| f64::max(most, (now - then).abs()));
            let is_settled = k > 100 && moved <= 1e-9 * state.amax();
            largest = largest.max(state[0].abs());
            if is_settled {
                break;
            }
        }
        Ok(largest)
    }

    /// Checks the margins of a stable loop against its poles. S is 1 far outside of the circle and has no pole there,
    /// so its peak on the circle is at least 1. Within the gain margins all poles are inside the circle; beyond them
    /// one is outside. Poles come from the closed-loop matrix and margins from the open-loop matrix. A contradiction
    /// means that the loop is too badly conditioned for f64.
    fn check(&self, found: &Margins) -> Result<(), MarginsError> {
        const ABOUT: f64 = 1e-6;
        let (low, high) = (found.gain_down, found.gain_up);
        let within = [0.5 * (low + 1.0), high.map_or(BY_ANY, |high| 0.5 * (1.0 + high))];
        // At a gain close to 0 only the integrator is left.
        let beyond = [Some(0.99 * low).filter(|low| *low > 1e-3), high.map(|high| 1.01 * high)];
        let mut is_right = found.sensitivity_peak > 1.0 - ABOUT;
        for factor in within {
            is_right &= self.spectral_radius(factor)? < 1.0 + ABOUT;
        }
        for factor in beyond.into_iter().flatten() {
            is_right &= self.spectral_radius(factor)? > 1.0 - ABOUT;
        }
        if is_right { Ok(()) } else { Err(MarginsError::Contradicted(*found)) }
    }

    /// Returns the frequency between two others at which a function of L changes its sign.
    fn crossing(&self, [mut low, mut high]: [f64; 2], of: impl Fn(Complex<f64>) -> f64) -> f64 {
        let is_above = of(self.gain(low)) > 0.0;
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if (of(self.gain(middle)) > 0.0) == is_above { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Returns a frequency grid from below the slowest pole to the Nyquist rate. It is denser around every pole,
    /// because a resonance is as narrow as its pole is close to the circle.
    fn frequencies(&self) -> Result<Vec<f64>, MarginsError> {
        const SPACED: i32 = 400;
        let nyquist = PI / self.period_s;
        let mut poles: Vec<Root> = eigenvalues(self.open.a.clone())?.into_iter().map(|z| self.pole(z)).collect();
        poles.extend(self.eigenvalues()?.into_iter().map(|z| self.pole(z)));
        let sizes = poles.iter().map(|pole| libm::hypot(pole.re, pole.im)).filter(|size| *size > 1e-9 * nyquist);
        let lowest = 0.03 * sizes.fold(0.1 * nyquist, f64::min);
        let ratio = libm::log(nyquist / lowest) / f64::from(SPACED - 1);
        let mut grid: Vec<f64> = (0..SPACED).map(|k| nyquist * libm::exp(-ratio * f64::from(k))).collect();
        for Root { re, im } in poles.into_iter().filter(|pole| pole.im > 0.0) {
            grid.extend((-8..=8).map(|k| im + 0.5 * f64::from(k) * re.abs().max(1e-6 * im)));
        }
        grid.retain(|omega| (lowest..=nyquist).contains(omega));
        grid.sort_by(f64::total_cmp);
        Ok(grid)
    }

    /// Returns the rms of u per rms of white noise on each sensor, for a stable loop.
    pub fn noise_gains(&self) -> Vec<f64> {
        let gain = |(input, direct): &(DVector<f64>, f64)| {
            let mut sum = input * input.transpose();
            let mut power = self.closed.clone();
            // Every iteration doubles the number of terms; 2^60 terms are always enough.
            for _ in 0..60 {
                let more = &power * &sum * power.transpose();
                if more.amax() <= f64::EPSILON * sum.amax() {
                    break;
                }
                sum += more;
                power = &power * &power;
            }
            (self.asked.dot(&(&sum * &self.asked)) + direct * direct).max(0.0).sqrt()
        };
        self.noise.iter().map(gain).collect()
    }
}

/// Returns the rms of u from all sensors, by [`Loop::noise_gains`].
pub(crate) fn noise_of(noise_gains: &[f64], at_rest: &AtRest) -> f64 {
    let parts = noise_gains.iter().zip(&at_rest.sensed).map(|(gain, sensed)| gain * sensed.rms);
    parts.map(|part| part * part).sum::<f64>().sqrt()
}

/// Returns the decay rate of the slowest of these poles, 1/s; negative if one grows.
pub fn decay_per_s(poles: &[Root]) -> f64 {
    poles.iter().map(|pole| -pole.re).fold(f64::INFINITY, f64::min)
}

/// Returns the decay rate α of the offset W, 1/s; 0 for a controller without an offset.
pub fn offset_per_s(experiment: &Experiment) -> f64 {
    match (&experiment.drive, &experiment.spec) {
        (Some(drive), _) => drive.designed.bandwidths().offset_per_s,
        (None, Some(spec)) => spec.config.padded.surface.alpha_per_s,
        (None, None) => 0.0,
    }
}

/// Corner of a scenario with an unstable loop.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnstableCorner {
    /// Deviations of the plant in this corner.
    pub name: String,
    /// Spectral radius of the closed loop in this corner.
    pub spectral_radius: f64,
}

/// Oscillatory pole with the least damping, over some plants.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeastDamped {
    /// Deviations of the plant in the corner; empty for the plant of the file.
    pub corner: String,
    /// Damping ratio -Re(s)/|s| of the pole s = ln(z)/T; negative for a growing oscillation.
    pub damping_ratio: f64,
    /// Natural frequency |s| of the pole, rad/s.
    pub frequency_rad_s: f64,
}

impl LeastDamped {
    /// Returns the least damped of these poles. `None` if no pole oscillates for longer than a tick.
    pub(crate) fn of(corner: &str, poles: impl IntoIterator<Item = Root>, period_s: f64) -> Option<Self> {
        let damped = |pole: Root| {
            let frequency_rad_s = libm::hypot(pole.re, pole.im);
            let damping_ratio = -pole.re / frequency_rad_s;
            Self { corner: corner.into(), damping_ratio, frequency_rad_s }
        };
        let slow = poles.into_iter().filter(|pole| pole.im > 0.0 && pole.re * period_s > -1.0);
        slow.map(damped).reduce(Self::lesser)
    }

    pub(crate) fn lesser(self, other: Self) -> Self {
        if other.damping_ratio < self.damping_ratio { other } else { self }
    }
}

/// Returns the corners of a scenario whose loop with this controller is unstable, worst first, and the pole with the
/// least damping in a corner; `None` if no pole oscillates.
///
/// # Errors
/// A corner cannot be integrated, or has no finite matrices.
pub fn corners(
    at_rest: &AtRest,
    law: &dyn LawAtRest,
    period_s: f64,
) -> Result<(Vec<UnstableCorner>, Option<LeastDamped>), MarginsError> {
    let mut unstable = Vec::new();
    let mut damped = Vec::new();
    for Corner { name, plant } in &at_rest.corners {
        let it = Loop::with(at_rest, plant.as_ref(), law, period_s)?;
        let values = it.eigenvalues()?;
        let spectral_radius = values.first().map_or(0.0, |z| libm::hypot(z.re, z.im));
        if spectral_radius >= 1.0 {
            unstable.push(UnstableCorner { name: name.clone(), spectral_radius });
        }
        damped.extend(LeastDamped::of(name, values.into_iter().map(|z| it.pole(z)), period_s));
    }
    unstable.sort_by(|a, b| b.spectral_radius.total_cmp(&a.spectral_radius));
    Ok((unstable, damped.into_iter().reduce(LeastDamped::lesser)))
}

/// Returns the unstable corners of [`corners`].
///
/// # Errors
/// A corner cannot be integrated, or has no finite matrices.
pub fn unstable_corners(
    at_rest: &AtRest,
    law: &dyn LawAtRest,
    period_s: f64,
) -> Result<Vec<UnstableCorner>, MarginsError> {
    Ok(corners(at_rest, law, period_s)?.0)
}

/// Returns the spectral radius of an unstable loop at rest, 1 or more. Returns `None` for a stable loop and for a loop
/// without matrices.
pub fn growth(experiment: &Experiment) -> Option<f64> {
    let at_rest = experiment.at_rest.as_ref().ok()?;
    let at_rest = Loop::of(at_rest, at_rest.law.as_ref(), experiment.period_s);
    at_rest.and_then(|it| it.spectral_radius(1.0)).ok().filter(|radius| *radius >= 1.0)
}

/// Returns warnings for this loop: it is unstable, or unstable within its declared uncertainty. A loop without matrices
/// has no warnings.
pub fn warnings(experiment: &Experiment) -> Vec<String> {
    let Ok(at_rest) = &experiment.at_rest else { return Vec::new() };
    let (law, period_s) = (at_rest.law.as_ref(), experiment.period_s);
    if let Some(radius) = growth(experiment) {
        return vec![format!(
            "UNSTABLE: the linearised loop has a spectral radius of {radius:.6} per tick; details: host-sim design"
        )];
    }
    let unstable = unstable_corners(at_rest, law, period_s).unwrap_or_default();
    let Some(worst) = unstable.first() else { return unstable_when_fast(experiment, at_rest).into_iter().collect() };
    let known = if at_rest.inertia_range.is_some() { "the range of the inertia" } else { "drive.uncertain_percent" };
    vec![format!(
        "unstable in {} of {} corners of {known}, worst with {} (spectral radius {:.6} per tick); details: host-sim \
         design",
        unstable.len(),
        at_rest.corners.len(),
        worst.name,
        worst.spectral_radius
    )]
}

/// Returns a warning if the high gains of a motor are unstable in the worst corner when they stay active.
fn unstable_when_fast(experiment: &Experiment, at_rest: &AtRest) -> Option<String> {
    let designed = experiment.drive.as_ref().map(|drive| drive.designed)?;
    if !matches!(designed, DriveDesign::Motor(_)) {
        return None;
    }
    let law = fast(&designed)?.at_rest().ok()?.law;
    let unstable = unstable_corners(at_rest, law.as_ref(), experiment.period_s).ok()?;
    let worst = unstable.first()?;
    Some(format!(
        "the high gains would be unstable if they stayed on, with {}: take drive.gain_sets = 1, a smaller \
         drive.fast_ratio or a slower drive; details: host-sim design",
        worst.name
    ))
}

impl Margins {
    /// Processes a crossing of |L| = 1.
    fn crosses_one(&mut self, omega: f64, l: Complex<f64>) {
        // Measured counter-clockwise from -180 degrees: the tolerated lag is up to a whole turn.
        let phase = libm::atan2(-l.im, -l.re);
        let lag = if phase < 0.0 { phase + 2.0 * PI } else { phase };
        let least = |known: Option<f64>, value: f64| Some(known.map_or(value, |known| known.min(value)));
        self.crossover_rad_s = Some(self.crossover_rad_s.map_or(omega, |known| known.max(omega)));
        let phase_deg = phase.abs().to_degrees();
        if self.phase_deg.is_none_or(|known| phase_deg < known) {
            (self.phase_deg, self.phase_rad_s) = (Some(phase_deg), Some(omega));
        }
        self.delay_s = least(self.delay_s, lag / omega);
    }

    /// Processes a crossing of the negative real axis at -`size`.
    fn critical(&mut self, size: f64) {
        if size > 0.0 && size < 1.0 {
            let factor = 1.0 / size;
            self.gain_up = Some(self.gain_up.map_or(factor, |known| known.min(factor)));
        } else if size >= 1.0 {
            self.gain_down = self.gain_down.max(1.0 / size);
        }
    }
}

/// c (z I - A)^-1 b with A as a Hessenberg matrix, so that the cost per z is quadratic in the order.
#[derive(Clone, Debug)]
struct Response {
    a: DMatrix<f64>,
    b: DVector<f64>,
    c: DVector<f64>,
}

impl Response {
    fn of(a: DMatrix<f64>, b: &DVector<f64>, c: &DVector<f64>) -> Self {
        let n = a.nrows();
        if n < 2 {
            return Self { a, b: b.clone(), c: c.clone() };
        }
        // The states have different units, and an orthogonal transform would mix large and small numbers. Input and
        // output are balanced too. Otherwise a state that is weakly driven from within, such as the current of a fast
        // loop, gets no useful scale.
        let mut all = DMatrix::zeros(n + 1, n + 1);
        all.view_mut((0, 0), (n, n)).copy_from(&a);
        all.view_mut((0, n), (n, 1)).copy_from(b);
        all.view_mut((n, 0), (1, n)).copy_from(&c.transpose());
        balance_parlett_reinsch(&mut all);
        let (q, a) = Hessenberg::new(all.view((0, 0), (n, n)).into_owned()).unpack();
        let b = DVector::from_fn(n, |i, _| all[(i, n)]);
        let c = DVector::from_fn(n, |i, _| all[(n, i)]);
        Self { b: q.tr_mul(&b), c: q.tr_mul(&c), a }
    }

    fn at(&self, z: Complex<f64>) -> Complex<f64> {
        let n = self.b.len();
        // z I - A beside b, row by row. Below the diagonal a row has one entry; the zeros before it are never read.
        let width = n + 1;
        let mut rows = vec![Complex::from(0.0); n * width];
        for (i, row) in rows.chunks_exact_mut(width).enumerate() {
            for j in i.saturating_sub(1)..n {
                row[j] = if i == j { z - self.a[(i, j)] } else { Complex::from(-self.a[(i, j)]) };
            }
            row[n] = Complex::from(self.b[i]);
        }
        for k in 1..n {
            let (above, row) = rows[(k - 1) * width..(k + 1) * width].split_at_mut(width);
            if row[k - 1].norm_sqr() > above[k - 1].norm_sqr() {
                above[k - 1..].swap_with_slice(&mut row[k - 1..]);
            }
            if above[k - 1] != Complex::from(0.0) {
                let factor = row[k - 1] / above[k - 1];
                for (entry, pivot) in row[k..].iter_mut().zip(&above[k..]) {
                    *entry -= factor * pivot;
                }
            }
        }
        let mut sum = Complex::from(0.0);
        let mut x = vec![Complex::from(0.0); n];
        for i in (0..n).rev() {
            let row = &rows[i * width..(i + 1) * width];
            let known: Complex<f64> = (i + 1..n).map(|j| row[j] * x[j]).sum();
            x[i] = (row[n] - known) / row[i];
            sum += x[i] * self.c[i];
        }
        // The frequency is a pole, such as an integrator at ω = 0.
        if sum.re.is_finite() && sum.im.is_finite() { sum } else { Complex::new(f64::INFINITY, 0.0) }
    }
}

/// Returns the states that affect an output, directly or through other states; `entry` is the matrix of the next
/// values.
pub(crate) fn heard(order: usize, at_once: impl Fn(usize) -> bool, entry: impl Fn(usize, usize) -> f64) -> Vec<usize> {
    let mut has_part: Vec<bool> = (0..order).map(at_once).collect();
    loop {
        let reaches = |j: usize| (0..order).any(|i| has_part[i] && entry(i, j) != 0.0);
        let more: Vec<bool> = (0..order).map(|j| has_part[j] || reaches(j)).collect();
        if more == has_part {
            return (0..order).filter(|&j| has_part[j]).collect();
        }
        has_part = more;
    }
}

/// Returns the eigenvalues without the one nearest to a real pole.
pub(crate) fn without_nearest(mut values: Vec<Complex<f64>>, pole: f64) -> Vec<Complex<f64>> {
    let away = |k: &usize| libm::hypot(values[*k].re - pole, values[*k].im);
    if let Some(nearest) = (0..values.len()).min_by(|i, j| away(i).total_cmp(&away(j))) {
        values.remove(nearest);
    }
    values
}

/// Returns the eigenvalues of a matrix, largest magnitude first.
pub(crate) fn eigenvalues(mut matrix: DMatrix<f64>) -> Result<Vec<Complex<f64>>, MarginsError> {
    if matrix.nrows() == 0 {
        return Ok(Vec::new());
    }
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return Err(MarginsError::NoNumbers);
    }
    // The states have different units; without balancing the small ones lose digits.
    balance_parlett_reinsch(&mut matrix);
    let schur = |matrix: DMatrix<f64>| Schur::try_new(matrix, f64::EPSILON, 10_000);
    // The QR iteration fails to converge for about one in 10 000 harmless matrices; their transpose then converges.
    let schur = schur(matrix.clone()).or_else(|| schur(matrix.transpose())).ok_or(MarginsError::NoPoles)?;
    let mut found: Vec<_> = schur.complex_eigenvalues().iter().copied().collect();
    found.sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
    Ok(found)
}
