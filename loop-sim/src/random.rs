//! Random numbers that are fixed by a seed.
//!
//! They come from the cipher ChaCha8 with the seed as its key. A Gaussian uses the formula of Box and Muller with
//! `libm`. So nothing depends on how a version of a random-number crate samples or seeds.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Stream of random numbers.
#[derive(Clone, Debug)]
pub struct Random(ChaCha8Rng);

impl Random {
    /// Returns a stream of ChaCha8 with the key `seed`, little endian, padded with zeros. Streams of one seed are
    /// independent.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        let mut generator = ChaCha8Rng::from_seed(key);
        generator.set_stream(stream);
        Self(generator)
    }

    /// Returns a uniform number in (0, 1], in steps of 2^-53. Its logarithm is finite.
    pub fn uniform(&mut self) -> f64 {
        ((self.0.next_u64() >> 11) + 1) as f64 / 9_007_199_254_740_992.0
    }

    /// Returns a Gaussian number with mean 0 and standard deviation 1, by Box and Muller.
    pub fn gaussian(&mut self) -> f64 {
        let radius = libm::sqrt(-2.0 * libm::log(self.uniform()));
        radius * libm::cos(core::f64::consts::TAU * self.uniform())
    }
}
