//! Drive of a motor with an encoder on its shaft and a rigid load.
//!
//! $$ J \dot\omega = K_t u - B \omega - \text{friction} - \text{load}, \qquad b = K_t/J, \quad \lambda = B/J, \quad
//!    a_z = -\lambda \omega $$
//!
//! The drive has one observer block without coupling, n = 2, and the chain is (position, speed) itself. The observer
//! has three states by default. With a fourth state d' the loop is only conditionally stable: at a third of the gain it
//! is unstable, at any bandwidth. It also hunts at rest in friction. Use four states only for b known to 20 % and
//! little friction.
//!
//! # Bandwidths by rule
//! Two effects limit the bandwidths. The first is the encoder quantisation, which causes current noise. The second is
//! the loop delay from the period T, the lag of the current loop and ticks of delay. With
//!
//! $$ w_n = \left(\frac{0.01 \thinspace u_{max} b}{6 \thinspace \mathrm{unit} \sqrt T}\right)^{0.4} $$
//!
//! the quantisation causes current noise of about 1 % of the current limit. The rule is a fit: the noise is 4 to 7
//! times $\mathrm{unit} \thinspace w_c^{2.5} \sqrt T / b$.
//!
//! [`MotorMargin::Fast`] is the rule of [`MotorDesign::by_rule`]. It has $w_c : w_o : k_l = 1 : 1.5 : 8$ with
//! $k_l T \le 1$ and
//!
//! $$ w_c = \min\left(w_n, \frac{0.1}{T/2 + 1.5 \thinspace \mathrm{lag} + \mathrm{delay}}\right) $$
//!
//! [`MotorMargin::Standard`] has a slow observer behind a fast law, with more margin at equal noise. The law is as fast
//! as quantisation and phase allow, and the observer is as fast as the remaining phase allows. With
//! $L = 0.7 \thinspace T + 1.8 \thinspace \mathrm{lag} + \mathrm{delay}$:
//!
//! $$ w_c = \min\left(4.2 w_n, \frac{0.9}{L}, \frac{0.5}{T}\right), \qquad
//!    k_l = \min\left(11.2 w_n, \frac{3}{L}, \frac{1}{T}\right) $$
//!
//! $$ w_o = \min\left(0.7 w_n, \frac{0.093}{0.165/w_c + 0.55/k_l - 0.19 \thinspace T + 1.4 \thinspace \mathrm{lag} +
//!    \mathrm{delay}}\right) $$
//!
//! White encoder noise with a standard deviation σ, in addition to quantisation, gives the $w_n$ of a count of
//! $\sqrt{\mathrm{unit}^2 + 18 \thinspace \sigma^2}$ ([`MotorDesign::with_noise`]).
//!
//! The numbers of the standard rule are fitted on data sheets (test `margin` of the crate `study`). J ranges from 1e-7
//! to 0.1 kg m², T from 50 us to 4 ms, the lag up to 2 T, the encoder from 10 to 24 bits, the delay from 0 to 3 ticks.
//! The peak sensitivity is up to 1.55, and up to 2.0 with the high gain set. With J and K_t off by ±20 % it is up to
//! 2.2 with either gain set.
//!
//! With one gain set both rules are stable for every J and K_t within ±50 % of the nominal values, with 0 to 3 ticks of
//! delay (tests `drive_motor::corners_of_the_motor_are_stable`, `margin`). With two gain sets they are stable within
//! ±20 %.
//!
//! For bandwidths of your own the limits are $w_c T \le 0.5$, $k_l T \le 1$ and $w_o T \le$ 0.8, 0.5, 0.3, 0.2 with 0,
//! 1, 2, 3 ticks of delay. For an observer with four states they are 0.15 and 0.1 with 2 and 3 ticks
//! ([`MotorDesign::observer_limit`]). Up to these limits the loop is stable for J and K_t within ±20 % if the current
//! follows at once (test `drive_motor::up_to_the_limits_the_motor_is_stable`). With four states and one tick this holds
//! only up to 0.3.
//!
//! ```
//! use controller_core::drive::{Encoder, Motor, MotorDesign, MotorDrive, Position, Sample, Target};
//! use controller_core::{Limits, Running};
//!
//! const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
//! const DESIGN: MotorDesign = MotorDesign::by_rule(1e-3, MOTOR, Encoder::absolute(14), Limits::symmetric(10.0));
//! type Drive = MotorDrive<f32, Position>;
//! static DRIVE: Drive = Drive::design(&DESIGN);
//!
//! let mut running = Running::new(&DRIVE);
//! let at = |angle| Target { turn: 0, jet: [angle, 0.0] };
//! let sample = Sample { counts: [Some(7)], begin: at(0.0), end: at(0.0) };
//! running.start_at_once(&sample);
//! let output = running.tick(&sample);
//! assert!(output.health.is_ok() && output.u < 0.0);
//! ```

