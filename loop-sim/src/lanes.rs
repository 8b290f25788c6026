//! Vectorised batch of closed loops: the trials of a campaign whose plants differ in numbers only.
//!
//! [`LANES`] loops go through every tick together, stage by stage. The stages are the tick of the controller, the
//! metrics and the step of the plant. A plant uses its own step ([`exact`](crate::exact)), and Example 1 uses the step
//! of the solver. Each stage is a plain loop over lanes, which the compiler vectorises for the instructions of the
//! machine. Every lane is bit-identical to the run alone ([`close_loop`](crate::closed_loop::close_loop)), since both
//! call the same functions. The tests check this.
//!
//! Trials that do not fit are reported and not run. `close_loop` must run them. They are other plants ([`takes`]), a
//! lane whose plant leaves the range of its step, and a controller of another kind. A lane keeps its metrics and no
//! trace.

use controller_core::{
    Benchmark, Config, ControlLaw, Controller, Exp, Guessing, Health, Lanes, Linear, Micromath, Nominal, NominalModel,
    Real, Shape,
};

use crate::exponential::Branchless;
use crate::metrics::Metrics;
use crate::plant::{Parts, Plant};
use crate::port::in_process::{ControllerSpec, Model, Precision, padded};
use crate::sensor::Sensing;
use crate::solver;

#[macro_use]
mod wide;

mod benchmarks;
mod each;
mod formulas;
mod linears;
mod merit;
mod sensors;
mod signals;
mod steps;

pub use each::{Recorded, close_each, close_each_with};
pub use wide::Instructions;

use benchmarks::Benchmarks;
use linears::Linears;
use merit::Merit;
use sensors::Sensors;
use wide::{Aligned, Wide};

/// Number of loops in a batch.
pub const LANES: usize = 64;
/// Number of counted flags: the low bits of [`Health`]. The others belong to drives, which no lane runs.
const FLAGS: usize = 8;
/// Longest delay of a sensor, ticks. Each tick of delay takes 3 kB.
const MOST_DELAY_TICKS: usize = 1000;

/// Settings that all trials of a batch share.
#[derive(Clone, Copy, Debug)]
pub struct Campaign<'a> {
    /// Controller.
    pub spec: &'a ControllerSpec,
    /// Sensor chain between state and sample.
    pub sensing: &'a Sensing,
    /// Period T, s.
    pub period_s: f64,
    /// Number of periods of a run.
    pub periods: usize,
    /// Window of the ultimate metrics, s.
    pub window_s: [f64; 2],
    /// Settling band: a smaller |y| counts as settled.
    pub settling_band: f64,
}

/// Settings that are equal in two campaigns that can share a batch.
#[derive(Clone, Debug, PartialEq)]
pub struct BatchSettings {
    spec: ControllerSpec,
    sensing: Sensing,
    times: [f64; 4],
    periods: usize,
}

impl Campaign<'_> {
    /// Returns the settings that trials must share to run in one batch. [`close_loops`] checks the plants.
    pub fn kind(&self) -> BatchSettings {
        let Self { spec, sensing, period_s, periods, window_s: [from_s, to_s], settling_band } = *self;
        BatchSettings {
            spec: spec.clone(),
            sensing: sensing.clone(),
            times: [period_s, from_s, to_s, settling_band],
            periods,
        }
    }
}

/// Trial of a campaign: a plant, its initial state and a seed.
#[derive(Clone, Copy)]
pub struct Trial<'a> {
    /// Plant of the trial.
    pub plant: &'a dyn Plant,
    /// State at t = 0.
    pub x0: &'a [f64],
    /// Seed of the random links of the sensor chain.
    pub seed: u64,
}

/// Returns true if closed loops with such a plant can run in a batch, provided that the controller can.
pub fn takes(plant: &dyn Plant) -> bool {
    plant.exact().is_some() || matches!(plant.parts(), Some(Parts::Benchmark(_)))
}

