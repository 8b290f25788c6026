//! Tuning of the bandwidths of a drive to a specification.
//!
//! The test runs are the runs of [`compare`](crate::compare) ([`Bench`]): a sine, a move of 1 rad, a recovery and a
//! load step. They use the plant of the data sheet and its corners of ±20 % or ±50 %. e are the worst values of S, M,
//! load and settling over these plants. x are the logarithms of the tuning parameters, 0 to 1 over their ranges.
//!
//! ```text
//! min over x: mean log10 e_i subject to noise of u <= its limit, max |z| < 1 at every corner with every gain set,
//! each e_i <= its limit, margins of the linear loop within their limits, a valid design
//! ```
//!
//! COBYLA (Powell's linear approximations with constraints) searches from a guess and from random points. The best of
//! all evaluated designs is the result. A run that is rough because of quantisation therefore costs time only. The
//! search uses the corners of the cost; the result is evaluated in all corners. Equal seeds give equal drives on any
//! number of threads.

use std::cell::RefCell;
use std::rc::Rc;

use cobyla::{Func, RhoBeg, StopTols};
use loop_sim::port::drive::{Bandwidths, DriveDesign};
use loop_sim::random::Random;
use rayon::prelude::*;
use serde::Serialize;

mod answer;

pub use answer::{Answer, Limits, SearchResult, searches_of, tune, value_of, within_noise};

use crate::Watch;
use crate::compare::{Bench, Knob, LOST, Tuned, Worst, of_ours};
use crate::gain_sets::{GainSet, gain_sets};

/// Starts of a search.
const STARTS: usize = 3;
/// Largest spectral radius in a search; the linear model holds at rest.
pub const LARGEST_RADIUS: f64 = 0.9995;
/// Constraint value of a design that does not exist.
const NO_DESIGN: f64 = -3.0;

/// Specification of a drive; metrics without a limit are minimised.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Specification {
    /// Largest rms current noise from encoder quantisation, A.
    pub noise_a: f64,
    /// Largest settling time of a recovery, s.
    pub settle_s: Option<f64>,
    /// Largest error in a move of 1 rad, rad.
    pub move_rad: Option<f64>,
    /// Largest error under a load step of 14 % of the largest torque, rad.
    pub load_rad: Option<f64>,
    /// Smallest phase margin with the data sheet, over the gain sets, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase_deg: Option<f64>,
    /// Largest |S| in the corners of the tolerance of the file, over the gain sets.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensitivity_peak: Option<f64>,
    /// Whether the plant uncertainty is ±50 % instead of ±20 %.
    pub is_wide: bool,
}

impl Specification {
    /// Returns the deviation in the corners, percent.
    pub const fn percent(&self) -> u32 {
        if self.is_wide { 50 } else { 20 }
    }

    /// Returns the specification with a reserve.
    fn tightened(&self) -> Self {
        let tight = |limit: Option<f64>| limit.map(|limit| SPARE * limit);
        Self {
            noise_a: SPARE * self.noise_a,
            settle_s: tight(self.settle_s),
            move_rad: tight(self.move_rad),
            load_rad: tight(self.load_rad),
            // The search and the result have the same corners at rest; only digits are rounded.
            phase_deg: self.phase_deg.map(|limit| 1.005 * limit),
            sensitivity_peak: self.sensitivity_peak.map(|limit| 0.995 * limit),
            is_wide: self.is_wide,
        }
    }

    /// Returns the specification with the limits of noise and stability alone.
    fn without_errors(&self) -> Self {
        Self { settle_s: None, move_rad: None, load_rad: None, ..*self }
    }

    /// Returns the positions in [`METRICS`] that the search limits. Without a limit of the linear loop it is left out:
    /// an analysis costs more than a run.
    fn limited(&self) -> impl Iterator<Item = usize> + use<> {
        let is_limited = [self.phase_deg.is_some(), self.sensitivity_peak.is_some()];
        (0..5).chain((5..7).filter(move |i| is_limited[i - 5]))
    }

