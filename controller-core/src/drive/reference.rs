//! References as functions of the tick number, and the duration that a move needs.
//!
//! A reference gives the trajectory point (revolution and jet: r, r', r'', ..) at any tick. Ticks are integers, because
//! k T + T is not (k+1) T in floating point. Evaluate a reference once per tick, for the end of the tick. [`Player`]
//! keeps the start point. The law differences r^(n-1) and needs no higher derivative, so jumps of r^(n) cost nothing.
//! For a motor (n = 2) r' must be continuous, for a joint (n = 4) r'''.
//!
//! * [`Joined`]: a polynomial transition from any trajectory point to any other reference in a given time:
//!   $$ r = \text{target} + q(s), \quad q = (1 - s)^m \sum_{k<m} a_k s^k, \quad
//!   a_k = \sum_{j \le k} D_j \binom{m-1+k-j}{m-1}, \quad D_j = \text{gap}^{(j)} \tau^j / j! $$
//!   The transition has m derivatives of the start point (r included) and meets the target with m - 1. One formula
//!   covers a move from rest to rest, a start, a recovery, a new target in motion, and a stop. A move from rest to
//!   rest has degree 2m - 1: m = 4 is the default for a joint, m = 3 is minimum jerk. For a new target in motion,
//!   start from the trajectory point of the old plan, never from the measurement.
//! * [`Sine`], [`Rest`], and [`Streamed`] points.
//! * [`shortest`]: the smallest duration whose feedforward stays within a limit. Run it as background work, and never
//!   skip it: a plan beyond the limit can hold the loop in saturation for good. If there is no such duration, do not
//!   plan. Use the target itself: the offset W handles the recovery.
//!
//! The position of a move is whole revolutions and a remainder, summed in fixed point of 2^-32 revolutions (1.5e-9 rad)
//! for any T. After a million revolutions it has the noise of a position within the first revolution (test
//! `a_far_way_is_as_fine_as_a_near_one`). The derivatives are sums in T, relative to the goal and to the duration. They
//! are exact at the end of a move.
//!
//! ```
//! use controller_core::drive::{Joined, Player, Rest};
//!
//! // From rest at 0 to 1 rad in 100 ticks of 1 ms, degree 7.
//! let goal = Rest { turn: 0, angle: 1.0_f32 };
//! let mut player: Player<f32, _, 2> = Player::new(Joined::new(goal, [-1.0, 0.0, 0.0, 0.0], 0, 100, 1e-3), 0);
//! let [begin, end] = player.next_tick();
//! assert!(begin.jet[0].abs() < 1e-7 && end.jet[1] > 0.0);
//! ```

use core::f64::consts::TAU;

use super::target::Target;
use super::trigonometry::sin_cos;
use crate::real::Real;

/// Plan: a trajectory point at every tick.
pub trait Reference<T: Real<Count = i32>, const J: usize> {
    /// Returns r and its derivatives up to the order J - 1 at a tick.
    fn at(&self, tick: u32) -> Target<T, i32, J>;

    /// Marks finished moves as finished for good, even after the tick number has wrapped.
    ///
    /// The number wraps after 2³² ticks, five days at 10 kHz. A program that follows one plan for so long calls this
    /// function now and then.
    fn settle(&mut self, _tick: u32) {}
}

impl<T: Real<Count = i32>, R: Reference<T, J>, const J: usize> Reference<T, J> for &R {
    fn at(&self, tick: u32) -> Target<T, i32, J> {
        R::at(self, tick)
    }
}

/// Reference that stays at an angle of a revolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rest<T> {
    /// Whole revolutions.
    pub turn: i32,
    /// Remaining angle, rad.
    pub angle: T,
}

impl<T: Real<Count = i32>, const J: usize> Reference<T, J> for Rest<T> {
    fn at(&self, _: u32) -> Target<T, i32, J> {
        let mut jet = [T::ZERO; J];
        jet[0] = self.angle;
        Target { turn: self.turn, jet }
    }
}

/// Reference A sin ωt about angle 0, with phase 0 at tick 0. The phase is an integer that wraps, so it never drifts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sine<T> {
    amplitude: T,
    omega: T,
    /// Phase increment per tick, in 2^-32 periods.
    phase_per_tick: u32,
}

impl<T: Real<Count = i32>> Sine<T> {
    /// Returns a sine with its amplitude in rad. ω is rounded to whole 2^-32 periods per tick, 1.5e-6 rad/s at 1 ms.
    pub fn new(amplitude_rad: f64, omega_rad_s: f64, period_s: f64) -> Self {
        let phase_per_tick = (omega_rad_s * period_s / TAU * TWO_32 + 0.5) as u32;
        let omega = f64::from(phase_per_tick) / TWO_32 * TAU / period_s;
        Self { amplitude: T::from_f64(amplitude_rad), omega: T::from_f64(omega), phase_per_tick }
    }
}

pub(super) const TWO_32: f64 = 4_294_967_296.0;

impl<T: Real<Count = i32>, const J: usize> Reference<T, J> for Sine<T> {
    fn at(&self, tick: u32) -> Target<T, i32, J> {
        let jet = jet_of_sine(self.phase_per_tick.wrapping_mul(tick) as i32, self.amplitude, self.omega);
        Target { turn: 0, jet }
    }
}

