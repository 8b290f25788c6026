#![doc = include_str!("../README.md")]
//!
//! # From text to experiment
//!
//! ```text
//! text + --set  ->  tree with places  ->  checked by the schema  ->  Scenario  ->  defaults, rules  ->  Experiment
//!                   (document)            (check)                                  (resolve, assemble)
//! ```
//!
//! The structs are flat with optional keys, because serde's tagged enums lose the place of an error. A table in
//! `resolve` lists the keys of each kind.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ptr;
use std::sync::LazyLock;

use schemars::JsonSchema;
use serde::Deserialize;

/// Declares a table of the file: each key with its type, its documentation, and its default unless that is empty or 0.
macro_rules! table {
    ($(#[$of:meta])* pub struct $name:ident {
        $($(#[$of_key:meta])* pub $key:ident: $type:ty $(= $default:expr)?,)*
    }) => {
        $(#[$of])*
        pub struct $name {
            $($(#[$of_key])* pub $key: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($key: table!(@ $($default)?),)* }
            }
        }
    };
    (@) => { Default::default() };
    (@ $default:expr) => { $default };
}

mod assemble;
mod check;
mod document;
mod drive;
mod error;
mod own;
mod resolve;
mod rewrite;

pub use assemble::{AtRest, Corner, Drive, Experiment, InertiaRange, Mu, Sensed, ShaftOf, StateName, TopSpeed};
pub use drive::coupled::{CoupledBy, KnownRule};
pub use drive::joint_rule::{Binding, CORNER_PEAK, FastSet, JointRule, JointSheet, Refused, Remedy, joint_rule};
pub use drive::{
    EncoderKey, EncoderTable, FaultKind, FaultTable, FrictionModel, FrictionTable, JointDriveTable, JointEncoderTable,
    JointErrorTable, JointScenario, JointTable, ModeKey, MotorDriveTable, MotorErrorTable, MotorScenario, MotorTable,
    NumberOrRange, ReferenceKind, ReferenceTable, TuningKey,
};
pub use error::{ErrorParts, ScenarioError, Source};
pub use rewrite::rewritten;

use document::KeyPath;
use error::Origin;
use resolve::Problem;
use whole_file::FileKind;

/// Default scenario, the template of `host-sim new NAME --plant paper`: Example 2, `reconstructed`, r = 2 as printed.
pub const DEFAULT: &str = include_str!("../scenarios/default.toml");

/// Template of a plant as a chain of integrators.
pub const CHAIN: &str = include_str!("../scenarios/chain.toml");

/// Template of a nonlinear plant by its equations.
pub const OWN: &str = include_str!("../scenarios/own.toml");

/// Template of a motor with one encoder, by its data sheet.
pub const MOTOR: &str = include_str!("../scenarios/motor.toml");

/// Template of a flexible joint with two encoders.
pub const JOINT: &str = include_str!("../scenarios/joint.toml");

table! {
/// One run of the closed loop. Every key is optional; `[plant]` alone is Example 2 of the paper.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Scenario {
    /// Short name, used for the output folder: letters, digits, `_`, `-`, `.`. Default: the name of the file.
    pub name: Option<String>,
    /// One-line title of the output and the figures.
    pub title: Option<String>,
    /// Length of the run, s. Default 20.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub span_s: f64 = 20.0,
    /// Window [from, to] of the "ultimate" metrics, s. Default: the second half of the span.
    pub window_s: Option<[f64; 2]>,
    /// Band of |y| that counts as settled, unit of x_1. Default 0.01.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub settling_band: f64 = 0.01,
    /// Seed of the sensor's jitter, noise and dropouts. Default 0.
    pub seed: u64,
    /// True plant.
    pub plant: PlantTable,
    /// Controller.
    pub controller: ControllerTable,
    /// Sensor, from the true state to the sample.
    pub sensor: SensorTable,
    /// Actuator, from the demand to the applied u.
    pub actuator: ActuatorTable,
}
}

/// True plant.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PlantTable {
    /// Kind of the plant. Default flexible_joint.
    pub kind: PlantKind,
    /// flexible_joint: reading of Eq. (63)-(64) and Table I. Default reconstructed, for the paper's figures.
    pub reading: ReadingKey,
    /// True state at t = 0, one number per state. Default: [0.1, 0, 0, 0] for the joint, else zeros.
    #[schemars(length(min = 2, max = 6))]
    pub x0: Option<Vec<f64>>,
    /// flexible_joint: physical parameters of plant and controller. Default: Table I. Other values require the reading
    /// physical.
    pub parameters: ParametersTable,
    /// flexible_joint: relative error of each true coefficient, 0.5 = 50 % above the nominal value.
    pub error: ErrorTable,
    /// flexible_joint: terms of the disturbance v at the input. Default 1 + sin 2t as in the paper; none in the reading
    /// physical.
    #[schemars(length(max = 64))]
    pub input_disturbance: Option<Vec<TermTable>>,
    /// benchmark: add the state-dependent terms x_1^2/2 + x_1 sin 2t + 0.2 x_2 of Eq. (60) to d_1. Default false.
    pub state_dependent: bool,
    /// chain: order n.
    #[schemars(range(min = 2, max = 6))]
    pub order: Option<usize>,
    /// chain: true a(x) = a_1 x_1 + .. + a_n x_n, Eq. (39), n numbers.
    #[schemars(length(min = 2, max = 6))]
    pub a: Option<Vec<f64>>,
    /// chain: true input gain b, Eq. (39).
    pub b: Option<f64>,
    /// own: true x_1' .. x_n', each a formula of x1 .. xn, u, t and the constants.
    #[schemars(length(min = 2, max = 6))]
    pub rates: Option<Vec<String>>,
    /// own: named constants for the formulas of plant and controller.
    pub constants: BTreeMap<String, f64>,
    /// Disturbances d_i(t) of Eq. (39), one table per channel. Default none.
    #[schemars(length(max = 6))]
    pub disturbance: Vec<DisturbanceTable>,
}

/// Kinds of plant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlantKind {
    /// Example 2, Eq. (62)-(64): n = 4.
    #[default]
    FlexibleJoint,
    /// Example 1, Eq. (59): n = 2, a(x) = -2 x_1 - x_2 + exp x_1.
    Benchmark,
    /// Chain of n integrators, Eq. (39), with linear a(x) and constant b.
    Chain,
    /// Plant by its equations.
    Own,
}

/// Readings of Example 2. The input gain of all but physical is not physical.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReadingKey {
    /// For the figures only, as printed: J11 on the link. It does not reproduce the published numbers.
    Literal,
    /// For the figures only: link equation with the link inertia. It reproduces the published numbers.
    #[default]
    Reconstructed,
    /// For the figures only: as reconstructed, with B11 on the motor, a hard test of a discretisation.
    Stiff,
    /// Two inertias on a spring, with a and b scaled consistently, as in a real joint.
    Physical,
}

