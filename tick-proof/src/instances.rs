//! Shipped ticks whose traces are proved, or at least tried.
//!
//! The instances of the image `budget` (`firmware/budgets.toml`) have the same names and designs. The drives among them
//! also have the designs of the template scenarios. `host-sim export --certificate` proves the C file of a scenario.

use controller_core::drive::{
    ALARMS, Aim, BRAKING, FullState, Hold, Joint, JointDesign, JointModel, Mounting, Position, Speed,
};
use controller_core::{
    Benchmark, Config, Controller, Health, JointParameters, Libm, Limits, Linear, MAX_N, Nominal, ObserverGains,
    Options, ReachingLaw, Reading, SampleLimits, Shape, Surface, channels,
};
use tick_record::Drift;
use tick_record::drive::{self, NamedAim};
use tick_record::monitor::monitor;

use crate::Functions;
use designs::{JOINT_DRIVE, JOINT_WHOLE, MOTOR};

// A link to the designs of the recorder, so that the package of this crate has them.
#[allow(dead_code, reason = "what is proved of any b(x) and of any exponential needs none of them")]
mod designs;

/// A tick with a name.
#[derive(Clone, Copy)]
pub struct Instance {
    /// Name in the list.
    pub name: &'static str,
    /// Description.
    pub what: &'static str,
    /// Function that records its traces.
    pub functions: fn() -> Functions,
    /// Whether every statement must be proved.
    pub must: bool,
}

const fn must(name: &'static str, what: &'static str, functions: fn() -> Functions) -> Instance {
    Instance { name, what, functions, must: true }
}

const fn tried(name: &'static str, what: &'static str, functions: fn() -> Functions) -> Instance {
    Instance { name, what, functions, must: false }
}

const DRIVEN: u8 = channels(4, 1, [4]);
const BOTH: u8 = channels(4, 2, [2, 4]);
const UPPER: u8 = channels(4, 2, [2, 3, 4]);
const ALL_FOUR: u8 = channels(4, 3, [1, 2, 3, 4]);

/// All instances; the ones that must be proved come first.
pub const ALL: [Instance; 30] = [
    must("joint_r1", "joint, observer of order 1", joint::<1, DRIVEN, 1>),
    must("joint_r2", "joint, observers of order 2", joint::<2, BOTH, 2>),
    must("joint_r3", "joint, observers of order 3", joint::<3, BOTH, 2>),
    must("chain_n2", "chain of order 2", || plain::<2, 1, 0b11, 2>([-1.0, -2.0], 3.0)),
    must("chain_n6", "chain of order 6", || plain::<6, 3, 0b11_0000, 2>([-1.0, -6.0, -15.0, -20.0, -15.0, -6.0], 2.0)),
    must("motor_two_sets", "motor's drive, two gain sets", motor::<Position, 1, 0, 3>),
    must("joint_drive_two_sets", "joint's drive, two gain sets", || joint_drive::<Position, 1, 0>(&JOINT_DRIVE)),
    must("motor_watched", "monitors of one shaft", monitors::<1>),
    must("joint_drive_watched", "monitors of two shafts", monitors::<2>),
    must("joint_whole_two_sets", "joint as a whole, two gain sets", || joint_drive::<Position, 1, 0>(&JOINT_WHOLE)),
    tried("benchmark", "Eq. (59)", || plain::<2, 2, 0b11, 2>(Benchmark::<Libm>::nominal().gradient, 1.0)),
    tried("chain_n3", "chain of order 3", || plain::<3, 2, 0b110, 2>([-4.2, -7.7, -4.2], 1.5)),
    tried("joint_r2_driven", "joint, order 2 in channel 4 alone", joint::<2, DRIVEN, 1>),
    tried("joint_r3_all", "joint, order 3 in every channel", joint::<3, ALL_FOUR, 4>),
    tried("joint_r2_gated", "joint behind a gate", || chain::<4, 2, BOTH, 2>(JOINT, Drift::Argument, Some(&GATE))),
    tried("joint_r2_varying_gain", "joint, any b(x)", || chain::<4, 2, BOTH, 2>(JOINT, Drift::ArgumentWithGain, None)),
    tried("motor", "motor's drive", motor::<Position, 0, 0, 3>),
    tried("motor_late", "motor's drive, a tick of delay", motor::<Position, 0, 1, 3>),
    tried("motor_late_two_sets", "the same, two gain sets", motor::<Position, 1, 1, 3>),
    tried("motor_speed", "motor's drive, of a speed", motor::<Speed, 0, 0, 3>),
    tried("motor_four_states", "motor's drive, observer of 4 states", motor::<Position, 0, 0, 4>),
    tried("joint_drive", "joint's drive", || joint_drive::<Position, 0, 0>(&JOINT_DRIVE)),
    tried("joint_drive_late", "joint's drive, a tick of delay", || joint_drive::<Position, 0, 1>(&JOINT_DRIVE)),
    tried("joint_drive_late_two_sets", "the same, two gain sets", || joint_drive::<Position, 1, 1>(&JOINT_DRIVE)),
    tried("joint_drive_held", "joint's drive, held at 0", || joint_drive::<Hold, 0, 0>(&JOINT_DRIVE)),
    tried("joint_whole", "joint as a whole", || joint_drive::<Position, 0, 0>(&JOINT_WHOLE)),
    tried("joint_whole_late", "the same, a tick of delay", || joint_drive::<Position, 0, 1>(&JOINT_WHOLE)),
    tried("joint_whole_late_two_sets", "the same, two gain sets", || joint_drive::<Position, 1, 1>(&JOINT_WHOLE)),
    tried("joint_measured", "joint's drive on a measured state", measured::<Position>),
    tried("joint_measured_held", "the same, held at 0", measured::<Hold>),
];

