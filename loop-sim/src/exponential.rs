//! Branchless exponentials and hyperbolic tangent, so that a loop over many values becomes vector code. The friction of
//! a motor needs two of the functions, Example 1 the others.
//!
//! [`exp`] and [`expf`] are bit-identical to `libm`. They do the operations of `libm` in its order, with a selection of
//! values in place of each branch. The friction uses
//!
//! $$ e^x - 1 = (2^k - 1) + 2^k (e^r - 1), \qquad x = k \ln 2 + r, \quad |r| \le \tfrac12 \ln 2 $$
//!
//! with the series of $e^r - 1$ up to $r^{13}$, whose remainder is below 1e-17 of the sum. Near 0, k is 0 and no digits
//! cancel. Both functions are within 2.3e-16 of the true value (test below). They are not bit-identical to `libm`,
//! which has branches.

use controller_core::Exp;

use crate::sine::WHOLE;

/// Coefficients 1/2!, 1/3!, .. 1/13!.
const INVERSE_FACTORIALS: [f64; 12] = inverse_factorials();

const fn inverse_factorials() -> [f64; 12] {
    let mut inverses = [0.5; 12];
    // Integers up to 13! are exact in f64.
    let (mut factorial, mut k) = (2.0, 1);
    while k < 12 {
        factorial *= (k + 2) as f64;
        inverses[k] = 1.0 / factorial;
        k += 1;
    }
    inverses
}

/// Returns e^x, bit-identical to `libm::exp`, for |x| up to [`LARGEST`].
#[inline(always)]
#[allow(clippy::excessive_precision)]
pub fn exp(x: f64) -> f64 {
    const ONE: u64 = 1023;
    // fdlibm compares upper words: 1.5 ln 2, 0.5 ln 2 and 2^-28.
    let (far, near, tiny) = (0x3ff0_a2b2 << 32, 0x3fd6_2e43 << 32, 0x3e30_0001 << 32);
    let size = x.abs().to_bits();
    let scaled = core::f64::consts::LOG2_E * x + 0.5_f64.copysign(x);
    let nearest = (scaled + WHOLE) - WHOLE;
    let cut = if nearest.abs() > scaled.abs() { nearest - 1.0_f64.copysign(x) } else { nearest };
    let one_or_none = if size >= near { 1.0_f64.copysign(x) } else { 0.0 };
    let k = if size >= far { cut } else { one_or_none };
    let (high, low) = (x - k * 6.931_471_803_691_238_164_90e-1, k * 1.908_214_929_270_587_700_02e-10);
    let r = high - low;
    let z = r * r;
    let c = r - z
        * (1.666_666_666_666_660_190_37e-1
            + z * (-2.777_777_777_701_559_338_42e-3
                + z * (6.613_756_321_437_934_361_17e-5
                    + z * (-1.653_390_220_546_525_153_90e-6 + z * 4.138_136_797_057_238_460_39e-8))));
    let y = 1.0 + (r * c / (2.0 - c) - low + high);
    let power = f64::from_bits((k + WHOLE).to_bits().wrapping_add(ONE) << 52);
    if size >= tiny { y * power } else { 1.0 + x }
}

/// Largest |x| for which 2^k is a normal f64.
pub const LARGEST: f64 = 700.0;

/// Returns true if |x| is at most [`LARGEST`].
#[inline(always)]
#[cfg(feature = "lanes")]
pub(crate) fn is_within(x: f64) -> bool {
    x.abs() <= LARGEST
}

/// Returns e^x, bit-identical to `libm::expf`, for any x.
#[inline(always)]
#[allow(clippy::excessive_precision)]
pub fn expf(x: f32) -> f32 {
    /// 1.5 * 2^23, the f32 counterpart of the `WHOLE` of f64.
    const WHOLE: f32 = 12_582_912.0;
    const ONE: u32 = 127;
    let (far, near, tiny) = (0x3f85_1593, 0x3eb1_7219, 0x3900_0001);
    let (over, under) = (0x42b1_7218, 0x42cf_f1b5);
    let size = x.abs().to_bits();
    let scaled = core::f32::consts::LOG2_E * x + 0.5_f32.copysign(x);
    let nearest = (scaled + WHOLE) - WHOLE;
    let cut = if nearest.abs() > scaled.abs() { nearest - 1.0_f32.copysign(x) } else { nearest };
    let one_or_none = if size >= near { 1.0_f32.copysign(x) } else { 0.0 };
    let k = if size >= far { cut } else { one_or_none };
    let (high, low) = (x - k * 6.931_457_519_5e-1, k * 1.428_606_765_3e-6);
    let r = high - low;
    let z = r * r;
    let c = r - z * (1.666_662_544_0e-1 + z * -2.766_733_290_6e-3);
    let y = 1.0 + (r * c / (2.0 - c) - low + high);
    // The powers at both ends are not representable, so y gets there in two steps.
    let first = if k > 127.0 {
        127.0
    } else if k < -126.0 {
        -102.0
    } else {
        0.0
    };
    let power = |k: f32| f32::from_bits((k + WHOLE).to_bits().wrapping_add(ONE) << 23);
    let within = if size >= tiny { y * power(first) * power(k - first) } else { 1.0 + x };
    let is_negative = x < 0.0;
    let ended = if is_negative && size >= under { 0.0 } else { within };
    let ended = if !is_negative && size >= over { f32::INFINITY } else { ended };
    if x.is_nan() { x } else { ended }
}

