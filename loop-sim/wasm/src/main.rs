//! Prints the hashes of this machine, one per line.

use loop_sim_wasm::{CASES, bits};

fn main() {
    (0..CASES).for_each(|case| println!("{:016x}", bits(case)));
}
