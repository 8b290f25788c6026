//! What a file says of a drive: a motor, or a flexible joint, with encoders, along a reference.
//!
//! A file with the table `[motor]` or `[joint]` is one. Numbers of the data sheet are those of the motor's own shaft;
//! all others (reference, load inertia, friction, load) are behind its gear, where the angle is meant. What the
//! controller is told is the data sheet; what is true differs from it by `[error]`, and by what no data sheet says.

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
/// One run of a motor under its drive. What has no default must be given.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MotorScenario {
    /// Short name, used for the output folder: letters, digits, `_`, `-`, `.`. Default: the name of the file.
    pub name: Option<String>,
    /// One line that says what is shown; heads the output and the figures.
    pub title: Option<String>,
    /// Length of the run, s. Default 2.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub span_s: f64 = 2.0,
    /// Window [from, to] over which errors are taken, s. Default: from where the reference is reached to the end; of a
    /// move from its start.
    pub window_s: Option<[f64; 2]>,
    /// Settled while the error stays within this band, rad; rad/s in mode speed. Default 0.005; in mode speed 2 % of
    /// the speed.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub settling_band: Option<f64>,
    /// Seed of the encoder's noise and of jitter. Default 0.
    pub seed: u64,
    /// Data sheet.
    pub motor: MotorTable,
    /// How the angle is measured.
    pub encoder: EncoderTable,
    /// The controller.
    pub drive: MotorDriveTable,
    /// Where to go.
    pub reference: ReferenceTable,
    /// What the drive is watched for. Default: thresholds by rule, and alarms are told only.
    pub monitor: MonitorTable,
    /// Where the shaft may be, how fast, and how far from its target. Default: no limits.
    pub limits: LimitsTable,
    /// What no data sheet says. Default: none of it.
    pub friction: FrictionTable,
    /// Terms of a torque against positive motion, behind the gear: amplitude in N m, slope in N m/s. Default none.
    #[schemars(length(max = 64))]
    pub load: Vec<TermTable>,
    /// What goes wrong with the counts, and when. Default nothing.
    #[schemars(length(max = 64))]
    pub fault: Vec<FaultTable>,
    /// How far the true motor is from its data sheet.
    pub error: MotorErrorTable,
}
}

table! {
/// Data sheet of a motor and its rigid load.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MotorTable {
    /// Inertia of the rotor, kg m^2, or [smallest, largest]: a loop is designed for the geometric mean of a range. Must
    /// be given.
    #[schemars(with = "Option<AboveZero>")]
    pub inertia_kg_m2: Option<NumberOrRange>,
    /// Torque constant K_t, N m/A. Must be given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub torque_n_m_per_a: Option<f64>,
    /// Largest current of either sign, A. Must be given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_current_a: Option<f64>,
    /// Supply voltage, V: the faster the motor, the less current it drives. Of a three-phase motor with space-vector
    /// modulation and K_t per ampere of the peak of a phase: 0.866 of the bus voltage. Default: no limit.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub supply_v: Option<f64>,
    /// Winding resistance, ohm, between the terminals; of a three-phase motor as above 1.5 times that of a phase. Must
    /// be given with supply_v; with no_load_rad_s alone the one at which max_current_a just flows at rest.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub resistance_ohm: Option<f64>,
    /// Speed of the motor's own shaft without load, rad/s, instead of supply_v.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub no_load_rad_s: Option<f64>,
    /// Viscous friction of the rotor, N m s/rad. Default 0.
    #[schemars(range(min = 0))]
    pub damping_n_m_s: f64,
    /// Turns of the motor, and those that what it drives makes meanwhile: [100, 1] is a reduction of 100. Default
    /// [1, 1]. Any ratio for an encoder behind the gear; before it one that the encoder's counts fit, of others the
    /// nearest is named.
    #[schemars(inner(range(min = 1)))]
    pub gear: [u64; 2] = [1, 1],
    /// Inertia of the load behind the gear, kg m^2, or [smallest, largest]. Default 0.
    #[schemars(extend("default" = 0.0))]
    pub load_inertia_kg_m2: NumberOrRange,
    /// Play between motor and load, rad behind the gear from one flank to the other. An encoder behind the gear then
    /// allows less bandwidth. Default 0.
    #[schemars(range(min = 0, max = 1))]
    pub play_rad: f64,
    /// Stiffness of the flanks with play, N m/rad behind the gear. Default: load and motor swing on them at 75 Hz.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub gear_stiffness_n_m: Option<f64>,
    /// Time constant of the current loop, s; 0 for none. Default 2e-4.
    #[schemars(range(min = 0, max = 0.1))]
    pub current_lag_s: f64 = controller_core::drive::DEFAULT_LAG_S,
    /// Angle at t = 0, at rest, rad. Default 0.
    pub start_rad: f64,
}
}