/// Parameters of Table I, SI units.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ParametersTable {
    /// Torque constant K_t, N m/A. Table I: 0.119.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub kt: Option<f64>,
    /// Inertia J_11, kg m^2. Table I: 931e-6.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub j11: Option<f64>,
    /// Inertia J_12, kg m^2. Table I: 0.230.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub j12: Option<f64>,
    /// Damping B_11, N m s/rad. Table I: 4.5.
    #[schemars(extend("minimum" = 0))]
    pub b11: Option<f64>,
    /// Damping B_12, N m s/rad. Table I: 0.07.
    #[schemars(extend("minimum" = 0))]
    pub b12: Option<f64>,
    /// Torsional stiffness K_s, N m/rad. Table I: 9.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub ks: Option<f64>,
}

/// Relative errors D of the joint's coefficients: true = (1 + D) times nominal. Default 0.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ErrorTable {
    /// Error of k_1, coefficient of x_1 in channel 2.
    pub k1: f64,
    /// Error of k_1, coefficient of x_3 in channel 2.
    pub k1_x3: f64,
    /// Error of b_1 in channel 2.
    pub b1: f64,
    /// Error of k_2, coefficient of x_1 in channel 4.
    pub k2_x1: f64,
    /// Error of k_2, coefficient of x_3 in channel 4.
    pub k2_x3: f64,
    /// Error of b_2 in channel 4.
    pub b2: f64,
    /// Error of the input gain b.
    pub b: f64,
}

/// Disturbance of one channel.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DisturbanceTable {
    /// Channel, from 1.
    #[serde(default)]
    #[schemars(range(min = 1, max = 6))]
    pub channel: Option<usize>,
    /// Terms, which are added.
    #[serde(default)]
    #[schemars(length(max = 64))]
    pub terms: Vec<TermTable>,
}