/// Returns a sine and its derivatives at a phase in 2^-32 revolutions. Public only for the recorder of C.
#[doc(hidden)]
pub fn jet_of_sine<T: Real, const J: usize>(phase: T::Count, amplitude: T, omega: T) -> [T; J] {
    let (s, c) = sin_cos(T::from_count(phase) * T::from_f64(TAU / TWO_32), T::from_f64(1.0));
    let mut jet = [T::ZERO; J];
    let mut scale = amplitude;
    for j in 0..J {
        jet[j] = scale * [s, c, -s, -c][j % 4];
        scale = scale * omega;
    }
    jet
}

/// Largest number of future ticks: half of all tick numbers.
const FARTHEST: u32 = i32::MAX as u32;

/// Polynomial transition from a trajectory point to another reference.
///
/// Before its start tick it stays at its start point. It provides at least r and r' (J >= 2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joined<T, R, const M: usize> {
    target: R,
    end: u32,
    /// Factors 1/ticks, 1/τ, and 2^-32 ticks in s.
    per_tick: T,
    per_s: T,
    instant_s: T,
    ticks: u32,
    /// Quotient 2^64/ticks.
    share: Turns,
    /// Coefficients of q in powers of s and in powers of the remaining part 1 - s. Each is used in its own half. So the
    /// plan is exact at the end of the move.
    powers: [[[T; M]; 2]; 2],
    way: [[[Turns; M]; 2]; 2],
}

/// Fixed-point number in units of 2^-32, with its sign in the whole part. Two words, because a plan in C consists of
/// words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Turns {
    whole: i32,
    part: u32,
}

impl Turns {
    pub(super) const fn new(units: i64) -> Self {
        Self { whole: (units >> 32) as i32, part: units as u32 }
    }

    pub(super) const fn units(self) -> i64 {
        (self.whole as i64) << 32 | self.part as i64
    }

    /// Returns 2π `turn` + `rad`, or the nearest representable number.
    pub(super) fn at(turn: i32, rad: f64) -> Self {
        Self::new((i64::from(turn) << 32).saturating_add(nearest_unit(rad * (TWO_32 / TAU))))
    }

    /// Returns the nearest whole number, and the remainder in units of 2^-32.
    pub(super) const fn nearest_whole(self) -> [i32; 2] {
        [self.whole.wrapping_add((self.part >> 31) as i32), self.part as i32]
    }

    /// Returns the nearest number, at most [`FARTHEST_TURNS`].
    fn nearest(rad: f64) -> Self {
        let most = FARTHEST_TURNS * TWO_32;
        Self::new(nearest_unit((rad * (TWO_32 / TAU)).clamp(-most, most)))
    }
}

/// Largest coefficient of a move, in revolutions. With s up to 1/2 no sum of coefficients reaches twice this number.
const FARTHEST_TURNS: f64 = 1_073_741_824.0;

/// Largest coefficient of a move, rad: ten million revolutions of a joint's move. Larger values are clamped, or
/// rejected if the function can return an error.
pub const FARTHEST_RAD: f64 = 6e9;

pub(super) fn nearest_unit(units: f64) -> i64 {
    (if units < 0.0 { units - 0.5 } else { units + 0.5 }) as i64
}

/// Evaluates a polynomial of s = part/ticks ≤ 1/2 in units of 2^-32. The second result is the rounding of s in units of
/// 2^-32 ticks: s has 32 bits and is rounded down.
fn along<'a>(powers: impl DoubleEndedIterator<Item = &'a Turns>, part: u32, ticks: u32, share: Turns) -> (Turns, i32) {
    let s = ((u64::from(part) * share.units() as u64) >> 32) as u32;
    let early = s.wrapping_mul(ticks).wrapping_neg() as i32;
    let sum = powers.rev().fold(0, |sum: i64, power| {
        let (whole, rest) = (i64::from((sum >> 32) as i32) * i64::from(s as i32), u64::from(sum as u32) * u64::from(s));
        (whole + (rest >> 32) as i64).wrapping_add(power.units())
    });
    (Turns::new(sum), early)
}

/// Returns the binomial coefficient n over k.
fn choose(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |product, i| product * (n - i) as f64 / (i + 1) as f64)
}

impl<T: Real<Count = i32>, R, const M: usize> Joined<T, R, M> {
    /// Returns the transition to `target` in `ticks` ticks from a trajectory point that is `gap` away at tick `start`.
    ///
    /// `gap` is the present point minus the target point: r, r', .. in rad and s, see [`gap`]. `ticks` is clamped to
    /// 1..=2^24.
    pub fn new(target: R, gap: [f64; M], start: u32, ticks: u32, period_s: f64) -> Self {
        const { assert!(M >= 2 && M <= 5, "a join takes over 2 to 5 derivatives, r included") };
        let ticks = ticks.clamp(1, 1 << 24);
        let tau = f64::from(ticks) * period_s;
        let powers = powers_of_join(gap, tau);
        Self {
            target,
            end: start.wrapping_add(ticks),
            per_tick: T::from_f64(1.0 / f64::from(ticks)),
            per_s: T::from_f64(1.0 / tau),
            instant_s: T::from_f64(period_s / TWO_32),
            ticks,
            share: Turns::new((u64::MAX / u64::from(ticks)) as i64),
            powers: powers.map(|half| half.map(|part| part.map(T::from_f64))),
            way: powers.map(|half| half.map(|part| part.map(Turns::nearest))),
        }
    }

