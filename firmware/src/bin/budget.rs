//! Cost of one tick per instance: the code, the state and the coefficients that `budgets.toml` limits, and a log of the
//! stopwatch.
//!
//! Every instance is a separate module, so each of its parts has a symbol: `tick`, called by reference as in a firmware
//! and never inlined here, `CONTROLLER` in flash and `STATE` in RAM. The generic code of the library is inlined into
//! each `tick`.
//!
//! The first line of the log has its unit: cycles on a chip, instructions under
//! `qemu-system-arm -icount shift=0,sleep=off`. The stopwatch includes the call and excludes its own reading.
//! `host-sim budget --ceilings` uses the machine code and the executed instructions of the emulator instead, and counts
//! the tick alone. All samples are valid, within the limits of u and beyond. The bound covers the cost of an invalid
//! sample.
#![no_std]
#![no_main]

use core::cell::UnsafeCell;
use core::hint::black_box;
use core::mem::MaybeUninit;

use controller_core::drive::{
    Aim, CoupledDrive, DriveLaw, FullState, Hold, Joint as JointData, JointDrive, JointModel, Measured, Monitored,
    MotorDrive, Position, Speed, Target, WatchTicks, sin_cos,
};
use controller_core::{
    Benchmark, ControlLaw, Controller, Exp, FlexibleJoint, Gate, Gated, Libm, Micromath, NominalModel, Output,
    SampleLimits, channels,
};
use cortex_m::asm;
use firmware::assembly::{
    JointSample, JointState, MotorSample, MotorState, NOMINAL, State, TickOutput, config, joint_drive_start,
    joint_drive_tick, joint_drive_tick_u, joint_r2_start, joint_r2_tick, joint_r2_tick_u, joint_r3_start,
    joint_r3_tick, joint_r3_tick_u, motor_start, motor_tick, motor_tick_u,
};
use firmware::{clock, log};
use stm32f4::stm32f405::Peripherals;

// Designs of the specifications that the machine code is validated against.
#[path = "../../../tick-record/src/bin/tick-record/designs.rs"]
mod designs;
use designs::{JOINT_DRIVE, JOINT_WHOLE, MOTOR, Nothing, VaryingGain};

/// Calls of each instance with valid samples: enough for saturation, few enough for a log of every instruction.
const TICKS: u32 = 200;

/// A state in RAM without further data, so that the symbol has its exact size.
#[repr(transparent)]
struct Place<S>(UnsafeCell<MaybeUninit<S>>);

// SAFETY: only `put` hands out the contents, and its caller guarantees exclusive use.
unsafe impl<S> Sync for Place<S> {}

impl<S> Place<S> {
    const fn empty() -> Self {
        Self(UnsafeCell::new(MaybeUninit::uninit()))
    }

    /// Writes a state into the place and returns a reference to it.
    ///
    /// # Safety
    /// At most one call for each place.
    #[allow(clippy::mut_from_ref)]
    unsafe fn put(&self, state: S) -> &mut S {
        // SAFETY: the caller guarantees that no other reference exists, now or later.
        unsafe { (*self.0.get()).write(state) }
    }
}

/// Defines one module per instance. `tick.u -> f32` is a caller that uses only u of the output.
macro_rules! instances {
    ($($name:ident: $law:ty, $n:literal = $design:expr, $call:ident $(.$field:ident)? -> $answer:ty;)*) => {
        $(mod $name {
            #[allow(clippy::wildcard_imports)]
            use super::*;

            type Law = $law;
            static CONTROLLER: Law = $design;
            static STATE: Place<<Law as ControlLaw>::State> = Place::empty();

            #[inline(never)]
            fn tick(controller: &Law, state: &mut <Law as ControlLaw>::State, x: &[f32; $n]) -> $answer {
                controller.$call(state, x)$(.$field)?
            }

            pub(super) fn run() {
                measure(stringify!($name), &CONTROLLER, &STATE, tick, samples());
            }
        })*

        fn all() {
            $($name::run();)*
        }
    };
}

/// Defines modules for drives, whose inputs are counts or a measured state, and targets.
macro_rules! drives {
    ($($name:ident: $law:ty = $design:expr, $samples:expr;)*) => {
        $(mod $name {
            #[allow(clippy::wildcard_imports)]
            use super::*;

            type Law = $law;
            static CONTROLLER: Law = $design;
            static STATE: Place<<Law as ControlLaw>::State> = Place::empty();

            #[inline(never)]
            fn tick(law: &Law, state: &mut <Law as ControlLaw>::State, sample: &<Law as ControlLaw>::Sample) -> f32 {
                law.tick(state, sample).u
            }

            pub(super) fn run() {
                measure(stringify!($name), &CONTROLLER, &STATE, tick, $samples);
            }
        })*

        fn all_drives() {
            $($name::run();)*
        }
    };
}

