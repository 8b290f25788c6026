//! The model of a drive: blocks that push each other, and the map that makes one chain of integrators of them.
//!
//! With L the derivative along the nominal motion without u and disturbances, $x = (q_1, \dot q_1, .., q_E, \dot q_E)$,
//!
//! $$ z_1 = x_1, \qquad z_{i+1} = L z_i, \qquad a_z = L z_n, \qquad
//!    d^z_i = d_i + \sum_{j<i} \frac{\partial z_i}{\partial x_j} d_j $$
//!
//! so that $\dot z_i = z_{i+1} + d^z_i$ and $\dot z_n = a_z + b u + d^z_n$: what the law of the paper is for. The user
//! of a new plant gives the map, no derivatives of it; [`map_error`] holds one to this definition. For a rigid shaft
//! the map is the identity and costs nothing.

use super::two_mass::Whole;
use crate::real::Real;
use crate::running::Words;

/// A nominal model of E blocks, of which the last is driven, as a chain of N = 2 E integrators. Channels count from 0
/// here.
///
/// A model of one's own goes with the design of a motor or of a joint. An arm on a motor, $w = -g \sin q$ with the
/// torque of its weight over J as g; with it the observer is not left to find out where the arm hangs:
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
    /// What the positions push: half the coupling w of every block, which is its share in the mean over a tick.
    type Push: Copy + core::fmt::Debug + PartialEq + Words;
    /// What is computed of the positions once per tick and used twice: sines and cosines.
    type Seen: Copy;
    /// Does a_z depend on anything but z_n? If not, no sum is made of its gradient.
    const HAS_GRADIENT: bool;

    /// Of positions, in the units of the blocks.
    fn seen(&self, position: &[T; E]) -> Self::Seen;

    /// The same a little further on: the first position has moved by so much.
    #[must_use]
    fn seen_ahead(&self, seen: Self::Seen, moved: T) -> Self::Seen;

    /// w/2 of the blocks at these positions.
    fn push(&self, position: &[T; E], seen: &Self::Seen) -> Self::Push;

    /// That of one block; `None` where nothing pushes and nothing pulls back (κ = 0).
    fn of_block(push: &Self::Push, block: usize) -> Option<T>;

    /// A number of every block, kept as they are.
    fn per_block(numbers: [T; E]) -> Self::Push;

    /// κ of a block.
    fn kappa(&self, block: usize) -> T;

    /// b: acceleration of the last block per unit of u.
    fn input_gain(&self) -> T;

    /// z and a_z.
    fn chain(&self, x: &[T; N], seen: &Self::Seen) -> ([T; N], T);

    /// What disturbances of the blocks are in the last channel. What they are in the others must not depend on the
    /// state: the design has it in its rows.
    fn last(&self, seen: &Self::Seen, d: &[T; E]) -> T;

    /// How many units of the block's position one rad of its shaft is.
    fn per_rad(&self, block: usize) -> T;

    /// Can it stand still at these positions under some u of up to so much? A drive does not start where it cannot.
    /// A joint's spring is not wound by more than twice what its motor can: there an encoder that tells its angle
    /// within a turn has told it in another one.
    fn may_stand(&self, position: &[T; E], u_max: T) -> bool {
        let _ = (position, u_max);
        true
    }

    /// Every number that the model is made of: what tells it from another.
    fn numbers(&self) -> impl Iterator<Item = T>;

    /// Of a model whose blocks are one within a tick: what is not each block's own. Of such a model x_3 is how far the
    /// second position is from the first.
    #[doc(hidden)]
    #[inline(always)]
    fn whole(&self) -> Option<&Whole<T, 2, 3>> {
        None
    }

    /// Of such a model: the current, and that of the reference, as they are remembered.
    #[doc(hidden)]
    #[inline(always)]
    fn currents(push: &Self::Push) -> [T; 2] {
        let _ = push;
        [T::ZERO; 2]
    }

    /// The couplings with these.
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    fn with_currents(push: Self::Push, currents: [T; 2]) -> Self::Push {
        let _ = currents;
        push
    }

    /// Of such a model: errors of a chain that knows no weight.
    #[doc(hidden)]
    #[inline(always)]
    fn weightless(&self, e: &[T; N], seen: &Self::Seen) -> [T; N] {
        let _ = seen;
        *e
    }
}

/// How far the map of a model is from its definition, at a state: the largest
/// $|L z_i - z_{i+1}| / (1 + |L z_i|)$ and $|L z_n - a_z - b u|$ likewise, by central differences along the nominal
/// motion. A right map gives less than 1e-6 (that of the joint 3e-9); a wrong sign gives 0.01 and more. `kappa` and
/// `lambda` are those of the blocks.
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
