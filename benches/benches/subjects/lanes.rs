//! Tick of the joint, r = 2, over [`L`] plants at once: one loop for the baseline instructions of x86-64 (SSE2) and for
//! AVX2. Every lane is bit-identical to the tick (test `running` of the suite); this module measures the cost.

use benches::Joint;
use controller_core::{Lanes, Output};

/// Number of plants in a batch.
pub(crate) const L: usize = 64;
/// States of all plants.
pub(crate) type States = Lanes<f32, controller_core::FlexibleJoint<f32>, 4, 2, 0b1010, 2, L>;

/// Runs one tick of all plants, with the instruction set of the caller.
#[inline(always)]
pub(crate) fn tick_all(joint: &Joint<f32, 2>, states: &mut States, x: &[[f32; L]; 4], u: &mut [f32; L]) {
    for l in 0..L {
        let output: Output<f32> = joint.tick_lane(states, l, &[x[0][l], x[1][l], x[2][l], x[3][l]]);
        u[l] = output.u;
    }
}

/// Runs one tick with the baseline instructions of x86-64.
#[inline(never)]
pub(crate) fn lanes_baseline(joint: &Joint<f32, 2>, states: &mut States, x: &[[f32; L]; 4], u: &mut [f32; L]) {
    tick_all(joint, states, x, u);
}

/// Runs one tick with AVX2, if the machine has it.
#[inline(never)]
#[multiversion::multiversion(targets("x86_64+avx2+fma+bmi1+bmi2"))]
pub(crate) fn lanes_avx2(joint: &Joint<f32, 2>, states: &mut States, x: &[[f32; L]; 4], u: &mut [f32; L]) {
    tick_all(joint, states, x, u);
}
