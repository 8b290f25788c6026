//! From what a scenario means to the stages of the loop.

use std::ops::ControlFlow;

use controller_core::drive::{JointDesign, MotorDesign, Mounting};
use controller_core::{ConfigError, Field, Gate, Remedy, SampleLimits};
use loop_sim::actuator::{self, Actuator};
use loop_sim::closed_loop::{Loop, LoopError, close_loop};
use loop_sim::metrics::{self, Metrics, Noise, Tracking};
use loop_sim::plant::{Benchmark, Chain, FlexibleJoint, JointErrors, LastChannel, Plant};
use loop_sim::port::ControllerPort;
use loop_sim::port::baseline::Baseline;
use loop_sim::port::compared::Compared;
use loop_sim::port::drive::Form;
use loop_sim::port::in_process::{self, ControllerSpec, Designed, Download, Precision};
use loop_sim::sensor::{self, Sensor};
use loop_sim::signal::Signal;
use loop_sim::trace::{Row, Trace};
use serde::Serialize;

use super::resolve::{ControllerChoice, PlantChoice, Problem, Resolved};
use super::{ActuatorTable, ControllerKind, ErrorTable, PrecisionKey, SensorTable};

/// A scenario ready to run.
pub struct Experiment {
    /// Short name: the output folder.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// Length of the run, s.
    pub span_s: f64,
    /// Period T, s.
    pub period_s: f64,
    /// Number of periods in the span.
    pub periods: usize,
    /// Window of the ultimate figures, s.
    pub window_s: [f64; 2],
    /// |y| within this counts as settled.
    pub settling_band: f64,
    /// Unit of the output; empty if unknown.
    pub output_unit: &'static str,
    /// Unit of the control; empty if unknown.
    pub control_unit: &'static str,
    /// True state at t = 0.
    pub x0: Vec<f64>,
    /// The true plant.
    pub plant: Box<dyn Plant>,
    /// Measuring chain.
    pub sensor: Box<dyn Sensor>,
    /// Actuating chain.
    pub actuator: Box<dyn Actuator>,
    /// The controller.
    pub port: Box<dyn ControllerPort>,
    /// What it was designed from; none for the baseline.
    pub spec: Option<ControllerSpec>,
    /// Its design for a target; none if it does not run on one (f64, the baseline).
    pub download: Option<Download>,
    /// Is the controller told what the actuator holds? Else it lives on what it asked for.
    pub report: bool,
    /// What to be warned of in the design.
    pub warnings: Vec<String>,
    /// Bounds of the external disturbances per channel; chain plants only.
    pub mu: Vec<Mu>,
    /// What is to be told of a drive; none for any other controller.
    pub drive: Option<Drive>,
    pub(super) controller: String,
}

/// What a drive is designed from, with sign and offset of its encoders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveDesign {
    /// A motor with one encoder.
    Motor(MotorDesign, Mounting),
    /// A joint with encoders on link and motor.
    Joint(JointDesign, [Mounting; 2]),
}

/// What a drive has to tell beside its trace.
pub struct Drive {
    /// What it is designed from.
    pub design: DriveDesign,
    /// Its gain sets, delay, observer states, and what it follows.
    pub form: Form,
    /// Bandwidths and why, a line each.
    pub chosen: Vec<String>,
    /// Limit of the current of either sign, A.
    pub max_current_a: f64,
    /// Shafts with an encoder.
    pub shafts: Vec<ShaftOf>,
    /// When the reference begins to move, s.
    pub begins_s: f64,
    /// The same drive with finer encoders, if there is room for such, and nothing is wrong with the coarse ones.
    pub(super) exact: Option<(Box<dyn Sensor>, Box<dyn ControllerPort>)>,
}

/// A shaft with an encoder: the torque against it is -J d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShaftOf {
    /// Its channel, from 0.
    pub channel: usize,
    /// What it is called.
    pub name: &'static str,
    /// J of the data sheet, kg m².
    pub inertia_kg_m2: f64,
}

/// Bounds of one external disturbance over the span, Eq. (2) and (40): what the file's terms say. What a wrong model
/// adds to d_n depends on the state and is not in it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mu {
    /// Channel, from 1.
    pub channel: usize,
    /// mu_i of Eq. (40): the largest of `by_order`.
    pub mu: f64,
    /// Bounds of |d_i|, |d_i'|, .. up to the order r of the channel's observer; a step's derivative counts 0.
    pub by_order: Vec<f64>,
}

impl Experiment {
    /// Runs the loop once; `watch` sees every row and may break off.
    pub fn run(&mut self, watch: &mut dyn FnMut(&Row) -> ControlFlow<()>) -> (Trace, Option<LoopError>) {
        self.run_beside(None, watch)
    }

