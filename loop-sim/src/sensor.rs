//! Sensor chain from the true state to the sample of the controller.
//!
//! Every fault is a wrapper around another sensor. The chain is built from the plant outwards: the innermost link reads
//! the true state. Each wrapper is one link nearer to the controller and changes the sample of the inner link.
//!
//! ```
//! use loop_sim::sensor::{Ideal, Noise, Quantised, Sensor};
//! // Noise on the line before the converter: the sample is a multiple of 0.01.
//! let mut sensor = Quantised::new(Noise::new(Ideal, &[0.1], 7), vec![0.01]);
//! let mut sample = [0.0];
//! sensor.measure(&[0.5], &mut sample);
//! assert!((sample[0] * 100.0 - (sample[0] * 100.0).round()).abs() < 1e-9);
//! ```
//!
//! A list of links in a scenario is stacked at run time as `Box<dyn Sensor>`, which is also a sensor.
//!
//! Jitter, noise and dropout of one seed are independent: each draw is a function of seed, tick and purpose
//! ([`philox`]). Two links of the same kind need two seeds. [`Sensing`] is the usual chain as numbers.

use std::collections::VecDeque;

use controller_core::{Gate, Real};

use crate::MAX_ORDER;
use crate::philox::{self, Purpose};
use crate::port::in_process::padded;

pub mod encoder;

/// One link of the sensor chain.
pub trait Sensor: Send {
    /// Reads the true state once per tick and writes the sample. A lost sample is NaN.
    fn measure(&mut self, x: &[f64], sample: &mut [f64]);
}

impl<T: Sensor + ?Sized> Sensor for Box<T> {
    fn measure(&mut self, x: &[f64], sample: &mut [f64]) {
        (**self).measure(x, sample);
    }
}

/// Sensor that returns the true state.
pub struct Ideal;

impl Sensor for Ideal {
    fn measure(&mut self, x: &[f64], sample: &mut [f64]) {
        sample.copy_from_slice(x);
    }
}

/// Sensor chain as numbers: true state, jitter, noise, quantisation, delay and dropout, in this order. 0 means none.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensing {
    /// Largest age of a sample, as a share of the period ([`Jittered`]).
    pub jitter: f64,
    /// Off-centre magnets, one after the other.
    pub off_centre: Vec<OffCentre>,
    /// Standard deviation of each channel ([`Noise`]).
    pub noise: Vec<f64>,
    /// Quantum of each channel ([`Quantised`]).
    pub quantum: Vec<f64>,
    /// Delay in ticks ([`Delayed`]).
    pub delay_ticks: usize,
    /// Probability of a lost sample ([`Dropout`]).
    pub dropout: f64,
}

impl Sensing {
    /// Chain without faults, as [`Ideal`].
    pub const IDEAL: Self = Self {
        jitter: 0.0,
        off_centre: Vec::new(),
        noise: Vec::new(),
        quantum: Vec::new(),
        delay_ticks: 0,
        dropout: 0.0,
    };

    /// Builds the chain with this seed.
    pub fn sensor(&self, seed: u64) -> Box<dyn Sensor> {
        let Self { jitter, off_centre, noise, quantum, delay_ticks, dropout } = self;
        let mut chain: Box<dyn Sensor> = Box::new(Ideal);
        if *jitter > 0.0 {
            chain = Box::new(Jittered::new(chain, *jitter, seed));
        }
        if !off_centre.is_empty() {
            chain = Box::new(Magnets { inner: chain, off_centre: off_centre.clone() });
        }
        if !noise.is_empty() {
            chain = Box::new(Noise::new(chain, noise, seed));
        }
        if !quantum.is_empty() {
            chain = Box::new(Quantised::new(chain, quantum.clone()));
        }
        if *delay_ticks > 0 {
            chain = Box::new(Delayed::new(chain, *delay_ticks));
        }
        if *dropout > 0.0 {
            chain = Box::new(Dropout::new(chain, *dropout, seed));
        }
        chain
    }
}

