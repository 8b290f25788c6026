//! Baseline controllers for the comparison: textbook controllers on the same counts, with the same feed-forward as
//! edo-smc.
//!
//! All of them except the cascades consist of an observer and a state feedback. Φ and Γ of one tick are exact:
//!
//! $$ \hat\xi^- = F \hat\xi + G u + H \bar w, \qquad \hat\xi = \hat\xi^- + L (y - C \hat\xi^-), \qquad
//!    \xi = (x, d) $$
//! $$ u = u_\text{ff} + N \hat d - K (\hat x - x_r - \Pi \hat d) - k_i \zeta $$
//!
//! w is defined in [`Model::pushes`]. Π and N solve the regulator equations (Francis 1977). They describe the rest of
//! the plant under d with its output on the reference: $\Phi \Pi + \Gamma N + E = \Pi S$, $C_1 \Pi = 0$.
//!
//! | controller | observer | feedback |
//! |---|---|---|
//! | LQG | Kalman filter, per encoder d and d' by noise | LQ: minimum of σ² + ρ u², σ the surface (s + w)^(n-1) |
//! | LQI | Kalman filter without disturbances | LQ with ζ, the integral of the error |
//! | ADRC | per encoder q, q', d with a triple pole (Gao 2003), the model known | all poles at w |
//! | super-twisting | as ADRC | surface (s + w)^(n-1) and the controller of Levant (1993), its root implicit in time |
//! | P-PI | none | P on the output's error, PI on the motor's, differenced and filtered; of a joint the spring too |
//! | P-PI, notch | none | of a joint: P on motor and link, PI on the motor, a notch before the current |
//!
//! The Kalman filter assumes quantisation noise of variance 1/12 counts² and a plant whose states are random walks.
//! With k states per encoder the j-th has a variance of $\beta \binom{k}{j} (\omega T)^{2j}/12$ counts² per tick, the
//! last one without β. The poles of the filter are then about ω, on a circle for β = 0 (Butterworth), in one place for
//! β = 1. ω and β are tuned.
//!
//! Anti-windup equals edo-smc: the observer receives the held current. ζ and the integral of the PI stop while u
//! exceeds its limits. With a tick of delay the estimates are predicted by one tick from the pending u.
//!
//! Both cascades are one controller. With the errors $e_m$ and $e_l$ of motor and link behind the gear, low-pass
//! filters D and F of the first order, and a notch N,
//!
//! $$ e = e_m + F (e_l - e_m), \qquad \sigma = D \dot e_m + k_p e, \qquad
//!    u = u_\text{ff} + N \frac{k_v}{b} \Big( \sigma + k_t (e_m - e_l) + k_i \int \sigma \Big) $$
//!
//! P-PI has F = N = 1, and b of the motor alone. It needs feedback of the spring. Without it, P on the link alone gives
//! $s^3 + b_1 s^2 + k_1 s + k_p k_1$ even with an infinitely fast speed loop of the motor. This polynomial is unstable
//! for any joint with little damping.
//!
//! P-PI with a notch is the usual servo drive solution for a resonance: $k_t = 0$, b of both shafts together, speed of
//! the motor, and dual feedback of the position. The motor position acts above the crossover F and the link position
//! below it. So the link reaches its target, and the position loop does not drive its oscillation. The notch acts on
//! the feedback only; the feed-forward already contains the spring. The notch is discretised by Tustin's rule,
//! prewarped at its centre:
//!
//! $$ N(s) = \frac{s^2 + \omega^2}{s^2 + 2 \zeta \omega s + \omega^2}, \qquad
//!    s \to \frac{\omega}{\kappa} \thinspace \frac{z - 1}{z + 1}, \qquad
//!    N(z) = \frac{(1 + \kappa^2)(z^2 + 1) + 2 (\kappa^2 - 1) z}
//!    {(1 + 2 \zeta \kappa + \kappa^2) z^2 + 2 (\kappa^2 - 1) z + 1 - 2 \zeta \kappa + \kappa^2}, \qquad
//!    \kappa = \tan \frac{\omega T}{2} $$
//!
//! The width ζ may become so small that the notch vanishes, so the search can omit it.
//!
//! A baseline controller has its state in f64 and angles from an unbounded count, so rounding does not affect it.
//! edo-smc runs in f32.

