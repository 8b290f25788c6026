//! Keys of a drive scenario: a motor or a flexible joint with encoders, following a reference.
//!
//! A file with the table `[motor]` or `[joint]` is a drive scenario. The data sheet refers to the motor shaft. All
//! other quantities (reference, load inertia, friction, load) refer to the output side of the gear. The controller's
//! model is the data sheet. The simulated plant differs from it by `[error]`, friction and torque ripple.

use controller_core::drive::RestLearning;
use schemars::JsonSchema;
use serde::Deserialize;

use super::{FallbackKey, TermTable};

mod build;
pub(super) mod coupled;
mod fence;
mod gear;
mod inertia;
pub(super) mod joint_rule;
mod margin;
mod planned;
mod play;
mod supply;
#[cfg(test)]
mod tests;

pub(super) use build::{joint, motor};
use margin::MarginKey;

table! {
/// One run of a motor with its drive. Keys without a default are required.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MotorScenario {
    /// Short name, used for the output folder: letters, digits, `_`, `-`, `.`. Default: the name of the file.
    pub name: Option<String>,
    /// One-line title of the output and the figures.
    pub title: Option<String>,
    /// Length of the run, s. Default 2.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub span_s: f64 = 2.0,
    /// Window [from, to] of the error metrics, s. Default: from the end of the transition onto the reference to the end
    /// of the run. For a move: from its start.
    pub window_s: Option<[f64; 2]>,
    /// Band of the error that counts as settled, rad; rad/s in mode speed. Default 0.005; in mode speed 2 % of the
    /// speed.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub settling_band: Option<f64>,
    /// Seed of the encoder noise and the jitter. Default 0.
    pub seed: u64,
    /// Data sheet.
    pub motor: MotorTable,
    /// Encoder of the motor.
    pub encoder: EncoderTable,
    /// Design of the controller.
    pub drive: MotorDriveTable,
    /// Reference of position or speed.
    pub reference: ReferenceTable,
    /// Alarm thresholds and reaction. Default: thresholds by rule, and alarms are only reported.
    pub monitor: MonitorTable,
    /// Limits of position, speed and following error. Default: no limits.
    pub limits: LimitsTable,
    /// Friction and torque ripple of the simulated motor. Default: none.
    pub friction: FrictionTable,
    /// Terms of a load torque against positive motion, behind the gear: amplitude in N m, slope in N m/s. Default none.
    #[schemars(length(max = 64))]
    pub load: Vec<TermTable>,
    /// Faults of encoder, power stage and interrupt, with their times. Default none.
    #[schemars(length(max = 64))]
    pub fault: Vec<FaultTable>,
    /// Deviation of the true motor from its data sheet.
    pub error: MotorErrorTable,
}
}

table! {
/// Data sheet of a motor and its rigid load.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MotorTable {
    /// Inertia of the rotor and of a load on its shaft, kg m^2, or [smallest, largest]: the design is for the geometric
    /// mean of a range. Required.
    #[schemars(with = "Option<AboveZero>")]
    pub inertia_kg_m2: Option<NumberOrRange>,
    /// Torque constant K_t, N m/A. Required.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub torque_n_m_per_a: Option<f64>,
    /// Current limit for both signs, A: the smaller of the peak current of the motor and the limit of the inverter, not
    /// the rated current. Peak or rms amperes, as for torque_n_m_per_a. Required.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_current_a: Option<f64>,
    /// Supply voltage, V. It limits the current at speed. For a three-phase motor with space-vector modulation and K_t
    /// per ampere of the peak of a phase: 0.866 of the bus voltage. Default: no limit.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub supply_v: Option<f64>,
    /// Winding resistance between the terminals, ohm; for a three-phase motor as above 1.5 times the resistance of a
    /// phase. Required with supply_v. Default with no_load_rad_s: max_current_a just flows at rest.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub resistance_ohm: Option<f64>,
    /// No-load speed of the motor shaft, rad/s, instead of supply_v.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub no_load_rad_s: Option<f64>,
    /// Viscous friction of the rotor, N m s/rad. Default 0.
    #[schemars(range(min = 0))]
    pub damping_n_m_s: f64,
    /// Gear ratio [motor revolutions, output revolutions]: [100, 1] is a reduction of 100. Default [1, 1]. With the
    /// encoder behind the gear any ratio is valid. Before the gear some are rejected, and the error names the nearest.
    #[schemars(inner(range(min = 1)))]
    pub gear: [u64; 2] = [1, 1],
    /// Inertia of the load behind the gear, kg m^2, or [smallest, largest]. Default 0.
    #[schemars(extend("default" = 0.0))]
    pub load_inertia_kg_m2: NumberOrRange,
    /// Backlash between motor and load, rad behind the gear from flank to flank. An encoder behind the gear then allows
    /// less bandwidth. Default 0.
    #[schemars(range(min = 0, max = 1))]
    pub play_rad: f64,
    /// Stiffness of the gear with backlash, N m/rad behind the gear. Default: load and motor oscillate on it at 75 Hz.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub gear_stiffness_n_m: Option<f64>,
    /// Time constant of the current loop, s; 0 for none. Default 2e-4.
    #[schemars(range(min = 0, max = 0.1))]
    pub current_lag_s: f64 = controller_core::drive::DEFAULT_LAG_S,
    /// Angle at t = 0, at rest, rad. Default 0.
    pub start_rad: f64,
}
}

