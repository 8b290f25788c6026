//! Tuning with equal effort for every controller: a number of cost evaluations, first random, then local, from one
//! seed.
//!
//! Of N evaluations 0.6 N come first: the guess, 0.3 N random ones over the range of every parameter, and the rest
//! around the best with a deviation of 0.15 of the ranges. The remaining 0.4 N have a deviation that falls from 0.1 to
//! 0.01. Every other local evaluation changes a single parameter. Parameters vary on a logarithmic scale.
//!
//! A controller at a noise limit is one job with its own random numbers on one thread. The result is independent of the
//! number of threads.

use loop_sim::random::Random;
use rayon::prelude::*;
use serde::Serialize;

use super::bench::{Bench, Figures};
use super::{Contender, Knob, of_ours};
use crate::Watch;

/// Effort of the tuning.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Evaluations of the cost per controller and limit.
    pub evaluations: usize,
    /// Seed of the search.
    pub seed: u64,
    /// Limits of the current noise, A.
    pub noise_a: Vec<f64>,
}

/// Controller tuned at a noise limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entry {
    /// Name of the controller.
    pub law: &'static str,
    /// Limit of the current noise, A.
    pub limit_a: f64,
    /// Cost of the best design.
    pub cost: f64,
    /// Tuning parameters with their names.
    pub knobs: Vec<(&'static str, f64)>,
    /// Metrics of the best design.
    #[serde(flatten)]
    pub figures: Figures,
}

impl Entry {
    /// Returns whether no tuning met the noise limit.
    pub fn breaks_limit(&self) -> bool {
        self.figures.noise_a.is_nan() || self.figures.noise_a > self.limit_a
    }
}

/// Result of [`compare`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Name of the scenario.
    pub scenario: String,
    /// Evaluations of the cost per controller and limit.
    pub evaluations: usize,
    /// Seed of the search.
    pub seed: u64,
    /// Time τ of the runs, s.
    pub tau_s: f64,
    /// Corners of each run.
    pub corners: usize,
    /// Start angle of the recovery, rad.
    pub start_rad: f64,
    /// Every controller at every limit, limit by limit.
    pub entries: Vec<Entry>,
    /// Metrics of the drive of the file: the gains by rule where the file has none. It is not tuned.
    pub of_file: Option<Figures>,
}

/// Tunes every contender at every limit. Returns `None` if stopped. A step of the watch is an evaluation.
pub fn compare(
    bench: &Bench,
    contenders: &[Box<dyn Contender>],
    settings: &Settings,
    watch: Watch<'_>,
) -> Option<Comparison> {
    let jobs: Vec<(usize, f64)> =
        settings.noise_a.iter().flat_map(|&limit| (0..contenders.len()).map(move |law| (law, limit))).collect();
    let of_job = |(job, &(law, limit)): (usize, &(usize, f64))| {
        tuned(bench, contenders[law].as_ref(), limit, settings, job as u64, watch)
    };
    // A job takes minutes: each one may run on another thread.
    let done: Vec<_> = jobs.par_iter().enumerate().with_max_len(1).map(of_job).collect();
    (!watch.is_stopped()).then(|| Comparison {
        scenario: bench.name.clone(),
        evaluations: settings.evaluations,
        seed: settings.seed,
        tau_s: bench.tau_s,
        corners: bench.corners(),
        start_rad: bench.start_rad,
        entries: done.into_iter().flatten().collect(),
        of_file: of_ours(&bench.designed).map(|design| bench.figures(&design)),
    })
}

/// Returns the best design; `None` if there was none.
fn tuned(
    bench: &Bench,
    contender: &dyn Contender,
    limit_a: f64,
    settings: &Settings,
    stream: u64,
    watch: Watch<'_>,
) -> Option<Entry> {
    let mut random = Random::new(settings.seed, stream);
    let knobs = contender.knobs();
    let all = settings.evaluations.max(1);
    let (first, anywhere) = (all * 3 / 5, all * 3 / 10);
    let mut best: (f64, Vec<f64>) = (f64::INFINITY, knobs.iter().map(Knob::guessed).collect());
    for k in 0..all {
        if watch.is_stopped() {
            return None;
        }
        let at: Vec<f64> = if k == 0 {
            best.1.clone()
        } else if k <= anywhere {
            knobs.iter().map(|_| random.uniform()).collect()
        } else {
            let left = (all - k) as f64 / (all - first) as f64;
            let deviation = if k < first { 0.15 } else { 0.1 * libm::pow(0.1, 1.0 - left) };
            let alone = (k % 2 == 0).then(|| (random.uniform() * knobs.len() as f64) as usize % knobs.len());
            let moved = |(i, at): (usize, &f64)| {
                let by = deviation * random.gaussian();
                if alone.is_none_or(|alone| alone == i) { (at + by).clamp(0.0, 1.0) } else { *at }
            };
            best.1.iter().enumerate().map(moved).collect()
        };
        let design = contender.design(&values(&knobs, &at));
        let cost = design.map_or(f64::INFINITY, |design| bench.cost(design.as_ref(), limit_a));
        if cost < best.0 {
            best = (cost, at);
        }
        watch.done();
    }
    let (cost, at) = best;
    let found = values(&knobs, &at);
    let figures = bench.figures(contender.design(&found)?.as_ref());
    let knobs = knobs.iter().map(|knob| knob.name).zip(found).collect();
    cost.is_finite().then(|| Entry { law: contender.name(), limit_a, cost, knobs, figures })
}

impl Knob {
    /// Returns the position of the guess in its range, 0 to 1.
    pub(crate) fn guessed(&self) -> f64 {
        libm::log(self.guess / self.low) / libm::log(self.high / self.low)
    }
}

fn values(knobs: &[Knob], at: &[f64]) -> Vec<f64> {
    knobs.iter().zip(at).map(|(knob, at)| knob.low * libm::pow(knob.high / knob.low, *at)).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

    use rayon::ThreadPoolBuilder;

    use super::super::contenders;
    use super::*;
    use crate::sized;

    #[test]
    fn any_number_of_threads_gives_the_same_and_another_seed_another() {
        let bench = Bench::new("motor.toml", scenario::MOTOR, &[]).expect("a file");
        let contenders = contenders(&bench);
        let found = |threads: usize, seed: u64| {
            let evaluations = sized(4, 2);
            let settings = Settings { evaluations, seed, noise_a: vec![0.1] };
            let (stop, steps) = (AtomicBool::new(false), AtomicUsize::new(0));
            let step = || _ = steps.fetch_add(1, Ordering::SeqCst);
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let compared = || compare(&bench, &contenders, &settings, Watch::new(&stop, &step));
            let entries = pool.install(compared).expect("not stopped").entries;
            let asked = evaluations * contenders.len();
            assert_eq!((entries.len(), steps.load(Ordering::SeqCst)), (contenders.len(), asked));
            entries
        };
        let one = found(1, 7);
        assert_eq!(one, found(3, 7));
        assert_ne!(one, found(1, 8));
    }

    /// The search lowers the cost of every controller.
    #[test]
    fn tuning_makes_every_law_better() {
        let bench = Bench::new("motor.toml", scenario::MOTOR, &[]).expect("a file");
        let contenders = contenders(&bench);
        let found = |evaluations: usize| {
            let settings = Settings { evaluations, seed: 1, noise_a: vec![0.1] };
            compare(&bench, &contenders, &settings, Watch::none()).expect("not stopped").entries
        };
        for (guess, tuned) in found(1).iter().zip(found(sized(30, 6))) {
            assert!(tuned.cost < guess.cost, "{}: {} of {}", tuned.law, tuned.cost, guess.cost);
        }
    }
}