/// One term of a disturbance.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TermTable {
    /// Kind of the term.
    #[serde(default)]
    pub kind: Option<TermKind>,
    /// const, sin, cos, step: amplitude, unit of the channel.
    #[serde(default)]
    pub amplitude: Option<f64>,
    /// ramp: slope, unit of the channel per s.
    #[serde(default)]
    pub slope: Option<f64>,
    /// sin, cos: angular frequency, rad/s.
    #[serde(default)]
    pub omega_rad_s: Option<f64>,
    /// sin, cos: phase, rad. Default 0.
    #[serde(default)]
    pub phase_rad: Option<f64>,
    /// step: time of the step, s; the step acts from then on.
    #[serde(default)]
    pub t0_s: Option<f64>,
}

/// Kinds of term.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TermKind {
    /// amplitude
    Const,
    /// slope t
    Ramp,
    /// amplitude sin(omega_rad_s t + phase_rad)
    Sin,
    /// amplitude cos(omega_rad_s t + phase_rad)
    Cos,
    /// 0 before t0_s, amplitude from there on
    Step,
}

table! {
/// Controller of a plant.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ControllerTable {
    /// Kind of the controller. Default proposed.
    pub kind: ControllerKind,
    /// Floating-point precision of the controller; the plant is always f64. Default f32.
    pub precision: PrecisionKey,
    /// Period T of the ticks, s. Default 1e-3.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub period_s: f64 = 1e-3,
    /// Surface c_1..c_n of Eq. (44), c_n = 1. Default for the joint: [125, 75, 15, 1].
    #[schemars(length(min = 2, max = 6))]
    pub c: Option<Vec<f64>>,
    /// Instead of c: all poles of the sliding motion at minus this value, rad/s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub surface_bandwidth_rad_s: Option<f64>,
    /// Decay rate alpha of the start-up offset of sigma*, Eq. (17), 1/s. Default 1.
    pub alpha_per_s: f64 = 1.0,
    /// Linear reaching gain k_l of Eq. (51), 1/s. Default 50.
    #[schemars(extend("minimum" = 0))]
    pub k_l: f64 = 50.0,
    /// Switching gain k_s of Eq. (51), unit of sigma per s. Default 0.
    #[schemars(extend("minimum" = 0))]
    pub k_s: f64,
    /// Boundary layer epsilon of Eq. (51), unit of sigma. Default 0.01.
    #[schemars(extend("minimum" = 0))]
    pub epsilon: f64 = 0.01,
    /// Disturbance observers, one table per observed channel. Default for the joint: channels 2 and 4, printed
    /// (100, 20); else none.
    #[schemars(length(max = 6))]
    pub observer: Option<Vec<ObserverTable>>,
    /// True if the law uses the nominal slope da/dx_n within a tick. Default true.
    pub use_slope: bool = true,
    /// True if the law uses the nominal gradient da/dx_1..da/dx_(n-1) within a tick. Default true.
    pub use_gradient: bool = true,
    /// Slope lambda = -da/dx_n of the design, 1/s. The model of the tick keeps its own slope. Half of the true slope is
    /// harmless, twice the true slope is not. Default: the slope of the nominal model.
    pub lambda_per_s: Option<f64>,
    /// chain, own: the controller's model of a and b.
    pub nominal: NominalTable,
    /// Limits of u. Default: limits beyond the range of any actuator.
    pub limits: Option<LimitsTable>,
    /// Safe output after a lost sample: "hold" (the last u) or a number. Default "hold".
    pub fallback: FallbackKey,
    /// Valid range of samples and their largest change per tick. Other samples are rejected. Default: all are valid.
    pub samples: Option<SamplesTable>,
    /// Estimates of d_1..d_n at t = 0. Default zeros.
    #[schemars(length(min = 2, max = 6), inner(range(min = -1e11, max = 1e11)))]
    pub initial_estimates: Option<Vec<f64>>,
    /// Bound of |sigma*|; above it a bit of the health column is set. Default 1e12.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub sigma_star_bound: f64 = 1e12,
    /// Limit of the fastest observer pole times the period; a faster design is an error. Default 1.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub observer_pole_limit: f64 = 1.0,
    /// benchmark: exponential of the nominal model. Default libm.
    pub exp: ExpKey,
    /// baseline: switching gain k.
    #[schemars(extend("minimum" = 0))]
    pub k: Option<f64>,
}
}

