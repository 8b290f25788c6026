//! Surface with a diverging sliding motion.

use compile_cases::*;

static CONTROLLER: Joint<2> = Joint::design(
    &Config { surface: Surface { c: [125.0, -75.0, 15.0, 1.0], alpha_per_s: 1.0 }, ..good(GAINS) },
    MODEL,
);

fn main() {
    let _ = &CONTROLLER;
}
