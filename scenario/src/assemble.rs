//! Builds the stages of the loop from a resolved scenario.

use std::ops::{ControlFlow, Range};

use controller_core::drive::MotorMargin;
use controller_core::{ConfigError, Field, Gate, Remedy, SampleLimits};
use loop_sim::actuator::{self, Actuator};
use loop_sim::closed_loop::{Loop, LoopError, close_loop};
use loop_sim::lanes::{self, Campaign, Trial};
use loop_sim::linear::LawAtRest;
use loop_sim::metrics::{self, Metrics, Noise, Tracking};
use loop_sim::plant::{Benchmark, Chain, FlexibleJoint, JointErrors, LastChannel, Own, Plant};
use loop_sim::port::ControllerPort;
use loop_sim::port::baseline::Baseline;
use loop_sim::port::compared::Compared;
use loop_sim::port::drive::{DriveDesign, Motion};
use loop_sim::port::in_process::{self, ControllerSpec, Designed, Download, Model, Precision};
use loop_sim::sensor::{self, Sensing, Sensor};
use loop_sim::signal::{Signal, Term};
use loop_sim::trace::{Row, Trace};
use serde::Serialize;

use super::drive::coupled::CoupledBy;
use super::drive::joint_rule::JointRule;
use super::own::Formulas;
use super::resolve::{ControllerChoice, PlantChoice, Problem, Resolved, problem};
use super::{ActuatorTable, ControllerKind, ErrorTable, PlantKind, PrecisionKey, ReadingKey, Scenario, SensorTable};
use crate::error::{ScenarioError, shown};

/// Scenario ready to run.
pub struct Experiment {
    /// Short name, also of the output folder.
    pub name: String,
    /// One-line title.
    pub title: String,
    /// Length of the run, s.
    pub span_s: f64,
    /// Period T, s.
    pub period_s: f64,
    /// Number of periods in the span.
    pub periods: usize,
    /// Window [from, to] of the ultimate metrics, s.
    pub window_s: [f64; 2],
    /// Band of |y| that counts as settled, unit of the output.
    pub settling_band: f64,
    /// Unit of the output; empty if unknown.
    pub output_unit: &'static str,
    /// Unit of the control; empty if unknown.
    pub control_unit: &'static str,
    /// True state at t = 0.
    pub x0: Vec<f64>,
    /// True plant.
    pub plant: Box<dyn Plant>,
    /// Sensor.
    pub sensor: Box<dyn Sensor>,
    /// Actuator.
    pub actuator: Box<dyn Actuator>,
    /// Controller.
    pub port: Box<dyn ControllerPort>,
    /// Specification of the controller. `None` for the baseline and for drives.
    pub spec: Option<ControllerSpec>,
    /// Design for a target. `None` if it does not run on one (f64, the baseline).
    pub download: Option<Download>,
    /// True if the applied u is reported to the controller. Otherwise the controller uses its demand.
    pub report: bool,
    /// Ticks without a control interrupt.
    pub missed: Vec<Range<usize>>,
    /// Warnings about the design.
    pub warnings: Vec<String>,
    /// Bounds of the external disturbances per channel. Only for chains.
    pub mu: Vec<Mu>,
    /// Reading of the paper that is for figures only, since its input gain is not physical. `None` for other plants.
    pub figures_only: Option<&'static str>,
    /// Data of a drive. `None` for any other controller.
    pub drive: Option<Drive>,
    /// Linearised loop at rest, or the error if there is none.
    pub at_rest: Result<AtRest, ScenarioError>,
    pub(super) controller: String,
    /// Sensor with its seed, if nothing else is between plant and law.
    pub(super) sensing: Option<(Sensing, u64)>,
}

/// Loop at rest with all angles or states at 0, in f64, without random, switching or friction terms. Margins, poles and
/// noise are computed from it ([`loop_sim::linear`]).
pub struct AtRest {
    /// Plant without friction, load and disturbance.
    pub plant: Box<dyn Plant>,
    /// True inertia of the shaft that a load acts on, of the link of a joint, kg m². `None` for a chain.
    pub loaded_inertia_kg_m2: Option<f64>,
    /// Control law.
    pub law: Box<dyn LawAtRest>,
    /// Measured states.
    pub sensed: Vec<Sensed>,
    /// Ticks between a sample and the law.
    pub sensor_delay_ticks: usize,
    /// Ticks between the law and the plant.
    pub actuator_delay_ticks: usize,
    /// True if the applied u is reported to the law.
    pub report: bool,
    /// Parts of the scenario that the linearised loop leaves out, in words.
    pub left_out: Vec<&'static str>,
    /// Corners of the parameter box of a drive (uncertain_percent). Empty for other controllers.
    pub corners: Vec<Corner>,
    /// Range of inertia of a motor. `None` without a range.
    pub inertia_range: Option<InertiaRange>,
}