/// Kinds of controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ControllerKind {
    /// The paper's law with extended disturbance observers, Eq. (44)-(51).
    #[default]
    Proposed,
    /// The paper's reference \[1\], on the benchmark plant: sigma = x_2 + c_1 x_1 + d_hat_1, switching gain k, f64.
    Baseline,
}

/// Precision of the controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PrecisionKey {
    /// Single precision, as on the target.
    #[default]
    F32,
    /// Double precision, for comparison with f32.
    F64,
}

/// Implementations of the exponential function.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ExpKey {
    /// Within one unit in the last place.
    #[default]
    Libm,
    /// Approximation with a few instructions, f32 only.
    Micromath,
}

/// Disturbance observer, Eq. (45)-(50). Set exactly one of printed, poles, bandwidth_rad_s.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObserverTable {
    /// Channel, from 1.
    #[serde(default)]
    #[schemars(range(min = 1, max = 6))]
    pub channel: Option<usize>,
    /// Gains l_1..l_r as printed in the paper, l_j in 1/s^j.
    #[serde(default)]
    #[schemars(length(min = 1, max = 3))]
    pub printed: Option<Vec<f64>>,
    /// Poles [re, im] of the estimation error, rad/s; complex poles in conjugate pairs.
    #[serde(default)]
    #[schemars(length(min = 1, max = 3))]
    pub poles: Option<Vec<[f64; 2]>>,
    /// All poles of the estimation error at minus this value, rad/s; requires order.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub bandwidth_rad_s: Option<f64>,
    /// Order r of the observer, with bandwidth_rad_s.
    #[serde(default)]
    #[schemars(range(min = 1, max = 3))]
    pub order: Option<usize>,
}

/// The controller's model of the last channel, x_n' = a(x) + b(x) u.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NominalTable {
    /// Nominal a_1..a_n; for the plant own also a formula of x1..xn. Default for a chain: the true coefficients.
    pub a: Option<DriftKey>,
    /// Nominal b; for the plant own also a formula of x1..xn. Default for a chain: the true b.
    pub b: Option<GainKey>,
    /// own: constants whose value in the controller's model differs from the true value.
    pub constants: BTreeMap<String, f64>,
}

/// Drift a(x): coefficients or a formula.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum DriftKey {
    /// Coefficients a_1..a_n of a linear a(x).
    Row(#[schemars(length(min = 2, max = 6))] Vec<f64>),
    /// Formula a(x).
    Formula(String),
}

/// Input gain b(x): a number or a formula.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum GainKey {
    /// Constant b.
    Number(f64),
    /// Formula b(x).
    Formula(String),
}

/// Range of u.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LimitsTable {
    /// Smallest u. Default: none.
    pub min: Option<f64>,
    /// Largest u. Default: none.
    pub max: Option<f64>,
}

/// Valid range of a sample, per state.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SamplesTable {
    /// Smallest x_1..x_n. Default: none.
    #[schemars(length(min = 2, max = 6))]
    pub min: Option<Vec<f64>>,
    /// Largest x_1..x_n. Default: none.
    #[schemars(length(min = 2, max = 6))]
    pub max: Option<Vec<f64>>,
    /// Largest change of x_1..x_n from the previous sample. Default: none.
    #[schemars(length(min = 2, max = 6))]
    pub jump: Option<Vec<f64>>,
}

/// Safe output after a lost sample: "hold" or a number.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum FallbackKey {
    /// Word for the last u.
    Word(FallbackWord),
    /// Fixed u.
    Safe(f64),
}

impl Default for FallbackKey {
    fn default() -> Self {
        Self::Word(FallbackWord::Hold)
    }
}

/// Word for a safe output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FallbackWord {
    /// Hold the last u.
    Hold,
}

/// Sensor: the true state, then jitter, noise, quantisation, delay, dropout.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SensorTable {
    /// Largest age of a sample, as a share of the period: random, uniform from 0. Default 0.
    #[schemars(range(min = 0, max = 1))]
    pub jitter: f64,
    /// Standard deviation of white noise per state, unit of the state. Default none.
    #[schemars(length(min = 2, max = 6), inner(range(min = 0, max = 1e300)))]
    pub noise: Option<Vec<f64>>,
    /// Quantisation step per state, unit of the state; 0 = none. Default none.
    #[schemars(length(min = 2, max = 6), inner(range(min = 0, max = 1e300)))]
    pub quantum: Option<Vec<f64>>,
    /// Delay of a sample, ticks. Default 0.
    #[schemars(range(min = 0, max = 100_000))]
    pub delay_ticks: usize,
    /// Probability that a sample is lost, per tick. Default 0.
    #[schemars(range(min = 0, max = 1))]
    pub dropout: f64,
}

