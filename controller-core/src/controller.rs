//! Discrete controller: one tick from the sample x to the input u.
//!
//! [`Config`] holds the design numbers, [`Controller`] computes a tick, and [`Running`](crate::Running) holds the
//! state. Each tick has the period T. It reads the sample x, computes u, and the actuator holds u. The tick is the
//! folded form of the discrete controller (module `design` explains the folding). With $\beta = b(x)/b_0$,
//! $a_u = a(x)/b_0$ and all of channel n in units of $b_0 u$:
//!
//! 1. $h_i = w_i x_{i+1}$ ($i < n$), $h_n = \theta a_u$; innovation $e_i = (x_i - x_i^-)/T - h_i - P_i$ per observed
//!    channel; observer update;
//! 2. $y_j = x_j$, $y_{i+1} \mathrel{+}= A_i$; $\sigma = c \cdot y + \sum (g_B B + g_C C)$; $\sigma^* = \sigma - W$
//!    (Eq. (44), (17));
//! 3. $v = k_x \cdot y + k_w W + u_\sigma \sigma^* + \sum (k_B B + k_C C) + \mathrm{clamp}(s \thinspace \sigma^*,
//!    \pm lim)$ in a unit of its own (module `design`, "Range"), $u = (v - a_u - A_n)/\beta$ clamped (Eq. (51));
//! 4. $P_i = y_{i+1} - h_i$, $P_n = a_u + A_n - h_n$ (u joins when it is known), $x^- = x$,
//!    $W \mathrel{-}= (1 - e^{-\alpha T}) W$.
//!
//! Units: let U be the unit of the output $y = x_1$. Channel i has $x_i$ in U/s^(i-1) and $d_i$ in U/s^i. σ and σ* have
//! the unit of $x_n$, because $c_n$ is 1.
//!
//! The tick has no exponential, no division (for a constant b), no branch for the first call, and no panic.
//!
//! ```
//! use controller_core::*;
//!
//! // The flexible joint of the paper, observers in channels 2 and 4, designed by the compiler.
//! type Joint = controller!(f32, FlexibleJoint<f32>, order 4, observers of order 2 in [2, 4]);
//! const NOMINAL: Nominal<4> = JointParameters::TABLE_I.chain(Reading::Reconstructed).nominal();
//! const GAINS: ObserverGains<2> = ObserverGains::as_printed([100.0, 20.0]);
//! const CONTROLLER: Joint = Joint::design(
//!     &Config {
//!         period_s: 1e-3,
//!         surface: Surface { c: [125.0, 75.0, 15.0, 1.0], alpha_per_s: 1.0 },
//!         observers: [None, Some(GAINS), None, Some(GAINS)],
//!         reaching: ReachingLaw { k_l: 50.0, k_s: 0.0, epsilon: 0.01 },
//!         nominal: NOMINAL,
//!         options: Options::NEUTRAL,
//!     },
//!     FlexibleJoint::<f32>::new(&NOMINAL),
//! );
//!
//! let mut running = Running::new(&CONTROLLER);
//! let output = running.tick(&[0.1, 0.0, 0.0, 0.0]);
//! assert_eq!(output.sigma_star, 0.0); // Eq. (17): the offset starts the sliding variable at zero
//! ```

use core::hint::black_box;
use core::sync::atomic::{Ordering, compiler_fence};

use crate::config::{Config, INPUT_LIMIT};
use crate::design::{self, Coefficients};
use crate::error::{Cause, ConfigError, Field, Text};
use crate::health::Health;
use crate::model::{Linear, NominalModel};
use crate::observer;
use crate::real::Real;
use crate::running::{self, ControlLaw, RetuneError};
use crate::state::{Lanes, State};

