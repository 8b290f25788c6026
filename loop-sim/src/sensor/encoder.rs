//! Encoders and their faults: an angle becomes a count that wraps.
//!
//! $$ \text{count} = \left(\pm \left\lfloor \frac{\theta}{2\pi} \thinspace \frac{\text{num}}{\text{den}} \thinspace
//!    \text{counts per turn} + \frac12 \right\rfloor + \text{offset}\right) \bmod \text{states} $$
//!
//! The encoder makes num revolutions for den revolutions of the shaft, and it has 2^bits states by default. A count is
//! an integer in an f64, exact for every counter. A lost count is NaN. The sample of a drive is the counts of its
//! encoders, in order, and zeros for the remaining states. [`Faulty`] adds a fault at a given time, as a wrapper like
//! all faults.

use std::f64::consts::TAU;
use std::ops::Range;

use controller_core::drive::{Encoder, Mounting};

use super::{Ideal, Sensor};
use crate::MAX_ORDER;

/// Encoder with its mounting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mounted {
    /// Counts, gear and width of the counter.
    pub encoder: Encoder,
    /// Sign and offset of the counts.
    pub mounting: Mounting,
}

impl Mounted {
    /// Returns an encoder that counts up, from 0 at angle 0.
    pub const fn new(encoder: Encoder) -> Self {
        Self { encoder, mounting: Mounting::UPRIGHT }
    }

    /// Returns the count at this angle.
    pub fn count(&self, angle_rad: f64) -> f64 {
        let Encoder { counts_per_turn, gear_num, gear_den, .. } = self.encoder;
        // The count is formed before the quotient, so that whole revolutions give whole counts.
        let steps = angle_rad / TAU * f64::from(counts_per_turn) * f64::from(gear_num) / f64::from(gear_den);
        let steps = libm::floor(steps + 0.5);
        let Mounting { is_reversed, offset_counts } = self.mounting;
        let count = if is_reversed { -steps } else { steps } + f64::from(offset_counts);
        let span = self.encoder.counter() as f64;
        count - span * libm::floor(count / span)
    }

    /// Removes the sign and offset of a count, as the input of a drive. `None` for a lost count.
    pub fn upright(&self, count: f64) -> Option<i32> {
        // The drive reads the low bits of a wider count.
        count.is_finite().then_some(count as i64 as i32).map(|count| self.mounting.upright(count))
    }

    /// Returns the counts from one count without sign and offset to a later one, the shorter way around the counter.
    pub fn counts_since(&self, count: i32, earlier: i32) -> i64 {
        let states = self.encoder.counter() as i64;
        let ahead = (i64::from(count) - i64::from(earlier)).rem_euclid(states);
        if 2 * ahead >= states { ahead - states } else { ahead }
    }
}

/// Encoders that replace the states of a sample. They measure the true state, or the state with jitter and noise.
pub struct Encoders<S = Ideal> {
    inner: S,
    /// Index of the state of each encoder, from 0.
    mounted: Vec<(usize, Mounted)>,
}

impl Encoders {
    /// Builds encoders of the true state. Each entry has the index of its state, from 0, and the encoder.
    pub fn new(mounted: Vec<(usize, Mounted)>) -> Self {
        Self::over(Ideal, mounted)
    }
}

impl<S> Encoders<S> {
    /// Builds encoders at the end of a chain that returns all states.
    pub fn over(inner: S, mounted: Vec<(usize, Mounted)>) -> Self {
        Self { inner, mounted }
    }
}

impl<S: Sensor> Sensor for Encoders<S> {
    fn measure(&mut self, x: &[f64], sample: &mut [f64]) {
        let mut seen = [0.0; MAX_ORDER];
        let seen = &mut seen[..x.len()];
        self.inner.measure(x, seen);
        sample.fill(0.0);
        for (value, (state, mounted)) in sample.iter_mut().zip(&self.mounted) {
            *value = seen.get(*state).map_or(f64::NAN, |&angle| mounted.count(angle));
        }
    }
}

