//! The floating-point modes that a tick assumes, and a check of them at start-up.
//!
//! Every number of this crate supposes IEEE 754 arithmetic in its own precision: rounding to nearest with ties to even,
//! subnormal numbers kept, one rounding per operation. The modes are state of the machine and not of a program: another
//! part of it may have changed them, and each context may have its own.
//!
//! | machine | assumed | who changes it |
//! |---|---|---|
//! | Cortex-M with FPU, thread | FPSCR: RMode = 00, FZ = 0 (as after reset) | start-up code, libraries |
//! | Cortex-M with FPU, interrupt | FPDSCR: RMode = 00, FZ = 0: a handler's FPSCR begins as it | start-up code |
//! | the same | FPCCR: ASPEN = 1 (LSPEN as you like), or a handler spoils other floats | start-up code, an RTOS |
//! | x86-64 | MXCSR: RC = 00, FTZ = 0, DAZ = 0 | `fesetround`; linking with `-ffast-math` sets FTZ and DAZ |
//!
//! FPSCR.DN chooses the bits of a NaN and FPSCR.AHP a format that no tick uses: no finite result depends on them. ASPEN
//! is seen by no arithmetic: it is for a look at the register.
//!
//! Under other modes the outputs have other bits than those that were tested and proved. What is left then, the test
//! module `modes` shows: u stays within its limits and is a number, and a reset gives the state that it always gives.

use core::hint::black_box;

/// Does arithmetic in f32 round to nearest, ties to even, once per operation, and keep subnormal numbers, here and now?
///
/// Call it once at start-up, from the context in which the tick runs: on a Cortex-M an interrupt has modes of its own.
/// Some 25 operations; no tick calls it.
///
/// ```
/// assert!(controller_core::modes_ok());
/// ```
#[inline(never)]
#[must_use]
pub fn modes_ok() -> bool {
    let [one, half_step, step] = black_box([1.0_f32, 5.960_464_5e-8, 1.192_092_9e-7]);
    // Halves of a step go to the even neighbour, less than half is lost, both ways.
    let is_nearest = one + half_step == one
        && (one + step) + half_step == one + (step + step)
        && one + 0.75 * half_step == one
        && one - 0.25 * half_step == one
        && -one - 0.75 * half_step == -one;
    // 2^-126 is the smallest normal number: a half of it is none; 2^-140 is none either.
    let [smallest, subnormal] = black_box([f32::MIN_POSITIVE, f32::from_bits(1 << 9)]);
    let [half, much] = black_box([0.5_f32, 1.267_650_6e30]);
    let half_of_it = black_box(smallest * half);
    let keeps_subnormals = half_of_it + half_of_it == smallest
        && smallest - half_of_it == half_of_it
        && subnormal * much == 9.094_947e-13
        && subnormal != 0.0;
    // (1 + 2^-12)^2 is 1 + 2^-11 in f32, and 2^-24 more in a fused operation or with more digits.
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
