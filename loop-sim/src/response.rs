//! What the loop as it ticks answers to one impulse, and the margins that follow.
//!
//! No model of the controller is made: the very tick runs against the plant, once with an impulse of one period at the
//! plant's input and once with its negative; half the difference is the linear answer, whatever the loop was doing.
//! With w the impulse, u what the actuator holds and $v = u + w$ what the plant feels,
//!
//! $$ S(\omega) = \frac{\sum_k v_k e^{-i \omega k T}}{\sum_k w_k e^{-i \omega k T}} = \frac{1}{1 + L(\omega)} $$
//!
//! is the sensitivity of the exact sampled loop, broken at the plant's input, and L its loop gain: delay, hold, lag and
//! whatever else lies in the loop included. An impulse on a sample shows what noise there makes of u. Both need a loop
//! that is stable, and a span in which the answer has died away.
//!
//! ```
//! use loop_sim::response::Margins;
//! // Of a gain 0.5 after one tick of delay, u_k = -0.5 u_(k-1): S = 1/(1 + 0.5 e^(-i w T)), worst at the Nyquist rate.
//! let answer: Vec<f64> = (0..60).map(|k| (-0.5_f64).powi(k)).collect();
//! let margins = Margins::of(&answer, 1e-3).expect("an answer that dies away");
//! assert!((margins.sensitivity_peak - 2.0).abs() < 1e-3);
//! assert!((margins.gain.expect("it could be raised") - 2.0).abs() < 1e-2);
//! ```

use std::f64::consts::PI;
use std::ops::ControlFlow;

use crate::closed_loop::{Loop, LoopError, close_loop};
use crate::plant::Plant;
use crate::sensor::Sensor;
use crate::trace::Row;

/// Where the impulse strikes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// At the plant's input, for one period.
    Input,
    /// On one sample of this state, from 0.
    Sample(usize),
}

/// u held and the output y of every tick from the impulse on, in a run with an impulse of this size at this tick.
///
/// # Errors
/// When the loop could not be run.
pub fn struck(setup: Loop<'_>, place: Place, tick: usize, size: f64) -> Result<Vec<[f64; 2]>, LoopError> {
    let Loop { plant, sensor, port, actuator, report, x0, period_s, periods } = setup;
    let [from_s, to_s] = [tick, tick + 1].map(|k| k as f64 * period_s);
    let (at_input, at_sample) = match place {
        Place::Input => (size, None),
        Place::Sample(state) => (0.0, Some(state)),
    };
    let mut jumps_s: Vec<f64> = plant.jumps_s().iter().copied().chain([from_s, to_s]).collect();
    jumps_s.sort_by(f64::total_cmp);
    let plant = Struck { plant, from_s, to_s, size: at_input, jumps_s };
    let mut sensor = Nudged { sensor, state: at_sample, size, left: tick };
    let mut answer = Vec::with_capacity(periods + 1);
    let mut taken = |row: &Row| {
        if row.t_s >= from_s - 0.5 * period_s {
            answer.push([row.u_held, row.x[0]]);
        }
        ControlFlow::Continue(())
    };
    let setup = Loop { plant: &plant, sensor: &mut sensor, port, actuator, report, x0, period_s, periods };
    close_loop(setup, &mut taken).map(|_| answer)
}

/// A plant that feels more than the actuator holds, for a while.
struct Struck<'a> {
    plant: &'a dyn Plant,
    from_s: f64,
    to_s: f64,
    size: f64,
    jumps_s: Vec<f64>,
}

impl Plant for Struck<'_> {
    fn order(&self) -> usize {
        self.plant.order()
    }
    fn rhs(&self, t_s: f64, x: &[f64], u: f64, dx: &mut [f64]) {
        // The solver's last stage lies on the end of its step.
        let strikes = t_s >= self.from_s && t_s < self.to_s;
        self.plant.rhs(t_s, x, if strikes { u + self.size } else { u }, dx);
    }
    fn lumped(&self, t_s: f64, x: &[f64], u: f64, d: &mut [f64]) {
        self.plant.lumped(t_s, x, u, d);
    }
    fn fastest_rad_s(&self, t_s: f64, x: &[f64], u: f64) -> f64 {
        self.plant.fastest_rad_s(t_s, x, u)
    }
    fn is_checked(&self) -> bool {
        self.plant.is_checked()
    }
    fn jumps_s(&self) -> &[f64] {
        &self.jumps_s
    }
}

