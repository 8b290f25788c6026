//! Period of 0/0.

use compile_cases::*;

static CONTROLLER: Joint<2> = Joint::design(&Config { period_s: 0.0 / 0.0, ..good(GAINS) }, MODEL);

fn main() {
    let _ = &CONTROLLER;
}
