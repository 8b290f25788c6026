//! Errors and warnings of a design.
//!
//! An error is data: the [`Field`] of the configuration, the [`Cause`] with its numbers and equation, and the
//! [`Remedy`]. A program that shows an error to a user can print field and remedy in the terms of its own file format
//! or language. This module has the Rust wording, which is also the compile error of a `const` design.

use core::fmt;

/// Error that rejects a design.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct ConfigError {
    /// Field with the error.
    pub field: Field,
    /// Cause of the error.
    pub cause: Cause,
}

/// Field of [`Config`](crate::Config).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Field {
    /// Plant order n, if the order is a number.
    Order,
    /// Field `period_s`.
    Period,
    /// Field `surface.c`.
    Surface,
    /// Field `surface.alpha_per_s`.
    Alpha,
    /// Field `observers`, entry of one channel.
    Observer {
        /// The channel, from 1.
        channel: usize,
    },
    /// Field `reaching.k_l`.
    LinearGain,
    /// Field `reaching.k_s`.
    SwitchingGain,
    /// Field `reaching.epsilon`.
    BoundaryLayer,
    /// Field `nominal.gradient`.
    Gradient,
    /// Field `nominal.input_gain`.
    InputGain,
    /// Field `options.initial_estimates`.
    InitialEstimates,
    /// Field `options.limits`.
    Limits,
    /// Field `options.fallback`.
    Fallback,
    /// Field `options.sigma_star_bound`.
    SigmaStarBound,
    /// Field `options.observer_pole_limit`.
    ObserverPoleLimit,
    /// Field `options.samples`.
    Samples,
    /// The whole configuration.
    Whole,
}

impl Field {
    /// Returns the path of the field in [`Config`](crate::Config).
    pub const fn name(self) -> &'static str {
        match self {
            Self::Order => "n",
            Self::Period => "period_s",
            Self::Surface => "surface.c",
            Self::Alpha => "surface.alpha_per_s",
            Self::Observer { .. } => "observers",
            Self::LinearGain => "reaching.k_l",
            Self::SwitchingGain => "reaching.k_s",
            Self::BoundaryLayer => "reaching.epsilon",
            Self::Gradient => "nominal.gradient",
            Self::InputGain => "nominal.input_gain",
            Self::InitialEstimates => "options.initial_estimates",
            Self::Limits => "options.limits",
            Self::Fallback => "options.fallback",
            Self::SigmaStarBound => "options.sigma_star_bound",
            Self::ObserverPoleLimit => "options.observer_pole_limit",
            Self::Samples => "options.samples",
            Self::Whole => "config",
        }
    }
}