/// Random numbers of one link, tick by tick.
struct Ticks {
    seed: [u32; 2],
    tick: u64,
}

impl Ticks {
    fn new(seed: u64) -> Self {
        Self { seed: philox::halves(seed), tick: 0 }
    }

    /// Returns the random words of the next tick, per pair of channels.
    fn next(&mut self, purpose: Purpose) -> impl Fn(u32) -> [u64; 2] + use<> {
        let (seed, tick) = (self.seed, self.tick);
        self.tick += 1;
        move |pair| philox::noise(seed, tick, purpose, pair)
    }
}

/// Off-centre magnet of an encoder, which causes an angle error once per revolution.
///
/// $$ \theta \leftarrow \theta + \frac{a}{N} \sin N \theta $$
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OffCentre {
    /// Index of the channel with the angle, from 0.
    pub channel: usize,
    /// Gear ratio N: revolutions of the encoder per revolution of the angle.
    pub turns: f64,
    /// Amplitude a of the error in the encoder's own angle, rad.
    pub rad: f64,
}

struct Magnets<S> {
    inner: S,
    off_centre: Vec<OffCentre>,
}

impl<S: Sensor> Sensor for Magnets<S> {
    fn measure(&mut self, x: &[f64], sample: &mut [f64]) {
        self.inner.measure(x, sample);
        for OffCentre { channel, turns, rad } in &self.off_centre {
            if let Some(angle) = sample.get_mut(*channel) {
                *angle += rad / turns * libm::sin(turns * *angle);
            }
        }
    }
}

/// Sensor with white Gaussian noise, independent between ticks and channels.
pub struct Noise<S> {
    inner: S,
    sigma: [f64; MAX_ORDER],
    ticks: Ticks,
}

impl<S> Noise<S> {
    /// Wraps `inner` with the standard deviation `sigma` of each channel, in its unit. Channels beyond the list have no
    /// noise.
    pub fn new(inner: S, sigma: &[f64], seed: u64) -> Self {
        Self { inner, sigma: padded(sigma), ticks: Ticks::new(seed) }
    }
}

impl<S: Sensor> Sensor for Noise<S> {
    fn measure(&mut self, x: &[f64], sample: &mut [f64]) {
        self.inner.measure(x, sample);
        // A channel draws the same numbers for any sigma of the other channels.
        let words = self.ticks.next(Purpose::Noise);
        for (pair, (values, sigma)) in (0..).zip(sample.chunks_mut(2).zip(self.sigma.chunks(2))) {
            let gaussians = philox::gaussians(words(pair));
            for ((value, sigma), gaussian) in values.iter_mut().zip(sigma).zip(gaussians) {
                *value += sigma * gaussian;
            }
        }
    }
}

/// Sensor that rounds to multiples of a quantum, halves away from zero. The error is at most half a quantum.
pub struct Quantised<S> {
    inner: S,
    quantum: Vec<f64>,
}

impl<S> Quantised<S> {
    /// Wraps `inner` with the `quantum` of each channel, in its unit. With 0, and beyond the list, a channel is not
    /// rounded.
    pub fn new(inner: S, quantum: Vec<f64>) -> Self {
        Self { inner, quantum }
    }
}

impl<S: Sensor> Sensor for Quantised<S> {
    fn measure(&mut self, x: &[f64], sample: &mut [f64]) {
        self.inner.measure(x, sample);
        for (value, &quantum) in sample.iter_mut().zip(&self.quantum) {
            if quantum > 0.0 {
                *value = quantum * libm::round(*value / quantum);
            }
        }
    }
}

/// Sensor that delays the sample by whole ticks. Until then it returns the first sample.
pub struct Delayed<S> {
    inner: S,
    ticks: usize,
    under_way: VecDeque<[f64; MAX_ORDER]>,
}

impl<S> Delayed<S> {
    /// Wraps `inner` with a delay of whole ticks. The buffer is allocated here and not during a run.
    pub fn new(inner: S, ticks: usize) -> Self {
        Self { inner, ticks, under_way: VecDeque::with_capacity(ticks + 1) }
    }
}

