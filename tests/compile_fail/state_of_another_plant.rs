//! State of the joint in a tick of a motor's controller.

use compile_cases::*;

type Motor = controller!(f32, Linear<f32, 4>, order 4, observers of order 2 in [2, 4]);

fn wrong(motor: &Motor, state: &mut <Joint<2> as ControlLaw>::State) -> f32 {
    motor.tick(state, &[0.0; 4]).u
}

fn main() {
    let _ = wrong;
}