/// Corner of the parameter box: a plant with every main parameter at the end of its tolerance.
pub struct Corner {
    /// Deviations of the parameters: `J_l +20 %, J_m -20 %, ..`.
    pub name: String,
    /// Plant without friction, load and disturbance.
    pub plant: Box<dyn Plant>,
}

/// Range of inertia with its plants.
pub struct InertiaRange {
    /// Smallest and largest inertia, kg m².
    pub ends_kg_m2: [f64; 2],
    /// Inertia of the design, the geometric mean, kg m².
    pub designed_for_kg_m2: f64,
    /// Returns the plants with an inertia (kg m²): with the nominal K_t, and with K_t at both ends of its tolerance.
    pub plants: Box<dyn Fn(f64) -> Vec<Corner> + Send + Sync>,
}

/// Measured state.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensed {
    /// Index of the state, from 0.
    pub state: usize,
    /// Name for the output.
    pub name: String,
    /// Unit; empty if unknown.
    pub unit: &'static str,
    /// Rms error from quantisation and noise.
    pub rms: f64,
    /// Standard deviation of the declared noise alone.
    pub noise: f64,
    /// Quantisation step, twice the largest error. 0 for none.
    pub quantum: f64,
}

/// Data of a drive besides its trace.
pub struct Drive {
    /// Bandwidths and their limiting factor, one line each.
    pub chosen: Vec<String>,
    /// Current limit for both signs, A.
    pub max_current_a: f64,
    /// Shafts with an encoder.
    pub shafts: Vec<ShaftOf>,
    /// Names of the states of the plant. The current is last, and absent without a current lag.
    pub states: &'static [StateName],
    /// Start time of the reference, s.
    pub begins_s: f64,
    /// Designed drive.
    pub designed: DriveDesign,
    /// Reference of the drive.
    pub motion: Motion,
    /// Time constant of the current loop, s.
    pub current_lag_s: f64,
    /// Margin rule of a motor that gives the bandwidths or their start values.
    pub margin: MotorMargin,
    /// Parameters of the coupled design of a joint besides its data sheet.
    pub coupled: Option<CoupledBy>,
    /// Result of the rule for a joint, if the design uses it.
    pub joint_rule: Option<JointRule>,
    /// Speed limits from the supply, if the file gives one.
    pub top_speed: Option<TopSpeed>,
    /// True if backlash behind the gear lowers the bandwidths below the rule.
    pub is_slowed_by_play: bool,
    /// True if the export of an unstable drive is allowed.
    pub accepts_unstable: bool,
    /// λ_2: bound of |σ*| with the base gains while every innovation is at most one encoder count.
    pub sigma_star_bound: f64,
    /// Twin for the current noise. `None` if an encoder has a fault.
    pub(super) twin: Option<Twin>,
}

/// Speed limits from the supply, by the data sheet without friction, behind the gear, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TopSpeed {
    /// No-load speed, rad/s.
    pub no_load_rad_s: f64,
    /// Largest speed with the full current, rad/s; 0 if the supply does not drive it at rest.
    pub full_current_rad_s: f64,
}

/// Copy of the drive with finer encoders, for the current noise.
pub(super) struct Twin {
    pub(super) sensor: Box<dyn Sensor>,
    pub(super) port: Box<dyn ControllerPort>,
    /// [`Finer::share`](loop_sim::port::finer::Finer::share). `None` if the encoders are not finer.
    pub(super) share: Option<f64>,
}

/// Name and unit of a state.
pub type StateName = (&'static str, &'static str);

/// Shaft with an encoder. Its load torque against positive motion is -J d, with the disturbance d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShaftOf {
    /// Channel, from 0.
    pub channel: usize,
    /// Name for the output.
    pub name: &'static str,
    /// Inertia J of the data sheet, kg m².
    pub inertia_kg_m2: f64,
}

