//! Why a design is refused, and what a design that is accepted should still be warned of.
//!
//! Every message names the channel (from 1, as the paper counts), the equation and the remedy. In a `const` the same
//! text is the compile error.

use core::fmt;

/// A design that must not run.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum ConfigError {
    /// The field is NaN or infinite.
    NotFinite {
        /// Name of the field of [`Config`](crate::Config).
        field: &'static str,
    },
    /// `period_s` <= 0.
    PeriodNotPositive {
        /// The period given, s.
        period_s: f64,
    },
    /// b = 0: the plant cannot be controlled.
    InputGainZero,
    /// c_n != 1.
    SurfaceLead {
        /// The c_n given.
        c_n: f64,
    },
    /// A root of the sliding motion is not in the left half plane.
    SurfaceNotHurwitz,
    /// α <= 0.
    OffsetDecayNotPositive {
        /// The α given, 1/s.
        alpha_per_s: f64,
    },
    /// α T so small that an f32 offset would never decay.
    OffsetDecayTooSlow {
        /// α T.
        alpha_times_period: f64,
    },
    /// A reaching gain or a bound below 0.
    Negative {
        /// Name of the field of [`Config`](crate::Config).
        field: &'static str,
    },
    /// k_s > 0 with ε < 0, or with ε = 0 and k_s T = 0.
    BoundaryLayerEmpty {
        /// The ε given.
        epsilon: f64,
    },
    /// A limit beyond [`INPUT_LIMIT`](crate::INPUT_LIMIT).
    LimitsTooWide {
        /// The limit given.
        limit: f64,
    },
    /// min > max.
    LimitsReversed {
        /// The lower limit given.
        min: f64,
        /// The upper limit given.
        max: f64,
    },
    /// The safe u is not within the limits.
    FallbackOutsideLimits {
        /// The u given.
        u: f64,
    },
    /// The configured observers are not the ones the controller type has.
    ChannelMismatch {
        /// The channel, from 1.
        channel: usize,
        /// Does the configuration have an observer there?
        configured: bool,
    },
    /// An order of 0 or above the capacity `R`.
    ObserverOrder {
        /// The channel, from 1.
        channel: usize,
        /// The order given.
        order: usize,
        /// The capacity R.
        capacity: usize,
    },
    /// Eq. (44) needs a derivative that this observer does not estimate.
    OrderTooLow {
        /// The channel, from 1.
        channel: usize,
        /// n - i.
        needed: usize,
        /// The order given.
        order: usize,
    },
    /// A gain is NaN or infinite.
    ObserverNotFinite {
        /// The channel, from 1.
        channel: usize,
    },
    /// D of Eq. (53) is not Hurwitz.
    ObserverNotHurwitz {
        /// The channel, from 1.
        channel: usize,
    },
    /// The fastest observer pole times the period is above the configured limit.
    ObserverTooFast {
        /// The channel, from 1.
        channel: usize,
        /// Fastest pole, rad/s.
        fastest_rad_s: f64,
        /// Largest fastest pole that this period allows, rad/s.
        allowed_rad_s: f64,
    },
    /// A designed coefficient is not a normal number in the precision of the controller.
    CoefficientRange,
}

impl ConfigError {
    /// The channel it is about, from 1.
    pub const fn channel(&self) -> Option<usize> {
        match *self {
            Self::ChannelMismatch { channel, .. }
            | Self::ObserverOrder { channel, .. }
            | Self::OrderTooLow { channel, .. }
            | Self::ObserverNotFinite { channel }
            | Self::ObserverNotHurwitz { channel }
            | Self::ObserverTooFast { channel, .. } => Some(channel),
            _ => None,
        }
    }

