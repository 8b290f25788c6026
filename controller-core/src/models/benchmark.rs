//! Nonlinear benchmark of Example 1, Eq. (59): $\dot x_1 = x_2 + d_1$, $\dot x_2 = -2x_1 - x_2 + e^{x_1} + u$.

use core::marker::PhantomData;

use crate::elementary::Exp;
use crate::model::{Nominal, NominalModel};
use crate::real::Real;

/// Model a(x) = -2 x_1 - x_2 + e^{x_1}, b = 1.
///
/// `E` computes the exponential: [`Libm`](crate::Libm) or [`Micromath`](crate::Micromath). Design the controller with
/// [`Benchmark::nominal`], whose b_0 is 1. The paper gives no units: x_1 is dimensionless, time is in s, u in 1/s².
/// Above x_1 = 27.6, e^{x_1} alone exceeds [`INPUT_LIMIT`](crate::INPUT_LIMIT), and the sample is rejected.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Benchmark<E>(PhantomData<E>);

impl<E> Benchmark<E> {
    /// Returns the model, which has no parameters.
    pub const fn new() -> Self {
        Self(PhantomData)
    }

    /// Returns the nominal channel. The slope -1 is exact. The gradient in x_1 depends on x_1 and is left to the
    /// observers.
    pub const fn nominal() -> Nominal<2> {
        Nominal { gradient: [0.0, -1.0], input_gain: 1.0 }
    }
}

impl<T: Real, E: Exp<T> + Copy> NominalModel<T, 2> for Benchmark<E> {
    #[inline(always)]
    fn drift(&self, x: &[T; 2]) -> T {
        E::exp(x[0]) - (x[0] + x[0]) - x[1]
    }
}