/// Exponential [`expf`] as a type parameter of a controller.
#[derive(Clone, Copy, Debug)]
pub struct Branchless;

impl Exp<f32> for Branchless {
    #[inline(always)]
    fn exp(x: f32) -> f32 {
        expf(x)
    }
}

/// Returns e^x - 1 for x up to 0.
#[inline(always)]
#[allow(clippy::excessive_precision)]
pub fn expm1_of_negative(x: f64) -> f64 {
    const ONE: u64 = 1023;
    // Below -40 the result is -1. The comparison lets NaN through.
    let x = if x < -40.0 { -40.0 } else { x };
    let shifted = x * core::f64::consts::LOG2_E + WHOLE;
    let k = shifted - WHOLE;
    // ln 2 in two parts, as in fdlibm: products with the first part are exact.
    let r = (x - k * 6.931_471_803_691_238_164_9e-1) - k * 1.908_214_929_270_587_700_0e-10;
    let [c2, c3, c4, c5, c6, c7, c8, c9, c10, c11, c12, c13] = INVERSE_FACTORIALS;
    let z = r * r;
    let even = c2 + z * (c4 + z * (c6 + z * (c8 + z * (c10 + z * c12))));
    let odd = c3 + z * (c5 + z * (c7 + z * (c9 + z * (c11 + z * c13))));
    let p = r + z * (even + r * odd);
    let power = f64::from_bits(shifted.to_bits().wrapping_add(ONE) << 52);
    (power - 1.0) + power * p
}

/// Returns tanh x = (1 - e^(-2|x|))/(1 + e^(-2|x|)), with the sign of x.
#[inline(always)]
pub fn tanh(x: f64) -> f64 {
    let m = expm1_of_negative(-2.0 * x.abs());
    (-m / (m + 2.0)).copysign(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the sizes from 1e-300 to 100, a thousand per power of ten.
    fn sizes() -> impl Iterator<Item = f64> {
        (-300_000..2000).map(|k| 10_f64.powf(f64::from(k) * 1e-3))
    }

    #[test]
    fn they_are_those_of_libm_to_the_last_place() {
        for x in sizes() {
            let (ours, theirs) = (expm1_of_negative(-x), libm::expm1(-x));
            assert!((ours - theirs).abs() <= 3.4e-16 * theirs.abs(), "e^-{x:e} - 1: {ours:e} {theirs:e}");
            let (ours, theirs) = (tanh(-x), libm::tanh(-x));
            assert!((ours - theirs).abs() <= 5e-16 * theirs.abs(), "tanh -{x:e}: {ours:e} {theirs:e}");
            assert_eq!(tanh(x), -ours);
        }
    }

    #[test]
    fn e_to_the_x_has_the_bits_of_libm() {
        let same = |x: f64| assert_eq!(exp(x).to_bits(), libm::exp(x).to_bits(), "{x:e}");
        for x in sizes().filter(|x| *x <= LARGEST) {
            same(x);
            same(-x);
        }
        // Values around the branch points of `libm`: 2^-28, halves of ln 2, and the ends of the powers.
        for around in [0x3e30_0000_u64, 0x3fd6_2e42, 0x3ff0_a2b2] {
            for bits in ((around - 1) << 32..(around + 2) << 32).step_by(0x3_fff1) {
                same(f64::from_bits(bits));
                same(-f64::from_bits(bits));
            }
        }
        for halves in -2018..=2018 {
            let x = f64::from(halves) * 0.5 * core::f64::consts::LN_2;
            for bits in x.to_bits().saturating_sub(300)..x.to_bits() + 300 {
                same(f64::from_bits(bits));
            }
        }
        for x in [0.0, -0.0, 5e-324, LARGEST, -LARGEST] {
            same(x);
        }
    }

    /// Every 251st f32. A run over all f32 values passed once.
    #[test]
    fn e_to_the_x_in_f32_has_the_bits_of_libm_everywhere() {
        for x in (0..=u32::MAX).step_by(251).map(f32::from_bits) {
            let (ours, theirs) = (expf(x), libm::expf(x));
            assert_eq!(ours.to_bits(), theirs.to_bits(), "{x:e}: {ours:e} {theirs:e}");
        }
        for around in [0x3900_0000_u32, 0x3eb1_7218, 0x3f85_1592, 0x42ae_ac50, 0x42b1_7218, 0x42cf_f1b5, 0x7f80_0000] {
            for bits in around - 1000..around + 1000 {
                for x in [f32::from_bits(bits), -f32::from_bits(bits)] {
                    assert_eq!(expf(x).to_bits(), libm::expf(x).to_bits(), "{x:e}");
                }
            }
        }
    }

    #[test]
    fn ends_are_ends() {
        assert_eq!([0.0, -40.0, -1e9, f64::NEG_INFINITY].map(expm1_of_negative), [0.0, -1.0, -1.0, -1.0]);
        assert_eq!([0.0, 22.0, -1e300, f64::INFINITY].map(tanh), [0.0, 1.0, -1.0, 1.0]);
        assert!(tanh(-0.0).is_sign_negative() && tanh(f64::NAN).is_nan() && expm1_of_negative(f64::NAN).is_nan());
    }
}
