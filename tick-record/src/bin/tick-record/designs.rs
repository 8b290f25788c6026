//! Designs of the instances in the image `budget`: one file for the image, for the texts with which it is compared, and
//! for the proofs. The texts of a drive use its counter widths; its other numbers may be any.

use controller_core::drive::{Coupled, Encoder, Joint as JointData, JointBandwidths, JointDesign, Motor, MotorDesign};
use controller_core::{Exp, FlexibleJoint, Limits, NominalModel, Real};

pub(crate) const MOTOR: MotorDesign = MotorDesign::by_rule(
    1e-3,
    Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 },
    Encoder::absolute(14),
    Limits::symmetric(10.0),
);
pub(crate) const JOINT_DRIVE: JointDesign =
    JointDesign::new(1e-3, JointData::TABLE_I, [Encoder::absolute(20); 2], Limits::symmetric(30.0), 1.3);
/// The joint as a whole, with the gains of `scenario/scenarios/joint.toml` by rule.
pub(crate) const JOINT_WHOLE: JointDesign = {
    let bandwidths = JointBandwidths {
        surface_rad_s: 27.0,
        reaching_per_s: 390.0,
        link_rad_s: 58.0,
        motor_rad_s: 850.0,
        offset_per_s: 10.0,
    };
    JOINT_DRIVE.coupled_by(Coupled::behind(&JOINT_DRIVE.encoders, 2e-4), bandwidths, 1.3)
};

/// The joint with b(x) = b_0 (1 + x_1²/2), to measure the cost of a varying gain.
#[derive(Clone, Copy)]
pub(crate) struct VaryingGain<T>(pub(crate) FlexibleJoint<T>);

impl<T: Real> NominalModel<T, 4> for VaryingGain<T> {
    #[inline]
    fn drift(&self, x: &[T; 4]) -> T {
        self.0.drift(x)
    }

    #[inline]
    fn gain_ratio(&self, x: &[T; 4]) -> Option<T> {
        Some(T::from_f64(1.0) + T::HALF * x[0] * x[0])
    }
}

/// Replacement of an exponential. Its cost is the benchmark with it minus the benchmark without it.
#[derive(Clone, Copy)]
pub(crate) struct Nothing;

impl<T: Real> Exp<T> for Nothing {
    #[inline]
    fn exp(x: T) -> T {
        x
    }
}
