//! Solver that moves the plant from one tick to the next under a held input.
//!
//! **Method.** Explicit extrapolation (Gragg, Bulirsch, Stoer). The midpoint rule crosses the step with 2, 4, 6, 8 and
//! 10 substeps. Its errors are series in the square of the substep. The five results are combined so that the first
//! four terms cancel: order 10 from 26 evaluations, with five weights as the only constants. The first m results alone
//! have order 2m, from 1 + m² evaluations.
//!
//! **Step.** The step h follows from the plant and not from an error estimate: h ω <= 1/2 with
//! ω = [`Plant::fastest_rad_s`], computed before every step. The number of rows follows from h ω. For x' = λx the
//! relative error per unit of |λ| t is then below 4e-11 for every stable λ (computed with 40 digits). The numbers of
//! rows are:
//!
//! | h ω up to | 0.007 | 0.07 | 0.23 | 0.5 |
//! |---|---|---|---|---|
//! | rows | 2 | 3 | 4 | 5 |
//! | evaluations | 5 | 10 | 17 | 26 |
//!
//! The order is at least n + 1, so that a chain of integrators is exact, also under a ramp. The remaining error is far
//! below the 6e-8 of an f32 controller: `a_linear_chain_agrees_with_the_matrix_exponential`,
//! `half_the_step_changes_nothing`, `no_row_too_few`.
//!
//! The friction of a motor is steep only near rest. There the plant requests fine steps. While the shaft turns it
//! requests steps within which it does not come to rest.
//!
//! A plant whose rate holds for this instant only ([`Plant::is_checked`]) has each step checked. Without its last row
//! the order is lower by 2. If both results differ by more than 1e-9, all five rows are used, and then half the step.
//!
//! **Events.** A plant with friction that holds has a smooth right-hand side between two events ([`Regime`]). A step
//! continues it beyond an event and is then cut there. The length at which the margin of the regime is 0 is found by
//! regula falsi (Illinois) with bisection. A margin that is below 0 only inside the step is found from a parabola
//! through its beginning, its slope there and its end. After the event the speed is 0, to the bit.
//!
//! **Jumps.** No step straddles a jump. The midpoint rule evaluates at the beginning and inside of the step, never at
//! its end. So a jump at the end of a step has no effect before its time.
//!
//! **Stiffness.** A plant faster than the tick takes more steps, up to [`MAX_STEPS`]. Above this number it is refused.
//!
//! Only `+ - * /`, comparison and rounding up to an integer are used, so a run has the same bits on every machine.

use core::fmt;

use crate::MAX_ORDER;
use crate::plant::{Plant, Regime};

/// Largest h ω of one step.
pub(crate) const STEP_ANGLE: f64 = 0.5;
/// Largest number of steps in one tick: 5000 rad of the fastest mode.
pub const MAX_STEPS: usize = 10_000;
/// Magnitude of a state above which the run has diverged.
pub const RUNAWAY: f64 = 1e9;
/// Number of midpoint results that are combined. Result j, from 0, has 2 (j + 1) substeps.
pub(crate) const ROWS: usize = 5;
/// Weights of the results for each number of rows.
pub(crate) const WEIGHTS: [[f64; ROWS]; ROWS + 1] =
    [weights(0), weights(1), weights(2), weights(3), weights(4), weights(5)];
/// Largest h ω for which 2, 3 and 4 rows suffice.
const ANGLES: [f64; 3] = [0.007, 0.07, 0.23];
/// Largest h ω of a checked step for 2, 3 and 4 rows. Without the last row the results differ by less than [`AGREED`].
const CHECKED_ANGLES: [f64; 3] = [0.0, 0.04, 0.17];
/// Largest difference without the last row in a checked step.
const AGREED: f64 = 1e-9;
/// Largest number of moves of the end of a step to meet an event.
const MOST_TRIES: u32 = 60;
/// Largest number of halvings of a step. After them the step is accepted, because a kink such as |x| never passes the
/// check.
const MOST_HALVINGS: u32 = 10;

