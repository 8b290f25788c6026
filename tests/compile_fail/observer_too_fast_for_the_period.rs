//! Observer pole of 2000 rad/s at T = 1 ms.

use compile_cases::*;

static CONTROLLER: Joint<2> = Joint::design(&good(ObserverGains::from_bandwidth::<2>(2000.0)), MODEL);

fn main() {
    let _ = &CONTROLLER;
}