/// Cause of an error in a field, with its numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Cause {
    /// The number is NaN or infinite.
    NotFinite,
    /// The number is below 0 but must not be.
    Negative,
    /// The period is 0 or below.
    PeriodNotPositive {
        /// Given period, s.
        period_s: f64,
    },
    /// The plant order is not in 2..=6.
    PlantOrder {
        /// Given order.
        n: usize,
    },
    /// The input gain b is 0: the plant cannot be controlled.
    InputGainZero,
    /// The last surface coefficient c_n is not 1.
    SurfaceLead {
        /// Given c_n.
        c_n: f64,
    },
    /// A root of the sliding motion is not in the left half plane.
    SurfaceNotHurwitz,
    /// The offset decay rate α is 0 or below.
    OffsetDecayNotPositive {
        /// Given α, 1/s.
        alpha_per_s: f64,
    },
    /// α T is so small that an f32 offset would never decay.
    OffsetDecayTooSlow {
        /// Product α T.
        alpha_times_period: f64,
    },
    /// The boundary layer is empty: k_s > 0 with ε < 0, or with ε = 0 and k_s T = 0.
    BoundaryLayerEmpty {
        /// Given ε.
        epsilon: f64,
    },
    /// A limit exceeds [`INPUT_LIMIT`](crate::INPUT_LIMIT).
    LimitsTooWide {
        /// Given limit.
        limit: f64,
    },
    /// The limits are reversed: min > max.
    LimitsReversed {
        /// Given lower limit.
        min: f64,
        /// Given upper limit.
        max: f64,
    },
    /// The safe output u is not within the limits.
    FallbackOutsideLimits {
        /// Given u.
        u: f64,
    },
    /// The configured observers differ from the observers of the controller type.
    ChannelMismatch {
        /// True if the configuration has an observer in this channel.
        configured: bool,
    },
    /// The observer order is 0 or exceeds the capacity R.
    ObserverOrder {
        /// Given order.
        order: usize,
        /// Capacity R.
        capacity: usize,
    },
    /// Eq. (44) needs a derivative that this observer does not estimate.
    OrderTooLow {
        /// Needed order n - i.
        needed: usize,
        /// Given order.
        order: usize,
    },
    /// An observer gain is NaN or infinite.
    ObserverNotFinite,
    /// Matrix D of Eq. (53) is not Hurwitz.
    ObserverNotHurwitz,
    /// The fastest observer pole times the period exceeds the configured limit.
    ObserverTooFast {
        /// Fastest pole, rad/s.
        fastest_rad_s: f64,
        /// Largest value of the fastest pole that this period allows, rad/s.
        allowed_rad_s: f64,
    },
    /// No sample satisfies the limits: min > max, or a jump of 0 or below.
    SamplesNone {
        /// State, from 1.
        state: usize,
        /// Given smallest x.
        min: f64,
        /// Given largest x.
        max: f64,
        /// Given jump.
        jump: f64,
    },
    /// The slope of the model differs from the nominal gradient.
    GradientContradicts {
        /// State, from 1.
        state: usize,
        /// Entry of the gradient.
        said: f64,
        /// Slope of the model.
        found: f64,
    },
    /// b(x) of the model does not have the sign of b_0.
    GainContradicts {
        /// Ratio b(x)/b_0 of the model.
        ratio: f64,
    },
    /// The configuration has limits of samples, but the controller has no gate to apply them.
    GateMissing,
    /// A designed coefficient is not a normal number in the precision of the controller.
    CoefficientRange,
    /// A warning, treated as an error by [`Config::validate_strictly`](crate::Config::validate_strictly).
    Warned(Warning),
}

/// Remedy for an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Remedy {
    /// The cause already implies the remedy.
    AsTheCauseSays,
    /// Give a finite number. For a limit of u, you can also give no limit.
    FiniteNumber,
    /// If the actuator has no limit, give no limit.
    NoLimit,
    /// Compute the surface from a bandwidth.
    SurfaceFromBandwidth,
    /// Compute the observer gains from a bandwidth or from poles.
    ObserverFromBandwidth,
    /// Observe the channel in the type too, or remove its observer.
    AddToType,
    /// Give the gains of the observer, or remove it from the type.
    GiveGains,
    /// Choose another order, or another capacity R.
    OtherOrder,
    /// Choose a slower observer, a shorter period, or a higher limit.
    SlowerObserver,
    /// Put the controller behind a gate, or give no limits of samples.
    AddGate,
}

impl Remedy {
    /// Returns the remedy in the wording of Rust.
    const fn words(self) -> &'static str {
        match self {
            Self::AsTheCauseSays => "",
            Self::FiniteNumber => ": give a finite one (for no limit of u: Limits::NONE)",
            Self::NoLimit => ": where the actuator has none give Limits::NONE",
            Self::SurfaceFromBandwidth => "; try Surface::from_bandwidth",
            Self::ObserverFromBandwidth => ": take them from_bandwidth or from_poles",
            Self::AddToType => ": add it to the controller's type, or set it to None",
            Self::GiveGains => ": give its gains, or take it out of the controller's type",
            Self::OtherOrder => ": change it, or the capacity R of the controller's type",
            Self::SlowerObserver => ": slow the observer, shorten the period, or raise observer_pole_limit",
            Self::AddGate => ": design a Gated<..> of it, or leave with_samples out",
        }
    }
}

