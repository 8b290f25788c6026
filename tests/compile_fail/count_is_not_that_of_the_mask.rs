//! Mismatch of the observer count: two channels in MASK, O = 1.

use compile_cases::*;

type Spoilt = Controller<f32, FlexibleJoint<f32>, 4, 2, { channels(4, 2, [2, 4]) }, 1>;
static CONTROLLER: Spoilt = Spoilt::design(&good(GAINS), MODEL);

fn main() {
    let _ = &CONTROLLER;
}
