//! The tick as assembly in a program of Rust: files that `host-sim export --asm` wrote of `joint.toml`, `motor.toml`
//! and `drive.toml` in this folder, and the designs that they were written of.
//!
//! One line takes such a file, a block declares what is called of it, and a struct is its state as the exported header
//! has it: numbers in their order, then two flags. A reference says what the header asks for: no two places overlap.
//! `assembly` is the image that holds every bit to the Rust tick, `budget` the one in which it is measured.

use core::arch::global_asm;

use controller_core::drive::{Encoder, Joint as JointData, JointDesign, Motor, MotorDesign, Sample, Target};
use controller_core::{
    Config, Controller, Fallback, FlexibleJoint, JointParameters, Limits, Nominal, ObserverGains, Options, ReachingLaw,
    Reading, Surface, channels,
};

global_asm!(include_str!("assembly/joint_r2.S"), options(raw));
global_asm!(include_str!("assembly/joint_r3.S"), options(raw));
global_asm!(include_str!("assembly/motor.S"), options(raw));
global_asm!(include_str!("assembly/joint_drive.S"), options(raw));

/// What a tick of assembly remembers; the first good sample fills it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct State<const NUMBERS: usize> {
    numbers: [f32; NUMBERS],
    resuming: bool,
    started: bool,
}

impl<const NUMBERS: usize> State<NUMBERS> {
    /// Before the start.
    pub const ZEROS: Self = Self { numbers: [0.0; NUMBERS], resuming: false, started: false };
}

/// What a tick tells beside its health.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Told {
    /// To hold until the next tick.
    pub u: f32,
    /// Eq. (44).
    pub sigma: f32,
    /// Eq. (17).
    pub sigma_star: f32,
}

/// The state with observers of order 2.
pub type State2 = State<10>;
/// The state with observers of order 3.
pub type State3 = State<12>;

/// What a drive remembers; zeros before the start.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct DriveState<const NUMBERS: usize, const COUNTS: usize, const ENCODERS: usize> {
    numbers: [f32; NUMBERS],
    counts: [u32; COUNTS],
    missed: [f32; ENCODERS],
    off: [f32; ENCODERS],
    fresh: bool,
    started: bool,
}

impl<const NUMBERS: usize, const COUNTS: usize, const ENCODERS: usize> DriveState<NUMBERS, COUNTS, ENCODERS> {
    /// Before the start.
    pub const ZEROS: Self = Self {
        numbers: [0.0; NUMBERS],
        counts: [0; COUNTS],
        missed: [0.0; ENCODERS],
        off: [0.0; ENCODERS],
        fresh: false,
        started: false,
    };
}

/// That of a motor.
pub type MotorState = DriveState<9, 3, 1>;
/// That of a joint.
pub type JointState = DriveState<16, 5, 2>;

/// Where a drive should be at one instant: whole turns, and an angle with its derivatives.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct DriveTarget<const N: usize> {
    turn: i32,
    jet: [f32; N],
}

/// What comes in once per tick of a drive.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct DriveSample<const N: usize, const ENCODERS: usize> {
    counts: [u32; ENCODERS],
    lost: [bool; ENCODERS],
    begin: DriveTarget<N>,
    end: DriveTarget<N>,
}

/// That of a motor.
pub type MotorSample = DriveSample<2, 1>;
/// That of a joint.
pub type JointSample = DriveSample<4, 2>;

/// A sample of the Rust drive as the exported header has it.
impl<const N: usize, const ENCODERS: usize> From<&Sample<i32, Target<f32, i32, N>, ENCODERS>>
    for DriveSample<N, ENCODERS>
{
    fn from(sample: &Sample<i32, Target<f32, i32, N>, ENCODERS>) -> Self {
        let target = |of: &Target<f32, i32, N>| DriveTarget { turn: of.turn, jet: of.jet };
        Self {
            counts: sample.counts.map(|count| count.unwrap_or_default() as u32),
            lost: sample.counts.map(|count| count.is_none()),
            begin: target(&sample.begin),
            end: target(&sample.end),
        }
    }
}