impl Cause {
    /// Returns the cause in words that fit every language. The numbers are added separately.
    const fn words(self) -> &'static str {
        match self {
            Self::NotFinite => "this number is NaN or infinite",
            Self::PeriodNotPositive { .. } => "the period must be above 0 s",
            Self::PlantOrder { .. } => "the plant order must be 2..=6 (Eq. (39))",
            Self::InputGainZero => {
                "the nominal input gain b is 0 (Eq. (39)): the law divides by it; give b(x)'s nominal value"
            }
            Self::SurfaceLead { .. } => "the last surface coefficient must be c_n = 1 (Eq. (44)): divide all c by it",
            Self::SurfaceNotHurwitz => {
                "the surface polynomial p^(n-1) + c_{n-1} p^(n-2) + .. + c_1 is not Hurwitz (Eq. (44)): \
                 the sliding motion would diverge"
            }
            Self::OffsetDecayNotPositive { .. } => {
                "alpha must be above 0 1/s (Eq. (17)): the offset of sigma* would never decay"
            }
            Self::OffsetDecayTooSlow { .. } => {
                "alpha times period is below 1e-7 (Eq. (17)): the offset of sigma* would not decay in f32; \
                 raise alpha or lengthen the period"
            }
            Self::Negative => "this number must not be negative",
            Self::BoundaryLayerEmpty { .. } => {
                "with k_s > 0 the boundary layer epsilon must not be below 0, \
                 nor 0 where k_s times period is 0 (Eq. (51))"
            }
            Self::LimitsTooWide { .. } => "a limit of u is beyond 1e12",
            Self::LimitsReversed { .. } => "the limits are reversed: min must not be above max",
            Self::FallbackOutsideLimits { .. } => {
                "the safe u lies outside the limits: give one that the actuator can hold"
            }
            Self::ChannelMismatch { configured: true } => {
                "this channel has an observer in the configuration but not in the controller's type (Eq. (47))"
            }
            Self::ChannelMismatch { configured: false } => {
                "this channel has an observer in the controller's type but none in the configuration (Eq. (47))"
            }
            Self::ObserverOrder { .. } => "the observer order must be 1..=R (Eq. (45))",
            Self::OrderTooLow { .. } => {
                "the observer order is below n - i, so that sigma needs a derivative it does not estimate (Eq. (44)): \
                 raise the order, or observe no disturbance there"
            }
            Self::ObserverNotFinite => {
                "an observer gain is NaN or infinite (Eq. (53)): \
                 give finite gains, or poles that are real or come in conjugate pairs"
            }
            Self::ObserverNotHurwitz => "the observer gains are not Hurwitz (Eq. (53); order 3 needs l1 l2 > l3)",
            Self::ObserverTooFast { .. } => "the fastest observer pole is too fast for the period (Eq. (53))",
            Self::SamplesNone { .. } => {
                "no sample keeps these limits: min must not be above max, nor any beyond 1e12, and the jump must be \
                 above 0"
            }
            Self::GradientContradicts { .. } => {
                "the model has another slope there than nominal.gradient says (Eq. (39)): \
                 it returns a(x)/b_0, the gradient is that of a(x)"
            }
            Self::GainContradicts { .. } => {
                "b(x) of the model is not of the sign of nominal.input_gain (Eq. (39)): it returns b(x)/b_0"
            }
            Self::GateMissing => "limits of samples are kept by a gate, and this law has none",
            Self::CoefficientRange => {
                "a designed coefficient overflows or vanishes in this precision: \
                 check the units of the period, the gains and b"
            }
            Self::Warned(Warning::ObserverFast { .. }) => {
                "the fastest observer pole times period is above 0.3, where the estimate loses accuracy: \
                 slow the observer or shorten the period"
            }
            Self::Warned(Warning::LinearGainHigh { .. }) => {
                "k_l times period is above 0.5, where there is little margin for a wrong b or a delay: \
                 lower k_l or shorten the period"
            }
            Self::Warned(Warning::SurfaceFast { .. }) => {
                "the surface bandwidth times period is above 0.5: slow the surface or shorten the period"
            }
        }
    }

    /// Returns the remedy for the cause.
    pub const fn remedy(self) -> Remedy {
        match self {
            Self::NotFinite => Remedy::FiniteNumber,
            Self::LimitsTooWide { .. } => Remedy::NoLimit,
            Self::SurfaceNotHurwitz => Remedy::SurfaceFromBandwidth,
            Self::ObserverNotHurwitz => Remedy::ObserverFromBandwidth,
            Self::ChannelMismatch { configured: true } => Remedy::AddToType,
            Self::ChannelMismatch { configured: false } => Remedy::GiveGains,
            Self::ObserverOrder { .. } => Remedy::OtherOrder,
            Self::ObserverTooFast { .. } => Remedy::SlowerObserver,
            Self::GateMissing => Remedy::AddGate,
            _ => Remedy::AsTheCauseSays,
        }
    }
}