/// A number or a range.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum NumberOrRange {
    /// One number.
    Number(#[schemars(range(min = 0))] f64),
    /// Smallest and largest number.
    Range(#[schemars(inner(range(min = 0)))] [f64; 2]),
}

impl NumberOrRange {
    /// Returns the number, or the middle of the range.
    pub(super) const fn middle(self) -> f64 {
        match self {
            Self::Number(number) => number,
            Self::Range([low, high]) => 0.5 * (low + high),
        }
    }
}

/// Schema of a [`NumberOrRange`] above 0.
#[derive(JsonSchema)]
#[schemars(untagged)]
#[expect(dead_code, reason = "what is read is a NumberOrRange")]
enum AboveZero {
    /// One number.
    Number(Positive),
    /// Smallest and largest number.
    Range([Positive; 2]),
}

#[derive(JsonSchema)]
#[schemars(inline, extend("exclusiveMinimum" = 0))]
#[expect(dead_code, reason = "a schema alone")]
struct Positive(f64);

impl Default for NumberOrRange {
    fn default() -> Self {
        Self::Number(0.0)
    }
}

/// Absolute or incremental encoder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct EncoderTable {
    /// Bits of the counter. Required unless states is given.
    #[schemars(range(min = 2, max = 32))]
    pub bits: Option<u32>,
    /// Number of states of the counter before it wraps, not necessarily a power of two: a timer with a reload value of
    /// 9999 has 10000. Default 2^bits; give it with counts_per_turn.
    #[schemars(range(min = 2, max = 4_294_967_296_u64))]
    pub states: Option<u64>,
    /// Counts per revolution of the encoder: four per line of an incremental encoder. Default 2^bits.
    #[schemars(range(min = 4, max = 16_777_216))]
    pub counts_per_turn: Option<u32>,
    /// True if the encoder is behind the gear, false if it is on the motor shaft. Default false. The encoder of a
    /// joint's link is always behind the gear.
    pub behind_gear: bool,
    /// True if the count decreases while the angle increases. Default false.
    pub reversed: bool,
    /// Count at angle 0. Default 0.
    pub offset_counts: i32,
    /// Standard deviation of white noise on the encoder angle before quantisation, rad. The rule for the bandwidth of a
    /// motor accounts for it. Default 0.
    #[schemars(range(min = 0, max = 1))]
    pub noise_rad: f64,
    /// Amplitude of the angle error with one period per revolution, as of a magnet off centre, rad. Default 0.
    #[schemars(range(min = 0, max = 0.2))]
    pub eccentricity_rad: f64,
}

