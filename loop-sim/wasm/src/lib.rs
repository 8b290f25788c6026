//! Runs of `loop-sim`, each reduced to a hash over every bit of every row.
//!
//! `cargo xtask wasm` compiles this crate for WebAssembly and for this machine. It calls [`bits`] in Node and here, and
//! compares the results. The crate also shows the small interface that a web page needs: functions on numbers, without
//! generated code.

use std::ops::ControlFlow;

use controller_core::{
    AnyConfig, Config, JointParameters, Nominal, ObserverGains, Options, ReachingLaw, Reading, Surface,
};
use loop_sim::actuator::{self, Limited};
use loop_sim::closed_loop::{Loop, close_loop};
use loop_sim::plant::{Benchmark, FlexibleJoint, Plant};
use loop_sim::port::in_process::{ControllerSpec, Model, Precision, build};
use loop_sim::sensor::{self, Dropout, Noise};
use loop_sim::trace::{Ending, Recorder, Row};

/// Number of cases of [`bits`]. Case 0 is the joint with an f32 controller and the solver. Case 1 is the joint with an
/// f64 controller and its own step. Case 2 is Eq. (59) in f32.
pub const CASES: u32 = 3;

const PERIOD_S: f64 = 1e-3;

/// FNV-1a hash, 64 bits.
struct Hash(u64);

impl Recorder for Hash {
    fn record(&mut self, row: &Row) -> ControlFlow<()> {
        let Row { t_s, x, r, u, u_held, sigma, sigma_star, d, d_hat, health } = row;
        let scalars = [t_s, r, u, u_held, sigma, sigma_star].into_iter();
        let words = scalars.chain(x).chain(d).chain(d_hat).map(|value| value.to_bits());
        for byte in words.chain([u64::from(health.bits())]).flat_map(u64::to_le_bytes) {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        ControlFlow::Continue(())
    }
}

/// Runs five seconds of a case at T = 1 ms with noise, lost samples and a limit that is reached. Returns the hash,
/// which is equal on every machine, or 0 if the run does not finish.
#[unsafe(no_mangle)]
pub extern "C" fn bits(case: u32) -> u64 {
    run(case).unwrap_or(0)
}

fn run(case: u32) -> Option<u64> {
    let joint = JointParameters::TABLE_I.chain(Reading::Reconstructed);
    let gains = Some(ObserverGains::<2>::as_printed([100.0, 20.0]));
    let reaching = ReachingLaw { k_l: 50.0, k_s: 0.5, epsilon: 0.01 };
    let of_joint = Config {
        period_s: PERIOD_S,
        surface: Surface::from_bandwidth(5.0, 1.0),
        observers: [None, gains, None, gains],
        reaching,
        nominal: joint.nominal(),
        options: Options::NEUTRAL,
    };
    let of_benchmark = Config {
        period_s: PERIOD_S,
        surface: Surface::from_bandwidth(5.0, 1.0),
        observers: [gains, None],
        reaching,
        nominal: Nominal { gradient: [0.0, -1.0], input_gain: 1.0 },
        options: Options::NEUTRAL,
    };
    let linear = Model::Linear(joint.nominal().gradient.to_vec());
    let (precision, model, config): (_, _, AnyConfig) = match case {
        0 => (Precision::F32, linear, of_joint.into()),
        1 => (Precision::F64, linear, of_joint.into()),
        2 => (Precision::F32, Model::BenchmarkLibm, of_benchmark.into()),
        _ => return None,
    };
    let plant: Box<dyn Plant> = match config.n {
        4 if case == 1 => Box::new(FlexibleJoint::of_the_paper(joint).sampled(PERIOD_S)),
        4 => Box::new(FlexibleJoint::of_the_paper(joint)),
        _ => Box::new(Benchmark::part_2()),
    };
    let n = plant.order();
    let mut port = build(&ControllerSpec { precision, model, config }).ok()?.port;
    let mut sensor = Dropout::new(Noise::new(sensor::Ideal, &vec![1e-6; n], 1), 0.01, 1);
    let mut actuator = Limited::new(actuator::Ideal, -20.0, 20.0);
    let setup = Loop {
        plant: plant.as_ref(),
        sensor: &mut sensor,
        port: port.as_mut(),
        actuator: &mut actuator,
        report: true,
        missed: &[],
        x0: &[0.1, 0.0, 0.0, 0.0][..n],
        period_s: PERIOD_S,
        periods: 5000,
    };
    let mut hash = Hash(0xcbf2_9ce4_8422_2325);
    (close_loop(setup, &mut hash) == Ok(Ending::Finished)).then_some(hash.0)
}