    /// Returns the logarithmic distance of each of the [`METRICS`] to its limit, negative if the limit is not met.
    fn margins(&self, found: &Found) -> [f64; 7] {
        // A failed run violates the specification, even without a limit.
        let below = |limit: Option<f64>, got: f64| match limit {
            _ if got >= LOST => NO_DESIGN,
            Some(limit) => libm::log10(limit / got),
            None => 1.0,
        };
        let Worst { move_rad, load_rad, settle_s, spectral_radius, .. } = found.worst;
        let margins = [
            below(Some(self.noise_a), found.noise_a),
            below(self.settle_s, settle_s),
            below(self.move_rad, move_rad),
            below(self.load_rad, load_rad),
            // A thousandth of spectral radius counts as much as a fifth of an error.
            100.0 * (LARGEST_RADIUS - spectral_radius),
            self.phase_deg.map_or(1.0, |limit| libm::log10(found.at_rest.phase_deg / limit)),
            self.sensitivity_peak.map_or(1.0, |limit| libm::log10(limit / found.at_rest.sensitivity_peak)),
        ];
        margins.map(|margin| if margin.is_nan() { NO_DESIGN } else { margin.clamp(NO_DESIGN, 1.0) })
    }

    /// Returns the names of the limits that are not met.
    pub fn missed(&self, found: &Found) -> Vec<&'static str> {
        let missed = METRICS.into_iter().zip(self.margins(found)).filter(|(_, margin)| *margin < 0.0);
        let sine = (found.worst.sine_rad >= LOST).then_some("sine");
        missed.map(|(name, _)| name).chain(sine).collect()
    }
}

/// Names of the limits of a specification.
const METRICS: [&str; 7] = ["noise", "settling", "move", "load", "stability", "phase margin", "peak |S|"];

/// Margins of the linear loop at rest, the worst of the gain sets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtRestMargins {
    /// Smallest phase margin with the data sheet, degrees; 180 if unlimited, 0 if unstable.
    pub phase_deg: f64,
    /// Largest |S| in a corner of the tolerance of the file; infinite if unstable.
    pub sensitivity_peak: f64,
}

impl AtRestMargins {
    /// Value of a search that does not limit them.
    const FREE: Self = Self { phase_deg: 180.0, sensitivity_peak: 0.0 };
    /// Value of a loop without margins.
    const NONE: Self = Self { phase_deg: 0.0, sensitivity_peak: f64::INFINITY };

    fn of(bench: &Bench, designed: &DriveDesign) -> Self {
        let sets = bench.at_rest.as_ref().ok().and_then(|at_rest| gain_sets(designed, at_rest).ok());
        let worse = |worst: Self, set: GainSet| {
            let phase_deg = set.margins.map_or(0.0, |margins| margins.phase_deg.unwrap_or(180.0));
            let peak = set.worst.map_or(0.0, |worst| worst.sensitivity_peak.unwrap_or(f64::INFINITY));
            Self { phase_deg: worst.phase_deg.min(phase_deg), sensitivity_peak: worst.sensitivity_peak.max(peak) }
        };
        sets.map_or(Self::NONE, |sets| sets.into_iter().fold(Self::FREE, worse))
    }
}

/// Relative observer bandwidths of two neighbours of a drive; the noise is the worst of all three. A single count can
/// schedule the high gains in by chance, and a search would exploit such chance.
const NEAR: [f64; 2] = [0.997, 1.003];

/// Returns the drive with its observer bandwidths multiplied by `factor`.
fn nudged(designed: &DriveDesign, factor: f64) -> DriveDesign {
    let (mut designed, mut bandwidths) = (*designed, designed.bandwidths());
    for bandwidth in &mut bandwidths.observers_rad_s {
        *bandwidth *= factor;
    }
    designed.set_bandwidths(&bandwidths);
    designed
}

/// Reserve of the limits within a search, because the final evaluation uses more corners.
const SPARE: f64 = 0.97;

