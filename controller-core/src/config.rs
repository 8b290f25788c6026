//! A whole design in SI units, and every rule it must keep.
//!
//! [`Config`] is a full struct literal: every number is visible where it is used. [`Config::validate`] refuses what the
//! theory refuses, and names channel, equation and remedy; [`Config::warnings`] remarks on what is near an edge.

use crate::error::{ConfigError, Warning, Warnings};
use crate::law::{Limits, ReachingLaw};
use crate::model::Nominal;
use crate::observer::ObserverGains;
use crate::surface::Surface;

/// Largest |u| that the law may ask for, that limits may allow and that [`State::applied`](crate::State::applied)
/// takes. A sample that makes the law ask for more is rejected as one that is not finite: whatever is wrong with x,
/// a(x), b(x) or a sum on the way ends up in the demand, so that one comparison at the end of the tick guards them all.
pub const INPUT_LIMIT: f64 = 1e12;

/// Half a unit in the last place of f32 is 6e-8: a smaller decrement per tick would leave the offset as it is.
const SLOWEST_DECAY: f64 = 1e-7;
/// A bandwidth set exactly to a limit must pass: coinciding roots are found up to 0.24 % too large (module
/// `polynomial`).
const ROOT_SLACK: f64 = 1.003;

/// What goes out when the input is rejected.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Fallback {
    /// The u that the actuator holds already.
    HoldLast,
    /// This u, in the plant's input unit; it must lie within the limits.
    Safe(f64),
}

/// A whole design, every number visible where it is used.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config<const N: usize, const R: usize> {
    /// Period T, s.
    pub period_s: f64,
    /// c and α, Eq. (44), (17).
    pub surface: Surface<N>,
    /// Gains of the observer in channel i = 1..n; `None` where there is none.
    pub observers: [Option<ObserverGains<R>>; N],
    /// k_l, k_s, ε, Eq. (51).
    pub reaching: ReachingLaw,
    /// b_0 and the gradient of a that the law allows for inside the tick.
    pub nominal: Nominal<N>,
    /// Clamp of u, in the plant's input unit.
    pub limits: Limits,
    /// What goes out when a sample is rejected.
    pub fallback: Fallback,
    /// Over this |σ*| (unit of x_n) the tick says [`Health::SIGMA_STAR_OVER_BOUND`](crate::Health::SIGMA_STAR_OVER_BOUND).
    pub sigma_star_bound: f64,
    /// Fastest observer pole times T above which the design is refused; 1 unless you know why.
    pub observer_pole_limit: f64,
}

impl<const N: usize, const R: usize> Config<N, R> {
    /// Checks every rule of the theory.
    ///
    /// # Errors
    /// The first rule that is broken, with channel, equation and remedy.
    pub const fn validate(&self) -> Result<(), ConfigError> {
        if let Some(field) = self.not_finite() {
            return Err(ConfigError::NotFinite { field });
        }
        if self.period_s <= 0.0 {
            return Err(ConfigError::PeriodNotPositive { period_s: self.period_s });
        }
        if self.nominal.input_gain == 0.0 {
            return Err(ConfigError::InputGainZero);
        }
        if self.surface.c[N - 1] != 1.0 {
            return Err(ConfigError::SurfaceLead { c_n: self.surface.c[N - 1] });
        }
        if !self.surface.is_hurwitz() {
            return Err(ConfigError::SurfaceNotHurwitz);
        }
        if self.surface.alpha_per_s <= 0.0 {
            return Err(ConfigError::OffsetDecayNotPositive { alpha_per_s: self.surface.alpha_per_s });
        }
        let alpha_times_period = self.surface.alpha_per_s * self.period_s;
        if alpha_times_period < SLOWEST_DECAY {
            return Err(ConfigError::OffsetDecayTooSlow { alpha_times_period });
        }
        let ReachingLaw { k_l, k_s, epsilon } = self.reaching;
        let non_negative = [
            (k_l, "reaching.k_l"),
            (k_s, "reaching.k_s"),
            (self.sigma_star_bound, "sigma_star_bound"),
            (self.observer_pole_limit, "observer_pole_limit"),
        ];
        let mut k = 0;
        while k < non_negative.len() {
            if non_negative[k].0 < 0.0 {
                return Err(ConfigError::Negative { field: non_negative[k].1 });
            }
            k += 1;
        }
        if k_s > 0.0 && (epsilon < 0.0 || epsilon + k_s * self.period_s == 0.0) {
            return Err(ConfigError::BoundaryLayerEmpty { epsilon });
        }
        let Limits { min, max } = self.limits;
        if min.abs() > INPUT_LIMIT || max.abs() > INPUT_LIMIT {
            return Err(ConfigError::LimitsTooWide { limit: if min.abs() > max.abs() { min } else { max } });
        }
        if min > max {
            return Err(ConfigError::LimitsReversed { min, max });
        }
        if let Fallback::Safe(u) = self.fallback
            && (u < min || u > max)
        {
            return Err(ConfigError::FallbackOutsideLimits { u });
        }
        let mut i = 0;
        while i < N {
            if let Some(gains) = &self.observers[i]
                && let Err(error) = self.validate_observer(i, gains)
            {
                return Err(error);
            }
            i += 1;
        }
        Ok(())
    }

