//! Assembly ticks in a Rust program: the files that `host-sim export --asm` wrote from `joint.toml`, `motor.toml` and
//! `drive.toml` in this folder, and the designs of their exports.
//!
//! One line includes such a file, and a block declares the called functions. A struct represents the state as in the
//! exported header: numbers in their order, then two flags. References fulfil the rule of the header that no two places
//! overlap. The image `assembly` compares every bit with the Rust tick, and the image `budget` measures the functions.

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

/// State of an assembly tick; the first valid sample fills it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct State<const NUMBERS: usize> {
    numbers: [f32; NUMBERS],
    resuming: bool,
    started: bool,
}

impl<const NUMBERS: usize> State<NUMBERS> {
    /// State before the start.
    pub const ZEROS: Self = Self { numbers: [0.0; NUMBERS], resuming: false, started: false };
}

/// Outputs of an assembly tick besides its health.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct TickOutput {
    /// Output u, to hold until the next tick.
    pub u: f32,
    /// Sliding variable sigma, Eq. (44).
    pub sigma: f32,
    /// Reaching variable sigma*, Eq. (17).
    pub sigma_star: f32,
}

/// State with observers of order 2.
pub type State2 = State<10>;
/// State with observers of order 3.
pub type State3 = State<12>;

/// State of a drive; zeros before the start.
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
    /// State before the start.
    pub const ZEROS: Self = Self {
        numbers: [0.0; NUMBERS],
        counts: [0; COUNTS],
        missed: [0.0; ENCODERS],
        off: [0.0; ENCODERS],
        fresh: false,
        started: false,
    };
}

/// State of a motor's drive.
pub type MotorState = DriveState<9, 3, 1>;
/// State of a joint's drive.
pub type JointState = DriveState<16, 5, 2>;

/// Target of a drive at one instant: whole revolutions, and an angle with its derivatives.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct DriveTarget<const N: usize> {
    turn: i32,
    jet: [f32; N],
}

/// Inputs of a drive's tick.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct DriveSample<const N: usize, const ENCODERS: usize> {
    counts: [u32; ENCODERS],
    lost: [bool; ENCODERS],
    begin: DriveTarget<N>,
    end: DriveTarget<N>,
}

/// Inputs of a motor's drive.
pub type MotorSample = DriveSample<2, 1>;
/// Inputs of a joint's drive.
pub type JointSample = DriveSample<4, 2>;

/// Converts a sample of the Rust drive to the layout of the exported header.
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

// SAFETY: names, arguments and results match the exported headers, which belong to the files included by `global_asm!`.
unsafe extern "C" {
    /// Initialises the state before the first tick from its sample; returns false if the sample is invalid.
    pub safe fn joint_r2_start(state: &mut State2, x: &[f32; 4]) -> bool;
    /// Runs one tick; returns u.
    pub safe fn joint_r2_tick_u(state: &mut State2, x: &[f32; 4]) -> f32;
    /// Runs one tick; writes the whole output and returns the health bits.
    pub safe fn joint_r2_tick(state: &mut State2, x: &[f32; 4], told: &mut TickOutput) -> u32;
    /// Reports the value that the actuator holds instead of u; returns false if the number is rejected.
    pub safe fn joint_r2_report_applied(state: &mut State2, u: f32) -> bool;
    /// Initialises the state of order 3 before the first tick; returns false if the sample is invalid.
    pub safe fn joint_r3_start(state: &mut State3, x: &[f32; 4]) -> bool;
    /// Runs one tick of order 3; returns u.
    pub safe fn joint_r3_tick_u(state: &mut State3, x: &[f32; 4]) -> f32;
    /// Runs one tick of order 3; writes the whole output and returns the health bits.
    pub safe fn joint_r3_tick(state: &mut State3, x: &[f32; 4], told: &mut TickOutput) -> u32;
    /// Reports the held actuator value for order 3; returns false if the number is rejected.
    pub safe fn joint_r3_report_applied(state: &mut State3, u: f32) -> bool;
    /// Initialises the state of a motor's drive; returns false if the sample is invalid.
    pub safe fn motor_start(state: &mut MotorState, sample: &MotorSample) -> bool;
    /// Runs one tick of a motor's drive; returns u.
    pub safe fn motor_tick_u(state: &mut MotorState, sample: &MotorSample) -> f32;
    /// Runs one tick of a motor's drive; writes the whole output and returns the health bits.
    pub safe fn motor_tick(state: &mut MotorState, sample: &MotorSample, told: &mut TickOutput) -> u32;
    /// Reports the held current of a motor's drive; returns false if the number is rejected.
    pub safe fn motor_report_applied(state: &mut MotorState, u: f32) -> bool;
    /// Initialises the state of a joint's drive; returns false if the sample is invalid.
    pub safe fn joint_drive_start(state: &mut JointState, sample: &JointSample) -> bool;
    /// Runs one tick of a joint's drive; returns u.
    pub safe fn joint_drive_tick_u(state: &mut JointState, sample: &JointSample) -> f32;
    /// Runs one tick of a joint's drive; writes the whole output and returns the health bits.
    pub safe fn joint_drive_tick(state: &mut JointState, sample: &JointSample, told: &mut TickOutput) -> u32;
    /// Reports the held current of a joint's drive; returns false if the number is rejected.
    pub safe fn joint_drive_report_applied(state: &mut JointState, u: f32) -> bool;
}

/// Controller of the exported files, with observers of order R in channels 2 and 4.
pub type Joint<const R: usize> = Controller<f32, FlexibleJoint<f32>, 4, R, { channels(4, 2, [2, 4]) }, 2>;

/// Nominal model of the joint.
pub const NOMINAL: Nominal<4> = JointParameters::TABLE_I.chain(Reading::Reconstructed).nominal();

/// Returns the controller, designed by the compiler.
pub const fn joint<const R: usize>() -> Joint<R> {
    Joint::<R>::design(&config(channels(4, 2, [2, 4]), NOMINAL), FlexibleJoint::<f32>::new(&NOMINAL))
}

/// Design of the drive in `motor.S`: as `firmware/motor.toml`, except period and gain sets. Its innovation gate is for
/// one gain set.
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

/// Design of the drive in `joint_drive.S`: as `firmware/drive.toml`, except period and gain sets.
pub const JOINT_DRIVE: JointDesign = JointDesign {
    fallback: Fallback::Safe(0.0),
    ..JointDesign::new(1e-3, JointData::TABLE_I, [Encoder::absolute(20); 2], Limits::symmetric(30.0), 1.3)
};

/// Returns the common configuration of all measured ticks; one observer per bit of the mask.
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
