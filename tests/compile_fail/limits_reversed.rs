//! Lower limit of u above the upper limit.

use compile_cases::*;

static CONTROLLER: Joint<2> = Joint::design(
    &Config { options: Options::NEUTRAL.with_limits(Limits { min: 300.0, max: -300.0 }), ..good(GAINS) },
    MODEL,
);

fn main() {
    let _ = &CONTROLLER;
}