use core::marker::PhantomData;

use super::block::Block;
use super::chain::ChainModel;
use super::encoder::Encoder;
use super::error::DriveError;
use super::fence::Slowing;
use super::law::{AcceptanceRules, BRAKING, EncoderForm, FastGains, MOST_DELAY_TICKS, QUARTER_TURN, Row};
use super::monitor::{Bounds, misjudged};
use super::rest::{RestBand, RestLearning};
use super::target::{Aim, Position};
use crate::config::{Config, Fallback, INPUT_LIMIT, Options};
use crate::design;
use crate::exponential::phi_functions;
use crate::law::{Limits, ReachingLaw};
use crate::model::Nominal;
use crate::observer::ObserverGains;
use crate::real::Real;
use crate::surface::Surface;

/// Data sheet of a motor and its rigid load, referred to the controlled shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Motor {
    /// Inertia J of motor and load, kg m².
    pub inertia_kg_m2: f64,
    /// Torque constant K_t, N m at the shaft per unit of u (A).
    pub torque_n_m_per_a: f64,
    /// Viscous friction B, N m s/rad. 0 if unknown.
    pub damping_n_m_s: f64,
}

impl Motor {
    /// Returns the input gain b, rad/s² per unit of u.
    pub const fn input_gain(&self) -> f64 {
        self.torque_n_m_per_a / self.inertia_kg_m2
    }

    /// Returns the u of a trajectory point r, r', r'' for the nominal motor. Use it for planning: the law does not use
    /// it.
    pub const fn feed_forward(&self, [_, speed, acceleration]: &[f64; 3]) -> f64 {
        (*acceleration + self.slope_per_s() * *speed) / self.input_gain()
    }

    /// Returns the slope λ = B/J, 1/s.
    pub const fn slope_per_s(&self) -> f64 {
        self.damping_n_m_s / self.inertia_kg_m2
    }
}

/// Bandwidths of the drive of a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotorBandwidths {
    /// Position bandwidth w_c, rad/s: the error obeys e' = -w_c e. Not read by the speed loop.
    pub surface_rad_s: f64,
    /// Observer bandwidth w_o, rad/s.
    pub observer_rad_s: f64,
    /// Reaching gain k_l, 1/s: the bandwidth of the speed loop.
    pub reaching_per_s: f64,
    /// Offset decay rate α, 1/s.
    pub offset_per_s: f64,
}

/// Bandwidth rule of a motor ([`MotorDesign::with_margin`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MotorMargin {
    /// A fast observer behind a slow law. The peak sensitivity is up to 2.25, up to 2.7 with the high gain set, and up
    /// to 4.2 with J and K_t off by ±20 %.
    #[default]
    Fast,
    /// A slow observer behind a fast law: peaks up to 1.55, 2.0 and 2.2 likewise. A load moves the shaft by about half
    /// more, and the observer detects errors half as fast.
    Standard,
}

/// Gain scheduling: the rule by which the high gain set is scheduled in.
///
/// Encoder quantisation gives innovations of both signs, a load gives innovations of one sign. While the smoothed
/// innovation exceeds the noise, the gains move to the high set.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Switching {
    /// Smoothed innovation, in counts, at which the high gains begin.
    pub calm_steps: f64,
    /// Smoothed innovation, in counts, at which the high gains are fully in use.
    pub alert_steps: f64,
    /// Time constant of the smoothing, s.
    pub smoothing_s: f64,
    /// Fade-out time constant of the high gains, s. Without the fade-out, friction would switch the gains at every
    /// reversal.
    pub keep_s: f64,
}

impl Switching {
    /// Default gain scheduling: 1.5 and 4 counts, 3 ms, 20 ms.
    pub const DEFAULT: Self = Self { calm_steps: 1.5, alert_steps: 4.0, smoothing_s: 3e-3, keep_s: 20e-3 };

    pub(crate) const fn gains<const S: usize>(
        &self,
        quiet: &[f64; S],
        fast: [f64; S],
        unit: f64,
        period_s: f64,
    ) -> FastGains<f64, S> {
        let mut more = fast;
        let mut s = 0;
        while s < S {
            more[s] -= quiet[s];
            s += 1;
        }
        FastGains {
            more,
            calm: self.calm_steps * unit,
            rate: 1.0 / ((self.alert_steps - self.calm_steps) * unit),
            smoothing: decay(period_s / self.smoothing_s),
            keep: phi_functions(-period_s / self.keep_s)[0],
        }
    }