/// Actuator: the demand, then hold, delay, limits, rate limit.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ActuatorTable {
    /// Smallest applied u. Default: none.
    pub min: Option<f64>,
    /// Largest applied u. Default: none.
    pub max: Option<f64>,
    /// Rate limit, unit of u per s. Default: none.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub rate_per_s: Option<f64>,
    /// Delay of a demand, ticks. Default 0.
    #[schemars(range(min = 0, max = 100_000))]
    pub delay_ticks: usize,
    /// Ticks between two accepted demands. Default 1.
    #[schemars(range(min = 1, max = 100_000))]
    pub hold_ticks: usize,
    /// True if the applied u is reported to the controller. For limits this is the only anti-windup. For a pure delay
    /// or hold set it to false: with fast observers it makes sigma* at least 1.4 times larger. Default true.
    pub report: bool,
}

impl Default for ActuatorTable {
    fn default() -> Self {
        Self { min: None, max: None, rate_per_s: None, delay_ticks: 0, hold_ticks: 1, report: true }
    }
}

/// Returns the JSON schema of the scenario files of one of [`STARTS`]. Motor and joint have their own schema.
pub fn schema(plant: &str) -> &'static serde_json::Value {
    // Made once: a campaign reads a million scenarios, and making a schema takes longer than reading one.
    static PAPER: LazyLock<serde_json::Value> = LazyLock::new(|| schemars::schema_for!(Scenario).to_value());
    static MOTOR: LazyLock<serde_json::Value> = LazyLock::new(|| schemars::schema_for!(MotorScenario).to_value());
    static JOINT: LazyLock<serde_json::Value> = LazyLock::new(|| schemars::schema_for!(JointScenario).to_value());
    match plant {
        "motor" => &MOTOR,
        "joint" => &JOINT,
        _ => &PAPER,
    }
}

/// Templates: the kind of plant and a commented file.
pub const STARTS: [(&str, &str); 5] =
    [("paper", DEFAULT), ("motor", MOTOR), ("joint", JOINT), ("chain", CHAIN), ("own", OWN)];

/// Returns one of [`STARTS`] as a scenario with this name. `None` for an invalid name or an unknown plant.
pub fn template(name: &str, plant: &str) -> Option<String> {
    let (_, text) = STARTS.iter().find(|(known, _)| *known == plant)?;
    let named = |line: &str| {
        if line.starts_with("name = ") { format!("name = {name:?}\n") } else { format!("{line}\n") }
    };
    resolve::is_file_name(name).then(|| text.lines().map(named).collect())
}

/// Reads a scenario file, applies `--set` arguments, checks everything and builds the experiment.
///
/// # Errors
/// Lists all errors with their places.
pub fn load(path: &std::path::Path, sets: &[String]) -> Result<Experiment, ScenarioError> {
    let file = path.display().to_string();
    let text =
        whole_file::read_text(path, FileKind::SETTINGS).map_err(|message| ScenarioError::of_file(&file, message))?;
    let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    parse_own(&Source { file: &file, text: &text, sets }, &stem)
}

/// Reads a scenario as [`parse`] does, and requires a plant. A file without one would run the paper's joint with the
/// paper's disturbance, which a user does not expect.
///
/// # Errors
/// Lists all errors with their places.
pub fn parse_own(source: &Source<'_>, default_name: &str) -> Result<Experiment, ScenarioError> {
    let tree = document::read(source)?;
    let is_there = |name: &&str| KeyPath::parse(name).is_some_and(|path| tree.get(&path).is_some());
    let says_what = ["plant", "motor", "joint"].iter().any(is_there);
    // Without a plant the keys of a drive are unknown.
    let is_of_drive = ["drive", "encoder"].iter().any(is_there);
    let parsed = built(source, tree, default_name);
    if says_what {
        return parsed;
    }
    let message = "no plant is given: a file needs a table `motor`, `joint` or `plant`; `host-sim new NAME --plant \
                   motor` (or joint, chain, own) writes a template, and `[plant]` alone selects the paper's joint with \
                   its disturbance";
    Err(ScenarioError::of_file(source.file, message).and(parsed.err().filter(|_| !is_of_drive)))
}

