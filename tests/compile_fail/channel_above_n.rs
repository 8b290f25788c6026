//! Channel 5 of a plant of order 4.

use compile_cases::*;

type Spoilt = Controller<f32, FlexibleJoint<f32>, 4, 2, { channels([2, 5]) }, 2>;
static CONTROLLER: Spoilt = Spoilt::designed(&good(GAINS), MODEL);

fn main() {
    let _ = &CONTROLLER;
}
