//! Flexible joint of Example 2, Eq. (62)-(64) and Table I.
//!
//! A torsional spring connects the link and the motor, and only the motor is driven. The states $x_1, x_2$ are the link
//! angle and velocity (rad, rad/s). The states $x_3, x_4$ are the motor angle and velocity scaled by $k_1$ (rad/s²,
//! rad/s³). In these states the joint is a chain of four integrators:
//!
//! $$ \dot x_2 = x_3 + d_2, \quad d_2 = -k_1 x_1 - b_1 x_2 - \sin x_1 + \dots, \qquad
//!    \dot x_4 = a(x) + b u + d_4, \quad a(x) = k_2 x_1 - k_2 x_3 - b_2 x_4 $$
//!
//! # Deviation
//! The printed equations contradict each other about which inertia belongs to which equation. The simplified Eq. (64)
//! omits $k_1$ in $a$ and $b$. [`Reading`] lists the possible readings. `Reconstructed` is the reading that reproduces
//! the published numbers.

use crate::model::{Nominal, NominalModel};
use crate::real::Real;

/// Joint parameters of Table I, SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct JointParameters {
    /// Drive torque constant `K_t`, N m/A.
    pub kt: f64,
    /// Inertia `J_11`, printed for the actuator, kg m².
    pub j11: f64,
    /// Inertia `J_12`, printed for the load, kg m².
    pub j12: f64,
    /// Viscous damping `B_11`, N m s/rad.
    pub b11: f64,
    /// Viscous damping `B_12`, N m s/rad.
    pub b12: f64,
    /// Torsional stiffness `K_s`, N m/rad.
    pub ks: f64,
}

/// Reading of Eq. (63)-(64) and Table I.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum Reading {
    /// Only for the paper's figures, as printed: `J_11` on the link. It does not reproduce the published numbers.
    Literal,
    /// Only for the paper's figures: link equation with the link inertia `J_12`. It reproduces the published numbers.
    /// On any real joint the input gain is wrong by the factor `k_1`.
    Reconstructed,
    /// Only for the paper's figures: as `Reconstructed`, with `B_11` on the motor. It is the hard test of a
    /// discretisation.
    Stiff,
    /// Two inertias on a spring: a and b of the consistent scaling x_3 = k_1 x_3'. Use this reading for a real joint.
    Physical,
}

/// Coefficients of the joint in chain coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct JointChain {
    /// Link stiffness `k_1`, 1/s².
    pub k1: f64,
    /// Link damping `b_1`, 1/s.
    pub b1: f64,
    /// Motor stiffness `k_2`, 1/s².
    pub k2: f64,
    /// Motor damping `b_2`, 1/s.
    pub b2: f64,
    /// Input gain `b`, rad/s⁴ per unit of u (A).
    pub b: f64,
    /// Coefficient of x_1 in a(x), 1/s⁴: `k_2` as printed (equal in number), or `k_1 k_2` if scaled consistently.
    pub a1: f64,
}

impl JointParameters {
    /// Parameters of Table I as printed.
    pub const TABLE_I: Self = Self { kt: 0.119, j11: 931e-6, j12: 0.230, b11: 4.5, b12: 0.07, ks: 9.0 };

    /// Returns the chain coefficients of the parameters under a reading.
    pub const fn chain(&self, reading: Reading) -> JointChain {
        let Self { kt, j11, j12, b11, b12, ks } = *self;
        if matches!(reading, Reading::Literal) {
            let k2 = ks / j12;
            return JointChain { k1: ks / j11, b1: b11 / j11, k2, b2: b12 / j11, b: kt / j11, a1: k2 };
        }
        let (k1, k2, b) = (ks / j12, ks / j11, kt / j11);
        let printed = JointChain { k1, b1: b12 / j12, k2, b2: b12 / j11, b, a1: k2 };
        match reading {
            Reading::Stiff => JointChain { b2: b11 / j11, ..printed },
            Reading::Physical => JointChain { b: k1 * b, a1: k1 * k2, ..printed },
            Reading::Literal | Reading::Reconstructed => printed,
        }
    }
}

impl JointChain {
    /// Returns a(x) and b for the design.
    pub const fn nominal(&self) -> Nominal<4> {
        Nominal { gradient: [self.a1, 0.0, -self.k2, -self.b2], input_gain: self.b }
    }
}

/// Model a(x)/b of the joint. State x_2 does not enter, so it costs no instruction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FlexibleJoint<T> {
    /// Coefficients of x_1, x_3, x_4, divided by b.
    row: [T; 3],
}

macro_rules! joint {
    ($($t:ty),*) => {$(
        impl FlexibleJoint<$t> {
            /// Returns the model of [`JointChain::nominal`], rounded once from f64.
            pub const fn new(nominal: &Nominal<4>) -> Self {
                let [x1, _, x3, x4] = nominal.gradient;
                let b = nominal.input_gain;
                Self { row: [(x1 / b) as $t, (x3 / b) as $t, (x4 / b) as $t] }
            }
        }
    )*};
}
joint!(f32, f64);

impl<T: Real> FlexibleJoint<T> {
    /// Returns the model from the coefficients of x_1, x_3, x_4 in a(x)/b.
    #[doc(hidden)]
    pub const fn from_row(row: [T; 3]) -> Self {
        Self { row }
    }
}

impl<T: Real> NominalModel<T, 4> for FlexibleJoint<T> {
    #[inline(always)]
    fn drift(&self, x: &[T; 4]) -> T {
        self.row[0] * x[0] + self.row[1] * x[2] + self.row[2] * x[3]
    }
}