/// A number, or a range of it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum NumberOrRange {
    /// One number.
    Number(#[schemars(range(min = 0))] f64),
    /// The smallest and the largest that it may be.
    Range(#[schemars(inner(range(min = 0)))] [f64; 2]),
}

/// The schema of one that is not 0.
#[derive(JsonSchema)]
#[schemars(untagged)]
#[expect(dead_code, reason = "what is read is a NumberOrRange")]
enum AboveZero {
    /// One number.
    Number(Positive),
    /// The smallest and the largest that it may be.
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

/// An encoder, absolute or incremental.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct EncoderTable {
    /// Bits of the counter. Must be given, or its states.
    #[schemars(range(min = 2, max = 32))]
    pub bits: Option<u32>,
    /// How many states the counter has before it wraps, a power of two or not: a timer with a reload of 9999 has 10000.
    /// Default 2^bits; must be given with counts_per_turn.
    #[schemars(range(min = 2, max = 4_294_967_296_u64))]
    pub states: Option<u64>,
    /// Counts in a turn of the encoder: four per line of an incremental one. Default 2^bits.
    #[schemars(range(min = 4, max = 16_777_216))]
    pub counts_per_turn: Option<u32>,
    /// motor with a gear: is the encoder behind the gear, and not on the motor's shaft? Default false.
    pub behind_gear: bool,
    /// Does it count down while the angle grows? Default false.
    pub reversed: bool,
    /// Count at angle 0. Default 0.
    pub offset_counts: i32,
    /// Standard deviation of white noise of its own angle, before it is rounded to a count, rad; a motor's bandwidth by
    /// rule allows for it. Default 0.
    #[schemars(range(min = 0, max = 1))]
    pub noise_rad: f64,
    /// Error of its own angle once a turn, as of a magnet off its centre, rad. Default 0.
    #[schemars(range(min = 0, max = 0.2))]
    pub eccentricity_rad: f64,
}

table! {
/// The drive of a motor.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MotorDriveTable {
    /// Period T of the ticks, s. Default 1e-3.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub period_s: f64 = 1e-3,
    /// What it follows. Default position.
    pub mode: ModeKey = ModeKey::Position,
    /// Stability margin of the rule for the bandwidths: "fast", "standard", or the peak of the sensitivity function
    /// with the quiet gain set. Default "fast".
    pub margin: Option<MarginKey>,
    /// Bandwidth of the position error, rad/s; the observer and the reaching law change in proportion. Default: by
    /// rule, of the encoder's steps and the phase that period, lag and delay cost.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub surface_rad_s: Option<f64>,
    /// Bandwidth of the observer, rad/s. Default: by rule.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub observer_rad_s: Option<f64>,
    /// Gain k_l of the reaching law, 1/s. Default: by rule, at most one per tick.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub reaching_per_s: Option<f64>,
    /// How well inertia and torque constant are known, percent, at most 50; of an inertia with a range the torque
    /// constant alone. Default 20.
    #[schemars(range(min = 0))]
    pub uncertain_percent: f64 = 20.0,
    /// May a drive be exported that is unstable, or is so with numbers as far off as uncertain_percent says? Default
    /// false.
    pub accept_unstable: bool,
    /// Gain sets: with 2 a fast one comes in while a load pushes. Default: 2 for uncertain_percent up to 20 and an
    /// inertia that is at most as far off, else 1.
    #[schemars(range(min = 1, max = 2))]
    pub gain_sets: Option<usize>,
    /// Bandwidth of the observer in the fast set over that in the quiet one. Default 2.
    #[schemars(range(min = 1, max = 4))]
    pub fast_ratio: Option<f64>,
    /// Ticks from the computation of a current until it is held, 0 to 3. Default 0.
    #[schemars(range(min = 0, max = 3))]
    pub delay_ticks: usize,
    /// Largest age of the count that a tick works with, s: uniform from 0, anew in each tick; at most period_s. Default
    /// 0.
    #[schemars(range(min = 0))]
    pub jitter_s: f64,
    /// States of the observer; 4 is for little friction and a motor known to 20 %. Default 3.
    #[schemars(range(min = 3, max = 4))]
    pub observer_states: usize = 3,
    /// Lost samples in a row that are bridged. Default 50.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub lost_ticks: u32 = 50,
    /// What goes out after them: "hold" (the last current) or a current, A. Default "hold".
    pub fallback: FallbackKey,
    /// How slack a motor is around a target that rests, against hunting in friction and swings in play; a speed loop
    /// has none.
    /// Default "learns".
    pub rest_band: Option<RestBandKey>,
}
}

