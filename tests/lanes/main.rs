//! Bit-identity of every lane of every configuration with the single tick.
//!
//! The program takes a minute to compile, so it is built by name only: `cargo test --workspace --test every_lane`.

use controller_core::shapes;
use integration_tests::{lanes, pairs};

#[test]
fn every_lane_of_every_shape_has_the_bits_of_the_tick_in_both_precisions() {
    let pairs = shapes!(all => pairs);
    assert_eq!(pairs.len(), 2 * 116);
    lanes::hold(pairs);
}