/// A sensor that sees one state wrong, once.
struct Nudged<'a> {
    sensor: &'a mut dyn Sensor,
    state: Option<usize>,
    size: f64,
    left: usize,
}

impl Sensor for Nudged<'_> {
    fn measure(&mut self, x: &[f64], sample: &mut [f64]) {
        let mut seen = [0.0; crate::MAX_ORDER];
        let seen = &mut seen[..x.len()];
        seen.copy_from_slice(x);
        if let (0, Some(state)) = (self.left, self.state) {
            seen[state] += self.size;
        }
        self.left = self.left.wrapping_sub(1);
        self.sensor.measure(seen, sample);
    }
}

/// How far a loop is from instability, at the plant's input.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Margins {
    /// The highest frequency at which the loop gain is 1, rad/s; none if it is less everywhere.
    pub crossover_rad_s: Option<f64>,
    /// Phase that may be lost where the loop gain is 1, degrees: the least of all such frequencies.
    pub phase_deg: Option<f64>,
    /// Delay that may be added, s.
    pub delay_s: Option<f64>,
    /// Factor by which the plant's gain may grow; none if nothing below infinity is too much.
    pub gain: Option<f64>,
    /// Factor to which the plant's gain may fall; none if 0 is still stable.
    pub gain_down: Option<f64>,
    /// Largest |S|: 1/(distance of L from -1).
    pub sensitivity_peak: f64,
    /// Where it is, rad/s.
    pub peak_rad_s: f64,
}

/// Frequencies per run of the sum, evenly spaced on a logarithmic scale.
const FREQUENCIES: usize = 3000;

impl Margins {
    /// Of what the plant felt, in units of the impulse: v_0 (1 and the u of that tick), v_1, .. `None` if that has not
    /// died away, so that the loop is not stable or the span too short.
    pub fn of(answer: &[f64], period_s: f64) -> Option<Self> {
        if !has_died_away(answer) {
            return None;
        }
        let nyquist = PI / period_s;
        let lowest = (nyquist / answer.len() as f64).min(0.1 * nyquist);
        let ratio = libm::pow(nyquist / lowest, 1.0 / (FREQUENCIES - 1) as f64);
        let mut margins = Self {
            crossover_rad_s: None,
            phase_deg: None,
            delay_s: None,
            gain: None,
            gain_down: None,
            sensitivity_peak: 0.0,
            peak_rad_s: 0.0,
        };
        let mut before: Option<(f64, Complex)> = None;
        let mut omega = lowest;
        for k in 0..FREQUENCIES {
            if k + 1 == FREQUENCIES {
                omega = nyquist;
            }
            let s = transformed(answer, omega * period_s);
            if s.magnitude() > margins.sensitivity_peak {
                (margins.sensitivity_peak, margins.peak_rad_s) = (s.magnitude(), omega);
            }
            let l = s.inverse().less_one();
            if let Some((last, from)) = before {
                margins.cross(last, from, omega, l);
            }
            // On the negative real axis at the highest frequency of all there is no crossing to see.
            if k + 1 == FREQUENCIES && l.re < 0.0 {
                margins.critical(-l.re);
            }
            before = Some((omega, l));
            omega *= ratio;
        }
        Some(margins)
    }

