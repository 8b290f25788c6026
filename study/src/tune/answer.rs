//! Tuning of a drive to a specification: searches around the noise limit, the best result rounded into the file, final
//! evaluation.

use loop_sim::port::drive::DriveDesign;
use serde::Serialize;

use super::{Effort, Entry, Found, Job, Specification, searches, settings};
use crate::chip::cycles;
use crate::compare::{Bench, Lost, Worst, of_ours};
use crate::design::refused_as_unstable;
use crate::gain_sets::{GainSet, gain_sets};
use crate::map::{Subject, tolerance_percent};
use crate::margins::{LeastDamped, corners};
use crate::{Error, Watch};

/// Noise limits of the searches relative to the specified one.
const AROUND: [f64; 3] = [1.0 / 3.0, 1.0, 3.0];

/// Limits of a specification. Metrics without a limit are minimised; the noise has a default limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Current noise, A rms.
    pub noise_a: Option<f64>,
    /// Settling time of a recovery, s.
    pub settle_s: Option<f64>,
    /// Error in a move of 1 rad, rad.
    pub move_rad: Option<f64>,
    /// Error under a load step of 14 % of the largest torque, rad.
    pub load_rad: Option<f64>,
    /// Smallest phase margin with the data sheet, degrees.
    pub phase_deg: Option<f64>,
    /// Largest |S| in the corners of the tolerance of the file.
    pub sensitivity_peak: Option<f64>,
    /// Whether the corners are ±50 % instead of ±20 %. The default is 50 if the file states more than 20 %, by
    /// `drive.uncertain_percent` or a range of the inertia.
    pub is_wide: Option<bool>,
}

impl Specification {
    /// Completes the limits of a specification from the scenario.
    ///
    /// # Errors
    /// A limit is not above 0, a phase margin not below 90 degrees, a peak of |S| not above 1.
    pub fn new(bench: &Bench, limits: &Limits) -> Result<Self, Error> {
        let Limits { noise_a, settle_s, move_rad, load_rad, phase_deg, sensitivity_peak, is_wide } = *limits;
        for (option, value) in [("noise", noise_a), ("settling", settle_s), ("move", move_rad), ("load", load_rad)] {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
                return Err(Error::input("expected a number above 0").at(format!("--{option} {value}")));
            }
        }
        if let Some(value) = phase_deg.filter(|value| !(*value > 0.0 && *value < 90.0)) {
            return Err(Error::input("expected an angle above 0 and below 90 degrees").at(format!("--phase {value}")));
        }
        if let Some(value) = sensitivity_peak.filter(|value| !(*value > 1.0 && value.is_finite())) {
            let what = "expected a number above 1: |S| has a peak above 1 in every sampled loop";
            return Err(Error::input(what).at(format!("--sensitivity {value}")));
        }
        let is_wide = is_wide.unwrap_or_else(|| bench.is_uncertain());
        let noise_a = noise_a.unwrap_or_else(|| bench.noise_limits_a()[1]);
        Ok(Self { noise_a, settle_s, move_rad, load_rad, phase_deg, sensitivity_peak, is_wide })
    }
}

/// Result of [`tune`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// Name of the scenario.
    pub scenario: String,
    /// Specification.
    #[serde(rename = "asked")]
    pub specification: Specification,
    /// Metrics of the drive, with the rounded numbers of the file.
    pub found: Found,
    /// Metrics with the nominal plant.
    pub nominal: Worst,
    /// Gain sets of the tuned drive at rest: their margins, and the worst corner of the tolerance of the file.
    pub gain_sets: Vec<GainSet>,
    /// Oscillatory pole of the base gains with the least damping, over the corners of the tolerance of the file.
    pub least_damped: Option<LeastDamped>,
    /// WCET bound of a tick on a Cortex-M4F, cycles.
    pub cycles: u32,
    /// Deviation of every data sheet number up to which all corners are stable, percent. The search ends at the
    /// declared uncertainty of the plant. `None` if a corner has no poles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub data_sheet_percent: Option<u32>,
    /// Keys of the table `drive`.
    pub settings: Vec<(&'static str, Vec<f64>)>,
    /// Limits that are not met.
    pub missed: Vec<&'static str>,
    /// Runs that fail in a corner.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lost: Vec<Lost>,
    /// Runs in which the monitors of the file stop the drive in a corner. All other numbers are without monitors.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stopped: Vec<Lost>,
    /// Reason why the file cannot be exported: an unstable corner within the tolerance that it declares.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused_by_export: Option<String>,
    /// Best result of each search.
    pub pareto: Vec<SearchResult>,
    /// Number of searches, including searches without a result.
    #[serde(skip)]
    pub searches: usize,
    /// Scenario with the tuned values.
    #[serde(skip)]
    pub text: String,
    /// Smallest tried noise at which all other limits are met, A rms.
    #[serde(skip)]
    pub met_with_noise_a: Option<f64>,
}

