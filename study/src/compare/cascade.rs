//! P-PI cascades of industrial drives: for a joint with feedback of the spring, or with a notch at its resonance.
//!
//! The formulas are in the head of [`rival`](super::rival).

use super::Knob;
use super::rival::{BEYOND, ESTIMATE, INTEGRAL, LAST, TickInputs};
use super::task::{Aim, Model, Task};

/// Number of additional memory entries: the filtered error of the spring, and two of the notch.
pub(super) const MORE: usize = 3;

/// Highest centre of a notch, as a share of the Nyquist frequency.
const HIGHEST: f64 = 0.9;

/// Gains of u = ff + N k_v/b (s + k_t spring + ∫ k_i s), s = D (motor's error)' + k_p (F link's + (1 - F) motor's).
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains {
    kp: f64,
    kt: f64,
    /// Gains over b, A s/rad.
    kv: f64,
    ki: f64,
    /// Filter coefficient of D.
    fresh: f64,
    /// Filter coefficient of F; 1 if the position is the link position alone.
    crossing: f64,
    notch: Option<Notch>,
}

impl Gains {
    /// Builds P-PI from k_p, k_v, k_i and D for a motor; for a joint k_t is the second value.
    pub(super) fn new(model: &Model, knobs: &[f64]) -> Option<Self> {
        let (kp, kt, [kv, ki, filter]) = match *knobs {
            [kp, kv, ki, filter] => (kp, 0.0, [kv, ki, filter]),
            [kp, kt, kv, ki, filter] => (kp, kt, [kv, ki, filter]),
            _ => return None,
        };
        let fresh = share(filter, model.period_s);
        Some(Self { kp, kt, kv: kv / model.b[model.order() - 1], ki, fresh, crossing: 1.0, notch: None })
    }

    /// Builds P-PI with a notch from the values of [`notch_knobs`].
    pub(super) fn notched(model: &Model, knobs: &[f64]) -> Option<Self> {
        let &[kp, crossing, kv, ki, filter, centre, damping] = knobs else { return None };
        let t = model.period_s;
        let [fresh, crossing] = [filter, crossing].map(|w| share(w, t));
        let notch = Some(Notch::new(centre, damping, t));
        Some(Self { kp, kt: 0.0, kv: kv / model.rigid_gain(), ki, fresh, crossing, notch })
    }
}

/// Returns the coefficient of a first-order low-pass filter with this bandwidth.
fn share(bandwidth_rad_s: f64, period_s: f64) -> f64 {
    1.0 - libm::exp(-bandwidth_rad_s * period_s)
}

/// Returns the tuning parameters of P-PI with a notch from the data sheet. The speed loop has half of the frequency of
/// the link with the motor held. Position and integral are four times as slow, and the crossover twice as slow again.
/// The filter is above the resonance, and the notch is at the resonance. The notch is narrow, because the phase lag of
/// a wide one costs more than ±50 % of K.
pub(super) fn notch_knobs(task: &Task) -> Vec<Knob> {
    let [alone, resonance] = task.model.resonances_rad_s();
    let highest = HIGHEST * std::f64::consts::PI / task.model.period_s;
    let knob = |name, guess: f64| Knob { name, low: guess / 8.0, high: guess * 8.0, guess };
    let kv = 0.5 * alone;
    let centre = resonance.min(0.5 * highest);
    vec![
        knob("kp (1/s)", kv / 4.0),
        knob("crossover (rad/s)", kv / 8.0),
        knob("kv (1/s)", kv),
        knob("ki (1/s)", kv / 4.0),
        knob("filter (rad/s)", 1.5 * resonance),
        Knob { name: "notch (rad/s)", low: centre / 4.0, high: (4.0 * centre).min(highest), guess: centre },
        Knob { name: "damping of the notch", low: 0.02, high: 3.0, guess: 0.2 },
    ]
}

/// Notch (s² + ω²)/(s² + 2 ζ ω s + ω²) by Tustin's rule, prewarped at ω. With x' and x'' of one and two ticks before, y
/// = b_0 (x + x'') + a_1 x' - a_1 y' - a_2 y''.
#[derive(Clone, Copy, Debug)]
pub(super) struct Notch {
    b_0: f64,
    a_1: f64,
    a_2: f64,
}

impl Notch {
    pub(super) fn new(centre_rad_s: f64, damping: f64, period_s: f64) -> Self {
        let k = libm::tan(0.5 * centre_rad_s * period_s);
        let (square, drag) = (k * k, 2.0 * damping * k);
        let whole = 1.0 + drag + square;
        Self { b_0: (1.0 + square) / whole, a_1: 2.0 * (square - 1.0) / whole, a_2: (1.0 - drag + square) / whole }
    }

