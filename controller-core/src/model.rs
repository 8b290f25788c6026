//! The nominal model: what the controller knows of the last channel, $\dot x_n = a(x) + b(x) u + d_n$ (Eq. (39)).
//!
//! Everything in that channel is measured in units of the *reference gain* $b_0$ ([`Nominal::input_gain`]): the model
//! returns $a(x)/b_0$, and $b(x)/b_0$ where b varies. With a constant b this is why the tick needs no division: choose
//! $b_0 = b$. The true plant may differ; what the model does not say is the observers' business.
//!
//! The design is told of the same channel by a [`Nominal`], in SI units. Where a is linear it is all there is, and the
//! model is made of it ([`Controller::linear`](crate::Controller::linear)). Where it is not the two are written apart,
//! and [`Nominal::check`] holds one against the other: in a test of your own, since a `const` cannot ask a model.

use crate::assert_order;
use crate::error::{Cause, ConfigError, Field};
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
/// // m l² = 0.5: hanging down, a = -4 x_1.
/// const NOMINAL: Nominal<2> = Nominal { gradient: [-4.0, 0.0], input_gain: 2.0 };
/// assert_eq!(NOMINAL.check(&Pendulum { weight: 2.0 }, &[0.0, 0.0]), Ok(()));
/// // g in feet.
/// assert!(NOMINAL.check(&Pendulum { weight: 6.56 }, &[0.0, 0.0]).is_err());
///
/// // The controller runs it.
/// type Law = controller!(f32, Pendulum, order 2, observers of order 2 in [2]);
/// const CONFIG: Config<2, 2> = Config {
///     period_s: 1e-3,
///     surface: Surface::from_bandwidth(5.0, 2.5),
///     observers: [None, Some(ObserverGains::from_bandwidth::<2>(60.0))],
///     reaching: ReachingLaw { k_l: 30.0, k_s: 0.0, epsilon: 0.01 },
///     nominal: NOMINAL,
///     options: Options::NEUTRAL.with_limits(Limits::symmetric(6.0)),
/// };
/// static LAW: Law = Law::design(&CONFIG, Pendulum { weight: 2.0 });
/// let mut running = Running::new(&LAW);
/// // At rest at 0.5 rad u carries the weight, 2 (0.5 - 0.5³/6), and lets σ = 5 x_1 decay with α: x_2' = -2.5 · 2.5.
/// let u = running.tick(&[0.5, 0.0]).u;
/// assert!((u - (0.958 - 6.25 / 2.0)).abs() < 0.02, "{u}");
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

/// How far a model and a nominal gradient may lie apart, as a share of the larger.
const AGREED: f64 = 0.01;

impl<const N: usize> Nominal<N> {
    /// Does a model say the same near x? Its slopes there, by central differences, must be those of
    /// [`gradient`](Self::gradient) within a hundredth (and what the precision of the model leaves open: at most
    /// half of them), but for entries of 0, which say that nothing is known; b(x) must have the sign of b_0. Of a model
    /// with a large constant part ask the one in f64.
    ///
    /// # Errors
    /// The first entry that is another, with both values.
    pub fn check<T: Real, M: NominalModel<T, N>>(&self, model: &M, x: &[T; N]) -> Result<(), ConfigError> {
        let here = model.drift(x).to_f64();
        let ratio = model.gain_ratio(x).map_or(1.0, T::to_f64);
        if !(ratio > 0.0 && ratio.is_finite()) {
            return Err(ConfigError::new(Field::InputGain, Cause::GainContradicts { ratio }));
        }
        for (j, &said) in self.gradient.iter().enumerate() {
            let step = 1e-3 * (1.0 + x[j].to_f64().abs());
            let [(above, high), (below, low)] = [step, -step].map(|by| {
                let mut there = *x;
                there[j] += T::from_f64(by);
                (there[j].to_f64(), model.drift(&there).to_f64() * self.input_gain)
            });
            let found = (high - low) / (above - below);
            let rounding = if T::WORDS == 1 { 1e-6 } else { 1e-14 } * high.abs().max(low.abs()) / step;
            let size = found.abs().max(said.abs());
            // False of a model that is not a number there, and of one that says nothing in this precision.
            let agrees = rounding <= 0.5 * size && (found - said).abs() <= AGREED * size + rounding;
            if !(here.is_finite() && found.is_finite()) || (said != 0.0 && !agrees) {
                return Err(ConfigError::new(
                    Field::Gradient,
                    Cause::GradientContradicts { state: j + 1, said, found },
                ));
            }
        }
        Ok(())
    }
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