/// Metrics of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Found {
    /// Rms current noise from encoder quantisation, A.
    pub noise_a: f64,
    /// Worst metrics over the corners.
    pub worst: Worst,
    /// Margins of the linear loop, if the specification limits them.
    #[serde(skip)]
    pub at_rest: AtRestMargins,
}

impl Found {
    /// Evaluates a drive for a specification over all corners or over the corners of the cost; `None` if the design is
    /// invalid.
    pub fn of(bench: &Bench, designed: &DriveDesign, specification: &Specification, all: bool) -> Option<Self> {
        let design = of_ours(designed)?;
        let mut noise_a = bench.noise_a(&design);
        for factor in NEAR {
            noise_a = noise_a.max(bench.noise_a(&of_ours(&nudged(designed, factor))?));
        }
        let is_free = specification.limited().count() == 5;
        let at_rest = if is_free { AtRestMargins::FREE } else { AtRestMargins::of(bench, designed) };
        Some(Self { noise_a, worst: bench.worst(&design, specification.is_wide, all), at_rest })
    }

    /// Returns the mean of the logarithms of the minimised metrics.
    pub fn cost(&self) -> f64 {
        let Worst { sine_rad, move_rad, load_rad, settle_s, .. } = self.worst;
        [sine_rad, move_rad, load_rad, settle_s].map(|error| libm::log10(error.max(1e-12))).iter().sum::<f64>() / 4.0
    }
}

/// Search for one number of gain sets and one specification.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Job {
    /// Number of gain sets.
    pub gain_sets: usize,
    /// Specification.
    pub specification: Specification,
}

/// Result of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Search that found the drive.
    pub job: Job,
    /// The drive.
    pub designed: DriveDesign,
    /// Metrics of the drive over all corners.
    pub found: Found,
}

/// Effort of the searches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Evaluations for each number of gain sets and each noise limit.
    pub evaluations: usize,
    /// Seed of the search.
    pub seed: u64,
    /// Largest WCET bound of a tick on a Cortex-M4F, cycles.
    pub most_cycles: Option<u32>,
}

/// Runs all searches; `None` if stopped. A search that found no drive has no entry. A step of the watch is an
/// evaluation.
pub fn searches(bench: &Bench, jobs: &[Job], effort: Effort, watch: Watch<'_>) -> Option<Vec<Entry>> {
    // All starts run in parallel, so that no thread is idle before the end.
    let of_start = |k: usize| searched(bench, jobs[k / STARTS], k % STARTS, effort, watch);
    let done: Vec<_> = (0..jobs.len() * STARTS).into_par_iter().with_max_len(1).map(of_start).collect();
    if watch.is_stopped() {
        return None;
    }
    let best = done.chunks(STARTS).zip(jobs).filter_map(|(starts, job)| {
        let best = starts.iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let designed = rounded(&Tuned::new(bench, job.gain_sets).designed(&best.1)?);
        Some(Entry { job: *job, designed, found: Found::of(bench, &designed, &job.specification, true)? })
    });
    Some(best.collect())
}