table! {
/// Drive of a motor.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MotorDriveTable {
    /// Period T of the ticks, s. Default 1e-3.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub period_s: f64 = 1e-3,
    /// Control mode. Default position.
    pub mode: ModeKey = ModeKey::Position,
    /// Stability margin of the rule for the bandwidths: "fast", "standard", or the peak sensitivity of the base gains.
    /// Default "fast".
    pub margin: Option<MarginKey>,
    /// Closed-loop position bandwidth, rad/s; the observer and the reaching law scale with it. Default: by rule, from
    /// the encoder resolution and the loop delay (period, current loop, delay_ticks).
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub surface_rad_s: Option<f64>,
    /// Bandwidth of the disturbance observer, rad/s. Default: by rule.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub observer_rad_s: Option<f64>,
    /// Reaching gain k_l, 1/s: rate at which sigma* is driven to zero. Default: by rule, at most 1/period_s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub reaching_per_s: Option<f64>,
    /// Tolerance of inertia and torque constant, percent, at most 50. With a range of inertia: tolerance of the torque
    /// constant alone. Default 20.
    #[schemars(range(min = 0))]
    pub uncertain_percent: f64 = 20.0,
    /// True to allow the export of a drive that is unstable, nominally or within uncertain_percent. Default false.
    pub accept_unstable: bool,
    /// Number of gain sets. With 2, high gains are scheduled in on the observer innovation while a load acts. Default:
    /// 2 if uncertain_percent and the range of inertia are at most 20 %, else 1.
    #[schemars(range(min = 1, max = 2))]
    pub gain_sets: Option<usize>,
    /// Ratio of the observer bandwidths of the high and the base gains. Default 2.
    #[schemars(range(min = 1, max = 4))]
    pub fast_ratio: Option<f64>,
    /// Ticks from the computation of a current until it is applied, 0 to 3. Default 0.
    #[schemars(range(min = 0, max = 3))]
    pub delay_ticks: usize,
    /// Largest age of the count at its tick, s: uniform from 0, independent in each tick, at most period_s. Default 0.
    #[schemars(range(min = 0))]
    pub jitter_s: f64,
    /// States of the observer; 4 is for little friction and a motor known to 20 %. Default 3.
    #[schemars(range(min = 3, max = 4))]
    pub observer_states: usize = 3,
    /// Consecutive lost samples that are bridged by prediction. Default 50.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub lost_ticks: u32 = 50,
    /// Safe output after lost_ticks: "hold" (the last current) or a current, A. Default "hold".
    pub fallback: FallbackKey,
    /// Rest band: dead band of the position error at a resting target, against hunting in friction and limit cycles in
    /// backlash. Not used in mode speed. Default "learns".
    pub rest_band: Option<RestBandKey>,
}
}

/// Rest band: dead band of the position error at a resting target, and lower gains against limit cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RestBandKey {
    /// One count, or the error caused by 0.1 % of the torque. If the shaft hunts, the band widens up to six counts or
    /// 2 % of the torque. If the shaft oscillates, lower gains hold it.
    #[default]
    Learns,
    /// A band that never widens, with unchanged gains.
    Fixed,
    /// No band.
    Off,
}

impl RestBandKey {
    pub(crate) const fn learning(self) -> Option<RestLearning> {
        match self {
            Self::Learns => Some(RestLearning::On),
            Self::Fixed => Some(RestLearning::Off),
            Self::Off => None,
        }
    }
}

/// Control mode of a motor drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ModeKey {
    /// Position control.
    #[default]
    Position,
    /// Speed control.
    Speed,
}

