//! Config -> Controller -> State: tune with the first, run with the second, remember in the third.
//!
//! One tick every period T: sample x, compute u, hold it. The tick is the folded form of the discrete controller
//! (module `design` explains the folding): with $\beta = b(x)/b_0$, $a_u = a(x)/b_0$ and all of channel n in units of
//! $b_0 u$
//!
//! 1. $h_i = w_i x_{i+1}$ ($i < n$), $h_n = \theta a_u$; innovation $e_i = (x_i - x_i^-)/T - h_i - P_i$ per observed
//!    channel; observer update;
//! 2. $y_j = x_j$, $y_{i+1} \mathrel{+}= A_i$; $\sigma = c \cdot y + \sum (g_B B + g_C C)$; $\sigma^* = \sigma - W$
//!    (Eq. (44), (17));
//! 3. $v = k_x \cdot y + k_w W + u_\sigma \sigma^* + \sum (k_B B + k_C C) + \mathrm{clamp}(s \thinspace \sigma^*,
//!    \pm lim)$, $u = (v - a_u - A_n)/\beta$ clamped (Eq. (51));
//! 4. $P_i = y_{i+1} - h_i$, $P_n = a_u + A_n - h_n$ (u joins when it is known), $x^- = x$,
//!    $W \mathrel{-}= (1 - e^{-\alpha T}) W$.
//!
//! Units: with U that of the output $y = x_1$, channel i has $x_i$ in U/s^(i-1) and $d_i$ in U/s^i; σ and σ*, whose
//! $c_n$ is 1, have the unit of $x_n$.
//!
//! There is no exponential, no division (for a constant b), no branch on the first call and no panic in it.
//!
//! ```
//! use controller_core::*;
//!
//! // The flexible joint of the paper, observers in channels 2 and 4, designed by the compiler.
//! type Joint = Controller<f32, FlexibleJoint<f32>, 4, 2, { channels([2, 4]) }, 2>;
//! const NOMINAL: Nominal<4> = JointParameters::TABLE_I.chain(Reading::Reconstructed).nominal();
//! const GAINS: ObserverGains<2> = ObserverGains::as_printed([100.0, 20.0]);
//! const CONTROLLER: Joint = Joint::designed(
//!     &Config {
//!         period_s: 1e-3,
//!         surface: Surface::from_coefficients([125.0, 75.0, 15.0, 1.0], 1.0),
//!         observers: [None, Some(GAINS), None, Some(GAINS)],
//!         reaching: ReachingLaw { k_l: 50.0, k_s: 0.0, epsilon: 0.01 },
//!         nominal: NOMINAL,
//!         limits: Limits::NONE,
//!         fallback: Fallback::HoldLast,
//!         sigma_star_bound: 1e12,
//!         observer_pole_limit: 1.0,
//!     },
//!     FlexibleJoint::<f32>::new(&NOMINAL),
//! );
//!
//! let mut state = CONTROLLER.start(&[0.1, 0.0, 0.0, 0.0]).expect("a finite first sample");
//! let output = CONTROLLER.tick(&mut state, &[0.1, 0.0, 0.0, 0.0]);
//! assert_eq!(output.sigma_star, 0.0); // Eq. (17): the offset starts the sliding variable at zero
//! ```

use crate::MAX_N;
use crate::config::{Config, INPUT_LIMIT};
use crate::design::{self, Coefficients};
use crate::error::ConfigError;
use crate::health::Health;
use crate::model::NominalModel;
use crate::observer;
use crate::real::Real;

/// `MASK` of [`Controller`] from channel numbers as the paper counts them.
///
/// # Panics
/// On a number outside 1..=6 or named twice; in a type, where it belongs, that is a compile error.
///
/// ```
/// assert_eq!(controller_core::channels([2, 4]), 0b1010);
/// ```
pub const fn channels<const O: usize>(numbers: [usize; O]) -> u8 {
    let mut mask = 0;
    let mut k = 0;
    while k < O {
        assert!(numbers[k] >= 1 && numbers[k] <= MAX_N, "a channel number must be 1..=6");
        assert!(mask >> (numbers[k] - 1) & 1 == 0, "a channel is named twice");
        mask |= 1 << (numbers[k] - 1);
        k += 1;
    }
    mask
}

