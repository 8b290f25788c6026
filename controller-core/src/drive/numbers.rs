//! Design of a drive as plain numbers in one order, for a serial protocol whose other end repeats the design.
//!
//! The arithmetic of a design is identical on every machine. So a target that receives these numbers makes the design
//! of the sender, bit for bit. It computes in 64-bit software arithmetic, as background work. The design checks the
//! range of the numbers, as always. Only the integer part of a whole number is read.

use super::encoder::Encoder;
use super::joint::{Coupled, Joint, JointDesign};
use super::monitor::Bounds;
use super::motor::{Motor, MotorDesign};
use crate::config::Fallback;
use crate::law::Limits;

const ENCODER: Encoder = Encoder::absolute(12);
const LIMITS: Limits = Limits::symmetric(1.0);
const MOTOR: MotorDesign = {
    let motor = Motor { inertia_kg_m2: 1.0, torque_n_m_per_a: 1.0, damping_n_m_s: 0.0 };
    MotorDesign::by_rule(1e-3, motor, ENCODER, LIMITS)
};
const JOINT: JointDesign = JointDesign::new(1e-3, Joint::TABLE_I, [ENCODER; 2], LIMITS, 1.0);

/// Lists all numbers in their order. The fallback comes last, as hold (0 or 1) and u.
macro_rules! numbers {
    ($($design:ident, $count:literal, $neutral:expr, $it:ident: [$($place:expr,)*];)*) => {
        $(impl $design {
            /// Number of numbers of this design.
            pub const NUMBERS: usize = $count;

            /// Returns the numbers of the design in the order of [`LAYOUT`].
            pub const fn to_numbers(&self) -> [f64; $count] {
                let $it = self;
                let (hold, safe) = match $it.fallback {
                    Fallback::HoldLast => (1.0, 0.0),
                    Fallback::Safe(u) => (0.0, u),
                };
                [$($place as f64,)* hold, safe]
            }

            /// Builds the design from its numbers, in the order of [`LAYOUT`].
            pub const fn from_numbers(numbers: &[f64; $count]) -> Self {
                let mut design = $neutral;
                let $it = &mut design;
                let mut i = 0;
                $(
                    $place = numbers[i] as _;
                    i += 1;
                )*
                $it.fallback = if numbers[i] == 1.0 { Fallback::HoldLast } else { Fallback::Safe(numbers[i + 1]) };
                design
            }
        })*

        /// Names of the numbers of a [`MotorDesign`] and of a [`JointDesign`], with the additional names of [`Coupled`]
        /// for a joint.
        ///
        /// Then follow the names for the [`Bounds`], disturbances first, and the bits of the alarms that stop the
        /// drive.
        pub const LAYOUT: &str = concat!(
            $(stringify!($design), $(" ", stringify!($place),)* " hold safe; ",)*
            "Coupled lag_s resolution_link resolution_motor calm_link calm_motor; ",
            "d sigma* stuck wrong_way patience brake_per_s brake_ticks stops_at"
        );
    };
}

numbers! {
    MotorDesign, 24, MOTOR, it: [
        it.period_s, it.motor.inertia_kg_m2, it.motor.torque_n_m_per_a, it.motor.damping_n_m_s,
        it.encoder.bits, it.encoder.counts_per_turn, it.encoder.gear_num, it.encoder.gear_den, it.encoder.states,
        it.limits.min, it.limits.max, it.bandwidths.surface_rad_s, it.bandwidths.observer_rad_s,
        it.bandwidths.reaching_per_s, it.bandwidths.offset_per_s, it.fast_ratio, it.switching.calm_steps,
        it.switching.alert_steps, it.switching.smoothing_s, it.switching.keep_s, it.gate_steps, it.lost_ticks,
    ];
    JointDesign, 36, JOINT, it: [
        it.period_s, it.joint.link_inertia_kg_m2, it.joint.link_damping_n_m_s, it.joint.weight_n_m,
        it.joint.stiffness_n_m, it.joint.motor_inertia_kg_m2, it.joint.motor_damping_n_m_s, it.joint.torque_n_m_per_a,
        it.encoders[0].bits, it.encoders[0].counts_per_turn, it.encoders[0].gear_num, it.encoders[0].gear_den,
        it.encoders[0].states,
        it.encoders[1].bits, it.encoders[1].counts_per_turn, it.encoders[1].gear_num, it.encoders[1].gear_den,
        it.encoders[1].states,
        it.limits.min, it.limits.max, it.bandwidths.surface_rad_s, it.bandwidths.link_rad_s,
        it.bandwidths.motor_rad_s, it.bandwidths.reaching_per_s, it.bandwidths.offset_per_s, it.fast_ratios[0],
        it.fast_ratios[1], it.switching.calm_steps, it.switching.alert_steps, it.switching.smoothing_s,
        it.switching.keep_s, it.gate_steps[0], it.gate_steps[1], it.lost_ticks,
    ];
}