/// Reference of a drive.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReferenceTable {
    /// Kind of the reference. Default rest.
    pub kind: ReferenceKind,
    /// move: target angle, rad.
    #[schemars(range(min = -1e6, max = 1e6))]
    pub to_rad: Option<f64>,
    /// sine: amplitude, rad.
    #[schemars(range(min = -100, max = 100))]
    pub amplitude_rad: Option<f64>,
    /// sine: frequency, Hz.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub frequency_hz: Option<f64>,
    /// points (2 or more), set_points: angles, rad.
    #[schemars(length(min = 1, max = 10_000), inner(range(min = -1e6, max = 1e6)))]
    pub points_rad: Option<Vec<f64>>,
    /// points, set_points: time between two points, s; a whole number of ticks.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub every_s: Option<f64>,
    /// set_points: speed limit, rad/s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_speed_rad_s: Option<f64>,
    /// set_points: acceleration limit, rad/s^2.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_acceleration_rad_s2: Option<f64>,
    /// set_points: averaging time of the trajectory, s; a whole number of ticks. The trajectory of a motor is averaged
    /// twice, of a joint three times. The jerk stays below 2 max_acceleration_rad_s2/smooth_s. For a stream of points
    /// take every_s. Default 0.01.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub smooth_s: Option<f64>,
    /// speed: constant speed, rad/s.
    #[schemars(range(min = -1e6, max = 1e6))]
    pub speed_rad_s: Option<f64>,
    /// Start time of the reference, s. Default 0.
    #[schemars(range(min = 0))]
    pub start_s: Option<f64>,
    /// Duration of the transition from rest to the reference, s. Default: the shortest within 90 % of the current limit
    /// for the weakest and heaviest motor within uncertain_percent; for sine and points at least 0.25.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub duration_s: Option<f64>,
}

/// Kinds of reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReferenceKind {
    /// Hold the start position.
    #[default]
    Rest,
    /// Move from rest to rest.
    Move,
    /// Sine about angle 0.
    Sine,
    /// Smooth curve through points, delayed by 3.5 point intervals.
    Points,
    /// Set-points at any time, followed along a trajectory within limits of speed, acceleration and jerk.
    SetPoints,
    /// Constant speed.
    Speed,
}

/// Alarm thresholds of a drive and the reaction to an alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MonitorTable {
    /// Reaction to an alarm. Default tell.
    pub reaction: ReactionKey,
    /// joined_stop: time from the alarm to rest, s. Default 0.25.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub stop_s: Option<f64>,
    /// Alarm threshold of the estimated torque from load, friction and data-sheet errors, N m; for a joint on the link.
    /// Default by rule, from the limits, uncertain_percent and sudden_load_n_m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub load_n_m: Option<f64>,
    /// joint: alarm threshold of the estimated torque on the motor, N m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub motor_n_m: Option<f64>,
    /// Alarm threshold of |sigma*| while the current is within its limits, rad/s; for a joint rad/s^3. Default by rule.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub sigma_star: Option<f64>,
    /// Allowed time at the current limit while |sigma| does not fall, s. Default 0.2.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub saturated_s: Option<f64>,
}

/// Limits of the shaft; for a joint of the link. Exceeding a limit is an alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LimitsTable {
    /// Lower end of the travel range, rad; the drive brakes before it. Default none.
    pub low_rad: Option<f64>,
    /// Upper end of the travel range, rad; the drive brakes before it. Default none.
    pub high_rad: Option<f64>,
    /// Speed limit, rad/s; durations by rule respect it. Default none.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_speed_rad_s: Option<f64>,
    /// Largest distance from the reference, rad. Default none.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub following_error_rad: Option<f64>,
}

/// Reaction to an alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReactionKey {
    /// Report the alarm and continue.
    #[default]
    Tell,
    /// Brake on the estimated speed while the counts are plausible, then switch the current off.
    Brake,
    /// Apply 0 A or the safe current of the fallback at once: the shaft coasts.
    Fallback,
    /// Controlled stop: the reference decelerates to rest along a polynomial, which needs valid counts. If the current
    /// does not suffice, the fallback is applied.
    JoinedStop,
}

/// Friction model about rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrictionModel {
    /// A shaft at rest holds until the torque exceeds static friction.
    #[default]
    Holds,
    /// Friction fades to 0 below `smooth_rad_s`: the shaft creeps instead of holding.
    Faded,
}