/// Best result of a search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SearchResult {
    /// Number of gain sets.
    pub gain_sets: usize,
    /// WCET bound of a tick, cycles.
    pub cycles: u32,
    /// Metrics of the drive.
    #[serde(flatten)]
    pub found: Found,
}

/// Returns the drive with this number of gain sets.
const fn with_sets(designed: &DriveDesign, sets: usize) -> DriveDesign {
    let mut designed = *designed;
    designed.form_mut().gain_sets = sets;
    designed
}

/// Returns the searches for these specifications with every number of gain sets that the cycle limit allows.
fn jobs(bench: &Bench, specification: &[Specification], most_cycles: Option<u32>) -> Result<Vec<Job>, Error> {
    let of = |sets: usize| cycles(&with_sets(&bench.designed, sets));
    let forms = [2, 1].into_iter().filter(|sets| most_cycles.is_none_or(|most| of(*sets) <= most));
    let jobs: Vec<Job> = forms
        .flat_map(|gain_sets| specification.iter().map(move |&specification| Job { gain_sets, specification }))
        .collect();
    if jobs.is_empty() {
        let what = format!("a tick of this drive takes up to {} cycles with one gain set", of(1));
        return Err(Error::input(what).at("--cycles"));
    }
    Ok(jobs)
}

/// Returns the best entry of the matching search, or of another search that meets all limits.
fn best<'a>(entries: &'a [Entry], specification: &Specification) -> Option<&'a Entry> {
    let may =
        |entry: &&Entry| entry.job.specification == *specification || specification.missed(&entry.found).is_empty();
    entries.iter().filter(may).min_by(|a, b| worth(specification, &a.found).total_cmp(&worth(specification, &b.found)))
}

/// Returns the rank of a result, smaller is better. Any violated limit ranks below every result that meets all.
fn worth(specification: &Specification, found: &Found) -> f64 {
    found.cost() + 100.0 * specification.missed(found).len() as f64
}

/// Returns the value of a key of [`settings`] as in a file.
pub fn value_of(key: &str, values: &[f64]) -> String {
    match values {
        [value] if key == "gain_sets" => (*value as i64).to_string(),
        [value] => format!("{value:?}"),
        values => format!("{values:?}"),
    }
}

/// Returns the file with the settings of `--set`, so that the written file is the evaluated drive.
fn written_into(text: &str, sets: &[String]) -> Result<String, Error> {
    let changes: Result<Vec<_>, Error> = sets
        .iter()
        .map(|set| {
            let (key, value) =
                set.split_once('=').ok_or_else(|| Error::input("expected KEY=VALUE").at(format!("--set {set}")))?;
            Ok((key, Some(value)))
        })
        .collect();
    Ok(scenario::rewritten(text, changes?)?)
}

