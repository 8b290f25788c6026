//! Sample gate in front of a controller: the valid range of a sample, and its largest change per tick.
//!
//! A finite sample can be as wrong as NaN: a flipped bit on the bus, or a counter that is read while it changes. The
//! guard in the tick has no data about the sensor. It rejects only samples that make the controller demand far more
//! than the actuator has (module `design`, "Range"). [`SampleLimits`] adds the limits of the sensor. A sample is valid
//! only if, for every state $j = 1..n$,
//!
//! $$ min_j \le x_j \le max_j, \qquad |x_j - x_j^-| \le jump_j $$
//!
//! Here $x^-$ is the last sample within its range, accepted or not. A sample out of range costs its own tick. A jump
//! within the range costs two ticks: its own and the return. From any state, the second of two valid samples is
//! accepted. So neither a number of lost samples nor a jump can lock the gate. A sensor that continues with consistent
//! wrong samples is accepted. Only a monitor can detect that fault.
//!
//! The gate is a type around the controller, so a controller without it has no extra cost. With it the tick of the
//! joint takes 101 more cycles on a Cortex-M4F (`firmware/budgets.toml`), and the state takes 4 n more bytes.
//!
//! ```
//! use controller_core::*;
//! # const NOMINAL: Nominal<2> = Nominal { gradient: [0.0, -0.5], input_gain: 250.0 };
//! # const GAINS: ObserverGains<1> = ObserverGains::from_bandwidth::<1>(100.0);
//! type Motor = controller!(f32, Linear<f32, 2>, order 2, observers of order 1 in [2]);
//! const CONFIG: Config<2, 1> = Config {
//!     period_s: 1e-3,
//!     surface: Surface::from_bandwidth(20.0, 10.0),
//!     observers: [None, Some(GAINS)],
//!     reaching: ReachingLaw { k_l: 100.0, k_s: 0.0, epsilon: 0.01 },
//!     nominal: NOMINAL,
//!     // A shaft that turns at most ±100 rad, at most 60 rad/s fast, that never gains more than 3 rad/s in a tick.
//!     options: Options::NEUTRAL.with_limits(Limits::symmetric(10.0)).with_samples(SampleLimits {
//!         min: [-100.0, -60.0],
//!         max: [100.0, 60.0],
//!         jump: [0.1, 3.0],
//!     }),
//! };
//! static MOTOR: Gated<Motor, 2> = Gated::<Motor, 2>::design(&CONFIG, Linear::<f32, 2>::new(&NOMINAL));
//!
//! let mut running = Running::new(&MOTOR);
//! let good = running.tick(&[0.1, 0.0]);
//! let lost = running.tick(&[1e6, 0.0]);
//! assert_eq!((lost.u, lost.health), (good.u, Health::INPUT_REJECTED)); // the fallback: the last u is held
//! assert!(running.tick(&[0.1, 0.0]).health.is_ok());
//! ```

use crate::config::{Config, INPUT_LIMIT};
use crate::controller::Controller;
use crate::error::ConfigError;
use crate::model::NominalModel;
use crate::real::{Real, row_f32};
use crate::running::{self, ControlLaw, RetuneError, Words};

/// Limits of a valid sample. One entry per state, in the unit of the state. A sample outside of them is lost.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SampleLimits<const N: usize> {
    /// Smallest valid x_1..x_n.
    pub min: [f64; N],
    /// Largest valid x_1..x_n.
    pub max: [f64; N],
    /// Largest valid change of x_1..x_n from the sample before. Add up the largest motion of the plant in a tick, the
    /// sensor noise, and the motion while one or two samples are lost.
    pub jump: [f64; N],
}

impl<const N: usize> SampleLimits<N> {
    /// Limits of ±1e12 with a jump from one end to the other, which no sensor reaches.
    pub const NONE: Self = Self { min: [-INPUT_LIMIT; N], max: [INPUT_LIMIT; N], jump: [2.0 * INPUT_LIMIT; N] };

    /// Returns true if there is no limit at all.
    pub(crate) const fn is_none(&self) -> bool {
        let mut j = 0;
        while j < N {
            let none = self.min[j] == -INPUT_LIMIT && self.max[j] == INPUT_LIMIT && self.jump[j] == 2.0 * INPUT_LIMIT;
            if !none {
                return false;
            }
            j += 1;
        }
        true
    }
}

/// Gate with [`SampleLimits`] in the precision of a controller.
#[derive(Clone, Copy, Debug)]
pub struct Gate<T, const N: usize> {
    min: [T; N],
    max: [T; N],
    jump: [T; N],
}

impl<const N: usize> Gate<f32, N> {
    /// Returns the gate with each limit rounded to the nearest f32.
    pub const fn new(limits: &SampleLimits<N>) -> Self {
        let SampleLimits { min, max, jump } = limits;
        Self::from_rows(row_f32(min), row_f32(max), row_f32(jump))
    }
}

impl<const N: usize> Gate<f64, N> {
    /// Returns the gate with the unchanged limits.
    pub const fn new(limits: &SampleLimits<N>) -> Self {
        let SampleLimits { min, max, jump } = *limits;
        Self::from_rows(min, max, jump)
    }
}

impl<T: Real, const N: usize> Gate<T, N> {
    /// Returns a gate from rows that were converted elsewhere.
    #[doc(hidden)]
    pub const fn from_rows(min: [T; N], max: [T; N], jump: [T; N]) -> Self {
        Self { min, max, jump }
    }