// SAFETY: names, arguments and answers are those of the exported headers, which `global_asm!` has just assembled.
unsafe extern "C" {
    /// Before the first tick, from its sample; false if that is not good enough.
    pub safe fn joint_r2_start(state: &mut State2, x: &[f32; 4]) -> bool;
    /// One tick: u alone.
    pub safe fn joint_r2_tick_u(state: &mut State2, x: &[f32; 4]) -> f32;
    /// One tick: the whole output, and the health as bits.
    pub safe fn joint_r2_tick(state: &mut State2, x: &[f32; 4], told: &mut Told) -> u32;
    /// What the actuator holds instead of u; false if the number is not taken.
    pub safe fn joint_r2_report_applied(state: &mut State2, u: f32) -> bool;
    /// The same of order 3.
    pub safe fn joint_r3_start(state: &mut State3, x: &[f32; 4]) -> bool;
    /// The same of order 3.
    pub safe fn joint_r3_tick_u(state: &mut State3, x: &[f32; 4]) -> f32;
    /// The same of order 3.
    pub safe fn joint_r3_tick(state: &mut State3, x: &[f32; 4], told: &mut Told) -> u32;
    /// The same of order 3.
    pub safe fn joint_r3_report_applied(state: &mut State3, u: f32) -> bool;
    /// The same of a motor's drive.
    pub safe fn motor_start(state: &mut MotorState, sample: &MotorSample) -> bool;
    /// The same of a motor's drive.
    pub safe fn motor_tick_u(state: &mut MotorState, sample: &MotorSample) -> f32;
    /// The same of a motor's drive.
    pub safe fn motor_tick(state: &mut MotorState, sample: &MotorSample, told: &mut Told) -> u32;
    /// The same of a motor's drive.
    pub safe fn motor_report_applied(state: &mut MotorState, u: f32) -> bool;
    /// The same of a joint's drive.
    pub safe fn joint_drive_start(state: &mut JointState, sample: &JointSample) -> bool;
    /// The same of a joint's drive.
    pub safe fn joint_drive_tick_u(state: &mut JointState, sample: &JointSample) -> f32;
    /// The same of a joint's drive.
    pub safe fn joint_drive_tick(state: &mut JointState, sample: &JointSample, told: &mut Told) -> u32;
    /// The same of a joint's drive.
    pub safe fn joint_drive_report_applied(state: &mut JointState, u: f32) -> bool;
}

/// The controller that the files were exported of, observers of order R in channels 2 and 4.
pub type Joint<const R: usize> = Controller<f32, FlexibleJoint<f32>, 4, R, { channels(4, 2, [2, 4]) }, 2>;

/// What its design knows of the joint.
pub const NOMINAL: Nominal<4> = JointParameters::TABLE_I.chain(Reading::Reconstructed).nominal();

/// It, designed by the compiler.
pub const fn joint<const R: usize>() -> Joint<R> {
    Joint::<R>::design(&config(channels(4, 2, [2, 4]), NOMINAL), FlexibleJoint::<f32>::new(&NOMINAL))
}

/// What the drive of `motor.S` is designed from: as `firmware/motor.toml`, but for period and gain sets. Its gate is
/// for one set.
pub const MOTOR: MotorDesign = {
    let by_rule = MotorDesign::by_rule(
        1e-3,
        Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 },
        Encoder::absolute(14),
        Limits::symmetric(10.0),
    );
    let one_set = MotorDesign { fallback: Fallback::Safe(0.0), fast_ratio: 1.0, ..by_rule };
    one_set.with_bandwidths(by_rule.bandwidths)
};

/// What the drive of `joint_drive.S` is designed from: as `firmware/drive.toml`, but for period and gain sets.
pub const JOINT_DRIVE: JointDesign = JointDesign {
    fallback: Fallback::Safe(0.0),
    ..JointDesign::new(1e-3, JointData::TABLE_I, [Encoder::absolute(20); 2], Limits::symmetric(30.0), 1.3)
};

/// What all ticks that are measured have in common; one observer for each bit of the mask.
pub const fn config<const N: usize, const R: usize>(mask: u8, nominal: Nominal<N>) -> Config<N, R> {
    let mut observers = [None; N];
    let mut i = 0;
    while i < N {
        if mask >> i & 1 == 1 {
            observers[i] = Some(ObserverGains::from_bandwidth::<R>(100.0));
        }
        i += 1;
    }
    Config {
        period_s: 1e-4,
        surface: Surface::from_bandwidth(10.0, 10.0),
        observers,
        reaching: ReachingLaw { k_l: 50.0, k_s: 0.5, epsilon: 0.01 },
        nominal,
        options: Options::NEUTRAL.with_limits(Limits::symmetric(300.0)).with_sigma_star_bound(10.0),
    }
}