/// The band around a target that rests, within which the position error does not count, and lower gains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RestBandKey {
    /// A count, or what 0.1 % of the torque does to the error; where the shaft hunts it widens, up to six counts or 2 %
    /// of the torque, and where the shaft swings lower gains hold it.
    #[default]
    Learns,
    /// It never widens, and the gains stay.
    Fixed,
    /// There is none.
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

/// What a drive follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ModeKey {
    /// The angle.
    #[default]
    Position,
    /// The speed alone.
    Speed,
}

/// Where to go.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReferenceTable {
    /// Its shape. Default rest.
    pub kind: ReferenceKind,
    /// move: angle to rest at, rad.
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
    /// points, set_points: time from one to the next, s; a whole number of ticks.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub every_s: Option<f64>,
    /// set_points: limit of the speed, rad/s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_speed_rad_s: Option<f64>,
    /// set_points: limit of the acceleration, rad/s^2.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_acceleration_rad_s2: Option<f64>,
    /// set_points: time over which the path is averaged, twice for a motor and three times for a joint, s; a whole
    /// number of ticks. The jerk stays below 2 max_acceleration_rad_s2/smooth_s. For points of a stream every_s.
    /// Default 0.01.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub smooth_s: Option<f64>,
    /// speed: speed to turn at, rad/s.
    #[schemars(range(min = -1e6, max = 1e6))]
    pub speed_rad_s: Option<f64>,
    /// Instant at which it begins, s. Default 0.
    #[schemars(range(min = 0))]
    pub start_s: Option<f64>,
    /// Time from rest onto the reference, s. Default: the shortest within 90 % of the current limit for a motor as weak
    /// and heavy as uncertain_percent allows; of sine and points at least 0.25.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub duration_s: Option<f64>,
}

/// Shapes of a reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReferenceKind {
    /// Stay where it is.
    #[default]
    Rest,
    /// From rest to rest.
    Move,
    /// A sine about angle 0.
    Sine,
    /// A smooth curve through points, late by 3.5 of them.
    Points,
    /// Set-points that come at any time, as a path within limits of speed, acceleration and jerk.
    SetPoints,
    /// Even turning.
    Speed,
}

/// What a drive is watched for, and what follows an alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MonitorTable {
    /// What follows an alarm. Default tell.
    pub reaction: ReactionKey,
    /// joined_stop: time to rest, s. Default 0.25.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub stop_s: Option<f64>,
    /// Largest torque that load, friction and what the data sheet has wrong may come to, N m; of a joint on the link.
    /// Default by rule, from the limits, uncertain_percent and sudden_load_n_m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub load_n_m: Option<f64>,
    /// joint: the same on the motor, N m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub motor_n_m: Option<f64>,
    /// Largest |sigma*| while the current is within its limits, rad/s; of a joint rad/s^3. Default by rule.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub sigma_star: Option<f64>,
    /// Time that the current may be at a limit while |sigma| does not fall, s. Default 0.2.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub saturated_s: Option<f64>,
}

/// Limits of the shaft, of a joint of its link: to break one is an alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LimitsTable {
    /// Lower end of its range, rad; the drive brakes ahead of it. Default none.
    pub low_rad: Option<f64>,
    /// Upper end of its range, rad. Default none.
    pub high_rad: Option<f64>,
    /// Top speed, rad/s; durations keep to it. Default none.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_speed_rad_s: Option<f64>,
    /// Largest distance from the target, rad. Default none.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub following_error_rad: Option<f64>,
}

