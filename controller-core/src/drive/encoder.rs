//! An encoder: counts that wrap, made an angle that does not.
//!
//! The counter has `bits` bits and wraps; the difference of two samples, its low bits with their sign, does not, as
//! long as the shaft moves less than half a counter per tick. A timer that is reloaded at 9999, or an absolute encoder
//! of 4000 positions, has a number of `states` that is no power of two: a difference of more than half of them is one
//! of so many less. The angle is kept as a whole number of counts since a
//! *base* that follows the shaft in whole turns: the f32 numbers of the tick stay below some turns, and so keep their
//! digits however far it goes. One step is
//!
//! $$ \text{unit} = 2\pi \thinspace \frac{\text{den}}{\text{num} \cdot \text{counts per turn}} \quad \text{rad} $$
//!
//! behind a gear: the encoder makes num turns while the shaft that is meant makes den. An angle counts to the middle of
//! its step; a sensor that rounds down is half a step off.

use core::f64::consts::TAU;

use super::error::DriveError;
use super::fence::Fence;
use super::fields::fields;
use super::rest::RestBand;
use crate::real::{Count, Real};
use crate::running::fingerprint_with;

/// An encoder and the gear between it and the shaft whose angle is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Encoder {
    /// Bits of the counter, 2..=32; higher bits of a sample are not read, unless it has a number of `states`.
    pub bits: u32,
    /// From 0 to one less the counter counts before it wraps, 2..2^31; 0 for 2^bits.
    #[cfg_attr(feature = "serde", serde(default))]
    pub states: u32,
    /// Counts while the encoder turns once, 4..=2^24.
    pub counts_per_turn: u32,
    /// Gear numerator: turns of the encoder, at least 1.
    pub gear_num: u32,
    /// Gear denominator: turns of the shaft meanwhile, at least 1. The fewest turns of the shaft that are a whole
    /// number of counts are at most 1000, and at most 2^24 counts: 325 turns for `geared(4554, 325)` and 2^10 counts.
    pub gear_den: u32,
}

impl Encoder {
    /// An absolute encoder of one turn on the shaft itself: 2^bits counts.
    pub const fn absolute(bits: u32) -> Self {
        Self { bits, states: 0, counts_per_turn: 1u32.wrapping_shl(bits), gear_num: 1, gear_den: 1 }
    }

    /// A counter of so many bits behind an encoder of `counts_per_turn`, four per line; it is 0 at angle 0.
    pub const fn incremental(bits: u32, counts_per_turn: u32) -> Self {
        Self { bits, states: 0, counts_per_turn, gear_num: 1, gear_den: 1 }
    }

    /// The same with a counter that wraps after so many states: `incremental(16, 10_000).wrapping_at(10_000)` is a
    /// timer with a reload of 9999 behind 2500 lines.
    #[must_use]
    pub const fn wrapping_at(self, states: u32) -> Self {
        Self { states, ..self }
    }

    /// How many states its counter has.
    pub const fn counter(&self) -> u64 {
        if self.states == 0 { 1u64 << (self.bits & 63) } else { self.states as u64 }
    }

    /// The same behind a gear: `num` turns of the encoder are `den` turns of the shaft.
    #[must_use]
    pub const fn geared(self, num: u32, den: u32) -> Self {
        Self { gear_num: num, gear_den: den, ..self }
    }

    /// One step, in rad of the shaft.
    pub const fn unit_rad(&self) -> f64 {
        TAU * self.gear_den as f64 / (self.gear_num as f64 * self.counts_per_turn as f64)
    }

    /// Turns of the shaft that are a whole number of counts, the fewest, and that number.
    pub(crate) const fn base(&self) -> (u32, u64) {
        let counts = self.counts_per_turn as u64 * self.gear_num as u64;
        let den = self.gear_den as u64;
        let (mut a, mut b) = (counts, den);
        while b != 0 {
            (a, b) = (b, a % b);
        }
        // Of a gear that `check` refuses it may be 0: nothing here panics, in the archive for C least of all.
        let a = if a == 0 { 1 } else { a };
        ((den / a) as u32, counts / a)
    }

    pub(crate) const fn check(&self, field: &'static str) -> Result<(), DriveError> {
        let Self { bits, states, counts_per_turn, gear_num, gear_den } = *self;
        let ranges = [
            (bits, 2, 32, "an encoder's counter has 2 to 32 bits"),
            (
                if states == 0 { 2 } else { states },
                2,
                MOST_STATES,
                "an encoder's counter has 2 to 2^31 - 1 states, or 2^bits",
            ),
            (counts_per_turn, 4, 1 << 24, "an encoder makes 4 to 2^24 counts per turn"),
            (gear_num, 1, u32::MAX, "the turns of a gear are whole numbers of at least 1"),
            (gear_den, 1, u32::MAX, "the turns of a gear are whole numbers of at least 1"),
        ];
        let mut k = 0;
        while k < ranges.len() {
            let (given, low, high, why) = ranges[k];
            if given < low || given > high {
                return Err(DriveError::new(field, given as f64, low as f64, high as f64, why));
            }
            k += 1;
        }
        // Of the gear a tick sees the base alone: its limits are those of a drive, whatever the two numbers are.
        let (turns, counts) = self.base();
        if turns > MOST_TURNS {
            let why = "gear and encoder meet again after 1 to 1000 turns of the shaft";
            return Err(DriveError::new(field, turns as f64, 1.0, MOST_TURNS as f64, why));
        }
        if counts > 1 << 24 {
            let why =
                "the turns in which gear and encoder meet again make more than 2^24 counts, which f32 cannot hold";
            return Err(DriveError::new(field, counts as f64, 4.0, (1 << 24) as f64, why));
        }
        Ok(())
    }