use std::sync::Arc;

use controller_core::{Health, MAX_R};
use loop_sim::MAX_ORDER;
use loop_sim::port::{ControllerPort, PortError, Tick};

use super::Knob;
use super::cascade::{self, Gains};
use super::matrix::{Matrix, ackermann, held, kalman, regulator};
use super::task::{Aim, Angles, Model, Task};

/// Indices of the controller memory. This one is the held value after a tick.
pub(super) const HELD: usize = 0;
/// With a delay: the next held value; the later ones are at the end of the memory.
const QUEUED: usize = 1;
/// 1 while u exceeds its limits.
pub(super) const BEYOND: usize = 2;
/// Integral: ζ, the integral of the twisting, or the integral of the PI.
pub(super) const INTEGRAL: usize = 3;
/// w at the last tick; for a cascade the last error and the filter.
pub(super) const LAST: usize = 4;
/// ξ; for a cascade its further states.
pub(super) const ESTIMATE: usize = 6;

/// Inputs of a controller in a tick.
pub(super) struct TickInputs<'a> {
    pub(super) y: [f64; 2],
    /// Reference at this tick.
    pub(super) now: &'a Aim,
    /// Reference at the tick from which u is held.
    pub(super) then: &'a Aim,
    /// Ticks from the computation of u until it is held.
    pub(super) late: usize,
}

/// Returns the memory indices of the pending u, the next one first.
fn queue(memory: &[f64], late: usize) -> impl DoubleEndedIterator<Item = usize> + use<> {
    let more = late.saturating_sub(1);
    (0..late.min(1)).map(|_| QUEUED).chain(memory.len() - more..memory.len())
}

/// Designed controller without its memory.
#[derive(Clone, Debug)]
pub(super) enum Law {
    Feedback(Box<Feedback>),
    Cascade { model: Arc<Model>, limit: f64, gains: Gains },
}

#[derive(Clone, Debug)]
pub(super) struct Feedback {
    model: Arc<Model>,
    limit: f64,
    is_cut: bool,
    f: Matrix,
    g: Matrix,
    h: Matrix,
    l: Matrix,
    /// Gains on (x - x_r, d): -K and N + K Π.
    on_state: Vec<f64>,
    on_disturbance: Vec<f64>,
    k_i: f64,
    twist: Option<Twist>,
}

/// Surface s = S (x - x_r - Π d), S Γ = 1.
#[derive(Clone, Debug)]
struct Twist {
    on_state: Vec<f64>,
    on_disturbance: Vec<f64>,
    /// Gains per tick: T k_1, T² k_2.
    root: f64,
    step: f64,
}

/// Adds M x to y.
fn add(y: &mut [f64], m: &Matrix, x: &[f64]) {
    for (column, x) in m.column_iter().zip(x) {
        for (y, entry) in y.iter_mut().zip(column.iter()) {
            *y += entry * x;
        }
    }
}

fn dot(row: &[f64], x: &[f64]) -> f64 {
    row.iter().zip(x).map(|(a, b)| a * b).sum()
}

impl Law {
    /// Returns the memory before the first tick of a controller with this delay in ticks.
    pub(super) fn started(&self, y: &[f64; 2], aim: &Aim, late: usize) -> Vec<f64> {
        let mut memory = match self {
            Self::Feedback(law) => {
                let mut memory = vec![0.0; ESTIMATE + law.f.nrows()];
                memory[LAST..ESTIMATE].copy_from_slice(&law.model.pushes(y, law.is_cut));
                for i in 0..law.model.encoders() {
                    memory[ESTIMATE + 2 * i] = y[i];
                }
                memory
            }
            Self::Cascade { model, .. } => {
                let mut memory = vec![0.0; ESTIMATE + cascade::MORE];
                let error = cascade::motor_error(model, y, aim);
                (memory[LAST], memory[ESTIMATE]) = (error, error - (aim.x[0] - y[0]));
                memory
            }
        };
        memory.resize(memory.len() + late.saturating_sub(1), 0.0);
        memory
    }

