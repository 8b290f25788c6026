//! Multisine excitation of the motor around its resonance: a sum of sines on top of the current during the moves.
//!
//! $$ e(t) = \hat e \thinspace \frac{\sum_i \sin(2 \pi f_i t + \varphi_i)}{\max | \cdot |} $$
//!
//! A move alone is quasi-static for the motor: stiffness, damping and torque constant have similar effects. Eight
//! frequencies around the resonance separate them. The phases are the best of some random sets, with the most power for
//! a given peak. The multisine fades in and out over 50 ms.

use std::f64::consts::TAU;

use loop_sim::random::Random;

/// Frequencies relative to the resonance of the joint with a free link; for 15.7 Hz from 5 to 37 Hz.
const RATIOS: [f64; 8] = [0.32, 0.51, 0.70, 0.89, 1.15, 1.47, 1.85, 2.36];
/// Middle frequency for a rigid load, Hz.
const RIGID_HZ: f64 = 15.7;
/// Number of random phase sets.
const TRIES: usize = 50;
/// Fade time, s.
const FADE_S: f64 = 0.05;
/// Smallest number of samples per period of the highest frequency.
const LEAST_SAMPLES: f64 = 10.0;

/// Returns the highest middle frequency for this sampling period, Hz.
pub(crate) fn highest_hz(period_s: f64) -> f64 {
    1.0 / (LEAST_SAMPLES * RATIOS[RATIOS.len() - 1] * period_s)
}

/// Returns one value per tick with this peak, around a resonance in rad/s (0 for a rigid load).
pub fn multisine(peak: f64, ticks: usize, period_s: f64, resonance_rad_s: f64, seed: u64) -> Vec<f64> {
    let middle = if resonance_rad_s > 0.0 { resonance_rad_s / TAU } else { RIGID_HZ };
    let middle = middle.min(highest_hz(period_s));
    let mut random = Random::new(seed, 0);
    let sum = |phases: &[f64]| -> Vec<f64> {
        let at = |k: usize| {
            let t = k as f64 * period_s;
            RATIOS.iter().zip(phases).map(|(ratio, phase)| libm::sin(TAU * ratio * middle * t + phase)).sum()
        };
        (0..ticks).map(at).collect()
    };
    let size = |wave: &[f64]| wave.iter().fold(0.0_f64, |most, value: &f64| most.max(value.abs()));
    let waves = (0..TRIES).map(|_| sum(&RATIOS.map(|_| TAU * random.uniform())));
    let mut wave = waves.min_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or_default();
    let scale = peak / size(&wave).max(1e-12);
    for (k, value) in wave.iter_mut().enumerate() {
        let from_an_end = k.min(ticks - 1 - k) as f64 * period_s;
        *value *= scale * (from_an_end / FADE_S).min(1.0);
    }
    wave
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_its_peak_begins_and_ends_at_nothing_and_shakes_where_it_should() {
        let wave = multisine(8.0, 4450, 1e-3, TAU * 15.7, 1);
        let largest = wave.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        assert!(largest <= 8.0 && largest > 7.0 && wave[0] == 0.0 && wave[4449] == 0.0, "{largest}");
        // Crest factor; eight sines with equal phases have 4.
        let rms = (wave.iter().map(|value| value * value).sum::<f64>() / 4450.0).sqrt();
        assert!(8.0 / rms < 2.6, "{}", 8.0 / rms);
        // Power at its frequencies, none between them.
        let at = |hertz: f64| {
            let parts = wave.iter().enumerate().map(|(k, value)| {
                let phase = TAU * hertz * k as f64 * 1e-3;
                [value * phase.cos(), value * phase.sin()]
            });
            let [c, s] = parts.fold([0.0; 2], |[c, s], [x, y]| [c + x, s + y]);
            c.hypot(s) * 2.0 / 4450.0
        };
        for ratio in RATIOS {
            assert!(at(ratio * 15.7) > 0.8, "{ratio}: {}", at(ratio * 15.7));
        }
        assert!(at(20.3) < 0.1 && at(3.0) < 0.1 && at(60.0) < 0.05);
        // A slow clock uses the highest possible frequencies.
        assert!(multisine(1.0, 400, 1e-2, TAU * 100.0, 1).iter().all(|value| value.abs() <= 1.0));
    }
}