    pub(crate) const fn sensor(&self) -> Sensor<f64> {
        let (turns, counts) = self.base();
        // Four bases and more: whatever was written there, an angle has a size.
        let mut width = 4;
        while width < 32 && (1u64 << (width - 1)) < 4 * counts {
            width += 1;
        }
        let span = self.counter();
        let is_whole = span.is_power_of_two();
        let quarter_counts = if counts < span { counts } else { span } / 4;
        Sensor {
            unit: self.unit_rad(),
            half_span: self.unit_rad() * span as f64 / 2.0,
            quarter: self.unit_rad() * quarter_counts as f64,
            edge: 9.0 / 16.0 * counts as f64 * self.unit_rad(),
            unread: if is_whole { 32 - span.trailing_zeros() } else { 0 },
            states: if is_whole { 0 } else { span as i32 },
            beyond: 32 - width,
            base_counts: counts as i32,
            base_turns: turns as i32,
            quarter_counts: quarter_counts as i32,
        }
    }
}

/// How an encoder is mounted: what makes of its counts those that a drive takes, which grow with the angle and are 0
/// at angle 0.
///
/// ```
/// use controller_core::drive::Mounting;
///
/// // It counts down, and stands at 100 where the angle is 0.
/// let mounting = Mounting { is_reversed: true, offset_counts: 100 };
/// assert_eq!(mounting.upright(97), 3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Mounting {
    /// Does it count down while the angle grows?
    pub is_reversed: bool,
    /// Count at angle 0.
    pub offset_counts: i32,
}

impl Mounting {
    /// It counts up, from 0 at angle 0: nothing is to be done.
    pub const UPRIGHT: Self = Self { is_reversed: false, offset_counts: 0 };

    /// What a drive is to be given for the count (`i32`) that was read. Of a counter with fewer bits the drive reads
    /// only those.
    #[inline(always)]
    #[must_use]
    pub fn upright<C: Count>(self, count: C) -> C {
        let offset = C::of(self.offset_counts);
        if self.is_reversed { offset.since(count) } else { count.since(offset) }
    }
}

/// Fingerprint of a drive as a whole: of its law within its monitors ([`ControlLaw::fingerprint`]), of the mounting of
/// its encoders, of the ticks of a joined stop after an alarm (0: none), of its fence and its band at rest. Returns the
/// fingerprint of the law where all encoders are upright and there is none of these.
///
/// ```
/// use controller_core::drive::{Mounting, fingerprint};
///
/// let turned = Mounting { is_reversed: true, offset_counts: 0 };
/// assert_eq!(fingerprint(0x1234_5678, &[Mounting::UPRIGHT], 0, None, None), 0x1234_5678);
/// assert_ne!(fingerprint(0x1234_5678, &[turned], 0, None, None), 0x1234_5678);
/// ```
///
/// [`ControlLaw::fingerprint`]: crate::ControlLaw::fingerprint
pub fn fingerprint(
    law: u32,
    mounting: &[Mounting],
    stop_ticks: u32,
    fence: Option<&Fence>,
    rest_band: Option<&RestBand>,
) -> u32 {
    let is_upright = mounting.iter().all(|mounting| *mounting == Mounting::UPRIGHT);
    let is_neutral = stop_ticks == 0 && fence.is_none() && rest_band.is_none() && is_upright;
    let words = mounting.iter().flat_map(|it| [u32::from(it.is_reversed), it.offset_counts as u32]);
    let words = words.chain([stop_ticks]).chain(fence.into_iter().flat_map(Fence::words));
    let words = words.chain(rest_band.into_iter().flat_map(RestBand::words));
    fingerprint_with(law, words.filter(|_| !is_neutral))
}

fields! {
    /// What the tick knows of an encoder.
    pub(crate) struct Sensor<T> {
        /// One count in the unit of the block's position.
        unit: T,
        /// Half the counter: further it cannot move in a tick.
        half_span: T,
        /// A quarter of the counter or of the base, whichever is less.
        quarter: T,
        /// 9/16 of the base: there it is moved, and does not come back for noise.
        edge: T,
        /// High bits of a sample that are not read.
        unread: u32,
        /// Of a counter that wraps at another number than a power of two; else 0.
        states: i32,
        /// High bits that no count since the base needs, but for its sign.
        beyond: u32,
        base_counts: i32,
        base_turns: i32,
        quarter_counts: i32,
    }
}

