//! Complete design in a `static`: the compiler computes it, and it lies in flash.

use compile_cases::*;

static CONTROLLER: Joint<2> = Joint::design(&good(GAINS), MODEL);

fn main() {
    assert!(CONTROLLER.start(&[0.1, 0.0, 0.0, 0.0]).is_some());
}
