//! Mismatch of observed channels: channel 3 in the type, channel 2 in the configuration.

use compile_cases::*;

type Spoilt = controller!(f32, FlexibleJoint<f32>, order 4, observers of order 2 in [3, 4]);
static CONTROLLER: Spoilt = Spoilt::design(&good(GAINS), MODEL);

fn main() {
    let _ = &CONTROLLER;
}
