//! What an encoder drive remembers between two ticks.

use super::chain::ChainModel;
use crate::real::{Count, Real};
use crate::running::{Words, each_word, next};

/// Everything in physical units: of another design of the same shape the estimates mean the same.
#[derive(Clone, Debug, PartialEq)]
pub struct EncoderState<T, M, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>
where
    T: Real,
    M: ChainModel<T, E, N>,
{
    /// Count of the last good sample.
    pub(crate) last: [T::Count; E],
    /// The same since the base.
    pub(crate) at: [T::Count; E],
    /// Turn of the base.
    pub(crate) turn: T::Count,
    /// Estimates of each block: p, the position less that of its count; v; d; with four states d'.
    pub(crate) x: [[T; S]; E],
    /// w/2 at the last tick.
    pub(crate) push: M::Push,
    /// With two gain sets, of each block: smoothed innovation, and how far the fast set is in.
    pub(crate) alert: [[[T; 2]; E]; FAST],
    /// A sample is believed that is so much further off than the gate; it closes to 0 after a start. While the counts
    /// have not agreed it is 0 after a place was known.
    pub(crate) reach: T,
    /// Samples of each encoder that were not used, in a row.
    pub(crate) missed: [T; E],
    /// How far the last count of each encoder that was not used was from its prediction.
    pub(crate) off: [T; E],
    /// Steps of the position lately, by their price; as long as the state is fresh, agreements of the counts that are
    /// still wanted before the law is asked.
    pub(crate) doubt: T,
    /// W = σ(0) e^(-αt).
    pub(crate) offset: T,
    /// What the actuator held since the last tick.
    pub(crate) held: T,
    /// What the power stage gives at most, |u|; that of the design without a limit of its own.
    pub(crate) limit: T,
    /// |u| of the last report if it was clearly less than was put out, else more than any; below 0 where the limit was
    /// set, and no report changes it.
    pub(crate) reported: T,
    /// With a delay: what it holds now, and in the ticks after it; the last is the newest.
    pub(crate) queued: [T; LATE],
    /// The estimates are those of the coming sample already: after the start, and after a re-tune.
    pub(crate) fresh: bool,
}

impl<T, M, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>
    EncoderState<T, M, E, N, S, FAST, LATE>
where
    T: Real,
    M: ChainModel<T, E, N>,
{
    /// Where in a state the one byte lies that must be 0 or 1.
    #[doc(hidden)]
    pub const FLAG_AT: usize = core::mem::offset_of!(Self, fresh);
}

impl<T, M, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize> Words
    for EncoderState<T, M, E, N, S, FAST, LATE>
where
    T: Real,
    M: ChainModel<T, E, N>,
{
    fn words(&self) -> impl Iterator<Item = u32> {
        let Self { last, at, turn, x, push, alert, reach, missed, off, doubt, offset, .. } = self;
        let Self { held, limit, reported, queued, fresh, .. } = self;
        let counts = last.iter().chain(at).chain([turn]).copied().map(Count::to_word);
        let alert = alert.as_flattened().as_flattened();
        let numbers = x.as_flattened().iter().chain(alert).chain([reach]).chain(missed).chain(off);
        let numbers = numbers.chain([doubt, offset, held, limit, reported]).chain(queued).flat_map(each_word);
        [u32::from(*fresh)].into_iter().chain(counts).chain(push.words()).chain(numbers)
    }

    fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self> {
        let fresh = match words.next()? {
            0 => false,
            1 => true,
            _ => return None,
        };
        let mut counts = [[T::Count::of(0); E]; 2];
        for count in counts.as_flattened_mut() {
            *count = T::Count::from_word(words.next()?);
        }
        let [last, at] = counts;
        let turn = T::Count::from_word(words.next()?);
        let push = M::Push::from_words(words)?;
        let mut state = Self {
            last,
            at,
            turn,
            x: [[T::ZERO; S]; E],
            push,
            alert: [[[T::ZERO; 2]; E]; FAST],
            reach: T::ZERO,
            missed: [T::ZERO; E],
            off: [T::ZERO; E],
            doubt: T::ZERO,
            offset: T::ZERO,
            held: T::ZERO,
            limit: T::ZERO,
            reported: T::ZERO,
            queued: [T::ZERO; LATE],
            fresh,
        };
        let Self { x, alert, reach, missed, off, doubt, offset, held, limit, reported, queued, .. } = &mut state;
        let alert = alert.as_flattened_mut().as_flattened_mut();
        let numbers = x.as_flattened_mut().iter_mut().chain(alert).chain([reach]).chain(missed).chain(off);
        for number in numbers.chain([doubt, offset, held, limit, reported]).chain(queued) {
            *number = next(words)?;
        }
        Some(state)
    }
}