impl ConfigError {
    pub(crate) const fn new(field: Field, cause: Cause) -> Self {
        Self { field, cause }
    }

    /// Returns place and cause, without the remedy.
    const fn complaint(&self) -> Text {
        let text = match self.field {
            Field::Observer { channel } => Text::new().string("channel ").number(channel).string(": "),
            _ => Text::new(),
        };
        let text = match self.cause {
            Cause::SamplesNone { state, .. } | Cause::GradientContradicts { state, .. } => {
                text.string("x_").number(state).string(": ")
            }
            Cause::NotFinite | Cause::Negative => text.string(self.field.name()).string(": "),
            Cause::OrderTooLow { needed, order } => {
                text.string("needs observer order ").number(needed).string(", has ").number(order).string(": ")
            }
            Cause::ObserverOrder { order, capacity } => {
                text.string("has observer order ").number(order).string(" with R = ").number(capacity).string(": ")
            }
            _ => text,
        };
        text.string(self.cause.words())
    }

    /// Returns one line in the wording of Rust. It is built in `const`, so that a compile error can print it.
    pub(crate) const fn text(&self) -> Text {
        self.complaint().string(self.cause.remedy().words())
    }

    /// Returns one line for a reader who does not write Rust, with another name for the field and other words for the
    /// remedy.
    ///
    /// `remedy` includes the punctuation before it (`""`, `": .."` or `"; .."`).
    pub fn told<'a>(&self, field: &'a str, remedy: &'a str) -> impl fmt::Display + use<'a> {
        CallerMessage { error: *self, field, remedy }
    }
}

/// Number for a message, with a power of ten where it would take many digits.
pub(crate) struct Short(pub(crate) f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_plain = self.0 == 0.0 || (1e-4..1e9).contains(&self.0.abs());
        if is_plain { fmt::Display::fmt(&self.0, f) } else { fmt::LowerExp::fmt(&self.0, f) }
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.words())?;
        f.write_str(self.remedy().words())
    }
}

impl core::error::Error for Cause {}

/// Error with the field name and the remedy of the caller.
struct CallerMessage<'a> {
    error: ConfigError,
    field: &'a str,
    remedy: &'a str,
}

impl fmt::Display for CallerMessage<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let complaint = self.error.complaint();
        // The name of a field is at the start, or absent.
        let (name, text) = (self.error.field.name(), complaint.as_str());
        match text.strip_prefix(name) {
            Some(rest) => write!(f, "{}{rest}", self.field)?,
            None => f.write_str(text)?,
        }
        f.write_str(self.remedy)?;
        match self.error.cause {
            Cause::PlantOrder { n } => write!(f, " (given {n})"),
            Cause::PeriodNotPositive { period_s } => write!(f, " (given {} s)", Short(period_s)),
            Cause::OffsetDecayNotPositive { alpha_per_s } => write!(f, " (given {} 1/s)", Short(alpha_per_s)),
            Cause::LimitsReversed { min, max } => write!(f, " (given min {}, max {})", Short(min), Short(max)),
            Cause::SurfaceLead { c_n: given }
            | Cause::OffsetDecayTooSlow { alpha_times_period: given }
            | Cause::BoundaryLayerEmpty { epsilon: given }
            | Cause::LimitsTooWide { limit: given }
            | Cause::FallbackOutsideLimits { u: given } => write!(f, " (given {})", Short(given)),
            Cause::GradientContradicts { said, found, .. } => {
                write!(f, " (said {:.4}, found {:.4})", Short(said), Short(found))
            }
            Cause::GainContradicts { ratio } => write!(f, " (b(x)/b_0 = {:.4})", Short(ratio)),
            Cause::SamplesNone { min, max, jump, .. } => {
                write!(f, " (given min {}, max {}, jump {})", Short(min), Short(max), Short(jump))
            }
            Cause::ObserverTooFast { fastest_rad_s, allowed_rad_s } => {
                let [fastest, allowed] = [fastest_rad_s, allowed_rad_s].map(Short);
                write!(f, " (fastest pole {fastest:.4} rad/s, allowed {allowed:.4} rad/s)")
            }
            Cause::Warned(
                Warning::ObserverFast { pole_times_period: product, .. }
                | Warning::LinearGainHigh { k_l_times_period: product }
                | Warning::SurfaceFast { bandwidth_times_period: product },
            ) => write!(f, " ({:.3})", Short(product)),
            _ => Ok(()),
        }
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        CallerMessage { error: *self, field: self.field.name(), remedy: self.cause.remedy().words() }.fmt(f)
    }
}

