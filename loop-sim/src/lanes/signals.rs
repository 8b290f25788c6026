//! Signals of all lanes, evaluated at a common time.

use super::wide::Wide;
use super::{Instructions, LANES};
use crate::signal::{Signal, Term};

/// One signal per lane.
pub(super) enum Signals {
    /// Terms that are equal in all lanes. For each later term: its amplitudes, and the term with amplitude 1.
    Alike(Signal, Vec<(Box<Wide>, Term)>),
    /// Separate signal of each lane.
    Each(Vec<Signal>),
}

impl Signals {
    /// Builds the signals. Lanes beyond the last copy the first.
    pub(super) fn new(each: &[&Signal]) -> Self {
        let of_lane = |l: usize| *each.get(l).unwrap_or(&each[0]);
        let units = |signal: &Signal| -> Vec<Term> { signal.terms().iter().map(|term| term.parted().1).collect() };
        let (first, terms) = (each[0].terms(), units(each[0]));
        if !each.iter().all(|signal| units(signal) == terms) {
            return Self::Each((0..LANES).map(|l| of_lane(l).clone()).collect());
        }
        let is_same = |p: &usize| each.iter().all(|signal| signal.terms()[*p] == first[*p]);
        let same = (0..first.len()).take_while(is_same).count();
        let amplitudes = |p: usize| Wide(std::array::from_fn(|l| of_lane(l).terms()[p].parted().0));
        let others = (same..first.len()).map(|p| (Box::new(amplitudes(p)), terms[p])).collect();
        Self::Alike(Signal::new(first[..same].to_vec()), others)
    }

    /// Returns the common value if all lanes have the same signal.
    pub(super) fn of_all(&self, t_s: f64) -> Option<f64> {
        match self {
            Self::Alike(same, others) if others.is_empty() => Some(same.value(t_s)),
            Self::Alike(..) | Self::Each(_) => None,
        }
    }

    /// Computes the value of each signal, summed in the order of [`Signal::value`].
    pub(super) fn value(&self, instructions: Instructions, t_s: f64, value: &mut Wide) {
        match self {
            Self::Alike(same, others) => {
                *value = Wide::of_all(same.value(t_s));
                for (amplitude, term) in others {
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
    /// Adds the value, multiplied by the factor of each lane.
    pub(super) fn weigh_all[;](sum: &mut Wide, factor: &Wide, value: f64,) {
        for l in 0..LANES {
            sum[l] += factor[l] * value;
        }
    }
}