/// Cause of a failed integration.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum SolverError {
    /// The right-hand side is not finite, for example from a division by zero or the logarithm of a negative number.
    NoRate {
        /// Time of the failure, s.
        t_s: f64,
        /// Index of the state, from 1.
        channel: usize,
        /// Value of its slope: infinite or NaN.
        rate: f64,
    },
    /// The dynamics are too fast for the tick: more than [`MAX_STEPS`] steps.
    TooStiff {
        /// Time of the failed step, s.
        t_s: f64,
        /// Fastest rate, rad/s.
        fastest_rad_s: f64,
    },
}

impl fmt::Display for SolverError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoRate { t_s, channel, rate } => write!(
                f,
                "the plant diverged at t = {t_s} s: x_{channel}' is {rate} there, a division by zero or a function \
                 beyond its range"
            ),
            Self::TooStiff { t_s, fastest_rad_s } => write!(
                f,
                "the plant is too fast for the period: {fastest_rad_s:.3e} rad/s at t = {t_s} s needs more than \
                 {MAX_STEPS} solver steps in one tick; shorten the period or slow the plant"
            ),
        }
    }
}

impl std::error::Error for SolverError {}

/// Integrates from `from_s` to `to_s` with `u` held. `x` is advanced in place.
///
/// A state beyond ±[`RUNAWAY`] or NaN stays as it was found: the run has diverged. A plant with a finite escape time
/// has no state at `to_s`.
///
/// # Errors
/// [`SolverError::NoRate`] if the right-hand side is not finite, and [`SolverError::TooStiff`] if the tick needs too
/// many steps.
pub fn advance(plant: &dyn Plant, from_s: f64, to_s: f64, u: f64, x: &mut [f64]) -> Result<(), SolverError> {
    // Loops over a constant number of states take a fifth of the instructions.
    macro_rules! of_order {
        ($($n:literal)*) => {
            match x.len() {
                $($n => advance_all::<$n>(plant, from_s, to_s, u, x.try_into().unwrap_or(&mut [0.0; $n])),)*
                order => unreachable!("a plant of order {order}, beyond {MAX_ORDER}"),
            }
        };
    }
    of_order!(0 1 2 3 4 5 6)
}

fn advance_all<const N: usize>(
    plant: &dyn Plant,
    from_s: f64,
    to_s: f64,
    u: f64,
    x: &mut [f64; N],
) -> Result<(), SolverError> {
    let mut crossing = Crossing::new(from_s, to_s);
    while !crossing.is_done() {
        let within = Within::at(plant, crossing.t_s, u, x);
        let mut first = [0.0; N];
        within.rhs(crossing.t_s, x, u, &mut first);
        let Some(mut stride) = crossing.plan(plant, u, x, &first)? else { return Ok(()) };
        let begin_s = crossing.t_s;
        let increment = loop {
            let (increment, difference) = step(within, begin_s, stride, u, x, &first);
            match crossing.checked(plant, difference) {
                None => break increment,
                Some(other) => stride = other,
            }
        };
        let end = core::array::from_fn(|i| x[i] + increment[i]);
        *x = within.ended(&mut crossing, begin_s, (stride.h_s, u), [x, &first, &end]);
    }
    Ok(())
}

/// Plant in one regime, up to its next event.
#[derive(Clone, Copy)]
pub(crate) struct Within<'a> {
    pub(crate) plant: &'a dyn Plant,
    pub(crate) regime: Regime,
}

impl<'a> Within<'a> {
    pub(crate) fn at(plant: &'a dyn Plant, t_s: f64, u: f64, x: &[f64]) -> Self {
        Self { plant, regime: plant.regime(t_s, x, u) }
    }

