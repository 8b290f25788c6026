//! A motor with a rigid load and an encoder.
//!
//! $$ J \dot\omega = K_t u - B \omega - \text{friction} - \text{load} $$
//!
//! The drive knows nothing of either load or friction.

use controller_core::drive::Motor as Data;
use core::f32::consts::TAU;

use super::Plant;

/// The motor, and what it drives.
pub struct Motor {
    data: Data,
    counts_per_turn: f32,
    angle: f32,
    speed: f32,
}

impl Motor {
    /// Torque of the friction, N m.
    const FRICTION_N_M: f32 = 0.005;

    /// At rest at angle 0, behind an encoder with so many counts per turn.
    pub const fn new(data: Data, counts_per_turn: u32) -> Self {
        Self { data, counts_per_turn: counts_per_turn as f32, angle: 0.0, speed: 0.0 }
    }
}

impl Plant<1> for Motor {
    fn counts(&self) -> [i32; 1] {
        [(self.angle / TAU * self.counts_per_turn) as i32]
    }

    /// The angle moves with the speed at the end (semi-implicit Euler).
    fn advance(&mut self, u: f32, load_n_m: f32, period_s: f32) {
        let of = |value: f64| value as f32;
        // Friction opposes the motion, steeply about rest: in full at 0.005 rad/s.
        let friction = Self::FRICTION_N_M * (self.speed * 200.0).clamp(-1.0, 1.0);
        let torque = of(self.data.torque_n_m_per_a) * u - of(self.data.damping_n_m_s) * self.speed - friction;
        self.speed += period_s * (torque - load_n_m) / of(self.data.inertia_kg_m2);
        self.angle += period_s * self.speed;
    }
}
