//! Many closed loops side by side: the trials of a campaign whose plants differ in numbers only.
//!
//! [`LANES`] loops go through every tick together, stage by stage: tick of the law, figures of merit, step of the
//! plant. Each stage is a loop over lanes with nothing but that stage in it, which the compiler makes vector code of,
//! for the instructions that the machine turns out to have. Every lane has the bits of the run alone
//! ([`close_loop`](crate::closed_loop::close_loop)), since the stages are the very functions of that run; the tests
//! hold it to them.
//!
//! What does not fit is not run here but reported as such, and is for `close_loop`: a plant without a step of its own
//! ([`Exact`]), a lane whose plant leaves the range of that step, a law of another kind. What a lane keeps is its
//! figures of merit, no trace.

use controller_core::{ControlLaw, Controller, Guessing, Health, Lanes, Linear, Nominal, Shape, shapes};

use crate::exact::{Exact, Lumped};
use crate::metrics::Metrics;
use crate::plant::Plant;
use crate::port::in_process::{ControllerSpec, Model, Precision, padded};
use crate::solver;

/// Functions with a loop over lanes, compiled for what a machine may have: chosen when they are called.
macro_rules! vectorised {
    ($(#[$about:meta])* $visible:vis fn $($function:tt)*) => {
        $(#[$about])*
        #[multiversion::multiversion(
            targets(
                "x86_64+avx512f+avx512vl+avx512dq+avx512bw+avx2+fma+bmi1+bmi2",
                "x86_64+avx2+fma+bmi1+bmi2"
            ),
            dispatcher = "direct"
        )]
        $visible fn $($function)*
    };
}

mod merit;
mod plants;

use merit::Merit;
use plants::Plants;

/// Loops side by side.
pub const LANES: usize = 64;
/// One number of each.
type Wide = [f64; LANES];
/// Troubles that are counted: the bits of [`Health`].
const TROUBLES: usize = 8;

/// What all trials of a batch have in common.
#[derive(Clone, Copy, Debug)]
pub struct Campaign<'a> {
    /// The law.
    pub spec: &'a ControllerSpec,
    /// T, s.
    pub period_s: f64,
    /// Number of periods.
    pub periods: usize,
    /// Window of the ultimate figures, s.
    pub window_s: [f64; 2],
    /// |y| within this counts as settled.
    pub settling_band: f64,
}

/// What makes two campaigns one.
#[derive(Clone, Debug, PartialEq)]
pub struct Kind {
    spec: ControllerSpec,
    times: [f64; 4],
    periods: usize,
}

impl Campaign<'_> {
    /// What trials must have in common to go side by side; whether their plants fit is for [`close_loops`].
    pub fn kind(&self) -> Kind {
        let Self { spec, period_s, periods, window_s: [from_s, to_s], settling_band } = *self;
        Kind { spec: spec.clone(), times: [period_s, from_s, to_s, settling_band], periods }
    }
}

/// A trial.
#[derive(Clone, Copy)]
pub struct Trial<'a> {
    /// Its plant.
    pub plant: &'a dyn Plant,
    /// Its state at t = 0.
    pub x0: &'a [f64],
}

/// What a trial came to that went through to its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// Its figures of merit.
    pub metrics: Metrics,
    /// Ticks with each trouble, by its bit in [`Health`].
    ticks_with: [u32; TROUBLES],
}

impl Judged {
    /// In how many ticks the law told of this trouble, one flag.
    pub fn ticks_with(&self, flag: Health) -> usize {
        self.ticks_with[flag.bits().trailing_zeros() as usize % TROUBLES] as usize
    }
}

/// Runs up to [`LANES`] trials; none for one that is to be run alone.
///
/// # Panics
/// If there are more.
pub fn close_loops(campaign: &Campaign<'_>, trials: &[Trial<'_>]) -> Vec<Option<Judged>> {
    assert!(trials.len() <= LANES, "{} trials in {LANES} lanes", trials.len());
    let Shape { n, r, mask } = campaign.spec.config.shape();
    macro_rules! instance {
        ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {
            match (n, r, mask) {
                $(($n, $r, $mask) => run::<$n, $r, $mask, $o>(campaign, trials),)*
                _ => None,
            }
        };
    }
    let found = shapes!(archive => instance);
    found.unwrap_or_else(|| vec![None; trials.len()])
}