/// Tolerated ticks of a frozen encoder, of motion in the wrong direction, at a limit, and of braking.
const PATIENCE: WatchTicks<f32> = WatchTicks { stuck: 200.0, wrong_way: 6.0, patience: 8.0, brake: 128.0 };

drives! {
    motor: MotorDrive = Law::design(&MOTOR), counts::<Law, 1, 2>();
    motor_two_sets: MotorDrive<f32, Position, 1> = Law::design(&MOTOR), counts::<Law, 1, 2>();
    motor_late: MotorDrive<f32, Position, 0, 1> = Law::design(&MOTOR), counts::<Law, 1, 2>();
    motor_speed: MotorDrive<f32, Speed> = Law::design(&MOTOR), counts::<Law, 1, 2>();
    joint_drive: JointDrive = Law::design(&JOINT_DRIVE), counts::<Law, 2, 4>();
    joint_drive_held: JointDrive<f32, Hold> = Law::design(&JOINT_DRIVE), counts::<Law, 2, 4>();
    joint_drive_two_sets: JointDrive<f32, Position, 1> = Law::design(&JOINT_DRIVE), counts::<Law, 2, 4>();
    joint_drive_late: JointDrive<f32, Position, 0, 1> = Law::design(&JOINT_DRIVE), counts::<Law, 2, 4>();
    joint_whole: CoupledDrive = Law::design(&JOINT_WHOLE), counts::<Law, 2, 4>();
    joint_whole_two_sets: CoupledDrive<f32, Position, 1> = Law::design(&JOINT_WHOLE), counts::<Law, 2, 4>();
    joint_whole_late: CoupledDrive<f32, Position, 0, 1> = Law::design(&JOINT_WHOLE), counts::<Law, 2, 4>();
    motor_watched: Monitored<MotorDrive, 1> =
        Law::from_parts(<MotorDrive>::design(&MOTOR), [1e6], 1e6, PATIENCE, 0.25).braking(), counts::<Law, 1, 2>();
    joint_drive_watched: Monitored<JointDrive, 2> =
        Law::from_parts(<JointDrive>::design(&JOINT_DRIVE), [1e6, 1e9], 1e9, PATIENCE, 0.25).braking(),
        counts::<Law, 2, 4>();
    joint_measured: Measuring<Position> = measuring(), measured::<Position>();
    joint_measured_held: Measuring<Hold> = measuring(), measured::<Hold>();
}

/// Control law of a joint over four measured states, with observers in channels 2, 3 and 4.
type Measuring<A> = FullState<f32, JointModel<f32>, A, 2, 4, 2, UPPER, 3, 0>;

const fn measuring<A>() -> Measuring<A> {
    let mut config = config::<4, 2>(UPPER, JointData::TABLE_I.model().nominal());
    config.period_s = 1e-3;
    match Measuring::try_design(&config, JointData::TABLE_I.model().in_f32()) {
        Ok(law) => law,
        Err(_) => panic!("a good design"),
    }
}

/// Returns samples with noise of some counts about 0, along a slowly moving target.
fn counts<L: DriveLaw<E, N>, const E: usize, const N: usize>() -> impl FnMut() -> L::Sample {
    let mut noise = Noise(1);
    let mut end = Target { turn: 0, jet: [0.0; N] };
    move || {
        let begin = end;
        end.jet[0] += 1e-6;
        L::sample(core::array::from_fn(|_| Some((40.0 * noise.next()) as i32)), &begin, &end)
    }
}

/// Returns measured states with noise about 0, along a slowly moving target.
fn measured<A: Aim<f32, 4>>() -> impl FnMut() -> Measured<f32, A::Target, 4> {
    let mut noise = Noise(1);
    let mut end = Target { turn: 0, jet: [0.0; 4] };
    move || {
        let begin = A::told(&end);
        end.jet[0] += 1e-6;
        Measured { x: [1e-4; 4].map(|size| size * noise.next()), begin, end: A::told(&end) }
    }
}

