//! Eq. (44): no order up to 2 is enough for channel 1 of 4.

use compile_cases::*;

type Spoilt = controller!(f32, FlexibleJoint<f32>, order 4, observers of order 2 in [1, 4]);
static CONTROLLER: Spoilt = Spoilt::design(&good(GAINS), MODEL);

fn main() {
    let _ = &CONTROLLER;
}
