//! From what a scenario means to the stages of the loop.

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
    /// Ticks whose interrupt does not come.
    pub missed: Vec<Range<usize>>,
    /// What to be warned of in the design.
    pub warnings: Vec<String>,
    /// Bounds of the external disturbances per channel; chain plants only.
    pub mu: Vec<Mu>,
    /// The reading of the paper that the controller is designed for, if it is for figures only: no joint is like it.
    pub figures_only: Option<&'static str>,
    /// What is to be told of a drive; none for any other controller.
    pub drive: Option<Drive>,
    /// The same loop standing still, or why it has no such form.
    pub at_rest: Result<AtRest, ScenarioError>,
    pub(super) controller: String,
    /// The measuring chain with its seed, if it is all that is between plant and law.
    pub(super) sensing: Option<(Sensing, u64)>,
}

/// A loop that stands still where its angles or states are 0, in f64, with nothing in it that is random, jumps or
/// wears: of it margins, poles and noise are computed ([`loop_sim::linear`]).
pub struct AtRest {
    /// The plant without friction, load and disturbance.
    pub plant: Box<dyn Plant>,
    /// The law.
    pub law: Box<dyn LawAtRest>,
    /// What it measures.
    pub sensed: Vec<Sensed>,
    /// Ticks between a sample and the law.
    pub sensor_delay_ticks: usize,
    /// Ticks between the law and the plant.
    pub actuator_delay_ticks: usize,
    /// Is the law told what the actuator holds?
    pub report: bool,
    /// What of the scenario is not in it, in words.
    pub left_out: Vec<&'static str>,
    /// The corners of what a file of a drive says of how well its data sheet is known; else none.
    pub corners: Vec<Corner>,
    /// Of a motor whose file says a range of its inertia.
    pub inertia_range: Option<InertiaRange>,
}

/// A plant of which every main number of the data sheet is off by as much as the file says that it may be.
pub struct Corner {
    /// What is off: `J_l +20 %, J_m -20 %, ..`.
    pub name: String,
    /// The plant without friction, load and disturbance.
    pub plant: Box<dyn Plant>,
}

/// A range of inertia, and the plants in it.
pub struct InertiaRange {
    /// The smallest and the largest, kg m².
    pub ends_kg_m2: [f64; 2],
    /// What the design is for, the geometric mean, kg m².
    pub designed_for_kg_m2: f64,
    /// Those with an inertia (kg m²): K_t as in the data sheet, then less and more by as much as the file says.
    pub plants: Box<dyn Fn(f64) -> Vec<Corner> + Send + Sync>,
}

/// An entry of the sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensed {
    /// The state that it sees, from 0.
    pub state: usize,
    /// What it is called.
    pub name: String,
    /// Its unit; empty if unknown.
    pub unit: &'static str,
    /// Rms of what its steps and its noise add.
    pub rms: f64,
    /// The noise of these alone: what the file declares.
    pub noise: f64,
    /// Largest step of what it tells: its error is half of it at most. 0 for none.
    pub quantum: f64,
}

/// What a drive has to tell beside its trace.
pub struct Drive {
    /// Bandwidths and why, a line each.
    pub chosen: Vec<String>,
    /// Limit of the current of either sign, A.
    pub max_current_a: f64,
    /// Shafts with an encoder.
    pub shafts: Vec<ShaftOf>,
    /// The states of its plant, the current last: without a lag there is none.
    pub states: &'static [StateName],
    /// When the reference begins to move, s.
    pub begins_s: f64,
    /// The drive before it runs.
    pub designed: DriveDesign,
    /// Its reference.
    pub motion: Motion,
    /// Time constant of the current loop, s.
    pub current_lag_s: f64,
    /// The rule of a motor, whose bandwidths these are or begin with.
    pub margin: MotorMargin,
    /// What the design of a joint as a whole is told besides its sheet.
    pub coupled: Option<CoupledBy>,
    /// What its rule says, where the design is by it.
    pub joint_rule: Option<JointRule>,
    /// What the supply leaves, if the file says it.
    pub top_speed: Option<TopSpeed>,
    /// Has play behind the gear made its bandwidths smaller than the rule's?
    pub is_slowed_by_play: bool,
    /// May it be exported although it is unstable?
    pub accepts_unstable: bool,
    /// λ_2: what |σ*| stays below with the quiet gains while every innovation is at most one step of its encoder.
    pub sigma_star_bound: f64,
    /// What the noise of u is told by; none if something is wrong with the encoders.
    pub(super) twin: Option<Twin>,
}

