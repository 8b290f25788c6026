//! A design that runs, but at k_l T = 0.6, where none is let pass that would be warned of.

use compile_cases::*;

const HASTY: Config<4, 2> =
    Config { reaching: ReachingLaw { k_l: 600.0, k_s: 0.0, epsilon: 0.01 }, ..good(GAINS) }.strict();

fn main() {
    let _ = HASTY;
}