    /// What happens between two frequencies that are near each other.
    fn cross(&mut self, low: f64, from: Complex, high: f64, to: Complex) {
        let share = |a: f64, b: f64| a / (a - b);
        let [a, b] = [from, to].map(|l| libm::log(l.magnitude()));
        if (a > 0.0) != (b > 0.0) {
            let part = share(a, b);
            let (omega, l) = (low + part * (high - low), from.towards(to, part));
            // From -180 degrees counter-clockwise: lag up to a whole turn can be borne.
            let phase = libm::atan2(-l.im, -l.re);
            let lag = if phase < 0.0 { phase + 2.0 * PI } else { phase };
            self.crossover_rad_s = Some(self.crossover_rad_s.map_or(omega, |known| known.max(omega)));
            let nearest = libm::fabs(phase) * 180.0 / PI;
            self.phase_deg = Some(self.phase_deg.map_or(nearest, |known| known.min(nearest)));
            self.delay_s = Some(self.delay_s.map_or(lag / omega, |known| known.min(lag / omega)));
        }
        if (from.im > 0.0) != (to.im > 0.0) {
            let l = from.towards(to, share(from.im, to.im));
            if l.re < 0.0 {
                self.critical(-l.re);
            }
        }
    }

    /// L has been at minus this.
    fn critical(&mut self, size: f64) {
        let factor = 1.0 / size;
        if factor > 1.0 {
            self.gain = Some(self.gain.map_or(factor, |known| known.min(factor)));
        } else {
            self.gain_down = Some(self.gain_down.map_or(factor, |known| known.max(factor)));
        }
    }
}

/// Has the last tenth sunk below a thousandth of the peak?
fn has_died_away(answer: &[f64]) -> bool {
    let peak = |values: &[f64]| values.iter().fold(0.0_f64, |peak, value| peak.max(value.abs()));
    let (all, last) = (peak(answer), peak(&answer[answer.len() - answer.len() / 10 - 1..]));
    all.is_finite() && last <= 1e-3 * all
}

/// How fast an answer dies away in the end, 1/s: from a tenth of its peak to a thousandth. `None` if it does not.
pub fn decay_per_s(answer: &[f64], period_s: f64) -> Option<f64> {
    let peak = answer.iter().fold(0.0_f64, |peak, value| peak.max(value.abs()));
    let below = |share: f64| answer.iter().rposition(|value| value.abs() > share * peak);
    let (tenth, thousandth) = (below(0.1)?, below(1e-3)?);
    let is_over = thousandth + 1 < answer.len() && thousandth > tenth;
    is_over.then(|| libm::log(100.0) / ((thousandth - tenth) as f64 * period_s))
}

/// Σ v_k e^(-i phase k).
fn transformed(values: &[f64], phase: f64) -> Complex {
    let turn = Complex { re: libm::cos(phase), im: -libm::sin(phase) };
    // From the last: a Horner sum.
    values.iter().rev().fold(Complex { re: 0.0, im: 0.0 }, |sum, value| sum.times(turn).plus(*value))
}

#[derive(Clone, Copy)]
struct Complex {
    re: f64,
    im: f64,
}

