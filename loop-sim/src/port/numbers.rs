//! State of a controller as numbers, for programs that restore it: bit-exact, and of one length per controller.
//!
//! The first number is 1 after the start and 0 before it, with zeros behind it. Then follow the words of the state
//! ([`Words`]), each as the number that it encodes: a flag or a count as an integer, any other word as a float.

use std::ops::Range;
use std::slice;

use controller_core::{ControlLaw, Real, Running, Words};

/// Words of the state of a chain's controller that are integers: its flag.
pub(crate) const FLAG: &[Range<usize>] = slice::from_ref(&(0..1));

/// Returns the state of a controller. The `whole` words are integers. `sample` starts a controller, for its length.
pub(super) fn of<L: ControlLaw>(running: &Running<L>, whole: &[Range<usize>], sample: &L::Sample) -> Vec<f64> {
    let started = |state: &L::State| numbers::<L::Scalar>(&state.words().collect::<Vec<_>>(), whole);
    if let Some(state) = running.state() {
        return [vec![1.0], started(state)].concat();
    }
    let length = running.design().start(sample).map_or(0, |state| started(&state).len());
    vec![0.0; 1 + length]
}

/// Restores the state of a controller. Returns `false` for numbers that are not the state of this controller.
pub(super) fn restore<L: ControlLaw>(running: &mut Running<L>, whole: &[Range<usize>], numbers: &[f64]) -> bool {
    let state = match numbers {
        [0.0, ..] => None,
        [1.0, rest @ ..] => {
            let mut words = words::<L::Scalar>(rest, whole).into_iter();
            let Some(state) = L::State::from_words(&mut words).filter(|_| words.next().is_none()) else { return false };
            Some(state)
        }
        _ => return false,
    };
    running.set_state(state);
    true
}

/// Returns the numbers that words encode. A float of type `T` has one word or two.
pub(crate) fn numbers<T: Real>(words: &[u32], whole: &[Range<usize>]) -> Vec<f64> {
    let mut words = words.iter().copied().enumerate();
    let next = || {
        let (at, low) = words.next()?;
        if whole.iter().any(|range| range.contains(&at)) {
            return Some(f64::from(low as i32));
        }
        let high = if T::WORDS == 2 { words.next()?.1 } else { 0 };
        Some(T::from_words([low, high]).to_f64())
    };
    std::iter::from_fn(next).collect()
}

/// Returns the words of numbers, as [`numbers`] encodes them.
pub(crate) fn words<T: Real>(numbers: &[f64], whole: &[Range<usize>]) -> Vec<u32> {
    let mut words = Vec::new();
    for &number in numbers {
        let is_whole = whole.iter().any(|range| range.contains(&words.len()));
        let pair = if is_whole { [number as i32 as u32, 0] } else { T::from_f64(number).to_words() };
        words.extend(&pair[..if is_whole { 1 } else { T::WORDS }]);
    }
    words
}