/// A designed controller: coefficients and the nominal model, never changed by a tick.
///
/// * `T`: precision, `f32` or `f64`
/// * `M`: nominal model a(x)/b_0
/// * `N`: plant order, 2..=6
/// * `R`: capacity for observer orders, 1..=3
/// * `MASK`, `O`: which channels carry an observer (bit i - 1 for channel i, see [`channels`]), and how many. An absent
///   channel takes no state and executes no instruction.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Controller<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize> {
    coefficients: Coefficients<T, N, R, O>,
    model: M,
}

/// What the controller remembers between two ticks. It belongs to the controller that started it: another design
/// would read it in other units. Its layout is that of the fields in this order, for callers in C.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct State<T, const R: usize, const O: usize> {
    /// A, B, C of each observed channel.
    z: [[T; R]; O],
    /// P of each observed channel; without u in channel n.
    past: [T; O],
    /// x of each observed channel at the last tick.
    x_prev: [T; O],
    /// W = σ(0) e^(-αt).
    offset: T,
    /// What the actuator holds.
    held: T,
    /// b(x)/b_0 at the last tick; not used if b is constant.
    gain_prev: T,
    /// No last tick to compare the next sample with: after the start, and after a lost sample. A `bool`, since an
    /// `Option<State>` then needs no tag of its own: 46 cycles in an interrupt that ticks one.
    resuming: bool,
}

/// What one tick returns.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Output<T> {
    /// The control to hold until the next tick, within the limits; in the plant's input unit.
    pub u: T,
    /// σ, Eq. (44), in the unit of x_n.
    pub sigma: T,
    /// σ*, Eq. (17), in the unit of x_n.
    pub sigma_star: T,
    /// Trouble, if any. After a rejected input `sigma` is the offset alone and `sigma_star` 0.
    pub health: Health,
}

macro_rules! design_in {
    ($t:ty, $convert:ident) => {
        impl<M, const N: usize, const R: usize, const MASK: u8, const O: usize> Controller<$t, M, N, R, MASK, O>
        where
            M: NominalModel<$t, N> + Copy,
        {
            /// Designs the controller; the same numbers whether the compiler or the program calls it.
            ///
            /// # Errors
            /// What [`Config::validate`] refuses, and a configuration whose observers are not those of `MASK`.
            pub const fn design(config: &Config<N, R>, model: M) -> Result<Self, ConfigError> {
                match design_f64::<N, R, MASK, O>(config) {
                    Ok(rows) => Ok(Self::from_parts(design_in!(@$convert rows), model)),
                    Err(error) => Err(error),
                }
            }

            /// [`design`](Self::design) for a `const`: a bad configuration is a compile error with the reason.
            ///
            /// # Panics
            /// On a bad configuration; outside a `const` use [`design`](Self::design).
            pub const fn designed(config: &Config<N, R>, model: M) -> Self {
                match Self::design(config, model) {
                    Ok(controller) => controller,
                    Err(error) => panic!("{}", error.text().as_str()),
                }
            }
        }
    };
    (@single $c:ident) => { $c.in_f32() };
    (@double $c:ident) => { $c };
}
design_in!(f32, single);
design_in!(f64, double);

const fn assert_shape<const N: usize, const MASK: u8, const O: usize>() {
    assert!(MASK as usize >> N == 0, "MASK names a channel above N");
    assert!(MASK.count_ones() as usize == O, "O must be the number of channels in MASK");
}

const fn design_f64<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    config: &Config<N, R>,
) -> Result<Coefficients<f64, N, R, O>, ConfigError> {
    const { assert_shape::<N, MASK, O>() };
    let mut i = 0;
    while i < N {
        let channel = i + 1;
        let configured = config.observers[i].is_some();
        if configured != (MASK >> i & 1 == 1) {
            return Err(ConfigError::ChannelMismatch { channel, configured });
        }
        i += 1;
    }
    match config.validate() {
        Ok(()) => design::coefficients(config, &design::observed(MASK)),
        Err(error) => Err(error),
    }
}

