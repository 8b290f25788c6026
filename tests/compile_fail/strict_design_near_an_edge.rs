//! Design that runs, but would get a warning: k_l T = 0.6. `strict` turns the warning into an error.

use compile_cases::*;

const HASTY: Config<4, 2> =
    Config { reaching: ReachingLaw { k_l: 600.0, k_s: 0.0, epsilon: 0.01 }, ..good(GAINS) }.strict();

fn main() {
    let _ = HASTY;
}