/// What follows an alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReactionKey {
    /// It is told, and the drive goes on.
    #[default]
    Tell,
    /// It brakes on its estimated speed as long as its counts can be believed, and the current is taken away then.
    Brake,
    /// From then on 0 A goes out, or the safe current of the fallback: the shaft coasts.
    Fallback,
    /// The reference comes to rest from where it is, which needs good counts; where the current does not
    /// suffice, the fallback goes out.
    JoinedStop,
}

/// How friction behaves about rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrictionModel {
    /// A shaft that comes to rest stands until what pushes it is more than static friction.
    #[default]
    Holds,
    /// It fades below `smooth_rad_s`: a shaft creeps where a real one stands.
    Faded,
}

table! {
/// Friction and ripple of the true motor; the controller knows nothing of them.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FrictionTable {
    /// Friction in motion, N m. Default 0.
    #[schemars(range(min = 0))]
    pub coulomb_n_m: f64,
    /// Friction just above rest, N m. Default: that in motion.
    #[schemars(range(min = 0))]
    pub static_n_m: Option<f64>,
    /// Speed at which the one has given way to the other, rad/s. Default 0.1.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub stribeck_rad_s: f64 = 0.1,
    /// About rest. Default "holds"; "faded" where smooth_rad_s is given.
    pub model: Option<FrictionModel>,
    /// faded: speed below which friction fades, rad/s. Default 0.005.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub smooth_rad_s: Option<f64>,
    /// Amplitude of the cogging, N m. Default 0.
    #[schemars(range(min = 0))]
    pub cogging_n_m: f64,
    /// Periods of the cogging in a turn of the motor. Default 7.
    #[schemars(range(min = 1, max = 10_000))]
    pub cogging_per_turn: f64 = 7.0,
    /// Ripple of the torque constant, percent. Default 0.
    #[schemars(range(min = 0, max = 100))]
    pub ripple_percent: f64,
    /// Periods of the ripple in a turn of the motor. Default 42.
    #[schemars(range(min = 1, max = 10_000))]
    pub ripple_per_turn: f64 = 42.0,
}
}

/// What goes wrong with an encoder or the power stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FaultTable {
    /// What. Must be given.
    pub kind: Option<FaultKind>,
    /// joint: of which encoder. Default: both.
    pub encoder: Option<EncoderKey>,
    /// From this instant on, s. Must be given.
    #[schemars(range(min = 0))]
    pub at_s: Option<f64>,
    /// For so long, s; at least a tick. Default: to the end.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub for_s: Option<f64>,
    /// jump: counts by which it is off.
    pub counts: Option<i32>,
    /// derated: the largest current that the power stage gives, A.
    #[schemars(range(min = 0))]
    pub current_a: Option<f64>,
}

/// Faults of an encoder or the power stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// The count stays what it was.
    Stuck,
    /// The count is off by some.
    Jump,
    /// There is no count.
    Lost,
    /// The power stage gives less current than `max_current_a`, and the drive is told what flows.
    Derated,
    /// The interrupt of the control does not come: u stays, and the drive is not told. Its reference is late from then
    /// on.
    Missed,
}

/// The encoders of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EncoderKey {
    /// On the link.
    Link,
    /// On the motor.
    Motor,
}

/// True parameter over that of the data sheet, less 1, percent. Default 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MotorErrorTable {
    /// Of the inertia, that of the load included.
    #[schemars(extend("exclusiveMinimum" = -100))]
    pub inertia_percent: f64,
    /// Of the torque constant.
    #[schemars(extend("exclusiveMinimum" = -100))]
    pub torque_percent: f64,
    /// Does the motor turn the other way than its current asks, as after two phases are swapped? Default false.
    pub reversed: bool,
    /// Of the viscous friction.
    #[schemars(range(min = -100))]
    pub damping_percent: f64,
}