table! {
/// Friction and torque ripple of the simulated motor. The controller's model has none.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FrictionTable {
    /// Coulomb friction in motion, N m. Default 0.
    #[schemars(range(min = 0))]
    pub coulomb_n_m: f64,
    /// Static friction, N m. Default: coulomb_n_m.
    #[schemars(range(min = 0))]
    pub static_n_m: Option<f64>,
    /// Stribeck speed of the transition from static to Coulomb friction, rad/s. Default 0.1.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub stribeck_rad_s: f64 = 0.1,
    /// Friction model about rest. Default "holds"; "faded" if smooth_rad_s is given.
    pub model: Option<FrictionModel>,
    /// faded: speed below which friction fades to 0, rad/s. Default 0.005.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub smooth_rad_s: Option<f64>,
    /// Amplitude of the cogging torque, N m. Default 0.
    #[schemars(range(min = 0))]
    pub cogging_n_m: f64,
    /// Cogging periods per motor revolution. Default 7.
    #[schemars(range(min = 1, max = 10_000))]
    pub cogging_per_turn: f64 = 7.0,
    /// Ripple of the torque constant, percent. Default 0.
    #[schemars(range(min = 0, max = 100))]
    pub ripple_percent: f64,
    /// Ripple periods per motor revolution. Default 42.
    #[schemars(range(min = 1, max = 10_000))]
    pub ripple_per_turn: f64 = 42.0,
}
}

/// Fault of an encoder, the power stage or the control interrupt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FaultTable {
    /// Kind of the fault. Required.
    pub kind: Option<FaultKind>,
    /// joint: affected encoder. Default: both.
    pub encoder: Option<EncoderKey>,
    /// Start time, s. Required.
    #[schemars(range(min = 0))]
    pub at_s: Option<f64>,
    /// Duration, s; at least one tick. Default: to the end of the run.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub for_s: Option<f64>,
    /// jump: offset of the count.
    pub counts: Option<i32>,
    /// derated: largest current of the power stage, A.
    #[schemars(range(min = 0))]
    pub current_a: Option<f64>,
}

/// Kinds of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// Frozen encoder: the count does not change.
    Stuck,
    /// Offset of the count.
    Jump,
    /// Missing count.
    Lost,
    /// The power stage limits the current below `max_current_a` and reports the applied current to the drive.
    Derated,
    /// The control interrupt is missed: the output stays, and the drive is not informed. Its reference is late from
    /// then on.
    Missed,
}

/// Encoder of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EncoderKey {
    /// Encoder of the link.
    Link,
    /// Encoder of the motor.
    Motor,
}

/// Deviations of the true parameters from the data sheet, percent. Default 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MotorErrorTable {
    /// Deviation of the inertia, load included, percent.
    #[schemars(extend("exclusiveMinimum" = -100))]
    pub inertia_percent: f64,
    /// Deviation of the torque constant, percent.
    #[schemars(extend("exclusiveMinimum" = -100))]
    pub torque_percent: f64,
    /// True if the motor turns against its current, as after swapping two phases. Default false.
    pub reversed: bool,
    /// Deviation of the viscous friction, percent.
    #[schemars(range(min = -100))]
    pub damping_percent: f64,
}

table! {
/// One run of a flexible joint with its drive. Keys without a default are required.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JointScenario {
    /// Short name, used for the output folder: letters, digits, `_`, `-`, `.`. Default: the name of the file.
    pub name: Option<String>,
    /// One-line title of the output and the figures.
    pub title: Option<String>,
    /// Length of the run, s. Default 2.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub span_s: f64 = 2.0,
    /// Window [from, to] of the error metrics, s. Default: from the end of the transition onto the reference to the end
    /// of the run. For a move: from its start.
    pub window_s: Option<[f64; 2]>,
    /// Band of the error that counts as settled, rad. Default 0.005.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub settling_band: Option<f64>,
    /// Seed of the encoder noise and the jitter. Default 0.
    pub seed: u64,
    /// Data sheet.
    pub joint: JointTable,
    /// Encoders of link and motor.
    pub encoder: JointEncoderTable,
    /// Design of the controller.
    pub drive: JointDriveTable,
    /// Reference of the link.
    pub reference: ReferenceTable,
    /// Alarm thresholds and reaction. Default: thresholds by rule, and alarms are only reported.
    pub monitor: MonitorTable,
    /// Limits of position, speed and following error of the link. Default: no limits.
    pub limits: LimitsTable,
    /// Friction and torque ripple of the simulated motor, as torques behind the gear. Default: none.
    pub friction: FrictionTable,
    /// Terms of a load torque against positive motion of the link: amplitude in N m, slope in N m/s. Default none.
    #[schemars(length(max = 64))]
    pub load: Vec<TermTable>,
    /// Faults of encoders, power stage and interrupt, with their times. Default none.
    #[schemars(length(max = 64))]
    pub fault: Vec<FaultTable>,
    /// Deviation of the true joint from its data sheet.
    pub error: JointErrorTable,
}
}

