//! Complete design in SI units, and the rules that it must keep.
//!
//! [`Config`] is a full struct literal, so every required number is visible where it is used. Numbers with a neutral
//! value are in its [`Options`]. [`Config`] has the orders in its type. [`AnyConfig`] has the orders as numbers, for
//! configurations from a file or a serial protocol. The same rules check both, and an error names field, cause and
//! remedy.

use crate::error::{Cause, ConfigError, Field, Warning, Warnings};
use crate::gate::SampleLimits;
use crate::law::{Limits, ReachingLaw};
use crate::model::Nominal;
use crate::observer::ObserverGains;
use crate::surface::{self, Surface};
use crate::{MAX_N, MAX_R, assert_order};

/// Largest |u| in limits and in [`Running::report_applied`](crate::Running::report_applied), and largest start value.
///
/// A controller starts only from numbers up to this limit. A sample that makes the law demand far more than the limits
/// is rejected like a sample that is not finite. An error in x, a(x), b(x), the state or an intermediate sum always
/// appears in the demand. So one check at the end of the tick covers them all.
pub const INPUT_LIMIT: f64 = 1e12;

/// Smallest decrement per tick: half a unit in the last place of f32 is 6e-8, and less would leave the offset
/// unchanged.
const SLOWEST_DECAY: f64 = 1e-7;
/// Tolerance for a bandwidth set exactly to a limit: coinciding roots are found up to 0.24 % too large (module
/// `polynomial`).
const ROOT_SLACK: f64 = 1.003;

/// Output when the input is rejected.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Fallback {
    /// Output the u that the actuator already holds.
    HoldLast,
    /// Output this u, in the plant's input unit. It must lie within the limits.
    Safe(f64),
}

/// Complete design, with every number visible where it is used.
///
/// ```
/// use controller_core::*;
/// // A motor: 2e-4 kg m², 0.05 N m/A, viscous friction 1e-4 N m s/rad, 10 A.
/// const NOMINAL: Nominal<2> = Nominal { gradient: [0.0, -1e-4 / 2e-4], input_gain: 0.05 / 2e-4 };
/// const CONFIG: Config<2, 1> = Config {
///     period_s: 1e-3,
///     surface: Surface::from_bandwidth(20.0, 10.0),
///     observers: [None, Some(ObserverGains::from_bandwidth::<1>(100.0))],
///     reaching: ReachingLaw { k_l: 100.0, k_s: 0.0, epsilon: 0.01 },
///     nominal: NOMINAL,
///     options: Options::NEUTRAL.with_limits(Limits::symmetric(10.0)).with_fallback(Fallback::Safe(0.0)),
/// };
/// assert_eq!(CONFIG.validate(), Ok(()));
/// assert_eq!(CONFIG.warnings().iter().count(), 0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config<const N: usize, const R: usize> {
    /// Sampling period T, s.
    pub period_s: f64,
    /// Surface coefficients c and offset decay rate α, Eq. (44), (17).
    pub surface: Surface<N>,
    /// Observer gains in channels i = 1..n. `None` for a channel without an observer.
    pub observers: [Option<ObserverGains<R>>; N],
    /// Reaching law gains k_l, k_s, ε, Eq. (51).
    pub reaching: ReachingLaw,
    /// Nominal channel: b_0, and the gradient of a that the law compensates within the tick.
    pub nominal: Nominal<N>,
    /// Options, each with a neutral value.
    pub options: Options<N>,
}

/// Optional numbers of a design. Start from [`Options::NEUTRAL`] and change the ones that you need.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Options<const N: usize> {
    /// Initial estimates of d_1..d_n, each in its physical unit, for [`Running::guessing`](crate::Running::guessing).
    /// Entries of channels without an observer are not read.
    pub initial_estimates: [f64; N],
    /// Limits of u, in the plant's input unit.
    pub limits: Limits,
    /// Output when a sample is rejected.
    pub fallback: Fallback,
    /// Bound of |σ*|, in the unit of x_n. Above it the tick sets
    /// [`Health::SIGMA_STAR_OVER_BOUND`](crate::Health::SIGMA_STAR_OVER_BOUND).
    pub sigma_star_bound: f64,
    /// Largest accepted product of the fastest observer pole and T, 1 by default. Raise it only with a reason.
    pub observer_pole_limit: f64,
    /// Limits of a valid sample and its change. Only a [`Gated`](crate::Gated) controller applies them. Others reject
    /// them.
    pub samples: SampleLimits<N>,
}