    /// Returns a plan that has met its target, as of tick 1. It costs a few instructions, for an interrupt that holds
    /// the place of a shaft; [`new`](Self::new) takes thousands of a core without `f64` in hardware.
    pub fn met(target: R) -> Self {
        let one = T::from_f64(1.0);
        Self {
            target,
            end: 1,
            per_tick: one,
            per_s: one,
            instant_s: T::from_f64(1.0 / TWO_32),
            ticks: 0,
            share: Turns::new(u64::MAX as i64),
            powers: [[[T::ZERO; M]; 2]; 2],
            way: [[[Turns::new(0); M]; 2]; 2],
        }
    }

    /// Returns the ticks until the target is met, or 0 afterwards. Ticks wrap: the end may be at most half of all ticks
    /// ahead.
    pub const fn left(&self, tick: u32) -> u32 {
        let left = self.end.wrapping_sub(tick);
        if self.ticks == 0 || left > FARTHEST { 0 } else { left }
    }
}

/// Returns q of a [`Joined`] in powers of s and of 1 - s, in two rows of M each, from the gap and τ in s.
///
/// It is public only for the recording of C. This module computes it in f64.
#[doc(hidden)]
pub fn powers_of_join<F: Real, const M: usize>(gap: [F; M], tau_s: F) -> [[[F; M]; 2]; 2] {
    let sum = |terms: &mut dyn Iterator<Item = F>| terms.reduce(|sum, term| sum + term).unwrap_or(F::ZERO);
    let (mut taylor, mut scale) = (gap, F::from_f64(1.0));
    for (j, entry) in taylor.iter_mut().enumerate() {
        *entry = *entry * scale;
        scale = scale * (tau_s / F::from_f64((j + 1) as f64));
    }
    let a: [F; M] =
        core::array::from_fn(|k| sum(&mut (0..=k).map(|j| taylor[j] * F::from_f64(choose(M - 1 + k - j, M - 1)))));
    // (1 - s)^m Σ a_k s^k, in powers of s. With u = 1 - s it is u^m Σ a_k (1 - u)^k.
    let sign = |i: usize| if i.is_multiple_of(2) { 1.0 } else { -1.0 };
    let in_s = |i: usize| {
        let terms = (0..M).filter(|k| (*k..=M + k).contains(&i));
        sum(&mut terms.map(|k| a[k] * F::from_f64(sign(i - k) * choose(M, i - k))))
    };
    let in_u = |i: usize| {
        let terms = if i < M { M..M } else { i - M..M };
        sum(&mut terms.map(|k| a[k] * F::from_f64(sign(i - M) * choose(k, i - M))))
    };
    let halves =
        |power: &dyn Fn(usize) -> F| core::array::from_fn(|half| core::array::from_fn(|k| power(M * half + k)));
    [halves(&in_s), halves(&in_u)]
}

impl<T: Real<Count = i32>, R: Reference<T, J>, const M: usize, const J: usize> Reference<T, J> for Joined<T, R, M> {
    fn at(&self, tick: u32) -> Target<T, i32, J> {
        let left = self.left(tick);
        if left == 0 {
            return self.target.at(tick);
        }
        // Before its start tick the plan stays at its start point.
        let left = if left > self.ticks { self.ticks } else { left };
        let mut target = self.target.at(self.end.wrapping_sub(left));
        let done = self.ticks - left;
        let (part, half, rate, instant_s) =
            if done < left { (done, 0, self.per_s, self.instant_s) } else { (left, 1, -self.per_s, -self.instant_s) };
        let (way, early) = along(self.way[half].as_flattened().iter(), part, self.ticks, self.share);
        let powers = self.powers[half].as_flattened().iter().copied();
        // Rounded to the nearest whole revolution.
        let [turns, rest] = way.nearest_whole();
        target.turn = target.turn.wrapping_add(turns);
        let late_s = T::from_count(early) * instant_s;
        let s = T::from_count(part as i32) * self.per_tick;
        let jet: [T; J] = jet_of_way(s, powers, rate, rest, late_s);
        for j in 0..J {
            target.jet[j] += jet[j];
        }
        target
    }

    fn settle(&mut self, tick: u32) {
        if self.left(tick) == 0 {
            self.ticks = 0;
        }
        self.target.settle(tick);
    }
}

/// Returns the trajectory point that a move adds to its goal. Public only for the recorder of C.
///
/// It is the remainder of the position in 2^-32 revolutions, advanced by `late_s` seconds, and the derivatives of the
/// polynomial.
#[doc(hidden)]
pub fn jet_of_way<T: Real, const J: usize>(
    x: T,
    powers: impl DoubleEndedIterator<Item = T>,
    rate: T,
    rest: T::Count,
    late_s: T,
) -> [T; J] {
    const { assert!(J >= 2, "a way gives r and r' at least") };
    let mut jet = jet_of(x, powers, rate);
    jet[0] = T::from_count(rest) * T::from_f64(TAU / TWO_32) + late_s * jet[1];
    jet
}