/// Reads a scenario from a text. `default_name` is the name of a scenario without the key `name`.
///
/// # Errors
/// Lists all errors with their places.
pub fn parse(source: &Source<'_>, default_name: &str) -> Result<Experiment, ScenarioError> {
    built(source, document::read(source)?, default_name)
}

fn built(source: &Source<'_>, tree: document::Node, default_name: &str) -> Result<Experiment, ScenarioError> {
    let table = |name: &str| KeyPath::parse(name).and_then(|path| Some(tree.get(&path)?.origin));
    let [motor, joint] = ["motor", "joint"].map(table);
    if let (Some(motor), Some(joint)) = (motor, joint) {
        let both = "a file has a table `motor` or a table `joint`, not both";
        return Err(source.error(motor.max(joint), both));
    }
    if motor.is_some() {
        let judge = |file: MotorScenario, _: &Located, is_whole| drive::motor(&file, default_name, is_whole);
        return Located::judged(source, tree, schema("motor"), judge).map(|(experiment, _)| experiment);
    }
    if joint.is_some() {
        let judge = |file: JointScenario, _: &Located, is_whole| drive::joint(&file, default_name, is_whole);
        return Located::judged(source, tree, schema("joint"), judge).map(|(experiment, _)| experiment);
    }
    if cfg!(feature = "drives-only") {
        return Err(ScenarioError::of_file(source.file, "this program runs a drive: give a table `motor` or `joint`"));
    }
    let judge = |scenario: Scenario, file: &Located, _| {
        let foreign = resolve::foreign_keys(&scenario, &|key| file.origin_of(key).is_some(), &|key| file.is_set(key));
        resolve::resolve(scenario, default_name, foreign).map_err(|problems| problems.0)
    };
    let (resolved, file) = Located::judged(source, tree, schema("paper"), judge)?;
    assemble::assemble(resolved, &|problem| source.errors(file.located(vec![problem])))
}

/// Returns the number at a key: from the text or the arguments, else the default. `None` if there is no default, or if
/// the value is not a number.
///
/// # Errors
/// Returns an error if the text is not TOML.
pub fn number_at(source: &Source<'_>, key: &str) -> Result<Option<f64>, ScenarioError> {
    let tree = document::read(source)?;
    let is_there = |name: &&str| KeyPath::parse(name).is_some_and(|path| tree.get(&path).is_some());
    let kind = ["motor", "joint"].into_iter().find(is_there).unwrap_or("paper");
    let Some(path) = KeyPath::parse(key) else { return Ok(None) };
    Ok(tree.get(&path).map_or_else(|| check::default_of(schema(kind), &path), |node| node.json().as_f64()))
}

/// Returns the gear ratio of a drive, motor revolutions per output revolution; 1 without a gear. `plant` is `motor` or
/// `joint`.
///
/// # Errors
/// Returns an error if the text is not TOML.
pub fn gear_at(source: &Source<'_>, plant: &str) -> Result<f64, ScenarioError> {
    let part = |k: u32| number_at(source, &format!("{plant}.gear[{k}]"));
    let is_part = |part: &f64| *part > 0.0;
    let parts = part(1)?.filter(is_part).zip(part(2)?.filter(is_part));
    Ok(parts.map_or(1.0, |(num, den)| num / den))
}

/// Returns the text at a key, if the file or an argument sets it.
///
/// # Errors
/// Returns an error if the text is not TOML.
pub fn text_at(source: &Source<'_>, key: &str) -> Result<Option<String>, ScenarioError> {
    let tree = document::read(source)?;
    let node = KeyPath::parse(key).and_then(|path| tree.get(&path).map(document::Node::json));
    Ok(node.and_then(|value| value.as_str().map(ToOwned::to_owned)))
}

/// Keys that the rules of other keys depend on. If one of them is wrong, those rules are not checked.
const JUDGES: [&str; 11] =
    ["kind", "mode", "order", "rates", "reading", "constants", "period_s", "span_s", "gear", "bits", "start_rad"];

/// TOML text after the check against a schema, with the place of each key.
pub(crate) struct Located {
    tree: document::Node,
}

