//! Model of a plant of order 4 in a controller of order 3.

use compile_cases::*;

type Spoilt = controller!(f32, FlexibleJoint<f32>, order 3, observers of order 2 in [3]);

fn tick(controller: &Spoilt) {
    let _ = Running::new(controller);
}

fn main() {
    let _ = tick;
}
