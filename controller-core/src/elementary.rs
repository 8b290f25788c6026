//! Elementary functions for nominal models: never the platform's, which differs between machines in the last bit.
//!
//! A backend is a type, so that the choice is visible in the controller's type and costs nothing.

/// e^x.
pub trait Exp<T> {
    /// e^x for any x: overflows to infinity (which the tick's guard rejects) and underflows to 0.
    fn exp(x: T) -> T;
}

/// The `libm` crate: within 1 ulp.
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

/// The `micromath` crate: a few instructions, f32 only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Micromath;

impl Exp<f32> for Micromath {
    #[inline]
    fn exp(x: f32) -> f32 {
        micromath::F32(x).exp().0
    }
}