    /// Computes one tick.
    pub(super) fn tick(&self, memory: &mut [f64], inputs: &TickInputs<'_>, is_first: bool) -> f64 {
        let (u, limit) = match self {
            Self::Feedback(law) => (law.tick(memory, inputs, is_first), law.limit),
            Self::Cascade { model, limit, gains } => (cascade::tick(model, gains, memory, inputs), *limit),
        };
        memory[BEYOND] = f64::from(u8::from(u.abs() > limit));
        let limited = u.clamp(-limit, limit);
        memory[HELD] = limited;
        for queued in queue(memory, inputs.late).rev() {
            memory.swap(HELD, queued);
        }
        u
    }

    /// Returns whether the controller is linear except for gravity.
    pub(super) fn is_linear(&self) -> bool {
        !matches!(self, Self::Feedback(law) if law.twist.is_some())
    }
}

impl Feedback {
    fn predicted(&self, xi: &[f64], u: f64, w: &[f64; 2]) -> Vec<f64> {
        let mut next = vec![0.0; xi.len()];
        add(&mut next, &self.f, xi);
        add(&mut next, &self.g, &[u]);
        add(&mut next, &self.h, w);
        next
    }

    fn tick(&self, memory: &mut [f64], inputs: &TickInputs<'_>, is_first: bool) -> f64 {
        let (order, encoders) = (self.model.order(), self.model.encoders());
        let estimate = ESTIMATE..ESTIMATE + self.f.nrows();
        let w = self.model.pushes(&inputs.y, self.is_cut);
        let before = [memory[LAST], memory[LAST + 1]];
        if !is_first {
            let mean = [0, 1].map(|i| 0.5 * (before[i] + w[i]));
            let mut xi = self.predicted(&memory[estimate.clone()], memory[HELD], &mean);
            let e = [0, 1].map(|i| if i < encoders { inputs.y[i] - xi[2 * i] } else { 0.0 });
            add(&mut xi, &self.l, &e[..encoders]);
            memory[estimate.clone()].copy_from_slice(&xi);
        }
        memory[LAST..ESTIMATE].copy_from_slice(&w);
        let mut ahead;
        let mut xi = &memory[estimate];
        for (tick, queued) in queue(memory, inputs.late).enumerate() {
            let from_now = tick as f64 + 0.5;
            let growing = if is_first { w } else { [0, 1].map(|i| w[i] + from_now * (w[i] - before[i])) };
            ahead = self.predicted(xi, memory[queued], &growing);
            xi = &ahead;
        }
        let mut off = [0.0; 4];
        for i in 0..order {
            off[i] = xi[i] - inputs.then.x[i];
        }
        let mut u = inputs.then.feed + dot(&self.on_state, &off) + dot(&self.on_disturbance, &xi[order..]);
        if let Some(twist) = &self.twist {
            let s = dot(&twist.on_state, &off) + dot(&twist.on_disturbance, &xi[order..]);
            let (more, eta) = twist.move_of(s, memory[INTEGRAL]);
            u += more;
            if u.abs() <= self.limit {
                memory[INTEGRAL] = eta;
            }
        } else if self.k_i != 0.0 {
            if memory[BEYOND] < 0.5 {
                memory[INTEGRAL] += self.model.period_s * (inputs.y[0] - inputs.now.x[0]);
            }
            u -= self.k_i * memory[INTEGRAL];
        }
        u
    }
}

impl Twist {
    /// Returns the change of s within the tick and the integral after it, both in units of s. The root is taken at the
    /// end of the tick, and the sign is softened where a tick would overshoot. Neither term chatters.
    fn move_of(&self, s: f64, eta: f64) -> (f64, f64) {
        let root = -0.5 * self.root + libm::sqrt(0.25 * self.root * self.root + s.abs());
        let after = root * root * s.signum();
        (after - s + eta, eta - (0.5 * s).clamp(-self.step, self.step))
    }
}

/// Kind of baseline controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BaselineKind {
    Lqg,
    Lqi,
    Adrc,
    SuperTwisting,
    Cascade,
    Notch,
}

