//! Eq. (44): channel 2 of 4 must estimate one derivative.

use compile_cases::*;

static CONTROLLER: Joint<2> = Joint::design(&good(ObserverGains::as_printed([100.0])), MODEL);

fn main() {
    let _ = &CONTROLLER;
}
