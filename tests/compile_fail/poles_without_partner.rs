//! Complex pole without its conjugate.

use compile_cases::*;

const ALONE: [Pole; 2] = [Pole { re: -10.0, im: 5.0 }, Pole { re: -10.0, im: 0.0 }];
const GAINS: ObserverGains<2> = ObserverGains::from_poles(ALONE);

fn main() {
    let _ = GAINS;
}
