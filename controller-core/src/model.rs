//! The nominal model: what the controller knows of the last channel, $\dot x_n = a(x) + b(x) u + d_n$ (Eq. (39)).
//!
//! Everything in that channel is measured in units of the *reference gain* $b_0$ ([`Nominal::input_gain`]): the model
//! returns $a(x)/b_0$, and $b(x)/b_0$ where b varies. With a constant b this is why the tick needs no division: choose
//! $b_0 = b$. The true plant may differ; what the model does not say is the observers' business.

use crate::assert_order;
use crate::real::Real;

/// a(x) and b(x) in units of b_0. A model is `Copy`, so that a design with it can lie in a `const`; what is large is
/// held by reference.
///
/// ```
/// use controller_core::*;
///
/// /// A pendulum: x_2' = -g/l sin x_1 + u/(m l²), with b_0 = 1/(m l²).
/// #[derive(Clone, Copy)]
/// struct Pendulum {
///     weight: f32, // m g l, the torque that holds it level
/// }
///
/// impl NominalModel<f32, 2> for Pendulum {
///     fn drift(&self, x: &[f32; 2]) -> f32 {
///         // Near the bottom; what the series leaves out, the observer of channel 2 estimates.
///         let angle = x[0];
///         -self.weight * (angle - angle * angle * angle * (1.0 / 6.0))
///     }
/// }
///
/// assert_eq!(Pendulum { weight: 2.0 }.drift(&[0.0, 1.0]), 0.0);
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no model of a plant of order {N} in `{T}`",
    label = "needs `NominalModel<{T}, {N}>`",
    note = "write `impl NominalModel<{T}, {N}> for ..` with its a(x)/b_0, or take `Linear<{T}, {N}>`; the model, the \
            controller's type and `Nominal` must name one order and one precision"
)]
pub trait NominalModel<T: Real, const N: usize>: Copy {
    /// a(x)/b_0: the drift of channel n in units of u.
    fn drift(&self, x: &[T; N]) -> T;

    /// b(x)/b_0, or `None` if b is b_0 always (then it costs nothing). A varying b costs one division per tick.
    #[inline(always)]
    fn gain_ratio(&self, x: &[T; N]) -> Option<T> {
        let _ = x;
        None
    }
}

impl<T: Real, M: NominalModel<T, N>, const N: usize> NominalModel<T, N> for &M {
    #[inline(always)]
    fn drift(&self, x: &[T; N]) -> T {
        M::drift(self, x)
    }

    #[inline(always)]
    fn gain_ratio(&self, x: &[T; N]) -> Option<T> {
        M::gain_ratio(self, x)
    }
}

/// What the design knows of the nominal last channel, in f64.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Nominal<const N: usize> {
    /// ∂a/∂x_1 .. ∂a/∂x_n, zero where unknown; a is in the unit of x_n per second, so entry i is in s^-(n-i+1). The
    /// last one is -λ, the slope, 1/s: if it is uncertain give the smaller |λ| (half is harmless, double destabilises).
    pub gradient: [f64; N],
    /// b_0: the constant b, or a reference value of b(x), in the unit of x_n per second and per unit of u. Never 0.
    pub input_gain: f64,
}

/// A linear a(x) with constant b: [`Nominal`] is all there is to know.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(transparent)]
pub struct Linear<T, const N: usize> {
    row: [T; N],
}

macro_rules! linear {
    ($($t:ty),*) => {$(
        impl<const N: usize> Linear<$t, N> {
            /// a(x) = gradient . x, rounded once from f64.
            pub const fn new(nominal: &Nominal<N>) -> Self {
                const { assert_order(N) };
                let mut row = [0.0; N];
                let mut i = 0;
                while i < N {
                    row[i] = (nominal.gradient[i] / nominal.input_gain) as $t;
                    i += 1;
                }
                Self { row }
            }
        }
    )*};
}
linear!(f32, f64);

impl<T: Real, const N: usize> Linear<T, N> {
    /// From the row of a(x)/b_0 itself.
    pub const fn from_row(row: [T; N]) -> Self {
        const { assert_order(N) };
        Self { row }
    }

    /// The row of a(x)/b_0.
    pub const fn row(&self) -> &[T; N] {
        &self.row
    }
}

impl<T: Real, const N: usize> NominalModel<T, N> for Linear<T, N> {
    #[inline(always)]
    fn drift(&self, x: &[T; N]) -> T {
        let mut sum = self.row[0] * x[0];
        for j in 1..N {
            sum += self.row[j] * x[j];
        }
        sum
    }
}
