//! Closed loops of the joint in C, on the host: the hand-written tick, and the plant by Runge-Kutta of order 4.
//!
//! $v = 1 + \sin 2t$ acts at the input. The result, the largest |y| towards the end, is also a metric of the Rust
//! simulation, so all programs can be compared.

use core::ffi::c_void;

use controller_core::JointChain;

use crate::{Joint, Tuned};

/// C type `struct closed_loop` of `c/loop.h`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ClosedLoop {
    joint: [f64; 6],
    period_s: f64,
    x1: f64,
    periods: i32,
    from: i32,
    steps: i32,
}

/// Instruction set of 32 parallel loops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum Beside {
    /// Baseline instructions of x86-64.
    Sse2,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512.
    Avx512,
    /// AVX-512 with reordered sums.
    Fast,
}

impl ClosedLoop {
    /// Number of plants in parallel.
    pub const BESIDE: usize = 32;

    /// Creates a loop from x = (x1, 0, 0, 0) over these periods, with |y| from tick `from` on, and `steps` plant steps
    /// per tick.
    ///
    /// # Panics
    /// A count does not fit into a C `int`.
    pub fn new(joint: &JointChain, period_s: f64, x1: f64, [periods, from, steps]: [usize; 3]) -> Self {
        let JointChain { k1, b1, k2, b2, b, a1 } = *joint;
        let [periods, from, steps] = [periods, from, steps].map(|count| i32::try_from(count).expect("an int"));
        Self { joint: [k1, b1, a1, k2, b2, b], period_s, x1, periods, from, steps }
    }

    /// Returns k_1, b_1, a_1, k_2, b_2, b.
    pub fn joint(&self) -> [f64; 6] {
        self.joint
    }

    /// Runs one loop; returns max |y|, rad.
    pub fn alone(&self, law: &Joint<f32, 2>) -> f64 {
        let Tuned { design, mut state } = self.started(law);
        // SAFETY: the structs match c/loop.h and c/law.h and live through the call.
        unsafe { closed_loop_alone(self, (&raw const design).cast(), (&raw mut state).cast()) }
    }

    /// Runs [`BESIDE`](Self::BESIDE) loops; returns max |y| of all, or `None` if this machine lacks the instructions.
    pub fn beside(&self, instructions: Beside, law: &Joint<f32, 2>) -> Option<f64> {
        let Tuned { design, state } = self.started(law);
        // SAFETY: as in `alone`; the C side checks the instructions of the machine.
        let largest = unsafe {
            closed_loops_beside(instructions as i32, self, (&raw const design).cast(), (&raw const state).cast())
        };
        (!largest.is_nan()).then_some(largest)
    }

    fn started(&self, law: &Joint<f32, 2>) -> Tuned<2, true> {
        Tuned::of(law, &[self.x1 as f32, 0.0, 0.0, 0.0])
    }
}

unsafe extern "C" {
    fn closed_loop_alone(asked: &ClosedLoop, design: *const c_void, state: *mut c_void) -> f64;
    fn closed_loops_beside(way: i32, asked: &ClosedLoop, design: *const c_void, state: *const c_void) -> f64;
}
