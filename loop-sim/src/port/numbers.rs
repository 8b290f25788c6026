//! State of a controller as numbers, for programs that restore it: bit-exact, and of one length per controller.
//!
//! The first number is 1 after the start and 0 before it, with zeros behind it. Then follow the words of the state
//! ([`Words`]), each as the number that it encodes: a flag or a count as an integer, any other word as a float.

use std::ops::Range;

use controller_core::{ControlLaw, Real, Running, Words};

/// Returns the state of a controller. The `whole` words are integers. `sample` starts a controller, for its length.
pub(super) fn of<L: ControlLaw>(running: &Running<L>, whole: &[Range<usize>], sample: &L::Sample) -> Vec<f64> {
    if let Some(state) = running.state() {
        return [1.0].into_iter().chain(numbers::<L::Scalar>(state.words(), whole)).collect();
    }
    let started = running.design().start(sample);
    let length = started.map_or(0, |state| numbers::<L::Scalar>(state.words(), whole).count());
    vec![0.0; 1 + length]
}

/// Restores the state of a controller. Returns `false` for numbers that are not the state of this controller.
pub(super) fn restore<L: ControlLaw>(running: &mut Running<L>, whole: &[Range<usize>], numbers: &[f64]) -> bool {
    let state = match numbers {
        [0.0, ..] => None,
        [1.0, rest @ ..] => {
            let mut words = words::<L::Scalar>(rest, whole);
            let Some(state) = L::State::from_words(&mut words).filter(|_| words.next().is_none()) else { return false };
            Some(state)
        }
        _ => return false,
    };
    running.set_state(state);
    true
}

/// Returns the numbers that words encode. A float of type `T` has one word or two.
pub(super) fn numbers<T: Real>(words: impl Iterator<Item = u32>, whole: &[Range<usize>]) -> impl Iterator<Item = f64> {
    let mut words = words.enumerate();
    std::iter::from_fn(move || {
        let (at, low) = words.next()?;
        if whole.iter().any(|range| range.contains(&at)) {
            return Some(f64::from(low as i32));
        }
        let high = if T::WORDS == 2 { words.next()?.1 } else { 0 };
        Some(T::from_words([low, high]).to_f64())
    })
}

/// Returns the words of numbers, as [`numbers`] encodes them.
pub(super) fn words<T: Real>(numbers: &[f64], whole: &[Range<usize>]) -> impl Iterator<Item = u32> {
    let mut at = 0;
    numbers.iter().flat_map(move |&number| {
        let is_whole = whole.iter().any(|range| range.contains(&at));
        let count = if is_whole { 1 } else { T::WORDS };
        at += count;
        let pair = if is_whole { [number as i32 as u32, 0] } else { T::from_f64(number).to_words() };
        pair.into_iter().take(count)
    })
}