table! {
/// One run of a flexible joint under its drive. What has no default must be given.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JointScenario {
    /// Short name, used for the output folder: letters, digits, `_`, `-`, `.`. Default: the name of the file.
    pub name: Option<String>,
    /// One line that says what is shown; heads the output and the figures.
    pub title: Option<String>,
    /// Length of the run, s. Default 2.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub span_s: f64 = 2.0,
    /// Window [from, to] over which errors are taken, s. Default: from where the reference is reached to the end; of a
    /// move from its start.
    pub window_s: Option<[f64; 2]>,
    /// Settled while the error stays within this band, rad. Default 0.005.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub settling_band: Option<f64>,
    /// Seed of the encoders' noise and of jitter. Default 0.
    pub seed: u64,
    /// Data sheet.
    pub joint: JointTable,
    /// How both angles are measured.
    pub encoder: JointEncoderTable,
    /// The controller.
    pub drive: JointDriveTable,
    /// Where the link is to go.
    pub reference: ReferenceTable,
    /// What the drive is watched for. Default: thresholds by rule, and alarms are told only.
    pub monitor: MonitorTable,
    /// Where the shaft may be, how fast, and how far from its target. Default: no limits.
    pub limits: LimitsTable,
    /// What no data sheet says of the motor, as torques behind the gear. Default: none of it.
    pub friction: FrictionTable,
    /// Terms of a torque against positive motion of the link: amplitude in N m, slope in N m/s. Default none.
    #[schemars(length(max = 64))]
    pub load: Vec<TermTable>,
    /// What goes wrong with the counts, and when. Default nothing.
    #[schemars(length(max = 64))]
    pub fault: Vec<FaultTable>,
    /// How far the true joint is from its data sheet.
    pub error: JointErrorTable,
}
}

table! {
/// Data sheet of a flexible joint.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JointTable {
    /// Inertia of the link, kg m^2. Must be given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub link_inertia_kg_m2: Option<f64>,
    /// Inertia of the motor at its own shaft, kg m^2. Must be given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub motor_inertia_kg_m2: Option<f64>,
    /// Stiffness of the spring between them, behind the gear, N m/rad. Must be given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub stiffness_n_m: Option<f64>,
    /// Torque constant K_t of the motor, N m/A. Must be given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub torque_n_m_per_a: Option<f64>,
    /// Largest current of either sign, A. Must be given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_current_a: Option<f64>,
    /// Supply voltage, V: the faster the motor, the less current it drives. Of a three-phase motor with space-vector
    /// modulation and K_t per ampere of the peak of a phase: 0.866 of the bus voltage. Default: no limit.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub supply_v: Option<f64>,
    /// Winding resistance, ohm, between the terminals; of a three-phase motor as above 1.5 times that of a phase. Must
    /// be given with supply_v; with no_load_rad_s alone the one at which max_current_a just flows at rest.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub resistance_ohm: Option<f64>,
    /// Speed of the motor's own shaft without load, rad/s, instead of supply_v.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub no_load_rad_s: Option<f64>,
    /// Turns of the motor, and those that the spring makes meanwhile: [100, 1] is a reduction of 100. Default [1, 1].
    /// Any ratio for an encoder behind the gear; before it the motor's encoder makes a whole number of counts in a turn
    /// of the spring, of other ratios the nearest is named.
    #[schemars(inner(range(min = 1)))]
    pub gear: [u64; 2] = [1, 1],
    /// Viscous friction of the link, N m s/rad. Default 0.
    #[schemars(range(min = 0))]
    pub link_damping_n_m_s: f64,
    /// Viscous friction of the motor at its own shaft, N m s/rad. Default 0.
    #[schemars(range(min = 0))]
    pub motor_damping_n_m_s: f64,
    /// Damping in the spring, N m s/rad; the controller does not know it. Default 0.
    #[schemars(range(min = 0))]
    pub spring_damping_n_m_s: f64,
    /// Torque of the link's weight when it is level, N m; angle 0 hangs down. Default 0: its axis is upright.
    #[schemars(range(min = 0))]
    pub weight_n_m: f64,
    /// Time constant of the current loop, s; 0 for none. Default 2e-4.
    #[schemars(range(min = 0, max = 0.1))]
    pub current_lag_s: f64 = controller_core::drive::DEFAULT_LAG_S,
    /// Angle of the link at t = 0, at rest, the spring drawn by its weight, rad. Default 0.
    pub start_rad: f64,
}
}

/// The encoders of a joint; both are 0 where the spring is relaxed and the link hangs down.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JointEncoderTable {
    /// On the link.
    pub link: EncoderTable,
    /// On the motor's own shaft, or behind the gear.
    pub motor: EncoderTable,
}