    #[inline(always)]
    pub(crate) fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        match self.regime {
            Regime::Smooth => self.plant.rhs(t_s, x, u, dx),
            regime => self.plant.rhs_in(regime, t_s, x, u, dx),
        }
    }

    /// Returns the end of a step of `h_s` from `begin_s`, or the event in it, to which the crossing goes back. It uses
    /// the state and the slope at the beginning and the state reached.
    pub(crate) fn ended<const N: usize>(
        &self,
        crossing: &mut Crossing,
        begin_s: f64,
        (h_s, u): (f64, f64),
        [x, first, end]: [&[f64; N]; 3],
    ) -> [f64; N] {
        if self.regime == Regime::Smooth {
            return *end;
        }
        let after = |h_s: f64| {
            let (increment, _) = step(*self, begin_s, Stride { h_s, rows: ROWS }, u, x, first);
            let x: [f64; N] = core::array::from_fn(|i| x[i] + increment[i]);
            (self.plant.margin(self.regime, begin_s + h_s, &x, u), x)
        };
        let [before, now] =
            [(begin_s, x), (begin_s + h_s, end)].map(|(t_s, x)| self.plant.margin(self.regime, t_s, x, u));
        let beyond = if now < 0.0 {
            Some((h_s, now, *end))
        } else {
            self.dip(begin_s, (h_s, u), [before, now], [x, first], &after)
        };
        let Some(beyond) = beyond else { return *end };
        let (at_s, mut x) = event(before, beyond, after);
        crossing.t_s = begin_s + at_s;
        if let Regime::Sliding { speed, .. } = self.regime {
            x[usize::from(speed)] = 0.0;
        }
        x
    }

    /// Searches for a margin that is above 0 at both ends and below 0 in between. Returns the time of its lowest point,
    /// the margin and the state there.
    fn dip<const N: usize>(
        &self,
        begin_s: f64,
        (h_s, u): (f64, f64),
        [before, now]: [f64; 2],
        [x, first]: [&[f64; N]; 2],
        after: &impl Fn(f64) -> (f64, [f64; N]),
    ) -> Option<(f64, f64, [f64; N])> {
        let little_s = 1e-6 * h_s;
        let ahead: [f64; N] = core::array::from_fn(|i| x[i] + little_s * first[i]);
        let slope = (self.plant.margin(self.regime, begin_s + little_s, &ahead, u) - before) / little_s;
        let bend = ((now - before) / h_s - slope) / h_s;
        let lowest_s = -slope / (2.0 * bend);
        let is_inside = slope < 0.0 && bend > 0.0 && lowest_s < h_s;
        if !is_inside || before + 0.5 * slope * lowest_s > 0.2 * before.min(now) {
            return None;
        }
        let (margin, x) = after(lowest_s);
        (margin < 0.0).then_some((lowest_s, margin, x))
    }
}

/// Returns the time at which a margin that is `before` (0 or more) at 0 becomes 0, and the state just after it.
/// `beyond` is a later time with a negative margin, with its margin and state.
fn event<const N: usize>(
    before: f64,
    beyond: (f64, f64, [f64; N]),
    after: impl Fn(f64) -> (f64, [f64; N]),
) -> (f64, [f64; N]) {
    let ([mut low_s, mut low], (mut high_s, mut high, mut x)) = ([0.0, before], beyond);
    let mut kept = 0;
    for turn in 0..MOST_TRIES {
        if high_s - low_s <= 1e-15 * beyond.0 {
            break;
        }
        let chord_s = high_s - high * (high_s - low_s) / (high - low);
        let middle_s = 0.5 * (low_s + high_s);
        let at_s = if turn % 3 == 2 || !(chord_s > low_s && chord_s < high_s) { middle_s } else { chord_s };
        let (margin, there) = after(at_s);
        // The final margin is below 0, so that the next regime differs.
        if margin >= 0.0 {
            (low_s, low) = (at_s, margin);
            high *= if kept == 1 { 0.5 } else { 1.0 };
            kept = 1;
        } else {
            (high_s, high, x) = (at_s, margin, there);
            low *= if kept == -1 { 0.5 } else { 1.0 };
            kept = -1;
        }
    }
    (high_s, x)
}

/// Step: its length, s, and its number of rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stride {
    pub(crate) h_s: f64,
    pub(crate) rows: usize,
}

/// Returns the number of rows of a step with this h ω for a plant of order n.
pub(crate) fn rows(angle: f64, order: usize, is_checked: bool) -> usize {
    let angles = if is_checked { CHECKED_ANGLES } else { ANGLES };
    let beyond = angles.iter().filter(|most| angle > **most).count();
    let least = order / 2 + 1 + usize::from(is_checked);
    (2 + beyond).max(least).min(ROWS)
}