    /// What is wrong and what to do, without the numbers: usable in a `const`.
    pub const fn reason(&self) -> &'static str {
        match self {
            Self::NotFinite { .. } => {
                "this number is NaN or infinite: give a finite one (for no limit of u: Limits::NONE)"
            }
            Self::PeriodNotPositive { .. } => "the period must be above 0 s",
            Self::InputGainZero => {
                "the nominal input gain b is 0 (Eq. (39)): the law divides by it; give b(x)'s nominal value"
            }
            Self::SurfaceLead { .. } => "the last surface coefficient must be c_n = 1 (Eq. (44)): divide all c by it",
            Self::SurfaceNotHurwitz => {
                "the surface polynomial p^(n-1) + c_{n-1} p^(n-2) + .. + c_1 is not Hurwitz (Eq. (44)): the sliding motion would diverge; try Surface::from_bandwidth"
            }
            Self::OffsetDecayNotPositive { .. } => {
                "alpha must be above 0 1/s (Eq. (17)): the offset of sigma* would never decay"
            }
            Self::OffsetDecayTooSlow { .. } => {
                "alpha times period is below 1e-7 (Eq. (17)): the offset of sigma* would not decay in f32; raise alpha or lengthen the period"
            }
            Self::Negative { .. } => "this number must not be negative",
            Self::BoundaryLayerEmpty { .. } => "with k_s > 0 the boundary layer epsilon must be above 0 (Eq. (51))",
            Self::LimitsTooWide { .. } => "a limit of u is beyond 1e12: where the actuator has none give Limits::NONE",
            Self::LimitsReversed { .. } => "the limits are reversed: min must not be above max",
            Self::FallbackOutsideLimits { .. } => {
                "the safe u lies outside the limits: give one that the actuator can hold"
            }
            Self::ChannelMismatch { configured: true, .. } => {
                "this channel has an observer in the configuration but not in the controller's type (Eq. (47)): add it to MASK and O, or set it to None"
            }
            Self::ChannelMismatch { configured: false, .. } => {
                "this channel has an observer in the controller's type but none in the configuration (Eq. (47)): give its gains, or take it out of MASK and O"
            }
            Self::ObserverOrder { .. } => {
                "the observer order must be 1..=R (Eq. (45)): change it, or the capacity R of the controller's type"
            }
            Self::OrderTooLow { .. } => {
                "the observer order is below n - i, so that sigma needs a derivative it does not estimate (Eq. (44)): raise the order, or observe no disturbance there"
            }
            Self::ObserverNotFinite { .. } => {
                "an observer gain is NaN or infinite (Eq. (53)): give finite gains, or poles that are real or come in conjugate pairs"
            }
            Self::ObserverNotHurwitz { .. } => {
                "the observer gains are not Hurwitz (Eq. (53); order 3 needs l1 l2 > l3): take them from_bandwidth or from_poles"
            }
            Self::ObserverTooFast { .. } => {
                "the fastest observer pole is too fast for the period (Eq. (53)): slow the observer, shorten the period, or raise observer_pole_limit"
            }
            Self::CoefficientRange => {
                "a designed coefficient overflows or vanishes in this precision: check the units of the period, the gains and b"
            }
        }
    }

    /// Channel, orders and reason as one line, built in `const` so that a compile error can say it.
    pub(crate) const fn text(&self) -> Text {
        let text = match self.channel() {
            Some(channel) => Text::new().string("channel ").number(channel).string(": "),
            None => Text::new(),
        };
        let text = match *self {
            Self::NotFinite { field } | Self::Negative { field } => text.string(field).string(": "),
            Self::OrderTooLow { needed, order, .. } => {
                text.string("needs observer order ").number(needed).string(", has ").number(order).string(": ")
            }
            Self::ObserverOrder { order, capacity, .. } => {
                text.string("has observer order ").number(order).string(" with R = ").number(capacity).string(": ")
            }
            _ => text,
        };
        text.string(self.reason())
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text().as_str())?;
        match *self {
            Self::PeriodNotPositive { period_s } => write!(f, " (given {period_s} s)"),
            Self::SurfaceLead { c_n } => write!(f, " (given {c_n})"),
            Self::OffsetDecayNotPositive { alpha_per_s } => write!(f, " (given {alpha_per_s} 1/s)"),
            Self::OffsetDecayTooSlow { alpha_times_period } => write!(f, " (given {alpha_times_period})"),
            Self::BoundaryLayerEmpty { epsilon } => write!(f, " (given {epsilon})"),
            Self::LimitsTooWide { limit } => write!(f, " (given {limit})"),
            Self::LimitsReversed { min, max } => write!(f, " (given min {min}, max {max})"),
            Self::FallbackOutsideLimits { u } => write!(f, " (given {u})"),
            Self::ObserverTooFast { fastest_rad_s, allowed_rad_s, .. } => {
                write!(f, " (fastest pole {fastest_rad_s:.4} rad/s, allowed {allowed_rad_s:.4} rad/s)")
            }
            _ => Ok(()),
        }
    }
}

impl core::error::Error for ConfigError {}

/// A line of text of fixed capacity; what does not fit is cut.
#[derive(Clone, Copy)]
pub(crate) struct Text {
    bytes: [u8; 320],
    len: usize,
}

impl Text {
    const fn new() -> Self {
        Self { bytes: [0; 320], len: 0 }
    }

    const fn string(mut self, part: &str) -> Self {
        let part = part.as_bytes();
        let mut k = 0;
        while k < part.len() && self.len < self.bytes.len() {
            self.bytes[self.len] = part[k];
            self.len += 1;
            k += 1;
        }
        self
    }

    const fn number(self, n: usize) -> Self {
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

/// One remark on a design that runs but is near an edge (theory: accuracy, robustness against delay and a wrong b).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Warning {
    /// Fastest observer pole times T above 0.3: the estimate between the ticks loses accuracy.
    ObserverFast {
        /// The channel, from 1.
        channel: usize,
        /// Fastest pole times period.
        pole_times_period: f64,
    },
    /// k_l T above 0.5: little margin if b or the slope is off by more than 1.5 times, or with a delay.
    LinearGainHigh {
        /// k_l times period.
        k_l_times_period: f64,
    },
    /// Surface bandwidth times T above 0.5: the sliding motion is as fast as the ticks.
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
                "channel {channel}: fastest observer pole times period is {pole_times_period:.3} (above 0.3 the estimate loses accuracy): slow the observer or shorten the period"
            ),
            Self::LinearGainHigh { k_l_times_period } => write!(
                f,
                "k_l times period is {k_l_times_period:.3} (above 0.5 there is little margin for a wrong b or a delay): lower k_l or shorten the period"
            ),
            Self::SurfaceFast { bandwidth_times_period } => write!(
                f,
                "surface bandwidth times period is {bandwidth_times_period:.3} (above 0.5): slow the surface or shorten the period"
            ),
        }
    }
}

/// The remarks on one design; at most one per channel and two more.
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

    /// The remarks in turn.
    pub fn iter(&self) -> impl Iterator<Item = &Warning> {
        self.list.iter().flatten()
    }

    /// Nothing to remark?
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }
}
