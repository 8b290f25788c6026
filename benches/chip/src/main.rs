//! Image with functions to measure: `cargo xtask bench` reads their machine code and traces their execution in the
//! emulator.
//!
//! Every subject is a separate function, called with equal samples, and with coefficients and state by reference. The C
//! versions are such functions already; their exponential comes from `libm`, and no C library is linked. The crates
//! `idsp` and `pid` contain no observer and no sliding mode: they show the cost of a much simpler controller.
#![no_std]
#![no_main]

#[allow(dead_code, unreachable_pub, reason = "a module of the firmware, whose images use the rest")]
#[path = "../../../firmware/src/assembly.rs"]
mod assembly;

use core::hint::black_box;

use assembly::{
    State, TickOutput, joint_r2_start, joint_r2_tick, joint_r2_tick_u, joint_r3_start, joint_r3_tick, joint_r3_tick_u,
};
use benches::{Joint, Naive, Noise, Tuned, joint};
use controller_core::ControlLaw;
use cortex_m_semihosting::debug;
use dsp_process::SplitProcess;
use idsp::iir::{Biquad, BiquadClamp, DirectForm1};
use pid::Pid;

/// Enough ticks for every code path: the log of all executed instructions has some 90 bytes per instruction.
const TICKS: u32 = 200;

static JOINT_2: Joint<f32, 2> = joint();
static JOINT_3: Joint<f32, 3> = joint();

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn shipped_tick_2(
    joint: &Joint<f32, 2>,
    state: &mut <Joint<f32, 2> as ControlLaw>::State,
    x: &[f32; 4],
) -> f32 {
    joint.tick(state, x).u
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn shipped_tick_3(
    joint: &Joint<f32, 3>,
    state: &mut <Joint<f32, 3> as ControlLaw>::State,
    x: &[f32; 4],
) -> f32 {
    joint.tick(state, x).u
}

/// Second-order section with the coefficients of a PID controller of one error, with an offset and limits.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn idsp_biquad(filter: &BiquadClamp<f32>, state: &mut DirectForm1<f32>, x: f32) -> f32 {
    filter.process(state, x)
}

/// Proportional, integral and derivative terms of one error, each limited, and their limited sum.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn pid_step(controller: &mut Pid<f32>, x: f32) -> f32 {
    controller.next_control_output(x).output
}

/// Exponential for the naive C version.
#[unsafe(no_mangle)]
extern "C" fn expf(x: f32) -> f32 {
    libm::expf(x)
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut noise = Noise::new(1);
    let first = noise.sample();
    let (joint_2, joint_3) = (black_box(&JOINT_2), black_box(&JOINT_3));
    let (Some(mut state_2), Some(mut state_3)) = (joint_2.start(&first), joint_3.start(&first)) else {
        end(debug::EXIT_FAILURE)
    };
    let mut naive_2 = Naive::<2, false>::new();
    let mut naive_3 = Naive::<3, false>::new();
    let mut naive_fast_2 = Naive::<2, true>::new();
    let mut naive_fast_3 = Naive::<3, true>::new();
    let mut tuned_2 = Tuned::<2, false>::start(&first);
    let mut tuned_3 = Tuned::<3, false>::start(&first);
    let mut tuned_guarded_2 = Tuned::<2, true>::start(&first);
    let mut tuned_guarded_3 = Tuned::<3, true>::start(&first);
    let (mut renamed_2, mut renamed_3) = (tuned_guarded_2, tuned_guarded_3);
    // The first tick uses the sibling function: a tick after a start takes longer than an ordinary one.
    let (mut scheduled_2, mut scheduled_3) = (State::ZEROS, State::ZEROS);
    joint_r2_start(&mut scheduled_2, &first);
    joint_r2_tick(&mut scheduled_2, &first, &mut TickOutput::default());
    joint_r3_start(&mut scheduled_3, &first);
    joint_r3_tick(&mut scheduled_3, &first, &mut TickOutput::default());
    let filter = BiquadClamp { coeff: Biquad { ba: [3.0, -5.0, 2.1, 1.5, -0.5] }, u: 0.0, min: -300.0, max: 300.0 };
    let filter = black_box(&filter);
    let mut filter_state = DirectForm1::default();
    let mut pid = Pid::new(0.0, 300.0);
    pid.p(40.0, 300.0).i(0.5, 100.0).d(900.0, 200.0);

    for _ in 0..TICKS {
        let x = &black_box(noise.sample());
        black_box(shipped_tick_2(joint_2, &mut state_2, x));
        black_box(shipped_tick_3(joint_3, &mut state_3, x));
        black_box(joint_r2_tick_u(&mut scheduled_2, x));
        black_box(joint_r3_tick_u(&mut scheduled_3, x));
        black_box(naive_2.tick(x));
        black_box(naive_3.tick(x));
        black_box(naive_fast_2.tick(x));
        black_box(naive_fast_3.tick(x));
        black_box(tuned_2.tick(x));
        black_box(tuned_3.tick(x));
        black_box(tuned_guarded_2.tick(x));
        black_box(tuned_guarded_3.tick(x));
        black_box(renamed_2.tick_renamed(x));
        black_box(renamed_3.tick_renamed(x));
        black_box(idsp_biquad(filter, &mut filter_state, x[0]));
        black_box(pid_step(&mut pid, x[0]));
    }
    end(debug::EXIT_SUCCESS)
}

/// Ends the run of the emulator; a board without a debugger stops here by a fault.
fn end(status: debug::ExitStatus) -> ! {
    loop {
        debug::exit(status);
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    end(debug::EXIT_FAILURE)
}
