//! Numbers of a run as in run.json: metrics, estimation errors, noise and status counts.
//!
//! A number is named by its path, `metrics.u_peak` or `design.margins.phase_deg`.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use controller_core::Health;
use loop_sim::lanes::Judged;
use loop_sim::metrics::{self, Metrics, Noise, Tracking};
use loop_sim::trace::{Ending, Trace};
use scenario::{Drive, Experiment, ShaftOf};
use serde::Serialize;

use crate::{Error, design};

/// Numbers of a run.
#[derive(Serialize)]
pub struct Figures {
    /// Metrics.
    pub metrics: serde_json::Value,
    /// Errors of the estimated torques on the shafts of a drive.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub torque_errors: Vec<TorqueError>,
    /// Tracking errors, if there is a reference.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tracking: Option<Tracking>,
    /// Current noise from encoder quantisation of a drive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<Noise>,
    /// Number of ticks with each status flag.
    pub ticks_with: BTreeMap<&'static str, usize>,
}

impl Figures {
    /// Returns the numbers of a finished run.
    pub fn of(experiment: &mut Experiment, trace: &Trace, metrics: &Metrics) -> Self {
        let of_shafts = experiment.drive.as_ref().map(|drive| torque_errors(drive, metrics, trace));
        Self {
            metrics: told(metrics, experiment),
            torque_errors: of_shafts.unwrap_or_default(),
            tracking: experiment.tracking(trace),
            noise: experiment.noise(trace),
            ticks_with: FLAGS.map(|(flag, name)| (name, ticks_with(trace, flag))).into(),
        }
    }

    /// Returns the numbers of a run in a vectorised batch.
    pub fn of_lane(experiment: &Experiment, judged: &Judged) -> Self {
        Self {
            metrics: told(&judged.metrics, experiment),
            torque_errors: Vec::new(),
            tracking: None,
            noise: None,
            ticks_with: FLAGS.map(|(flag, name)| (name, judged.ticks_with(flag))).into(),
        }
    }
}

/// Error of an estimated torque, load and friction together.
#[derive(Serialize)]
pub struct TorqueError {
    /// Name of the shaft.
    pub shaft: &'static str,
    /// Rms error over the window, N m.
    pub rms_n_m: f64,
}

/// Returns the error of the estimated torque on each shaft of a drive.
pub fn torque_errors(drive: &Drive, metrics: &Metrics, trace: &Trace) -> Vec<TorqueError> {
    let of = |shaft: &ShaftOf| {
        let (i, inertia) = (shaft.channel, shaft.inertia_kg_m2);
        let rms_n_m = metrics::rms(trace, metrics.window_s, |row| inertia * (row.d[i] - row.d_hat[i]));
        TorqueError { shaft: shaft.name, rms_n_m }
    };
    drive.shafts.iter().map(of).collect()
}

/// Returns the metrics as JSON: along a reference |y - r| is named an error, and a number has its unit.
fn told(metrics: &Metrics, experiment: &Experiment) -> serde_json::Value {
    let mut told = serde_json::to_value(metrics).unwrap_or_default();
    if let (Some(_), Some(error)) = (&experiment.drive, told.get("y_ultimate").cloned()) {
        told["error_ultimate"] = error;
        told.as_object_mut().and_then(|told| told.remove("y_ultimate"));
    }
    for error in told["estimation_error_ultimate"].as_array_mut().into_iter().flatten() {
        // The estimation errors of a drive belong to its shafts. In the paper they belong to a chain in which each
        // state is the derivative of the one before.
        let order = if experiment.drive.is_some() { 2 } else { error["channel"].as_u64().unwrap_or_default() };
        if !experiment.output_unit.is_empty() {
            error["unit"] = rad_per_s(order as usize).into();
        }
    }
    told
}

/// Returns the unit rad, rad/s, rad/s^2, ..
pub fn rad_per_s(order: usize) -> String {
    match order {
        0 => "rad".into(),
        1 => "rad/s".into(),
        order => format!("rad/s^{order}"),
    }
}

/// Returns the order of the time derivative of an angle that sigma* has. It differs for a motor, whose current is not a
/// state of the chain, for a joint, and for a plant of order n.
pub fn order_of_sigma(experiment: &Experiment) -> usize {
    experiment.drive.as_ref().map_or(experiment.plant.order(), |drive| 2 * drive.shafts.len()) - 1
}