    /// Returns true if every entry lies within its range. False for NaN.
    #[inline(always)]
    fn spans(&self, x: &[T; N]) -> bool {
        (0..N).all(|j| x[j] >= self.min[j] && x[j] <= self.max[j])
    }

    /// Returns true if the sample is valid. `last` is the last sample within its range, and a sample within the range
    /// replaces it. The first sample has no predecessor: pass it as `last` too.
    #[inline(always)]
    pub fn takes(&self, last: &mut [T; N], x: &[T; N]) -> bool {
        T::section("The gate: what a sample may be, and how far it may move.");
        if !self.spans(x) {
            return false;
        }
        let before = core::mem::replace(last, *x);
        (0..N).all(|j| (x[j] - before[j]).called("jumped", j + 1).abs() <= self.jump[j])
    }
}

/// Controller behind a [`Gate`]: a sample that does not pass is [lost](ControlLaw::lost).
#[derive(Clone, Copy, Debug)]
pub struct Gated<C: ControlLaw, const N: usize> {
    law: C,
    gate: Gate<C::Scalar, N>,
}

impl<C: ControlLaw, const N: usize> Gated<C, N> {
    /// Returns a controller that was designed elsewhere, behind this gate.
    pub const fn new(law: C, gate: Gate<C::Scalar, N>) -> Self {
        Self { law, gate }
    }

    /// Returns the controller behind the gate.
    pub const fn law(&self) -> &C {
        &self.law
    }
}

macro_rules! design_in {
    ($t:ty) => {
        impl<M, const N: usize, const R: usize, const MASK: u8, const O: usize>
            Gated<Controller<$t, M, N, R, MASK, O>, N>
        where
            M: NominalModel<$t, N> + Copy,
        {
            /// Designs a controller and the gate for its [`samples`](crate::Options::samples).
            ///
            /// # Errors
            /// Returns the errors of [`Controller::try_design`], except for the limits of samples.
            pub const fn try_design(config: &Config<N, R>, model: M) -> Result<Self, ConfigError> {
                match Controller::<$t, M, N, R, MASK, O>::ungated(config, model) {
                    Ok(law) => Ok(Self { law, gate: Gate::<$t, N>::new(&config.options.samples) }),
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
                    Ok(gated) => gated,
                    Err(error) => panic!("{}", error.text().as_str()),
                }
            }
        }
    };
}
design_in!(f32);
design_in!(f64);

/// State of a [`Gated`] controller.
#[derive(Clone, Debug, PartialEq)]
pub struct GatedState<S, T, const N: usize> {
    law: S,
    /// Last sample within its range.
    last: [T; N],
}

/// State snapshot: the words of the controller, then the last sample within its range.
impl<S: Words, T: Real, const N: usize> Words for GatedState<S, T, N> {
    fn words(&self) -> impl Iterator<Item = u32> {
        self.law.words().chain(self.last.words())
    }

    fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self> {
        Some(Self { law: S::from_words(words)?, last: Words::from_words(words)? })
    }
}

impl<C, const N: usize> ControlLaw for Gated<C, N>
where
    C: ControlLaw<Sample = [<C as ControlLaw>::Scalar; N]>,
{
    type Scalar = C::Scalar;
    type Sample = C::Sample;
    type Output = C::Output;
    type State = GatedState<C::State, C::Scalar, N>;
    type Guess = C::Guess;
    type Estimates = C::Estimates;
    const NO_GUESS: C::Guess = C::NO_GUESS;

    #[inline]
    fn start_from(&self, x0: &C::Sample, guess: &C::Guess) -> Option<Self::State> {
        if !self.gate.spans(x0) {
            return None;
        }
        Some(GatedState { law: self.law.start_from(x0, guess)?, last: *x0 })
    }
    #[inline]
    fn not_started(&self) -> C::Output {
        self.law.not_started()
    }
    #[inline(always)]
    fn tick(&self, state: &mut Self::State, x: &C::Sample) -> C::Output {
        if self.gate.takes(&mut state.last, x) { self.law.tick(&mut state.law, x) } else { self.lost(state) }
    }
    #[inline]
    fn lost(&self, state: &mut Self::State) -> C::Output {
        self.law.lost(&mut state.law)
    }
    #[inline]
    fn missed(&self, state: &mut Self::State, periods: u32) {
        self.law.missed(&mut state.law, periods);
    }
    #[inline]
    fn report_applied(state: &mut Self::State, u: C::Scalar) -> bool {
        C::report_applied(&mut state.law, u)
    }
    #[inline]
    fn limit(state: &mut Self::State, u: C::Scalar) -> bool {
        C::limit(&mut state.law, u)
    }
    fn estimates(&self, state: &Self::State) -> C::Estimates {
        self.law.estimates(&state.law)
    }
    fn take_over(&self, from: &Self, state: &Self::State, x: &C::Sample) -> Result<Self::State, RetuneError> {
        if !self.gate.takes(&mut { state.last }, x) {
            return Err(RetuneError::Sample);
        }
        Ok(GatedState { law: self.law.take_over(&from.law, &state.law, x)?, last: state.last })
    }
    fn fingerprint(&self) -> u32 {
        let Gate { min, max, jump } = &self.gate;
        running::hash([self.law.fingerprint()].into_iter().chain([min, max, jump].into_iter().flat_map(Words::words)))
    }
}
