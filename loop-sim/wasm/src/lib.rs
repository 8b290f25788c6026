//! Runs of `loop-sim` as one number each: a hash over every bit of every row.
//!
//! `cargo xtask wasm` compiles this for WebAssembly and for this machine, calls [`bits`] in Node and here, and
//! compares. It shows too how little a page needs: functions that take and return numbers, and no generated code.

use std::ops::ControlFlow;

use controller_core::{Fallback, JointParameters, Limits, ReachingLaw, Reading};
use loop_sim::actuator::{self, Limited};
use loop_sim::closed_loop::{Loop, close_loop};
use loop_sim::plant::{Benchmark, FlexibleJoint, Plant};
use loop_sim::port::in_process::{ControllerSpec, Model, Precision, build};
use loop_sim::sensor::{self, Dropout, Noise};
use loop_sim::trace::{Ending, Recorder, Row};

/// Numbers that [`bits`] takes: the joint in f32, the joint in f64, Eq. (59) in f32.
pub const CASES: u32 = 3;

/// FNV-1a, 64 bits.
struct Hash(u64);

impl Recorder for Hash {
    fn record(&mut self, row: &Row) -> ControlFlow<()> {
        let Row { t_s, x, u, u_held, sigma, sigma_star, d, d_hat, health } = row;
        let scalars = [t_s, u, u_held, sigma, sigma_star].into_iter();
        let words = scalars.chain(x).chain(d).chain(d_hat).map(|value| value.to_bits());
        for byte in words.chain([u64::from(health.bits())]).flat_map(u64::to_le_bytes) {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        ControlFlow::Continue(())
    }
}

/// Five seconds of a case at T = 1 ms with noise, lost samples and a limit that is reached. The numbers of one case are
/// the same on every machine; 0 if the run does not go to its end.
#[unsafe(no_mangle)]
pub extern "C" fn bits(case: u32) -> u64 {
    run(case).unwrap_or(0)
}

fn run(case: u32) -> Option<u64> {
    let joint = JointParameters::TABLE_I.chain(Reading::Reconstructed);
    let gains = || Some(vec![100.0, 20.0]);
    let of_joint = |precision| ControllerSpec {
        precision,
        period_s: 1e-3,
        surface_c: vec![125.0, 75.0, 15.0, 1.0],
        alpha_per_s: 1.0,
        observers: vec![None, gains(), None, gains()],
        reaching: ReachingLaw { k_l: 50.0, k_s: 0.5, epsilon: 0.01 },
        model: Model::Linear(joint.nominal().gradient.to_vec()),
        gradient: joint.nominal().gradient.to_vec(),
        input_gain: joint.nominal().input_gain,
        limits: Limits::NONE,
        fallback: Fallback::HoldLast,
        initial_estimates: vec![0.0; 4],
        sigma_star_bound: 1e12,
        observer_pole_limit: 1.0,
    };
    let (plant, spec): (Box<dyn Plant>, _) = match case {
        0 => (Box::new(FlexibleJoint::of_the_paper(joint)), of_joint(Precision::F32)),
        1 => (Box::new(FlexibleJoint::of_the_paper(joint)), of_joint(Precision::F64)),
        2 => {
            let spec = ControllerSpec {
                surface_c: vec![5.0, 1.0],
                observers: vec![gains(), None],
                model: Model::BenchmarkLibm,
                gradient: vec![0.0, -1.0],
                input_gain: 1.0,
                initial_estimates: vec![0.0; 2],
                ..of_joint(Precision::F32)
            };
            (Box::new(Benchmark::part_2()), spec)
        }
        _ => return None,
    };
    let n = plant.order();
    let mut port = build(&spec).ok()?.port;
    let mut sensor = Dropout::new(Noise::new(sensor::Ideal, vec![1e-6; n], 1), 0.01, 1);
    let mut actuator = Limited::new(actuator::Ideal, -20.0, 20.0);
    let setup = Loop {
        plant: plant.as_ref(),
        sensor: &mut sensor,
        port: port.as_mut(),
        actuator: &mut actuator,
        report: true,
        x0: &[0.1, 0.0, 0.0, 0.0][..n],
        period_s: spec.period_s,
        periods: 5000,
    };
    let mut hash = Hash(0xcbf2_9ce4_8422_2325);
    (close_loop(setup, &mut hash) == Ok(Ending::Finished)).then_some(hash.0)
}