    const fn validate_observer(&self, i: usize, gains: &ObserverGains<R>) -> Result<(), ConfigError> {
        let channel = i + 1;
        let needed = N - channel;
        if gains.order == 0 || gains.order > R {
            return Err(ConfigError::ObserverOrder { channel, order: gains.order, capacity: R });
        }
        if gains.order < needed {
            return Err(ConfigError::OrderTooLow { channel, needed, order: gains.order });
        }
        if !gains.is_finite() {
            return Err(ConfigError::ObserverNotFinite { channel });
        }
        if !gains.is_hurwitz() {
            return Err(ConfigError::ObserverNotHurwitz { channel });
        }
        let allowed_rad_s = self.observer_pole_limit / self.period_s;
        let fastest_rad_s = gains.fastest_rad_s();
        if fastest_rad_s > allowed_rad_s * ROOT_SLACK {
            return Err(ConfigError::ObserverTooFast { channel, fastest_rad_s, allowed_rad_s });
        }
        Ok(())
    }

    /// Name of the first field that is not finite (gains of observers are looked at per channel).
    const fn not_finite(&self) -> Option<&'static str> {
        let mut i = 0;
        while i < N {
            if !self.surface.c[i].is_finite() {
                return Some("surface.c");
            }
            if !self.nominal.gradient[i].is_finite() {
                return Some("nominal.gradient");
            }
            i += 1;
        }
        let fallback = match self.fallback {
            Fallback::HoldLast => 0.0,
            Fallback::Safe(u) => u,
        };
        let fields = [
            (self.period_s, "period_s"),
            (self.surface.alpha_per_s, "surface.alpha_per_s"),
            (self.reaching.k_l, "reaching.k_l"),
            (self.reaching.k_s, "reaching.k_s"),
            (self.reaching.epsilon, "reaching.epsilon"),
            (self.nominal.input_gain, "nominal.input_gain"),
            (self.limits.min, "limits.min"),
            (self.limits.max, "limits.max"),
            (fallback, "fallback"),
            (self.sigma_star_bound, "sigma_star_bound"),
            (self.observer_pole_limit, "observer_pole_limit"),
        ];
        let mut k = 0;
        while k < fields.len() {
            if !fields[k].0.is_finite() {
                return Some(fields[k].1);
            }
            k += 1;
        }
        None
    }

    /// What to be warned of in a design that [`validate`](Self::validate) accepts.
    pub const fn warnings(&self) -> Warnings {
        let mut warnings = Warnings::NONE;
        let mut i = 0;
        while i < N {
            if let Some(gains) = &self.observers[i] {
                let pole_times_period = gains.fastest_rad_s() * self.period_s;
                if pole_times_period > 0.3 * ROOT_SLACK {
                    warnings = warnings.with(Warning::ObserverFast { channel: i + 1, pole_times_period });
                }
            }
            i += 1;
        }
        let k_l_times_period = self.reaching.k_l * self.period_s;
        if k_l_times_period > 0.5 {
            warnings = warnings.with(Warning::LinearGainHigh { k_l_times_period });
        }
        let bandwidth_times_period = self.surface.bandwidth_rad_s() * self.period_s;
        if bandwidth_times_period > 0.5 * ROOT_SLACK {
            warnings = warnings.with(Warning::SurfaceFast { bandwidth_times_period });
        }
        warnings
    }
}
