//! Exact step of a plant that is linear except for one sine, from tick to tick without substeps.
//!
//! $$ \dot x = A x + e_n b u + \sum_i e_i w_i(t) - e_2 s \sin x_1 $$
//!
//! Here u is held. The linear part is exact: $x^+ = \Phi x + \gamma u$ plus a share for each term of a signal. One
//! matrix exponential gives the shares of constants, ramps and sinusoids. Along the solution $g = -\sin x_1$ is
//! replaced by its polynomial of degree 3 about the beginning of the step,
//!
//! $$ \sum_{j \le 3} g^{(j)} G_j, \quad G_j = h^{j+1} \varphi_{j+1}(A h) s e_2, \qquad
//!    \dot g = -\cos x_1 \dot x_1, \quad \ddot g = \sin x_1 \dot x_1^2 - \cos x_1 \ddot x_1, \quad
//!    \dddot g = \cos x_1 \dot x_1^3 + 3 \sin x_1 \dot x_1 \ddot x_1 - \cos x_1 \dddot x_1 $$
//!
//! The derivatives of $x_1$ follow from the equation, which must not have $x_4$ in its second row. The step h is the
//! tick, or an equal part of it such that $h \omega \le 0.15$. ω is the fastest rate of the plant, without a lag of u,
//! because a lag only smooths. A plant without sine crosses any tick in one step. The reference is the solver of order
//! 10 ([`solver`](crate::solver)). The states differ from it by less than 1e-9 of their largest value (tests below).
//!
//! The solver handles the ticks that this step does not cross: a tick with a jump inside, a link that turns too fast
//! for the polynomial, and a diverged state. The choice depends only on the tick and the plant.
//!
//! A step uses only `+ - * /` and comparisons, plus one sine and cosine for each frequency. So many plants in a batch
//! (module `lanes`) are bit-identical to each plant alone.

mod augmented;

use augmented::Augmented;

use crate::MAX_ORDER;
use crate::signal::{Signal, Term};
use crate::sine::{self, sin_cos};
use crate::solver::RUNAWAY;

/// Largest number of frequencies, and of jumps, in the signals of one plant together.
const MOST: usize = 8;
/// Number of terms of the polynomial of the sine.
pub(crate) const TERMS: usize = 4;
/// Largest h ω of a step of a plant with a sine, rad.
const STEP_ANGLE: f64 = 0.15;
/// Largest number of steps per tick. Above it the solver takes fewer steps.
const MOST_STEPS: usize = 100;
/// Largest change of the angle in one step, rad.
const TURN: f64 = 0.05;
/// Largest angle whose sine is reduced exactly, rad. It is far below [`RUNAWAY`].
const ANGLE: f64 = 1000.0;

pub(crate) type Row = [f64; MAX_ORDER];

/// Coefficients of the linear part of a plant.
#[derive(Clone, Copy, Debug)]
pub struct LinearPart<'a> {
    /// Matrix A, row by row. The order gives the number of rows in use.
    pub a: [Row; MAX_ORDER],
    /// Order n.
    pub order: usize,
    /// Input gain b.
    pub b: f64,
    /// Channel from 0, factor and signal. A signal v at the input has channel n - 1 and factor b.
    pub signals: &'a [(usize, f64, Signal)],
    /// Coefficient s of -s sin x_1 in the second row, or 0 for none.
    pub sine: f64,
    /// Fastest rate of the plant, rad/s.
    pub fastest_rad_s: f64,
}

/// Response to a sinusoid of one frequency: the factors of its sine and its cosine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wave {
    pub(crate) omega_rad_s: f64,
    pub(crate) sin: Row,
    pub(crate) cos: Row,
}

/// Response to a step from its instant on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jump {
    pub(crate) at_s: f64,
    pub(crate) share: Row,
}

/// Values of the signals of the first rows at an instant, with the derivatives that the sine needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moved {
    pub(crate) w: [f64; 3],
    pub(crate) dw: [f64; 2],
    pub(crate) ddw: f64,
}

/// Coefficients of one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Share<const N: usize> {
    pub(crate) phi: [[f64; N]; N],
    pub(crate) gamma: [f64; N],
    pub(crate) g: [[f64; N]; TERMS],
    /// First three entries of row 2 of A.
    pub(crate) row: [f64; 3],
    /// Coefficient s of the sine.
    pub(crate) sine: f64,
}

/// Lumped disturbances of such a plant, Eq. (39): the part that the nominal chain does not have,
///
/// $$ d_i = w_i(t) + \sum_j D_{ij} x_j + D_{iu} u \ (- \sin x_1 \text{ in } d_2) $$
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lumped {
    /// Matrix D, row by row.
    pub rows: [Row; MAX_ORDER],
    /// Coefficients D_iu of u.
    pub of_u: Row,
    /// Channel, factor and signal.
    pub signals: Vec<(usize, f64, Signal)>,
    /// True if d_2 contains the sine.
    pub has_sine: bool,
}

