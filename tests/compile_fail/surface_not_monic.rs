//! Surface with c_n other than 1; Eq. (44) has c_n = 1.

use compile_cases::*;

static CONTROLLER: Joint<2> = Joint::design(
    &Config { surface: Surface { c: [250.0, 150.0, 30.0, 2.0], alpha_per_s: 1.0 }, ..good(GAINS) },
    MODEL,
);

fn main() {
    let _ = &CONTROLLER;
}