/// Returns the unit of a number of run.json by its path; empty if it has none or the scenario names none.
pub fn unit_of(path: &str, experiment: &Experiment) -> String {
    let Experiment { output_unit: output, control_unit: control, .. } = *experiment;
    let last = path.rsplit('.').next().unwrap_or_default();
    match (path.split('.').next(), last) {
        (Some("ticks_with"), _) => "ticks".into(),
        (Some("noise"), _) => format!("{control} rms").trim_start().into(),
        (_, "sigma_star_ultimate") if !output.is_empty() => rad_per_s(order_of_sigma(experiment)),
        (_, "y_ultimate" | "error_ultimate" | "error_rms") => output.into(),
        (_, "u_peak") => control.into(),
        (_, "u_total_variation_per_s") if !control.is_empty() => format!("{control}/s"),
        (_, "u_total_variation_per_s") => String::new(),
        (_, "rms_n_m") => "N m".into(),
        (_, last) if last.ends_with("_s") => "s".into(),
        _ => String::new(),
    }
}

/// Every status flag of a controller with its name in JSON.
pub const FLAGS: [(Health, &str); 16] = [
    (Health::INPUT_REJECTED, "input_rejected"),
    (Health::SATURATED, "saturated"),
    (Health::SIGMA_STAR_OVER_BOUND, "sigma_star_over_bound"),
    (Health::SAMPLE_LOST, "sample_lost"),
    (Health::DISTURBANCE_OVER_BOUND, "disturbance_over_bound"),
    (Health::STUCK_AT_LIMIT, "stuck_at_limit"),
    (Health::STOPPED, "stopped"),
    (Health::POSITION_STEPPED, "position_stepped"),
    (Health::WAITS, "waits"),
    (Health::WRONG_WAY, "wrong_way"),
    (Health::OSCILLATES, "oscillates"),
    (Health::BRAKES, "brakes"),
    (Health::OVERSPEED, "overspeed"),
    (Health::FOLLOWING_ERROR, "following_error"),
    (Health::END_OF_RANGE, "end_of_range"),
    (Health::HUNTS, "hunts"),
];

/// Returns the number of ticks with this status flag.
pub fn ticks_with(trace: &Trace, flag: Health) -> usize {
    trace.rows.iter().filter(|row| row.health.contains(flag)).count()
}

/// Prefix of the numbers of a design, which need no run.
pub const OF_DESIGN: &str = "design.";

/// Returns the numbers of run.json for a run or its design, and whether the run finished and stayed bounded.
fn numbers_of(experiment: &mut Experiment, simulate: bool) -> Result<(serde_json::Value, bool), Error> {
    let told = |error: serde_json::Error| Error::failed(error.to_string());
    if simulate {
        let (trace, _) = experiment.run(&mut |_| ControlFlow::Continue(()));
        let metrics = experiment.metrics(&trace);
        let has_ended = trace.ending == Ending::Finished && metrics.bounded;
        let figures = serde_json::to_value(Figures::of(experiment, &trace, &metrics)).map_err(told)?;
        return Ok((figures, has_ended));
    }
    let design = design(experiment)?;
    let design = serde_json::to_value(design).map_err(told)?;
    Ok((serde_json::Map::from_iter([("design".to_owned(), design)]).into(), true))
}

/// Returns the number at a path; NaN if the run did not finish or the margin does not exist.
///
/// # Errors
/// The scenario has no design.
pub fn number_of(path: &str, experiment: &mut Experiment) -> Result<f64, Error> {
    let (told, has_ended) = numbers_of(experiment, !path.starts_with(OF_DESIGN))?;
    Ok(if has_ended { number_in(&told, path) } else { f64::NAN })
}

/// Returns the paths of all numbers that [`number_of`] accepts.
///
/// # Errors
/// The scenario has no design.
pub fn known_numbers(experiment: &mut Experiment) -> Result<Vec<String>, Error> {
    let mut known = Vec::new();
    for simulate in [true, false] {
        collect(&numbers_of(experiment, simulate)?.0, "", &mut known);
    }
    Ok(known)
}

/// Collects the paths of all numbers in run.json, including numbers that this run lacks.
pub fn collect(value: &serde_json::Value, path: &str, known: &mut Vec<String>) {
    let below = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match value {
        serde_json::Value::Object(object) => {
            object.iter().for_each(|(key, value)| collect(value, &below(key), known));
        }
        serde_json::Value::Array(list) => {
            list.iter().enumerate().for_each(|(k, value)| collect(value, &below(&k.to_string()), known));
        }
        // A margin that this design does not have.
        serde_json::Value::Number(_) | serde_json::Value::Null => known.push(path.into()),
        _ => {}
    }
}

/// Returns the number at a path; NaN if there is none.
pub fn number_in(told: &serde_json::Value, path: &str) -> f64 {
    told.pointer(&format!("/{}", path.replace('.', "/"))).and_then(serde_json::Value::as_f64).unwrap_or(f64::NAN)
}