impl Lumped {
    /// Writes d_1 .. d_n.
    pub fn value(&self, t_s: f64, x: &[f64], u: f64, d: &mut [f64]) {
        for (i, d) in d.iter_mut().enumerate() {
            *d = 0.0;
            for (_, factor, signal) in self.signals.iter().filter(|(channel, ..)| *channel == i) {
                *d += factor * signal.value(t_s);
            }
            for (row, x) in self.rows[i].iter().zip(x) {
                *d += row * x;
            }
            *d += self.of_u[i] * u;
            if self.has_sine && i == 1 {
                *d -= sine::sin(x[0]);
            }
        }
    }
}

/// Precomputed step of one plant at one period.
#[derive(Clone, Debug, PartialEq)]
pub struct Exact {
    pub(crate) order: usize,
    pub(crate) period_s: f64,
    pub(crate) steps: usize,
    /// Length of one of the steps, s.
    pub(crate) h_s: f64,
    /// Coefficient s of the sine, and whether the plant has one.
    pub(crate) sine: f64,
    pub(crate) has_sine: bool,
    pub(crate) phi: [Row; MAX_ORDER],
    pub(crate) gamma: Row,
    pub(crate) g: [Row; TERMS],
    pub(crate) row: [f64; 3],
    pub(crate) constant: Row,
    pub(crate) ramp: Option<Row>,
    pub(crate) waves: Vec<Wave>,
    pub(crate) jumps: Vec<Jump>,
    /// Signals of the first three rows, for their derivatives.
    first: [Signal; 3],
}

impl Exact {
    /// Builds the step of a plant at a period.
    ///
    /// Returns `None` in three cases: more than 8 frequencies or jumps, x_4 in the row of the sine, or a plant so fast
    /// that the solver takes fewer steps.
    pub fn new(plant: &LinearPart<'_>, period_s: f64) -> Option<Self> {
        let n = plant.order;
        let has_sine = plant.sine != 0.0;
        if has_sine && plant.a[1][3..n.max(3)].iter().any(|entry| *entry != 0.0) {
            return None;
        }
        let steps = if has_sine { (period_s * plant.fastest_rad_s / STEP_ANGLE).ceil().max(1.0) } else { 1.0 };
        if !(steps <= MOST_STEPS as f64 && period_s > 0.0) {
            return None;
        }
        let steps = steps as usize;
        let h_s = period_s / steps as f64;
        let augmented = Augmented::new(plant, h_s)?;
        let mut first = <[Signal; 3]>::default();
        for (channel, factor, signal) in plant.signals {
            if let Some(of_row) = first.get_mut(*channel).filter(|_| has_sine) {
                *of_row = of_row.plus(*factor, signal);
            }
        }
        let mut this = Self {
            order: n,
            period_s,
            steps,
            h_s,
            sine: plant.sine,
            has_sine,
            phi: augmented.phi(),
            gamma: augmented.constant(n - 1).map(|share| plant.b * share),
            g: std::array::from_fn(|j| augmented.column(n + TERMS - 1 - j)),
            row: [plant.a[1][0], plant.a[1][1], plant.a[1][2]],
            constant: [0.0; MAX_ORDER],
            ramp: None,
            waves: Vec::new(),
            jumps: Vec::new(),
            first,
        };
        for (channel, factor, signal) in plant.signals {
            for term in signal.terms() {
                this.add(&augmented, *channel, *factor, term)?;
            }
        }
        Some(this)
    }

