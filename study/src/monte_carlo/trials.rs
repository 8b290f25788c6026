//! Trials of a plan: each one is a run of the scenario with its own settings, on all threads, vectorised where
//! possible.
//!
//! A run that diverges or has no valid design is also a result.

use std::collections::BTreeMap;
use std::ops::{ControlFlow, Range};

use controller_core::Health;
use loop_sim::lanes;
use loop_sim::metrics::Metrics;
use loop_sim::trace::{Ending, Recorder, Row, Trace};
use rayon::prelude::*;
use scenario::Experiment;
use serde_json::Value as Json;

use super::{Outcome, Plan};
use crate::Watch;
use crate::figures::{Figures, collect, number_in, unit_of};
use crate::margins::growth;

/// Memory for the traces of vectorised runs, bytes per thread.
const MOST_TRACES_BYTES: usize = 128 << 20;
/// Name of the column after the drawn ones.
pub const ENDED: &str = "ended_at_s";

/// Outcome of each trial, and its numbers in the order of the columns.
pub type Rows = Vec<(Outcome, Vec<f64>)>;

/// Result of one trial.
pub struct Trial {
    /// Outcome.
    pub outcome: Outcome,
    /// Time of the last tick, s.
    pub ended_at_s: f64,
    /// Numbers of run.json.
    pub figures: Json,
}

/// Runs an experiment as a trial; `None` if stopped.
pub fn trial(experiment: &mut Experiment, watch: Watch<'_>) -> Option<Trial> {
    let (trace, _) = experiment.run(&mut |_| going_on(watch));
    judged(experiment, &trace)
}

fn going_on(watch: Watch<'_>) -> ControlFlow<()> {
    if watch.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// Recorder that keeps all rows until it is stopped.
struct Stoppable<'a> {
    trace: Trace,
    watch: Watch<'a>,
}

impl Recorder for Stoppable<'_> {
    fn record(&mut self, row: &Row) -> ControlFlow<()> {
        _ = self.trace.record(row);
        going_on(self.watch)
    }

    fn end(&mut self, ending: Ending) {
        self.trace.end(ending);
    }
}

/// Returns the result of a trace; `None` if the run was stopped.
fn judged(experiment: &mut Experiment, trace: &Trace) -> Option<Trial> {
    let metrics = experiment.metrics(trace);
    let outcome = match trace.ending {
        Ending::Interrupted { .. } => return None,
        Ending::Diverged { .. } => Outcome::Diverged,
        Ending::BrokenOff { .. } => Outcome::BrokenOff,
        Ending::Finished => match outcome_of(experiment, &metrics) {
            // A drive that stands still after an alarm looks bounded.
            Outcome::Finished if trace.rows.iter().any(|row| row.health.contains(Health::STOPPED)) => Outcome::Stopped,
            outcome => outcome,
        },
    };
    let ended_at_s = trace.rows.last().map_or(0.0, |row| row.t_s);
    let figures = serde_json::to_value(Figures::of(experiment, trace, &metrics)).unwrap_or_default();
    Some(Trial { outcome, ended_at_s, figures })
}

/// Returns the outcome of a finished run. An unstable loop with limited u returns from far away and looks bounded;
/// without limits an unstable loop does not settle.
fn outcome_of(experiment: &Experiment, metrics: &Metrics) -> Outcome {
    let limits = experiment.spec.as_ref().map(|spec| spec.config.padded.options.limits);
    let is_limited = limits.is_none_or(|limits| limits.max.is_finite() || limits.min.is_finite());
    if !metrics.bounded {
        Outcome::Unbounded
    } else if (is_limited || metrics.settling_time_s.is_none()) && growth(experiment).is_some() {
        Outcome::Unstable
    } else {
        Outcome::Finished
    }
}

/// Runs compatible trials as a vectorised batch ([`lanes`]), bit-identical to single runs. Returns `None` for trials
/// that must run alone.
fn side_by_side(experiments: &[Option<Experiment>]) -> Vec<Option<Trial>> {
    let mut found: Vec<Option<Trial>> = experiments.iter().map(|_| None).collect();
    let of = |experiment: &Option<Experiment>| experiment.as_ref().and_then(|it| it.beside().map(|(of, _)| of.kind()));
    let Some(first) = experiments.iter().find_map(of) else { return found };
    let fit: Vec<usize> = (0..experiments.len()).filter(|k| of(&experiments[*k]).as_ref() == Some(&first)).collect();
    for group in fit.chunks(lanes::LANES) {
        let members: Vec<_> =
            group.iter().filter_map(|k| experiments[*k].as_ref().and_then(Experiment::beside)).collect();
        let Some((campaign, _)) = members.first() else { continue };
        let trials: Vec<_> = members.iter().map(|(_, trial)| *trial).collect();
        let judged = lanes::close_loops(campaign, &trials);
        for (k, judged) in group.iter().zip(judged) {
            let (Some(judged), Some(experiment)) = (judged, experiments[*k].as_ref()) else { continue };
            let figures = serde_json::to_value(Figures::of_lane(experiment, &judged)).unwrap_or_default();
            let outcome = outcome_of(experiment, &judged.metrics);
            let ended_at_s = experiment.periods as f64 * experiment.period_s;
            found[*k] = Some(Trial { outcome, ended_at_s, figures });
        }
    }
    found
}

