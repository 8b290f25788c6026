//! Bandwidths of a motor for a stability margin: one of two rules, or between them for a given peak sensitivity.
//!
//! The peak Ms of |S| bounds the margins: the phase margin is at least 2 asin(1/(2 Ms)), and the gain of the plant may
//! grow by Ms/(Ms - 1). Here S is the discrete Fourier transform of a pulse response: with an impulse w at the input of
//! the plant, v = u + w is the impulse response of S. `study::margins` computes S from matrices.

use controller_core::drive::{MotorBandwidths, MotorDesign, MotorMargin};
use loop_sim::linear::{LawAtRest, LinearPlant, LinearTick};
use loop_sim::plant::{Imperfections, Motor, Plant, Shaft};
use loop_sim::port::drive::DriveDesign;
use loop_sim::signal::Signal;
use schemars::JsonSchema;
use serde::Deserialize;

/// Stability margin: a rule or a peak sensitivity.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum MarginKey {
    /// Rule for the bandwidths.
    Rule(MarginRule),
    /// Nominal peak sensitivity of the base gains.
    Peak(#[schemars(range(min = 1.2, max = 3))] f64),
}

impl Default for MarginKey {
    fn default() -> Self {
        Self::Rule(MarginRule::Fast)
    }
}

/// Rules for the bandwidths of a motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MarginRule {
    /// Peak sensitivity up to 2.2, with the high gains up to 2.7.
    Fast,
    /// Peak sensitivity up to 1.55, with the high gains up to 2.0. The deflection under a load is about half larger.
    Standard,
}

impl MarginKey {
    /// Returns the rule, or the rule that the search starts from.
    pub(super) const fn rule(self) -> MotorMargin {
        match self {
            Self::Rule(MarginRule::Fast) => MotorMargin::Fast,
            Self::Rule(MarginRule::Standard) | Self::Peak(_) => MotorMargin::Standard,
        }
    }
}

/// Largest factor by which the observer becomes slower than in the standard rule.
const SLOWEST: f64 = 8.0;

/// Returns the design with the bandwidths of a margin, for this encoder noise. `peak` returns the peak of a design.
pub(super) fn with_margin(
    design: MotorDesign,
    key: MarginKey,
    (lag_s, delay_ticks): (f64, u32),
    noise_rad: f64,
    peak: impl Fn(&MotorDesign) -> Option<f64>,
) -> MotorDesign {
    let of = |margin| design.with_margin(margin, lag_s, delay_ticks).with_noise(margin, noise_rad);
    let asked = match key {
        MarginKey::Rule(_) => return of(key.rule()),
        MarginKey::Peak(asked) => asked,
    };
    let design = of(MotorMargin::Standard);
    let [standard, fast] = [design, of(MotorMargin::Fast)].map(|design| design.bandwidths);
    // 0 is the standard rule, 1 the fast rule; below 0 only the observer becomes slower.
    let at = |share: f64| {
        let between = |slow: f64, fast: f64| slow * libm::pow(fast / slow, share.max(0.0));
        let slower = libm::pow(SLOWEST, share.min(0.0));
        let observer_rad_s = slower * between(standard.observer_rad_s, fast.observer_rad_s);
        let surface_rad_s = between(standard.surface_rad_s, fast.surface_rad_s);
        design.with_bandwidths(MotorBandwidths {
            surface_rad_s,
            observer_rad_s,
            reaching_per_s: between(standard.reaching_per_s, fast.reaching_per_s),
            offset_per_s: 0.5 * surface_rad_s.min(observer_rad_s),
        })
    };
    let (mut low, mut high) = (-1.0, 1.0);
    for _ in 0..16 {
        let middle = 0.5 * (low + high);
        // An invalid design is too fast.
        if peak(&at(middle)).is_some_and(|peak| peak <= asked) { low = middle } else { high = middle }
    }
    at(low)
}

/// Returns the largest |S| of a drive with this shaft. `None` as in [`sensitivity_peak`].
pub(super) fn motor_peak(designed: &DriveDesign, shaft: Shaft, lag: Imperfections) -> Option<f64> {
    let law = designed.at_rest().ok()?.law;
    let plant = Motor::new(shaft, shaft, lag, Signal::default());
    sensitivity_peak(law.as_ref(), &plant, designed.period_s(), designed.form().delay_ticks)
}

/// Returns the largest |S| at the plant input. `None` if the loop cannot be computed or does not decay.
fn sensitivity_peak(law: &dyn LawAtRest, plant: &dyn Plant, period_s: f64, delay_ticks: usize) -> Option<f64> {
    let v = pulse(law, plant, period_s, delay_ticks)?;
    // 60 phases per factor of ten, down to a thousandth of the Nyquist rate.
    let size_at = |k: i32| {
        let phase = std::f64::consts::PI * libm::pow(10.0, -f64::from(k) / 60.0);
        let (sin, cos) = (libm::sin(phase), libm::cos(phase));
        // Horner's scheme in e^(-i phase).
        let add = |[re, im]: [f64; 2], v: &f64| [re * cos + im * sin + v, im * cos - re * sin];
        let [re, im] = v.iter().rev().fold([0.0; 2], add);
        libm::hypot(re, im)
    };
    Some((0..180).map(size_at).fold(0.0, f64::max))
}

/// Returns the pulse response of v until it has decayed.
fn pulse(law: &dyn LawAtRest, plant: &dyn Plant, period_s: f64, delay_ticks: usize) -> Option<Vec<f64>> {
    const MOST: usize = 20_000;
    let law = LinearTick::of(law, true);
    let plant = LinearPlant::of(plant, law.u, period_s).ok()?;
    let dot = |row: &[f64], x: &[f64]| row.iter().zip(x).map(|(a, b)| a * b).sum::<f64>();
    let (mut x, mut s) = (vec![0.0; plant.gamma.len()], vec![0.0; law.c.len()]);
    let mut asked = std::collections::VecDeque::from(vec![0.0; delay_ticks]);
    let (mut all, mut quiet) = (Vec::new(), 0);
    while quiet < 200 {
        let angle = &x[..1];
        asked.push_back(dot(&law.c, &s) + dot(&law.d, angle));
        let held = asked.pop_front()?;
        let v = held + if all.is_empty() { 1.0 } else { 0.0 };
        s = (0..s.len()).map(|i| dot(&law.a[i], &s) + dot(&law.b[i], angle) + law.e[i] * held).collect();
        x = (0..x.len()).map(|i| dot(&plant.phi[i], &x) + plant.gamma[i] * v).collect();
        all.push(v);
        quiet = if v.abs() < 1e-7 { quiet + 1 } else { 0 };
        if all.len() > MOST || !v.is_finite() {
            return None;
        }
    }
    Some(all)
}