table! {
/// The drive of a joint.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JointDriveTable {
    /// Period T of the ticks, s. Default 1e-3.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub period_s: f64 = 1e-3,
    /// Bandwidths. "coupled" takes the joint as a whole, with gains by rule from the data sheet: stable in every
    /// corner of uncertain_percent. Default: "coupled" where the spring is stiff, K/J_l above the square of the
    /// bandwidth of the error, else "normal" if both encoders have 16 bits or more in a turn, else "quiet".
    pub tuning: Option<TuningKey>,
    /// Of tuning = "coupled": "fast", peaks of the sensitivity function up to 2.4, "standard", up to 1.7, or a peak by
    /// the data sheet, 1.2 to 3. Default "fast".
    pub margin: Option<MarginKey>,
    /// Bandwidth of the error instead, rad/s; the others follow in the proportions of `tuning`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub surface_rad_s: Option<f64>,
    /// Bandwidth of the link's observer instead, rad/s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub link_rad_s: Option<f64>,
    /// Bandwidth of the motor's observer instead, rad/s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub motor_rad_s: Option<f64>,
    /// Gain k_l of the reaching law instead, 1/s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub reaching_per_s: Option<f64>,
    /// How well the parameters are known, percent, at most 50. Default 20.
    #[schemars(range(min = 0))]
    pub uncertain_percent: f64 = 20.0,
    /// May a drive be exported that is unstable, or is so with parameters as far off as uncertain_percent says? Default
    /// false.
    pub accept_unstable: bool,
    /// Gain sets: with 2 a fast one comes in while a load pushes. Default: 2 for uncertain_percent up to 20, else 1.
    #[schemars(range(min = 1, max = 2))]
    pub gain_sets: Option<usize>,
    /// Bandwidths of the observers in the fast set over those in the quiet one, link and motor, 1 to 4; of tuning =
    /// "coupled" 0.5 to 5. Default [3, 1.5], or by rule.
    #[schemars(length(min = 2, max = 2), inner(range(min = 0.5, max = 5)))]
    pub fast_ratios: Option<Vec<f64>>,
    /// Ticks from the computation of a current until it is held, 0 to 3. Default 0.
    #[schemars(range(min = 0, max = 3))]
    pub delay_ticks: usize,
    /// Largest age of the counts that a tick works with, s: uniform from 0, anew in each tick, one for both; at most
    /// period_s. Default 0.
    #[schemars(range(min = 0))]
    pub jitter_s: f64,
    /// The largest load that comes at once, N m; a larger one looks like a broken encoder. Default: what the motor can
    /// make.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub sudden_load_n_m: Option<f64>,
    /// Lost samples of an encoder in a row that are bridged. Default 50.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub lost_ticks: u32 = 50,
    /// What goes out after them: "hold" (the last current) or a current, A. Default "hold".
    pub fallback: FallbackKey,
}
}

/// Measured sets of bandwidths of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TuningKey {
    /// For 12 to 14 bits.
    Quiet,
    /// For 16 bits and more.
    Normal,
    /// For 20 bits and more: stiffer against a load, more noise.
    Firm,
    /// No set: the joint as a whole, by rule.
    Coupled,
}

/// True parameter over that of the data sheet, less 1, percent. Default 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JointErrorTable {
    /// Of the link's inertia.
    #[schemars(extend("exclusiveMinimum" = -100))]
    pub link_inertia_percent: f64,
    /// Of the motor's inertia.
    #[schemars(extend("exclusiveMinimum" = -100))]
    pub motor_inertia_percent: f64,
    /// Of the spring.
    #[schemars(extend("exclusiveMinimum" = -100))]
    pub stiffness_percent: f64,
    /// Of the torque constant.
    #[schemars(extend("exclusiveMinimum" = -100))]
    pub torque_percent: f64,
    /// Does the motor turn the other way than its current asks, as after two phases are swapped? Default false.
    pub reversed: bool,
    /// Of the link's weight.
    #[schemars(range(min = -100))]
    pub weight_percent: f64,
    /// Of the link's viscous friction.
    #[schemars(range(min = -100))]
    pub link_damping_percent: f64,
    /// Of the motor's viscous friction.
    #[schemars(range(min = -100))]
    pub motor_damping_percent: f64,
}