    /// Computes one tick with two memory entries.
    fn tick(&self, memory: &mut [f64], x: f64) -> f64 {
        let y = self.b_0 * x + memory[0];
        memory[0] = self.a_1 * (x - y) + memory[1];
        memory[1] = self.b_0 * x - self.a_2 * y;
        y
    }
}

/// Returns the error of the motor angle; the output of a plant without a joint is the motor.
pub(super) fn motor_error(model: &Model, y: &[f64; 2], aim: &Aim) -> f64 {
    let driven = model.encoders() - 1;
    aim.x[2 * driven] - y[driven]
}

/// Returns u of a tick.
pub(super) fn tick(model: &Model, gains: &Gains, memory: &mut [f64], inputs: &TickInputs<'_>) -> f64 {
    let error = motor_error(model, &inputs.y, inputs.now);
    let [last, filtered] = [memory[LAST], memory[LAST + 1]];
    let filtered = filtered + gains.fresh * ((error - last) / model.period_s - filtered);
    (memory[LAST], memory[LAST + 1]) = (error, filtered);
    let output_error = inputs.now.x[0] - inputs.y[0];
    let spring = error - output_error;
    let slow = (1.0 - gains.crossing) * memory[ESTIMATE] + gains.crossing * spring;
    memory[ESTIMATE] = slow;
    let s = filtered + gains.kp * (output_error + (spring - slow));
    if memory[BEYOND] < 0.5 {
        memory[INTEGRAL] += gains.ki * model.period_s * s;
    }
    let asked = gains.kv * (s + gains.kt * spring + memory[INTEGRAL]);
    inputs.then.feed
        + gains.notch.as_ref().map_or(asked, |notch| notch.tick(&mut memory[ESTIMATE + 1..ESTIMATE + MORE], asked))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use nalgebra::Complex;

    use super::*;

    /// Returns N of the notch in continuous time at jΩ.
    fn continuous(centre: f64, damping: f64, w: f64) -> Complex<f64> {
        let stiff = Complex::new(centre * centre - w * w, 0.0);
        stiff / (stiff + Complex::new(0.0, 2.0 * damping * centre * w))
    }

    fn size(number: Complex<f64>) -> f64 {
        libm::hypot(number.re, number.im)
    }

    /// Returns the response of the recursion to e^(jθk) after its poles have decayed.
    fn response(notch: &Notch, theta: f64) -> Complex<f64> {
        let mut memory = [[0.0; 2]; 2];
        let ticks = 20_000;
        let turned = |k: usize| Complex::new(libm::cos(theta * k as f64), libm::sin(theta * k as f64));
        let mut last = Complex::new(0.0, 0.0);
        for k in 0..ticks {
            let x = turned(k);
            let [re, im] = [x.re, x.im];
            last = Complex::new(notch.tick(&mut memory[0], re), notch.tick(&mut memory[1], im));
        }
        last / turned(ticks - 1)
    }

    /// At every frequency the notch equals the continuous one at (2/T) tan(θ/2), scaled to keep the centre: slow and
    /// fast, narrow and wide.
    #[test]
    fn the_notch_is_its_closed_form_at_every_frequency() {
        let t = 2.5e-4;
        for (centre, damping) in [(580.0, 0.7), (580.0, 0.05), (9000.0, 1.5), (40.0, 0.7)] {
            let notch = Notch::new(centre, damping, t);
            for w in [0.0, 0.3 * centre, 0.97 * centre, 1.05 * centre, 1.3 * centre, 0.95 * PI / t] {
                let warped = centre * libm::tan(0.5 * w * t) / libm::tan(0.5 * centre * t);
                let (found, expected) = (response(&notch, w * t), continuous(centre, damping, warped));
                assert!(size(found - expected) < 1e-8, "{centre} {damping} at {w}: {found} of {expected}");
            }
        }
    }

    /// Prewarping keeps the zero at the centre, even at half the Nyquist frequency, where it would be 15 % too low
    /// otherwise.
    #[test]
    fn the_notch_lets_nothing_of_its_centre_through() {
        let t = 1e-3;
        for centre in [50.0, 340.0, 0.5 * PI / t] {
            let notch = Notch::new(centre, 0.7, t);
            assert!(size(response(&notch, centre * t)) < 1e-8, "{centre}");
            let beside = size(response(&notch, 1.05 * centre * t));
            assert!(beside > 0.02, "{centre}: {beside}");
        }
    }
}
