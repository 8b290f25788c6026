//! Vectorised sensor chain: the links of [`sensor`](crate::sensor), with a separate seed for each lane.

use std::collections::VecDeque;

use super::wide::Wide;
use super::{Instructions, LANES, Trial};
use crate::MAX_ORDER;
use crate::philox::{self, Purpose};
use crate::port::in_process::padded;
use crate::sensor::Sensing;

/// Sensor chain of all lanes.
pub(super) struct Sensors<'a, const N: usize> {
    instructions: Instructions,
    sensing: &'a Sensing,
    /// Low and high halves of the seeds.
    seeds: [Wide<u32>; 2],
    tick: u64,
    /// Buffers of the link at work: two random words, a radius, and the unused noise of an odd channel.
    words: [Wide<u64>; 2],
    radius: Wide,
    beyond: Wide,
    /// Previous states, for jitter.
    last: Option<Box<[Wide; N]>>,
    under_way: VecDeque<Box<[Wide; N]>>,
}

impl<'a, const N: usize> Sensors<'a, N> {
    pub(super) fn new(instructions: Instructions, sensing: &'a Sensing, trials: &[Trial<'_>]) -> Self {
        // Lanes beyond the last trial copy the first.
        let halves = |l: usize| philox::halves(trials.get(l).unwrap_or(&trials[0]).seed);
        let seeds = [0, 1].map(|half| Wide(std::array::from_fn(|l| halves(l)[half])));
        Self {
            instructions,
            sensing,
            seeds,
            tick: 0,
            words: [Wide::of_all(0); 2],
            radius: Wide::of_all(0.0),
            beyond: Wide::of_all(0.0),
            last: None,
            under_way: VecDeque::new(),
        }
    }

    /// Returns true if the controller receives the state itself.
    pub(super) fn is_ideal(&self) -> bool {
        *self.sensing == Sensing::IDEAL
    }

    /// Computes the samples of a tick. Call it once per tick.
    pub(super) fn measure(&mut self, x: &[Wide; N], sample: &mut Box<[Wide; N]>) {
        let Self { instructions, sensing, ref seeds, tick, .. } = *self;
        let Self { words: [word, other], radius, beyond, .. } = self;
        **sample = *x;
        self.tick += 1;
        if sensing.jitter > 0.0 {
            words_all(instructions, seeds, tick, Purpose::Jitter, 0, word, other);
            let now = sample.clone();
            let last = self.last.replace(now).unwrap_or_else(|| sample.clone());
            for l in 0..LANES {
                let age = sensing.jitter * philox::uniform(word[l]);
                for (sample, last) in sample.iter_mut().zip(last.iter()) {
                    sample[l] -= age * (sample[l] - last[l]);
                }
            }
        }
        let sigma: [f64; MAX_ORDER] = padded(&sensing.noise);
        for (pair, (samples, sigma)) in (0..).zip(sample.chunks_mut(2).zip(sigma.chunks(2))) {
            if sensing.noise.is_empty() {
                break;
            }
            let (first, second) = match samples {
                [first, second] => (first, second),
                [first, ..] => (first, &mut *beyond),
                [] => break,
            };
            words_all(instructions, seeds, tick, Purpose::Noise, pair, word, other);
            radius_all(instructions, word, radius);
            noise_all(instructions, radius, other, [sigma[0], sigma[1]], first, second);
        }
        for (sample, &quantum) in sample.iter_mut().zip(&sensing.quantum).filter(|(_, quantum)| **quantum > 0.0) {
            for l in 0..LANES {
                sample[l] = quantum * libm::round(sample[l] / quantum);
            }
        }
        if sensing.delay_ticks > 0 {
            self.under_way.push_back(sample.clone());
            let oldest = if self.under_way.len() > sensing.delay_ticks { self.under_way.pop_front() } else { None };
            if let Some(arrived) = oldest.or_else(|| self.under_way.front().cloned()) {
                *sample = arrived;
            }
        }
        if sensing.dropout > 0.0 {
            words_all(instructions, seeds, tick, Purpose::Dropout, 0, word, other);
            for l in 0..LANES {
                if philox::uniform(word[l]) < sensing.dropout {
                    sample.iter_mut().for_each(|sample| sample[l] = f64::NAN);
                }
            }
        }
    }
}

vectorised! {
    fn words_all[;](
        seeds: &[Wide<u32>; 2],
        tick: u64,
        purpose: Purpose,
        pair: u32,
        first: &mut Wide<u64>,
        second: &mut Wide<u64>,
    ) {
        for l in 0..LANES {
            let words = philox::noise([seeds[0][l], seeds[1][l]], tick, purpose, pair);
            first[l] = words[0];
            second[l] = words[1];
        }
    }
}

// Noise takes three loops: words, radius and direction. In one loop the chain of dependent operations is too long to
// overlap two vectors, and its constants do not fit into the registers.
vectorised! {
    fn radius_all[;](word: &Wide<u64>, radius: &mut Wide,) {
        for l in 0..LANES {
            radius[l] = philox::radius(word[l]);
        }
    }
}

vectorised! {
    /// Scales two random numbers as [`philox::gaussians`] computes them.
    fn noise_all[;](radius: &Wide, word: &Wide<u64>, sigma: [f64; 2], first: &mut Wide, second: &mut Wide,) {
        for l in 0..LANES {
            let (sin, cos) = philox::direction(word[l]);
            first[l] += sigma[0] * (radius[l] * cos);
            second[l] += sigma[1] * (radius[l] * sin);
        }
    }
}
