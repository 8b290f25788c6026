//! Runs of a scenario with other references, loads and faults.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use controller_core::Health;
use loop_sim::MAX_ORDER;
use loop_sim::metrics::{Metrics, Tracking};
use loop_sim::port::drive::{DriveDesign, LivePort};
use loop_sim::port::{ControllerPort, PortError, Tick};
use loop_sim::trace::{Row, Trace};
use scenario::{Experiment, ShaftOf};
use serde::{Deserialize, Serialize};
use study::figures::FLAGS;

use crate::request::{Failure, Text};

/// Run that the page shows.
#[derive(Deserialize)]
pub(crate) struct RunRequest {
    /// Name under which the page has the answer.
    name: String,
    /// Settings of this run: reference, load, faults, length.
    #[serde(default)]
    sets: Vec<String>,
    /// Changes of the design while the run goes on.
    #[serde(default)]
    retunes: Vec<Retune>,
    /// Largest number of rows in the answer.
    rows: usize,
}

/// Change of the design: from a tick on, the settings of another scenario text.
#[derive(Deserialize)]
struct Retune {
    at_s: f64,
    scenario: Text,
}

/// Drive whose design changes at given ticks, without a step in the current.
struct Retuned {
    drive: Box<dyn LivePort>,
    /// Designs with their ticks, the last one first.
    coming: Vec<(usize, DriveDesign)>,
    tick: usize,
}

impl ControllerPort for Retuned {
    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError> {
        while let Some((_, to)) = self.coming.pop_if(|(tick, _)| *tick <= self.tick) {
            self.drive.retune(&to, false).map_err(|error| PortError::Refused(error.to_string()))?;
        }
        self.tick += 1;
        self.drive.tick(sample)
    }

    fn report_applied(&mut self, u: f64) {
        self.drive.report_applied(u);
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.drive.reset()
    }

    fn observed(&self) -> &[usize] {
        self.drive.observed()
    }

    fn follows(&self) -> Option<usize> {
        self.drive.follows()
    }

    fn reference(&self) -> f64 {
        self.drive.reference()
    }
}

/// Replaces the controller of an experiment by one whose design changes.
fn with_retunes(experiment: &mut Experiment, sets: &[String], retunes: &[Retune]) -> Result<(), Failure> {
    let Some(drive) = experiment.drive.as_ref().filter(|_| !retunes.is_empty()) else { return Ok(()) };
    let mut coming = Vec::new();
    for Retune { at_s, scenario } in retunes.iter().rev() {
        let other = scenario.with(sets)?;
        let designed = other.drive.map(|drive| drive.designed).ok_or_else(|| study::Error::input("no drive"))?;
        coming.push(((at_s / experiment.period_s).round() as usize, designed));
    }
    let live = drive.designed.live(&drive.motion).map_err(|error| study::Error::input(error.to_string()))?;
    experiment.port = Box::new(Retuned { drive: live, coming, tick: 0 });
    Ok(())
}

/// Run as the page shows it.
#[derive(Serialize)]
pub(crate) struct Ran {
    name: String,
    ending: &'static str,
    ended_at_s: Option<f64>,
    error: Option<String>,
    columns: BTreeMap<String, Vec<f32>>,
    metrics: Metrics,
    tracking: Option<Tracking>,
    move_s: Option<f64>,
    flags: Vec<Flag>,
    warnings: Vec<String>,
}

/// Status flag with its first and last time and its number of ticks.
#[derive(Serialize)]
struct Flag {
    name: &'static str,
    from_s: f64,
    to_s: f64,
    ticks: usize,
}

/// Runs a scenario and returns its columns, metrics and status flags.
pub(crate) fn run(text: &Text, request: &RunRequest) -> Result<Ran, Failure> {
    let mut experiment = text.with(&request.sets)?;
    with_retunes(&mut experiment, &request.sets, &request.retunes)?;
    let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
    Ok(Ran {
        name: request.name.clone(),
        ending: trace.ending.word(),
        ended_at_s: trace.ending.at_s(),
        error: error.map(|error| error.to_string()),
        columns: columns(&trace, &experiment, request.rows),
        metrics: experiment.metrics(&trace),
        tracking: experiment.tracking(&trace),
        move_s: experiment.drive.as_ref().map(|drive| f64::from(drive.motion.ticks) * experiment.period_s),
        flags: FLAGS.iter().filter_map(|(flag, name)| spans(&trace, *flag, name)).collect(),
        warnings: experiment.warnings,
    })
}

/// Returns first and last time and number of the ticks with a status flag. `None` without such a tick.
fn spans(trace: &Trace, flag: Health, name: &'static str) -> Option<Flag> {
    let mut with = trace.rows.iter().filter(|row| row.health.contains(flag));
    let first = with.next()?;
    let (ticks, last) = with.fold((1, first), |(count, _), row| (count + 1, row));
    Some(Flag { name, from_s: first.t_s, to_s: last.t_s, ticks })
}

/// Returns columns for a picture, in f32: of `trace.csv` time, angles, reference, error and current, and for each shaft
/// the torque of load and friction with its estimate, N m. Of each group of rows it has the one with the largest error.
fn columns(trace: &Trace, experiment: &Experiment, most: usize) -> BTreeMap<String, Vec<f32>> {
    let drive = experiment.drive.as_ref();
    let group = trace.rows.len().div_ceil(most.max(2)).max(1);
    let size = |row: &&Row| trace.error(row).abs();
    let rows: Vec<&Row> =
        trace.rows.chunks(group).filter_map(|rows| rows.iter().max_by(|a, b| size(a).total_cmp(&size(b)))).collect();
    let names = trace.columns(drive.map_or(&[][..], |drive| drive.states));
    let shown = |name: &str| ["t_s", "r", "error", "u_held"].contains(&name) || name.ends_with("angle_rad");
    let mut columns = BTreeMap::new();
    for (j, name) in names.into_iter().enumerate().filter(|(_, name)| shown(name)) {
        let values = rows.iter().map(|row| trace.values(row).nth(j).map_or(f32::NAN, |value| value as f32));
        columns.insert(name, values.collect());
    }
    for &ShaftOf { channel, name, inertia_kg_m2 } in drive.iter().flat_map(|drive| &drive.shafts) {
        // The load torque against positive motion is -J d.
        let torque = |of: fn(&Row) -> &[f64; MAX_ORDER]| {
            rows.iter().map(|row| (-inertia_kg_m2 * of(row)[channel]) as f32).collect()
        };
        columns.insert(format!("load of the {name}"), torque(|row| &row.d));
        columns.insert(format!("estimated load of the {name}"), torque(|row| &row.d_hat));
    }
    columns
}