impl BaselineKind {
    const ALL: [Self; 6] = [Self::Lqg, Self::Lqi, Self::Adrc, Self::SuperTwisting, Self::Cascade, Self::Notch];

    /// Returns the kinds for this number of encoders: a motor has no resonance for a notch.
    pub(super) fn all(encoders: usize) -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(move |kind| encoders > 1 || *kind != Self::Notch)
    }

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Lqg => "LQG, disturbance states",
            Self::Lqi => "LQI",
            Self::Adrc => "ADRC with model",
            Self::SuperTwisting => "super-twisting",
            Self::Cascade => "P-PI",
            Self::Notch => "P-PI, notch",
        }
    }

    /// Returns the disturbance states per encoder, where edo-smc has `ours`.
    const fn disturbances(self, ours: usize) -> usize {
        match self {
            Self::Lqg => ours,
            Self::Lqi | Self::Cascade | Self::Notch => 0,
            Self::Adrc | Self::SuperTwisting => 1,
        }
    }

    /// Returns the tuning parameters with initial guesses from the bandwidths of this drive: the error bandwidth, or a
    /// slower observer. For a coupled joint the guesses come from both poles of the error and from the observers. For a
    /// notch they come from the data sheet.
    pub(super) fn knobs(self, task: &Task) -> Vec<Knob> {
        let designed = &task.designed;
        let w = designed.bandwidths();
        let is_whole = designed.is_whole();
        let slow = if is_whole {
            libm::sqrt(w.surface_rad_s * w.reaching_per_s)
        } else {
            w.observers_rad_s.iter().map(|own| own / 0.75).fold(w.surface_rad_s, f64::min)
        };
        // On a shaft that is stiff below its resonance the LQ design then has poles near the resonance.
        let reaching = if is_whole { task.model.resonances_rad_s()[1].powi(2) / slow } else { 5.0 * slow };
        let knob = |name, guess: f64| Knob { name, low: guess / 8.0, high: guess * 8.0, guess };
        let [observers, cascade] = crate::kind::DriveKind::of(designed).rivals;
        let observer = |(&(name, times), own): (&(&'static str, f64), &f64)| {
            knob(name, if is_whole { *own } else { times * slow })
        };
        let observers = observers.iter().zip(&w.observers_rad_s).map(observer);
        let own: &[Knob] = match self {
            Self::Lqg | Self::Lqi => &[
                knob("surface (rad/s)", slow),
                knob("reaching (1/s)", reaching),
                Knob { name: "damping of the filter", low: 0.05, high: 2.0, guess: 0.5 },
            ],
            Self::Adrc => &[knob("poles (rad/s)", 1.5 * slow)],
            Self::SuperTwisting => &[
                knob("surface (rad/s)", slow),
                Knob { name: "disturbance's rate (A/s)", low: 0.3, high: 3e4, guess: 100.0 },
            ],
            Self::Notch => return cascade::notch_knobs(task),
            Self::Cascade => {
                return cascade.iter().map(|(name, times)| knob(*name, times * slow)).collect();
            }
        };
        own.iter().copied().chain(observers).collect()
    }

    /// Returns the controller with these parameters; `None` if there is none.
    pub(super) fn law(self, task: &Task, knobs: &[f64]) -> Option<Law> {
        let (model, limit) = (&task.model, task.max_current_a());
        let t = model.period_s;
        let gains = match self {
            Self::Cascade => Some(Gains::new(model, knobs)?),
            Self::Notch => Some(Gains::notched(model, knobs)?),
            _ => None,
        };
        if let Some(gains) = gains {
            return Some(Law::Cascade { model: model.clone(), limit, gains });
        }
        let order = model.order();
        let (own, observer) = knobs.split_at(knobs.len() - model.encoders());
        let is_cut = matches!(self, Self::Adrc | Self::SuperTwisting);
        let per_encoder = self.disturbances(task.designed.form().observer_states - 2);
        let seen = Seen::new(model, per_encoder, is_cut);
        let encoders: Vec<_> = task.designed.encoders();
        let unit_rad: Vec<f64> = encoders.iter().map(|(_, mounted)| mounted.encoder.unit_rad()).collect();
        let l =
            if is_cut { seen.placed(observer, t)? } else { seen.filtered(&unit_rad, own[own.len() - 1], observer, t)? };

        let (phi, gamma) = held(&model.a, &model.b, t);
        let whole = Seen::new(model, per_encoder, false);
        let (pi, n) = whole.rests()?;
        let surface = || ackermann(&phi, &gamma, &vec![libm::exp(-own[0] * t); order - 1]);
        let (k, k_i, twist) = match self {
            Self::Lqg | Self::Cascade | Self::Notch => {
                (quadratic(model, &phi, &gamma, own[0], own[1], false)?.0, 0.0, None)
            }
            Self::Lqi => {
                let (k, k_i) = quadratic(model, &phi, &gamma, own[0], own[1], true)?;
                (k, k_i, None)
            }
            Self::Adrc => (ackermann(&phi, &gamma, &vec![libm::exp(-own[0] * t); order])?, 0.0, None),
            Self::SuperTwisting => {
                // s(k+1) = S Φ off + (u - u*): u keeps s constant, and the twisting changes it.
                let s = surface()?;
                let on_disturbance = row(&-(&s * &pi));
                let (root, step) = (1.5 * libm::sqrt(own[1]) * t, 1.1 * own[1] * t * t);
                (&s * &phi - &s, 0.0, Some(Twist { on_state: row(&s), on_disturbance, root, step }))
            }
        };
        let mut on_disturbance = row(&(&n + &k * &pi));
        if let (Self::SuperTwisting, Some(driven)) = (self, on_disturbance.last_mut()) {
            // The integral of the twisting replaces the disturbance estimate of the motor.
            *driven = 0.0;
        }
        let Seen { f, g, h, .. } = seen;
        let on_state = row(&-k);
        let law = Feedback { model: model.clone(), limit, is_cut, f, g, h, l, on_state, on_disturbance, k_i, twist };
        Some(Law::Feedback(Box::new(law)))
    }
}

