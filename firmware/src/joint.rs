//! A stand-in for the flexible joint, so that a drive runs on a bare board and in an emulator.
//!
//!     x_1' = x_2        x_2' = x_3 - k_1 x_1 - b_1 x_2 - sin x_1
//!     x_3' = x_4        x_4' = k_1 k_2 x_1 - k_2 x_3 - b_2 x_4 + b (u + v),  v = 1 + sin 2t
//!
//! Eq. (62)-(64) with the parameters of Table I as a joint has them, reading `Physical`. Units: x_1 in rad and each
//! next one per second more, u and v in A. Positive u and v accelerate towards positive x_1.

use controller_core::{JointChain, JointParameters, Reading};

/// State of the joint and what drives it.
pub struct Joint {
    x: [f32; 4],
    u: f32,
    /// sin 2t, cos 2t.
    wave: [f32; 2],
}

impl Joint {
    const CHAIN: JointChain = JointParameters::TABLE_I.chain(Reading::Physical);

    /// At rest 0.1 rad from where it should be.
    pub const fn new() -> Self {
        Self { x: [0.1, 0.0, 0.0, 0.0], u: 0.0, wave: [0.0, 1.0] }
    }

    /// What ideal sensors say, in chain coordinates.
    pub fn sample(&self) -> [f32; 4] {
        self.x
    }

    /// Holds u until the next call.
    pub fn drive(&mut self, u: f32) {
        self.u = u;
    }

    /// One period passes. Each state moves with the new value of the one that drives it (semi-implicit Euler), which
    /// keeps the torsion undamped as it is.
    pub fn advance(&mut self, period_s: f32) {
        let JointChain { k1, b1, k2, b2, b, a1 } = Self::CHAIN;
        let [k1, b1, k2, b2, b, a1] = [k1, b1, k2, b2, b, a1].map(|value| value as f32);
        let [x1, x2, x3, x4] = &mut self.x;
        let sin_x1 = *x1 - *x1 * *x1 * *x1 * (1.0 / 6.0);
        let v = 1.0 + self.wave[0];
        *x4 += period_s * (a1 * *x1 - k2 * *x3 - b2 * *x4 + b * (self.u + v));
        *x3 += period_s * *x4;
        *x2 += period_s * (*x3 - k1 * *x1 - b1 * *x2 - sin_x1);
        *x1 += period_s * *x2;
        self.wave[0] += 2.0 * period_s * self.wave[1];
        self.wave[1] -= 2.0 * period_s * self.wave[0];
    }
}

impl Default for Joint {
    fn default() -> Self {
        Self::new()
    }
}
