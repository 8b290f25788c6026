//! Counter-based random numbers: Philox4x32-10 of Salmon, Moraes, Dror and Shaw, "Parallel random numbers: as easy as
//! 1, 2, 3", SC 2011.
//!
//! A block is a function of a counter (four words) and a key (two words), without memory. It applies ten rounds of
//!
//! ```text
//! (c_0, c_1, c_2, c_3) -> (hi(M_1 c_2) ^ c_1 ^ k_0, lo(M_1 c_2), hi(M_0 c_0) ^ c_3 ^ k_1, lo(M_0 c_0))
//! ```
//!
//! and adds W_0, W_1 to the keys between two rounds. So the draw of trial i for its parameter p depends only on the
//! master seed, i and p. Any number of threads, in any order, on any machines, draws the same numbers. The noise of a
//! sensor depends only on seed, tick and channel ([`noise`]), so a run has the same noise alone and in a batch.
//!
//! A block costs twenty multiplications. A pair of Gaussians costs one more logarithm, sine and cosine, computed with
//! `+ - * /` and a root. There is no branch, so a loop over many runs becomes vector code with the bits of each run
//! alone.

use crate::sine::sin_cos;

const M: [u32; 2] = [0xD251_1F53, 0xCD9E_8D57];
const W: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];

/// Purpose of the random numbers of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Noise of a pair of channels.
    Noise = 1,
    /// Loss of a sample.
    Dropout = 2,
    /// Age of a sample.
    Jitter = 3,
}

/// Returns the block of a counter under a key.
///
/// Words are in the low halves of 64 bits, with anything above them. Only the low half is multiplied, which is free on
/// vector units. Narrowing and widening costs as much as the rest of a round.
#[inline(always)]
pub const fn block(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    const LOW: u64 = u32::MAX as u64;
    let [mut c0, mut c1, mut c2, mut c3] = [counter[0] as u64, counter[1] as u64, counter[2] as u64, counter[3] as u64];
    let [mut k0, mut k1] = key;
    let mut round = 0;
    while round < 10 {
        let (a, b) = (M[0] as u64 * (c0 & LOW), M[1] as u64 * (c2 & LOW));
        (c0, c1, c2, c3) = (b >> 32 ^ c1 ^ k0 as u64, b, a >> 32 ^ c3 ^ k1 as u64, a);
        (k0, k1) = (k0.wrapping_add(W[0]), k1.wrapping_add(W[1]));
        round += 1;
    }
    [c0 as u32, c1 as u32, c2 as u32, c3 as u32]
}

/// Returns two words of 64 bits for a parameter of a trial, under a master seed.
pub const fn draw(seed: u64, trial: u64, parameter: u32) -> [u64; 2] {
    words(block([trial as u32, (trial >> 32) as u32, parameter, 0], halves(seed)))
}

/// Returns two words of 64 bits for a tick of a run with this seed. For noise, `pair` is the pair of channels, from 0.
///
/// The seed is in the counter, so that many runs in a batch share the keys of the rounds.
#[inline(always)]
pub const fn noise(seed: [u32; 2], tick: u64, purpose: Purpose, pair: u32) -> [u64; 2] {
    words(block([tick as u32, pair, seed[0], seed[1]], [(tick >> 32) as u32, purpose as u32]))
}

/// Returns the two halves of a seed.
pub const fn halves(seed: u64) -> [u32; 2] {
    [seed as u32, (seed >> 32) as u32]
}

#[inline(always)]
const fn words([a, b, c, d]: [u32; 4]) -> [u64; 2] {
    [a as u64 | (b as u64) << 32, c as u64 | (d as u64) << 32]
}

/// Converts a word to a uniform number in [0, 1), in steps of 2^-53.
pub const fn uniform(word: u64) -> f64 {
    (word >> 11) as f64 / 9_007_199_254_740_992.0
}

/// Converts two words to two independent numbers of mean 0 and standard deviation 1, by the method of Box and Muller.
#[inline(always)]
pub fn gaussians(words: [u64; 2]) -> [f64; 2] {
    let radius = radius(words[0]);
    let (sin, cos) = direction(words[1]);
    [radius * cos, radius * sin]
}

/// Returns the distance of the two [`gaussians`] from 0.
#[inline(always)]
pub(crate) fn radius(word: u64) -> f64 {
    // The argument is in (0, 1], where the logarithm is finite.
    (-2.0 * log(2.0 - one_to_two(word))).sqrt()
}

/// Returns the direction of the two [`gaussians`]: sine and cosine.
#[inline(always)]
pub(crate) fn direction(word: u64) -> (f64, f64) {
    sin_cos(core::f64::consts::TAU * (one_to_two(word) - 1.0))
}

/// Returns a number in [1, 2) whose fraction is 52 bits of the word. Not every vector unit can convert integers.
#[inline(always)]
fn one_to_two(word: u64) -> f64 {
    f64::from_bits(word >> 12 | 0x3ff0_0000_0000_0000)
}