table! {
/// Data sheet of a flexible joint.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JointTable {
    /// Inertia of the link, kg m^2. Required.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub link_inertia_kg_m2: Option<f64>,
    /// Inertia of the motor at its own shaft, kg m^2. Required.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub motor_inertia_kg_m2: Option<f64>,
    /// Stiffness of the spring between motor and link, behind the gear, N m/rad. Required.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub stiffness_n_m: Option<f64>,
    /// Torque constant K_t of the motor, N m/A. Required.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub torque_n_m_per_a: Option<f64>,
    /// Current limit for both signs, A: the smaller of the peak current of the motor and the limit of the inverter, not
    /// the rated current. Peak or rms amperes, as for torque_n_m_per_a. Required.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_current_a: Option<f64>,
    /// Supply voltage, V. It limits the current at speed. For a three-phase motor with space-vector modulation and K_t
    /// per ampere of the peak of a phase: 0.866 of the bus voltage. Default: no limit.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub supply_v: Option<f64>,
    /// Winding resistance between the terminals, ohm; for a three-phase motor as above 1.5 times the resistance of a
    /// phase. Required with supply_v. Default with no_load_rad_s: max_current_a just flows at rest.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub resistance_ohm: Option<f64>,
    /// No-load speed of the motor shaft, rad/s, instead of supply_v.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub no_load_rad_s: Option<f64>,
    /// Gear ratio [motor revolutions, spring revolutions]: [100, 1] is a reduction of 100. Default [1, 1]. With the
    /// encoder behind the gear any ratio is valid. Before the gear, a spring revolution must be a whole number of motor
    /// counts. For other ratios the error names the nearest.
    #[schemars(inner(range(min = 1)))]
    pub gear: [u64; 2] = [1, 1],
    /// Viscous friction of the link, N m s/rad. Default 0.
    #[schemars(range(min = 0))]
    pub link_damping_n_m_s: f64,
    /// Viscous friction of the motor at its own shaft, N m s/rad. Default 0.
    #[schemars(range(min = 0))]
    pub motor_damping_n_m_s: f64,
    /// Damping of the spring, N m s/rad. The controller's model has none. Default 0.
    #[schemars(range(min = 0))]
    pub spring_damping_n_m_s: f64,
    /// Gravity torque of the horizontal link, N m; at angle 0 the link hangs down. Default 0: the axis is vertical.
    #[schemars(range(min = 0))]
    pub weight_n_m: f64,
    /// Time constant of the current loop, s; 0 for none. Default 2e-4.
    #[schemars(range(min = 0, max = 0.1))]
    pub current_lag_s: f64 = controller_core::drive::DEFAULT_LAG_S,
    /// Angle of the link at t = 0, at rest, with the spring twisted by gravity, rad. Default 0.
    pub start_rad: f64,
}
}

/// Encoders of a joint. Both angles are 0 if the spring is relaxed and the link hangs down.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JointEncoderTable {
    /// Encoder of the link.
    pub link: EncoderTable,
    /// Encoder on the motor shaft, or behind the gear.
    pub motor: EncoderTable,
}

