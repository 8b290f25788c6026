//! From what a drive shall do to its bandwidths.
//!
//! The runs are those of [`compare`](crate::compare) ([`Bench`]): a sine, a move of 1 rad, a recovery and a load step,
//! each with the plant of the data sheet and with it off at the corners of ±20 % or ±50 %. With e the worst of S, M,
//! load and settling over those, and x the logarithms of the knobs, 0 to 1 over their ranges,
//!
//! ```text
//! min over x: mean log10 e_i subject to noise of u <= its limit, max |z| < 1 at every corner with every gain set,
//! each e_i <= what is asked of it, a design that is accepted
//! ```
//!
//! COBYLA (Powell's linear approximations with constraints) does it from a guess and from random points; the best of
//! all that were tried is what counts, so that a run which an encoder's steps make rough costs nothing but its time.
//! In the search the corners that stand for all are run, in the end all of them. The same seed gives the same drive,
//! on any number of threads.

use std::cell::RefCell;
use std::rc::Rc;

use cobyla::{Func, RhoBeg, StopTols};
use loop_sim::port::drive::{Bandwidths, DriveDesign};
use loop_sim::random::Random;
use rayon::prelude::*;
use serde::Serialize;

mod answer;

pub use answer::{Answer, Limits, Tried, searches_of, tune, value_of, within_noise};

use crate::Watch;
use crate::compare::{Bench, Knob, LOST, Tuned, Worst, of_ours};

/// Starts of a search.
const STARTS: usize = 3;
/// How near the edge of stability a search may go: what is linear is so at rest.
pub const LARGEST_RADIUS: f64 = 0.9995;
/// What counts for a constraint of a design that there is none of.
const NO_DESIGN: f64 = -3.0;

/// What a drive shall do; what is not asked for is made as small as it gets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Asked {
    /// Largest rms of u that the encoders' steps may make, A.
    pub noise_a: f64,
    /// Settling of a recovery, s, at worst.
    pub settle_s: Option<f64>,
    /// Error on a move of 1 rad, rad, at worst.
    pub move_rad: Option<f64>,
    /// Error under a load step of 14 % of the largest torque, rad, at worst.
    pub load_rad: Option<f64>,
    /// Is the plant known to 50 % only, and not to 20 %?
    pub is_wide: bool,
}

impl Asked {
    /// Of the corners.
    pub const fn percent(&self) -> u32 {
        if self.is_wide { 50 } else { 20 }
    }

    /// The same with something to spare.
    fn tightened(&self) -> Self {
        let tight = |asked: Option<f64>| asked.map(|asked| SPARE * asked);
        Self {
            noise_a: SPARE * self.noise_a,
            settle_s: tight(self.settle_s),
            move_rad: tight(self.move_rad),
            load_rad: tight(self.load_rad),
            is_wide: self.is_wide,
        }
    }

    /// How far below what is asked each figure is, as a logarithm; negative where it is above.
    fn margins(&self, found: &Found) -> [f64; 5] {
        // What is lost in a corner is missed, asked for or not.
        let below = |asked: Option<f64>, got: f64| match asked {
            _ if got >= LOST => NO_DESIGN,
            Some(asked) => libm::log10(asked / got),
            None => 1.0,
        };
        let Worst { move_rad, load_rad, settle_s, spectral_radius, .. } = found.worst;
        let margins = [
            below(Some(self.noise_a), found.noise_a),
            below(self.settle_s, settle_s),
            below(self.move_rad, move_rad),
            below(self.load_rad, load_rad),
            // A thousandth of radius counts as much as a fifth of an error.
            100.0 * (LARGEST_RADIUS - spectral_radius),
        ];
        margins.map(|margin| if margin.is_nan() { NO_DESIGN } else { margin.clamp(NO_DESIGN, 1.0) })
    }

    /// What is not met, in words.
    pub fn missed(&self, found: &Found) -> Vec<&'static str> {
        let names = ["noise", "settling", "move", "load", "stability"];
        let missed = names.into_iter().zip(self.margins(found)).filter(|(_, margin)| *margin < 0.0);
        let sine = (found.worst.sine_rad >= LOST).then_some("sine");
        missed.map(|(name, _)| name).chain(sine).collect()
    }
}

/// Noise is the worst of three drives, with observers that are so many times as fast: where a step falls that calls
/// the fast gain set is luck, and a search finds all the luck there is.
const NEAR: [f64; 2] = [0.997, 1.003];

/// The same drive with observers that are so many times as fast.
fn nudged(designed: &DriveDesign, factor: f64) -> DriveDesign {
    let (mut designed, mut bandwidths) = (*designed, designed.bandwidths());
    for bandwidth in &mut bandwidths.observers_rad_s {
        *bandwidth *= factor;
    }
    designed.set_bandwidths(&bandwidths);
    designed
}

/// Within a search everything that is asked must be met with this to spare: in the end other corners are run.
const SPARE: f64 = 0.97;

