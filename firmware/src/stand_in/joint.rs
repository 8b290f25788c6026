//! Simulated flexible joint with an encoder on each side.
//!
//! $$ J_l \ddot q_l = K (q_m - q_l) - B_l \dot q_l - m g l \sin q_l - \text{load}, \qquad
//!    J_m \ddot q_m = K_t u - K (q_m - q_l) - B_m \dot q_m - \text{friction} - a \sin 24 q_m $$
//!
//! in rad of the link. The drive's model has no load, friction or cogging.
//!
//! A period consists of half a move, the torques there, and half a move. This is exact for a constant torque. For a
//! spring the error is (ωT)²/24, which is 4e-5 for the joint at 3.2 kHz.

use controller_core::drive::Joint as Data;
use core::f32::consts::TAU;

use super::{Angle, COGGING_PER_TURN, Plant, moved};

/// Simulated joint with its drive.
pub struct Joint {
    /// Parameters as in [`pil_wire::Plant`].
    numbers: pil_wire::Plant,
    counts_per_turn: i32,
    link: (Angle, f32),
    motor: (Angle, f32),
}

impl Joint {
    /// Friction torque on the motor side, N m.
    const FRICTION_N_M: f32 = 0.05;

    /// Creates a joint at rest at angle 0, with `counts_per_turn` counts per revolution of the link.
    pub const fn new(data: Data, counts_per_turn: u32) -> Self {
        let numbers = [
            data.link_inertia_kg_m2 as f32,
            data.link_damping_n_m_s as f32,
            data.weight_n_m as f32,
            data.stiffness_n_m as f32,
            data.motor_inertia_kg_m2 as f32,
            data.motor_damping_n_m_s as f32,
            data.torque_n_m_per_a as f32,
            Self::FRICTION_N_M,
            0.0,
        ];
        let rest = (Angle::ZERO, 0.0);
        Self { numbers, counts_per_turn: counts_per_turn as i32, link: rest, motor: rest }
    }
}

impl Plant<2> for Joint {
    fn counts(&self) -> [i32; 2] {
        [self.link.0.whole, self.motor.0.whole]
    }

    fn become_as(&mut self, numbers: &pil_wire::Plant) {
        // A link needs a positive inertia.
        if numbers[0] > 0.0 {
            self.numbers = *numbers;
        }
    }

    fn advance(&mut self, u: f32, load_n_m: f32, period_s: f32) {
        let [link_inertia, link_damping, weight, stiffness, inertia, damping, torque, friction, cogging] = self.numbers;
        let turn = self.counts_per_turn;
        let unit = TAU / turn as f32;
        let half = |(angle, speed): (Angle, f32)| {
            let mut angle = angle;
            angle.move_by(0.5 * period_s * speed / unit);
            angle
        };
        let (link, motor) = (half(self.link), half(self.motor));
        let torsion = stiffness * unit * motor.from(link);
        let on_link = torsion - link.wave(1, turn, weight) - load_n_m;
        // Friction opposes the motion, with a steep transition at rest: full at 0.04 rad/s.
        let friction = friction * (self.motor.1 * 25.0).clamp(-1.0, 1.0);
        let on_motor = torque * u - torsion - friction - motor.wave(COGGING_PER_TURN, turn, cogging);
        let shafts = [
            (&mut self.link, on_link / link_inertia, link_damping / link_inertia),
            (&mut self.motor, on_motor / inertia, damping / inertia),
        ];
        for ((angle, speed), acceleration, damping) in shafts {
            let (next, way) = moved(*speed, acceleration, damping, period_s);
            *speed = next;
            angle.move_by(way / unit);
        }
    }
}
