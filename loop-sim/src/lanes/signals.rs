//! One signal of each lane, at a time that is that of all.

use super::wide::Wide;
use super::{Instructions, LANES};
use crate::signal::{Signal, Term};

/// The signals.
pub(super) enum Signals {
    /// Terms that are the same in all lanes; of those after them the amplitudes and the term of amplitude 1.
    Alike(Signal, Vec<(Box<Wide>, Term)>),
    /// One for each lane.
    Each(Vec<Signal>),
}

impl Signals {
    /// Of these; lanes beyond the last are like the first.
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

    /// Their value, if all have the same.
    pub(super) fn of_all(&self, t_s: f64) -> Option<f64> {
        match self {
            Self::Alike(same, others) if others.is_empty() => Some(same.value(t_s)),
            Self::Alike(..) | Self::Each(_) => None,
        }
    }

    /// The value of each, summed as [`Signal::value`] does.
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
    /// Adds so many times the value.
    pub(super) fn weigh_all[;](sum: &mut Wide, factor: &Wide, value: f64,) {
        for l in 0..LANES {
            sum[l] += factor[l] * value;
        }
    }
}