/// Returns a polynomial and its derivatives at an argument that moves at `rate`. Horner's scheme gives the value and
/// all Taylor coefficients at once.
fn jet_of<T: Real, const J: usize>(x: T, powers: impl DoubleEndedIterator<Item = T>, rate: T) -> [T; J] {
    let mut jet = [T::ZERO; J];
    for (k, power) in powers.rev().enumerate() {
        for i in (1..J).rev() {
            // Derivatives of a polynomial of degree k. The higher ones are 0.
            if i < k {
                jet[i] = jet[i] * x + jet[i - 1];
            } else if i == k {
                jet[i] = jet[i - 1];
            }
        }
        jet[0] = if k == 0 { power } else { jet[0] * x + power };
    }
    let mut scale = T::from_f64(1.0);
    for j in 0..J {
        jet[j] = scale * jet[j];
        scale = scale * rate * T::from_f64((j + 1) as f64);
    }
    jet
}

/// Returns the present point minus the target point, in f64 and with the revolutions counted, for [`Joined::new`].
pub fn gap<T: Real<Count = i32>, const M: usize>(present: &Target<T, i32, M>, target: &Target<T, i32, M>) -> [f64; M] {
    let mut gap = core::array::from_fn(|j| present.jet[j].to_f64() - target.jet[j].to_f64());
    gap[0] += TAU * f64::from(present.turn.wrapping_sub(target.turn));
    gap
}

/// Returns a controlled stop that starts at this trajectory point: its end position and its number of ticks.
///
/// The stop takes at most `ticks` ticks and never reverses. With $m = M - 1$ and s from 0 to 1 the speed on the way is
/// $$ \dot r = (1 - s)^m \sum_{k < m} R_k s^k, \quad R_k = \sum_{j \le k} V_j \binom{m - 1 + k - j}{m - 1}, \quad
/// V_j = r^{(j + 1)} \tau^j / j! $$
/// It starts with the given derivatives, and ends at rest with m - 1 derivatives. If no two R_k have opposite signs,
/// every speed keeps the sign of the initial speed. For a shaft that already slows down, a long stop would have to
/// reverse. For a short stop only $V_0 \binom{m - 1 + k}{m - 1}$ remains, and all signs are equal. So the stop takes
/// fewer ticks if needed, at least one. From a constant speed the stop covers half of the distance that the shaft would
/// have moved.
pub fn stop<T: Real<Count = i32>, const M: usize>(
    present: &Target<T, i32, M>,
    ticks: u32,
    period_s: f64,
) -> (Rest<T>, u32) {
    let jet = present.jet.map(T::to_f64);
    let (mut taken, mut too_many) = (ticks, ticks);
    if goes_back(&speed_of_stop(&jet, f64::from(ticks) * period_s)) {
        taken = ticks.min(1);
        while taken + 1 < too_many {
            let middle = taken + (too_many - taken) / 2;
            if goes_back(&speed_of_stop(&jet, f64::from(middle) * period_s)) {
                too_many = middle;
            } else {
                taken = middle;
            }
        }
    }
    let tau_s = f64::from(taken) * period_s;
    // The integral of (1 - s)^m s^k is k! m!/(k + m + 1)!.
    let (mut way, mut share) = (0.0, 1.0 / M as f64);
    for (k, part) in speed_of_stop(&jet, tau_s).into_iter().enumerate() {
        way += share * part;
        share *= (k + 1) as f64 / (k + 1 + M) as f64;
    }
    (Rest { turn: present.turn, angle: T::from_f64(jet[0] + tau_s * way) }, taken)
}

/// Returns R_k of [`stop`]. The last entry is 0.
fn speed_of_stop<const M: usize>(jet: &[f64; M], tau_s: f64) -> [f64; M] {
    let (mut parts, mut scale) = ([0.0; M], 1.0);
    for k in 1..M {
        parts[k - 1] = scale * jet[k];
        scale *= tau_s / k as f64;
    }
    // A factor 1/(1 - s) accumulates the entries before, and it occurs m times.
    for _ in 1..M {
        for k in 1..M - 1 {
            parts[k] += parts[k - 1];
        }
    }
    parts
}

/// Returns true if the speed has two signs.
fn goes_back(parts: &[f64]) -> bool {
    parts.iter().any(|part| *part > 0.0) && parts.iter().any(|part| *part < 0.0)
}

/// Reference from evenly spaced points, as a uniform quartic B-spline: r''' is continuous.
///
/// The points are filtered by $P - \frac{5}{24} \delta^2 P$ first. So the spline passes through them to the fourth
/// order (10 ms points of 0.5 sin t: to 2e-10). It has a delay of 3.5 points. An angle is in units of 2^-32
/// revolutions, so the differences for the derivatives are exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Streamed<T> {
    /// Last seven points, the newest last.
    points: [i64; 7],
    /// Tick of the newest point.
    tick: u32,
    /// Factors 1/(ticks per point) and 1/(time per point).
    per_tick: T,
    per_s: T,
    /// Control points relative to the middle one.
    control: [T; 5],
}

