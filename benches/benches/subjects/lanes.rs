//! The tick of the joint, r = 2, over [`L`] plants at once: the same loop for the instructions that every x86-64 has
//! (SSE2) and for AVX2. Every lane has the bits of the tick (test `running` of the suite); here is what it costs.

use benches::Joint;
use controller_core::{Lanes, Output};

/// Plants side by side.
pub(crate) const L: usize = 64;
/// Their states.
pub(crate) type States = Lanes<f32, controller_core::FlexibleJoint<f32>, 4, 2, 0b1010, 2, L>;

/// One tick of all, with the instruction set that the caller has.
#[inline(always)]
pub(crate) fn tick_all(joint: &Joint<f32, 2>, states: &mut States, x: &[[f32; L]; 4], u: &mut [f32; L]) {
    for l in 0..L {
        let output: Output<f32> = joint.tick_lane(states, l, &[x[0][l], x[1][l], x[2][l], x[3][l]]);
        u[l] = output.u;
    }
}

/// With what every x86-64 has.
#[inline(never)]
pub(crate) fn lanes_baseline(joint: &Joint<f32, 2>, states: &mut States, x: &[[f32; L]; 4], u: &mut [f32; L]) {
    tick_all(joint, states, x, u);
}

/// With AVX2 where the machine has it.
#[inline(never)]
#[multiversion::multiversion(targets("x86_64+avx2+fma+bmi1+bmi2"))]
pub(crate) fn lanes_avx2(joint: &Joint<f32, 2>, states: &mut States, x: &[[f32; L]; 4], u: &mut [f32; L]) {
    tick_all(joint, states, x, u);
}
