//! Random numbers by counter: Philox4x32-10 of Salmon, Moraes, Dror and Shaw, "Parallel random numbers: as easy as
//! 1, 2, 3", SC 2011.
//!
//! A block is a function of a counter (four words) and a key (two), without memory: ten rounds of
//!
//! ```text
//! (c_0, c_1, c_2, c_3) -> (hi(M_1 c_2) ^ c_1 ^ k_0, lo(M_1 c_2), hi(M_0 c_0) ^ c_3 ^ k_1, lo(M_0 c_0))
//! ```
//!
//! with the keys raised by W_0, W_1 between two rounds. What trial i draws for its parameter p therefore depends on
//! master seed, i and p alone: any number of threads, in any order, on any machines, draws the same. A block costs
//! twenty multiplications.

const M: [u32; 2] = [0xD251_1F53, 0xCD9E_8D57];
const W: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];

/// The block of a counter under a key.
pub const fn block(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    let ([mut c0, mut c1, mut c2, mut c3], [mut k0, mut k1]) = (counter, key);
    let mut round = 0;
    while round < 10 {
        let (a, b) = (M[0] as u64 * c0 as u64, M[1] as u64 * c2 as u64);
        (c0, c1, c2, c3) = ((b >> 32) as u32 ^ c1 ^ k0, b as u32, (a >> 32) as u32 ^ c3 ^ k1, a as u32);
        (k0, k1) = (k0.wrapping_add(W[0]), k1.wrapping_add(W[1]));
        round += 1;
    }
    [c0, c1, c2, c3]
}

/// Two words of 64 bits for a trial's parameter, under a master seed.
pub const fn draw(seed: u64, trial: u64, parameter: u32) -> [u64; 2] {
    let [a, b, c, d] = block([trial as u32, (trial >> 32) as u32, parameter, 0], [seed as u32, (seed >> 32) as u32]);
    [a as u64 | (b as u64) << 32, c as u64 | (d as u64) << 32]
}

/// Uniform in [0, 1), in steps of 2^-53.
pub const fn uniform(word: u64) -> f64 {
    (word >> 11) as f64 / 9_007_199_254_740_992.0
}

/// Mean 0, standard deviation 1, of two words: Box and Muller.
pub fn gaussian([radius, angle]: [u64; 2]) -> f64 {
    // From (0, 1], which has a logarithm.
    let radius = libm::sqrt(-2.0 * libm::log(1.0 - uniform(radius)));
    radius * libm::cos(core::f64::consts::TAU * uniform(angle))
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
        // Four standard deviations of a mean of 40000: of uniform 4/sqrt(12 * 40000) = 0.0058, of a product of two
        // that much around 1/4, of a normal number 0.02, of its square 0.03, of its fourth power 0.2.
        assert!((mean(&of) - 0.5).abs() < 0.0058);
        let next = |trial| uniform(draw(7, trial + 1, 3)[0]);
        let other = |trial| uniform(draw(7, trial, 4)[0]);
        assert!((mean(&|trial| of(trial) * next(trial)) - 0.25).abs() < 0.0058, "trials are coupled");
        assert!((mean(&|trial| of(trial) * other(trial)) - 0.25).abs() < 0.0058, "parameters are coupled");
        let normal = |trial| gaussian(draw(7, trial, 3));
        assert!(mean(&normal).abs() < 0.02);
        assert!((mean(&|trial| normal(trial).powi(2)) - 1.0).abs() < 0.03);
        assert!((mean(&|trial| normal(trial).powi(4)) - 3.0).abs() < 0.2);
    }
}
