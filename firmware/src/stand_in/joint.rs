//! A stand-in for a flexible joint with an encoder on each side, so that a drive runs on a bare board and in an
//! emulator.
//!
//! $$ J_l \ddot q_l = K (q_m - q_l) - B_l \dot q_l - m g l \sin q_l - \text{load}, \qquad
//!    J_m \ddot q_m = K_t u - K (q_m - q_l) - B_m \dot q_m - \text{friction} $$
//!
//! in rad of the link. The load comes and goes, and the drive knows nothing of either it or the friction.

use controller_core::drive::{Joint as Data, sin_cos};
use core::f32::consts::TAU;

/// The joint, and what drives it.
pub struct Joint {
    data: Data,
    counts_per_turn: f32,
    link: [f32; 2],
    motor: [f32; 2],
    /// Periods gone.
    tick: u32,
}

impl Joint {
    /// Torque of the friction against the motor, N m.
    const FRICTION_N_M: f32 = 0.05;
    /// The load, N m: on for a second, off for the next.
    const LOAD_N_M: f32 = 0.3;

    /// At rest at angle 0, behind encoders with so many counts per turn of the link.
    pub const fn new(data: Data, counts_per_turn: u32) -> Self {
        Self { data, counts_per_turn: counts_per_turn as f32, link: [0.0; 2], motor: [0.0; 2], tick: 0 }
    }

    /// What the counters of link and motor say.
    pub fn counts(&self) -> [i32; 2] {
        [self.link[0], self.motor[0]].map(|angle| (angle / TAU * self.counts_per_turn) as i32)
    }

    /// One period passes under a current of `u` A. Each position moves with the speed at the end (semi-implicit Euler),
    /// which keeps the torsion undamped as it is.
    pub fn advance(&mut self, u: f32, period_s: f32) {
        let of = |value: f64| value as f32;
        let torsion = of(self.data.stiffness_n_m) * (self.motor[0] - self.link[0]);
        let weight = sin_cos(self.link[0], of(self.data.weight_n_m)).0;
        let is_loaded = (self.tick as f32 * period_s) as u32 & 1 == 1;
        let load = if is_loaded { Self::LOAD_N_M } else { 0.0 };
        let link = torsion - of(self.data.link_damping_n_m_s) * self.link[1] - weight - load;
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
        self.tick = self.tick.wrapping_add(1);
    }
}