/// Progress of crossing a tick. All decisions about steps are made here, equally for a plant alone and in a batch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    pub(crate) t_s: f64,
    to_s: f64,
    next_s: f64,
    rows: usize,
    steps: usize,
    halvings: u32,
}

impl Crossing {
    pub(crate) const fn new(from_s: f64, to_s: f64) -> Self {
        Self { t_s: from_s, to_s, next_s: from_s, rows: ROWS, steps: 0, halvings: 0 }
    }

    pub(crate) fn is_done(&self) -> bool {
        self.t_s >= self.to_s
    }

    /// Ends the crossing at the present time.
    #[cfg(feature = "lanes")]
    pub(crate) const fn give_up(&mut self) {
        self.t_s = self.to_s;
    }

    /// Returns the next step from x, with the slope `first` there, or `None` if x has diverged.
    pub(crate) fn plan<const N: usize>(
        &mut self,
        plant: &dyn Plant,
        u: f64,
        x: &[f64; N],
        first: &[f64; N],
    ) -> Result<Option<Stride>, SolverError> {
        let Self { t_s, to_s, .. } = *self;
        if !x.iter().all(|value| value.abs() <= RUNAWAY) {
            return Ok(None);
        }
        let end_s =
            plant.jumps_s().iter().copied().find(|&jump_s| jump_s > t_s).map_or(to_s, |jump_s| jump_s.min(to_s));
        if let Some(at) = first.iter().position(|rate| !rate.is_finite()) {
            return Err(SolverError::NoRate { t_s, channel: at + 1, rate: first[at] });
        }
        let fastest_rad_s = plant.fastest_rad_s(t_s, x, u);
        // Equal steps to the end, as long as the rate does not change.
        let needed = ((end_s - t_s) * fastest_rad_s / STEP_ANGLE).ceil();
        if self.steps == MAX_STEPS || !needed.is_finite() {
            return Err(SolverError::TooStiff { t_s, fastest_rad_s });
        }
        self.next_s = if needed <= 1.0 { end_s } else { t_s + (end_s - t_s) / needed };
        self.rows = rows((self.next_s - t_s) * fastest_rad_s, N, plant.is_checked());
        self.halvings = 0;
        Ok(Some(self.stride()))
    }

    const fn stride(&self) -> Stride {
        Stride { h_s: self.next_s - self.t_s, rows: self.rows }
    }

    /// Accepts a computed step whose rows differ by `difference`, or returns another step to try.
    pub(crate) fn checked(&mut self, plant: &dyn Plant, difference: f64) -> Option<Stride> {
        let is_taken =
            !plant.is_checked() || difference.is_nan() || difference <= AGREED || self.halvings == MOST_HALVINGS;
        if is_taken {
            self.t_s = self.next_s;
            self.steps += 1;
            return None;
        }
        if self.rows < ROWS {
            self.rows = ROWS;
        } else {
            self.next_s = self.t_s + 0.5 * (self.next_s - self.t_s);
            self.halvings += 1;
        }
        Some(self.stride())
    }
}

/// Returns w_j = prod_{i != j} n_j^2 / (n_j^2 - n_i^2): the value at substep 0 of the polynomial in (substep)^2 through
/// the first rows.
const fn weights(rows: usize) -> [f64; ROWS] {
    let mut weights = [0.0; ROWS];
    let mut j = 0;
    while j < rows {
        weights[j] = 1.0;
        let mut i = 0;
        while i < rows {
            let (own, other) = ((j + 1) as f64, (i + 1) as f64);
            if i != j {
                weights[j] *= own * own / (own * own - other * other);
            }
            i += 1;
        }
        j += 1;
    }
    weights
}

/// Returns the increment of x over a step, with the slope `first` at t, and the largest difference without the last
/// row. The difference is relative to the distance of a state from 0 or its change.
pub(crate) fn step<const N: usize>(
    within: Within<'_>,
    t_s: f64,
    Stride { h_s, rows }: Stride,
    u: f64,
    x: &[f64; N],
    first: &[f64; N],
) -> ([f64; N], f64) {
    // Increments are combined instead of states, so that the weights (up to 6) do not amplify the rounding of x.
    let (mut increment, mut less) = ([0.0; N], [0.0; N]);
    for row in 0..rows {
        let (weight, without) = (WEIGHTS[rows][row], WEIGHTS[rows - 1][row]);
        let across = midpoint(within, t_s, h_s, u, x, first, 2 * (row + 1));
        for i in 0..N {
            increment[i] += weight * across[i];
            less[i] += without * across[i];
        }
    }
    (increment, difference(h_s, x, first, &increment, &less))
}