/// Bounds of one external disturbance over the span, Eq. (2) and (40), from the terms of the file. Model errors in d_n
/// depend on the state and are not included.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mu {
    /// Channel, from 1.
    pub channel: usize,
    /// mu_i of Eq. (40): the largest of `by_order`.
    pub mu: f64,
    /// Bounds of |d_i|, |d_i'|, .. up to the order r of the channel's observer; a step's derivative counts 0.
    pub by_order: Vec<f64>,
    /// Sum of the absolute step sizes within the span.
    pub jumps: f64,
}

impl Experiment {
    /// Runs the loop once. `watch` gets every row and can stop the run. Run an experiment only once, because controller
    /// and sensors keep their state.
    pub fn run(&mut self, watch: &mut dyn FnMut(&Row) -> ControlFlow<()>) -> (Trace, Option<LoopError>) {
        self.run_beside(None, watch)
    }

    /// Runs the loop once, beside a second copy of the controller if given. The first bit in which the two controllers
    /// differ ends the run.
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

    /// Removes the rest band, which the firmware images do not have. Returns true if there was one.
    pub fn leave_rest_band(&mut self) -> bool {
        let Some(drive) = self.drive.as_mut().filter(|drive| drive.designed.rest_band().is_some()) else {
            return false;
        };
        let designed = drive.designed.without_rest_band();
        // A valid drive stays valid without its band.
        let Ok(port) = designed.port(&drive.motion) else { return false };
        (drive.designed, self.port) = (designed, port);
        true
    }

    /// Returns the loop of this experiment, for [`close_loop`] with another recorder.
    pub fn setup(&mut self) -> Loop<'_> {
        Loop {
            plant: self.plant.as_ref(),
            sensor: self.sensor.as_mut(),
            port: self.port.as_mut(),
            actuator: self.actuator.as_mut(),
            report: self.report,
            missed: &self.missed,
            x0: &self.x0,
            period_s: self.period_s,
            periods: self.periods,
        }
    }

    /// Returns this run for a vectorised batch ([`lanes`]). `None` for a drive, an actuator, a gate, or a plant that
    /// the batch does not support.
    pub fn beside(&self) -> Option<(Campaign<'_>, Trial<'_>)> {
        let Self { period_s, periods, window_s, settling_band, .. } = *self;
        let spec = self.spec.as_ref().filter(|_| lanes::takes(self.plant.as_ref()))?;
        let (sensing, seed) = self.sensing.as_ref()?;
        let campaign = Campaign { spec, sensing, period_s, periods, window_s, settling_band };
        Some((campaign, Trial { plant: self.plant.as_ref(), x0: &self.x0, seed: *seed }))
    }

    /// Returns the metrics of a trace of this scenario.
    pub fn metrics(&self, trace: &Trace) -> Metrics {
        metrics::measure(trace, self.window_s, self.settling_band)
    }

    /// Returns the tracking metrics. `None` without a reference.
    pub fn tracking(&self, trace: &Trace) -> Option<Tracking> {
        trace.follows.map(|_| metrics::track(trace, self.window_s, self.settling_band))
    }

    /// Returns the current noise from encoder quantisation, compared with a drive with finer encoders in the same run.
    /// The noise in motion is NaN if no finer encoder is possible. `None` if an encoder has a fault.
    pub fn noise(&mut self, trace: &Trace) -> Option<Noise> {
        let Twin { sensor, port, share } = self.drive.as_mut()?.twin.as_mut()?;
        port.reset().ok()?;
        let told = metrics::noise(trace, self.window_s, self.plant.jumps_s(), sensor.as_mut(), port.as_mut());
        Some(Noise { moving: share.map_or(f64::NAN, |share| share * told.moving), ..told })
    }

    /// Returns the message for a controller whose model is a formula, with the key to change. `None` without a formula.
    /// A target computes in f32 with other functions, so its result would differ from the simulation.
    pub fn formulas_stay_here(&self) -> Option<String> {
        let ControllerSpec { config, model: Model::Formulas { drift, .. }, .. } = self.spec.as_ref()? else {
            return None;
        };
        let at_rest = vec![0.0; config.n];
        let slopes: Vec<String> = (0..config.n).map(|j| format!("{:?}", drift.slope(&at_rest, j))).collect();
        Some(format!(
            "a(x) or b(x) of the controller is a formula, which only the host evaluates, in f64; set \
             controller.nominal.a=[{}], its slopes at rest, and a constant controller.nominal.b, and the observers \
             estimate the rest; or write the model in Rust as a NominalModel",
            slopes.join(", ")
        ))
    }

    /// Returns one line with name, title, controller, span and period.
    pub fn headline(&self) -> String {
        let Self { name, title, controller, span_s, period_s, .. } = self;
        format!("{name}: {title} ({controller}, {span_s} s at T = {period_s} s)")
    }
}