/// Designed controller: coefficients and the nominal model, which a tick never changes.
///
/// * `T`: precision, `f32` or `f64`
/// * `M`: nominal model a(x)/b_0
/// * `N`: plant order, 2..=6
/// * `R`: capacity for observer orders, 1..=3
/// * `MASK`, `O`: observed channels (bit i - 1 for channel i, see [`channels`](crate::channels)), and their number. A
///   channel without an observer takes no state and executes no instruction.
///
/// The macro [`controller!`](macro@crate::controller) builds this type. [`Running`](crate::Running) ticks it. With a
/// state of your own, use it as a [`ControlLaw`]:
/// ```
/// use controller_core::*;
/// # const NOMINAL: Nominal<2> = Nominal { gradient: [0.0, -0.5], input_gain: 250.0 };
/// # const CONFIG: Config<2, 1> = Config {
/// #     period_s: 1e-3,
/// #     surface: Surface::from_bandwidth(20.0, 10.0),
/// #     observers: [None, Some(ObserverGains::from_bandwidth::<1>(100.0))],
/// #     reaching: ReachingLaw { k_l: 100.0, k_s: 0.0, epsilon: 0.01 },
/// #     nominal: NOMINAL,
/// #     options: Options::NEUTRAL,
/// # };
/// type Motor = controller!(f32, Linear<f32, 2>, order 2, observers of order 1 in [2]);
/// let controller = Motor::try_linear(&CONFIG).expect("a good design");
/// let mut state = controller.start(&[0.1, 0.0]).expect("a good first sample");
/// assert!(controller.tick(&mut state, &[0.1, 0.0]).u < 0.0);
/// ```
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Controller<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize> {
    coefficients: Coefficients<T, N, R, O>,
    model: M,
}

/// Result of one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Output<T> {
    /// Input u to hold until the next tick, within the limits, in the plant's input unit.
    pub u: T,
    /// Sliding variable σ, Eq. (44), in the unit of x_n.
    pub sigma: T,
    /// Sliding variable σ* with zero start value, Eq. (17), in the unit of x_n.
    pub sigma_star: T,
    /// Status flags. After a rejected input, `sigma` is the offset alone and `sigma_star` is 0.
    pub health: Health,
}

macro_rules! design_in {
    ($t:ty, $convert:ident) => {
        impl<M, const N: usize, const R: usize, const MASK: u8, const O: usize> Controller<$t, M, N, R, MASK, O>
        where
            M: NominalModel<$t, N> + Copy,
        {
            /// Designs the controller. The compiler and the program compute equal numbers.
            ///
            /// # Errors
            /// Returns the errors of [`Config::validate`]. Also rejects a configuration whose observers differ from
            /// `MASK`, and limits of samples.
            pub const fn try_design(config: &Config<N, R>, model: M) -> Result<Self, ConfigError> {
                match Self::ungated(config, model) {
                    Ok(_) if !config.options.samples.is_none() => {
                        Err(ConfigError::new(Field::Samples, Cause::GateMissing))
                    }
                    designed => designed,
                }
            }

            /// Designs the controller and ignores the limits of samples, which the caller applies.
            pub(crate) const fn ungated(config: &Config<N, R>, model: M) -> Result<Self, ConfigError> {
                match design_f64::<N, R, MASK, O>(config) {
                    Ok(rows) => Ok(Self::from_parts(design_in!(@$convert rows), model)),
                    Err(error) => Err(error),
                }
            }

            /// Designs as [`try_design`](Self::try_design), in a `const`: an invalid configuration is a compile error
            /// with the reason.
            ///
            /// # Panics
            /// On an invalid configuration. Outside a `const` use [`try_design`](Self::try_design).
            pub const fn design(config: &Config<N, R>, model: M) -> Self {
                match Self::try_design(config, model) {
                    Ok(controller) => controller,
                    Err(error) => panic!("{}", error.text().as_str()),
                }
            }
        }

        impl<const N: usize, const R: usize, const MASK: u8, const O: usize>
            Controller<$t, Linear<$t, N>, N, R, MASK, O>
        {
            /// Designs as [`try_design`](Self::try_design), with the linear model in the configuration's own
            /// [`nominal`](Config::nominal).
            ///
            /// # Errors
            /// Returns the errors of [`try_design`](Self::try_design).
            pub const fn try_linear(config: &Config<N, R>) -> Result<Self, ConfigError> {
                Self::try_design(config, Linear::<$t, N>::new(&config.nominal))
            }

            /// Designs as [`try_linear`](Self::try_linear), in a `const`.
            ///
            /// # Panics
            /// On an invalid configuration. Outside a `const` use [`try_linear`](Self::try_linear).
            pub const fn linear(config: &Config<N, R>) -> Self {
                Self::design(config, Linear::<$t, N>::new(&config.nominal))
            }
        }
    };
    (@single $c:ident) => { $c.ranged(128).in_f32() };
    (@double $c:ident) => { $c.ranged(1024) };
}
design_in!(f32, single);
design_in!(f64, double);