/// The controller for the injected faults.
pub const CHAIN_WITH_FAULTS: Instance = ALL[1];
/// The drive for the injected faults.
pub const DRIVE_WITH_FAULTS: Instance = ALL[5];
/// The monitors for the injected faults.
pub const MONITORS_WITH_FAULTS: Instance = ALL[7];

const JOINT: Nominal<4> = JointParameters::TABLE_I.chain(Reading::Reconstructed).nominal();
const GATE: SampleLimits<MAX_N> = SampleLimits { min: [-12.0; MAX_N], max: [12.0; MAX_N], jump: [12.0; MAX_N] };

/// Returns the common configuration of the chains, as in the image.
const fn config<const N: usize, const R: usize>(mask: u8, period_s: f64, nominal: Nominal<N>) -> Config<N, R> {
    let mut observers = [None; N];
    let mut i = 0;
    while i < N {
        if mask >> i & 1 == 1 {
            observers[i] = Some(ObserverGains::from_bandwidth::<R>(100.0));
        }
        i += 1;
    }
    Config {
        period_s,
        surface: Surface::from_bandwidth(10.0, 10.0),
        observers,
        reaching: ReachingLaw { k_l: 50.0, k_s: 0.5, epsilon: 0.01 },
        nominal,
        options: Options::NEUTRAL.with_limits(Limits::symmetric(300.0)).with_sigma_star_bound(10.0),
    }
}

/// Records a chain. a(x), and a varying b(x), are arguments, so the proofs hold for any values.
fn chain<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    nominal: Nominal<N>,
    drift: Drift,
    samples: Option<&SampleLimits<MAX_N>>,
) -> Functions {
    let law = Controller::<f32, Linear<f32, N>, N, R, MASK, O>::linear(&config(MASK, 1e-4, nominal));
    let numbers: Vec<f64> = law.coefficients().numbers().map(f64::from).collect();
    let shape = Shape { n: N as u8, r: R as u8, mask: MASK };
    let nothing = [0.0; MAX_N];
    let recorded = tick_record::chain(shape, &numbers, drift, &nothing, &nothing, samples);
    Functions::Chain(recorded.expect("a shape of the list"))
}

fn plain<const N: usize, const R: usize, const MASK: u8, const O: usize>(gradient: [f64; N], b: f64) -> Functions {
    chain::<N, R, MASK, O>(Nominal { gradient, input_gain: b }, Drift::Argument, None)
}

fn joint<const R: usize, const MASK: u8, const O: usize>() -> Functions {
    chain::<4, R, MASK, O>(JOINT, Drift::Argument, None)
}

fn motor<A, const FAST: usize, const LATE: usize, const S: usize>() -> Functions
where
    A: NamedAim<2> + Aim<f32, 2> + Aim<f64, 2>,
{
    Functions::Drive(drive::motor::<A, FAST, LATE, S>(&MOTOR, Mounting::UPRIGHT).expect("a good design"))
}

fn joint_drive<A, const FAST: usize, const LATE: usize>(design: &JointDesign) -> Functions
where
    A: NamedAim<4> + Aim<f32, 4> + Aim<f64, 4>,
{
    Functions::Drive(drive::joint::<A, FAST, LATE>(design, [Mounting::UPRIGHT; 2]).expect("a good design"))
}

fn monitors<const E: usize>() -> Functions {
    Functions::Monitors {
        braking: monitor::<E>(BRAKING),
        stopping: monitor::<E>(ALARMS),
        telling: monitor::<E>(Health::OK),
    }
}

fn measured<A>() -> Functions
where
    A: NamedAim<4> + Aim<f32, 4> + 'static,
{
    let model = Joint::TABLE_I.model();
    let config = config(UPPER, 1e-3, model.nominal());
    let law = FullState::<f32, JointModel<f32>, A, 2, 4, 2, UPPER, 3, 0>::try_design(&config, model.in_f32());
    Functions::Measured(drive::measured(&law.expect("a good design")))
}

/// Returns the instances for a test: all at full size (`DEEP=1`), every `n`th in the fast tier.
#[cfg(test)]
pub(crate) fn sampled(n: usize) -> impl Iterator<Item = &'static Instance> {
    let deep = std::env::var_os("DEEP").is_some_and(|value| value == "1");
    ALL.iter().step_by(if deep { 1 } else { n })
}

#[cfg(test)]
mod tests {
    use super::sampled;

    #[test]
    fn every_instance_can_be_recorded() {
        for instance in sampled(5) {
            assert!(!crate::statements(&(instance.functions)()).is_empty(), "{}", instance.name);
        }
    }
}