fn row(matrix: &Matrix) -> Vec<f64> {
    matrix.iter().copied().collect()
}

/// Sampled plant with disturbance states, as the observer models it.
struct Seen {
    f: Matrix,
    g: Matrix,
    h: Matrix,
    encoders: usize,
    per_encoder: usize,
}

impl Seen {
    fn new(model: &Model, per_encoder: usize, is_cut: bool) -> Self {
        let (n, encoders) = (model.order(), model.encoders());
        let size = n + encoders * per_encoder;
        let mut a = Matrix::zeros(size, size);
        a.view_mut((0, 0), (n, n)).copy_from(&model.a);
        if is_cut && encoders == 2 {
            (a[(1, 2)], a[(3, 0)]) = (0.0, 0.0);
        }
        let mut b = Matrix::zeros(size, 1 + encoders);
        b.view_mut((0, 0), (n, 1)).copy_from(&model.b);
        for i in 0..encoders {
            b[(2 * i + 1, 1 + i)] = 1.0;
            for j in 0..per_encoder {
                let state = n + i * per_encoder + j;
                a[(if j == 0 { 2 * i + 1 } else { state - 1 }, state)] = 1.0;
            }
        }
        let (f, inputs) = held(&a, &b, model.period_s);
        let (g, h) = (inputs.columns(0, 1).into(), inputs.columns(1, encoders).into());
        Self { f, g, h, encoders, per_encoder }
    }

    /// Returns the states of an encoder: angle, speed, disturbances.
    fn of(&self, i: usize) -> Vec<usize> {
        let first = 2 * self.encoders + i * self.per_encoder;
        [2 * i, 2 * i + 1].into_iter().chain(first..first + self.per_encoder).collect()
    }

