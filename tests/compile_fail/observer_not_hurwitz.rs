//! Unstable observer of order 3: positive gains do not suffice, l1 l2 > l3 is required.

use compile_cases::*;

static CONTROLLER: Joint<3> = Joint::design(&good(ObserverGains::as_printed([1.0, 2.0, 3.0])), MODEL);

fn main() {
    let _ = &CONTROLLER;
}