/// Result of a trial that ran to its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// Metrics of the trial.
    pub metrics: Metrics,
    /// Number of ticks with each flag, by its bit in [`Health`].
    ticks_with: [u32; FLAGS],
}

impl Judged {
    /// Returns the number of ticks in which the controller reported this flag. `flag` must be a single flag. A flag
    /// of a drive is never reported.
    pub fn ticks_with(&self, flag: Health) -> usize {
        self.ticks_with.get(flag.bits().trailing_zeros() as usize).map_or(0, |count| *count as usize)
    }
}

/// Runs up to [`LANES`] trials. The entry of a trial that must run alone is `None`.
///
/// # Panics
/// Panics if there are more than [`LANES`] trials.
pub fn close_loops(campaign: &Campaign<'_>, trials: &[Trial<'_>]) -> Vec<Option<Judged>> {
    close_loops_with(Instructions::Avx512, campaign, trials)
}

/// Runs up to [`LANES`] trials with at most these instructions. The bits do not depend on the instructions.
///
/// # Panics
/// Panics if there are more than [`LANES`] trials.
pub fn close_loops_with(
    instructions: Instructions,
    campaign: &Campaign<'_>,
    trials: &[Trial<'_>],
) -> Vec<Option<Judged>> {
    assert!(trials.len() <= LANES, "{} trials in {LANES} lanes", trials.len());
    let found = match &campaign.spec.model {
        Model::Linear(row) => linear(instructions, campaign, trials, row),
        Model::BenchmarkLibm => benchmark::<Branchless>(instructions, campaign, trials),
        Model::BenchmarkMicromath => benchmark::<Micromath>(instructions, campaign, trials),
        Model::Formulas { .. } => None,
    };
    found.unwrap_or_else(|| vec![None; trials.len()])
}

/// Runs a controller with a linear a(x) and plants with a step of their own.
fn linear(
    instructions: Instructions,
    campaign: &Campaign<'_>,
    trials: &[Trial<'_>],
    row: &[f64],
) -> Option<Vec<Option<Judged>>> {
    let Shape { n, r, mask } = campaign.spec.config.shape();
    macro_rules! instance {
        ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {
            match (n, r, mask) {
                $(($n, $r, $mask) => {
                    let plants = Linears::beside(instructions, trials, campaign.period_s)?;
                    let config = campaign.spec.config.fixed::<$n, $r>()?;
                    let nominal = Nominal { gradient: padded(row), ..config.nominal };
                    macro_rules! of_precision {
                        ($T:ty) => {{
                            let model = Linear::<$T, $n>::new(&nominal);
                            let law = Controller::<$T, _, $n, $r, $mask, $o>::try_design(&config, model);
                            run(instructions, campaign, trials, law.ok()?, &config, plants)
                        }};
                    }
                    match campaign.spec.precision {
                        Precision::F32 => of_precision!(f32),
                        Precision::F64 => of_precision!(f64),
                    }
                })*
                _ => None,
            }
        };
    }
    #[cfg(feature = "drives-only")]
    return instance! { n2_r2_c2: 2 2 0b10 1, };
    #[cfg(not(feature = "drives-only"))]
    controller_core::shapes!(archive => instance)
}

/// Runs Example 1 with the exponential `E` in the controller. The f64 exponential has branches.
fn benchmark<E: Exp<f32> + Copy>(
    instructions: Instructions,
    campaign: &Campaign<'_>,
    trials: &[Trial<'_>],
) -> Option<Vec<Option<Judged>>> {
    if campaign.spec.precision != Precision::F32 {
        return None;
    }
    let Shape { n, r, mask } = campaign.spec.config.shape();
    let plants = Benchmarks::beside(instructions, trials)?;
    macro_rules! instance {
        ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {
            match (n, r, mask) {
                $(($n, $r, $mask) => {
                    let config = campaign.spec.config.fixed::<$n, $r>()?;
                    let law = Controller::<f32, _, $n, $r, $mask, $o>::try_design(&config, Benchmark::<E>::new());
                    run(instructions, campaign, trials, law.ok()?, &config, plants)
                })*
                _ => None,
            }
        };
    }
    #[cfg(feature = "drives-only")]
    return instance! { n2_r2_c2: 2 2 0b10 1, };
    #[cfg(not(feature = "drives-only"))]
    controller_core::shapes!(planar => instance)
}

/// Plants of all lanes, which step over the same ticks together.
trait Plants<const N: usize> {
    /// Prepares for the states x. Call it with every x before the methods below.
    fn turn(&mut self, x: &[Wide; N]);

    /// Advances all lanes over a tick. Sets `lost` for a lane that must run alone.
    fn advance(&mut self, from_s: f64, to_s: f64, x: &mut [Wide; N], u: &Wide, lost: &mut Wide<u64>);

    /// Updates the largest |d - d_hat| of a channel.
    fn note_estimate(&self, channel: usize, t_s: f64, x: &[Wide; N], u: &Wide, d_hat: &Wide, most: &mut Wide);
}

/// Advances one lane over a tick with the solver.
fn alone<const N: usize>(
    plant: &dyn Plant,
    [from_s, to_s]: [f64; 2],
    u: f64,
    x: &mut [Wide; N],
    l: usize,
    lost: &mut Wide<u64>,
) {
    let mut of_lane: [f64; N] = std::array::from_fn(|i| x[i][l]);
    if solver::advance(plant, from_s, to_s, u, &mut of_lane).is_err() {
        lost[l] |= 1;
    }
    for (x, of_lane) in x.iter_mut().zip(of_lane) {
        x[l] = of_lane;
    }
}

/// Returns the initial states of the lanes. A lane without a trial gets the first state.
fn initial<const N: usize>(trials: &[Trial<'_>]) -> Option<Box<[Wide<f64>; N]>> {
    let mut x = Box::new([Wide::of_all(0.0); N]);
    for l in 0..LANES {
        let x0 = <[f64; N]>::try_from(trials.get(l).unwrap_or(&trials[0]).x0).ok()?;
        for (x, x0) in x.iter_mut().zip(x0) {
            x[l] = x0;
        }
    }
    Some(x)
}

type States<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize> = Lanes<T, M, N, R, MASK, O, LANES>;

fn run<T: Real, M: NominalModel<T, N>, const N: usize, const R: usize, const MASK: u8, const O: usize>(
    instructions: Instructions,
    campaign: &Campaign<'_>,
    trials: &[Trial<'_>],
    law: Controller<T, M, N, R, MASK, O>,
    config: &Config<N, R>,
    mut plants: Box<dyn Plants<N> + '_>,
) -> Option<Vec<Option<Judged>>> {
    let Campaign { sensing, period_s, periods, window_s, settling_band, .. } = *campaign;
    if sensing.delay_ticks > MOST_DELAY_TICKS {
        return None;
    }
    let start = Guessing::new(law, config.options.initial_estimates.map(T::from_f64));
    let mut x = initial(trials)?;
    let mut sensors = Sensors::<N>::new(instructions, sensing, trials);
    let mut sensed = x.clone();
    if !sensors.is_ideal() {
        sensors.measure(&x, &mut sensed);
    }
    let started = |l: usize| start.start(&std::array::from_fn(|i| T::from_f64(sensed[i][l])));
    let mut states = Box::new(Aligned((0..trials.len()).find_map(started)?.lanes::<LANES>()));
    let mut lost = Box::new(Wide::of_all(0));
    for l in 0..trials.len() {
        match started(l) {
            Some(state) => states.0.set(l, &state),
            // The controller does not start with its first sample.
            None => lost[l] = 1,
        }
    }
    let channels = Controller::<T, M, N, R, MASK, O>::CHANNELS;
    let mut samples = Box::new([Wide::of_all(T::ZERO); N]);
    let mut told = Box::new(LaneOutputs::<T>::new());
    let mut merit = Box::new(Merit::new(instructions, window_s, period_s, settling_band));
    let mut d_hat = Box::new([Wide::of_all(0.0); O]);
    for k in 0..=periods {
        let t_s = k as f64 * period_s;
        if k > 0 && !sensors.is_ideal() {
            sensors.measure(&x, &mut sensed);
        }
        let seen = if sensors.is_ideal() { &x } else { &sensed };
        for (sample, seen) in samples.iter_mut().zip(seen.iter()) {
            round_all(instructions, sample, seen);
        }
        let LaneOutputs { demand, u, sigma_star, health } = &mut *told;
        tick_all(instructions, &law, &mut states.0, &samples, demand, sigma_star, health);
        drive_all(instructions, demand, u);
        merit.note(k, t_s, &x[0], &told);
        plants.turn(&x);
        if merit.is_inside(t_s) {
            estimated(instructions, &law, &states.0, &mut d_hat);
            for (s, channel) in channels.into_iter().enumerate() {
                plants.note_estimate(channel, t_s, &x, &told.u, &d_hat[s], &mut merit.estimation[s]);
            }
        }
        if k == periods {
            break;
        }
        let next_s = (k + 1) as f64 * period_s;
        plants.advance(t_s, next_s, &mut x, &told.u, &mut lost);
    }
    merit.sum_up();
    // A state beyond the range is lost: the run alone must report it.
    let judged = (0..trials.len()).map(|l| {
        let is_sound = x.iter().all(|x| x[l].abs() <= solver::RUNAWAY);
        (lost[l] == 0 && is_sound).then(|| merit.judged(l, periods, &channels))
    });
    Some(judged.collect())
}

/// Output of a tick for every lane, and the held u.
struct LaneOutputs<T> {
    demand: Wide<T>,
    u: Wide,
    sigma_star: Wide<T>,
    health: Wide<u8>,
}

impl<T: Real> LaneOutputs<T> {
    fn new() -> Self {
        let none = Wide::of_all(T::ZERO);
        Self { demand: none, u: Wide::of_all(0.0), sigma_star: none, health: Wide::of_all(0) }
    }
}

vectorised! {
    /// Rounds a sample to the precision of the controller. A separate loop makes the tick twice as fast, as all numbers
    /// of the tick have one width.
    fn round_all[T; T: Real](sample: &mut Wide<T>, x: &Wide,) {
        for l in 0..LANES {
            sample[l] = T::from_f64(x[l]);
        }
    }
}

vectorised! {
    fn tick_all[T, M, N, R, MASK, O;
        T: Real, M: NominalModel<T, N>, const N: usize, const R: usize, const MASK: u8, const O: usize
    ](
        law: &Controller<T, M, N, R, MASK, O>,
        states: &mut States<T, M, N, R, MASK, O>,
        samples: &[Wide<T>; N],
        u: &mut Wide<T>,
        sigma_star: &mut Wide<T>,
        health: &mut Wide<u8>,
    ) {
        for l in 0..LANES {
            let output = law.tick_lane(states, l, &std::array::from_fn(|i| samples[i][l]));
            u[l] = output.u;
            sigma_star[l] = output.sigma_star;
            // A controller with measured states uses only the first three flags.
            health[l] = output.health.bits() as u8;
        }
    }
}

vectorised! {
    /// Holds the demand, or 0 if the demand is not finite.
    fn drive_all[T; T: Real](demand: &Wide<T>, held: &mut Wide,) {
        for l in 0..LANES {
            let u = demand[l].to_f64();
            held[l] = if u.abs() < f64::INFINITY { u } else { 0.0 };
        }
    }
}

vectorised! {
    fn estimated[T, M, N, R, MASK, O;
        T: Real, M: NominalModel<T, N>, const N: usize, const R: usize, const MASK: u8, const O: usize
    ](
        law: &Controller<T, M, N, R, MASK, O>,
        states: &States<T, M, N, R, MASK, O>,
        d_hat: &mut [Wide; O],
    ) {
        for (s, d_hat) in d_hat.iter_mut().enumerate() {
            for l in 0..LANES {
                d_hat[l] = law.estimate_lane(states, l, s).to_f64();
            }
        }
    }
}

#[cfg(test)]
mod tests;