/// Has every lane the law, the times and the functions of time of the first?
fn is_alike(parts: &[(&Exact, &Lumped)]) -> bool {
    let Some(((exact, lumped), rest)) = parts.split_first() else { return false };
    rest.iter().all(|(other, of_other)| {
        let waves = |exact: &Exact| exact.waves().iter().map(|wave| wave.omega_rad_s.to_bits()).collect::<Vec<_>>();
        let falls = |exact: &Exact| exact.falls().iter().map(|jump| jump.at_s.to_bits()).collect::<Vec<_>>();
        (exact.order, exact.steps, exact.has_sine, exact.has_ramp)
            == (other.order, other.steps, other.has_sine, other.has_ramp)
            && exact.period_s.to_bits() == other.period_s.to_bits()
            && waves(exact) == waves(other)
            && falls(exact) == falls(other)
            && exact.is_moved_as(other)
            && lumped.signals.len() == of_other.signals.len()
    })
}

fn run<const N: usize, const R: usize, const MASK: u8, const O: usize>(
    campaign: &Campaign<'_>,
    trials: &[Trial<'_>],
) -> Option<Vec<Option<Judged>>> {
    let Campaign { spec, period_s, periods, window_s, settling_band } = *campaign;
    let (Precision::F32, Model::Linear(row)) = (spec.precision, &spec.model) else { return None };
    let config = spec.config.fixed::<N, R>()?;
    let input_gain = config.nominal.input_gain;
    let model = Linear::<f32, N>::new(&Nominal { gradient: padded(row), input_gain });
    let law = Controller::<f32, _, N, R, MASK, O>::try_design(&config, model).ok()?;
    let guess = config.options.initial_estimates.map(|guess| guess as f32);
    let start = Guessing::new(law, guess);
    let parts: Vec<(&Exact, &Lumped)> =
        trials.iter().map(|trial| Some((trial.plant.exact()?, trial.plant.lumped_part()?))).collect::<Option<_>>()?;
    if !is_alike(&parts) || parts[0].0.order != N || parts[0].0.period_s.to_bits() != period_s.to_bits() {
        return None;
    }
    let mut x = Box::new([[0.0; LANES]; N]);
    for (l, trial) in trials.iter().enumerate() {
        let x0 = <[f64; N]>::try_from(trial.x0).ok()?;
        for (x, x0) in x.iter_mut().zip(x0) {
            x[l] = x0;
        }
    }
    let single = |x: &[[f64; LANES]; N], l: usize| std::array::from_fn(|i| x[i][l] as f32);
    // A lane that no trial has is like the first.
    for l in trials.len()..LANES {
        for x in x.iter_mut() {
            x[l] = x[0];
        }
    }
    let first = start.start(&single(&x, 0))?;
    let mut states: Box<Lanes<f32, Linear<f32, N>, N, R, MASK, O, LANES>> = Box::new(first.lanes());
    for l in 0..trials.len() {
        states.set(l, &start.start(&single(&x, l))?);
    }
    let mut plants = Plants::<N>::new(&parts);
    let channels = Controller::<f32, Linear<f32, N>, N, R, MASK, O>::CHANNELS;
    let (mut samples, mut u) = (Box::new([[0.0_f32; LANES]; N]), [0.0_f32; LANES]);
    let mut told = Box::new(Told::default());
    let mut merit = Box::new(Merit::new(window_s, period_s, settling_band));
    let mut d_hat = Box::new([[0.0; LANES]; O]);
    let mut d = Box::new([0.0; LANES]);
    let mut lost = [0_u64; LANES];
    for k in 0..=periods {
        let t_s = k as f64 * period_s;
        for (sample, x) in samples.iter_mut().zip(x.iter()) {
            single_all(sample, x);
        }
        tick_all(&law, &mut states, &samples, &mut u, &mut told.sigma_star, &mut told.health);
        drive_all(&mut told.u, &u);
        merit.note(k, t_s, &x[0], &told);
        if merit.is_inside(t_s) {
            estimated(&law, &states, &mut d_hat);
            for (s, channel) in channels.into_iter().enumerate() {
                plants.lumped(channel, t_s, &x, &told.u, &mut d);
                merit.note_estimate(s, &d, &d_hat[s]);
            }
        }
        if k == periods {
            break;
        }
        let next_s = (k + 1) as f64 * period_s;
        if parts[0].0.jumps_between(t_s, next_s) {
            for (l, trial) in trials.iter().enumerate() {
                let mut alone: [f64; N] = std::array::from_fn(|i| x[i][l]);
                if solver::advance(trial.plant, t_s, next_s, told.u[l], &mut alone).is_err() {
                    lost[l] |= 1;
                }
                for (x, alone) in x.iter_mut().zip(alone) {
                    x[l] = alone;
                }
            }
            continue;
        }
        plants.advance(t_s, &mut x, &told.u, &mut lost);
    }
    // What ended beyond the range is for the run alone to tell.
    let judged = (0..trials.len()).map(|l| {
        let is_sound = x.iter().all(|x| x[l].abs() <= solver::RUNAWAY);
        (lost[l] == 0 && is_sound).then(|| merit.judged(l, periods, &channels))
    });
    Some(judged.collect())
}

/// What a tick of every lane says.
struct Told {
    u: Wide,
    sigma_star: [f32; LANES],
    health: [u8; LANES],
}

impl Default for Told {
    fn default() -> Self {
        Self { u: [0.0; LANES], sigma_star: [0.0; LANES], health: [0; LANES] }
    }
}

type Law<const N: usize, const R: usize, const MASK: u8, const O: usize> =
    Controller<f32, Linear<f32, N>, N, R, MASK, O>;
type States<const N: usize, const R: usize, const MASK: u8, const O: usize> =
    Lanes<f32, Linear<f32, N>, N, R, MASK, O, LANES>;

vectorised! {
    fn tick_all<const N: usize, const R: usize, const MASK: u8, const O: usize>(
        law: &Law<N, R, MASK, O>,
        states: &mut States<N, R, MASK, O>,
        samples: &[[f32; LANES]; N],
        u: &mut [f32; LANES],
        sigma_star: &mut [f32; LANES],
        health: &mut [u8; LANES],
    ) {
        for l in 0..LANES {
            let output = law.tick_lane(states, l, &std::array::from_fn(|i| samples[i][l]));
            u[l] = output.u;
            sigma_star[l] = output.sigma_star;
            health[l] = output.health.bits();
        }
    }
}

vectorised! {
    fn single_all(samples: &mut [f32; LANES], x: &Wide) {
        for l in 0..LANES {
            samples[l] = x[l] as f32;
        }
    }
}

vectorised! {
    /// An actuator that is told nonsense switches off.
    fn drive_all(held: &mut Wide, u: &[f32; LANES]) {
        for l in 0..LANES {
            held[l] = if u[l].abs() <= f32::MAX { f64::from(u[l]) } else { 0.0 };
        }
    }
}

vectorised! {
    fn estimated<const N: usize, const R: usize, const MASK: u8, const O: usize>(
        law: &Law<N, R, MASK, O>,
        states: &States<N, R, MASK, O>,
        d_hat: &mut [Wide; O],
    ) {
        for l in 0..LANES {
            let estimates = law.estimates(&states.lane(l));
            for (s, channel) in Law::<N, R, MASK, O>::CHANNELS.into_iter().enumerate() {
                d_hat[s][l] = f64::from(estimates[channel][0]);
            }
        }
    }
}

#[cfg(test)]
mod tests;
