//! Channel 5 of a plant of order 4.

use compile_cases::*;

type Spoilt = controller!(f32, FlexibleJoint<f32>, order 4, observers of order 2 in [2, 5]);
static CONTROLLER: Spoilt = Spoilt::design(&good(GAINS), MODEL);

fn main() {
    let _ = &CONTROLLER;
}
