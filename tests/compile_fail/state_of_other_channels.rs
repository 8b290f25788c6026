//! State of observers in channels 2 and 4 in a tick of a controller with observers in 3 and 4.

use compile_cases::*;

type Other = controller!(f32, FlexibleJoint<f32>, order 4, observers of order 2 in [3, 4]);

fn wrong(other: &Other, state: &mut <Joint<2> as ControlLaw>::State) -> f32 {
    other.tick(state, &[0.0; 4]).u
}

fn main() {
    let _ = wrong;
}
