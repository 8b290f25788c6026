//! One signal of each lane, at a time that is that of all.

use super::wide::Wide;
use super::{Instructions, LANES};
use crate::signal::{Signal, Term};

/// The signals.
pub(super) enum Signals {
    /// Lanes differ in amplitudes only: those of each term, and the term of amplitude 1.
    Alike(Vec<(Box<Wide>, Term)>),
    /// One for each lane.
    Each(Vec<Signal>),
}

impl Signals {
    /// Of these; lanes beyond the last are like the first.
    pub(super) fn new(each: &[&Signal]) -> Self {
        let units = |signal: &Signal| -> Vec<Term> { signal.terms().iter().map(|term| term.parted().1).collect() };
        let first = units(each[0]);
        if !each.iter().all(|signal| units(signal) == first) {
            return Self::Each((0..LANES).map(|l| (*each.get(l).unwrap_or(&each[0])).clone()).collect());
        }
        let amplitude = |p: usize, l: usize| each.get(l).unwrap_or(&each[0]).terms()[p].parted().0;
        let terms = first.into_iter().enumerate();
        Self::Alike(terms.map(|(p, term)| (Box::new(Wide(std::array::from_fn(|l| amplitude(p, l)))), term)).collect())
    }

    /// The value of each, summed as [`Signal::value`] does.
    pub(super) fn value(&self, instructions: Instructions, t_s: f64, value: &mut Wide) {
        match self {
            Self::Alike(terms) => {
                *value = Wide::of_all(0.0);
                for (amplitude, term) in terms {
                    weigh_all(instructions, value, amplitude, term.value(t_s));
                }
            }
            Self::Each(signals) => {
                for (value, signal) in value.0.iter_mut().zip(signals) {
                    *value = signal.value(t_s);
                }
            }
        }
    }
}

vectorised! {
    /// Adds so many times the value.
    pub(super) fn weigh_all[;](sum: &mut Wide, factor: &Wide, value: f64,) {
        for l in 0..LANES {
            sum[l] += factor[l] * value;
        }
    }
}