/// Builds the experiment. `told` adds a place to a problem.
pub(super) fn assemble(
    resolved: Resolved,
    told: &dyn Fn(Problem) -> ScenarioError,
) -> Result<Experiment, ScenarioError> {
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
    // K_t is a torque per ampere, so the u of the joint is in amperes.
    let (output_unit, control_unit) =
        if matches!(plant, PlantChoice::FlexibleJoint { .. }) { ("rad", "A") } else { ("", "") };
    let disturbances: Vec<Signal> = disturbance.into_iter().map(Signal::new).collect();

    let (port, law, spec, download, warnings, orders): (Box<dyn ControllerPort>, _, _, _, Vec<String>, Vec<usize>) =
        match controller {
            ControllerChoice::Proposed(spec) => {
                let Designed { port, warnings, download, at_rest } =
                    in_process::build(&spec).map_err(|error| told(design_problem(&error, &observer_position)))?;
                let observers = spec.config.padded.observers.iter().take(spec.config.n);
                let orders = observers.map(|gains| gains.map_or(0, |gains| gains.order())).collect();
                let warnings = warnings.iter().map(ToString::to_string).collect();
                (port, Some(at_rest), Some(*spec), download, warnings, orders)
            }
            ControllerChoice::Baseline(spec) => {
                (Box::new(Baseline::new(spec)), None, None, None, Vec::new(), vec![1, 0])
            }
        };
    let warnings = warnings.into_iter().chain(late_steps(&file)).collect();
    let at_rest = at_rest(&plant, law, output_unit, &file).map_err(told);
    let sensing = sensing_of(&file.sensor);
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
        plant: plant_of(plant, &file.plant.error, disturbances, Some(period_s)).map_err(told)?,
        sensor: gated(sensing.sensor(file.seed), spec.as_ref()),
        actuator: actuator_of(&file.actuator, period_s),
        x0,
        port,
        download,
        report: file.actuator.report,
        missed: Vec::new(),
        warnings,
        mu,
        figures_only: (file.plant.kind == PlantKind::FlexibleJoint && file.plant.reading != ReadingKey::Physical)
            .then(|| file.plant.reading.word()),
        drive: None,
        at_rest,
        sensing: is_direct(&file.actuator, spec.as_ref()).then_some((sensing, file.seed)),
        spec,
        controller: controller_word(&file).into(),
    })
}

fn controller_word(file: &Scenario) -> &'static str {
    match (file.controller.kind, file.controller.precision) {
        (ControllerKind::Baseline, _) => "baseline f64",
        (ControllerKind::Proposed, PrecisionKey::F32) => "f32",
        (ControllerKind::Proposed, PrecisionKey::F64) => "f64",
    }
}

/// Returns warnings for steps of disturbances after the end of the run.
fn late_steps(file: &Scenario) -> Vec<String> {
    let of_channels = (1..).zip(&file.plant.disturbance);
    let of_channels = of_channels.map(|(k, table)| (format!("plant.disturbance[{k}].terms"), &table.terms));
    let at_input = file.plant.input_disturbance.iter().map(|terms| ("plant.input_disturbance".to_owned(), terms));
    let late = of_channels.chain(at_input).flat_map(|(key, terms)| {
        let late = (1..).zip(terms).filter(|(_, term)| term.t0_s.is_some_and(|t0_s| t0_s >= file.span_s));
        late.map(move |(k, term)| {
            let (at, span) = (shown(term.t0_s.unwrap_or_default()), shown(file.span_s));
            format!("{key}[{k}].t0_s = {at} is not before the end of the run, span_s = {span}: the step never occurs")
        })
    });
    late.collect()
}

