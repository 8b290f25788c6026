//! State of an encoder drive between two ticks.

use super::chain::ChainModel;
use crate::real::{Count, Real};
use crate::running::{Words, each_word, next};

/// State of an encoder drive in physical units. Under another design of this form the estimates keep their meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct EncoderState<T, M, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>
where
    T: Real,
    M: ChainModel<T, E, N>,
{
    /// Count of the last valid sample.
    pub(crate) last: [T::Count; E],
    /// Last valid count, relative to the base count.
    pub(crate) at: [T::Count; E],
    /// Revolution of the base count.
    pub(crate) turn: T::Count,
    /// Estimates of each block: p, the position minus the position of its count; v; d; with four states also d'.
    pub(crate) x: [[T; S]; E],
    /// Known disturbance w/2 at the last tick.
    pub(crate) push: M::Push,
    /// With two gain sets, for each block: smoothed innovation, and share of the high gains.
    pub(crate) alert: [[[T; 2]; E]; FAST],
    /// Amount by which a sample may exceed the innovation gate. It decays to 0 after a start. While the counts are not
    /// yet consistent, it is 0 if a position was known before.
    pub(crate) reach: T,
    /// Number of consecutive rejected samples of each encoder.
    pub(crate) missed: [T; E],
    /// Distance of the last rejected count of each encoder from its prediction.
    pub(crate) off: [T; E],
    /// Recent position steps, weighted by their price. In a fresh state: number of consistent counts still needed
    /// before the law starts.
    pub(crate) doubt: T,
    /// Offset W = σ(0) e^(-αt).
    pub(crate) offset: T,
    /// Current that the actuator has held since the last tick.
    pub(crate) held: T,
    /// Largest |u| of the power stage. The limit of the design applies if no other limit is set.
    pub(crate) limit: T,
    /// Last reported |u| if it was clearly below the output, otherwise a value above any |u|. Below 0 if the limit was
    /// set, and then no report changes it.
    pub(crate) reported: T,
    /// With a delay: u that the actuator holds now and in the following ticks. The last entry is the newest.
    pub(crate) queued: [T; LATE],
    /// True if the estimates belong to the coming sample: after the start, and after a retune.
    pub(crate) fresh: bool,
}

impl<T, M, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>
    EncoderState<T, M, E, N, S, FAST, LATE>
where
    T: Real,
    M: ChainModel<T, E, N>,
{
    /// Byte offset of the one byte in a state that must be 0 or 1.
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
