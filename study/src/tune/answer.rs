//! From what is asked to the drive: searches around the noise, the best of them, rounded into the file, judged again.

use loop_sim::port::drive::DriveDesign;
use serde::Serialize;

use super::{Asked, Effort, Entry, Found, Job, searches, settings};
use crate::chip::cycles;
use crate::compare::{Bench, Lost, Worst, of_ours};
use crate::map::{Subject, tolerance_percent};
use crate::{Error, Watch};

/// Noise of the searches around the one that is asked for.
const AROUND: [f64; 3] = [1.0 / 3.0, 1.0, 3.0];

/// Limits of a specification; what has none is made as small as it gets, but for the noise, which has one by rule.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Noise of u, A rms.
    pub noise_a: Option<f64>,
    /// Settling of a recovery, s.
    pub settle_s: Option<f64>,
    /// Error on a move of 1 rad, rad.
    pub move_rad: Option<f64>,
    /// Error under a load step of 14 % of the largest torque, rad.
    pub load_rad: Option<f64>,
    /// Are the corners those of 50 %, and not of 20 %? By default 50 where the file says more than 20 %, by
    /// `drive.uncertain_percent` or a range of the inertia.
    pub is_wide: Option<bool>,
}

impl Asked {
    /// Completes the limits of a specification from the scenario.
    ///
    /// # Errors
    /// A limit is not above 0.
    pub fn new(bench: &Bench, limits: &Limits) -> Result<Self, Error> {
        let Limits { noise_a, settle_s, move_rad, load_rad, is_wide } = *limits;
        for (option, value) in [("noise", noise_a), ("settling", settle_s), ("move", move_rad), ("load", load_rad)] {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
                return Err(Error::input("expected a number above 0").at(format!("--{option} {value}")));
            }
        }
        let is_wide = is_wide.unwrap_or_else(|| bench.is_uncertain());
        let noise_a = noise_a.unwrap_or_else(|| bench.noise_limits_a()[1]);
        Ok(Self { noise_a, settle_s, move_rad, load_rad, is_wide })
    }
}

/// Answer of [`tune`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// Name of the scenario.
    pub scenario: String,
    /// The specification.
    pub asked: Asked,
    /// What the drive does, with the rounded numbers of the file.
    pub found: Found,
    /// What it does with the plant of the data sheet.
    pub nominal: Worst,
    /// Cycles of a tick on a Cortex-M4F, a bound.
    pub cycles: u32,
    /// Every number of the data sheet may be so much off, and all its corners are stable: at most the uncertainty of
    /// the plant, beyond which nothing was asked. None where a corner has no poles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub data_sheet_percent: Option<u32>,
    /// Keys of the table `drive`.
    pub settings: Vec<(&'static str, Vec<f64>)>,
    /// Limits that are not met.
    pub missed: Vec<&'static str>,
    /// Runs that come to nothing in a corner.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lost: Vec<Lost>,
    /// The best of each search.
    pub pareto: Vec<Tried>,
    /// How many searches there were: one may have found nothing.
    #[serde(skip)]
    pub searches: usize,
    /// The scenario with what was found.
    #[serde(skip)]
    pub text: String,
    /// The least noise that was tried with which all else is met, A rms.
    #[serde(skip)]
    pub met_with_noise_a: Option<f64>,
}

/// The best of a search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tried {
    /// Gain sets.
    pub gain_sets: usize,
    /// Cycles of a tick, a bound.
    pub cycles: u32,
    /// What it does.
    #[serde(flatten)]
    pub found: Found,
}

/// The same drive with so many gain sets.
const fn with_sets(designed: &DriveDesign, sets: usize) -> DriveDesign {
    let mut designed = *designed;
    designed.form_mut().gain_sets = sets;
    designed
}

/// Searches for each of these: with every number of gain sets that the cycles allow.
fn jobs(bench: &Bench, asked: &[Asked], most_cycles: Option<u32>) -> Result<Vec<Job>, Error> {
    let of = |sets: usize| cycles(&with_sets(&bench.designed, sets));
    let forms = [2, 1].into_iter().filter(|sets| most_cycles.is_none_or(|most| of(*sets) <= most));
    let jobs: Vec<Job> = forms.flat_map(|gain_sets| asked.iter().map(move |&asked| Job { gain_sets, asked })).collect();
    if jobs.is_empty() {
        let what = format!("a tick of this drive takes up to {} with one gain set", of(1));
        return Err(Error::input(what).at("--cycles"));
    }
    Ok(jobs)
}

/// Of these searches the best for what is asked: of its own, or of another that has all of it too.
fn best<'a>(entries: &'a [Entry], asked: &Asked) -> Option<&'a Entry> {
    let may = |entry: &&Entry| entry.job.asked == *asked || asked.missed(&entry.found).is_empty();
    entries.iter().filter(may).min_by(|a, b| worth(asked, &a.found).total_cmp(&worth(asked, &b.found)))
}