    /// Returns the Kalman gain in units of a count and a tick, well scaled at any period.
    fn filtered(&self, unit_rad: &[f64], damping: f64, bandwidths: &[f64], period_s: f64) -> Option<Matrix> {
        let size = self.f.nrows();
        let mut unit = vec![0.0; size];
        let (mut c, mut q) = (Matrix::zeros(self.encoders, size), Matrix::zeros(size, size));
        for i in 0..self.encoders {
            let states = self.of(i);
            for (j, &state) in states.iter().enumerate() {
                unit[state] = unit_rad[i] / libm::pow(period_s, j as f64);
            }
            c[(i, 2 * i)] = 1.0;
            let mut binomial = 1.0;
            for (j, &state) in states.iter().enumerate() {
                let (k, order) = (j + 1, states.len());
                binomial *= (order - j) as f64 / k as f64;
                let share = if k == order { 1.0 } else { damping * binomial };
                q[(state, state)] = share * libm::pow(bandwidths[i] * period_s, 2.0 * k as f64) / 12.0;
            }
        }
        let f = Matrix::from_fn(size, size, |i, j| self.f[(i, j)] * unit[j] / unit[i]);
        let r = Matrix::identity(self.encoders, self.encoders) / 12.0;
        let l = kalman(&f, &c, &q, &r)?;
        Some(Matrix::from_fn(size, self.encoders, |i, j| l[(i, j)] * unit[i] / unit_rad[j]))
    }

    /// Returns the observer gain that gives every decoupled block all poles in one place.
    fn placed(&self, bandwidths: &[f64], period_s: f64) -> Option<Matrix> {
        let mut l = Matrix::zeros(self.f.nrows(), self.encoders);
        for i in 0..self.encoders {
            let states = self.of(i);
            let k = states.len();
            let power = |j: usize| libm::pow(period_s, j as f64);
            let f = Matrix::from_fn(k, k, |a, b| self.f[(states[a], states[b])] * power(a) / power(b));
            let sees = f.row(0).transpose();
            let roots = vec![libm::exp(-bandwidths[i] * period_s); k];
            let gains = ackermann(&f.transpose(), &Matrix::from_column_slice(k, 1, sees.as_slice()), &roots)?;
            for (j, &state) in states.iter().enumerate() {
                l[(state, i)] = gains[j] / power(j);
            }
        }
        Some(l)
    }

    /// Returns Π and N.
    fn rests(&self) -> Option<(Matrix, Matrix)> {
        let (n, k) = (2 * self.encoders, self.encoders * self.per_encoder);
        let mut left = Matrix::zeros(n + 1, n + 1);
        left.view_mut((0, 0), (n, n)).copy_from(&(self.f.view((0, 0), (n, n)) - Matrix::identity(n, n)));
        left.view_mut((0, n), (n, 1)).copy_from(&self.g.rows(0, n));
        left[(n, 0)] = 1.0;
        let left = left.lu();
        let (mut pi, mut u) = (Matrix::zeros(n, k), Matrix::zeros(1, k));
        for j in 0..k {
            let mut right = Matrix::zeros(n + 1, 1);
            for i in 0..n {
                // S is 1 on its diagonal and T above it, within an encoder.
                let before: f64 = (0..j).map(|m| self.f[(n + m, n + j)] * pi[(i, m)]).sum();
                right[i] = before - self.f[(i, n + j)];
            }
            let found = left.solve(&right)?;
            pi.column_mut(j).copy_from(&found.view((0, 0), (n, 1)));
            u[j] = found[n];
        }
        Some((pi, u))
    }
}

/// Returns the K that minimises the sum of σ² + (b u/k)², and its gain. σ = (s + w)^(n-1) of the error, with an
/// integral (s + w)^n/s.
fn quadratic(
    model: &Model,
    phi: &Matrix,
    gamma: &Matrix,
    w: f64,
    reaching: f64,
    with_integral: bool,
) -> Option<(Matrix, f64)> {
    let n = model.order();
    // z in units of w.
    let mut chain = model.chain();
    for i in 0..n {
        chain.row_mut(i).scale_mut(libm::pow(w, -(i as f64)));
    }
    let back = chain.clone().try_inverse()?;
    let (a, b) = (&chain * phi * &back, &chain * gamma);
    let first = usize::from(with_integral);
    let size = n + first;
    let mut whole = Matrix::identity(size, size);
    whole.view_mut((first, first), (n, n)).copy_from(&a);
    let mut into = Matrix::zeros(size, 1);
    into.view_mut((first, 0), (n, 1)).copy_from(&b);
    if with_integral {
        whole[(0, 1)] = w * model.period_s;
    }
    let binomial = |j: usize| (0..j).fold(1.0, |product, i| product * (size - 1 - i) as f64 / (i + 1) as f64);
    let sigma = Matrix::from_fn(1, size, |_, j| binomial(j));
    let per_u = model.gain / (reaching * libm::pow(w, (n - 1) as f64));
    let k = regulator(&whole, &into, &(sigma.transpose() * &sigma), &Matrix::from_element(1, 1, per_u * per_u))?;
    let on_state = k.columns(first, n) * chain;
    Some((on_state, if with_integral { k[0] * w } else { 0.0 }))
}