    /// Runs the loop once, with the same controller elsewhere if there is one: both tick, and the first bit in which
    /// they differ ends the run.
    pub fn run_beside(
        &mut self,
        other: Option<&mut dyn ControllerPort>,
        watch: &mut dyn FnMut(&Row) -> ControlFlow<()>,
    ) -> (Trace, Option<LoopError>) {
        let mut compared;
        let mut setup = self.setup();
        if let Some(other) = other {
            compared = Compared::new(other, setup.port);
            setup.port = &mut compared;
        }
        let mut trace = setup.trace();
        let error = close_loop(setup, &mut (&mut trace, watch)).err();
        (trace, error)
    }

    /// The loop of this experiment, for [`close_loop`] with a recorder of one's own.
    pub fn setup(&mut self) -> Loop<'_> {
        Loop {
            plant: self.plant.as_ref(),
            sensor: self.sensor.as_mut(),
            port: self.port.as_mut(),
            actuator: self.actuator.as_mut(),
            report: self.report,
            x0: &self.x0,
            period_s: self.period_s,
            periods: self.periods,
        }
    }

    /// Figures of merit of a trace of this scenario.
    pub fn metrics(&self, trace: &Trace) -> Metrics {
        metrics::measure(trace, self.window_s, self.settling_band)
    }

    /// How a reference was followed; none where there is none.
    pub fn tracking(&self, trace: &Trace) -> Option<Tracking> {
        trace.follows.map(|_| metrics::track(trace, self.window_s, self.settling_band))
    }

    /// Noise of u by the steps of the encoders of a drive, against the same drive with finer ones in the same run.
    pub fn noise(&mut self, trace: &Trace) -> Option<Noise> {
        let (sensor, port) = self.drive.as_mut()?.exact.as_mut()?;
        port.reset().ok()?;
        Some(metrics::noise(trace, self.window_s, self.plant.jumps_s(), sensor.as_mut(), port.as_mut()))
    }

    /// What is being run, in one line.
    pub fn headline(&self) -> String {
        let Self { name, title, controller, span_s, period_s, .. } = self;
        format!("{name}: {title} ({controller}, {span_s} s at T = {period_s} s)")
    }
}

pub(super) fn assemble(resolved: Resolved) -> Result<Experiment, Problem> {
    let Resolved {
        name,
        title,
        span_s,
        periods,
        window_s,
        x0,
        plant,
        disturbance,
        controller,
        observer_position,
        file,
    } = resolved;
    let period_s = file.controller.period_s;
    let is_chain = matches!(plant, PlantChoice::Chain { .. });
    // K_t is a torque per ampere, so the joint's u counts amperes.
    let (output_unit, control_unit) =
        if matches!(plant, PlantChoice::FlexibleJoint { .. }) { ("rad", "A") } else { ("", "") };
    let disturbances: Vec<Signal> = disturbance.into_iter().map(Signal::new).collect();

    let (port, spec, download, warnings, orders): (Box<dyn ControllerPort>, _, _, Vec<String>, Vec<usize>) =
        match controller {
            ControllerChoice::Proposed(spec) => {
                let Designed { port, warnings, download } =
                    in_process::build(&spec).map_err(|error| design_problem(&error, &observer_position))?;
                let observers = spec.config.padded.observers.iter().take(spec.config.n);
                let orders = observers.map(|gains| gains.map_or(0, |gains| gains.order())).collect();
                (port, Some(*spec), download, warnings.iter().map(ToString::to_string).collect(), orders)
            }
            ControllerChoice::Baseline(spec) => (Box::new(Baseline::new(spec)), None, None, Vec::new(), vec![1, 0]),
        };
    let mu = if is_chain { bounds(&disturbances, &orders, span_s) } else { Vec::new() };

    Ok(Experiment {
        name,
        title,
        span_s,
        period_s,
        periods,
        window_s,
        settling_band: file.settling_band,
        output_unit,
        control_unit,
        plant: plant_of(plant, &file.plant.error, disturbances)?,
        sensor: gated(sensor_of(&file.sensor, file.seed), spec.as_ref()),
        actuator: actuator_of(&file.actuator, period_s),
        x0,
        port,
        spec,
        download,
        report: file.actuator.report,
        warnings,
        mu,
        drive: None,
        controller: match (file.controller.kind, file.controller.precision) {
            (ControllerKind::Baseline, _) => "baseline f64".into(),
            (ControllerKind::Proposed, PrecisionKey::F32) => "f32".into(),
            (ControllerKind::Proposed, PrecisionKey::F64) => "f64".into(),
        },
    })
}

fn bounds(disturbances: &[Signal], orders: &[usize], span_s: f64) -> Vec<Mu> {
    let channels = disturbances.iter().zip(orders).enumerate();
    let mu = channels.map(|(i, (signal, &order))| {
        let by_order: Vec<f64> = (0..=order as u32).map(|j| signal.bound(j, span_s)).collect();
        Mu { channel: i + 1, mu: by_order.iter().copied().fold(0.0, f64::max), by_order }
    });
    mu.collect()
}