    pub(crate) const fn check(&self) -> Result<(), DriveError> {
        const WHY: &str = "steps and times of the gain scheduling must be above 0, and alert_steps above calm_steps";
        let rules = [
            ("switching.calm_steps", self.calm_steps, 0.0, 1e6),
            ("switching.alert_steps", self.alert_steps, self.calm_steps + 0.1, 1e7),
            ("switching.smoothing_s", self.smoothing_s, 1e-6, 10.0),
            ("switching.keep_s", self.keep_s, 1e-6, 10.0),
        ];
        let mut k = 0;
        while k < rules.len() {
            let (field, given, low, high) = rules[k];
            if let Err(error) = DriveError::within(field, given, low, high, WHY) {
                return Err(error);
            }
            k += 1;
        }
        Ok(())
    }
}

/// Returns 1 - e^(-x).
pub(crate) const fn decay(x: f64) -> f64 {
    x * phi_functions(-x)[1]
}

/// Design of the drive of a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotorDesign {
    /// Sampling period T, s.
    pub period_s: f64,
    /// Data sheet of the motor and its load.
    pub motor: Motor,
    /// Encoder of the shaft.
    pub encoder: Encoder,
    /// Limits of u.
    pub limits: Limits,
    /// Output of a drive that has not started, has stopped, or has lost its samples.
    pub fallback: Fallback,
    /// Bandwidths of the drive.
    pub bandwidths: MotorBandwidths,
    /// Ratio of the high observer bandwidth to the base one. 1 with one gain set. A ratio of 2 is stable within ±20 %
    /// of J and K_t. No ratio above 1 is stable within ±50 %.
    pub fast_ratio: f64,
    /// Gain scheduling. Read only with two gain sets.
    pub switching: Switching,
    /// Innovation gate, in counts: a count with a larger innovation is rejected. Infinite for no gate.
    pub gate_steps: f64,
    /// Consecutive lost samples that the observer bridges. After more, the fallback is the output and the drive
    /// restarts.
    pub lost_ticks: u32,
}

/// Counts with the effect of white noise of standard deviation 1: √18.
const STEPS_PER_NOISE: f64 = 4.243;

/// Ratios w_o, w_c and k_l of the standard rule to w_c of the fast rule, if quantisation limits them.
const STANDARD_BY_NOISE: [f64; 3] = [0.7, 4.2, 11.2];
/// Phase available to the observer of the standard rule: w_o times the loop delay.
const STANDARD_PHASE: f64 = 0.093;

/// Returns the loop delay of a law with this w_c and k_l, s.
const fn lost_to_law_s([surface_rad_s, reaching_per_s]: [f64; 2]) -> f64 {
    0.165 / surface_rad_s + 0.55 / reaching_per_s
}

/// Default lag of the current loop, s.
pub const DEFAULT_LAG_S: f64 = 2e-4;

impl MotorDesign {
    /// Returns the largest w_o T of an observer with `states` states. More than three ticks of delay count as three.
    pub const fn observer_limit(delay_ticks: usize, states: usize) -> f64 {
        match (delay_ticks, states) {
            (0, _) => 0.8,
            (1, _) => 0.5,
            (2, 3) => 0.3,
            (2, _) => 0.15,
            (_, 3) => 0.2,
            _ => 0.1,
        }
    }

    /// Designs by the fast rule of the module, for a current loop with a lag of 0.2 ms and no tick of delay.
    ///
    /// The innovation gate is for a disturbance of 1.2 times the limit, and of twice that if
    /// [`fast_ratio`](Self::fast_ratio) is 1. With one gain set, a motor that turns the wrong way is detected later.
    pub const fn by_rule(period_s: f64, motor: Motor, encoder: Encoder, limits: Limits) -> Self {
        let bandwidths =
            MotorBandwidths { surface_rad_s: 0.0, observer_rad_s: 0.0, reaching_per_s: 0.0, offset_per_s: 0.0 };
        Self {
            period_s,
            motor,
            encoder,
            limits,
            fallback: Fallback::HoldLast,
            bandwidths,
            fast_ratio: 2.0,
            switching: Switching::DEFAULT,
            gate_steps: f64::INFINITY,
            lost_ticks: 50,
        }
        .with_lag(DEFAULT_LAG_S, 0)
    }

    /// Returns the design with bandwidths and innovation gate for another lag of the current loop, and for
    /// `delay_ticks` ticks between computation and output of u.
    #[must_use]
    pub const fn with_lag(self, lag_s: f64, delay_ticks: u32) -> Self {
        self.with_margin(MotorMargin::Fast, lag_s, delay_ticks)
    }

