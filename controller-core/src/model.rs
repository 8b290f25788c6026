//! Nominal model of the last channel, $\dot x_n = a(x) + b(x) u + d_n$ (Eq. (39)).
//!
//! All terms of that channel are in units of the *reference gain* $b_0$ ([`Nominal::input_gain`]). The model returns
//! $a(x)/b_0$, and $b(x)/b_0$ if b varies. With a constant b, choose $b_0 = b$: the tick then needs no division. The
//! true plant may differ from the model. The observers estimate the difference.
//!
//! The design takes the same channel as a [`Nominal`], in SI units. For a linear a(x), [`Nominal`] is complete, and
//! [`Controller::linear`](crate::Controller::linear) builds the model from it. For a nonlinear a(x), write both and
//! compare them with [`Nominal::check`] in a test of your own. A `const` cannot evaluate a model.

use crate::assert_order;
use crate::error::{Cause, ConfigError, Field};
use crate::real::Real;

/// Nominal model a(x) and b(x), in units of b_0.
///
/// A model is `Copy`, so that a design with it can lie in a `const`. Hold large data by reference.
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
    /// Returns a(x)/b_0, the drift of channel n in units of u.
    fn drift(&self, x: &[T; N]) -> T;

    /// Returns b(x)/b_0, or `None` if b always equals b_0 (no cost). A varying b costs one division per tick.
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

/// Nominal last channel as the design reads it, in f64.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Nominal<const N: usize> {
    /// Gradient ∂a/∂x_1 .. ∂a/∂x_n, with zero for unknown entries. The unit of a is the unit of x_n per second, so
    /// entry i is in s^-(n-i+1). The last entry is -λ, the slope, 1/s. If the slope is uncertain, give the smaller |λ|:
    /// half is harmless, double destabilises.
    pub gradient: [f64; N],
    /// Input gain b_0: the constant b, or a reference value of b(x). Unit of x_n per second and per unit of u. Never 0.
    pub input_gain: f64,
}

/// Largest accepted difference between a slope of the model and the nominal gradient, as a share of the larger one.
const AGREED: f64 = 0.01;

impl<const N: usize> Nominal<N> {
    /// Checks a model against this gradient and input gain near x.
    ///
    /// Central differences give the slopes of the model. Each slope must agree with its entry of
    /// [`gradient`](Self::gradient) within 1 % plus the rounding error of the model's precision. The rounding error
    /// must be at most half of the slope. Entries of 0 mean *unknown* and are not compared. b(x) must have the sign of
    /// b_0. A model with a large constant part needs this check in f64.
    ///
    /// # Errors
    /// Returns the first entry that does not agree, with both values.
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
            // False for a model that returns NaN here, and for a slope that is lost in the rounding of this precision.
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

/// Linear a(x) with a constant b, complete with the numbers of [`Nominal`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(transparent)]
pub struct Linear<T, const N: usize> {
    row: [T; N],
}

macro_rules! linear {
    ($($t:ty),*) => {$(
        impl<const N: usize> Linear<$t, N> {
            /// Returns the model a(x) = gradient . x, rounded once from f64.
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
    /// Returns the model with this row of a(x)/b_0.
    pub const fn from_row(row: [T; N]) -> Self {
        const { assert_order(N) };
        Self { row }
    }

    /// Returns the row of a(x)/b_0.
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