fn plant_of(choice: PlantChoice, errors: &ErrorTable, disturbances: Vec<Signal>) -> Result<Box<dyn Plant>, Problem> {
    let mut given = disturbances.into_iter();
    let mut next = || given.next().unwrap_or_default();
    Ok(match choice {
        PlantChoice::FlexibleJoint { chain, input_disturbance } => {
            let ErrorTable { k1, k1_x3, b1, k2_x1, k2_x3, b2, b } = *errors;
            let errors = JointErrors { k1, k1_x3, b1, k2_x1, k2_x3, b2, b };
            let extra = [next(), next(), next(), next()];
            Box::new(FlexibleJoint::new(chain, errors, Signal::new(input_disturbance), extra))
        }
        PlantChoice::Benchmark { state_dependent } => Box::new(Benchmark::new([next(), next()], state_dependent)),
        PlantChoice::Chain { a, b, nominal_a, nominal_b } => {
            let truth = LastChannel { a, b };
            let nominal = LastChannel { a: nominal_a, b: nominal_b };
            let chain = Chain::new(truth, nominal, given.collect());
            Box::new(chain.map_err(|error| Problem { key: "plant".into(), message: error.to_string() })?)
        }
    })
}

/// From the truth to the sample: jitter, noise, quantisation, delay, dropout.
fn sensor_of(table: &SensorTable, seed: u64) -> Box<dyn Sensor> {
    let mut chain: Box<dyn Sensor> = Box::new(sensor::Ideal);
    if table.jitter > 0.0 {
        chain = Box::new(sensor::Jittered::new(chain, table.jitter, seed));
    }
    if let Some(noise) = &table.noise {
        chain = Box::new(sensor::Noise::new(chain, noise.clone(), seed));
    }
    if let Some(quantum) = &table.quantum {
        chain = Box::new(sensor::Quantised::new(chain, quantum.clone()));
    }
    if table.delay_ticks > 0 {
        chain = Box::new(sensor::Delayed::new(chain, table.delay_ticks));
    }
    if table.dropout > 0.0 {
        chain = Box::new(sensor::Dropout::new(chain, table.dropout, seed));
    }
    chain
}

/// Before a controller that keeps limits of its samples, its gate.
fn gated(sensor: Box<dyn Sensor>, spec: Option<&ControllerSpec>) -> Box<dyn Sensor> {
    let Some(ControllerSpec { precision, config, .. }) = spec else { return sensor };
    let samples = &config.padded.options.samples;
    match precision {
        _ if *samples == SampleLimits::NONE => sensor,
        Precision::F32 => Box::new(sensor::Gated::new(sensor, Gate::<f32, _>::new(samples))),
        Precision::F64 => Box::new(sensor::Gated::new(sensor, Gate::<f64, _>::new(samples))),
    }
}

/// From the demand to the plant: hold, delay, limits, rate limit. Built from the plant outwards. The limits come before
/// the rate, so that a rate limiter never runs on beyond them.
fn actuator_of(table: &ActuatorTable, period_s: f64) -> Box<dyn Actuator> {
    let mut chain: Box<dyn Actuator> = Box::new(actuator::Ideal);
    if let Some(rate_per_s) = table.rate_per_s {
        chain = Box::new(actuator::RateLimited::new(chain, rate_per_s, period_s));
    }
    if table.min.is_some() || table.max.is_some() {
        let (min, max) = (table.min.unwrap_or(f64::NEG_INFINITY), table.max.unwrap_or(f64::INFINITY));
        chain = Box::new(actuator::Limited::new(chain, min, max));
    }
    if table.delay_ticks > 0 {
        chain = Box::new(actuator::Delayed::new(chain, table.delay_ticks));
    }
    if table.hold_ticks > 1 {
        chain = Box::new(actuator::Held::new(chain, table.hold_ticks));
    }
    chain
}

/// A refused design in the words of a scenario: the key that it is about, and what to do there.
fn design_problem(error: &ConfigError, observer_position: &[Option<usize>]) -> Problem {
    let path = error.field.name();
    let word = path.rsplit('.').next().unwrap_or(path);
    let key = match error.field {
        Field::Observer { channel } => match observer_position.get(channel.wrapping_sub(1)).copied().flatten() {
            Some(position) => format!("controller.observer[{position}]"),
            None => "controller.observer".into(),
        },
        // That of a chain is looked at before; what is left is a b of the joint that vanishes.
        Field::InputGain | Field::Gradient => "plant.parameters".into(),
        Field::Whole => "controller".into(),
        // All other keys have the names of the fields.
        _ => format!("controller.{word}"),
    };
    let remedy = match error.cause.remedy() {
        Remedy::FiniteNumber => ": give a finite one (for no limit of u: leave the limit out)",
        Remedy::NoLimit => ": where the actuator has none leave the limit out",
        Remedy::SurfaceFromBandwidth => "; try surface_bandwidth_rad_s",
        Remedy::ObserverFromBandwidth => ": give bandwidth_rad_s or poles instead",
        Remedy::OtherOrder => ": an order is 1 to 3",
        Remedy::SlowerObserver => ": slow the observer, shorten the period, or raise observer_pole_limit",
        _ => "",
    };
    let message = error.told(word, remedy).to_string();
    Problem { key, message }
}