table! {
/// Drive of a joint.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JointDriveTable {
    /// Period T of the ticks, s. Default 1e-3.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub period_s: f64 = 1e-3,
    /// Set of bandwidths. "coupled" designs both shafts as one system, with base gains by rule from the data sheet that
    /// are stable in every corner of uncertain_percent. Default: "coupled" for a stiff spring, with K/J_l above the
    /// square of the position bandwidth. Else "normal" if both encoders have at least 16 bits per revolution, else
    /// "quiet".
    pub tuning: Option<TuningKey>,
    /// Stability margin of tuning = "coupled": "fast" (peak sensitivity up to 2.4), "standard" (up to 1.7), or the
    /// nominal peak sensitivity, 1.2 to 3. Default "fast".
    pub margin: Option<MarginKey>,
    /// Closed-loop position bandwidth, rad/s; the others scale with it in proportion. Default: by tuning.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub surface_rad_s: Option<f64>,
    /// Bandwidth of the link observer, rad/s. Default: by tuning.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub link_rad_s: Option<f64>,
    /// Bandwidth of the motor observer, rad/s. Default: by tuning.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub motor_rad_s: Option<f64>,
    /// Reaching gain k_l, 1/s: rate at which sigma* is driven to zero. Default: by tuning.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub reaching_per_s: Option<f64>,
    /// Tolerance of the data sheet, percent, at most 50. Default 20.
    #[schemars(range(min = 0))]
    pub uncertain_percent: f64 = 20.0,
    /// True to allow the export of a drive that is unstable, nominally or within uncertain_percent. Default false.
    pub accept_unstable: bool,
    /// Number of gain sets. With 2, high gains are scheduled in on the observer innovation while a load acts. Default:
    /// 2 for uncertain_percent up to 20, else 1.
    #[schemars(range(min = 1, max = 2))]
    pub gain_sets: Option<usize>,
    /// Ratios of the observer bandwidths of the high and the base gains, link and motor, 1 to 4; for tuning = "coupled"
    /// 0.5 to 5. Default [3, 1.5], or by rule.
    #[schemars(length(min = 2, max = 2), inner(range(min = 0.5, max = 5)))]
    pub fast_ratios: Option<Vec<f64>>,
    /// Ticks from the computation of a current until it is applied, 0 to 3. Default 0.
    #[schemars(range(min = 0, max = 3))]
    pub delay_ticks: usize,
    /// Largest age of the counts at their tick, s: uniform from 0, independent in each tick, equal for both encoders,
    /// at most period_s. Default 0.
    #[schemars(range(min = 0))]
    pub jitter_s: f64,
    /// Largest load step, N m. A larger step is rejected as an encoder fault. Default: the largest motor torque.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub sudden_load_n_m: Option<f64>,
    /// Consecutive lost samples of an encoder that are bridged by prediction. Default 50.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub lost_ticks: u32 = 50,
    /// Safe output after lost_ticks: "hold" (the last current) or a current, A. Default "hold".
    pub fallback: FallbackKey,
}
}

/// Sets of bandwidths of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TuningKey {
    /// Low bandwidths, for encoders with 12 to 14 bits.
    Quiet,
    /// For encoders with 16 bits or more.
    Normal,
    /// High bandwidths, for encoders with 20 bits or more: stiffer under load, more current noise.
    Firm,
    /// Gains by rule for both shafts as one system.
    Coupled,
}

/// Deviations of the true parameters from the data sheet, percent. Default 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JointErrorTable {
    /// Deviation of the link inertia, percent.
    #[schemars(extend("exclusiveMinimum" = -100))]
    pub link_inertia_percent: f64,
    /// Deviation of the motor inertia, percent.
    #[schemars(extend("exclusiveMinimum" = -100))]
    pub motor_inertia_percent: f64,
    /// Deviation of the spring stiffness, percent.
    #[schemars(extend("exclusiveMinimum" = -100))]
    pub stiffness_percent: f64,
    /// Deviation of the torque constant, percent.
    #[schemars(extend("exclusiveMinimum" = -100))]
    pub torque_percent: f64,
    /// True if the motor turns against its current, as after swapping two phases. Default false.
    pub reversed: bool,
    /// Deviation of the gravity torque of the link, percent.
    #[schemars(range(min = -100))]
    pub weight_percent: f64,
    /// Deviation of the viscous friction of the link, percent.
    #[schemars(range(min = -100))]
    pub link_damping_percent: f64,
    /// Deviation of the viscous friction of the motor, percent.
    #[schemars(range(min = -100))]
    pub motor_damping_percent: f64,
}