impl<T: Real<Count = i32>> Streamed<T> {
    /// Returns a reference at rest at this angle, in units of 2^-32 revolutions.
    pub fn new(angle: i64, ticks_per_point: u32, period_s: f64) -> Self {
        let ticks = f64::from(ticks_per_point);
        let (per_tick, per_s) = (T::from_f64(1.0 / ticks), T::from_f64(1.0 / (ticks * period_s)));
        Self { points: [angle; 7], tick: 0, per_tick, per_s, control: [T::ZERO; 5] }
    }

    /// Converts an angle from rad to units of 2^-32 revolutions.
    pub fn angle(rad: f64) -> i64 {
        nearest_unit(rad / TAU * TWO_32)
    }

    /// Adds the next point, at the tick at which it is due.
    pub fn push(&mut self, angle: i64, tick: u32) {
        self.points.rotate_left(1);
        self.points[6] = angle;
        self.tick = tick;
        let p = &self.points;
        let filtered = |i: usize| {
            let [before, here, after] = [i - 1, i, i + 1].map(|i| p[i].wrapping_sub(p[3]) as f64);
            here - 5.0 / 24.0 * (after - 2.0 * here + before)
        };
        self.control = core::array::from_fn(|i| T::from_f64(filtered(i + 1) * (TAU / TWO_32)));
    }
}

impl<T: Real<Count = i32>, const J: usize> Reference<T, J> for Streamed<T> {
    fn at(&self, tick: u32) -> Target<T, i32, J> {
        // Powers of s on the five control points, times 24.
        const POWERS: [[f64; 5]; 5] = [
            [1.0, 11.0, 11.0, 1.0, 0.0],
            [-4.0, -12.0, 12.0, 4.0, 0.0],
            [6.0, -6.0, -6.0, 6.0, 0.0],
            [-4.0, 12.0, -12.0, 4.0, 0.0],
            [1.0, -4.0, 6.0, -4.0, 1.0],
        ];
        let s = T::from_count(tick.wrapping_sub(self.tick) as i32) * self.per_tick;
        let power = |row: &[f64; 5]| {
            let terms = row.iter().zip(self.control);
            terms.fold(T::ZERO, |sum, (entry, control)| sum + T::from_f64(*entry / 24.0) * control)
        };
        let mut jet = jet_of(s, POWERS.iter().map(power), self.per_s);
        let [turn, rest] = Turns::new(self.points[3]).nearest_whole();
        jet[0] += T::from_f64(f64::from(rest) * (TAU / TWO_32));
        Target { turn, jet }
    }
}

/// Player of a reference. It keeps the start point of the coming tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Player<T, R, const J: usize> {
    reference: R,
    tick: u32,
    last: Target<T, i32, J>,
}

impl<T: Real<Count = i32>, R: Reference<T, J>, const J: usize> Player<T, R, J> {
    /// Returns a player whose first tick begins at `tick`: 0, or 1 if u is applied one tick late.
    pub fn new(reference: R, tick: u32) -> Self {
        let last = reference.at(tick);
        Self { reference, tick, last }
    }

    /// Returns the targets at the start and at the end of the coming tick.
    pub fn next_tick(&mut self) -> [Target<T, i32, J>; 2] {
        self.tick = self.tick.wrapping_add(1);
        let begin = self.last;
        self.last = self.reference.at(self.tick);
        [begin, self.last]
    }

    /// Returns the tick at which the coming tick begins. Start a new plan there.
    pub const fn tick(&self) -> u32 {
        self.tick
    }

    /// Switches to another reference from the coming tick on. It must begin at the present point.
    pub fn play(&mut self, reference: R) {
        self.reference = reference;
    }

    /// Returns the reference, for example to add a point.
    pub fn reference_mut(&mut self) -> &mut R {
        &mut self.reference
    }
}