    /// Returns the design with bandwidths and innovation gate by the rule of this margin.
    #[must_use]
    pub const fn with_margin(self, margin: MotorMargin, lag_s: f64, delay_ticks: u32) -> Self {
        let [noise, phase] = self.limits_by_rule(margin, lag_s, delay_ticks);
        let binding = lesser(noise, phase);
        let bandwidths = match margin {
            MotorMargin::Fast => return self.with_surface(binding),
            MotorMargin::Standard => {
                let [surface_rad_s, reaching_per_s] = self.law_by_rule(lag_s, delay_ticks);
                MotorBandwidths { surface_rad_s, observer_rad_s: binding, reaching_per_s, offset_per_s: 0.5 * binding }
            }
        };
        self.with_bandwidths(bandwidths)
    }

    /// Returns the bandwidth limits from quantisation and from phase, rad/s: w_c of the fast rule, w_o of the standard
    /// rule.
    pub const fn limits_by_rule(&self, margin: MotorMargin, lag_s: f64, delay_ticks: u32) -> [f64; 2] {
        let [held, lag, delay] = self.lost_time_s(margin, lag_s, delay_ticks);
        let late_s = held + lag + delay;
        match margin {
            MotorMargin::Fast => [self.by_noise(), 0.1 / late_s],
            MotorMargin::Standard => [STANDARD_BY_NOISE[0] * self.by_noise(), STANDARD_PHASE / late_s],
        }
    }

    /// Returns the three parts of the loop delay, s, as the rule weights them.
    ///
    /// They are the hold of a period (plus the law, if the observer depends on it), the lag of the current loop, and
    /// the ticks of delay.
    pub const fn lost_time_s(&self, margin: MotorMargin, lag_s: f64, delay_ticks: u32) -> [f64; 3] {
        let (t, delay_s) = (self.period_s, delay_ticks as f64 * self.period_s);
        match margin {
            MotorMargin::Fast => [t / 2.0, 1.5 * lag_s, delay_s],
            MotorMargin::Standard => {
                let law_s = lost_to_law_s(self.law_by_rule(lag_s, delay_ticks));
                [law_s - 0.19 * t, 1.4 * lag_s, delay_s]
            }
        }
    }

    /// Returns w_c and k_l of the standard rule.
    const fn law_by_rule(&self, lag_s: f64, delay_ticks: u32) -> [f64; 2] {
        let (t, noise) = (self.period_s, self.by_noise());
        let late_s = 0.7 * t + 1.8 * lag_s + delay_ticks as f64 * t;
        let [_, surface, reaching] = STANDARD_BY_NOISE;
        [
            lesser(surface * noise, lesser(0.9 / late_s, 0.5 / t)),
            lesser(reaching * noise, lesser(3.0 / late_s, 1.0 / t)),
        ]
    }

    /// Returns $(0.01 \thinspace u_{max} b / (6 \thinspace \mathrm{unit} \sqrt T))^{0.4}$.
    const fn by_noise(&self) -> f64 {
        let noise = 0.01 * self.largest_acceleration() / (6.0 * self.encoder.unit_rad());
        // (x/√T)^0.4 = (x²/T)^(1/5).
        root(noise * noise / self.period_s, 5)
    }

    /// Returns the design for an encoder whose angle has white noise of this standard deviation, rad, besides
    /// quantisation.
    ///
    /// Noise of σ counts as quantisation of √(unit² + 18 σ²). It lowers the bandwidth limits
    /// ([`limits_by_rule`](Self::limits_by_rule)). It also raises the innovation thresholds of the high gain set above
    /// [`Switching::DEFAULT`] in proportion. The rms of a count is unit/√12, but with 12 in place of 18 the current
    /// noise would be up to 1.2 times its limit.
    #[must_use]
    pub const fn with_noise(mut self, margin: MotorMargin, noise_rad: f64) -> Self {
        if noise_rad == 0.0 {
            return self;
        }
        let (w, steps) = (self.bandwidths, noise_rad / self.encoder.unit_rad());
        let step = root(1.0 + STEPS_PER_NOISE * STEPS_PER_NOISE * steps * steps, 2);
        self.switching.calm_steps = step * Switching::DEFAULT.calm_steps;
        self.switching.alert_steps = step * Switching::DEFAULT.alert_steps;
        let by_noise = self.by_noise() / root(step * step, 5);
        match margin {
            MotorMargin::Fast if w.surface_rad_s > by_noise => self.slowed(by_noise / w.surface_rad_s),
            MotorMargin::Fast => self,
            MotorMargin::Standard => {
                let [observer, surface, reaching] = STANDARD_BY_NOISE;
                let surface_rad_s = lesser(w.surface_rad_s, surface * by_noise);
                let reaching_per_s = lesser(w.reaching_per_s, reaching * by_noise);
                // The observer gives up the phase that the slower law costs.
                let more_s =
                    lost_to_law_s([surface_rad_s, reaching_per_s]) - lost_to_law_s([w.surface_rad_s, w.reaching_per_s]);
                let by_phase = STANDARD_PHASE / (STANDARD_PHASE / w.observer_rad_s + more_s);
                let observer_rad_s = lesser(by_phase, observer * by_noise);
                let offset_per_s = 0.5 * observer_rad_s;
                self.with_bandwidths(MotorBandwidths { surface_rad_s, observer_rad_s, reaching_per_s, offset_per_s })
            }
        }
    }