impl<S: Sensor> Sensor for Delayed<S> {
    fn measure(&mut self, x: &[f64], sample: &mut [f64]) {
        self.inner.measure(x, sample);
        let mut newest = [0.0; MAX_ORDER];
        newest[..sample.len()].copy_from_slice(sample);
        self.under_way.push_back(newest);
        let oldest = if self.under_way.len() > self.ticks { self.under_way.pop_front() } else { None };
        let arrived = oldest.or_else(|| self.under_way.front().copied()).unwrap_or(newest);
        sample.copy_from_slice(&arrived[..sample.len()]);
    }
}

/// Sensor with sampling jitter. The sample is too old by a random part of the period, uniform from 0 to a share of it,
/// equal in all channels. Between two ticks the state is interpolated linearly.
pub struct Jittered<S> {
    inner: S,
    share: f64,
    ticks: Ticks,
    last: Option<[f64; MAX_ORDER]>,
}

impl<S> Jittered<S> {
    /// Wraps `inner` with the largest age `share` of the period, 0 (none) to 1.
    pub fn new(inner: S, share: f64, seed: u64) -> Self {
        Self { inner, share, ticks: Ticks::new(seed), last: None }
    }
}

impl<S: Sensor> Sensor for Jittered<S> {
    fn measure(&mut self, x: &[f64], sample: &mut [f64]) {
        self.inner.measure(x, sample);
        let mut now = [0.0; MAX_ORDER];
        now[..sample.len()].copy_from_slice(sample);
        let age = self.share * philox::uniform(self.ticks.next(Purpose::Jitter)(0)[0]);
        let last = self.last.replace(now).unwrap_or(now);
        for (value, last) in sample.iter_mut().zip(last) {
            *value -= age * (*value - last);
        }
    }
}

/// Sensor that loses whole samples at random. A lost sample is NaN in all channels.
pub struct Dropout<S> {
    inner: S,
    probability: f64,
    ticks: Ticks,
}

impl<S> Dropout<S> {
    /// Wraps `inner` with the `probability` of each loss, 0 (none) to 1 (all), independent of other samples.
    pub fn new(inner: S, probability: f64, seed: u64) -> Self {
        Self { inner, probability, ticks: Ticks::new(seed) }
    }
}

impl<S: Sensor> Sensor for Dropout<S> {
    fn measure(&mut self, x: &[f64], sample: &mut [f64]) {
        // The sensor measures in any case. Its sample is lost on the way.
        self.inner.measure(x, sample);
        if philox::uniform(self.ticks.next(Purpose::Dropout)(0)[0]) < self.probability {
            sample.fill(f64::NAN);
        }
    }
}

/// Sample gate in front of any controller. A sample outside of its limits becomes lost. A target has no gate in its
/// tick and uses this one. In the precision of the controller it decides exactly like
/// [`Gated`](controller_core::Gated).
pub struct Gated<S, T> {
    inner: S,
    gate: Gate<T, MAX_ORDER>,
    last: Option<[T; MAX_ORDER]>,
}

impl<S, T: Real> Gated<S, T> {
    /// Wraps `inner` with a gate. The limits of unused states must admit 0.
    pub fn new(inner: S, gate: Gate<T, MAX_ORDER>) -> Self {
        Self { inner, gate, last: None }
    }
}

