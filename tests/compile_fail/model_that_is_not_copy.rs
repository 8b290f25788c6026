//! A model that cannot be copied, told at its own line.

use compile_cases::*;

struct Pendulum;

impl NominalModel<f32, 2> for Pendulum {
    fn drift(&self, x: &[f32; 2]) -> f32 {
        -x[0]
    }
}

fn main() {}