    /// Returns the design with all bandwidths times this share, and the innovation gate for them.
    #[must_use]
    pub const fn slowed(self, share: f64) -> Self {
        let MotorBandwidths { surface_rad_s, observer_rad_s, reaching_per_s, offset_per_s } = self.bandwidths;
        self.with_bandwidths(MotorBandwidths {
            surface_rad_s: share * surface_rad_s,
            observer_rad_s: share * observer_rad_s,
            reaching_per_s: share * reaching_per_s,
            offset_per_s: share * offset_per_s,
        })
    }

    /// Returns the design in the proportions of the fast rule for another w_c, rad/s, with the innovation gate for it.
    #[must_use]
    pub const fn with_surface(self, surface_rad_s: f64) -> Self {
        self.with_surface_by(MotorMargin::Fast, surface_rad_s)
    }

    /// Returns the design for another w_c, rad/s, with the innovation gate for it.
    ///
    /// The fast rule uses its own proportions. The standard rule keeps the proportions of the present bandwidths, with
    /// k_l at most 1/T.
    #[must_use]
    pub const fn with_surface_by(self, margin: MotorMargin, surface_rad_s: f64) -> Self {
        let (w, fastest) = (self.bandwidths, 1.0 / self.period_s);
        let [observer_rad_s, reaching_per_s, offset_per_s] = match margin {
            MotorMargin::Fast => [1.5 * surface_rad_s, 8.0 * surface_rad_s, 0.5 * surface_rad_s],
            MotorMargin::Standard => {
                let faster = surface_rad_s / w.surface_rad_s;
                [faster * w.observer_rad_s, faster * w.reaching_per_s, faster * w.offset_per_s]
            }
        };
        let reaching_per_s = lesser(reaching_per_s, fastest);
        self.with_bandwidths(MotorBandwidths { surface_rad_s, observer_rad_s, reaching_per_s, offset_per_s })
    }

    /// Returns the design with other bandwidths and the innovation gate for them.
    #[must_use]
    pub const fn with_bandwidths(mut self, bandwidths: MotorBandwidths) -> Self {
        self.bandwidths = bandwidths;
        let omega = bandwidths.observer_rad_s;
        // A step D of the disturbance causes an innovation of at most 0.42 D/w_o². The high gain set detects D = 2 b u,
        // as from a motor that turns the wrong way, before that.
        let largest = self.largest_acceleration() * if self.fast_ratio > 1.0 { 1.2 } else { 2.4 };
        self.gate_steps = 1.0 + 0.42 * largest / (omega * omega * self.encoder.unit_rad());
        self
    }

    /// Returns the alarm thresholds of the monitors if J and K_t are known to within the share p = `uncertain` (0.2,
    /// 0.5).
    ///
    /// With q = p/(1 - p), disturbances may reach (0.25 + 0.65 q) of the acceleration at the limit of u: 0.25 of it are
    /// load and friction. Innovations may reach q times the innovation gate. u may stay at a limit for 0.2 s.
    pub fn bounds<T: Real, A: Aim<T, 2>, const FAST: usize, const LATE: usize, const S: usize>(
        &self,
        law: &MotorDrive<T, A, FAST, LATE, S>,
        uncertain: f64,
    ) -> Bounds<1> {
        let share = 0.25 + 0.65 * misjudged(uncertain);
        let fastest = self.largest_acceleration();
        let brake = self.brake_per_s();
        Bounds::of(law, [share * fastest], [self.gate_steps], uncertain, fastest, [brake, 1.0 / brake], self.period_s)
    }

