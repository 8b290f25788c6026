//! Floating-point modes that a tick assumes, and a check of these modes at start-up.
//!
//! Every number of this crate assumes IEEE 754 arithmetic in its own precision: rounding to nearest with ties to even,
//! subnormal numbers kept, one rounding per operation. These modes are state of the machine, not of a program. Other
//! code may change them, and each execution context may have its own modes.
//!
//! | machine | assumed | who changes it |
//! |---|---|---|
//! | Cortex-M with FPU, thread | FPSCR: RMode = 00, FZ = 0 (as after reset) | start-up code, libraries |
//! | Cortex-M with FPU, interrupt | FPDSCR: RMode = 00, FZ = 0: a handler's FPSCR begins as it | start-up code |
//! | the same | FPCCR: ASPEN = 1 (LSPEN as you like), or a handler spoils other floats | start-up code, an RTOS |
//! | x86-64 | MXCSR: RC = 00, FTZ = 0, DAZ = 0 | `fesetround`; linking with `-ffast-math` sets FTZ and DAZ |
//!
//! FPSCR.DN selects the bits of a NaN, and FPSCR.AHP selects a format that no tick uses. No finite result depends on
//! them. Arithmetic cannot detect ASPEN: read the register to check it.
//!
//! Under other modes the output bits differ from the tested and proved ones. The test module `modes` shows the
//! remaining guarantees. The output u stays within its limits and is a number, and a reset gives its usual state.

use core::hint::black_box;

/// Returns true if f32 arithmetic rounds to nearest even, once per operation, and keeps subnormal numbers.
///
/// Call it once at start-up, from the context in which the tick runs: on a Cortex-M an interrupt has modes of its own.
/// It takes about 25 operations. No tick calls it.
///
/// ```
/// assert!(controller_core::modes_ok());
/// ```
#[inline(never)]
#[must_use]
pub fn modes_ok() -> bool {
    let [one, half_step, step] = black_box([1.0_f32, 5.960_464_5e-8, 1.192_092_9e-7]);
    // Half a unit in the last place rounds to the even neighbour, and less than half is lost, in both directions.
    let is_nearest = one + half_step == one
        && (one + step) + half_step == one + (step + step)
        && one + 0.75 * half_step == one
        && one - 0.25 * half_step == one
        && -one - 0.75 * half_step == -one;
    // 2^-126 is the smallest normal number. Half of it and 2^-140 are subnormal.
    let [smallest, subnormal] = black_box([f32::MIN_POSITIVE, f32::from_bits(1 << 9)]);
    let [half, much] = black_box([0.5_f32, 1.267_650_6e30]);
    let half_of_it = black_box(smallest * half);
    let keeps_subnormals = half_of_it + half_of_it == smallest
        && smallest - half_of_it == half_of_it
        && subnormal * much == 9.094_947e-13
        && subnormal != 0.0;
    // (1 + 2^-12)^2 is 1 + 2^-11 in f32. A fused operation or extra digits give 2^-24 more.
    let [root, square] = black_box([1.000_244_1_f32, 1.000_488_3]);
    let rounds_once = root * root - square == 0.0 && (one + 0.25 * step) - one == 0.0;
    is_nearest && keeps_subnormals && rounds_once
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_numbers_of_the_check_are_the_powers_of_two_that_its_comments_say() {
        let exponent = |number: f32| libm::frexpf(number);
        for (number, power) in [(5.960_464_5e-8, -24), (1.192_092_9e-7, -23), (1.267_650_6e30, 100)] {
            assert_eq!(exponent(number), (0.5, power + 1));
        }
        assert_eq!(exponent(f32::from_bits(1 << 9)), (0.5, -139));
        assert_eq!(exponent(9.094_947e-13), (0.5, -39));
        assert_eq!((exponent(1.000_244_1 - 1.0), exponent(1.000_488_3 - 1.0)), ((0.5, -11), (0.5, -10)));
        assert!(super::modes_ok());
    }
}
