//! Channel 3 is observed in the type, channel 2 in the configuration.

use compile_cases::*;

type Spoilt = Controller<f32, FlexibleJoint<f32>, 4, 2, { channels([3, 4]) }, 2>;
static CONTROLLER: Spoilt = Spoilt::designed(&good(GAINS), MODEL);

fn main() {
    let _ = &CONTROLLER;
}
