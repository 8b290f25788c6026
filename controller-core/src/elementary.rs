//! Elementary functions for nominal models, with the same bits on every machine.
//!
//! The functions of a platform differ between machines in the last bit, so this crate never uses them. A backend is a
//! type: the choice is visible in the controller's type and costs nothing.
//!
//! | e^x in `f32` | largest relative error on [-10, 10] | infinite from | underflow |
//! |---|---|---|---|
//! | [`Libm`] | 7.4e-8 (0.6 of the spacing of `f32` at 1) | 88.72284 | gradual, 0 below -103.98 |
//! | [`Micromath`] | 2.4e-3 (7.6e-4 for x > 0) | 88.72284 | no digit right below -87.34, 0 below -88.1 |
//!
//! Tests: `libm_exp_is_as_accurate_as_documented`, `micromath_exp_is_as_accurate_as_documented` and
//! `exp_ends_in_infinity_and_zero`. An error of e^x in a(x) is a matched disturbance. The observer of channel n
//! estimates it with all others. The error of `Micromath` jumps at multiples of ln 2 and at ±1, and so does that
//! disturbance.

/// Backend that computes e^x.
pub trait Exp<T> {
    /// Returns e^x for any x. It overflows to infinity, which the guard of the tick rejects, and underflows to 0. A NaN
    /// stays a NaN.
    fn exp(x: T) -> T;
}

/// Backend of the `libm` crate: within 1 ulp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Libm;

impl Exp<f32> for Libm {
    #[inline]
    fn exp(x: f32) -> f32 {
        libm::expf(x)
    }
}

impl Exp<f64> for Libm {
    #[inline]
    fn exp(x: f64) -> f64 {
        libm::exp(x)
    }
}

/// Backend of the `micromath` crate: four terms of a series, no table, f32 only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Micromath;

impl Micromath {
    /// Overflow limit 128 ln 2: from here on e^x exceeds the largest `f32`.
    const OVERFLOW: f32 = 88.722_84;
}

impl Exp<f32> for Micromath {
    #[inline]
    fn exp(x: f32) -> f32 {
        // micromath returns infinity for a NaN, and fails its own assertion just above the limit.
        if x < Self::OVERFLOW { micromath::F32(x).exp().0 } else { x + f32::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    /// Returns the largest relative error over [from, to] at intervals of 1e-5.
    fn largest_error(exp: impl Fn(f32) -> f32, from: i32, to: i32) -> f64 {
        (from * 100_000..=to * 100_000)
            .map(|step| step as f32 * 1e-5)
            .map(|x| (f64::from(exp(x)) / f64::from(x).exp() - 1.0).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn libm_exp_is_as_accurate_as_documented() {
        let single = largest_error(Libm::exp, -10, 10);
        assert!((7.3e-8..7.45e-8).contains(&single), "{single:e}");
        let double = (-1_000_000..=1_000_000)
            .map(|step| f64::from(step) * 1e-5)
            .map(|x| (Libm::exp(x) / x.exp() - 1.0).abs())
            .fold(0.0, f64::max);
        // The reference itself is accurate to 1 ulp.
        assert!(double <= 2.0 * f64::EPSILON, "{double:e}");
    }

    #[test]
    fn micromath_exp_is_as_accurate_as_documented() {
        let all = largest_error(Micromath::exp, -10, 10);
        assert!((2.35e-3..2.45e-3).contains(&all), "{all:e}");
        let positive = largest_error(Micromath::exp, 0, 10);
        assert!((7.0e-4..8.0e-4).contains(&positive), "{positive:e}");
    }

    #[test]
    fn exp_ends_in_infinity_and_zero() {
        for exp in [Libm::exp as fn(f32) -> f32, Micromath::exp] {
            assert!(exp(f32::NAN).is_nan());
            assert_eq!(exp(0.0), 1.0);
            assert_eq!(exp(-0.0), 1.0);
            for x in [88.722_84, 88.8, 89.0, 1e3, f32::MAX, f32::INFINITY] {
                assert_eq!(exp(x), f32::INFINITY, "{x}");
            }
            for x in [-104.0, -1e3, f32::MIN, f32::NEG_INFINITY] {
                assert_eq!(exp(x), 0.0, "{x}");
            }
            // Every float between the last documented digit and the end is finite and fails no assertion of the
            // backend.
            for bits in 88.0_f32.to_bits()..88.722_84_f32.to_bits() {
                let x = f32::from_bits(bits);
                assert!(exp(x).is_finite() && exp(x) > 1e38, "{x}");
            }
            // Below the smallest normal number the result is tiny and not negative.
            for bits in 87.0_f32.to_bits()..105.0_f32.to_bits() {
                let tiny = exp(-f32::from_bits(bits));
                assert!((0.0..2e-38).contains(&tiny), "{tiny:e}");
            }
        }
        assert_eq!(Micromath::exp(-88.1), 0.0);
        assert!(Libm::exp(-103.97_f32) > 0.0);
        assert_eq!(Libm::exp(-103.98_f32), 0.0);
        assert!(Libm::exp(f64::NAN).is_nan());
        assert_eq!((Libm::exp(710.0_f64), Libm::exp(-746.0_f64)), (f64::INFINITY, 0.0));
    }
}