/// Largest number of delay states of a loop at rest: one per tick of u, one per tick and entry of a sample.
const MOST_DELAY_STATES: usize = 40;

fn at_rest(
    plant: &PlantChoice,
    law: Option<Box<dyn LawAtRest>>,
    unit: &'static str,
    file: &Scenario,
) -> Result<AtRest, Problem> {
    let Scenario { sensor, actuator, controller, .. } = file;
    let Some(law) = law else {
        return problem("controller.kind", "a switching law has no poles and margins: take \"proposed\"");
    };
    if actuator.hold_ticks > 1 {
        let period_s = shown(controller.period_s * actuator.hold_ticks as f64);
        let message = format!(
            "poles and margins are computed for a loop that acts in every tick: take controller.period_s = {period_s} \
             with actuator.hold_ticks = 1"
        );
        return problem("actuator.hold_ticks", message);
    }
    let still = match plant.clone() {
        PlantChoice::FlexibleJoint { chain, .. } => PlantChoice::FlexibleJoint { chain, input_disturbance: Vec::new() },
        other => other,
    };
    let order = match &still {
        PlantChoice::FlexibleJoint { .. } => 4,
        PlantChoice::Benchmark { .. } => 2,
        PlantChoice::Chain { a, .. } => a.len(),
        PlantChoice::Own(formulas) => formulas.rates.len(),
    };
    for (key, ticks, states) in [("sensor", sensor.delay_ticks, order), ("actuator", actuator.delay_ticks, 1)] {
        let most = MOST_DELAY_STATES / states;
        if ticks > most {
            let message = format!("poles and margins are computed for a delay of up to {most} ticks");
            return problem(format!("{key}.delay_ticks"), message);
        }
    }
    let of = |row: &Option<Vec<f64>>, state: usize| row.as_ref().and_then(|row| row.get(state)).copied().unwrap_or(0.0);
    let rates = match (unit, &still) {
        ("rad", PlantChoice::FlexibleJoint { .. }) => ["rad", "rad/s", "rad/s^2", "rad/s^3"],
        _ => [""; 4],
    };
    let sensed = (0..order).map(|state| Sensed {
        state,
        name: format!("x_{}", state + 1),
        unit: rates.get(state).copied().unwrap_or(""),
        rms: (of(&sensor.noise, state).powi(2) + of(&sensor.quantum, state).powi(2) / 12.0).sqrt(),
        noise: of(&sensor.noise, state),
        quantum: of(&sensor.quantum, state),
    });
    let left_out = [
        (
            matches!(still, PlantChoice::FlexibleJoint { .. } | PlantChoice::Benchmark { .. } | PlantChoice::Own(_)),
            "the plant away from x = 0",
        ),
        (controller.k_s > 0.0, "the switching term beyond its boundary layer"),
        (sensor.jitter > 0.0, "jitter"),
        (sensor.dropout > 0.0, "lost samples"),
        (actuator.rate_per_s.is_some(), "the rate limit"),
    ];
    Ok(AtRest {
        loaded_inertia_kg_m2: None,
        plant: plant_of(still, &file.plant.error, vec![Signal::default(); order], None)?,
        law,
        sensed: sensed.collect(),
        sensor_delay_ticks: sensor.delay_ticks,
        actuator_delay_ticks: actuator.delay_ticks,
        report: actuator.report,
        left_out: left_out.into_iter().filter_map(|(is_there, what)| is_there.then_some(what)).collect(),
        corners: Vec::new(),
        inertia_range: None,
    })
}

fn bounds(disturbances: &[Signal], orders: &[usize], span_s: f64) -> Vec<Mu> {
    let channels = disturbances.iter().zip(orders).enumerate();
    let mu = channels.map(|(i, (signal, &order))| {
        let by_order: Vec<f64> = (0..=order as u32).map(|j| signal.bound(j, span_s)).collect();
        let jumps = signal.terms().iter().map(|term| match *term {
            Term::Step { amplitude, t0_s } if t0_s > 0.0 && t0_s < span_s => amplitude.abs(),
            _ => 0.0,
        });
        Mu { channel: i + 1, mu: by_order.iter().copied().fold(0.0, f64::max), by_order, jumps: jumps.sum() }
    });
    mu.collect()
}