    /// Adds the share of a term in a channel.
    fn add(&mut self, augmented: &Augmented, channel: usize, factor: f64, term: &Term) -> Option<()> {
        let plus = |to: &mut Row, by: f64, share: Row| {
            for (to, share) in to.iter_mut().zip(share) {
                *to += by * share;
            }
        };
        let (amplitude, omega_rad_s, phase_rad) = match *term {
            Term::Const { amplitude } => {
                plus(&mut self.constant, factor * amplitude, augmented.constant(channel));
                return Some(());
            }
            Term::Ramp { slope } => {
                // s (t + τ) over the step: s t acts as a constant, and s τ follows from the next state of the chain.
                plus(self.ramp.get_or_insert([0.0; MAX_ORDER]), factor * slope, augmented.constant(channel));
                plus(&mut self.constant, factor * slope, augmented.ramp(channel));
                return Some(());
            }
            Term::Step { amplitude, t0_s } => {
                // A jump that never occurs.
                if t0_s.is_nan() || t0_s == f64::INFINITY {
                    return Some(());
                }
                let known = self.jumps.iter().position(|jump| jump.at_s == t0_s);
                let at = known.unwrap_or(self.jumps.len());
                if known.is_none() {
                    if at == MOST {
                        return None;
                    }
                    self.jumps.push(Jump { at_s: t0_s, share: [0.0; MAX_ORDER] });
                }
                plus(&mut self.jumps[at].share, factor * amplitude, augmented.constant(channel));
                return Some(());
            }
            Term::Sin { amplitude, omega_rad_s, phase_rad } => (amplitude, omega_rad_s, phase_rad),
            Term::Cos { amplitude, omega_rad_s, phase_rad } => {
                (amplitude, omega_rad_s, phase_rad + core::f64::consts::FRAC_PI_2)
            }
        };
        let (sin, cos) = augmented.wave(channel, omega_rad_s)?;
        // At most `MOST` frequencies, because the matrix has no room for more.
        let known = self.waves.iter().position(|wave| wave.omega_rad_s == omega_rad_s);
        let at = known.unwrap_or(self.waves.len());
        if known.is_none() {
            self.waves.push(Wave { omega_rad_s, sin: [0.0; MAX_ORDER], cos: [0.0; MAX_ORDER] });
        }
        let wave = &mut self.waves[at];
        // A sin(ω t + φ) = A cos φ sin ω t + A sin φ cos ω t. The response to the cosine is the rotated response to the
        // sine.
        let (a, b) = (factor * amplitude * libm::cos(phase_rad), factor * amplitude * libm::sin(phase_rad));
        plus(&mut wave.sin, a, sin);
        plus(&mut wave.cos, a, cos);
        plus(&mut wave.cos, b, sin);
        plus(&mut wave.sin, -b, cos);
        Some(())
    }

    /// Advances x from `from_s` over a tick with `u` held. Returns false with x unchanged if the solver must take this
    /// tick.
    pub fn advance(&self, from_s: f64, to_s: f64, u: f64, x: &mut [f64]) -> bool {
        match x.len() {
            2 => self.cross::<2>(from_s, to_s, u, x),
            3 => self.cross::<3>(from_s, to_s, u, x),
            4 => self.cross::<4>(from_s, to_s, u, x),
            5 => self.cross::<5>(from_s, to_s, u, x),
            6 => self.cross::<6>(from_s, to_s, u, x),
            _ => false,
        }
    }

    fn cross<const N: usize>(&self, from_s: f64, to_s: f64, u: f64, x: &mut [f64]) -> bool {
        let Ok(mut now) = <[f64; N]>::try_from(&*x) else { return false };
        // A tick of another length needs another step.
        let is_of_period = (to_s - from_s - self.period_s).abs() <= 1e-9 * self.period_s;
        if !is_of_period || self.jumps_between(from_s, to_s) {
            return false;
        }
        let share = self.share::<N>();
        for step in 0..self.steps {
            let t_s = self.at(from_s, step);
            let moved = self.moved(t_s);
            let forced = self.forced::<N>(t_s);
            let (next, is_within) = if self.has_sine {
                let (s, c) = sin_cos(now[0]);
                (share.step::<true>(&now, u, &forced, &moved, [s, c]), is_within::<N, true>(&now, &moved, self.h_s))
            } else {
                (share.step::<false>(&now, u, &forced, &moved, [0.0; 2]), is_within::<N, false>(&now, &moved, self.h_s))
            };
            if !is_within {
                return false;
            }
            now = next;
        }
        x.copy_from_slice(&now);
        true
    }

    /// Returns the time at which a step of a tick begins, s.
    pub(crate) fn at(&self, from_s: f64, step: usize) -> f64 {
        if step == 0 { from_s } else { from_s + step as f64 * self.h_s }
    }

    /// Returns true if a signal jumps inside the interval.
    pub(crate) fn jumps_between(&self, from_s: f64, to_s: f64) -> bool {
        self.jumps.iter().any(|jump| jump.at_s > from_s && jump.at_s < to_s)
    }

    /// Returns true if the first rows have signals that the sine depends on.
    pub(crate) fn is_moved(&self) -> bool {
        self.has_sine && self.first.iter().any(|signal| !signal.terms().is_empty())
    }

    pub(crate) fn share<const N: usize>(&self) -> Share<N> {
        let first = |row: &Row| -> [f64; N] { std::array::from_fn(|i| row[i]) };
        Share {
            phi: std::array::from_fn(|i| first(&self.phi[i])),
            gamma: first(&self.gamma),
            g: self.g.map(|g| first(&g)),
            row: self.row,
            sine: self.sine,
        }
    }