impl Complex {
    fn times(self, other: Self) -> Self {
        Self { re: self.re * other.re - self.im * other.im, im: self.re * other.im + self.im * other.re }
    }
    fn plus(self, real: f64) -> Self {
        Self { re: self.re + real, ..self }
    }
    fn less_one(self) -> Self {
        self.plus(-1.0)
    }
    fn magnitude(self) -> f64 {
        libm::hypot(self.re, self.im)
    }
    fn inverse(self) -> Self {
        let square = self.re * self.re + self.im * self.im;
        Self { re: self.re / square, im: -self.im / square }
    }
    fn towards(self, other: Self, part: f64) -> Self {
        Self { re: self.re + part * (other.re - self.re), im: self.im + part * (other.im - self.im) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::actuator::Ideal as Held;
    use crate::plant::{Chain, LastChannel};
    use crate::port::{ControllerPort, PortError, Tick};
    use crate::sensor::Ideal;
    use crate::signal::Signal;
    use controller_core::Health;

    const PERIOD_S: f64 = 0.01;
    const K: [f64; 2] = [400.0, 30.0];

    /// u = -k . x.
    struct Feedback;

    impl ControllerPort for Feedback {
        fn tick(&mut self, x: &[f64]) -> Result<Tick, PortError> {
            let u = -K[0] * x[0] - K[1] * x[1];
            Ok(Tick { u, sigma: 0.0, sigma_star: 0.0, estimates: Default::default(), health: Health::OK })
        }
        fn report_applied(&mut self, _: f64) {}
        fn reset(&mut self) -> Result<(), PortError> {
            Ok(())
        }
        fn observed(&self) -> &[usize] {
            &[]
        }
    }

    fn answer(place: Place, size: f64) -> Vec<[f64; 2]> {
        let channel = LastChannel { a: vec![0.0, 0.0], b: 1.0 };
        let plant = Chain::new(channel.clone(), channel, vec![Signal::default(), Signal::default()]).expect("a chain");
        let setup = Loop {
            plant: &plant,
            sensor: &mut Ideal,
            port: &mut Feedback,
            actuator: &mut Held,
            report: true,
            x0: &[0.0, 0.0],
            period_s: PERIOD_S,
            periods: 400,
        };
        struck(setup, place, 3, size).expect("a run")
    }

    /// K (z I - A)^-1 B of the double integrator under a hold, by hand.
    fn loop_gain(omega: f64) -> Complex {
        let z = Complex { re: libm::cos(omega * PERIOD_S), im: libm::sin(omega * PERIOD_S) };
        let step = z.less_one().inverse();
        // x_2 = T/(z - 1), x_1 = (T x_2 + T²/2)/(z - 1).
        let x_2 = Complex { re: PERIOD_S * step.re, im: PERIOD_S * step.im };
        let half = PERIOD_S * PERIOD_S / 2.0;
        let x_1 = Complex { re: PERIOD_S * x_2.re + half, im: PERIOD_S * x_2.im }.times(step);
        Complex { re: K[0] * x_1.re + K[1] * x_2.re, im: K[0] * x_1.im + K[1] * x_2.im }
    }

    #[test]
    fn margins_of_a_known_loop_are_those_of_its_transfer_function() {
        let felt: Vec<f64> =
            answer(Place::Input, 1.0).iter().enumerate().map(|(k, [u, _])| u + f64::from(k == 0)).collect();
        let margins = Margins::of(&felt, PERIOD_S).expect("a stable loop");
        let crossover = margins.crossover_rad_s.expect("a gain above 1 at low frequencies");
        let l = loop_gain(crossover);
        assert!((l.magnitude() - 1.0).abs() < 1e-3, "{}", l.magnitude());
        let phase = libm::atan2(-l.im, -l.re);
        assert!((margins.phase_deg.expect("one") - phase.to_degrees()).abs() < 0.05, "{margins:?}");
        assert!((margins.delay_s.expect("one") / (phase / crossover) - 1.0).abs() < 1e-3);
        // At the Nyquist rate L is real: -(K_2 T/2).
        let nyquist = loop_gain(PI / PERIOD_S);
        assert!((margins.gain.expect("one") * -nyquist.re - 1.0).abs() < 1e-3, "{margins:?}, {}", nyquist.re);
        assert_eq!(margins.gain_down, None);
        let l = loop_gain(margins.peak_rad_s);
        assert!((margins.sensitivity_peak * l.plus(1.0).magnitude() - 1.0).abs() < 1e-6);
    }

    /// An impulse on a sample is answered at once by -k, and then by what the loop makes of it.
    #[test]
    fn an_impulse_on_a_sample_is_seen_once() {
        let [u, then] = [0, 1].map(|k| answer(Place::Sample(1), 2.0)[k]);
        assert_eq!(u, [-2.0 * K[1], 0.0]);
        let expected = -2.0 * K[1] * PERIOD_S;
        let [x_1, x_2] = [expected * PERIOD_S / 2.0, expected];
        assert!((then[0] + K[0] * x_1 + K[1] * x_2).abs() < 1e-9 && (then[1] - x_1).abs() < 1e-12, "{then:?}");
    }

    #[test]
    fn an_answer_that_does_not_die_away_has_no_margins() {
        let growing: Vec<f64> = (0..100).map(|k| 1.01_f64.powi(k)).collect();
        assert_eq!((Margins::of(&growing, 1e-3), decay_per_s(&growing, 1e-3)), (None, None));
        let dying: Vec<f64> = (0..2000).map(|k| libm::exp(-0.01 * f64::from(k))).collect();
        assert!((decay_per_s(&dying, 1e-3).expect("a rate") / 10.0 - 1.0).abs() < 5e-3);
    }
}