/// Returns the smallest number of ticks from `fewest` to `most` whose plan keeps the feedforward within ±`u_max`.
///
/// The plan begins at tick `start` and is checked at 64 of its ticks. Use 0.9 of the current limit as `u_max`.
/// `feed_forward` returns u for a trajectory point of n + 1 entries:
/// [`Motor::feed_forward`](super::Motor::feed_forward), [`Joint::feed_forward`](super::Joint::feed_forward).
///
/// Returns `None` if there is no such plan. A plan always has at least 20 ticks: with fewer ticks the check would miss
/// the peak of u. Longer plans than a feasible one may be infeasible. The search goes up by a quarter each time, and
/// then refines the first feasible number.
pub fn shortest<R: Reference<f64, J>, const J: usize>(
    start: u32,
    fewest: u32,
    most: u32,
    u_max: f64,
    feed_forward: impl Fn(&[f64; J]) -> f64,
    plan: impl Fn(u32) -> R,
) -> Option<u32> {
    const POINTS: u64 = 64;
    const FEWEST_TICKS: u32 = 20;
    let fits = |ticks: u32| {
        let plan = plan(ticks);
        (0..POINTS).all(|i| {
            let tick = start.wrapping_add((u64::from(ticks) * i / POINTS) as u32);
            feed_forward(&plan.at(tick).jet).abs() <= u_max
        })
    };
    let (mut low, mut high) = (0, fewest.max(FEWEST_TICKS));
    while high <= most && !fits(high) {
        low = high;
        high = high.saturating_add(high / 4);
    }
    if high > most {
        return None;
    }
    while low > 0 && high - low > 1 {
        let middle = low + (high - low) / 2;
        if fits(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(high)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::drive::{Joint, Motor};

    /// Printed polynomials of the moves in powers of s. Entry i has m = i + 2.
    const POINT: [&[f64]; 4] = [
        &[0.0, 0.0, 3.0, -2.0],
        &[0.0, 0.0, 0.0, 10.0, -15.0, 6.0],
        &[0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0],
        &[0.0, 0.0, 0.0, 0.0, 0.0, 126.0, -420.0, 540.0, -315.0, 70.0],
    ];

    fn printed(c: &[f64], s: f64, tau: f64, j: i32) -> f64 {
        let term = |(i, c): (usize, &f64)| {
            let power = i32::try_from(i).expect("small");
            let factor: f64 = (0..j).map(|k| f64::from(power - k)).product();
            if power < j { 0.0 } else { c * factor * s.powi(power - j) }
        };
        c.iter().enumerate().map(term).sum::<f64>() / tau.powi(j)
    }

    fn at<T: Real<Count = i32>, const J: usize>(reference: &impl Reference<T, J>, tick: u32) -> [f64; J] {
        let Target { turn, jet } = reference.at(tick);
        core::array::from_fn(|j| jet[j].to_f64() + if j == 0 { TAU * f64::from(turn) } else { 0.0 })
    }

    fn joined<T: Real<Count = i32>, const M: usize>(distance: f64) -> Joined<T, Rest<T>, M> {
        let mut gap = [0.0; M];
        gap[0] = -distance;
        Joined::new(Rest { turn: 0, angle: T::from_f64(distance) }, gap, 50, 200, 1e-3)
    }

    /// Rounding of a position: 9 sums of its polynomial are rounded to 2^-32 revolutions, and each affects the next by
    /// half.
    const GRID_RAD: f64 = 2.0 * TAU / TWO_32;

    /// Compares with the printed polynomial, which cancels from coefficients up to 540 (of its derivatives, 1e4) to 1.
    #[test]
    fn a_move_from_rest_to_rest_is_the_printed_polynomial() {
        macro_rules! check {
            ($m:literal) => {{
                let plan = joined::<f64, $m>(0.7);
                for tick in 50..250 {
                    let found: [f64; 5] = at(&plan, tick);
                    for j in 0..5_u8 {
                        let s = f64::from(tick - 50) / 200.0;
                        let expected = 0.7 * printed(POINT[$m - 2], s, 0.2, i32::from(j));
                        let size = 0.7 * [1.0, 10.0, 300.0, 3e4, 3e6][usize::from(j)];
                        let off = (found[usize::from(j)] - expected).abs();
                        let grid = if j == 0 { GRID_RAD } else { 0.0 };
                        assert!(off <= 3e-12 * size + grid, "m = {}, tick {tick}, r^({j}): {off:e}", $m);
                    }
                }
                assert_eq!(at::<f64, 3>(&plan, 250), [0.7, 0.0, 0.0]);
                assert_eq!(at::<f64, 3>(&plan, 1000), [0.7, 0.0, 0.0]);
            }};
        }
        check!(2);
        check!(3);
        check!(4);
        check!(5);
    }

    #[test]
    fn a_join_takes_over_m_derivatives_and_meets_the_target_with_as_many() {
        let sine = Sine::<f64>::new(0.5, 7.0, 1e-3);
        let present = Target { turn: 3, jet: [0.3, -1.0, 20.0, -300.0, 4000.0] };
        let plan = Joined::new(sine, gap(&present, &sine.at(40)), 40, 120, 1e-3);
        let begin: [f64; 5] = at(&plan, 40);
        for (j, jet) in present.jet.into_iter().enumerate() {
            let expected = jet + if j == 0 { TAU * 3.0 } else { 0.0 };
            let grid = if j == 0 { GRID_RAD } else { 0.0 };
            assert!((begin[j] - expected).abs() <= 1e-9 * (1.0 + expected.abs()) + grid, "r^({j}): {}", begin[j]);
        }
        // The last tick is near the target to the order 5 - j in the remaining time, which is 1/120.
        let (last, target): ([f64; 5], [f64; 5]) = (at(&plan, 159), at(&sine, 159));
        // The gap is 19 rad.
        let (mut size, mut factor) = (4e3 * 120.0_f64.powi(-5), 5.0);
        for j in 0..5 {
            let size_j = size + if j == 0 { GRID_RAD } else { 0.0 };
            assert!((last[j] - target[j]).abs() <= size_j, "r^({j}) off by {} of {size}", last[j] - target[j]);
            size *= factor * 1e3;
            factor -= 1.0;
        }
        assert_eq!(at::<f64, 5>(&plan, 160), at::<f64, 5>(&sine, 160));
    }

    /// Checks that every derivative of a reference is the difference quotient of the one before, independent of the
    /// formulas.
    #[test]
    fn derivatives_are_those_of_the_position() {
        fn check(name: &str, plan: &impl Reference<f64, 5>, ticks: core::ops::Range<u32>) {
            for tick in ticks {
                let [before, here, after] = [tick - 1, tick, tick + 1].map(|tick| plan.at(tick).jet);
                for j in 0..4 {
                    let found = (after[j] - before[j]) / 2e-5;
                    let bend = (after[j + 1] - 2.0 * here[j + 1] + before[j + 1]).abs();
                    assert!((found - here[j + 1]).abs() <= bend + 1e-4 * (1.0 + here[j + 1].abs()), "{name}, r^({j})");
                }
            }
        }
        check("sine", &Sine::<f64>::new(0.5, 7.0, 1e-5), 1000..1200);
        let mut gap = [0.0; 5];
        gap[0] = -1.0;
        check("move", &Joined::new(Rest { turn: 0, angle: 1.0 }, gap, 0, 20_000, 1e-5), 9000..9200);
    }

    #[test]
    fn streamed_points_are_met_late_by_three_and_a_half() {
        let h = 0.01;
        let at_point = |k: u32| 2.0 * TAU + 0.5 * (h * f64::from(k)).sin();
        let first = Streamed::<f64>::angle(at_point(0));
        let (mut double, mut single) = (Streamed::<f64>::new(first, 10, 1e-3), Streamed::<f32>::new(first, 10, 1e-3));
        let (mut worst, mut jump, mut rough) = (0.0_f64, 0.0_f64, 0.0_f64);
        let mut last = 0.0;
        for tick in 0..4000_u32 {
            if tick % 10 == 0 {
                double.push(Streamed::<f64>::angle(at_point(tick / 10)), tick);
                single.push(Streamed::<f32>::angle(at_point(tick / 10)), tick);
            }
            let (found, coarse): ([f64; 4], [f64; 4]) = (at(&double, tick), at(&single, tick));
            if tick > 100 {
                let t = 1e-3 * f64::from(tick) - 3.5 * h;
                worst = worst.max((found[0] - 2.0 * TAU - 0.5 * t.sin()).abs());
                rough = rough.max((coarse[3] - found[3]).abs());
                jump = jump.max((found[3] - last).abs());
            }
            last = found[3];
        }
        std::println!("r off by {worst:.1e}; third derivative steps {jump:.1e}, in f32 off by {rough:.1e}");
        // The points are rounded to 0.7e-9 rad, and f32 rounds their distances as much. In r^(3) that is amplified some
        // million times.
        assert!(worst <= 2e-9, "{worst:e}");
        assert!(jump <= 4e-3 && rough <= 4e-3, "{jump:e}, {rough:e}");
    }

    #[test]
    fn f32_follows_f64() {
        let (double, single) = (joined::<f64, 4>(1.0), joined::<f32, 4>(1.0));
        let (sine, coarse) = (Sine::<f64>::new(1.0, TAU, 1e-3), Sine::<f32>::new(1.0, TAU, 1e-3));
        let mut worst = [0.0_f64; 4];
        for tick in 0..1000 {
            let (a, b): ([f64; 4], [f64; 4]) = (at(&double, tick), at(&single, tick));
            let (c, d): ([f64; 4], [f64; 4]) = (at(&sine, tick), at(&coarse, tick));
            let (moves, sines) = ([1.0, 11.0, 188.0, 6600.0], [1.0, TAU, TAU * TAU, TAU * TAU * TAU]);
            for j in 0..4 {
                worst[j] = worst[j].max((a[j] - b[j]).abs() / moves[j]).max((c[j] - d[j]).abs() / sines[j]);
            }
        }
        std::println!("f32 off by {worst:?} of the largest");
        assert!(worst[0] <= 4e-7 && worst.iter().all(|&worst| worst <= 2e-6), "{worst:?}");
    }

    /// Returns the revolutions of a move of degree 5 in whole numbers: $D (10 s^3 - 15 s^4 + 6 s^5)$ at s = k/n is D
    /// P/n^5.
    ///
    /// The sum runs over the bits of D P, and whole revolutions are removed at every bit.
    fn in_whole_numbers(turns: u32, k: u32, n: u32) -> (i32, f64) {
        let [k, n] = [k, n].map(i128::from);
        let (share, all) = (k.pow(3) * (10 * n * n - 15 * k * n + 6 * k * k), n.pow(5));
        let (mut whole, mut rest) = (0_i32, 0_i128);
        for bit in (0..32).rev() {
            (whole, rest) = (2 * whole, 2 * rest + if turns >> bit & 1 == 1 { share } else { 0 });
            whole += (rest / all) as i32;
            rest %= all;
        }
        (whole, rest as f64 / all as f64)
    }

    /// Checks f32 from 10 to a million revolutions, in 1 s to four hours: the noise equals the noise of the first
    /// revolution.
    #[test]
    fn a_far_way_is_as_fine_as_a_near_one() {
        for (turns, ticks) in [(10, 1000), (1000, 20_000), (1_000_000, 1 << 24), (1_000_000, 6_000_001)] {
            let goal = Rest { turn: turns, angle: 0.0_f32 };
            let plan: Joined<f32, _, 3> = Joined::new(goal, [-TAU * f64::from(turns), 0.0, 0.0], 7, ticks, 1e-3);
            let (mut worst, mut steps, mut last) = (0.0_f64, 0.0_f64, 0.0);
            // Some whole sections of the move, and the middle, where the halves meet.
            for stretch in 0..=20 {
                for k in (0..100).map(|k| (u64::from(ticks - 100) * stretch / 20) as u32 + k) {
                    let found: Target<f32, i32, 2> = plan.at(7 + k);
                    let (whole, rest) = in_whole_numbers(turns as u32, k, ticks);
                    let off = TAU * (f64::from(found.turn - whole) - rest) + f64::from(found.jet[0]);
                    worst = worst.max(off.abs());
                    steps = steps.max(if k > 0 && last != 0.0 { (off - last).abs() } else { 0.0 });
                    last = off;
                }
            }
            std::println!("{turns} turns in {ticks} ticks: off by {worst:.1e} rad, by {steps:.1e} from tick to tick");
            // Half a digit of 3.14 in f32 is 1.2e-7, and the result consists of three numbers of this size.
            assert!(worst < 4e-7, "{turns} in {ticks}: {worst:e}");
        }
    }

    #[test]
    fn a_plan_across_the_wrap_of_the_tick_number_goes_on() {
        let start = u32::MAX - 20;
        let plan: Joined<f64, _, 2> = Joined::new(Rest { turn: 0, angle: 0.0 }, [1.0, 0.0], start, 40, 1e-3);
        let mut last = 1.0;
        for k in 1..=40 {
            let [r, _]: [f64; 2] = at(&plan, start.wrapping_add(k));
            assert!(r < last, "tick {k}: {r} after {last}");
            last = r;
        }
        assert_eq!(last, 0.0);
    }

    #[test]
    fn a_stop_never_goes_back() {
        let present = Target { turn: 2, jet: [0.4, 30.0, 0.0_f64] };
        let (rest, ticks) = stop(&present, 100, 1e-3);
        let plan: Joined<f64, _, 3> = Joined::new(rest, gap(&present, &rest.at(0)), 0, ticks, 1e-3);
        for tick in 0..100 {
            let [r, v]: [f64; 2] = at(&plan, tick);
            assert!(v >= -1e-9 && r <= 2.0 * TAU + 0.4 + 1.5 + 1e-9, "tick {tick}: {r}, {v}");
        }
    }

    /// Checks the recovery from 0.1 rad with the motor at 0, within 27 A: 0.21 s.
    #[test]
    fn the_shortest_recovery_of_the_joint_is_the_known_one() {
        let joint = Joint::TABLE_I;
        let (k_1, b_1) = (9.0 / 0.23, 0.07 / 0.23);
        let pull = k_1 * 0.1 + 0.1_f64.sin();
        let gap = [0.1, 0.0, -pull, b_1 * pull];
        let plan = |ticks| Joined::<f64, _, 4>::new(Rest { turn: 0, angle: 0.0 }, gap, 0, ticks, 1e-3);
        let ticks = shortest::<_, 5>(0, 20, 10_000, 27.0, |jet| joint.feed_forward(jet), plan);
        assert!((205..=215).contains(&ticks.expect("a plan")), "{ticks:?}");
        // Below the initial current for the spring there is no plan.
        assert_eq!(shortest::<_, 5>(0, 20, 10_000, 1.0, |jet| joint.feed_forward(jet), plan), None);
    }

    /// Checks the closed form: the largest acceleration of degree 5 is 10/√3 D/τ².
    #[test]
    fn the_shortest_move_of_a_motor_is_the_closed_form() {
        let motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 0.0 };
        let plan = |ticks| Joined::<f64, _, 3>::new(Rest { turn: 0, angle: 1.0 }, [-1.0, 0.0, 0.0], 0, ticks, 1e-5);
        let ticks = shortest::<_, 3>(0, 20, 100_000, 9.0, |jet| motor.feed_forward(jet), plan).expect("a plan");
        let expected = (10.0 / 3.0_f64.sqrt() / (9.0 * 250.0)).sqrt();
        assert!((f64::from(ticks) * 1e-5 / expected - 1.0).abs() < 2e-3, "{ticks} for {expected} s");
    }

    /// Checks the peak between the ticks of short moves: at most 1.1 % above the limit. A parabola through the peak of
    /// degree 5 falls by that much within half of a twentieth.
    #[test]
    fn the_peak_of_a_short_move_is_not_missed_between_ticks() {
        let motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 0.0 };
        let shortest_of = |distance: f64, most: u32| {
            let plan = |ticks| {
                Joined::<f64, _, 3>::new(Rest { turn: 0, angle: distance }, [-distance, 0.0, 0.0], 0, ticks, 1e-3)
            };
            shortest::<_, 3>(0, 1, most, 9.0, |jet| motor.feed_forward(jet), plan)
        };
        for distance in [1e-4, 1e-3, 0.01, 0.03, 0.1, 0.2, 0.3, 0.7, 1.0, 10.0] {
            let ticks = shortest_of(distance, 10_000).expect("a plan");
            let tau = f64::from(ticks) * 1e-3;
            let peak = 10.0 / 3.0_f64.sqrt() * distance / (tau * tau);
            assert!(peak <= 1.015 * 9.0 * 250.0, "{distance} rad in {ticks} ticks asks for {peak} rad/s^2 of 2250");
        }
        assert_eq!(shortest_of(1e-4, 19), None);
    }
}