/// Returns the plant. With a period it has its exact step, if one exists.
fn plant_of(
    choice: PlantChoice,
    errors: &ErrorTable,
    disturbances: Vec<Signal>,
    period_s: Option<f64>,
) -> Result<Box<dyn Plant>, Problem> {
    let mut given = disturbances.into_iter();
    let mut next = || given.next().unwrap_or_default();
    Ok(match choice {
        PlantChoice::FlexibleJoint { chain, input_disturbance } => {
            let ErrorTable { k1, k1_x3, b1, k2_x1, k2_x3, b2, b } = *errors;
            let errors = JointErrors { k1, k1_x3, b1, k2_x1, k2_x3, b2, b };
            let extra = [next(), next(), next(), next()];
            let joint = FlexibleJoint::new(chain, errors, Signal::new(input_disturbance), extra);
            Box::new(match period_s {
                Some(period_s) => joint.sampled(period_s),
                None => joint,
            })
        }
        PlantChoice::Benchmark { state_dependent } => Box::new(Benchmark::new([next(), next()], state_dependent)),
        PlantChoice::Chain { a, b, nominal_a, nominal_b } => {
            let truth = LastChannel { a, b };
            let nominal = LastChannel { a: nominal_a, b: nominal_b };
            let chain = Chain::new(truth, nominal, given.collect());
            let chain = chain.map_err(|error| Problem { key: "plant".into(), message: error.to_string() })?;
            Box::new(match period_s {
                Some(period_s) => chain.sampled(period_s),
                None => chain,
            })
        }
        PlantChoice::Own(Formulas { rates, drift, gain }) => {
            let own = Own::new(rates, drift, gain, given.collect());
            Box::new(own.map_err(|error| Problem { key: "plant".into(), message: error.to_string() })?)
        }
    })
}

/// Returns true if there is neither an actuator nor a gate between law and plant.
fn is_direct(actuator: &ActuatorTable, spec: Option<&ControllerSpec>) -> bool {
    let free = actuator.rate_per_s.is_none()
        && actuator.min.is_none()
        && actuator.max.is_none()
        && actuator.delay_ticks == 0
        && actuator.hold_ticks <= 1;
    free && spec.is_some_and(|spec| spec.config.padded.options.samples == SampleLimits::NONE)
}

/// Returns the sensor of a table.
fn sensing_of(table: &SensorTable) -> Sensing {
    let SensorTable { jitter, noise, quantum, delay_ticks, dropout } = table.clone();
    let (noise, quantum) = (noise.unwrap_or_default(), quantum.unwrap_or_default());
    Sensing { jitter, noise, quantum, delay_ticks, dropout, ..Sensing::IDEAL }
}

/// Adds the gate for a controller with limits of its samples.
fn gated(sensor: Box<dyn Sensor>, spec: Option<&ControllerSpec>) -> Box<dyn Sensor> {
    let Some(ControllerSpec { precision, config, .. }) = spec else { return sensor };
    let samples = &config.padded.options.samples;
    match precision {
        _ if *samples == SampleLimits::NONE => sensor,
        Precision::F32 => Box::new(sensor::Gated::new(sensor, Gate::<f32, _>::new(samples))),
        Precision::F64 => Box::new(sensor::Gated::new(sensor, Gate::<f64, _>::new(samples))),
    }
}

/// Returns the actuator: hold, delay, limits, rate limit. It is built from the plant outwards. The limits come before
/// the rate limit, so that the rate limiter never runs beyond them.
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
        chain = Box::new(actuator::SlowBus::new(chain, table.hold_ticks));
    }
    chain
}

/// Translates a design error to the key of the scenario and its remedy.
fn design_problem(error: &ConfigError, observer_position: &[Option<usize>]) -> Problem {
    let path = error.field.name();
    let word = path.rsplit('.').next().unwrap_or(path);
    let key = match error.field {
        Field::Observer { channel } => match observer_position.get(channel.wrapping_sub(1)).copied().flatten() {
            Some(position) => format!("controller.observer[{position}]"),
            None => "controller.observer".into(),
        },
        // A chain is checked earlier, so this is a vanishing b of the joint.
        Field::InputGain | Field::Gradient => "plant.parameters".into(),
        Field::Whole => "controller".into(),
        // All other keys have the name of the field.
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
