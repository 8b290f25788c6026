//! A measuring chain over lanes: what the links of [`sensor`](crate::sensor) do, each lane with a seed of its own.

use std::collections::VecDeque;

use super::wide::Wide;
use super::{Instructions, LANES, Trial};
use crate::philox::{self, Purpose};
use crate::sensor::Sensing;

/// The chain.
pub(super) struct Sensors<'a, const N: usize> {
    instructions: Instructions,
    sensing: &'a Sensing,
    /// Philox keys, word by word.
    keys: [Wide<u32>; 2],
    tick: u64,
    /// What jitter looks back to.
    last: Option<Box<[Wide; N]>>,
    under_way: VecDeque<Box<[Wide; N]>>,
}

impl<'a, const N: usize> Sensors<'a, N> {
    pub(super) fn new(instructions: Instructions, sensing: &'a Sensing, trials: &[Trial<'_>]) -> Self {
        // Lanes beyond the last are like the first.
        let key = |l: usize| philox::key(trials.get(l).unwrap_or(&trials[0]).seed);
        let keys = [0, 1].map(|word| Wide(std::array::from_fn(|l| key(l)[word])));
        Self { instructions, sensing, keys, tick: 0, last: None, under_way: VecDeque::new() }
    }

    /// Does the law see the state itself?
    pub(super) fn is_ideal(&self) -> bool {
        *self.sensing == Sensing::IDEAL
    }

    /// To be called once a tick.
    pub(super) fn measure(&mut self, x: &[Wide; N], sample: &mut Box<[Wide; N]>) {
        let Self { instructions, sensing, ref keys, tick, .. } = *self;
        **sample = *x;
        self.tick += 1;
        if sensing.jitter > 0.0 {
            let mut word = Wide::of_all(0);
            words_all(instructions, keys, tick, Purpose::Jitter, &mut word);
            let now = sample.clone();
            let last = self.last.replace(now).unwrap_or_else(|| sample.clone());
            for l in 0..LANES {
                let age = sensing.jitter * philox::uniform(word[l]);
                for (sample, last) in sample.iter_mut().zip(last.iter()) {
                    sample[l] -= age * (sample[l] - last[l]);
                }
            }
        }
        for (pair, (samples, sigma)) in (0..).zip(sample.chunks_mut(2).zip(sensing.noise.chunks(2))) {
            let mut gaussians = [Wide::of_all(0.0); 2];
            gaussians_all(instructions, keys, tick, pair, &mut gaussians);
            for ((sample, sigma), gaussians) in samples.iter_mut().zip(sigma).zip(&gaussians) {
                add_all(instructions, sample, *sigma, gaussians);
            }
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
            let mut word = Wide::of_all(0);
            words_all(instructions, keys, tick, Purpose::Dropout, &mut word);
            for l in 0..LANES {
                if philox::uniform(word[l]) < sensing.dropout {
                    sample.iter_mut().for_each(|sample| sample[l] = f64::NAN);
                }
            }
        }
    }
}

vectorised! {
    fn words_all[;](keys: &[Wide<u32>; 2], tick: u64, purpose: Purpose, word: &mut Wide<u64>,) {
        for l in 0..LANES {
            word[l] = philox::noise([keys[0][l], keys[1][l]], tick, purpose, 0)[0];
        }
    }
}

vectorised! {
    fn gaussians_all[;](keys: &[Wide<u32>; 2], tick: u64, pair: u32, gaussians: &mut [Wide; 2],) {
        let [first, second] = gaussians;
        for l in 0..LANES {
            let words = philox::noise([keys[0][l], keys[1][l]], tick, Purpose::Noise, pair);
            [first[l], second[l]] = philox::gaussians(words);
        }
    }
}

vectorised! {
    fn add_all[;](sample: &mut Wide, sigma: f64, gaussians: &Wide,) {
        for l in 0..LANES {
            sample[l] += sigma * gaussians[l];
        }
    }
}