/// Runs one search and returns the value of the best design and its parameters.
fn searched(bench: &Bench, job: Job, start: usize, effort: Effort, watch: Watch<'_>) -> Option<(f64, Vec<f64>)> {
    if watch.is_stopped() {
        return None;
    }
    let tuned = Tuned::new(bench, job.gain_sets);
    let (knobs, tight) = (tuned.knobs(), job.specification.tightened());
    let mut random = Random::new(effort.seed, start as u64);
    let begin: Vec<f64> =
        knobs.iter().map(|knob| if start == 0 { knob.guessed() } else { 0.15 + 0.7 * random.uniform() }).collect();
    let search = Rc::new(RefCell::new(Search { last: None, best: None }));
    let at = |x: &[f64], search: &mut Rc<RefCell<Search>>| -> Judged {
        let mut search = search.borrow_mut();
        if let Some((last, told)) = &search.last
            && last == x
        {
            return *told;
        }
        let values: Vec<f64> = knobs.iter().zip(x).map(|(knob, x)| knob.at(*x)).collect();
        let found = if watch.is_stopped() { None } else { tuned.designed(&values) };
        let found = found.map(|designed| rounded(&designed));
        let found = found.and_then(|designed| Found::of(bench, &designed, &job.specification, false));
        watch.done();
        let told = found.map_or(([NO_DESIGN; 7], 3.0), |found| (tight.margins(&found), found.cost()));
        if found.is_some() {
            let short: f64 = told.0.iter().map(|margin| margin.min(0.0)).sum();
            // A design that violates a limit ranks below every design that meets all of them.
            let worth = if short < 0.0 { -1e3 + short } else { -told.1 };
            if search.best.as_ref().is_none_or(|(known, _)| worth > *known) {
                search.best = Some((worth, values));
            }
        }
        search.last = Some((x.to_vec(), told));
        told
    };
    let constraints: Vec<_> = tight
        .limited()
        .map(|i| move |x: &[f64], search: &mut Rc<RefCell<Search>>| at_margin(at, x, search, i))
        .collect();
    let constraints: Vec<&dyn Func<Rc<RefCell<Search>>>> = constraints.iter().map(|it| it as _).collect();
    let tolerances = StopTols { xtol_abs: vec![1e-3; knobs.len()], ..StopTols::default() };
    let cost = |x: &[f64], search: &mut Rc<RefCell<Search>>| at(x, search).1;
    // The termination status is irrelevant: the best evaluated design counts.
    let _ = cobyla::minimize(
        cost,
        &begin,
        &vec![(0.0, 1.0); knobs.len()],
        &constraints,
        search.clone(),
        (effort.evaluations / STARTS).max(1),
        RhoBeg::All(0.15),
        Some(tolerances),
    );
    search.take().best
}

fn at_margin<S>(at: impl Fn(&[f64], &mut S) -> Judged, x: &[f64], search: &mut S, i: usize) -> f64 {
    at(x, search).0[i]
}

/// Margins of the specification, and the cost.
type Judged = ([f64; 7], f64);

/// Rounds the bandwidths to digits that are typed in a file, so that the file reproduces the evaluated drive.
fn rounded(designed: &DriveDesign) -> DriveDesign {
    let four = |value: f64| format!("{value:.3e}").parse().unwrap_or(value);
    let w = designed.bandwidths();
    let surface_rad_s = four(w.surface_rad_s);
    let bandwidths = Bandwidths {
        surface_rad_s,
        observers_rad_s: w.observers_rad_s.into_iter().map(four).collect(),
        reaching_per_s: four(w.reaching_per_s),
        offset_per_s: 0.0,
    }
    .with_offset();
    let mut designed = designed.redesigned(&bandwidths, designed.sudden_load_n_m());
    for ratio in designed.fast_ratios() {
        *ratio = four(*ratio);
    }
    designed
}

/// State of a search.
#[derive(Default)]
struct Search {
    /// Last point with its result, because COBYLA evaluates cost and constraints separately.
    last: Option<(Vec<f64>, Judged)>,
    /// Value and parameters of the best design.
    best: Option<(f64, Vec<f64>)>,
}

impl Knob {
    /// Returns the value at a position of its range, 0 to 1.
    fn at(&self, place: f64) -> f64 {
        self.low * libm::pow(self.high / self.low, place.clamp(0.0, 1.0))
    }
}

/// Returns the keys of a scenario file that make this drive.
pub fn settings(designed: &DriveDesign) -> Vec<(&'static str, Vec<f64>)> {
    let (sets, w, mut fast) = (designed.form().gain_sets, designed.bandwidths(), *designed);
    let mut keys = vec![("surface_rad_s", vec![w.surface_rad_s])];
    keys.extend(designed.observer_keys().iter().zip(w.observers_rad_s).map(|(key, own)| (*key, vec![own])));
    keys.push(("reaching_per_s", vec![w.reaching_per_s]));
    if sets > 1 {
        keys.push((designed.fast_key(), fast.fast_ratios().to_vec()));
    }
    keys.push(("gain_sets", vec![sets as f64]));
    keys
}

#[cfg(test)]
mod tests;