/// What a drive does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Found {
    /// Rms of u that the encoders' steps make, A.
    pub noise_a: f64,
    /// At its worst.
    pub worst: Worst,
}

impl Found {
    /// Of a drive, over all corners or those that stand for all; none if it is refused.
    pub fn of(bench: &Bench, designed: &DriveDesign, is_wide: bool, all: bool) -> Option<Self> {
        let design = of_ours(designed)?;
        let mut noise_a = bench.noise_a(&design);
        for factor in NEAR {
            noise_a = noise_a.max(bench.noise_a(&of_ours(&nudged(designed, factor))?));
        }
        Some(Self { noise_a, worst: bench.worst(&design, is_wide, all) })
    }

    /// The mean of the logarithms of what is made small.
    pub fn cost(&self) -> f64 {
        let Worst { sine_rad, move_rad, load_rad, settle_s, .. } = self.worst;
        [sine_rad, move_rad, load_rad, settle_s].map(|error| libm::log10(error.max(1e-12))).iter().sum::<f64>() / 4.0
    }
}

/// A search: so many gain sets within this noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Job {
    /// Gain sets.
    pub gain_sets: usize,
    /// What is asked.
    pub asked: Asked,
}

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Of what.
    pub job: Job,
    /// The drive.
    pub designed: DriveDesign,
    /// What it does, over all corners.
    pub found: Found,
}

/// How much is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Evaluations for each number of gain sets and each noise.
    pub evaluations: usize,
    /// Seed of the search.
    pub seed: u64,
    /// Most cycles that a tick may take on a Cortex-M4F.
    pub most_cycles: Option<u32>,
}

/// Runs all searches; `None` if they were stopped. A search that found no drive has no entry. A step of the watch
/// is an evaluation.
pub fn searches(bench: &Bench, jobs: &[Job], effort: Effort, watch: Watch<'_>) -> Option<Vec<Entry>> {
    // Start by start, so that all threads have work to the end.
    let of_start = |k: usize| searched(bench, jobs[k / STARTS], k % STARTS, effort, watch);
    let done: Vec<_> = (0..jobs.len() * STARTS).into_par_iter().with_max_len(1).map(of_start).collect();
    if watch.is_stopped() {
        return None;
    }
    let best = done.chunks(STARTS).zip(jobs).filter_map(|(starts, job)| {
        let best = starts.iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let designed = rounded(&Tuned::new(bench, job.gain_sets).designed(&best.1)?);
        Some(Entry { job: *job, designed, found: Found::of(bench, &designed, job.asked.is_wide, true)? })
    });
    Some(best.collect())
}

/// One search: how good the best is, and its knobs.
fn searched(bench: &Bench, job: Job, start: usize, effort: Effort, watch: Watch<'_>) -> Option<(f64, Vec<f64>)> {
    if watch.is_stopped() {
        return None;
    }
    let tuned = Tuned::new(bench, job.gain_sets);
    let (knobs, tight) = (tuned.knobs(), job.asked.tightened());
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
        let found = found.and_then(|designed| Found::of(bench, &designed, job.asked.is_wide, false));
        watch.done();
        let told = found.map_or(([NO_DESIGN; 5], 3.0), |found| (tight.margins(&found), found.cost()));
        if found.is_some() {
            let short: f64 = told.0.iter().map(|margin| margin.min(0.0)).sum();
            // What misses something is worse than all that does not.
            let worth = if short < 0.0 { -1e3 + short } else { -told.1 };
            if search.best.as_ref().is_none_or(|(known, _)| worth > *known) {
                search.best = Some((worth, values));
            }
        }
        search.last = Some((x.to_vec(), told));
        told
    };
    let constraints: Vec<_> =
        (0..5).map(|i| move |x: &[f64], search: &mut Rc<RefCell<Search>>| at_margin(at, x, search, i)).collect();
    let constraints: Vec<&dyn Func<Rc<RefCell<Search>>>> = constraints.iter().map(|it| it as _).collect();
    let tolerances = StopTols { xtol_abs: vec![1e-3; knobs.len()], ..StopTols::default() };
    let cost = |x: &[f64], search: &mut Rc<RefCell<Search>>| at(x, search).1;
    // How it ended says nothing: the best is what was tried.
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

/// Margins of what is asked, and the cost.
type Judged = ([f64; 5], f64);

/// With numbers that can be read and typed: a file that has them is the very drive that was judged.
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

/// What a search knows.
#[derive(Default)]
struct Search {
    /// The last point and what came of it: cost and constraints are asked one by one.
    last: Option<(Vec<f64>, Judged)>,
    /// How good the best is, and its knobs.
    best: Option<(f64, Vec<f64>)>,
}

impl Knob {
    /// The value at a place of its range, 0 to 1.
    fn at(&self, place: f64) -> f64 {
        self.low * libm::pow(self.high / self.low, place.clamp(0.0, 1.0))
    }
}

/// The keys of a scenario file that make this drive.
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