    /// Returns the braking model of the drive, for `delay_ticks` ticks of delay.
    ///
    /// The deceleration towards a far target leaves a share of the limit for load and friction. The time constant comes
    /// from the gain of the brake ([`Bounds::brake_per_s`]).
    pub const fn slowing(&self, delay_ticks: usize) -> Slowing {
        Slowing {
            deceleration_rad_s2: BRAKING * self.largest_acceleration(),
            constant_s: 1.0 / self.brake_per_s() + ticks_to_slow(delay_ticks) * self.period_s,
            tolerance_rad: 2.0 * self.encoder.unit_rad(),
        }
    }

    /// Returns the rest band of the drive, within which a shaft held by friction is left in place.
    ///
    /// If the high gain set has larger thresholds than [`Switching::DEFAULT`], as for noise, two deviations of the
    /// noise replace the count.
    pub const fn rest_band(&self, learning: RestLearning) -> RestBand {
        let steps = 2.0 / STEPS_PER_NOISE * self.switching.calm_steps / Switching::DEFAULT.calm_steps;
        let count = (if steps > 1.0 { steps } else { 1.0 }) * self.encoder.unit_rad();
        let omega = self.bandwidths.observer_rad_s;
        RestBand::of(count, [self.motor.input_gain(), self.limits.stronger()], omega, self.period_s, learning)
    }

    /// Returns the gain of the brake, 1/s. The brake uses the estimated speed, so it must be slower than the observer.
    const fn brake_per_s(&self) -> f64 {
        let MotorBandwidths { surface_rad_s, observer_rad_s, .. } = self.bandwidths;
        lesser(0.5 * surface_rad_s, observer_rad_s / 1.5)
    }

    const fn largest_acceleration(&self) -> f64 {
        let Limits { min, max } = self.limits;
        (if max > -min { max } else { -min }) * self.motor.input_gain().abs()
    }

    /// Checks every number, for a drive with `late` ticks of delay and `states` observer states.
    ///
    /// # Errors
    /// Returns the first number that is out of its range, with the range.
    pub const fn validate(&self, late: usize, states: usize) -> Result<(), DriveError> {
        if let Err(error) = check_delay(late) {
            return Err(error);
        }
        if let Err(error) = self.encoder.check("encoder") {
            return Err(error);
        }
        if let Err(error) = self.switching.check() {
            return Err(error);
        }
        let Self { period_s: t, motor, limits, bandwidths, .. } = self;
        let t = *t;
        let limit = "0 is not within the limits, or one is beyond 1e12";
        let u_safe = match self.fallback {
            Fallback::HoldLast => limits.min,
            Fallback::Safe(u) => u,
        };
        let rules = [
            ("period_s", t, 2e-5, 1e-2, "the period of a drive is 20 us to 10 ms"),
            ("motor.inertia_kg_m2", motor.inertia_kg_m2, 1e-12, 1e9, POSITIVE),
            ("motor.torque_n_m_per_a", motor.torque_n_m_per_a, 1e-9, 1e9, POSITIVE),
            ("motor.damping_n_m_s", motor.slope_per_s() * t, 0.0, 1.0, "the damping times period over J is 0 to 1"),
            ("limits.max", limits.max, 0.0, 1e12, limit),
            ("limits.min", limits.min, -1e12, 0.0, limit),
            ("fallback", u_safe, limits.min, limits.max, "the safe u lies outside the limits"),
            ("bandwidths.surface_rad_s", bandwidths.surface_rad_s * t, 1e-6, 0.5, "w_c times period is up to 0.5"),
            (
                "bandwidths.observer_rad_s",
                bandwidths.observer_rad_s * t,
                1e-5,
                Self::observer_limit(late, states),
                OBSERVER,
            ),
            ("bandwidths.reaching_per_s", bandwidths.reaching_per_s * t, 1e-6, 1.0, "k_l times period is up to 1"),
            ("bandwidths.offset_per_s", bandwidths.offset_per_s * t, 1e-7, 1.0, "alpha times period is 1e-7 to 1"),
            ("fast_ratio", self.fast_ratio, 1.0, 4.0, "the high gains are 1 to 4 times as fast as the base gains"),
            ("gate_steps", self.gate_steps, 2.0, f64::INFINITY, "a gate below 2 steps refuses good counts"),
            ("lost_ticks", self.lost_ticks as f64, 1.0, 1e6, "1 to 1e6 samples may be missing"),
        ];
        let mut k = 0;
        while k < rules.len() {
            let (field, given, low, high, why) = rules[k];
            if let Err(error) = DriveError::within(field, given, low, high, why) {
                return Err(error);
            }
            k += 1;
        }
        Ok(())
    }
}