impl Located {
    /// Checks the tree against the schema of `T` and passes the result to `judge`. Invalid keys and values are left out
    /// before that; the last argument of `judge` is true if the file is complete.
    ///
    /// # Errors
    /// Lists all errors with their places.
    fn judged<T: serde::de::DeserializeOwned, R>(
        source: &Source<'_>,
        mut tree: document::Node,
        schema: &'static serde_json::Value,
        judge: impl FnOnce(T, &Self, bool) -> Result<R, Vec<Problem>>,
    ) -> Result<(R, Self), ScenarioError> {
        let is_text_sound = !source.sets.is_empty() && is_sound(source, schema);
        let faults = if is_text_sound { check::check_set(schema, &tree) } else { check::check(schema, &tree) };
        for fault in &faults {
            tree.take_out(&fault.path);
        }
        let root = tree.origin_of(&KeyPath::root());
        let value = serde_json::from_value(tree.json());
        let file = Self { tree };
        let told = |fault: &check::Fault| {
            // The argument set the first number of the list, which created the list.
            let is_begun = |argument: &String| {
                let (key, _) = argument.split_once('=')?;
                KeyPath::parse(key.trim())?.list().filter(|list| *list == fault.path)
            };
            let list = match fault.origin {
                Origin::Set(k) if !fault.is_unknown => source.sets.get(k).and_then(is_begun),
                _ => None,
            };
            let remedy = list.map_or_else(String::new, |list| format!(": {}", document::whole_first(&list)));
            (fault.origin, format!("{}{remedy}", fault.message))
        };
        let mut wrong: Vec<_> = faults.iter().map(told).collect();
        match value {
            // The rules of other keys depend on this one.
            _ if faults.iter().any(|fault| fault.path.last_key().is_some_and(|key| JUDGES.contains(&key))) => {}
            // The schema is derived from the structs, so serde accepts valid trees. Any other case is reported.
            Err(error) if faults.is_empty() => wrong.push((root, error.to_string())),
            Err(_) => {}
            Ok(value) => match judge(value, &file, faults.is_empty()) {
                Ok(judged) if faults.is_empty() => return Ok((judged, file)),
                Ok(_) => {}
                Err(mut problems) => {
                    problems.retain(|problem| !faults.iter().any(|fault| fault.explains(problem)));
                    wrong.extend(file.located(problems));
                }
            },
        }
        Err(source.errors(wrong))
    }

    /// Adds places to problems: the place of the key if the file contains it. For a missing key: the `--set` argument
    /// that selects another kind, else the table around the key.
    fn located(&self, problems: Vec<Problem>) -> Vec<(Origin, String)> {
        let located = problems.into_iter().map(|Problem { key, message }| {
            let path = KeyPath::parse(&key).unwrap_or_else(KeyPath::root);
            // The keys that a kind requires are direct children of its table.
            let is_asked = |kind: &&str| key.matches('.').count() == 1 && self.is_set(kind);
            let of_kind = || self.origin_of(["plant.kind", "controller.kind"].into_iter().find(is_asked)?);
            let origin = self.origin_of(&key).or_else(of_kind);
            (origin.unwrap_or_else(|| self.tree.origin_of(&path)), format!("`{key}`: {message}"))
        });
        located.collect()
    }

    /// Returns the place of a key, if the file or an argument sets it.
    fn origin_of(&self, key: &str) -> Option<Origin> {
        self.tree.get(&KeyPath::parse(key)?).map(|node| node.origin)
    }

    /// Returns true if `--set` sets the key.
    fn is_set(&self, key: &str) -> bool {
        matches!(self.origin_of(key), Some(Origin::Set(_)))
    }
}

/// Returns true if the text without arguments is valid. Cached, because the trials of a campaign share one text.
fn is_sound(source: &Source<'_>, schema: &'static serde_json::Value) -> bool {
    thread_local! {
        static LAST: RefCell<Option<(String, &'static serde_json::Value, bool)>> = const { RefCell::new(None) };
    }
    let known = LAST.with_borrow(|last| {
        let (text, of, is_sound) = last.as_ref()?;
        (text == source.text && ptr::eq(*of, schema)).then_some(*is_sound)
    });
    known.unwrap_or_else(|| {
        let is_sound = document::read_once(source).is_ok_and(|root| check::check(schema, &root).is_empty());
        LAST.set(Some((source.text.into(), schema, is_sound)));
        is_sound
    })
}

#[cfg(test)]
mod tests;