const fn assert_shape<const N: usize, const R: usize, const MASK: u8, const O: usize>() {
    assert!(N >= 2 && N <= crate::MAX_N && R >= 1 && R <= crate::MAX_R, "the orders must be N = 2..=6 and R = 1..=3");
    let text = Text::new().string("MASK names ").number(MASK.count_ones() as usize).string(" channels, ");
    assert!(MASK as usize >> N == 0, "{}", text.string("one of them above N = ").number(N).as_str());
    let text = text.string("O is ").number(O).string(": let the macro controller! count");
    assert!(MASK.count_ones() as usize == O, "{}", text.as_str());
}

const fn design_f64<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    config: &Config<N, R>,
) -> Result<Coefficients<f64, N, R, O>, ConfigError> {
    const { assert_shape::<N, R, MASK, O>() };
    let mut i = 0;
    while i < N {
        let channel = i + 1;
        let configured = config.observers[i].is_some();
        if configured != (MASK >> i & 1 == 1) {
            return Err(ConfigError::new(Field::Observer { channel }, Cause::ChannelMismatch { configured }));
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
    /// Observed channels, from 0.
    pub const CHANNELS: [usize; O] = design::observed(MASK);
    const LAST: usize = N - 1;

    /// Returns a controller with coefficients that were designed elsewhere, see [`Coefficients::from_numbers`].
    pub const fn from_parts(coefficients: Coefficients<T, N, R, O>, model: M) -> Self {
        const { assert_shape::<N, R, MASK, O>() };
        Self { coefficients, model }
    }

    /// Returns the coefficients of the tick.
    pub const fn coefficients(&self) -> &Coefficients<T, N, R, O> {
        &self.coefficients
    }

    /// Returns the nominal model.
    pub const fn model(&self) -> &M {
        &self.model
    }

    /// Computes the [`tick`](ControlLaw::tick) of lane `l`, bit-identical. A loop over the lanes becomes vector code,
    /// see [`Lanes`].
    ///
    /// # Panics
    /// If `l >= L`.
    #[inline(always)]
    pub fn tick_lane<const L: usize>(
        &self,
        lanes: &mut Lanes<T, M, N, R, MASK, O, L>,
        l: usize,
        x: &[T; N],
    ) -> Output<T> {
        let mut state = lanes.lane(l);
        let output = self.step::<true, true, ()>(&mut state, x, ());
        lanes.set(l, &state);
        output
    }

    /// Returns the estimate of d in the observed channel of slot `s` (see [`CHANNELS`](Self::CHANNELS)), in lane `l`.
    ///
    /// The result is bit-identical to [`estimates`](ControlLaw::estimates). A loop over the lanes becomes vector code.
    ///
    /// # Panics
    /// If there is no such lane or slot.
    #[inline(always)]
    pub fn estimate_lane<const L: usize>(&self, lanes: &Lanes<T, M, N, R, MASK, O, L>, l: usize, s: usize) -> T {
        self.physical(&core::array::from_fn(|m| lanes.z[s][m][l]), s)[0]
    }

    /// Returns the estimates of slot `s` in physical units: A, B, C to S_0, S_1, S_2, then S_m -> d_hat^(m) = m! S_m /
    /// T^(m+1).
    #[inline(always)]
    fn physical(&self, z: &[T; R], s: usize) -> [T; 3] {
        let period = self.coefficients.period;
        let (theta, mu2, unit) = self.folding(s);
        let at = |m: usize| if m < R { z[m] } else { T::ZERO };
        let [a, b, c] = [at(0), at(1), at(2)];
        let s2 = T::HALF * c;
        let s1 = b - (theta + T::HALF) * c;
        let s0 = a - theta * s1 - mu2 * s2;
        [s0 * unit, s1 * unit / period, c * unit / period / period]
    }

    /// Computes the [`tick`](ControlLaw::tick) without the guard, to measure the cost of the guard. After a first
    /// `tick` it is bit-identical for valid samples. After an invalid sample it returns NaN for ever. Firmware has no
    /// use for it.
    #[doc(hidden)]
    #[inline]
    pub fn tick_unguarded(&self, state: &mut State<T, M, N, R, MASK, O>, x: &[T; N]) -> Output<T> {
        self.step::<false, false, ()>(state, x, ())
    }

    /// Computes the tick. The sample comes directly or through a map, and the target is a course or rest.
    #[inline(always)]
    pub(crate) fn step<const GUARDED: bool, const LANE: bool, C: Course<T, N>>(
        &self,
        state: &mut State<T, M, N, R, MASK, O>,
        x: &[T; N],
        course: C,
    ) -> Output<T> {
        let k = &self.coefficients;
        T::section("0. Nominal model, in units of u: a(x)/b_0, b(x)/b_0.");
        let drift = course.drift(&self.model, x).called("drift", 0);
        let gain = course.gain_ratio(&self.model, x).map(|gain| gain.called("gain", 0));

        T::section("1. Observers, Eq. (45)-(50): innovation e, then A += B + gamma_1 e, B += C + gamma_2 e, ..");
        // Short loops with one task each are unrolled. This order of statements, driven channel first, takes the fewest
        // cycles (docs/reference/cycles.md).
        let mut moved = [T::ZERO; O];
        for s in 0..O {
            let i = Self::CHANNELS[s];
            let moved_s = (x[i] - state.x_prev[s]) * if i == Self::LAST { k.rate_n } else { k.rate };
            moved[s] = moved_s.called("moved", i + 1);
        }
        let h = self.foreseen(x, drift);
        let held = match gain {
            None => state.held,
            // The applied b u: b(x) moved from its last to its present value during the tick.
            Some(now) => state.held * (state.gain_prev + k.theta_n * (now - state.gain_prev)),
        };
        let mut z = state.z;
        for s in (0..O).rev() {
            let expected = if Self::CHANNELS[s] == Self::LAST { state.past[s] + held } else { state.past[s] };
            let e = (moved[s] - h[s] - expected).called("e", Self::CHANNELS[s] + 1);
            z[s] = observer::advance(z[s], &k.gamma[s], e);
        }
        let resuming = GUARDED && state.resuming;
        if resuming {
            if !LANE {
                compiler_fence(Ordering::SeqCst);
            }
            // There is no last tick to compare with. The estimates still advance by one tick, so that the demand shows
            // a growing estimate in every tick, not only in every other one.
            for s in 0..O {
                z[s] = observer::coasted(state.z[s]);
            }
            state.resuming = false;
        }

        T::section("2. Of the law what needs no sigma*; surface, Eq. (44); offset, Eq. (17).");
        let y = Self::advanced(x, &z);
        let mut input_drift = drift;
        for s in 0..O {
            if Self::CHANNELS[s] == Self::LAST {
                input_drift += z[s][0];
            }
        }
        let input_drift = input_drift.called("input_drift", 0);
        let (held_on, then) = if C::LATE { course.ahead(&y, input_drift, &Self::growth(&z)) } else { (y, input_drift) };
        let e = course.error(held_on);
        let sigma = self.sigma(&e, &z);
        let sigma_star = (sigma - state.offset).called("sigma_star", 0);

        T::section("3. Law, Eq. (51).");
        let mut v = (k.us * sigma_star).called("v", 0);
        v += (k.satk * sigma_star).called("switching", 0).limited(-k.lim, k.lim);
        v += k.kw * state.offset;
        for j in 1..N {
            v += k.kx[j] * e[j];
        }
        for s in (0..O).rev() {
            for m in 1..R {
                v += k.k[s][m] * z[s][m];
            }
        }
        let mut asked = (v * k.unit - then).called("asked", 0);
        if let Some(feed) = course.feed() {
            asked += feed;
        }
        let demand = gain.map_or(asked, |ratio| (asked / ratio).called("demand", 0));
        if GUARDED && !(self.is_plausible(demand, state.offset) && gain.is_none_or(is_sound)) {
            return self.reject::<LANE, C>(state, Some((x, course)), resuming);
        }
        let u = demand.limited(k.u_min, k.u_max).called("u", 0);

        T::section("4. Memory.");
        for s in 0..O {
            let i = Self::CHANNELS[s];
            state.past[s] = if i == Self::LAST { input_drift } else { y[i + 1] } - h[s];
        }
        state.z = z;
        for s in 0..O {
            state.x_prev[s] = x[Self::CHANNELS[s]];
        }
        state.held = u;
        state.offset -= k.decay * state.offset;
        if let Some(ratio) = gain {
            state.gain_prev = ratio;
        }

        let health = Health::SATURATED
            .when(u != demand)
            .union(Health::SIGMA_STAR_OVER_BOUND.when(sigma_star.abs() > k.sigma_star_bound));
        Output { u, sigma, sigma_star, health }
    }

    /// Returns h of each observed channel: the share of x_{i+1} (or a) at the end of the tick in the mean over the
    /// tick.
    #[inline(always)]
    fn foreseen(&self, x: &[T; N], drift: T) -> [T; O] {
        let mut h = [T::ZERO; O];
        for s in 0..O {
            let i = Self::CHANNELS[s];
            let foreseen = if i == Self::LAST {
                self.coefficients.theta_n * drift
            } else if i + 1 == Self::LAST {
                // x_n moves exponentially inside the tick.
                self.coefficients.theta_n * x[i + 1]
            } else {
                T::HALF * x[i + 1]
            };
            h[s] = foreseen.called("h", i + 1);
        }
        h
    }

    /// Returns y: the sample, with the estimate of each mismatched channel added to the state that it drives.
    #[inline(always)]
    fn advanced(x: &[T; N], z: &[[T; R]; O]) -> [T; N] {
        let mut y = *x;
        for s in 0..O {
            let i = Self::CHANNELS[s];
            if i != Self::LAST {
                y[i + 1] += z[s][0];
                y[i + 1] = y[i + 1].called("y", i + 2);
            }
        }
        y
    }

    /// Returns the growth of each estimate per tick.
    #[inline(always)]
    fn growth(z: &[[T; R]; O]) -> [T; N] {
        let mut growth = [T::ZERO; N];
        for s in 0..O {
            for m in 1..R {
                growth[Self::CHANNELS[s]] += z[s][m];
            }
        }
        growth
    }

    /// Returns σ of Eq. (44).
    #[inline(always)]
    fn sigma(&self, y: &[T; N], z: &[[T; R]; O]) -> T {
        let k = &self.coefficients;
        let mut sigma = (k.c[0] * y[0]).called("sigma", 0);
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
        (sigma + y[Self::LAST]).called("sigma", 0)
    }

    /// Returns θ, μ_2 and the unit of the estimate in slot s (module `design`).
    fn folding(&self, s: usize) -> (T, T, T) {
        let k = &self.coefficients;
        if Self::CHANNELS[s] == Self::LAST {
            (k.theta_n, k.mu2_n, k.input_gain)
        } else {
            (T::HALF, T::from_f64(1.0 / 3.0), T::from_f64(1.0))
        }
    }

    /// Returns A, B, C for estimates in physical units: the inverse of [`estimates`](ControlLaw::estimates).
    fn folded(&self, estimates: &[[T; R]; N]) -> [[T; R]; O] {
        let period = self.coefficients.period;
        let mut z = [[T::ZERO; R]; O];
        for s in 0..O {
            let (theta, mu2, unit) = self.folding(s);
            let (physical, gamma) = (&estimates[Self::CHANNELS[s]], &self.coefficients.gamma[s]);
            // An observer of lower order would never correct an entry that it does not estimate.
            let estimated = |m: usize| m < R && gamma[m] != T::ZERO;
            let estimate = |m: usize| if estimated(m) { physical[m] / unit } else { T::ZERO };
            let [d0, d1, d2] = [estimate(0), estimate(1), estimate(2)];
            let (s1, c) = (d1 * period, d2 * period * period);
            let s2 = T::HALF * c;
            let all = [d0 + theta * s1 + mu2 * s2, s1 + (theta + T::HALF) * c, c];
            z[s].copy_from_slice(&all[..R]);
        }
        z
    }

    /// Returns the state for a start at this sample with these estimates, or `None` if a number is not valid.
    pub(crate) fn start_on<C: Course<T, N>>(
        &self,
        x0: &[T; N],
        course: C,
        d_hat: &[T; N],
    ) -> Option<State<T, M, N, R, MASK, O>> {
        let mut z = [[T::ZERO; R]; O];
        for s in 0..O {
            let i = Self::CHANNELS[s];
            z[s][0] = if i == Self::LAST { d_hat[i] / self.coefficients.input_gain } else { d_hat[i] };
        }
        let offset = self.sigma(&course.error(Self::advanced(x0, &z)), &z);
        // A function instead of a closure is compiled once per scalar, not per configuration.
        let all_sound = x0.iter().chain(z.as_flattened()).chain([&offset]).copied().all(is_sound);
        all_sound.then_some(State::resuming(z, offset, T::ZERO))
    }

    /// Returns the state of this controller for a bumpless transfer from the controller `from`.
    ///
    /// The past tick has the old period and belongs to the old observers. The new law acts from now on. The difference
    /// of the two models in channel n is added to d_hat_n, so that the total acceleration is kept. The demand is
    /// $v(W) = v_0 + (k_w - u_\sigma)W + \mathrm{clamp}(s(\sigma - W), \pm lim)$. Several W may give the old demand:
    /// the function takes the one nearest to the old W.
    pub(crate) fn take_over_on<C: Course<T, N>>(
        &self,
        from: &Self,
        state: &State<T, M, N, R, MASK, O>,
        then: (&[T; N], C),
        now: (&[T; N], C),
    ) -> Result<State<T, M, N, R, MASK, O>, RetuneError> {
        let Coefficients { kw, us, satk, lim, unit, .. } = self.coefficients;
        let [kw, us, satk, lim] = [kw, us, satk, lim].map(|entry| entry * unit);
        let slope = kw - us;
        if slope.abs() < T::from_f64(0.1) * us.abs() {
            return Err(RetuneError::GainNearDecay);
        }
        let mut old = state.clone();
        let before = from.step::<true, false, C>(&mut old, then.0, then.1);
        let mut estimates = from.estimates(&old);
        let one = T::from_f64(1.0);
        let [(a_old, b_old), (a_new, b_new)] = [(from, then), (self, now)].map(|(law, (x, course))| {
            let b = law.coefficients.input_gain;
            (course.drift(&law.model, x) * b, course.gain_ratio(&law.model, x).unwrap_or(one) * b)
        });
        estimates[Self::LAST][0] += (a_old - a_new) + (b_old - b_new) * state.held;
        // The estimates are current, and the tick that resumes advances them by one tick.
        let z = self.folded(&estimates).map(observer::rewound);

        // The demand without limits, in units of v. It comes from `step`, so that the law is written once.
        let limit = T::from_f64(INPUT_LIMIT);
        let ratio = now.1.gain_ratio(&self.model, now.0).unwrap_or(one);
        let demand = |switching: bool, offset: T| {
            let mut open = self.coefficients;
            (open.u_min, open.u_max, open.plausible) = (-limit, limit, limit);
            if !switching {
                (open.satk, open.lim) = (T::ZERO, T::ZERO);
            }
            let bare = Controller::<T, &M, N, R, MASK, O> { coefficients: open, model: &self.model };
            let output = bare.step::<true, false, C>(&mut State::resuming(z, offset, state.held), now.0, now.1);
            (output.u * ratio, output.sigma, output.health.contains(Health::INPUT_REJECTED))
        };
        let wanted = before.u.limited(self.coefficients.u_min, self.coefficients.u_max) * ratio;
        let (v_0, sigma, rejected) = demand(false, T::ZERO);
        if rejected || before.health.contains(Health::INPUT_REJECTED) {
            return Err(RetuneError::Sample);
        }
        // One straight piece each: below, within and above the layer of the switching term.
        let pieces = [(slope, lim), (slope - satk, satk * sigma), (slope, -lim)];
        let nearest = pieces
            .into_iter()
            .filter(|&(slope, _)| slope != T::ZERO)
            .map(|(slope, intercept)| (slope, (wanted - v_0 - intercept) / slope))
            // Rounded at the edge of a piece: a thousandth of it may lie beyond.
            .filter(|&(_, offset)| {
                let switching = satk * (sigma - offset);
                let reached = v_0 + (kw - us) * offset + switching.limited(-lim, lim);
                (reached - wanted).abs() <= T::from_f64(1e-3) * (lim + wanted.abs()) + T::from_f64(1e-6) * v_0.abs()
            })
            .map(|(slope, offset)| ((offset - old.offset).abs(), slope, offset))
            .reduce(|best, other| if other.0 < best.0 { other } else { best });
        let Some((_, slope, offset)) = nearest else { return Err(RetuneError::OffsetOutOfRange) };
        // W comes from large terms that nearly cancel. The law evaluated at W gives the remaining error.
        let (reached, _, _) = demand(true, offset);
        let offset = offset - (reached - wanted) / slope;
        if is_sound(offset) { Ok(State::resuming(z, offset, state.held)) } else { Err(RetuneError::OffsetOutOfRange) }
    }

    /// Returns true if the demand is plausible: near the limits, or large only because the state began far off.
    ///
    /// In the second case the offset alone demands more still, and the sample cancels a large part of it. Spoilt
    /// estimates or a spoilt offset do not have this pattern, and they are rejected before they decay. False for NaN.
    #[inline(always)]
    fn is_plausible(&self, demand: T, offset: T) -> bool {
        let k = &self.coefficients;
        let of_offset = (k.ko * offset).called("of_offset", 0);
        demand.abs() <= k.plausible || (demand.abs() < of_offset.abs() && (demand - of_offset).abs() > k.plausible)
    }

    /// Handles a lost sample: keeps the estimates, lets the offset decay and outputs the fallback.
    ///
    /// If the last sample was lost too, and both samples fit one plant, the state is spoilt. The controller then
    /// restarts.
    #[inline(always)]
    pub(crate) fn reject<const LANE: bool, C: Course<T, N>>(
        &self,
        state: &mut State<T, M, N, R, MASK, O>,
        x: Option<(&[T; N], C)>,
        again: bool,
    ) -> Output<T> {
        let mut k = &self.coefficients;
        let mut x = x;
        if !LANE {
            // Reloads everything, so that the code path of a valid sample keeps no register for this path.
            compiler_fence(Ordering::SeqCst);
            (k, x) = black_box((k, x));
        }
        T::section("A rejected sample.");
        let held = if is_sound(state.held) { state.held } else { T::ZERO };
        // σ of the sample alone, and of the last lost sample. P stores the latter and is free until the next valid
        // tick.
        let before = *state.aside();
        let mut alone = T::from_f64(NO_SIGMA);
        if let Some((x, course)) = x {
            let sum = course.weighed(&k.c, x);
            if is_sound(sum) {
                alone = sum;
            }
        }
        let alone = alone.called("alone", 0);
        *state.aside() = alone;
        // The difference between the two demands must not be much more than the accepted demand.
        let apart = ((k.us + k.kw) * k.unit * (alone - before)).called("apart", 0);
        if again && is_sound(alone) && apart.abs() <= k.plausible {
            // The compiler writes more than eight constant zeros by a call of memset. It cannot see that this number is
            // zero.
            #[allow(clippy::eq_op)]
            let zero = if R * O <= 8 { T::ZERO } else { alone - alone };
            state.z = [[zero; R]; O];
            state.offset = alone;
        }
        state.held = (k.hold * held + k.fallback).limited(k.u_min, k.u_max);
        state.offset -= k.decay * state.offset;
        state.resuming = true;
        Output { u: state.held, sigma: state.offset, sigma_star: T::ZERO, health: Health::INPUT_REJECTED }
    }
}

impl<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize> ControlLaw
    for Controller<T, M, N, R, MASK, O>
where
    T: Real,
    M: NominalModel<T, N>,
{
    type Scalar = T;
    /// Sample x, in chain coordinates.
    type Sample = [T; N];
    type Output = Output<T>;
    type State = State<T, M, N, R, MASK, O>;
    /// Estimate d_hat of each channel in its physical unit. Entries of unobserved channels are not read.
    type Guess = [T; N];
    /// Estimates [d_hat, d_hat', d_hat''] of every channel. Zeros without an observer, or beyond its order.
    type Estimates = [[T; R]; N];
    const NO_GUESS: [T; N] = [T::ZERO; N];

    /// Takes the offset of Eq. (17) from this sample: give the first tick the same sample.
    fn start_from(&self, x0: &[T; N], d_hat: &[T; N]) -> Option<Self::State> {
        self.start_on(x0, (), d_hat)
    }

    #[inline]
    fn not_started(&self) -> Output<T> {
        Output {
            u: self.coefficients.fallback.limited(self.coefficients.u_min, self.coefficients.u_max),
            sigma: T::ZERO,
            sigma_star: T::ZERO,
            health: Health::INPUT_REJECTED,
        }
    }

    /// Computes one tick: observers, σ*, law, clamp. Call it once per period with the newest sample x, in chain
    /// coordinates.
    ///
    /// A sample that is not finite never reaches the state. The estimates wait, and the next valid sample resumes
    /// without a step: in its tick they advance without a correction. From any state, at most two consecutive valid
    /// samples lead back into the set of the design (module `design`, "Range"). Here, valid means that the controller
    /// would start from the sample and accept it at once.
    ///
    /// The tick assumes that the actuator will hold `u`. If the actuator holds another value, call
    /// [`report_applied`](ControlLaw::report_applied).
    #[inline(always)]
    fn tick(&self, state: &mut Self::State, x: &[T; N]) -> Output<T> {
        self.step::<true, false, ()>(state, x, ())
    }

    #[inline]
    fn lost(&self, state: &mut Self::State) -> Output<T> {
        self.reject::<false, ()>(state, None, false)
    }

    /// Treats the next tick as after a lost sample: the estimates ignore x once, because it has moved for more than a
    /// period.
    #[inline]
    fn missed(&self, state: &mut Self::State, periods: u32) {
        state.resuming |= periods > 0;
    }

    /// Replaces the held u, which the observers use. With the commanded u as input, a saturated start-up may never
    /// settle. Under saturation this is the only anti-windup, and it is needed. A value beyond [`INPUT_LIMIT`] is
    /// rejected.
    #[inline]
    fn report_applied(state: &mut Self::State, u: T) -> bool {
        let sound = is_sound(u);
        if sound {
            state.held = u;
        }
        sound
    }

    fn estimates(&self, state: &Self::State) -> [[T; R]; N] {
        let mut estimates = [[T::ZERO; R]; N];
        for s in 0..O {
            estimates[Self::CHANNELS[s]].copy_from_slice(&self.physical(&state.z[s], s)[..R]);
        }
        estimates
    }

    fn take_over(&self, from: &Self, state: &Self::State, x: &[T; N]) -> Result<Self::State, RetuneError> {
        self.take_over_on(from, state, (x, ()), (x, ()))
    }

    /// Hashes version, precision, configuration, every coefficient, and the model at n + 1 points. The hash
    /// distinguishes any two linear models, and nonlinear models that differ at these points.
    fn fingerprint(&self) -> u32 {
        let shape = [crate::VERSION_NUMBER, T::WORDS as u32, N as u32, R as u32, u32::from(MASK)];
        let mut hash = running::hashed(running::hash(shape), self.coefficients.numbers());
        for asked in 0..=N {
            // e_1 .. e_n, and one point with all entries different, to show nonlinear terms.
            let mut x = [T::ZERO; N];
            for (j, entry) in x.iter_mut().enumerate() {
                if asked == N {
                    *entry = T::from_f64(0.37 + 0.11 * j as f64);
                } else if asked == j {
                    *entry = T::from_f64(1.0);
                }
            }
            let answers = [self.model.drift(&x), self.model.gain_ratio(&x).unwrap_or(T::from_f64(1.0))];
            hash = running::hashed(hash, answers);
        }
        hash
    }
}

/// Reference trajectory while u is held. `()` is rest at 0, and takes no instruction. Observers do not use it.
pub(crate) trait Course<T: Real, const N: usize>: Copy {
    /// Returns a(x)/b_0. A sample that came through a map already has it.
    #[inline(always)]
    fn drift<M: NominalModel<T, N>>(&self, model: &M, x: &[T; N]) -> T {
        model.drift(x)
    }

    /// Returns b(x)/b_0, as [`NominalModel::gain_ratio`].
    #[inline(always)]
    fn gain_ratio<M: NominalModel<T, N>>(&self, model: &M, x: &[T; N]) -> Option<T> {
        model.gain_ratio(x)
    }

    /// True if u is applied one tick after it was computed. The law is then evaluated one tick ahead.
    const LATE: bool;

    /// Returns y and the drift of channel n (with its estimate, in units of u) one tick ahead. Estimates grow by
    /// `growth`.
    fn ahead(&self, y: &[T; N], input_drift: T, growth: &[T; N]) -> ([T; N], T);

    /// Returns y minus the reference.
    fn error(&self, y: [T; N]) -> [T; N];

    /// Returns c . (y minus the reference).
    #[inline(always)]
    fn weighed(&self, c: &[T; N], y: &[T; N]) -> T {
        weighed(c, y)
    }

    /// Returns the feedforward part of u for the reference, or `None` without one.
    fn feed(&self) -> Option<T>;
}

/// Returns c . y, with c_n = 1.
#[inline(always)]
pub(crate) fn weighed<T: Real, const N: usize>(c: &[T; N], y: &[T; N]) -> T {
    let mut sum = y[N - 1];
    for j in (0..N - 1).rev() {
        sum += c[j] * y[j];
    }
    sum
}

impl<T: Real, const N: usize> Course<T, N> for () {
    const LATE: bool = false;

    #[inline(always)]
    fn ahead(&self, y: &[T; N], input_drift: T, _: &[T; N]) -> ([T; N], T) {
        (*y, input_drift)
    }

    #[inline(always)]
    fn error(&self, y: [T; N]) -> [T; N] {
        y
    }

    #[inline(always)]
    fn feed(&self) -> Option<T> {
        None
    }
}

/// Placeholder for σ of a sample without one: far from any valid σ.
const NO_SIGMA: f64 = 1e38;

/// Returns true within ±[`INPUT_LIMIT`]. False for NaN and infinities.
#[inline(always)]
fn is_sound<T: Real>(value: T) -> bool {
    value.abs() <= T::from_f64(INPUT_LIMIT).called("input_limit", 0)
}