/// Checks the number of delay ticks of a drive.
pub(crate) const fn check_delay(late: usize) -> Result<(), DriveError> {
    const WHY: &str = "a drive has 0 to 3 ticks of delay";
    DriveError::within("delay_ticks", late as f64, 0.0, MOST_DELAY_TICKS as f64, WHY)
}

/// Returns the ticks until a shaft begins to slow down: one more than the delay, at least two.
pub(crate) const fn ticks_to_slow(delay_ticks: usize) -> f64 {
    if delay_ticks > 1 { delay_ticks as f64 + 1.0 } else { 2.0 }
}

/// Observer of order 2 for the rows. Its gains are replaced by the gains of the block.
pub(crate) const OBSERVED: ObserverGains<2> = ObserverGains::from_bandwidth::<2>(1.0);

const OBSERVER: &str = "the observer's bandwidth times period is up to 0.8; up to 0.5, 0.3, 0.2 with 1, 2, 3 ticks of \
                        delay, and 0.15, 0.1 with 2, 3 and four states";

pub(crate) const POSITIVE: &str = "this number of the data sheet must be above 0";

/// Returns the root by Newton's method from above.
const fn root(x: f64, degree: u32) -> f64 {
    let mut root = if x > 1.0 { x } else { 1.0 };
    let mut steps = 0;
    while steps < 400 {
        let (mut power, mut k) = (root, 2);
        while k < degree {
            power *= root;
            k += 1;
        }
        root -= (root * power - x) / (degree as f64 * power);
        steps += 1;
    }
    root
}

pub(super) const fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Model of the motor in the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorModel<T> {
    b: T,
    /// Negative slope -λ, 1/s.
    drag: T,
}

impl MotorModel<f64> {
    /// Returns the model of a data sheet.
    pub const fn new(motor: &Motor) -> Self {
        Self { b: motor.input_gain(), drag: -motor.slope_per_s() }
    }

    const fn in_f32(&self) -> MotorModel<f32> {
        MotorModel { b: self.b as f32, drag: self.drag as f32 }
    }
}

impl<T: Real> MotorModel<T> {
    /// Converts every number to another scalar, by name.
    #[doc(hidden)]
    pub fn converted<U: Real>(&self, to: &mut dyn FnMut(&'static str, T) -> U) -> MotorModel<U> {
        MotorModel { b: to("b", self.b), drag: to("drag", self.drag) }
    }
}

impl<T: Real> ChainModel<T, 1, 2> for MotorModel<T> {
    type Push = ();
    type Seen = ();
    const HAS_GRADIENT: bool = false;

