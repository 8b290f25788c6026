//! Monte Carlo: a scenario runs many times with random values of some keys.
//!
//! Trial i is the run of the scenario with `KEY=VALUE` set for each parameter p. The value depends only on (master
//! seed, i, p) ([`philox`]), or is point i of a Sobol sequence ([`sobol`]). The noise seed is drawn in the same way.
//! Threads, shards, order and resumption after an interruption therefore do not change the numbers. Any trial can be
//! repeated alone by `host-sim run` with its settings.
//!
//! Trials run on all cores ([`trials`]). The results are percentiles by exact rank and an upper bound of the failure
//! rate ([`statistics`]).

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

/// Outcome of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// The run finished and stayed bounded.
    Finished,
    /// A monitor stopped the drive after an alarm.
    Stopped,
    /// The run finished, but far from its start.
    Unbounded,
    /// The run finished, but only the limits of u kept it bounded: the loop at rest is unstable.
    Unstable,
    /// The state diverged.
    Diverged,
    /// The plant could not be integrated.
    BrokenOff,
    /// The drawn values have no valid design.
    Refused,
}

impl Outcome {
    /// All outcomes.
    pub const ALL: [Self; 7] = [
        Self::Finished,
        Self::Stopped,
        Self::Unbounded,
        Self::Unstable,
        Self::Diverged,
        Self::BrokenOff,
        Self::Refused,
    ];

    /// Returns the word in the result file.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Finished => "finished",
            Self::Stopped => "stopped",
            Self::Unbounded => "unbounded",
            Self::Unstable => "unstable",
            Self::Diverged => "diverged",
            Self::BrokenOff => "broken off",
            Self::Refused => "refused",
        }
    }
}

/// Parameter number of the noise seed of a trial.
const NOISE: u32 = u32::MAX;

/// Plan of the trials.
pub struct Plan<'a> {
    /// Scenario without drawn values.
    pub subject: Subject<'a>,
    /// Parameters that vary from trial to trial.
    pub vary: Vec<Vary>,
    /// Master seed.
    pub seed: u64,
    /// Whether every trial has its own noise seed.
    has_noise: bool,
}

impl<'a> Plan<'a> {
    /// Reads the parameters to vary.
    ///
    /// # Errors
    /// A text or a key is invalid, or two parameters draw the same key.
    pub fn new(subject: Subject<'a>, vary: &[String], seed: u64) -> Result<Self, Error> {
        let mut dimension = 0;
        let vary: Vec<Vary> =
            vary.iter().map(|text| Vary::parse(text, &subject, &mut dimension)).collect::<Result<_, _>>()?;
        let keys: Vec<&str> = vary.iter().flat_map(Vary::keys).collect();
        // A table is drawn with all its entries.
        let plain = |key: &str| key.split('[').map(|part| part.trim_start_matches('0')).collect::<Vec<_>>().join("[");
        let holds = |outer: &str, key: &str| {
            let (outer, key) = (plain(outer), plain(key));
            key.strip_prefix(&outer).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        for (k, key) in keys.iter().enumerate() {
            if let Some(before) = keys[..k].iter().find(|before| holds(before, key) || holds(key, before)) {
                let with = if before == key { String::new() } else { format!(": it overlaps {before}") };
                return Err(Error::input(format!("{key} is drawn twice{with}")).at("--vary"));
            }
        }
        let has_noise = !keys.contains(&"seed") && subject.with(&["seed=1".into()]).is_ok();
        Ok(Self { subject, vary, seed, has_noise })
    }

    /// Returns the draw of each parameter.
    fn draws(&self, trial: u64) -> impl Iterator<Item = (&Vary, f64)> {
        (0..).zip(&self.vary).map(move |(p, vary)| (vary, vary.draw(self.seed, trial, p)))
    }

    /// Returns the parameter values of a trial.
    pub fn drawn(&self, trial: u64) -> Vec<f64> {
        self.draws(trial).map(|(vary, draw)| vary.value(draw)).collect()
    }

    /// Returns the settings `KEY=VALUE` of a trial.
    pub fn settings(&self, trial: u64) -> Vec<String> {
        // A seed of 53 bits is exact for every reader of TOML and JSON.
        let noise = self.has_noise.then(|| format!("seed={}", philox::draw(self.seed, trial, NOISE)[0] >> 11));
        self.draws(trial).flat_map(|(vary, draw)| vary.settings(draw)).chain(noise).collect()
    }

    /// Returns the experiment of a trial.
    ///
    /// # Errors
    /// The drawn values have no valid design.
    pub fn experiment(&self, trial: u64) -> Result<Experiment, ScenarioError> {
        self.subject.with(&self.settings(trial))
    }
}