/// Defines every option: type, neutral value, setter.
macro_rules! options {
    ($($name:ident: $type:ty = $neutral:expr, $set:ident;)*) => {
        impl<const N: usize> Options<N> {
            /// Neutral options: initial estimates of 0, no limit, the last u held on a lost sample, no σ* alarm below
            /// 1e12, no observer pole faster than 1/T, no limit of samples.
            pub const NEUTRAL: Self = Self { $($name: $neutral),* };

            $(#[doc = concat!("The same with this [`", stringify!($name), "`](Self::", stringify!($name), ").")]
            #[must_use]
            pub const fn $set(mut self, $name: $type) -> Self {
                self.$name = $name;
                self
            })*

            /// Returns the setter calls that build these options from [`NEUTRAL`](Self::NEUTRAL), to write a design as
            /// Rust code.
            #[doc(hidden)]
            pub fn calls(&self) -> impl Iterator<Item = (&'static str, &dyn core::fmt::Debug)> {
                let calls: [(&'static str, &dyn core::fmt::Debug); _] = [$((stringify!($set), &self.$name)),*];
                calls.into_iter()
            }
        }
    };
}
options! {
    initial_estimates: [f64; N] = [0.0; N], with_initial_estimates;
    limits: Limits = Limits::NONE, with_limits;
    fallback: Fallback = Fallback::HoldLast, with_fallback;
    sigma_star_bound: f64 = INPUT_LIMIT, with_sigma_star_bound;
    observer_pole_limit: f64 = 1.0, with_observer_pole_limit;
    samples: SampleLimits<N> = SampleLimits::NONE, with_samples;
}

impl<const N: usize, const R: usize> Config<N, R> {
    /// Checks every rule of the theory.
    ///
    /// # Errors
    /// Returns the first broken rule: field, cause with channel and equation, remedy.
    pub const fn validate(&self) -> Result<(), ConfigError> {
        const { assert_order(N) };
        check(&self.resized(), N, R)
    }

    /// Returns the warnings for a design that [`validate`](Self::validate) accepts.
    pub const fn warnings(&self) -> Warnings {
        const { assert_order(N) };
        remarks(&self.resized(), N)
    }

    /// Checks every rule of the theory, and treats each warning as an error.
    ///
    /// # Errors
    /// Returns the error of [`validate`](Self::validate), else the first of the [`warnings`](Self::warnings).
    pub const fn validate_strictly(&self) -> Result<(), ConfigError> {
        if let Err(error) = self.validate() {
            return Err(error);
        }
        match self.warnings().first() {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }

    /// Returns the configuration if it has no warnings. In a `const` design, warnings become compile errors.
    ///
    /// # Panics
    /// On a configuration that [`validate_strictly`](Self::validate_strictly) rejects. Outside a `const` use that
    /// function.
    #[must_use]
    pub const fn strict(self) -> Self {
        match self.validate_strictly() {
            Ok(()) => self,
            Err(error) => panic!("{}", error.text().as_str()),
        }
    }

    /// Returns the configuration in other orders, with rows cut or filled with zeros.
    const fn resized<const TO_N: usize, const TO_R: usize>(&self) -> Config<TO_N, TO_R> {
        let Self { period_s, surface, reaching, nominal, options, .. } = *self;
        let Options { initial_estimates, limits, fallback, sigma_star_bound, observer_pole_limit, samples } = options;
        let mut observers = [None; TO_N];
        let mut i = 0;
        while i < N && i < TO_N {
            if let Some(gains) = &self.observers[i] {
                observers[i] = Some(gains.resized());
            }
            i += 1;
        }
        Config {
            period_s,
            surface: Surface { c: resized(&surface.c), alpha_per_s: surface.alpha_per_s },
            observers,
            reaching,
            nominal: Nominal { gradient: resized(&nominal.gradient), input_gain: nominal.input_gain },
            options: Options {
                initial_estimates: resized(&initial_estimates),
                limits,
                fallback,
                sigma_star_bound,
                observer_pole_limit,
                samples: SampleLimits {
                    min: resized(&samples.min),
                    max: resized(&samples.max),
                    jump: resized(&samples.jump),
                },
            },
        }
    }
}

/// [`Config`] whose orders are numbers, for configurations from a file, a serial protocol or a user.
///
/// ```
/// use controller_core::*;
/// # const CONFIG: Config<2, 1> = Config {
/// #     period_s: 1e-3,
/// #     surface: Surface::from_bandwidth(20.0, 10.0),
/// #     observers: [None, Some(ObserverGains::from_bandwidth::<1>(100.0))],
/// #     reaching: ReachingLaw { k_l: 100.0, k_s: 0.0, epsilon: 0.01 },
/// #     nominal: Nominal { gradient: [0.0, -0.5], input_gain: 250.0 },
/// #     options: Options::NEUTRAL,
/// # };
/// let any = AnyConfig::from(CONFIG);
/// assert_eq!(any.shape(), Shape { n: 2, r: 1, mask: 0b10 });
/// assert_eq!(any.fixed::<2, 1>(), Some(CONFIG));
/// assert_eq!(any.fixed::<4, 2>(), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AnyConfig {
    /// Plant order n, 2..=6.
    pub n: usize,
    /// Numbers of the design. The first n entries of every row are read, and the observers of channels 1..n.
    pub padded: Config<MAX_N, MAX_R>,
}

/// Controller configuration: plant order, capacity for observer orders, observed channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Shape {
    /// Plant order n.
    pub n: u8,
    /// Highest order among the observers, or 1 without observers.
    pub r: u8,
    /// Observed channels: bit i - 1 is set for an observer in channel i.
    pub mask: u8,
}

impl<const N: usize, const R: usize> From<Config<N, R>> for AnyConfig {
    fn from(config: Config<N, R>) -> Self {
        Self { n: N, padded: config.resized() }
    }
}

impl AnyConfig {
    /// Checks every rule of the theory.
    ///
    /// # Errors
    /// Returns the first broken rule: field, cause with channel and equation, remedy.
    pub const fn validate(&self) -> Result<(), ConfigError> {
        if self.n < 2 || self.n > MAX_N {
            return Err(ConfigError::new(Field::Order, Cause::PlantOrder { n: self.n }));
        }
        check(&self.padded, self.n, MAX_R)
    }

    /// Returns the warnings for a design that [`validate`](Self::validate) accepts.
    pub const fn warnings(&self) -> Warnings {
        remarks(&self.padded, self.n)
    }

    /// Returns the smallest controller configuration that holds this design.
    pub fn shape(&self) -> Shape {
        let (mut r, mut mask) = (1, 0);
        for (i, gains) in self.padded.observers.iter().enumerate().take(self.n) {
            if let Some(gains) = gains {
                r = r.max(gains.order);
                mask |= 1 << i;
            }
        }
        let [n, r] = [self.n, r].map(|order| u8::try_from(order).unwrap_or(u8::MAX));
        Shape { n, r, mask }
    }

    /// Returns the configuration with the orders as types, or `None` if the orders differ.
    pub fn fixed<const N: usize, const R: usize>(&self) -> Option<Config<N, R>> {
        const { assert_order(N) };
        let fits = self.n == N && usize::from(self.shape().r) <= R;
        fits.then(|| self.padded.resized())
    }
}

/// Returns the first entries of a row, filled with zeros if the row is shorter.
pub(crate) const fn resized<const FROM: usize, const TO: usize>(row: &[f64; FROM]) -> [f64; TO] {
    let mut out = [0.0; TO];
    let mut i = 0;
    while i < FROM && i < TO {
        out[i] = row[i];
        i += 1;
    }
    out
}

/// Checks every rule, for a plant of order `n` <= 6 and observers of order up to `capacity`.
const fn check(config: &Config<MAX_N, MAX_R>, n: usize, capacity: usize) -> Result<(), ConfigError> {
    let Config { period_s, surface, observers, reaching, nominal, options } = config;
    if let Some(field) = not_finite(config, n) {
        return Err(ConfigError::new(field, Cause::NotFinite));
    }
    if *period_s <= 0.0 {
        return Err(ConfigError::new(Field::Period, Cause::PeriodNotPositive { period_s: *period_s }));
    }
    if nominal.input_gain == 0.0 {
        return Err(ConfigError::new(Field::InputGain, Cause::InputGainZero));
    }
    if let Err(error) = check_surface(surface, n, *period_s) {
        return Err(error);
    }
    let ReachingLaw { k_l, k_s, epsilon } = *reaching;
    let non_negative = [
        (k_l, Field::LinearGain),
        (k_s, Field::SwitchingGain),
        (options.sigma_star_bound, Field::SigmaStarBound),
        (options.observer_pole_limit, Field::ObserverPoleLimit),
    ];
    let mut k = 0;
    while k < non_negative.len() {
        if non_negative[k].0 < 0.0 {
            return Err(ConfigError::new(non_negative[k].1, Cause::Negative));
        }
        k += 1;
    }
    if k_s > 0.0 && (epsilon < 0.0 || epsilon + k_s * *period_s == 0.0) {
        return Err(ConfigError::new(Field::BoundaryLayer, Cause::BoundaryLayerEmpty { epsilon }));
    }
    let Limits { min, max } = options.limits;
    if min.abs() > INPUT_LIMIT || max.abs() > INPUT_LIMIT {
        let limit = if min.abs() > max.abs() { min } else { max };
        return Err(ConfigError::new(Field::Limits, Cause::LimitsTooWide { limit }));
    }
    if min > max {
        return Err(ConfigError::new(Field::Limits, Cause::LimitsReversed { min, max }));
    }
    if let Fallback::Safe(u) = options.fallback
        && (u < min || u > max)
    {
        return Err(ConfigError::new(Field::Fallback, Cause::FallbackOutsideLimits { u }));
    }
    let mut i = 0;
    while i < MAX_N && i < n {
        let unit = if i + 1 == n { nominal.input_gain } else { 1.0 };
        if observers[i].is_some() && (options.initial_estimates[i] / unit).abs() > INPUT_LIMIT {
            return Err(ConfigError::new(Field::InitialEstimates, Cause::CoefficientRange));
        }
        i += 1;
    }
    if let Err(error) = check_samples(&options.samples, n) {
        return Err(error);
    }
    let mut i = 0;
    while i < MAX_N && i < n {
        if let Some(gains) = &observers[i]
            && let Some(cause) = wrong_observer(gains, n - (i + 1), capacity, options.observer_pole_limit / *period_s)
        {
            return Err(ConfigError::new(Field::Observer { channel: i + 1 }, cause));
        }
        i += 1;
    }
    Ok(())
}

const fn check_surface(surface: &Surface<MAX_N>, n: usize, period_s: f64) -> Result<(), ConfigError> {
    let c_n = surface::lead(&surface.c, n);
    if c_n != 1.0 {
        return Err(ConfigError::new(Field::Surface, Cause::SurfaceLead { c_n }));
    }
    if !surface::is_hurwitz(&surface.c, n) {
        return Err(ConfigError::new(Field::Surface, Cause::SurfaceNotHurwitz));
    }
    let alpha_per_s = surface.alpha_per_s;
    if alpha_per_s <= 0.0 {
        return Err(ConfigError::new(Field::Alpha, Cause::OffsetDecayNotPositive { alpha_per_s }));
    }
    let alpha_times_period = alpha_per_s * period_s;
    if alpha_times_period < SLOWEST_DECAY {
        return Err(ConfigError::new(Field::Alpha, Cause::OffsetDecayTooSlow { alpha_times_period }));
    }
    Ok(())
}

const fn check_samples(samples: &SampleLimits<MAX_N>, n: usize) -> Result<(), ConfigError> {
    let SampleLimits { min, max, jump } = samples;
    let mut j = 0;
    while j < MAX_N && j < n {
        // A jump must be above 0 in f32 too.
        let numbers = min[j].abs() <= INPUT_LIMIT && max[j].abs() <= INPUT_LIMIT && jump[j] <= 2.0 * INPUT_LIMIT;
        if !numbers || min[j] > max[j] || jump[j] as f32 <= 0.0 {
            let (min, max, jump) = (min[j], max[j], jump[j]);
            return Err(ConfigError::new(Field::Samples, Cause::SamplesNone { state: j + 1, min, max, jump }));
        }
        j += 1;
    }
    Ok(())
}

/// Returns the error in the gains of one observer. `needed` is n - i, the order that Eq. (44) requires.
const fn wrong_observer(
    gains: &ObserverGains<MAX_R>,
    needed: usize,
    capacity: usize,
    allowed_rad_s: f64,
) -> Option<Cause> {
    let order = gains.order;
    if order == 0 || order > capacity {
        return Some(Cause::ObserverOrder { order, capacity });
    }
    if order < needed {
        return Some(Cause::OrderTooLow { needed, order });
    }
    if !gains.is_finite() {
        return Some(Cause::ObserverNotFinite);
    }
    if !gains.is_hurwitz() {
        return Some(Cause::ObserverNotHurwitz);
    }
    let fastest_rad_s = gains.fastest_rad_s();
    if fastest_rad_s > allowed_rad_s * ROOT_SLACK {
        return Some(Cause::ObserverTooFast { fastest_rad_s, allowed_rad_s });
    }
    None
}

/// Returns the first field that is not finite. The observer gains are checked per channel.
const fn not_finite(config: &Config<MAX_N, MAX_R>, n: usize) -> Option<Field> {
    let Config { period_s, surface, reaching, nominal, options, .. } = config;
    let mut i = 0;
    while i < MAX_N && i < n {
        if !surface.c[i].is_finite() {
            return Some(Field::Surface);
        }
        if !nominal.gradient[i].is_finite() {
            return Some(Field::Gradient);
        }
        if !options.initial_estimates[i].is_finite() {
            return Some(Field::InitialEstimates);
        }
        let SampleLimits { min, max, jump } = &options.samples;
        if !(min[i].is_finite() && max[i].is_finite() && jump[i].is_finite()) {
            return Some(Field::Samples);
        }
        i += 1;
    }
    let fallback = match options.fallback {
        Fallback::HoldLast => 0.0,
        Fallback::Safe(u) => u,
    };
    let numbers = [
        (*period_s, Field::Period),
        (surface.alpha_per_s, Field::Alpha),
        (reaching.k_l, Field::LinearGain),
        (reaching.k_s, Field::SwitchingGain),
        (reaching.epsilon, Field::BoundaryLayer),
        (nominal.input_gain, Field::InputGain),
        (options.limits.min, Field::Limits),
        (options.limits.max, Field::Limits),
        (fallback, Field::Fallback),
        (options.sigma_star_bound, Field::SigmaStarBound),
        (options.observer_pole_limit, Field::ObserverPoleLimit),
    ];
    let mut k = 0;
    while k < numbers.len() {
        if !numbers[k].0.is_finite() {
            return Some(numbers[k].1);
        }
        k += 1;
    }
    None
}

const fn remarks(config: &Config<MAX_N, MAX_R>, n: usize) -> Warnings {
    let mut warnings = Warnings::NONE;
    let mut i = 0;
    while i < MAX_N && i < n {
        if let Some(gains) = &config.observers[i] {
            let pole_times_period = gains.fastest_rad_s() * config.period_s;
            if pole_times_period > 0.3 * ROOT_SLACK {
                warnings = warnings.with(Warning::ObserverFast { channel: i + 1, pole_times_period });
            }
        }
        i += 1;
    }
    let k_l_times_period = config.reaching.k_l * config.period_s;
    if k_l_times_period > 0.5 {
        warnings = warnings.with(Warning::LinearGainHigh { k_l_times_period });
    }
    let bandwidth_times_period = surface::bandwidth_rad_s(&config.surface.c, n) * config.period_s;
    if bandwidth_times_period > 0.5 * ROOT_SLACK {
        warnings = warnings.with(Warning::SurfaceFast { bandwidth_times_period });
    }
    warnings
}
