//! The two examples of the paper: as runs of `loop-sim`, and under the printed continuous controller.

use crate::oracle::{Gains, Spec};
use crate::printed::Printed;
use crate::shape::any_config;
use controller_core::{
    Config, JointParameters, Limits, Nominal, ObserverGains, Options, ReachingLaw, Reading, Surface,
};
use loop_sim::actuator::Actuator;
use loop_sim::closed_loop::{Loop, close_loop};
use loop_sim::plant::Plant;
use loop_sim::port::in_process::{ControllerSpec, Model, Precision, build};
use loop_sim::sensor::Sensor;
use loop_sim::trace::{Ending, Trace};
use loop_sim::{actuator, sensor};

/// Plant, controller and initial state of a run.
pub struct Run<'a> {
    /// The true plant.
    pub plant: &'a dyn Plant,
    /// The controller.
    pub spec: Spec,
    /// Nominal a(x) and b(x) of the controller.
    pub model: Model,
    /// Precision of the controller: f32 or f64.
    pub precision: Precision,
    /// x(0).
    pub x0: Vec<f64>,
    /// Length of the run, s.
    pub span_s: f64,
}

/// Returns Example 2: k_l = 10 to 100 without switching, gains as printed for r = 2, T = 1 ms.
pub fn joint_spec(reading: Reading, k_l: f64) -> Spec {
    let nominal = JointParameters::TABLE_I.chain(reading).nominal();
    let gains = Gains::printed(&[100.0, 20.0]);
    Spec {
        period_s: 1e-3,
        c: vec![125.0, 75.0, 15.0, 1.0],
        alpha: 1.0,
        k_l,
        k_s: 0.0,
        epsilon: 0.01,
        gradient: nominal.gradient.to_vec(),
        input_gain: nominal.input_gain,
        observers: vec![None, Some(gains.clone()), None, Some(gains)],
        limit: 1e12,
    }
}

/// Nominal joint of Example 2.
pub const NOMINAL: Nominal<4> = JointParameters::TABLE_I.chain(Reading::Reconstructed).nominal();

/// Returns a valid design of the joint: T = 1 ms, k_l = 50, |u| <= 300, equal gains in channels 2 and 4.
pub const fn joint_config<const R: usize>(gains: ObserverGains<R>) -> Config<4, R> {
    Config {
        period_s: 1e-3,
        surface: Surface { c: [125.0, 75.0, 15.0, 1.0], alpha_per_s: 1.0 },
        observers: [None, Some(gains), None, Some(gains)],
        reaching: ReachingLaw { k_l: 50.0, k_s: 0.0, epsilon: 0.01 },
        nominal: NOMINAL,
        options: Options::NEUTRAL.with_limits(Limits::symmetric(300.0)),
    }
}

/// Returns a run of Example 2: 20 s from 0.1 rad.
pub fn joint(plant: &dyn Plant, spec: Spec, precision: Precision) -> Run<'_> {
    let model = Model::Linear(spec.gradient.clone());
    Run { plant, spec, model, precision, x0: vec![0.1, 0.0, 0.0, 0.0], span_s: 20.0 }
}

/// Returns a run of Example 1 part 2: 10 s from x_1 = 1. The text does not give c_1 = 5 and alpha = 1.
pub fn complex_disturbance(plant: &dyn Plant, period_s: f64, precision: Precision) -> Run<'_> {
    let spec = Spec {
        period_s,
        c: vec![5.0, 1.0],
        alpha: 1.0,
        k_l: 50.0,
        k_s: 0.0,
        epsilon: 0.01,
        // The observer estimates e^x_1; the slope in x_2 is exact.
        gradient: vec![0.0, -1.0],
        input_gain: 1.0,
        observers: vec![Some(Gains::printed(&[100.0, 20.0])), None],
        limit: 1e12,
    };
    Run { plant, spec, model: Model::BenchmarkLibm, precision, x0: vec![1.0, 0.0], span_s: 10.0 }
}

impl Run<'_> {
    /// Runs the sampled loop with ideal sensor and actuator.
    pub fn trace(&self) -> Trace {
        self.trace_through(&mut sensor::Ideal, &mut actuator::Ideal)
    }

    /// Runs the sampled loop through a sensor and an actuator.
    ///
    /// # Panics
    /// If the design is rejected or the plant cannot be integrated. These tests do not cover either case.
    pub fn trace_through(&self, sensor: &mut dyn Sensor, actuator: &mut dyn Actuator) -> Trace {
        let spec = &self.spec;
        let designed =
            build(&ControllerSpec { precision: self.precision, model: self.model.clone(), config: any_config(spec) });
        let mut port = designed.expect("a valid design").port;
        let setup = Loop {
            plant: self.plant,
            sensor,
            port: port.as_mut(),
            actuator,
            report: true,
            missed: &[],
            x0: &self.x0,
            period_s: spec.period_s,
            periods: (self.span_s / spec.period_s).round() as usize,
        };
        let mut trace = setup.trace();
        close_loop(setup, &mut trace).unwrap_or_else(|error| panic!("{error}"));
        trace
    }

    /// Returns the ultimate (|sigma*|, |y|) from `from_s` on under the printed continuous controller, by Runge-Kutta
    /// with this step.
    pub fn continuous_ultimate(&self, a_b: &dyn Fn(&[f64]) -> (f64, f64), from_s: f64, step_s: f64) -> (f64, f64) {
        let mut printed = Printed::start(&self.spec, a_b, &self.x0);
        let (mut sigma_star, mut y) = (0.0_f64, 0.0_f64);
        let points = (self.span_s / 1e-3).round() as usize;
        for k in 0..=points {
            let t = k as f64 * 1e-3;
            if t >= from_s - 1e-9 {
                sigma_star = sigma_star.max(printed.now().sigma_star.abs());
                y = y.max(printed.x()[0].abs());
            }
            let steps = (1e-3 / step_s).ceil() as usize;
            printed.advance(&|t, x, u, dx| self.plant.rhs(t, x, u, dx), (k + 1) as f64 * 1e-3, steps);
        }
        (sigma_star, y)
    }
}

/// Returns true if the run reached its end with a bounded state.
pub fn is_bounded(trace: &Trace) -> bool {
    trace.ending == Ending::Finished
}