    /// Returns the share of the signals over a step from `t_s` on.
    pub(crate) fn forced<const N: usize>(&self, t_s: f64) -> [f64; N] {
        let mut forced: [f64; N] = std::array::from_fn(|i| self.constant[i]);
        if let Some(ramp) = self.ramp {
            for (forced, ramp) in forced.iter_mut().zip(ramp) {
                *forced += ramp * t_s;
            }
        }
        for jump in self.jumps.iter().filter(|jump| t_s >= jump.at_s) {
            for (forced, share) in forced.iter_mut().zip(jump.share) {
                *forced += share;
            }
        }
        for wave in &self.waves {
            let [sin, cos] = wave.at(t_s);
            for (i, forced) in forced.iter_mut().enumerate() {
                *forced += wave.sin[i] * sin + wave.cos[i] * cos;
            }
        }
        forced
    }

    /// Returns the values of the signals that the sine needs at `t_s`.
    pub(crate) fn moved(&self, t_s: f64) -> Moved {
        let [first, second, third] = &self.first;
        if !self.is_moved() {
            return Moved::default();
        }
        Moved {
            w: [first.value(t_s), second.value(t_s), third.value(t_s)],
            dw: [first.derivative(t_s, 1), second.derivative(t_s, 1)],
            ddw: first.derivative(t_s, 2),
        }
    }

    /// Returns true if the time functions and the number of steps match `other`. Amplitudes and plants may differ.
    #[cfg(feature = "lanes")]
    pub(crate) fn is_alike(&self, other: &Self) -> bool {
        let times = |exact: &Self| -> Vec<u64> {
            let waves = exact.waves.iter().map(|wave| wave.omega_rad_s);
            waves.chain(exact.jumps.iter().map(|jump| jump.at_s)).chain([exact.period_s]).map(f64::to_bits).collect()
        };
        let kind =
            |exact: &Self| (exact.order, exact.steps, exact.sine.to_bits(), exact.ramp.is_some(), exact.waves.len());
        kind(self) == kind(other) && times(self) == times(other) && self.first == other.first
    }
}

impl Wave {
    /// Returns its sine and cosine at `t_s`.
    pub(crate) fn at(&self, t_s: f64) -> [f64; 2] {
        sine::sin_and_cos(self.omega_rad_s * t_s)
    }
}

/// Returns true if the polynomial of the sine is valid for a step from here and the state has not diverged.
#[inline(always)]
pub(crate) fn is_within<const N: usize, const SINE: bool>(x: &[f64; N], moved: &Moved, h_s: f64) -> bool {
    let turn = (x[1] + moved.w[0]) * h_s;
    let mut is_within = if SINE { (turn.abs() <= TURN) & (x[0].abs() <= ANGLE) } else { x[0].abs() <= RUNAWAY };
    for x in &x[1..] {
        is_within &= x.abs() <= RUNAWAY;
    }
    is_within
}

impl<const N: usize> Share<N> {
    /// Returns the state after one step. s and c are the sine and cosine of x_1.
    #[inline(always)]
    pub(crate) fn step<const SINE: bool>(
        &self,
        x: &[f64; N],
        u: f64,
        forced: &[f64; N],
        moved: &Moved,
        [s, c]: [f64; 2],
    ) -> [f64; N] {
        let mut next = [0.0; N];
        for i in 0..N {
            let mut sum = self.phi[i][0] * x[0];
            for j in 1..N {
                sum += self.phi[i][j] * x[j];
            }
            next[i] = sum + (self.gamma[i] * u + forced[i]);
        }
        if SINE {
            let Moved { w, dw, ddw } = *moved;
            let [k1, b1, x3] = self.row;
            // Derivatives of x_1: d1 = x_2 + w_1, d2, d3. v2 is x_2' and v3 is x_2''.
            let d1 = x[1] + w[0];
            let third = if N > 2 { x3 * x[2.min(N - 1)] } else { 0.0 };
            let v2 = third + k1 * x[0] + b1 * x[1] - self.sine * s + w[1];
            let d2 = v2 + dw[0];
            let g1 = -(c * d1);
            let fourth = if N > 3 { x3 * (x[3.min(N - 1)] + w[2]) } else { 0.0 };
            let v3 = fourth + k1 * d1 + b1 * v2 + self.sine * g1 + dw[1];
            let d3 = v3 + ddw;
            let g2 = s * (d1 * d1) - c * d2;
            let g3 = c * (d1 * d1 * d1) + 3.0 * (s * (d1 * d2)) - c * d3;
            for i in 0..N {
                next[i] += (self.g[1][i] * g1 - self.g[0][i] * s) + (self.g[2][i] * g2 + self.g[3][i] * g3);
            }
        }
        next
    }
}

#[cfg(test)]
mod tests;