    #[inline(always)]
    fn seen(&self, _: &[T; 1]) {}
    #[inline(always)]
    fn seen_ahead(&self, (): (), _: T) {}
    #[inline(always)]
    fn push(&self, _: &[T; 1], (): &()) {}
    #[inline(always)]
    fn of_block((): &(), _: usize) -> Option<T> {
        None
    }
    #[inline(always)]
    fn per_block(_: [T; 1]) {}
    #[inline(always)]
    fn kappa(&self, _: usize) -> T {
        T::ZERO
    }
    #[inline(always)]
    fn input_gain(&self) -> T {
        self.b
    }
    #[inline(always)]
    fn chain(&self, x: &[T; 2], (): &()) -> ([T; 2], T) {
        (*x, self.drag * x[1])
    }
    #[inline(always)]
    fn last(&self, (): &(), d: &[T; 1]) -> T {
        d[0]
    }
    #[inline(always)]
    fn per_rad(&self, _: usize) -> T {
        T::from_f64(1.0)
    }
    fn numbers(&self) -> impl Iterator<Item = T> {
        [self.b, self.drag].into_iter()
    }
}

/// Drive of a motor with one encoder.
///
/// `MotorDrive` without parameters is in f32, follows a position, has one gain set and no delay. The parameters select
/// other forms:
/// * `MotorDrive<f32, Speed>` is the speed loop.
/// * `MotorDrive<f32, Position, 1>` has a high gain set too.
/// * `MotorDrive<f32, Position, 0, 1>` applies u one tick after its computation (up to three).
/// * `MotorDrive<f32, Position, 0, 0, 4>` has an observer with four states.
pub type MotorDrive<T = f32, A = Position, const FAST: usize = 0, const LATE: usize = 0, const S: usize = 3> =
    EncoderForm<T, MotorModel<T>, A, 1, 2, S, FAST, LATE>;

impl<A: Aim<f64, 2>, const S: usize, const FAST: usize, const LATE: usize>
    EncoderForm<f64, MotorModel<f64>, A, 1, 2, S, FAST, LATE>
{
    const fn of_motor(design: &MotorDesign) -> Result<Self, DriveError> {
        if let Err(error) = design.validate(LATE, S) {
            return Err(error);
        }
        let MotorDesign { period_s: t, motor, encoder, limits, bandwidths, .. } = design;
        let (t, lambda) = (*t, motor.slope_per_s());
        let gradient = [0.0, -lambda];
        let w_c = if A::POSITION { bandwidths.surface_rad_s } else { 0.0 };
        let config = Config {
            period_s: t,
            surface: Surface::from_bandwidth(w_c, bandwidths.offset_per_s),
            observers: [None, Some(OBSERVED)],
            reaching: ReachingLaw { k_l: bandwidths.reaching_per_s, k_s: 0.0, epsilon: 0.0 },
            nominal: Nominal { gradient, input_gain: motor.input_gain() },
            options: Options::NEUTRAL.with_limits(*limits),
        };
        let Ok(rows) = design::coefficients::<2, 2, 1>(&config, &[1]) else {
            return Err(DriveError::new("motor", f64::NAN, 0.0, 0.0, "a coefficient overflows in f32"));
        };
        // From w_c far the law brakes with w_c² far.
        let far = BRAKING * motor.input_gain().abs() * limits.weaker() / (w_c * w_c);
        let far = if far > 0.0 && far < INPUT_LIMIT { far } else { INPUT_LIMIT };
        let omega = bandwidths.observer_rad_s;
        let block = Block::<f64, S>::design(0.0, lambda, t, omega);
        let sensor = encoder.sensor();
        let fast = Block::<f64, S>::gains_at(0.0, lambda, t, omega * design.fast_ratio);
        let fast = design.switching.gains(&block.gains, fast, sensor.unit, t);
        let gate = design.gate_steps * sensor.unit;
        Ok(Self {
            model: MotorModel::new(motor),
            blocks: [block],
            sensors: [sensor],
            fast: [[fast]; FAST],
            row: Row::of(&rows, &gradient, &[[0.0]; 2], *limits, design.fallback, far),
            belief: AcceptanceRules::of([gate], &[sensor], [QUARTER_TURN], 0.2 * omega, design.lost_ticks, t),
            inertia: [motor.inertia_kg_m2],
            at_rest: false,
            of: PhantomData,
        })
    }
}

macro_rules! designs {
    ($t:ty, $late:ident => $convert:expr) => {
        impl<A: Aim<f64, 2> + Aim<$t, 2>, const S: usize, const FAST: usize, const LATE: usize>
            EncoderForm<$t, MotorModel<$t>, A, 1, 2, S, FAST, LATE>
        {
            /// Designs the drive. The compiler and the program compute equal numbers.
            ///
            /// # Errors
            /// Returns the first number that is out of its range, with the range.
            pub const fn try_design(design: &MotorDesign) -> Result<Self, DriveError> {
                match EncoderForm::<f64, MotorModel<f64>, A, 1, 2, S, FAST, LATE>::of_motor(design) {
                    Ok($late) => Ok($convert),
                    Err(error) => Err(error),
                }
            }

            /// Designs as [`try_design`](Self::try_design), in a `const`: an invalid design is a compile error with the
            /// reason.
            ///
            /// # Panics
            /// On an invalid design. Outside a `const` use [`try_design`](Self::try_design).
            pub const fn design(design: &MotorDesign) -> Self {
                match Self::try_design(design) {
                    Ok(drive) => drive,
                    Err(error) => panic!("{}", error.text().as_str()),
                }
            }
        }
    };
}
designs!(f64, drive => drive);
designs!(f32, drive => drive.in_f32(drive.model.in_f32()));

impl<M: ChainModel<f32, 1, 2>, A: Aim<f64, 2> + Aim<f32, 2>, const S: usize, const FAST: usize, const LATE: usize>
    EncoderForm<f32, M, A, 1, 2, S, FAST, LATE>
{
    /// Designs the drive of a motor with a known load: bandwidths and innovation gate of a [`MotorDesign`], a model of
    /// your own.
    ///
    /// The model must have the b and the λ of the design's motor. Its coupling w, rad/s², is every other acceleration
    /// of the shaft. w has a period of one revolution, because positions count from the last whole revolution.
    /// [`ChainModel`] has an example.
    ///
    /// # Errors
    /// Returns the first number of the design that is out of its range, with the range.
    pub const fn try_design_with(design: &MotorDesign, model: M) -> Result<Self, DriveError> {
        match EncoderForm::<f64, MotorModel<f64>, A, 1, 2, S, FAST, LATE>::of_motor(design) {
            Ok(drive) => Ok(drive.in_f32(model)),
            Err(error) => Err(error),
        }
    }
}