/// Fault of a count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The count is frozen.
    Stuck,
    /// The count is off by a constant.
    Jump {
        /// Added counts.
        counts: f64,
    },
    /// The count is lost.
    Lost,
}

/// Fault during a range of ticks.
pub struct Faulty<S> {
    inner: S,
    fault: Fault,
    channels: Range<usize>,
    ticks: Range<usize>,
    tick: usize,
    held: [f64; MAX_ORDER],
}

impl<S> Faulty<S> {
    /// Adds a fault to these entries of the sample, during these ticks from 0.
    pub fn new(inner: S, fault: Fault, channels: Range<usize>, ticks: Range<usize>) -> Self {
        Self { inner, fault, channels, ticks, tick: 0, held: [f64::NAN; MAX_ORDER] }
    }
}

impl<S: Sensor> Sensor for Faulty<S> {
    fn measure(&mut self, x: &[f64], sample: &mut [f64]) {
        self.inner.measure(x, sample);
        let is_now = self.ticks.contains(&self.tick);
        self.tick += 1;
        for (k, (value, held)) in sample.iter_mut().zip(&mut self.held).enumerate() {
            if is_now && self.channels.contains(&k) {
                *value = match self.fault {
                    Fault::Stuck => *held,
                    Fault::Jump { counts } => *value + counts,
                    Fault::Lost => f64::NAN,
                };
            } else {
                *held = *value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::{Jittered, Noise};

    #[test]
    fn a_count_is_the_nearest_step_and_wraps() {
        let plain = Mounted::new(Encoder::absolute(12));
        let step = TAU / 4096.0;
        for (angle, count) in [
            (0.0, 0.0),
            (0.49 * step, 0.0),
            (0.51 * step, 1.0),
            (-0.51 * step, 4095.0),
            (TAU, 0.0),
            (1000.25 * TAU, 1024.0),
            (-1000.25 * TAU, 3072.0),
        ] {
            assert_eq!(plain.count(angle), count, "{angle}");
        }
        // Four counts per line, 1000 lines, in a counter of 16 bits behind a gear of 7 : 2.
        let geared = Mounted::new(Encoder::incremental(16, 4000).geared(7, 2));
        assert_eq!(geared.count(2.0 * TAU), 28_000.0);
        assert_eq!(geared.count(6.0 * TAU), 84_000.0 - 65_536.0);
        // A counter with all 32 bits.
        assert_eq!(Mounted::new(Encoder::incremental(32, 4000)).count(-TAU), 4_294_967_296.0 - 4000.0);
    }

    /// For any sign and offset, the input of the drive grows with the angle from 0 at angle 0, modulo the counter.
    #[test]
    fn what_the_drive_is_fed_knows_neither_sign_nor_offset() {
        for (bits, is_reversed, offset_counts) in [(12, false, 700), (12, true, 4000), (32, true, -5)] {
            let encoder = Encoder::incremental(bits, 4096);
            let mounted = Mounted { encoder, mounting: Mounting { is_reversed, offset_counts } };
            for steps in [-9000_i32, -4096, -1, 0, 3, 2047, 2048, 70_000] {
                let count = mounted.count(f64::from(steps) * TAU / 4096.0);
                assert!((0.0..(1_u64 << bits) as f64).contains(&count), "{count}");
                let fed = mounted.upright(count).expect("a count");
                let wrong = i64::from(fed.wrapping_sub(steps)) % (1 << bits);
                assert_eq!(wrong, 0, "{steps} steps of {mounted:?} are fed as {fed}");
            }
            assert_eq!(mounted.upright(f64::NAN), None);
        }
    }

    #[test]
    fn encoders_see_their_states_and_nothing_else_is_measured() {
        let mounted = Mounted::new(Encoder::absolute(12));
        let mut sensor = Encoders::new(vec![(0, mounted), (2, mounted)]);
        let mut sample = [9.0; 5];
        sensor.measure(&[TAU / 4.0, 1.0, TAU / 8.0, 1.0, 1.0], &mut sample);
        assert_eq!(sample, [1024.0, 512.0, 0.0, 0.0, 0.0]);
    }

    /// With a shaft at constant speed, a count is the angle at the age of its sample plus the noise, rounded once.
    /// Without noise and jitter it is the ideal count.
    #[test]
    fn what_encoders_see_is_late_and_noisy_before_it_is_rounded() {
        let mounted = Mounted::new(Encoder::incremental(32, 4096).geared(3, 1));
        let sees = || vec![(1, mounted)];
        let (sigma, share, seed) = (2e-3, 0.5, 11);
        let mut counted = Encoders::over(Noise::new(Jittered::new(Ideal, share, seed), &[0.0, sigma], seed), sees());
        let mut seen = Noise::new(Jittered::new(Ideal, share, seed), &[0.0, sigma], seed);
        let mut plain = Encoders::new(sees());
        let (mut apart, mut squares, ticks) = (0.0, 0.0, 20_000);
        for k in 0..ticks {
            let x = [0.0, 1e-2 * f64::from(k)];
            let [mut count, mut angle, mut exact] = [[0.0; 2]; 3];
            counted.measure(&x, &mut count);
            seen.measure(&x, &mut angle);
            plain.measure(&x, &mut exact);
            assert_eq!(count[0], mounted.count(angle[1]), "tick {k}");
            assert_eq!(exact[0], mounted.count(x[1]), "tick {k}");
            let off = (count[0] - exact[0]) * mounted.encoder.unit_rad();
            (apart, squares) = (apart + off, squares + off * off);
        }
        // Ages are uniform up to half of 1e-2 rad: mean 2.5e-3. The rms is from sigma, 5e-3/sqrt(12) and two roundings
        // of 2 pi/12288. The limit is four standard deviations of a mean of 20000.
        let mean = apart / f64::from(ticks);
        let rms = (squares / f64::from(ticks) - mean * mean).sqrt();
        let rounding = TAU / 12_288.0;
        let expected = (sigma * sigma + (25e-6 + 2.0 * rounding * rounding) / 12.0).sqrt();
        assert!((mean + 2.5e-3).abs() < 4.0 * expected / f64::from(ticks).sqrt(), "{mean}");
        assert!((rms / expected - 1.0).abs() < 0.03, "{rms} {expected}");
    }

    fn faulty(fault: Fault, ticks: Range<usize>) -> Vec<[f64; 2]> {
        let mut sensor = Faulty::new(Ideal, fault, 1..2, ticks);
        let measured = |k: u32| {
            let mut sample = [0.0; 2];
            sensor.measure(&[f64::from(k), 10.0 + f64::from(k)], &mut sample);
            sample
        };
        (0..5).map(measured).collect()
    }

    #[test]
    fn a_fault_lasts_its_ticks_and_is_of_its_channel() {
        assert_eq!(faulty(Fault::Stuck, 2..4).concat(), [0.0, 10.0, 1.0, 11.0, 2.0, 11.0, 3.0, 11.0, 4.0, 14.0]);
        let jump = Fault::Jump { counts: -5.0 };
        assert_eq!(faulty(jump, 3..usize::MAX).concat(), [0.0, 10.0, 1.0, 11.0, 2.0, 12.0, 3.0, 8.0, 4.0, 9.0]);
        let lost = faulty(Fault::Lost, 1..2);
        assert!(lost[1][1].is_nan() && lost.iter().flatten().filter(|value| value.is_nan()).count() == 1, "{lost:?}");
        // Frozen from the first tick, so there is no count.
        assert!(faulty(Fault::Stuck, 0..2)[1][1].is_nan());
    }
}