/// The less, the better: what misses something is worse than all that does not.
fn worth(asked: &Asked, found: &Found) -> f64 {
    found.cost() + 100.0 * asked.missed(found).len() as f64
}

/// Returns the value of a key of [`settings`] as a file has it.
pub fn value_of(key: &str, values: &[f64]) -> String {
    match values {
        [value] if key == "gain_sets" => (*value as i64).to_string(),
        [value] => format!("{value:?}"),
        values => format!("{values:?}"),
    }
}

/// The file with what was set besides, so that what is written is the drive that was judged.
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

/// The file with these in its table `drive`, and all else as it was.
fn with_settings(text: &str, settings: &[(&'static str, Vec<f64>)]) -> Result<String, Error> {
    let settings: Vec<(String, String)> =
        settings.iter().map(|(key, values)| (format!("drive.{key}"), value_of(key, values))).collect();
    let settings = settings.iter().map(|(key, value)| (key.as_str(), Some(value.as_str())));
    Ok(scenario::rewritten(text, std::iter::once(("drive.tuning", None)).chain(settings))?)
}

fn around(asked: &Asked) -> [Asked; 3] {
    AROUND.map(|factor| Asked { noise_a: factor * asked.noise_a, ..*asked })
}

/// Returns the number of searches that [`tune`] makes.
///
/// # Errors
/// No number of gain sets is within the cycles.
pub fn searches_of(bench: &Bench, asked: &Asked, effort: Effort) -> Result<usize, Error> {
    Ok(jobs(bench, &around(asked), effort.most_cycles)?.len())
}

/// Searches the bandwidths of a drive for a specification; `None` if it was stopped. `subject` is the scenario of the
/// bench; messages call the tuned one by the name of its file. A step of the watch is an evaluation.
///
/// # Errors
/// No number of gain sets is within the cycles; no drive was found at all, or the one that was found is refused.
pub fn tune(
    bench: &Bench,
    subject: &Subject<'_>,
    asked: &Asked,
    effort: Effort,
    watch: Watch<'_>,
) -> Result<Option<Answer>, Error> {
    let jobs = jobs(bench, &around(asked), effort.most_cycles)?;
    let text = written_into(subject.text, subject.sets)?;
    let Some(entries) = searches(bench, &jobs, effort, watch) else { return Ok(None) };
    let best = best(&entries, asked).ok_or_else(|| Error::failed("no drive was found that runs at all"))?;

    // What is told is of the file, with its rounded numbers.
    let settings = settings(&best.designed);
    let text = with_settings(&text, &settings)?;
    let tuned = Subject { text: &text, sets: &[], ..*subject };
    let experiment = tuned.with(&[])?;
    let designed = experiment.drive.as_ref().map_or(best.designed, |drive| drive.designed);
    let refused = || Error::failed("the drive that was found is refused");
    let design = of_ours(&designed).ok_or_else(refused)?;
    // Of the data sheet, as all else here; not of the plant that the file makes of it.
    let no_error = ["error={}".to_owned()];
    let found = Found::of(bench, &designed, asked.is_wide, true).ok_or_else(refused)?;
    let missed = asked.missed(&found);
    let met = entries.iter().filter(|entry| {
        let Entry { job, found, .. } = entry;
        job.asked.noise_a > asked.noise_a && job.asked.missed(found).is_empty()
    });
    let tried =
        |entry: &Entry| Tried { gain_sets: entry.job.gain_sets, cycles: cycles(&entry.designed), found: entry.found };
    Ok(Some(Answer {
        scenario: bench.name.clone(),
        asked: *asked,
        found,
        nominal: bench.nominal(&design),
        cycles: cycles(&designed),
        data_sheet_percent: tolerance_percent(&Subject { sets: &no_error, ..tuned }, asked.percent()).ok(),
        settings,
        // What is lost is missed.
        lost: if missed.is_empty() { Vec::new() } else { bench.lost(&design, asked.is_wide) },
        missed,
        met_with_noise_a: met.map(|entry| entry.job.asked.noise_a).min_by(f64::total_cmp),
        pareto: entries.iter().map(tried).collect(),
        searches: jobs.len(),
        text,
    }))
}

/// Returns what can be had within the noise that is asked for, where nothing else is: what to ask instead. `None` if
/// nothing else was asked, nothing is within it, or it was stopped.
///
/// # Errors
/// No number of gain sets is within the cycles.
pub fn within_noise(bench: &Bench, asked: &Asked, effort: Effort, watch: Watch<'_>) -> Result<Option<Found>, Error> {
    let alone = Asked { settle_s: None, move_rad: None, load_rad: None, ..*asked };
    if alone == *asked {
        return Ok(None);
    }
    let entries = searches(bench, &jobs(bench, &[alone], effort.most_cycles)?, effort, watch).unwrap_or_default();
    Ok(best(&entries, &alone).map(|entry| entry.found).filter(|found| alone.missed(found).is_empty()))
}