impl<S: Sensor, T: Real> Sensor for Gated<S, T> {
    fn measure(&mut self, x: &[f64], sample: &mut [f64]) {
        self.inner.measure(x, sample);
        let now = std::array::from_fn(|j| T::from_f64(sample.get(j).copied().unwrap_or(0.0)));
        let mut last = self.last.unwrap_or(now);
        let taken = self.gate.takes(&mut last, &now);
        if taken || self.last.is_some() {
            self.last = Some(last);
        }
        if !taken {
            sample.fill(f64::NAN);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(sensor: &mut dyn Sensor, x: f64) -> f64 {
        let mut sample = [0.0];
        sensor.measure(&[x], &mut sample);
        sample[0]
    }

    #[test]
    fn noise_has_the_stated_deviation_and_is_white_and_independent() {
        let ticks = 40_000;
        let mut sensor = Noise::new(Ideal, &[0.5, 0.0, 2.0], 11);
        let mut rows = Vec::new();
        for _ in 0..ticks {
            let mut sample = [0.0; 4];
            sensor.measure(&[1.0, 2.0, 3.0, 4.0], &mut sample);
            assert_eq!([sample[1], sample[3]], [2.0, 4.0]);
            rows.push([(sample[0] - 1.0) / 0.5, (sample[2] - 3.0) / 2.0]);
        }
        let mean = |f: &dyn Fn(usize) -> f64| (1..ticks).map(f).sum::<f64>() / f64::from(ticks as u32 - 1);
        // Four standard deviations of a mean of 40000: 4/sqrt(40000) = 0.02. The square has sqrt(2) times this, the
        // fourth power sqrt(96) times.
        for channel in 0..2 {
            assert!(mean(&|k| rows[k][channel]).abs() < 0.02);
            assert!((mean(&|k| rows[k][channel] * rows[k][channel]) - 1.0).abs() < 0.03);
            assert!((mean(&|k| rows[k][channel].powi(4)) - 3.0).abs() < 0.2, "not Gaussian");
            assert!(mean(&|k| rows[k][channel] * rows[k - 1][channel]).abs() < 0.02, "not white");
        }
        assert!(mean(&|k| rows[k][0] * rows[k][1]).abs() < 0.02, "channels are coupled");
    }

    #[test]
    fn a_seed_means_the_same_numbers_for_ever() {
        // Expected values from an independent computation, from the published generator and formula with another
        // logarithm and cosine. A change here breaks every recorded run.
        let mut sensor = Noise::new(Ideal, &[1.0], 1);
        let bits = [(); 2].map(|()| measured(&mut sensor, 0.0).to_bits());
        assert_eq!(bits, [4_599_461_192_487_880_948, 13_831_421_787_269_264_396]);
        let mut other = Noise::new(Ideal, &[1.0], 2);
        assert_ne!(measured(&mut other, 0.0).to_bits(), bits[0]);
        let mut dropout = Dropout::new(Ideal, 0.5, 1);
        let lost: String = (0..16).map(|_| if measured(&mut dropout, 0.0).is_nan() { 'x' } else { '.' }).collect();
        assert_eq!(lost, "x..xxxx.xx..xxxx");
    }

    #[test]
    fn one_channel_s_noise_does_not_depend_on_another_s_sigma() {
        let sample = |sigma: [f64; 2]| {
            let mut sample = [0.0; 2];
            Noise::new(Ideal, &sigma, 3).measure(&[0.0; 2], &mut sample);
            sample
        };
        assert_eq!(sample([0.0, 1.0])[1], sample([5.0, 1.0])[1]);
    }

    #[test]
    fn quantised_rounds_to_the_nearest_multiple_and_zero_passes() {
        let mut sensor = Quantised::new(Ideal, vec![0.25, 0.0]);
        for (x, expected) in [(0.12, 0.0), (0.125, 0.25), (-0.125, -0.25), (0.3, 0.25), (-0.9, -1.0)] {
            let mut sample = [0.0; 3];
            sensor.measure(&[x, x, x], &mut sample);
            assert_eq!(sample, [expected, x, x]);
        }
    }

    #[test]
    fn delayed_repeats_the_first_sample_and_then_lags_by_whole_ticks() {
        for (ticks, expected) in [(0, [1.0, 2.0, 3.0, 4.0]), (1, [1.0, 1.0, 2.0, 3.0]), (2, [1.0, 1.0, 1.0, 2.0])] {
            let mut sensor = Delayed::new(Ideal, ticks);
            assert_eq!([1.0, 2.0, 3.0, 4.0].map(|x| measured(&mut sensor, x)), expected, "{ticks} ticks");
        }
    }

    #[test]
    fn jittered_is_too_old_by_a_uniform_part_of_the_period_the_same_in_every_channel() {
        let mut sensor = Jittered::new(Ideal, 0.5, 4);
        let ticks = 10_000;
        let mut ages = Vec::new();
        for k in 0..ticks {
            // On straight lines any channel gives the age in periods.
            let (t, mut sample) = (f64::from(k), [0.0; 2]);
            sensor.measure(&[t, 7.0 - 2.0 * t], &mut sample);
            let age = t - sample[0];
            assert!((sample[1] - (7.0 - 2.0 * (t - age))).abs() < 1e-8);
            ages.push(age);
        }
        assert_eq!(ages[0], 0.0, "there is nothing older than the first sample");
        assert!(ages.iter().all(|age| (0.0..=0.5 + 1e-8).contains(age)));
        // Four standard deviations of a mean: 4 * 0.5/sqrt(12 * 10000) = 0.006.
        assert!((ages.iter().sum::<f64>() / f64::from(ticks) - 0.25).abs() < 0.006);
        assert!(ages.iter().any(|age| *age > 0.49) && ages[1..].iter().any(|age| *age < 0.01));
    }

    #[test]
    fn dropout_loses_whole_samples_as_often_as_stated() {
        let ticks = 10_000;
        for probability in [0.0, 0.2, 1.0] {
            let mut sensor = Dropout::new(Ideal, probability, 5);
            let mut lost = 0;
            for _ in 0..ticks {
                let mut sample = [0.0; 2];
                sensor.measure(&[1.0, 2.0], &mut sample);
                assert!(sample == [1.0, 2.0] || sample.iter().all(|value| value.is_nan()));
                lost += usize::from(sample[0].is_nan());
            }
            // Four standard deviations: 4 sqrt(p (1 - p) / ticks), none at 0 and 1.
            let slack = 4.0 * (probability * (1.0 - probability) / f64::from(ticks)).sqrt();
            assert!((lost as f64 / f64::from(ticks) - probability).abs() <= slack, "{lost} of {ticks}");
        }
    }

    #[test]
    fn the_outer_link_acts_last() {
        // With noise before the quantisation the samples are multiples of the quantum. With noise after it they are
        // not.
        let off_grid = |x: f64| (x / 0.25 - (x / 0.25).round()).abs();
        let mut converted = Quantised::new(Noise::new(Ideal, &[0.3], 1), vec![0.25]);
        let mut noisy = Noise::new(Quantised::new(Ideal, vec![0.25]), &[0.3], 1);
        assert_eq!(off_grid(measured(&mut converted, 1.1)), 0.0);
        assert!(off_grid(measured(&mut noisy, 1.1)) > 1e-3);
    }

    #[test]
    fn a_sample_lost_before_a_delay_is_missed_later() {
        let mut sensor = Delayed::new(Dropout::new(Ideal, 0.5, 9), 2);
        let mut undelayed = Dropout::new(Ideal, 0.5, 9);
        let late: Vec<bool> = (0..50).map(|_| measured(&mut sensor, 1.0).is_nan()).collect();
        let prompt: Vec<bool> = (0..50).map(|_| measured(&mut undelayed, 1.0).is_nan()).collect();
        assert_eq!(late[2..], prompt[..48]);
        assert_ne!(late[2..], prompt[2..]);
    }

    #[test]
    fn links_stack_at_run_time() {
        let mut sensor: Box<dyn Sensor> = Box::new(Ideal);
        sensor = Box::new(Delayed::new(sensor, 1));
        sensor = Box::new(Quantised::new(sensor, vec![1.0]));
        assert_eq!([0.6, 2.4].map(|x| measured(&mut sensor, x)), [1.0, 1.0]);
        assert_eq!(measured(&mut sensor, 9.0), 2.0);
    }
}