/// Most turns of the shaft in a base.
const MOST_TURNS: u32 = 1000;
/// Of a counter whose difference has a sign.
const MOST_STATES: u32 = i32::MAX as u32;

impl<T: Real> Sensor<T> {
    /// What the count has moved: the difference of two samples that is within half a counter.
    #[inline(always)]
    pub(crate) fn moved(&self, difference: T::Count) -> T::Count {
        // A divisor that is above 0 needs no question for the one quotient that overflows.
        if self.states <= 0 {
            return difference.signed(self.unread);
        }
        let difference = difference.since(difference.whole(self.states, self.states));
        let (way, states) = (self.unit * T::from_count(difference), T::Count::of(self.states));
        if way > self.half_span {
            difference.since(states)
        } else if way < -self.half_span {
            difference.plus(states)
        } else {
            difference
        }
    }
}

impl<T> Sensor<T> {
    /// Does a count mean the same to both?
    pub(crate) const fn counts_alike(&self, other: &Self) -> bool {
        self.unread == other.unread
            && self.states == other.states
            && self.base_counts == other.base_counts
            && self.base_turns == other.base_turns
    }
}

impl Sensor<f64> {
    /// With the position in another unit.
    #[must_use]
    pub(crate) const fn scaled(self, factor: f64) -> Self {
        Self {
            unit: self.unit * factor,
            half_span: self.half_span * factor,
            quarter: self.quarter * factor,
            edge: self.edge * factor,
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gear_meets_its_encoder_again_after_whole_turns() {
        // 37 : 10 with 4096 counts: 15155.2 counts per turn of the shaft, 75776 in five.
        let encoder = Encoder::absolute(12).geared(37, 10);
        assert_eq!(encoder.base(), (5, 75_776));
        assert!((encoder.unit_rad() * 75_776.0 - 5.0 * TAU).abs() < 1e-12);
        // A harmonic drive needs one turn, a bare encoder too.
        assert_eq!(Encoder::absolute(12).geared(100, 1).base(), (1, 409_600));
        assert_eq!(Encoder::incremental(16, 4000).base(), (1, 4000));
    }

    #[test]
    fn an_encoder_that_the_tick_cannot_hold_is_refused_with_what_it_may_be() {
        let refused = [
            Encoder::absolute(25),
            Encoder::absolute(1),
            Encoder::incremental(33, 4096),
            Encoder::absolute(20).geared(0, 1),
            Encoder::absolute(20).geared(1, 0),
            Encoder::absolute(20).geared(1, 1001),
            Encoder::absolute(20).geared(100, 1),
            Encoder::absolute(14).geared(10_301, 100),
            Encoder::absolute(12).geared(u32::MAX, u32::MAX - 1),
        ];
        for encoder in refused {
            let error = encoder.check("encoder").expect_err("refused");
            assert!(error.given < error.low || error.given > error.high, "{encoder:?}: {error}");
        }
        assert_eq!(Encoder::absolute(24).check("encoder"), Ok(()));
        assert_eq!(Encoder::incremental(32, 4000).geared(160, 3).check("encoder"), Ok(()));
    }

    /// The two numbers of a gear may be large: the tick sees the turns and counts after which it meets its encoder.
    #[test]
    fn a_gear_of_large_numbers_is_taken_where_its_base_is_small() {
        let taken = [
            (Encoder::absolute(10).geared(4554, 325), (325, 4_663_296)),
            (Encoder::absolute(12).geared(99_225, 1024), (1, 396_900)),
            (Encoder::incremental(16, 4000).geared(10_301, 100), (1, 412_040)),
            (Encoder::absolute(12).geared(3591, 187), (187, 14_708_736)),
            (Encoder::absolute(24).geared(16_777_213, 16_777_216), (1, 16_777_213)),
        ];
        for (encoder, base) in taken {
            assert_eq!((encoder.check("encoder"), encoder.base()), (Ok(()), base), "{encoder:?}");
            // No tick can tell it from an encoder of so many counts on a shaft of so many turns.
            let (turns, counts) = base;
            let plain = Encoder::incremental(encoder.bits, counts as u32).geared(1, turns);
            let [geared, plain] = [encoder, plain].map(|encoder| encoder.sensor());
            assert!((geared.unit / plain.unit - 1.0).abs() < 4.0 * f64::EPSILON, "{encoder:?}");
            assert!(geared.counts_alike(&plain) && geared.quarter_counts == plain.quarter_counts);
        }
    }

    #[test]
    fn the_width_holds_four_bases() {
        for encoder in [Encoder::absolute(12), Encoder::absolute(24), Encoder::incremental(16, 4000)] {
            let sensor = encoder.sensor();
            let largest = (1_i64 << (31 - sensor.beyond)) as f64;
            let bases = largest / f64::from(sensor.base_counts);
            assert!((4.0..=8.0).contains(&bases), "{bases}");
        }
    }
}