/// Speeds that a supply allows the motor of a data sheet, without its friction, where the angle is meant, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TopSpeed {
    /// Without load.
    pub no_load_rad_s: f64,
    /// Up to which the largest current is driven; 0 if it is not even at rest.
    pub full_current_rad_s: f64,
}

/// The same drive once more, with finer encoders if there is room for such.
pub(super) struct Twin {
    pub(super) sensor: Box<dyn Sensor>,
    pub(super) port: Box<dyn ControllerPort>,
    /// [`Finer::share`](loop_sim::port::finer::Finer::share); none if the encoders are the same.
    pub(super) share: Option<f64>,
}

/// Name and unit of a state.
pub type StateName = (&'static str, &'static str);

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
    /// Sum of the sizes of its steps within the span.
    pub jumps: f64,
}

impl Experiment {
    /// Runs the loop once; `watch` sees every row and may break off. It is used up then: controller and sensors would
    /// go on from where they are.
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

    /// The same without a band at rest, as images on a chip run it: whether it had one.
    pub fn leave_rest_band(&mut self) -> bool {
        let Some(drive) = self.drive.as_mut().filter(|drive| drive.designed.rest_band().is_some()) else {
            return false;
        };
        let designed = drive.designed.without_rest_band();
        // A drive that ran with a band runs without one.
        let Ok(port) = designed.port(&drive.motion) else { return false };
        (drive.designed, self.port) = (designed, port);
        true
    }

    /// The loop of this experiment, for [`close_loop`] with a recorder of one's own.
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

    /// This run as one of many side by side ([`lanes`]); none if it has anything that those do not know: a drive, an
    /// actuator, a gate, a plant that they do not take.
    pub fn beside(&self) -> Option<(Campaign<'_>, Trial<'_>)> {
        let Self { period_s, periods, window_s, settling_band, .. } = *self;
        let spec = self.spec.as_ref().filter(|_| lanes::takes(self.plant.as_ref()))?;
        let (sensing, seed) = self.sensing.as_ref()?;
        let campaign = Campaign { spec, sensing, period_s, periods, window_s, settling_band };
        Some((campaign, Trial { plant: self.plant.as_ref(), x0: &self.x0, seed: *seed }))
    }

    /// Figures of merit of a trace of this scenario.
    pub fn metrics(&self, trace: &Trace) -> Metrics {
        metrics::measure(trace, self.window_s, self.settling_band)
    }

    /// How a reference was followed; none where there is none.
    pub fn tracking(&self, trace: &Trace) -> Option<Tracking> {
        trace.follows.map(|_| metrics::track(trace, self.window_s, self.settling_band))
    }

    /// Noise of u by the steps of the encoders of a drive, against the same drive with finer ones in the same run;
    /// where there is no room for such, nothing is told of it in motion (NaN). None if something is wrong with the
    /// encoders.
    pub fn noise(&mut self, trace: &Trace) -> Option<Noise> {
        let Twin { sensor, port, share } = self.drive.as_mut()?.twin.as_mut()?;
        port.reset().ok()?;
        let told = metrics::noise(trace, self.window_s, self.plant.jumps_s(), sensor.as_mut(), port.as_mut());
        Some(Noise { moving: share.map_or(f64::NAN, |share| share * told.moving), ..told })
    }

