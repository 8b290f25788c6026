//! Model of a drive: coupled blocks, and the map to one chain of integrators.
//!
//! Let L be the derivative along the nominal motion without u and disturbances, and
//! $x = (q_1, \dot q_1, .., q_E, \dot q_E)$. Then
//!
//! $$ z_1 = x_1, \qquad z_{i+1} = L z_i, \qquad a_z = L z_n, \qquad
//!    d^z_i = d_i + \sum_{j<i} \frac{\partial z_i}{\partial x_j} d_j $$
//!
//! so that $\dot z_i = z_{i+1} + d^z_i$ and $\dot z_n = a_z + b u + d^z_n$: the plant of the paper's law. For a new
//! plant, implement the map, without its derivatives. [`map_error`] compares the map with this definition. For a rigid
//! shaft the map is the identity and costs nothing.

use super::two_mass::Whole;
use crate::real::Real;
use crate::running::Words;

/// Nominal model of E blocks, the last one driven, as a chain of N = 2 E integrators. Channels count from 0 here.
///
/// Use a model of your own with the design of a motor or of a joint. The example is an arm on a motor: $w = -g \sin q$,
/// with the torque of its weight over J as g. With this model the observer need not estimate the weight:
///
/// ```
/// use controller_core::drive::*;
/// use controller_core::{Limits, Real, Running};
///
/// #[derive(Clone, Copy)]
/// struct Arm<T> {
///     b: T,     // K_t/J
///     drag: T,  // -B/J
///     gravity: T,
/// }
///
/// impl<T: Real> ChainModel<T, 1, 2> for Arm<T> {
///     type Push = [T; 1];
///     type Seen = T; // g sin q
///     const HAS_GRADIENT: bool = false;
///
///     fn seen(&self, position: &[T; 1]) -> T {
///         sin_cos(position[0], self.gravity).0
///     }
///     fn seen_ahead(&self, seen: T, _: T) -> T {
///         seen
///     }
///     fn push(&self, _: &[T; 1], seen: &T) -> [T; 1] {
///         [-T::from_f64(0.5) * *seen]
///     }
///     fn of_block(push: &[T; 1], block: usize) -> Option<T> {
///         Some(push[block])
///     }
///     fn per_block(numbers: [T; 1]) -> [T; 1] {
///         numbers
///     }
///     fn kappa(&self, _: usize) -> T {
///         T::from_f64(0.0)
///     }
///     fn input_gain(&self) -> T {
///         self.b
///     }
///     fn chain(&self, x: &[T; 2], seen: &T) -> ([T; 2], T) {
///         (*x, self.drag * x[1] - *seen)
///     }
///     fn last(&self, _: &T, d: &[T; 1]) -> T {
///         d[0]
///     }
///     fn per_rad(&self, _: usize) -> T {
///         T::from_f64(1.0)
///     }
///     fn numbers(&self) -> impl Iterator<Item = T> {
///         [self.b, self.drag, self.gravity].into_iter()
///     }
/// }
///
/// const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
/// const DESIGN: MotorDesign = MotorDesign::by_rule(1e-3, MOTOR, Encoder::absolute(14), Limits::symmetric(10.0));
///
/// // The map is what the definition says; with another λ it is not.
/// let arm = Arm { b: 250.0_f64, drag: -0.05, gravity: 400.0 };
/// assert!(map_error(&arm, &[0.0], &[0.05], &[0.7, -3.0], 2.0) < 1e-6);
/// assert!(map_error(&Arm { drag: 5.0, ..arm }, &[0.0], &[0.05], &[0.7, -3.0], 2.0) > 1e-2);
///
/// type Drive = EncoderForm<f32, Arm<f32>, Position, 1, 2, 3, 0, 0>;
/// const ARM: Arm<f32> = Arm { b: 250.0, drag: -0.05, gravity: 400.0 };
/// let drive: Drive = Drive::try_design_with(&DESIGN, ARM)?;
/// // Held at a quarter turn the weight is known at once: 400/250 A.
/// let at = |angle| Target { turn: 0, jet: [angle, 0.0] };
/// let quarter = core::f32::consts::FRAC_PI_2;
/// let sample = Sample { counts: [Some(4096)], begin: at(quarter), end: at(quarter) };
/// let mut running = Running::new(&drive);
/// running.start_at_once(&sample);
/// let output = running.tick(&sample);
/// assert!((output.u - 1.6).abs() < 1e-4, "{}", output.u);
/// # Ok::<(), DriveError>(())
/// ```
pub trait ChainModel<T: Real, const E: usize, const N: usize>: Copy {
    /// Couplings that depend on the positions: half the coupling w of every block, which is its share in the mean over
    /// a tick.
    type Push: Copy + core::fmt::Debug + PartialEq + Words;
    /// Values that depend on the positions, computed once per tick and used twice: sines and cosines.
    type Seen: Copy;
    /// True if a_z depends on more than z_n. Otherwise the law omits the sum of its gradient.
    const HAS_GRADIENT: bool;