/// Defines modules for sine and cosine alone, from a drive's map and from `libm` (which computes in 64 bits), as
/// functions of an angle.
macro_rules! sines {
    ($($name:ident: $of:expr;)*) => {
        $(mod $name {
            #[allow(clippy::wildcard_imports)]
            use super::*;

            #[inline(never)]
            fn tick(x: f32) -> f32 {
                let (sine, cosine): (f32, f32) = $of(x);
                sine + cosine
            }

            pub(super) fn run() {
                let mut noise = Noise(1);
                for _ in 0..TICKS {
                    black_box(tick(black_box(3.0 * noise.next())));
                }
            }
        })*

        fn all_sines() {
            $($name::run();)*
        }
    };
}

sines! {
    sine: |x| sin_cos(x, 1.0);
    sine_libm: libm::sincosf;
}

/// Defines modules for the assembly ticks: the exported function itself is measured. The first tick uses the sibling
/// `tick`, because a tick after a start or a missing sample takes longer than an ordinary one.
macro_rules! assemblies {
    ($($name:ident: $state:expr, $samples:expr, $start:ident, $tick:ident, $tick_u:ident;)*) => {
        $(mod $name {
            #[allow(clippy::wildcard_imports)]
            use super::*;

            pub(super) fn run() {
                let mut sample = $samples;
                let (mut state, first) = ($state, sample());
                $start(&mut state, &first);
                $tick(&mut state, &first, &mut TickOutput::default());
                let overhead = clock::elapsed(|| {});
                log_costs(stringify!($name), || {
                    let sample = sample();
                    let (state, sample) = (black_box(&mut state), black_box(&sample));
                    clock::elapsed(|| {
                        black_box($tick_u(state, sample));
                    }) - overhead
                });
            }
        })*

        fn all_assemblies() {
            $($name::run();)*
        }
    };
}

assemblies! {
    joint_r2_assembly: State::ZEROS, samples(), joint_r2_start, joint_r2_tick, joint_r2_tick_u;
    joint_r3_assembly: State::ZEROS, samples(), joint_r3_start, joint_r3_tick, joint_r3_tick_u;
    motor_assembly: MotorState::ZEROS, motor_samples(), motor_start, motor_tick, motor_tick_u;
    joint_drive_assembly: JointState::ZEROS, joint_samples(), joint_drive_start, joint_drive_tick, joint_drive_tick_u;
}

/// Returns the samples of the row `motor`.
fn motor_samples() -> impl FnMut() -> MotorSample {
    let mut sample = counts::<MotorDrive, 1, 2>();
    move || MotorSample::from(&sample())
}

/// Returns the samples of the row `joint_drive`.
fn joint_samples() -> impl FnMut() -> JointSample {
    let mut sample = counts::<JointDrive, 2, 4>();
    move || JointSample::from(&sample())
}

const DRIVEN: u8 = channels(4, 1, [4]);
const BOTH: u8 = channels(4, 2, [2, 4]);
const UPPER: u8 = channels(4, 2, [2, 3, 4]);
const ALL: u8 = channels(4, 3, [1, 2, 3, 4]);
const OF_TWO: u8 = channels(2, 2, [1, 2]);

// Eq. (44) requires order n - i in channel i: order 1 suits the driven channel only, all four channels need order 3.
instances! {
    joint_r1: Of<Joint, 1, DRIVEN, 1>, 4 = joint(JOINT), tick.u -> f32;
    joint_r2: Of<Joint, 2, BOTH, 2>, 4 = joint(JOINT), tick.u -> f32;
    joint_r3: Of<Joint, 3, BOTH, 2>, 4 = joint(JOINT), tick.u -> f32;
    joint_r2_driven: Of<Joint, 2, DRIVEN, 1>, 4 = joint(JOINT), tick.u -> f32;
    joint_r3_all: Of<Joint, 3, ALL, 4>, 4 = joint(JOINT), tick.u -> f32;
    joint_r2_output: Of<Joint, 2, BOTH, 2>, 4 = joint(JOINT), tick -> Output<f32>;
    joint_r3_output: Of<Joint, 3, BOTH, 2>, 4 = joint(JOINT), tick -> Output<f32>;
    joint_r2_unguarded: Of<Joint, 2, BOTH, 2>, 4 = joint(JOINT), tick_unguarded.u -> f32;
    joint_r3_unguarded: Of<Joint, 3, BOTH, 2>, 4 = joint(JOINT), tick_unguarded.u -> f32;
    joint_r2_varying_gain: Of<VaryingGain<f32>, 2, BOTH, 2>, 4 = joint(VaryingGain(JOINT)), tick.u -> f32;
    joint_r2_gated: Gated<Of<Joint, 2, BOTH, 2>, 4>, 4 = Gated::new(joint(JOINT), GATE), tick.u -> f32;
    benchmark_libm: OfTwo<Libm>, 2 = benchmark(Benchmark::new()), tick.u -> f32;
    benchmark_micromath: OfTwo<Micromath>, 2 = benchmark(Benchmark::new()), tick.u -> f32;
    benchmark_without_exponential: OfTwo<Nothing>, 2 = benchmark(Benchmark::new()), tick.u -> f32;
}

