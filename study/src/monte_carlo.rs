//! Monte Carlo: a scenario run many times, with some of its keys drawn anew each time.
//!
//! Trial i is the run of the scenario with `KEY=VALUE` set for each parameter p, the value a function of (master seed,
//! i, p) alone ([`philox`]), or point i of a Sobol sequence ([`sobol`]); the seed of its noise likewise. Nothing else
//! has a say: threads, shards, order, a run that was killed and resumed give the same numbers, and any trial
//! can be run again alone, with `host-sim run` and those settings.
//!
//! Trials are computed on all cores ([`trials`]). What they come to: percentiles by exact
//! rank, and the largest failure rate that the trials leave open ([`statistics`]).

use loop_sim::philox;

use scenario::{Experiment, ScenarioError};

use crate::Error;
use crate::map::Subject;

pub mod sobol;
pub mod statistics;
mod trials;
pub mod uncertain;
pub mod vary;

pub use trials::{Columns, ENDED, Rows, Trial, trial, trials};

use vary::Vary;

/// How a trial went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// To its end, and bounded.
    Finished,
    /// To its end, but far from where it began.
    Unbounded,
    /// To its end, but only the limits of u kept it near: at rest its loop grows.
    Unstable,
    /// The state ran away.
    Diverged,
    /// The plant could not be integrated.
    BrokenOff,
    /// There is no design with what was drawn.
    Refused,
}

impl Outcome {
    /// All there are.
    pub const ALL: [Self; 6] =
        [Self::Finished, Self::Unbounded, Self::Unstable, Self::Diverged, Self::BrokenOff, Self::Refused];

    /// As it stands in the file.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Finished => "finished",
            Self::Unbounded => "unbounded",
            Self::Unstable => "unstable",
            Self::Diverged => "diverged",
            Self::BrokenOff => "broken off",
            Self::Refused => "refused",
        }
    }
}

/// The parameter number of the seed of a trial's noise.
const NOISE: u32 = u32::MAX;

/// What is drawn for which trial.
pub struct Plan<'a> {
    /// The scenario with nothing drawn.
    pub subject: Subject<'a>,
    /// What differs from trial to trial.
    pub vary: Vec<Vary>,
    /// Master seed.
    pub seed: u64,
    /// Does every trial have a noise seed of its own?
    has_noise: bool,
}

impl<'a> Plan<'a> {
    /// Reads what is to vary.
    ///
    /// # Errors
    /// What is wrong with it: the text, or a key, or two that draw the same key.
    pub fn new(subject: Subject<'a>, vary: &[String], seed: u64) -> Result<Self, Error> {
        let mut dimension = 0;
        let vary: Vec<Vary> =
            vary.iter().map(|text| Vary::parse(text, &subject, &mut dimension)).collect::<Result<_, _>>()?;
        let keys: Vec<&str> = vary.iter().flat_map(Vary::keys).collect();
        // A table is drawn with all that is in it.
        let plain = |key: &str| key.split('[').map(|part| part.trim_start_matches('0')).collect::<Vec<_>>().join("[");
        let holds = |outer: &str, key: &str| {
            let (outer, key) = (plain(outer), plain(key));
            key.strip_prefix(&outer).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        for (k, key) in keys.iter().enumerate() {
            if let Some(before) = keys[..k].iter().find(|before| holds(before, key) || holds(key, before)) {
                let with = if before == key { String::new() } else { format!(": {before} is too") };
                return Err(Error::input(format!("{key} is drawn twice{with}")).at("--vary"));
            }
        }
        let has_noise = !keys.contains(&"seed") && subject.with(&["seed=1".into()]).is_ok();
        Ok(Self { subject, vary, seed, has_noise })
    }

    /// The draw of each parameter.
    fn draws(&self, trial: u64) -> impl Iterator<Item = (&Vary, f64)> {
        (0..).zip(&self.vary).map(move |(p, vary)| (vary, vary.draw(self.seed, trial, p)))
    }

    /// What a trial's parameters are.
    pub fn drawn(&self, trial: u64) -> Vec<f64> {
        self.draws(trial).map(|(vary, draw)| vary.value(draw)).collect()
    }

    /// `KEY=VALUE` that make the trial of the scenario.
    pub fn settings(&self, trial: u64) -> Vec<String> {
        // A seed of 53 bits is a number to every reader of TOML and JSON.
        let noise = self.has_noise.then(|| format!("seed={}", philox::draw(self.seed, trial, NOISE)[0] >> 11));
        self.draws(trial).flat_map(|(vary, draw)| vary.settings(draw)).chain(noise).collect()
    }

    /// Returns the experiment of a trial.
    ///
    /// # Errors
    /// There is no design with the values that were drawn.
    pub fn experiment(&self, trial: u64) -> Result<Experiment, ScenarioError> {
        self.subject.with(&self.settings(trial))
    }
}