impl<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize> Controller<T, M, N, R, MASK, O>
where
    T: Real,
    M: NominalModel<T, N>,
{
    /// The observed channels, from 0.
    const CHANNELS: [usize; O] = design::observed(MASK);
    const LAST: usize = N - 1;

    /// A controller of coefficients that were designed elsewhere, see [`Coefficients::from_numbers`].
    pub const fn from_parts(coefficients: Coefficients<T, N, R, O>, model: M) -> Self {
        const { assert_shape::<N, MASK, O>() };
        Self { coefficients, model }
    }

    /// What the tick multiplies with.
    pub const fn coefficients(&self) -> &Coefficients<T, N, R, O> {
        &self.coefficients
    }

    /// The nominal model.
    pub const fn model(&self) -> &M {
        &self.model
    }

    /// State before the first tick, estimates at 0. `None` if the sample is not finite; try the next one.
    pub fn start(&self, x0: &[T; N]) -> Option<State<T, R, O>> {
        self.start_from(x0, &[T::ZERO; N])
    }

    /// State before the first tick with a guess of the disturbances, d_hat of each channel in its physical unit
    /// (entries of unobserved channels are not read). The offset of Eq. (17) is taken here: give the first tick the
    /// same sample.
    pub fn start_from(&self, x0: &[T; N], d_hat: &[T; N]) -> Option<State<T, R, O>> {
        let mut z = [[T::ZERO; R]; O];
        for s in 0..O {
            let i = Self::CHANNELS[s];
            z[s][0] = if i == Self::LAST { d_hat[i] / self.coefficients.input_gain } else { d_hat[i] };
        }
        let offset = self.sigma(&Self::advanced(x0, &z), &z);
        let all_sound = x0.iter().chain(z.as_flattened()).all(|&value| is_sound(value)) && is_sound(offset);
        all_sound.then_some(State {
            z,
            past: [T::ZERO; O],
            x_prev: [T::ZERO; O],
            offset,
            held: T::ZERO,
            gain_prev: T::ZERO,
            resuming: true,
        })
    }

    /// [`tick`](Self::tick) of a controller that need not have started: the first good sample starts it, from `d_hat`
    /// as [`start_from`](Self::start_from) does; until then the fallback goes out (0, as far as the limits allow it, if
    /// there is nothing to hold).
    #[inline]
    pub fn tick_or_start(&self, state: &mut Option<State<T, R, O>>, d_hat: &[T; N], x: &[T; N]) -> Output<T> {
        if state.is_none() {
            *state = self.start_from(x, d_hat);
        }
        match state {
            Some(state) => self.tick(state, x),
            None => self.not_started(),
        }
    }

    /// What goes out as long as there has been no good sample to start with.
    #[inline]
    pub fn not_started(&self) -> Output<T> {
        Output {
            u: self.coefficients.fallback.limited(self.coefficients.u_min, self.coefficients.u_max),
            sigma: T::ZERO,
            sigma_star: T::ZERO,
            health: Health::INPUT_REJECTED,
        }
    }

    /// One tick: observers, σ*, law, clamp. Call it once per period with the newest sample x, in chain coordinates.
    ///
    /// A sample that is not finite never reaches the state (see [`INPUT_LIMIT`]); the estimates wait, and the next good
    /// sample resumes without a kick. The tick takes `u` as what the actuator will hold; if it will not, say so with
    /// [`State::applied`].
    #[inline]
    pub fn tick(&self, state: &mut State<T, R, O>, x: &[T; N]) -> Output<T> {
        self.step::<true>(state, x)
    }

    /// [`tick`](Self::tick) without the guard: once a first `tick` has been made, the same bits for good samples, and
    /// NaN for ever after one that is not. It is there so that the guard can be priced; firmware has no use for it.
    #[doc(hidden)]
    #[inline]
    pub fn tick_unguarded(&self, state: &mut State<T, R, O>, x: &[T; N]) -> Output<T> {
        self.step::<false>(state, x)
    }

    #[inline(always)]
    fn step<const GUARDED: bool>(&self, state: &mut State<T, R, O>, x: &[T; N]) -> Output<T> {
        let k = &self.coefficients;
        let drift = self.model.drift(x);
        let gain = self.model.gain_ratio(x);

        // 1. Observers. Here and below: short loops of one job each are unrolled, and the order of the statements, the
        // driven channel first, is the one of the fewest cycles (docs/cycles.md).
        let mut moved = [T::ZERO; O];
        for s in 0..O {
            let i = Self::CHANNELS[s];
            moved[s] = (x[i] - state.x_prev[s]) * if i == Self::LAST { k.rate_n } else { k.rate };
        }
        let h = self.foreseen(x, drift);
        let held = match gain {
            None => state.held,
            // What b u really was: b(x) moved from its last to its present value during the tick.
            Some(now) => state.held * (state.gain_prev + k.theta_n * (now - state.gain_prev)),
        };
        let mut z = state.z;
        for s in (0..O).rev() {
            let expected = if Self::CHANNELS[s] == Self::LAST { state.past[s] + held } else { state.past[s] };
            z[s] = observer::advance(z[s], &k.gamma[s], moved[s] - h[s] - expected);
        }
        if GUARDED && state.resuming {
            // There is no last tick to compare with: the estimates wait one more.
            z = state.z;
        }

        // 2. Surface, and of the law what needs no sigma*.
        let y = Self::advanced(x, &z);
        let mut input_drift = drift;
        for s in 0..O {
            if Self::CHANNELS[s] == Self::LAST {
                input_drift += z[s][0];
            }
        }
        let mut v = -input_drift;
        for s in (0..O).rev() {
            for m in 1..R {
                v += k.k[s][m] * z[s][m];
            }
        }
        let sigma = self.sigma(&y, &z);
        let sigma_star = sigma - state.offset;

        // 3. Law.
        v += k.kw * state.offset;
        v += k.us * sigma_star;
        for j in 1..N {
            v += k.kx[j] * y[j];
        }
        v += (k.satk * sigma_star).limited(-k.lim, k.lim);
        let demand = match gain {
            None => v,
            Some(ratio) => v / ratio,
        };
        if GUARDED && !(is_sound(demand) && gain.is_none_or(is_sound)) {
            return self.reject(state, demand);
        }

        // 4. Memory.
        for s in 0..O {
            let i = Self::CHANNELS[s];
            state.past[s] = if i == Self::LAST { input_drift } else { y[i + 1] } - h[s];
        }
        state.z = z;
        for s in 0..O {
            state.x_prev[s] = x[Self::CHANNELS[s]];
        }
        let u = demand.limited(k.u_min, k.u_max);
        state.held = u;
        state.offset -= k.decay * state.offset;
        if GUARDED {
            state.resuming = false;
        }
        if let Some(ratio) = gain {
            state.gain_prev = ratio;
        }

        let health = Health::SATURATED
            .when(u != demand)
            .union(Health::SIGMA_STAR_OVER_BOUND.when(sigma_star.abs() > k.sigma_star_bound));
        Output { u, sigma, sigma_star, health }
    }

    /// h of each observed channel: what x_{i+1} (or a) at the end of the tick contributes to the mean over the tick.
    #[inline(always)]
    fn foreseen(&self, x: &[T; N], drift: T) -> [T; O] {
        let mut h = [T::ZERO; O];
        for s in 0..O {
            let i = Self::CHANNELS[s];
            h[s] = if i == Self::LAST {
                self.coefficients.theta_n * drift
            } else if i + 1 == Self::LAST {
                // x_n moves exponentially inside the tick.
                self.coefficients.theta_n * x[i + 1]
            } else {
                T::HALF * x[i + 1]
            };
        }
        h
    }

    /// y: the sample with the estimate of each mismatched channel on top of the state that it drives.
    #[inline(always)]
    fn advanced(x: &[T; N], z: &[[T; R]; O]) -> [T; N] {
        let mut y = *x;
        for s in 0..O {
            let i = Self::CHANNELS[s];
            if i != Self::LAST {
                y[i + 1] += z[s][0];
            }
        }
        y
    }

    /// σ of Eq. (44).
    #[inline(always)]
    fn sigma(&self, y: &[T; N], z: &[[T; R]; O]) -> T {
        let k = &self.coefficients;
        let mut sigma = k.c[0] * y[0];
        for j in 1..Self::LAST {
            sigma += k.c[j] * y[j];
        }
        for s in 0..O {
            if Self::CHANNELS[s] != Self::LAST {
                for m in 1..R {
                    sigma += k.g[s][m] * z[s][m];
                }
            }
        }
        // c_n = 1 takes no multiplication.
        sigma + y[Self::LAST]
    }

    /// The sample is lost: keep the estimates, let the offset decay as time goes on, send the fallback.
    #[inline(always)]
    fn reject(&self, state: &mut State<T, R, O>, demand: T) -> Output<T> {
        let k = &self.coefficients;
        if state.resuming && demand.abs() <= T::from_f64(1e30) {
            // A finite sample asks for too much a second time running: it is the estimates that a spike has spoilt.
            // More than eight constant zeros the compiler writes by a call of memset; of this one it does not know.
            #[allow(clippy::eq_op)]
            let zero = if R * O <= 8 { T::ZERO } else { demand - demand };
            state.z = [[zero; R]; O];
        }
        state.held = (k.hold * state.held + k.fallback).limited(k.u_min, k.u_max);
        state.offset -= k.decay * state.offset;
        state.resuming = true;
        Output { u: state.held, sigma: state.offset, sigma_star: T::ZERO, health: Health::INPUT_REJECTED }
    }

    /// Estimates of every channel in physical units: [d_hat, d_hat', d_hat''] at the instant of the last tick, zeros
    /// where there is no observer (or beyond its order).
    pub fn estimates(&self, state: &State<T, R, O>) -> [[T; R]; N] {
        let k = &self.coefficients;
        let mut estimates = [[T::ZERO; R]; N];
        for s in 0..O {
            let i = Self::CHANNELS[s];
            let (theta, mu2, unit) = if i == Self::LAST {
                (k.theta_n, k.mu2_n, k.input_gain)
            } else {
                (T::HALF, T::from_f64(1.0 / 3.0), T::from_f64(1.0))
            };
            // Undo the folding: A, B, C -> S_0, S_1, S_2, then S_m -> d_hat^(m) = m! S_m / T^(m+1).
            let [a, b, c] = core::array::from_fn(|m| if m < R { state.z[s][m] } else { T::ZERO });
            let s2 = T::HALF * c;
            let s1 = b - (theta + T::HALF) * c;
            let s0 = a - theta * s1 - mu2 * s2;
            let physical = [s0 * unit, s1 * unit / k.period, c * unit / (k.period * k.period)];
            estimates[i].copy_from_slice(&physical[..R]);
        }
        estimates
    }
}

impl<T: Real, const R: usize, const O: usize> State<T, R, O> {
    /// Where in a state the one byte lies that must be 0 or 1; all others may be anything. Who gets states from memory
    /// that others can write to looks there first.
    pub const FLAG_AT: usize = core::mem::offset_of!(Self, resuming);

    /// Tells what the actuator really holds since the last tick, where that is not the `u` the tick returned. The
    /// observers live on it: fed the commanded u, a saturated start-up may never settle. Under saturation this is the
    /// only anti-windup there is, and needed. Call it before the next tick. A value that is not finite is ignored, and
    /// the answer is `false`.
    #[inline]
    pub fn applied(&mut self, u: T) -> bool {
        let sound = is_sound(u);
        if sound {
            self.held = u;
        }
        sound
    }

    /// The u that the controller believes is held.
    pub const fn held(&self) -> T {
        self.held
    }
}

/// Within ±[`INPUT_LIMIT`]? False for NaN and infinities.
#[inline(always)]
fn is_sound<T: Real>(value: T) -> bool {
    value.abs() <= T::from_f64(INPUT_LIMIT)
}