/// Returns the file with these keys in its table `drive`.
fn with_settings(text: &str, settings: &[(&'static str, Vec<f64>)]) -> Result<String, Error> {
    let settings: Vec<(String, String)> =
        settings.iter().map(|(key, values)| (format!("drive.{key}"), value_of(key, values))).collect();
    let settings = settings.iter().map(|(key, value)| (key.as_str(), Some(value.as_str())));
    Ok(scenario::rewritten(text, std::iter::once(("drive.tuning", None)).chain(settings))?)
}

fn around(specification: &Specification) -> [Specification; 3] {
    AROUND.map(|factor| Specification { noise_a: factor * specification.noise_a, ..*specification })
}

/// Returns the number of searches that [`tune`] makes.
///
/// # Errors
/// No number of gain sets meets the cycle limit.
pub fn searches_of(bench: &Bench, specification: &Specification, effort: Effort) -> Result<usize, Error> {
    Ok(jobs(bench, &around(specification), effort.most_cycles)?.len())
}

/// Searches the bandwidths of a drive for a specification; `None` if stopped. `subject` is the scenario of the bench,
/// and messages use the name of its file. A step of the watch is an evaluation.
///
/// # Errors
/// No number of gain sets meets the cycle limit, the search finds no drive, or the tuned drive is invalid.
pub fn tune(
    bench: &Bench,
    subject: &Subject<'_>,
    specification: &Specification,
    effort: Effort,
    watch: Watch<'_>,
) -> Result<Option<Answer>, Error> {
    let jobs = jobs(bench, &around(specification), effort.most_cycles)?;
    let text = written_into(subject.text, subject.sets)?;
    let Some(entries) = searches(bench, &jobs, effort, watch) else { return Ok(None) };
    let best = best(&entries, specification)
        .ok_or_else(|| Error::failed("the search found no drive that finishes its runs"))?;

    // The results refer to the file with its rounded numbers.
    let settings = settings(&best.designed);
    let text = with_settings(&text, &settings)?;
    let tuned = Subject { text: &text, sets: &[], ..*subject };
    let experiment = tuned.with(&[])?;
    let written = experiment.drive.as_ref().map_or(best.designed, |drive| drive.designed);
    // The bench judges the gains, as in the search: a drive that a monitor stopped has no error to compare.
    let designed = written.telling().without_rest_band();
    let refused = || Error::failed("the tuned drive is invalid");
    let design = of_ours(&designed).ok_or_else(refused)?;
    // The data sheet plant, without the errors of the file.
    let no_error = ["error={}".to_owned()];
    let found = Found::of(bench, &designed, specification, true).ok_or_else(refused)?;
    let missed = specification.missed(&found);
    // A failed run counts as a missed limit.
    let lost = if missed.is_empty() { Vec::new() } else { bench.lost(&design, specification.is_wide) };
    let watched = of_ours(&written.without_rest_band()).ok_or_else(refused)?;
    let mut stopped = bench.lost(&watched, specification.is_wide);
    stopped.retain(|it| !lost.contains(it));
    let met = entries.iter().filter(|entry| {
        let Entry { job, found, .. } = entry;
        job.specification.noise_a > specification.noise_a && job.specification.missed(found).is_empty()
    });
    let tried = |entry: &Entry| SearchResult {
        gain_sets: entry.job.gain_sets,
        cycles: cycles(&entry.designed),
        found: entry.found,
    };
    let at_rest = experiment.at_rest.as_ref()?;
    Ok(Some(Answer {
        scenario: bench.name.clone(),
        specification: *specification,
        found,
        nominal: bench.nominal(&design),
        gain_sets: gain_sets(&designed, at_rest)?,
        least_damped: corners(at_rest, at_rest.law.as_ref(), experiment.period_s)?.1,
        cycles: cycles(&designed),
        data_sheet_percent: tolerance_percent(&Subject { sets: &no_error, ..tuned }, specification.percent()).ok(),
        settings,
        lost,
        stopped,
        refused_by_export: refused_as_unstable(&experiment),
        missed,
        met_with_noise_a: met.map(|entry| entry.job.specification.noise_a).min_by(f64::total_cmp),
        pareto: entries.iter().map(tried).collect(),
        searches: jobs.len(),
        text,
    }))
}

/// Returns the best metrics within the specified noise if the other limits are dropped, for an achievable
/// specification. Returns `None` if there were no other limits, nothing meets the noise, or the search was stopped.
///
/// # Errors
/// No number of gain sets meets the cycle limit.
pub fn within_noise(
    bench: &Bench,
    specification: &Specification,
    effort: Effort,
    watch: Watch<'_>,
) -> Result<Option<Found>, Error> {
    let alone = specification.without_errors();
    if alone == *specification {
        return Ok(None);
    }
    let entries = searches(bench, &jobs(bench, &[alone], effort.most_cycles)?, effort, watch).unwrap_or_default();
    Ok(best(&entries, &alone).map(|entry| entry.found).filter(|found| alone.missed(found).is_empty()))
}