impl core::error::Error for ConfigError {}

/// Line of text of fixed capacity. Text that does not fit is cut.
#[derive(Clone, Copy)]
pub(crate) struct Text {
    bytes: [u8; 320],
    len: usize,
}

impl Text {
    pub(crate) const fn new() -> Self {
        Self { bytes: [0; 320], len: 0 }
    }

    pub(crate) const fn string(mut self, part: &str) -> Self {
        let part = part.as_bytes();
        let mut k = 0;
        while k < part.len() && self.len < self.bytes.len() {
            self.bytes[self.len] = part[k];
            self.len += 1;
            k += 1;
        }
        self
    }

    pub(crate) const fn number(self, n: usize) -> Self {
        let this = if n >= 10 { self.number(n / 10) } else { self };
        let digit = [b'0' + (n % 10) as u8];
        match core::str::from_utf8(&digit) {
            Ok(digit) => this.string(digit),
            Err(_) => this,
        }
    }

    pub(crate) const fn as_str(&self) -> &str {
        match core::str::from_utf8(self.bytes.split_at(self.len).0) {
            Ok(text) => text,
            Err(_) => "",
        }
    }
}

/// Warning about a valid design near a limit of accuracy, or of robustness against delay and a wrong b.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Warning {
    /// The fastest observer pole times T exceeds 0.3: the estimate between the ticks loses accuracy.
    ObserverFast {
        /// The channel, from 1.
        channel: usize,
        /// Fastest pole times period.
        pole_times_period: f64,
    },
    /// k_l T exceeds 0.5: little margin with a delay, or if b or the slope is off by more than 1.5 times.
    LinearGainHigh {
        /// Product k_l T.
        k_l_times_period: f64,
    },
    /// The surface bandwidth times T exceeds 0.5: the sliding motion is as fast as the ticks.
    SurfaceFast {
        /// Bandwidth times period.
        bandwidth_times_period: f64,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::ObserverFast { channel, pole_times_period } => write!(
                f,
                "channel {channel}: fastest observer pole times period is {:.3} (above 0.3 the estimate loses \
                 accuracy): slow the observer or shorten the period",
                Short(pole_times_period)
            ),
            Self::LinearGainHigh { k_l_times_period } => write!(
                f,
                "k_l times period is {:.3} (above 0.5 there is little margin for a wrong b or a delay): \
                 lower k_l or shorten the period",
                Short(k_l_times_period)
            ),
            Self::SurfaceFast { bandwidth_times_period } => write!(
                f,
                "surface bandwidth times period is {:.3} (above 0.5): slow the surface or shorten the period",
                Short(bandwidth_times_period)
            ),
        }
    }
}

/// Warnings about one design: at most one per channel and two more.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Warnings {
    list: [Option<Warning>; 8],
    len: usize,
}

impl Warnings {
    pub(crate) const NONE: Self = Self { list: [None; 8], len: 0 };

    #[must_use]
    pub(crate) const fn with(mut self, warning: Warning) -> Self {
        self.list[self.len] = Some(warning);
        self.len += 1;
        self
    }

    /// Returns the first warning as an error.
    pub(crate) const fn first(&self) -> Option<ConfigError> {
        let [Some(warning), ..] = self.list else { return None };
        let field = match warning {
            Warning::ObserverFast { channel, .. } => Field::Observer { channel },
            Warning::LinearGainHigh { .. } => Field::LinearGain,
            Warning::SurfaceFast { .. } => Field::Surface,
        };
        Some(ConfigError::new(field, Cause::Warned(warning)))
    }

    /// Returns the warnings in turn.
    pub fn iter(&self) -> impl Iterator<Item = &Warning> {
        self.list.iter().flatten()
    }
}