/// Runs the remaining trials with their own controller, sensors and metrics; their plants are vectorised where
/// possible. Returns `None` if stopped.
fn each_alone(experiments: &mut [Option<Experiment>], found: &mut [Option<Trial>], watch: Watch<'_>) -> Option<()> {
    let mut left: Vec<_> = experiments
        .iter_mut()
        .zip(found)
        .filter_map(|(experiment, found)| experiment.as_mut().filter(|_| found.is_none()).map(|it| (it, found)))
        .collect();
    let ticks = left.first().map_or(1, |(experiment, _)| experiment.periods + 1);
    let together = (MOST_TRACES_BYTES / (ticks * size_of::<Row>())).clamp(1, lanes::LANES);
    for group in left.chunks_mut(together) {
        let setups: Vec<_> = group.iter_mut().map(|(experiment, _)| experiment.setup()).collect();
        let mut kept: Vec<_> = setups.iter().map(|setup| Stoppable { trace: setup.trace(), watch }).collect();
        let recorders = kept.iter_mut().map(|recorder| recorder as &mut dyn Recorder);
        lanes::close_each(setups.into_iter().zip(recorders).collect());
        for ((experiment, found), Stoppable { trace, .. }) in group.iter_mut().zip(kept) {
            **found = Some(judged(experiment, &trace)?);
            watch.done();
        }
    }
    Some(())
}

/// Columns of a trial: drawn values, end time and metrics.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    /// Names of the columns.
    pub names: Vec<String>,
    /// Units of the columns that have one.
    pub units: BTreeMap<String, String>,
    /// Numbers of the scenario without drawn values.
    pub of_file: BTreeMap<String, f64>,
    /// Metrics: paths of numbers of run.json.
    pub figures: Vec<String>,
}

impl Columns {
    /// Returns the columns of a plan from the scenario without drawn values, and its trial.
    pub fn new(plan: &Plan<'_>, experiment: &Experiment, of_file: &Trial) -> Self {
        let mut figures = Vec::new();
        collect(&of_file.figures, "", &mut figures);
        // The window and the channel of a metric are not results.
        figures.retain(|path| !path.starts_with("metrics.window_s") && !path.ends_with(".channel"));
        let names = plan.vary.iter().map(|vary| vary.name().to_owned());
        let names = names.chain([ENDED.into()]).chain(figures.iter().cloned()).collect();
        let known = figures.iter().map(|path| (path.clone(), number_in(&of_file.figures, path)));
        let drawn =
            plan.vary.iter().filter_map(|vary| Some((vary.name().to_owned(), plan.subject.number_at(vary.name())?)));
        let units = figures.iter().map(String::as_str).chain([ENDED]).filter_map(|path| {
            // An estimation error has its own unit, which depends on its channel.
            let own = path.strip_suffix(".error").map(|of| format!("/{}/unit", of.replace('.', "/")));
            let own = own.and_then(|at| of_file.figures.pointer(&at)?.as_str()).map(ToOwned::to_owned);
            let unit = own.unwrap_or_else(|| unit_of(path, experiment));
            (!unit.is_empty()).then(|| (path.to_owned(), unit))
        });
        let units = units.collect();
        let of_file = known.chain(drawn).filter(|(_, value)| value.is_finite()).collect();
        Self { names, units, of_file, figures }
    }

    fn row(&self, mut drawn: Vec<f64>, found: Option<Trial>) -> (Outcome, Vec<f64>) {
        let Some(Trial { outcome, ended_at_s, figures }) = found else {
            drawn.resize(self.names.len(), f64::NAN);
            return (Outcome::Refused, drawn);
        };
        drawn.push(ended_at_s);
        drawn.extend(self.figures.iter().map(|path| number_in(&figures, path)));
        (outcome, drawn)
    }
}

/// Runs trials of a plan on the threads of the current rayon pool; `None` if they were stopped.
pub fn trials(plan: &Plan<'_>, columns: &Columns, range: Range<u64>, watch: Watch<'_>) -> Option<Rows> {
    let Range { start: first, end } = range;
    let group = |start: u64| -> Option<Rows> {
        let trials = start..end.min(start + lanes::LANES as u64);
        let mut experiments = Vec::new();
        for i in trials.clone() {
            if watch.is_stopped() {
                return None;
            }
            experiments.push(plan.experiment(i).ok());
        }
        let mut found = side_by_side(&experiments);
        // Progress of the other trials is reported one by one.
        (0..experiments.len()).filter(|k| found[*k].is_some() || experiments[*k].is_none()).for_each(|_| watch.done());
        each_alone(&mut experiments, &mut found, watch)?;
        Some(trials.zip(found).map(|(i, found)| columns.row(plan.drawn(i), found)).collect())
    };
    let starts: Vec<u64> = (first..end).step_by(lanes::LANES).collect();
    let rows: Option<Vec<Rows>> = starts.into_par_iter().map(group).collect();
    rows.map(|groups| groups.concat())
}