impl JointDesign {
    /// Number of numbers of a coupled joint design: the numbers of a [`JointDesign`], then the numbers of [`Coupled`].
    pub const COUPLED_NUMBERS: usize = Self::NUMBERS + 5;

    /// Returns the numbers in the order of [`LAYOUT`], or `None` for a design with one observer per encoder.
    pub fn to_coupled_numbers(&self) -> Option<[f64; Self::COUPLED_NUMBERS]> {
        let Coupled { lag_s, resolution_rad: [link, motor], calm_steps: [calm_link, calm_motor] } = self.coupled?;
        let mut numbers = [0.0; Self::COUPLED_NUMBERS];
        numbers[..Self::NUMBERS].copy_from_slice(&self.to_numbers());
        numbers[Self::NUMBERS..].copy_from_slice(&[lag_s, link, motor, calm_link, calm_motor]);
        Some(numbers)
    }

    /// Builds a coupled joint design from its numbers, in the order of [`LAYOUT`].
    pub fn from_coupled_numbers(numbers: &[f64; Self::COUPLED_NUMBERS]) -> Self {
        let of = |i: usize| numbers[Self::NUMBERS + i];
        let coupled = Coupled { lag_s: of(0), resolution_rad: [of(1), of(2)], calm_steps: [of(3), of(4)] };
        let design = Self::from_numbers(&core::array::from_fn(|i| numbers[i]));
        Self { coupled: Some(coupled), ..design }
    }
}

impl<const E: usize> Bounds<E> {
    /// Number of numbers of the bounds.
    pub const NUMBERS: usize = E + 6;

    /// Returns the numbers of the bounds in the order of [`LAYOUT`].
    pub fn to_numbers(&self) -> impl Iterator<Item = f64> {
        let ticks = [self.stuck_ticks, self.wrong_way_ticks, self.patience_ticks].map(f64::from);
        let brake = [self.brake_per_s, f64::from(self.brake_ticks)];
        self.disturbance.into_iter().chain([self.sigma_star]).chain(ticks).chain(brake)
    }

    /// Builds the bounds from their numbers. Missing numbers become NaN, and no value is within a NaN bound.
    pub fn from_numbers(numbers: impl IntoIterator<Item = f64>) -> Self {
        let mut numbers = numbers.into_iter();
        let mut next = || numbers.next().unwrap_or(f64::NAN);
        Self {
            disturbance: core::array::from_fn(|_| next()),
            sigma_star: next(),
            stuck_ticks: next() as u32,
            wrong_way_ticks: next() as u32,
            patience_ticks: next() as u32,
            brake_per_s: next(),
            brake_ticks: next() as u32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that every number has a place of its own and returns from it.
    #[test]
    fn a_description_comes_back_from_its_numbers() {
        let numbers = |i: usize| if i == MotorDesign::NUMBERS - 2 { 0.0 } else { i as f64 + 1.0 };
        let motor = MotorDesign::from_numbers(&core::array::from_fn(numbers));
        assert_eq!(motor.to_numbers(), core::array::from_fn(numbers));
        let numbers = |i: usize| if i == JointDesign::NUMBERS - 2 { 0.0 } else { i as f64 + 1.0 };
        assert_eq!(
            JointDesign::from_numbers(&core::array::from_fn(numbers)).to_numbers(),
            core::array::from_fn(numbers)
        );
        let numbers = |i: usize| if i == JointDesign::NUMBERS - 2 { 0.0 } else { i as f64 + 1.0 };
        let coupled = JointDesign::from_coupled_numbers(&core::array::from_fn(numbers));
        assert_eq!(coupled.to_coupled_numbers(), Some(core::array::from_fn(numbers)));
        assert_eq!(JointDesign { coupled: None, ..coupled }.to_coupled_numbers(), None);
        let holding = MotorDesign { fallback: Fallback::HoldLast, ..motor };
        assert_eq!(MotorDesign::from_numbers(&holding.to_numbers()), holding);
        let bounds = Bounds {
            disturbance: [1.0, 2.0],
            sigma_star: f64::INFINITY,
            stuck_ticks: 3,
            wrong_way_ticks: 4,
            patience_ticks: 5,
            brake_per_s: 6.0,
            brake_ticks: 7,
        };
        assert_eq!(Bounds::from_numbers(bounds.to_numbers()), bounds);
    }
}
