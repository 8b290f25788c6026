//! A flexible joint with an encoder on each side.
//!
//! $$ J_l \ddot q_l = K (q_m - q_l) - B_l \dot q_l - m g l \sin q_l - \text{load}, \qquad
//!    J_m \ddot q_m = K_t u - K (q_m - q_l) - B_m \dot q_m - \text{friction} $$
//!
//! in rad of the link. The drive knows nothing of either load or friction.

use controller_core::drive::{Joint as Data, sin_cos};
use core::f32::consts::TAU;

use super::Plant;

/// The joint, and what drives it.
pub struct Joint {
    data: Data,
    counts_per_turn: f32,
    link: [f32; 2],
    motor: [f32; 2],
}

impl Joint {
    /// Torque of the friction against the motor, N m.
    const FRICTION_N_M: f32 = 0.05;

    /// At rest at angle 0, behind encoders with so many counts per turn of the link.
    pub const fn new(data: Data, counts_per_turn: u32) -> Self {
        Self { data, counts_per_turn: counts_per_turn as f32, link: [0.0; 2], motor: [0.0; 2] }
    }
}

impl Plant<2> for Joint {
    fn counts(&self) -> [i32; 2] {
        [self.link[0], self.motor[0]].map(|angle| (angle / TAU * self.counts_per_turn) as i32)
    }

    /// Each position moves with the speed at the end (semi-implicit Euler), which keeps the torsion undamped as it is.
    fn advance(&mut self, u: f32, load_n_m: f32, period_s: f32) {
        let of = |value: f64| value as f32;
        let torsion = of(self.data.stiffness_n_m) * (self.motor[0] - self.link[0]);
        let weight = sin_cos(self.link[0], of(self.data.weight_n_m)).0;
        let link = torsion - of(self.data.link_damping_n_m_s) * self.link[1] - weight - load_n_m;
        let drive = of(self.data.torque_n_m_per_a) * u - torsion - of(self.data.motor_damping_n_m_s) * self.motor[1];
        // Friction opposes the motion, steeply about rest.
        let friction = Self::FRICTION_N_M * (self.motor[1] * 100.0).clamp(-1.0, 1.0);
        let moves = [
            (&mut self.link, link / of(self.data.link_inertia_kg_m2)),
            (&mut self.motor, (drive - friction) / of(self.data.motor_inertia_kg_m2)),
        ];
        for ([angle, speed], acceleration) in moves {
            *speed += period_s * acceleration;
            *angle += period_s * *speed;
        }
    }
}