type Of<M, const R: usize, const MASK: u8, const O: usize> = Controller<f32, M, 4, R, MASK, O>;
type OfTwo<E> = Controller<f32, Benchmark<E>, 2, 2, OF_TWO, 2>;
type Joint = FlexibleJoint<f32>;
const JOINT: Joint = Joint::new(&NOMINAL);

/// Limits that accept all measured samples.
const GATE: Gate<f32, 4> = Gate::<f32, 4>::new(&SampleLimits { min: [-12.0; 4], max: [12.0; 4], jump: [12.0; 4] });

const fn joint<M: NominalModel<f32, 4> + Copy, const R: usize, const MASK: u8, const O: usize>(
    model: M,
) -> Of<M, R, MASK, O> {
    Of::<M, R, MASK, O>::design(&config(MASK, NOMINAL), model)
}

/// Returns the controller of the benchmark, Eq. (59).
const fn benchmark<E: Exp<f32> + Copy>(model: Benchmark<E>) -> OfTwo<E> {
    let config = config(OF_TWO, Benchmark::<E>::nominal());
    OfTwo::<E>::design(&config, model)
}

/// Noise of ±1/2 from a linear congruential generator, as a trajectory without a plant: smaller than a spike, larger
/// than rest.
struct Noise(u32);

impl Noise {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / 16_777_216.0 - 0.5
    }
}

/// Returns samples of a chain with sizes 0.01, 0.1, 1, 10; each derivative is larger than the previous one.
fn samples<const N: usize>() -> impl FnMut() -> [f32; N] {
    let mut noise = Noise(1);
    let mut size = 0.001;
    let mut sizes = [0.0; N];
    for entry in &mut sizes {
        size *= 10.0;
        *entry = size;
    }
    move || sizes.map(|size| size * noise.next())
}

type Tick<C, Y> = fn(&C, &mut <C as ControlLaw>::State, &<C as ControlLaw>::Sample) -> Y;

/// Calls a tick by reference as a firmware does, hidden from the optimiser.
#[inline(never)]
fn measure<C: ControlLaw, Y>(
    name: &str,
    controller: &'static C,
    place: &'static Place<C::State>,
    tick: Tick<C, Y>,
    mut sample: impl FnMut() -> C::Sample,
) {
    let (controller, tick) = (black_box(controller), black_box(tick));
    let overhead = clock::elapsed(|| {});
    let x0 = sample();
    let Some(state) = controller.start(&x0) else { unreachable!() };
    // SAFETY: the macro gives every instance its own place, and `main` runs each instance once.
    let state = unsafe { place.put(state) };
    // A tick without its guard cannot handle the start, so the guarded tick runs first.
    controller.tick(state, &x0);
    log_costs(name, || {
        let x = sample();
        let (state, x) = (black_box(&mut *state), black_box(&x));
        clock::elapsed(|| {
            black_box(tick(controller, state, x));
        }) - overhead
    });
}

fn log_costs(name: &str, mut cost: impl FnMut() -> u32) {
    let (mut fewest, mut most, mut sum) = (u32::MAX, 0, 0);
    for _ in 0..TICKS {
        let took = cost();
        (fewest, most, sum) = (fewest.min(took), most.max(took), sum + took);
    }
    defmt::println!(
        "{=str}: min {=u32}, max {=u32}, mean {=f32} ({=u32} ticks)",
        name,
        fewest,
        most,
        sum as f32 / TICKS as f32,
        TICKS,
    );
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let (Some(core), Some(chip)) = (cortex_m::Peripherals::take(), Peripherals::take()) else { unreachable!() };
    log::start(chip.USART2, &chip.RCC, &chip.GPIOA);
    let unit = clock::start(core.DCB, core.DWT, chip.TIM2, &chip.RCC);
    defmt::println!("budget in {}", unit);
    all();
    all_assemblies();
    all_drives();
    all_sines();
    defmt::println!("budget ends");
    loop {
        asm::wfi();
    }
}