/// Returns the largest difference between two increments.
#[inline(always)]
pub(crate) fn difference<const N: usize>(
    h_s: f64,
    x: &[f64; N],
    first: &[f64; N],
    increment: &[f64; N],
    less: &[f64; N],
) -> f64 {
    let mut most = 0.0;
    for i in 0..N {
        let size = x[i].abs() + increment[i].abs() + (h_s * first[i]).abs();
        let share = (increment[i] - less[i]).abs() / if size > 0.0 { size } else { 1.0 };
        if share > most || share.is_nan() {
            most = share;
        }
    }
    most
}

/// Returns the increment of x over `h_s` by `substeps` (even) of the midpoint rule, the first by Euler. `first` is the
/// slope at t.
fn midpoint<const N: usize>(
    within: Within<'_>,
    t_s: f64,
    h_s: f64,
    u: f64,
    x: &[f64; N],
    first: &[f64; N],
    substeps: usize,
) -> [f64; N] {
    // Plain loops: code optimised for size keeps the calls of an iterator, and this loop is most of a run.
    let s = h_s / substeps as f64;
    let (mut before, mut now, mut at, mut slope) = ([0.0; N], [0.0; N], [0.0; N], [0.0; N]);
    for i in 0..N {
        now[i] = s * first[i];
    }
    for k in 1..substeps {
        for i in 0..N {
            at[i] = x[i] + now[i];
            slope[i] = 0.0;
        }
        within.rhs(t_s + k as f64 * s, &at, u, &mut slope);
        for i in 0..N {
            let next = before[i] + 2.0 * s * slope[i];
            before[i] = now[i];
            now[i] = next;
        }
    }
    now
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Benchmark, Chain, FlexibleJoint, JointErrors, LastChannel};
    use crate::signal::{Signal, Term};
    use controller_core::{JointParameters, Reading};

    const TABLE_I: JointParameters = JointParameters::TABLE_I;

    fn chain(a: &[f64], b: f64, disturbances: Vec<Signal>) -> Chain {
        let last = LastChannel { a: a.to_vec(), b };
        Chain::new(last.clone(), last, disturbances).unwrap()
    }

    /// Returns exp([A, b; 0, 0] t): the exact step of x' = A x + b u, u held, by scaling and Taylor series.
    fn exact_step(a: &[f64], b: f64, t_s: f64) -> Vec<Vec<f64>> {
        let n = a.len() + 1;
        let product = |p: &[Vec<f64>], q: &[Vec<f64>]| -> Vec<Vec<f64>> {
            (0..n).map(|i| (0..n).map(|j| (0..n).map(|k| p[i][k] * q[k][j]).sum()).collect()).collect()
        };
        let halvings = 20;
        let mut m = vec![vec![0.0; n]; n];
        for i in 0..n - 2 {
            m[i][i + 1] = t_s / f64::from(1 << halvings);
        }
        for j in 0..n - 1 {
            m[n - 2][j] = a[j] * t_s / f64::from(1 << halvings);
        }
        m[n - 2][n - 1] = b * t_s / f64::from(1 << halvings);
        // E = exp(M) - I, kept apart from I so that the doubling loses no digits: E <- 2E + E E.
        let mut e = vec![vec![0.0; n]; n];
        for k in (1..=12).rev() {
            let mut one_plus = e.clone();
            for i in 0..n {
                one_plus[i][i] += 1.0;
            }
            e = product(&m, &one_plus);
            e.iter_mut().flatten().for_each(|entry| *entry /= f64::from(k));
        }
        for _ in 0..halvings {
            let square = product(&e, &e);
            for i in 0..n {
                for j in 0..n {
                    e[i][j] = 2.0 * e[i][j] + square[i][j];
                }
            }
        }
        for i in 0..n {
            e[i][i] += 1.0;
        }
        e
    }

    /// Returns the largest relative deviation from the exact solution over `ticks` ticks. Each state is relative to its
    /// own maximum. The input changes sign every few ticks.
    fn deviation_from_exact(a: &[f64], b: f64, period_s: f64, ticks: usize) -> f64 {
        let n = a.len();
        let plant = chain(a, b, vec![Signal::default(); n]);
        let transition = exact_step(a, b, period_s);
        let mut x: Vec<f64> = (0..n).map(|i| 1.0 - 0.3 * i as f64).collect();
        let mut exact = x.clone();
        let (mut largest, mut worst) = (vec![0.0_f64; n], vec![0.0_f64; n]);
        for k in 0..ticks {
            let u = if k / 7 % 2 == 0 { 1.0 } else { -0.7 };
            advance(&plant, k as f64 * period_s, (k + 1) as f64 * period_s, u, &mut x).unwrap();
            let before = exact.clone();
            for i in 0..n {
                exact[i] = (0..n).map(|j| transition[i][j] * before[j]).sum::<f64>() + transition[i][n] * u;
                largest[i] = largest[i].max(exact[i].abs());
                worst[i] = worst[i].max((exact[i] - x[i]).abs());
            }
        }
        worst.iter().zip(&largest).map(|(worst, largest)| worst / largest).fold(0.0, f64::max)
    }

    #[test]
    fn a_linear_chain_agrees_with_the_matrix_exponential() {
        let cases: [(&[f64], f64, f64, usize); 5] = [
            (&[-55.08, -20.0], 6.46, 1e-3, 3000),
            // Without damping every error remains: 1000 rad.
            (&[-1e4, 0.0], 1.0, 1e-3, 10_000),
            // Stiff: three steps per tick, then 200.
            (&[-74_830.0, -24_610.0, -2000.0], 2.53, 1e-3, 3000),
            (&[-74_830.0, -24_610.0, -2000.0], 2.53, 5e-2, 200),
            (&[-1.0, -6.0, -15.0, -20.0, -15.0, -6.0], 1.0, 5e-2, 400),
        ];
        for (a, b, period_s, ticks) in cases {
            let deviation = deviation_from_exact(a, b, period_s, ticks);
            // 4e-11 per rad of memory, and the rounding of 1e4 steps. A simulation with an f32 controller (6e-8) or
            // with metrics compared to 1e-5 is not affected.
            assert!(deviation < 1e-9, "{a:?} at {period_s} s: {deviation:.1e}");
        }
    }

    /// At the largest h ω for each number of rows, damped and undamped, the error is 4e-11 per rad of memory.
    #[test]
    fn no_row_too_few() {
        for (k, angle) in ANGLES.into_iter().chain([STEP_ANGLE]).enumerate() {
            assert_eq!(rows(angle, 2, false), 2 + k);
            for damping in [0.0, 0.2, 0.7, 1.0] {
                let (period_s, ticks) = (1e-3, 3000);
                let omega = angle / period_s / 1.001;
                let a = [-omega * omega, -2.0 * damping * omega];
                let deviation = deviation_from_exact(&a, omega * omega, period_s, ticks);
                let remembered = if damping > 0.0 { 1.0 / damping } else { angle * ticks as f64 };
                // Plus the rounding of each tick.
                let most = 4e-11 * remembered.max(1.0) + 1e-15 * ticks as f64;
                assert!(deviation < most, "{} rows, damping {damping}: {deviation:.1e} {most:.1e}", 2 + k);
            }
        }
        assert_eq!([2, 3, 4, 5, 6].map(|n| rows(0.0, n, false)), [2, 2, 3, 3, 4]);
        assert_eq!([2, 3, 4, 5, 6].map(|n| rows(0.0, n, true)), [3, 3, 4, 4, 5]);
    }

    #[test]
    fn six_integrators_are_exact_in_one_step_of_any_length() {
        let plant = chain(&[0.0; 6], 2.0, vec![Signal::default(); 6]);
        let mut x = [0.0; 6];
        advance(&plant, 0.0, 3.0, 1.0, &mut x).unwrap();
        let (mut exact, mut factorial) = ([0.0; 6], 1.0);
        for k in 1..=6 {
            factorial *= f64::from(k);
            exact[6 - k as usize] = 2.0 * 3.0_f64.powi(k) / factorial;
        }
        for (x, exact) in x.iter().zip(exact) {
            assert!((x - exact).abs() < 1e-13 * exact, "{x} {exact}");
        }
    }

    /// Plant that requests steps of half the length.
    struct Halved<'a>(&'a dyn Plant);

    impl Plant for Halved<'_> {
        fn order(&self) -> usize {
            self.0.order()
        }
        fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
            self.0.rhs(t_s, x, u, dx);
        }
        fn lumped(&self, t_s: f64, x: &[f64], u: f64, d: &mut [f64]) {
            self.0.lumped(t_s, x, u, d);
        }
        fn fastest_rad_s(&self, t_s: f64, x: &[f64], u: f64) -> f64 {
            // At least two steps per tick, even if the plant is slow.
            2.0 * self.0.fastest_rad_s(t_s, x, u).max(2.0 * STEP_ANGLE / 1e-3)
        }
        fn jumps_s(&self) -> &[f64] {
            self.0.jumps_s()
        }
    }

    #[test]
    fn half_the_step_changes_nothing() {
        let joint = |reading| FlexibleJoint::of_the_paper(TABLE_I.chain(reading));
        let low = FlexibleJoint::new(
            TABLE_I.chain(Reading::Reconstructed),
            JointErrors::uniform(-0.5),
            FlexibleJoint::input_of_the_paper(),
            <[Signal; 4]>::default(),
        );
        let plants: [(&dyn Plant, &[f64], f64, f64); 6] = [
            (&joint(Reading::Reconstructed), &[0.1, 0.0, 0.0, 0.0], 1e-3, 3.0),
            (&joint(Reading::Physical), &[0.1, 0.0, 0.0, 0.0], 1e-2, 3.0),
            (&joint(Reading::Stiff), &[0.1, 0.0, 0.0, 0.0], 1e-3, 3.0),
            (&joint(Reading::Stiff), &[0.1, 0.0, 0.0, 0.0], 5e-2, 3.0),
            (&low, &[0.1, -5.0, 0.0, 0.0], 1e-2, 3.0),
            // The jump at 2 s lies inside a tick. With this input the plant escapes at 2.7 s.
            (&Benchmark::part_2(), &[-1.0, 0.5], 0.15, 2.4),
        ];
        for (case, (plant, x0, period_s, span_s)) in plants.into_iter().enumerate() {
            let (mut whole, mut halved) = (x0.to_vec(), x0.to_vec());
            let mut largest = vec![0.0_f64; x0.len()];
            for k in 0..(span_s / period_s) as usize {
                let (from, to) = (k as f64 * period_s, (k + 1) as f64 * period_s);
                let u = -1.0 + 0.1 * (k % 5) as f64 - whole[1];
                advance(plant, from, to, u, &mut whole).unwrap();
                advance(&Halved(plant), from, to, u, &mut halved).unwrap();
                for i in 0..x0.len() {
                    largest[i] = largest[i].max(whole[i].abs());
                    let difference = (whole[i] - halved[i]).abs() / largest[i];
                    // 4e-11 per rad of memory of the fastest mode.
                    assert!(difference < 1e-10, "case {case}, t = {to}, x{}: {difference:.1e}", i + 1);
                }
            }
        }
    }

    #[test]
    fn the_undamped_joint_keeps_its_energy() {
        // Physical reading, no friction, no drive: E = link + motor + spring + gravity (of 1 rad/s^2 per J12).
        let parameters = JointParameters { b11: 0.0, b12: 0.0, ..TABLE_I };
        let chain = parameters.chain(Reading::Physical);
        let plant = FlexibleJoint::new(chain, JointErrors::default(), Signal::default(), <[Signal; 4]>::default());
        let energy = |x: &[f64]| {
            let JointParameters { j11, j12, ks, .. } = parameters;
            let (q2, w2) = (x[2] / chain.k1, x[3] / chain.k1);
            0.5 * (j12 * x[1] * x[1] + j11 * w2 * w2 + ks * (x[0] - q2) * (x[0] - q2)) + j12 * (1.0 - x[0].cos())
        };
        let mut x = [1.2, 0.0, 0.0, 0.0];
        let start = energy(&x);
        for k in 0..10_000 {
            advance(&plant, f64::from(k) * 1e-3, f64::from(k + 1) * 1e-3, 0.0, &mut x).unwrap();
            // 1000 rad of the motor's spring at 4e-11 each, for steps of the largest length.
            assert!((energy(&x) / start - 1.0).abs() < 1e-10, "tick {k}: {}", energy(&x) / start - 1.0);
        }
    }

    #[test]
    fn a_jump_inside_a_tick_acts_exactly_from_its_instant() {
        let jump_s = 0.0137;
        let step = Signal::new(vec![Term::Step { amplitude: 3.0, t0_s: jump_s }]);
        let plant = chain(&[0.0, 0.0], 1.0, vec![Signal::default(), step]);
        // First with the jump inside a long tick, then with the jump at the end of a tick.
        for ticks_s in [vec![0.0, 0.5], vec![0.0, jump_s, 0.5]] {
            let mut x = [0.0; 2];
            for pair in ticks_s.windows(2) {
                advance(&plant, pair[0], pair[1], 1.0, &mut x).unwrap();
            }
            let after = 0.5 - jump_s;
            let exact = [0.5 * 0.25 + 1.5 * after * after, 0.5 + 3.0 * after];
            // The weights sum to 1 within 1e-15. A jump that acts one substep early or late shows as 1e-2.
            assert!((x[0] - exact[0]).abs() < 1e-14 && (x[1] - exact[1]).abs() < 1e-14, "{x:?} {exact:?}");
        }
    }

    #[test]
    fn a_fast_disturbance_of_a_slow_plant_is_resolved() {
        let fast = Signal::new(vec![Term::Cos { amplitude: 1.0, omega_rad_s: 5000.0, phase_rad: 0.0 }]);
        let plant = chain(&[0.0, 0.0], 1.0, vec![Signal::default(), fast]);
        let mut x = [0.0; 2];
        advance(&plant, 0.0, 0.05, 0.0, &mut x).unwrap();
        assert!((x[1] - 250.0_f64.sin() / 5000.0).abs() < 1e-12, "{}", x[1]);
    }

    #[test]
    fn a_plant_too_fast_for_its_tick_is_refused_and_one_just_below_is_not() {
        let with_rate = |rate: f64| chain(&[-rate, -rate], 1.0, vec![Signal::default(); 2]);
        let mut x = [0.1, 0.0];
        assert!(advance(&with_rate(4.9e6), 0.0, 1e-3, 0.0, &mut x).is_ok());
        let refused = advance(&with_rate(5.1e6), 0.0, 1e-3, 0.0, &mut x);
        let Err(SolverError::TooStiff { fastest_rad_s, t_s }) = refused else { panic!("{refused:?}") };
        assert!((fastest_rad_s / 5.1e6 - 1.0).abs() < 0.02 && t_s < 1e-3);
        let endless = advance(&with_rate(1e300), 0.0, 1e-3, 0.0, &mut x);
        assert!(matches!(endless, Err(SolverError::TooStiff { .. })), "{endless:?}");
        let none = advance(&with_rate(f64::INFINITY), 0.0, 1e-3, 0.0, &mut x);
        assert!(matches!(none, Err(SolverError::NoRate { channel: 2, .. })), "{none:?}");
    }

    #[test]
    fn a_finite_escape_ends_as_a_runaway_state_and_not_as_a_stiff_plant() {
        // x_2' = e^x_1 from 20 on escapes within 0.1 ms.
        let mut x = [20.0, 0.0];
        assert_eq!(advance(&Benchmark::part_1(), 0.0, 1e-2, 0.0, &mut x), Ok(()));
        assert!(x.iter().any(|value| value.abs() > RUNAWAY), "{x:?}");
        let mut lost = [f64::NAN, 0.0];
        assert_eq!(advance(&Benchmark::part_1(), 0.0, 1e-2, 0.0, &mut lost), Ok(()));
    }
}