/// Returns log x for x from 2^-52 to 1, with the kernel of fdlibm. The relative error is below 1.2e-16 (test below).
#[inline(always)]
#[allow(clippy::excessive_precision)]
fn log(x: f64) -> f64 {
    const HALF_ROOT: u64 = 0x3fe6_a09e_667f_3bcd;
    const FRACTION: u64 = 0x000f_ffff_ffff_ffff;
    // x = 2^k m with m from sqrt(1/2) to sqrt(2).
    let shifted = x.to_bits().wrapping_add(0x3ff0_0000_0000_0000 - HALF_ROOT);
    let m = f64::from_bits((shifted & FRACTION).wrapping_add(HALF_ROOT));
    // k goes into the last bits of 1.5 * 2^52, which also avoids a conversion.
    let k = f64::from_bits((shifted >> 52).wrapping_sub(1023).wrapping_add(0x4338_0000_0000_0000))
        - f64::from_bits(0x4338_0000_0000_0000);
    let f = m - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let even =
        w * (3.999_999_999_940_941_908e-1 + w * (2.222_219_843_214_978_396e-1 + w * 1.531_383_769_920_937_332e-1));
    let odd = z
        * (6.666_666_666_666_735_130e-1
            + w * (2.857_142_874_366_239_149e-1
                + w * (1.818_357_216_161_805_012e-1 + w * 1.479_819_860_511_658_591e-1)));
    let half = 0.5 * f * f;
    s * (half + odd + even) + k * 1.908_214_929_270_587_700_02e-10 - half + f + k * 6.931_471_803_691_238_164_90e-1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_answers_come_out() {
        // `kat_vectors` of the authors' library Random123: counters and keys of zeros, of ones, of the digits of pi.
        let ones = u32::MAX;
        let cases = [
            ([0; 4], [0; 2], [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]),
            ([ones; 4], [ones; 2], [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]),
            (
                [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
                [0xa409_3822, 0x299f_31d0],
                [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1],
            ),
        ];
        for (counter, key, expected) in cases {
            assert_eq!(block(counter, key), expected, "{counter:08x?} under {key:08x?}");
        }
    }

    #[test]
    fn uniform_and_gaussian_have_their_moments() {
        let trials = 40_000_u32;
        let mean = |f: &dyn Fn(u64) -> f64| (0..trials.into()).map(f).sum::<f64>() / f64::from(trials);
        let of = |trial| uniform(draw(7, trial, 3)[0]);
        // Four standard deviations of a mean of 40000: uniform 4/sqrt(12 * 40000) = 0.0058, a product of two 0.0058
        // around 1/4, a normal number 0.02, its square 0.03, its fourth power 0.2.
        assert!((mean(&of) - 0.5).abs() < 0.0058);
        let next = |trial| uniform(draw(7, trial + 1, 3)[0]);
        let other = |trial| uniform(draw(7, trial, 4)[0]);
        assert!((mean(&|trial| of(trial) * next(trial)) - 0.25).abs() < 0.0058, "trials are coupled");
        assert!((mean(&|trial| of(trial) * other(trial)) - 0.25).abs() < 0.0058, "parameters are coupled");
        for k in [0, 1] {
            let normal = |trial| gaussians(draw(7, trial, 3))[k];
            assert!(mean(&normal).abs() < 0.02);
            assert!((mean(&|trial| normal(trial).powi(2)) - 1.0).abs() < 0.03);
            assert!((mean(&|trial| normal(trial).powi(4)) - 3.0).abs() < 0.2);
        }
        let both = |trial| gaussians(draw(7, trial, 3)).into_iter().product();
        assert!(mean(&both).abs() < 0.02, "the two are coupled");
    }

    #[test]
    fn the_logarithm_is_that_of_libm() {
        let least = f64::EPSILON;
        for k in 0..1_000_000_u64 {
            let [word, _] = draw(3, k, 1);
            for x in [1.0 - uniform(word), least.powf(uniform(word)), 1.0 - least * (k as f64)] {
                let (ours, theirs) = (log(x), libm::log(x));
                assert!((ours - theirs).abs() <= 2.3e-16 * theirs.abs(), "{x:e}: {ours:e} {theirs:e}");
            }
        }
        assert_eq!((log(1.0), log(least)), (0.0, libm::log(least)));
    }

    #[test]
    fn gaussians_are_those_of_the_formula_with_libm() {
        for k in 0..100_000 {
            let [a, b] = draw(9, k, 1);
            let part = |word: u64| (word >> 12) as f64 / 4_503_599_627_370_496.0;
            let radius = libm::sqrt(-2.0 * libm::log(1.0 - part(a)));
            let angle = core::f64::consts::TAU * part(b);
            for (ours, theirs) in gaussians([a, b]).into_iter().zip([libm::cos(angle), libm::sin(angle)]) {
                assert!((ours - radius * theirs).abs() < 4e-15, "{ours:e} {:e}", radius * theirs);
            }
        }
    }
}