/// Running controller.
pub(super) struct Port {
    law: Arc<Law>,
    task: Task,
    angles: Angles,
    memory: Option<Vec<f64>>,
    tick: usize,
    u: f64,
}

impl Port {
    pub(super) fn new(law: Arc<Law>, task: &Task) -> Self {
        Self { law, task: task.clone(), angles: task.angles(), memory: None, tick: 0, u: 0.0 }
    }
}

impl ControllerPort for Port {
    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError> {
        let (now, delay, limit) = (self.task.aim(self.tick), self.task.delay_ticks(), self.task.max_current_a());
        let mut health = Health::OK;
        if let Some(y) = self.angles.read(sample) {
            let then = self.task.aim(self.tick + delay);
            let is_first = self.memory.is_none();
            let memory = self.memory.get_or_insert_with(|| self.law.started(&y, &now, delay));
            self.u = self.law.tick(memory, &TickInputs { y, now: &now, then: &then, late: delay }, is_first);
        } else {
            health = Health::SAMPLE_LOST;
        }
        if self.u.abs() > limit {
            health |= Health::SATURATED;
        }
        self.tick += 1;
        Ok(Tick { u: self.u, sigma: 0.0, sigma_star: 0.0, estimates: [[0.0; MAX_R]; MAX_ORDER], health })
    }

    fn report_applied(&mut self, u: f64) {
        if let Some(memory) = &mut self.memory {
            memory[HELD] = u;
        }
    }

    fn reset(&mut self) -> Result<(), PortError> {
        *self = Self::new(self.law.clone(), &self.task);
        Ok(())
    }

    fn observed(&self) -> &[usize] {
        &[]
    }

    fn follows(&self) -> Option<usize> {
        Some(0)
    }

    fn reference(&self) -> f64 {
        self.task.aim(self.tick.saturating_sub(1)).jet[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Levant's controller with k_1 = 1.5 √L, k_2 = 1.1 L holds s at 0 against a signal with a rate below L. In
    /// discrete time it holds s within the change that the disturbance causes in a tick.
    #[test]
    fn the_twisting_holds_its_surface_against_a_ramp_and_a_sine() {
        let (rate, t) = (200.0, 1e-3);
        let twist = Twist {
            on_state: Vec::new(),
            on_disturbance: Vec::new(),
            root: 1.5 * libm::sqrt(rate) * t,
            step: 1.1 * rate * t * t,
        };
        for disturbance in [|t: f64| 150.0 * t, |t: f64| 3.0 * libm::sin(50.0 * t)] {
            let (mut s, mut eta, mut last) = (0.5, 0.0, 0.0_f64);
            for k in 0..4000 {
                let (moved, after) = twist.move_of(s, eta);
                s += moved + t * disturbance(f64::from(k) * t);
                eta = after;
                if k > 2000 {
                    last = last.max(s.abs());
                }
            }
            // In steady state the soft sign needs twice the rate of a ramp.
            assert!(last <= 2.0 * rate * t * t, "{last:e}");
        }
        // Checks that the implicit equation is solved.
        for s in [-3.0, -1e-2, 1e-4, 2.0] {
            let (moved, _) = twist.move_of(s, 0.0);
            let end = s + moved;
            let expected = -twist.root * libm::sqrt(end.abs()) * end.signum();
            assert!((moved - expected).abs() < 1e-12, "{s}");
        }
    }
}