    /// Why a controller whose model is a formula runs in this process only, and which key to change; `None` without a
    /// formula. A target computes in f32, with functions of its own: it would not run what was simulated.
    pub fn formulas_stay_here(&self) -> Option<String> {
        let ControllerSpec { config, model: Model::Formulas { drift, .. }, .. } = self.spec.as_ref()? else {
            return None;
        };
        let at_rest = vec![0.0; config.n];
        let slopes: Vec<String> = (0..config.n).map(|j| format!("{:?}", drift.slope(&at_rest, j))).collect();
        Some(format!(
            "a(x) or b(x) of the controller is a formula, which is computed here in f64 only; set \
             controller.nominal.a=[{}], its slopes at rest, and a constant controller.nominal.b, and the observers \
             estimate what that leaves out; or write it in Rust as a NominalModel",
            slopes.join(", ")
        ))
    }

    /// What is being run, in one line.
    pub fn headline(&self) -> String {
        let Self { name, title, controller, span_s, period_s, .. } = self;
        format!("{name}: {title} ({controller}, {span_s} s at T = {period_s} s)")
    }
}

/// `told` makes an error of a problem that has a place.
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
    // K_t is a torque per ampere, so the joint's u counts amperes.
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

/// Steps of disturbances that come after the end of the run.
fn late_steps(file: &Scenario) -> Vec<String> {
    let of_channels = (1..).zip(&file.plant.disturbance);
    let of_channels = of_channels.map(|(k, table)| (format!("plant.disturbance[{k}].terms"), &table.terms));
    let at_input = file.plant.input_disturbance.iter().map(|terms| ("plant.input_disturbance".to_owned(), terms));
    let late = of_channels.chain(at_input).flat_map(|(key, terms)| {
        let late = (1..).zip(terms).filter(|(_, term)| term.t0_s.is_some_and(|t0_s| t0_s >= file.span_s));
        late.map(move |(k, term)| {
            let (at, span) = (shown(term.t0_s.unwrap_or_default()), shown(file.span_s));
            format!("{key}[{k}].t0_s = {at} is not before the end of the run, span_s = {span}: there is no such step")
        })
    });
    late.collect()
}

/// States that a delay of a loop at rest may have: one for a tick, of a sample one for each of its entries.
const MOST_DELAY_STATES: usize = 40;

fn at_rest(
    plant: &PlantChoice,
    law: Option<Box<dyn LawAtRest>>,
    unit: &'static str,
    file: &Scenario,
) -> Result<AtRest, Problem> {
    let Scenario { sensor, actuator, controller, .. } = file;
    let Some(law) = law else {
        return problem("controller.kind", "a law that switches has no poles and margins: take \"proposed\"");
    };
    if actuator.hold_ticks > 1 {
        let period_s = shown(controller.period_s * actuator.hold_ticks as f64);
        let message = format!(
            "poles and margins are those of a loop that acts in every tick: look at controller.period_s = {period_s} \
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
            let message = format!("poles and margins are computed with a delay of up to {most} ticks here");
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

/// With a period it has its own step, if there is one.
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

/// Neither actuator nor gate between law and plant.
fn is_direct(actuator: &ActuatorTable, spec: Option<&ControllerSpec>) -> bool {
    let free = actuator.rate_per_s.is_none()
        && actuator.min.is_none()
        && actuator.max.is_none()
        && actuator.delay_ticks == 0
        && actuator.hold_ticks <= 1;
    free && spec.is_some_and(|spec| spec.config.padded.options.samples == SampleLimits::NONE)
}

/// From the truth to the sample.
fn sensing_of(table: &SensorTable) -> Sensing {
    let SensorTable { jitter, noise, quantum, delay_ticks, dropout } = table.clone();
    let (noise, quantum) = (noise.unwrap_or_default(), quantum.unwrap_or_default());
    Sensing { jitter, noise, quantum, delay_ticks, dropout, ..Sensing::IDEAL }
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
