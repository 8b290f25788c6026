//! Simulated motor with a rigid load and an encoder.
//!
//! $$ J \dot\omega = K_t u - B \omega - \text{friction} - a \sin 24 q - \text{load} $$
//!
//! The drive's model has no load, friction or cogging.

use controller_core::drive::Motor as Data;
use core::f32::consts::TAU;

use super::{Angle, COGGING_PER_TURN, Plant, moved};

/// Simulated motor with its load.
pub struct Motor {
    /// Parameters as in [`pil_wire::Plant`].
    numbers: pil_wire::Plant,
    counts_per_turn: i32,
    angle: Angle,
    speed: f32,
}

impl Motor {
    /// Friction torque, N m.
    const FRICTION_N_M: f32 = 0.005;

    /// Creates a motor at rest at angle 0, with `counts_per_turn` counts per revolution.
    pub const fn new(data: Data, counts_per_turn: u32) -> Self {
        let [inertia, damping, torque] = [data.inertia_kg_m2, data.damping_n_m_s, data.torque_n_m_per_a];
        let numbers = [0.0, 0.0, 0.0, 0.0, inertia as f32, damping as f32, torque as f32, Self::FRICTION_N_M, 0.0];
        Self { numbers, counts_per_turn: counts_per_turn as i32, angle: Angle::ZERO, speed: 0.0 }
    }
}

impl Plant<1> for Motor {
    fn counts(&self) -> [i32; 1] {
        [self.angle.whole]
    }

    fn become_as(&mut self, numbers: &pil_wire::Plant) {
        self.numbers = *numbers;
    }

    fn advance(&mut self, u: f32, load_n_m: f32, period_s: f32) {
        let [_, _, _, _, inertia, damping, torque, friction, cogging] = self.numbers;
        // Friction opposes the motion, with a steep transition at rest: full at 0.005 rad/s.
        let friction = friction * (self.speed * 200.0).clamp(-1.0, 1.0);
        let torque = torque * u - friction - self.angle.wave(COGGING_PER_TURN, self.counts_per_turn, cogging);
        let (next, way) = moved(self.speed, (torque - load_n_m) / inertia, damping / inertia, period_s);
        self.speed = next;
        self.angle.move_by(way * self.counts_per_turn as f32 / TAU);
    }
}
