//! Model without `Copy`; the error points at the line of the model.

use compile_cases::*;

struct Pendulum;

impl NominalModel<f32, 2> for Pendulum {
    fn drift(&self, x: &[f32; 2]) -> f32 {
        -x[0]
    }
}

fn main() {}