    /// Returns the values at these positions, in the units of the blocks.
    fn seen(&self, position: &[T; E]) -> Self::Seen;

    /// Returns the values after the first position has moved by `moved`.
    #[must_use]
    fn seen_ahead(&self, seen: Self::Seen, moved: T) -> Self::Seen;

    /// Returns w/2 of the blocks at these positions.
    fn push(&self, position: &[T; E], seen: &Self::Seen) -> Self::Push;

    /// Returns w/2 of one block, or `None` without a coupling and without a restoring term (κ = 0).
    fn of_block(push: &Self::Push, block: usize) -> Option<T>;

    /// Builds couplings from one number per block, unchanged.
    fn per_block(numbers: [T; E]) -> Self::Push;

    /// Returns the restoring term κ of a block.
    fn kappa(&self, block: usize) -> T;

    /// Returns the input gain b: the acceleration of the last block per unit of u.
    fn input_gain(&self) -> T;

    /// Returns z and a_z.
    fn chain(&self, x: &[T; N], seen: &Self::Seen) -> ([T; N], T);

    /// Returns the effect of the block disturbances in the last channel. Their effects in the other channels must not
    /// depend on the state, because the design has them in its rows.
    fn last(&self, seen: &Self::Seen, d: &[T; E]) -> T;

    /// Returns the units of the block's position per rad of its shaft.
    fn per_rad(&self, block: usize) -> T;

    /// Returns true if the shafts can stand still at these positions with some |u| up to `u_max`. Otherwise a drive
    /// does not start.
    ///
    /// For a joint the twist of the spring must not exceed twice the torque limit of its motor. A larger twist means
    /// that an encoder with its angle within a revolution refers to the wrong revolution.
    fn may_stand(&self, position: &[T; E], u_max: T) -> bool {
        let _ = (position, u_max);
        true
    }

    /// Returns every number of the model, to distinguish it from another one.
    fn numbers(&self) -> impl Iterator<Item = T>;

    /// Returns the coupling numbers of a model whose blocks are coupled within a tick. In such a model x_3 is the
    /// second position minus the first.
    #[doc(hidden)]
    #[inline(always)]
    fn whole(&self) -> Option<&Whole<T, 2, 3>> {
        None
    }

    /// Returns the current and the reference current of a coupled model, as they are stored.
    #[doc(hidden)]
    #[inline(always)]
    fn currents(push: &Self::Push) -> [T; 2] {
        let _ = push;
        [T::ZERO; 2]
    }

    /// Returns the couplings with these currents.
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    fn with_currents(push: Self::Push, currents: [T; 2]) -> Self::Push {
        let _ = currents;
        push
    }

    /// Returns the errors of a chain without weight, for a coupled model.
    #[doc(hidden)]
    #[inline(always)]
    fn weightless(&self, e: &[T; N], seen: &Self::Seen) -> [T; N] {
        let _ = seen;
        *e
    }
}

/// Returns the error of a model's map relative to its definition, at a state.
///
/// It is the largest $|L z_i - z_{i+1}| / (1 + |L z_i|)$, and $|L z_n - a_z - b u|$ likewise, by central differences
/// along the nominal motion. A correct map gives less than 1e-6 (the joint 3e-9). A wrong sign gives 0.01 and more.
/// `kappa` and `lambda` belong to the blocks.
pub fn map_error<M, const E: usize, const N: usize>(
    model: &M,
    kappa: &[f64; E],
    lambda: &[f64; E],
    x: &[f64; N],
    u: f64,
) -> f64
where
    M: ChainModel<f64, E, N>,
{
    let position = core::array::from_fn(|i| x[2 * i]);
    let push = model.push(&position, &model.seen(&position));
    let flow: [f64; N] = core::array::from_fn(|j| {
        let i = j / 2;
        let driven = if i + 1 == E { model.input_gain() * u } else { 0.0 };
        let pushed = M::of_block(&push, i).map_or(0.0, |half| 2.0 * half - kappa[i] * x[2 * i]);
        if j % 2 == 0 { x[j + 1] } else { pushed - lambda[i] * x[j] + driven }
    });
    let h = 1e-6;
    let at = |sign: f64| -> ([f64; N], f64) {
        let x = core::array::from_fn(|j| x[j] + sign * h * flow[j]);
        model.chain(&x, &model.seen(&core::array::from_fn(|i| x[2 * i])))
    };
    let ((z, a), (later, _), (before, _)) = (at(0.0), at(1.0), at(-1.0));
    let errors = (0..N).map(|i| {
        let rate = (later[i] - before[i]) / (2.0 * h);
        let expected = if i + 1 < N { z[i + 1] } else { a + model.input_gain() * u };
        (rate - expected).abs() / (1.0 + rate.abs())
    });
    errors.fold(0.0, |worst, error| if error > worst || error.is_nan() { error } else { worst })
}
