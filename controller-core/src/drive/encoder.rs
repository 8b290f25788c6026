//! Encoder: converts counts that wrap to an angle that does not.
//!
//! The counter has `bits` bits and wraps. The difference of two samples (its low bits, with their sign) does not wrap,
//! as long as the shaft moves less than half a counter per tick. A timer with a reload of 9999, or an absolute encoder
//! of 4000 positions, has a number of `states` that is not a power of two. A difference above half of the states is
//! then reduced by the number of states.
//!
//! The angle is a whole number of counts relative to a *base*. The base follows the shaft in whole revolutions. So the
//! f32 numbers of the tick stay below some revolutions, and keep their digits over any distance. One count is
//!
//! $$ \text{unit} = 2\pi \thinspace \frac{\text{den}}{\text{num} \cdot \text{counts per turn}} \quad \text{rad} $$
//!
//! behind a gear: the encoder makes num revolutions while the controlled shaft makes den. An angle refers to the middle
//! of its count. A sensor that rounds down is off by half a count.

use core::f64::consts::TAU;

use super::error::DriveError;
use super::fence::Fence;
use super::fields::fields;
use super::rest::RestBand;
use crate::real::{Count, Real};
use crate::running::fingerprint_with;

/// Encoder, and the gear between it and the controlled shaft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Encoder {
    /// Bits of the counter, 2..=32. Higher bits of a sample are not read, unless the counter has a number of `states`.
    pub bits: u32,
    /// States of the counter before it wraps from the last to 0, 2..2^31. 0 means 2^bits.
    #[cfg_attr(feature = "serde", serde(default))]
    pub states: u32,
    /// Counts per revolution of the encoder, 4..=2^24.
    pub counts_per_turn: u32,
    /// Gear numerator: encoder revolutions, at least 1.
    pub gear_num: u32,
    /// Gear denominator: shaft revolutions, at least 1.
    ///
    /// The base is the fewest revolutions of the shaft that are a whole number of counts. It is at most 1000
    /// revolutions and at most 2^24 counts. For example, `geared(4554, 325)` with 2^10 counts has a base of 325
    /// revolutions.
    pub gear_den: u32,
}

impl Encoder {
    /// Returns an absolute single-turn encoder on the shaft itself: 2^bits counts per revolution.
    pub const fn absolute(bits: u32) -> Self {
        Self { bits, states: 0, counts_per_turn: 1u32.wrapping_shl(bits), gear_num: 1, gear_den: 1 }
    }

    /// Returns a counter of `bits` bits behind an encoder with `counts_per_turn` (four per line). Its count is 0 at
    /// angle 0.
    pub const fn incremental(bits: u32, counts_per_turn: u32) -> Self {
        Self { bits, states: 0, counts_per_turn, gear_num: 1, gear_den: 1 }
    }

    /// Returns the encoder with a counter that wraps after `states` states.
    /// `incremental(16, 10_000).wrapping_at(10_000)` is a timer with a reload of 9999 behind 2500 lines.
    #[must_use]
    pub const fn wrapping_at(self, states: u32) -> Self {
        Self { states, ..self }
    }

    /// Returns the number of states of the counter.
    pub const fn counter(&self) -> u64 {
        if self.states == 0 { 1u64 << (self.bits & 63) } else { self.states as u64 }
    }

    /// Returns the encoder behind a gear: `num` revolutions of the encoder are `den` revolutions of the shaft.
    #[must_use]
    pub const fn geared(self, num: u32, den: u32) -> Self {
        Self { gear_num: num, gear_den: den, ..self }
    }

    /// Returns one count, in rad of the shaft.
    pub const fn unit_rad(&self) -> f64 {
        TAU * self.gear_den as f64 / (self.gear_num as f64 * self.counts_per_turn as f64)
    }

    /// Returns the base: the fewest revolutions of the shaft that are a whole number of counts, and that number.
    pub(crate) const fn base(&self) -> (u32, u64) {
        let counts = self.counts_per_turn as u64 * self.gear_num as u64;
        let den = self.gear_den as u64;
        let (mut a, mut b) = (counts, den);
        while b != 0 {
            (a, b) = (b, a % b);
        }
        // It may be 0 for a gear that `check` rejects. Nothing here panics, in particular not in the static library for
        // C.
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
        // The tick uses only the base of the gear: the limits apply to the base, for any pair of numbers.
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

    /// Returns the motion from one count to another, in counts, reduced to within half a counter.
    ///
    /// ```
    /// use controller_core::drive::Encoder;
    ///
    /// // A timer with a reload value of 9999 that wraps backwards.
    /// let encoder = Encoder::incremental(16, 10_000).wrapping_at(10_000);
    /// assert_eq!(encoder.moved(3, 9_998), -5);
    /// ```
    pub fn moved(&self, from: i32, to: i32) -> i32 {
        self.sensor().moved(to.wrapping_sub(from))
    }

    pub(crate) const fn sensor(&self) -> Sensor<f64> {
        let (turns, counts) = self.base();
        // At least four bases wide: with any content of the memory, the angle stays bounded.
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

/// Mounting of an encoder: converts its counts to counts that increase with the angle and are 0 at angle 0.
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
    /// True if the encoder counts down while the angle increases.
    pub is_reversed: bool,
    /// Count at angle 0.
    pub offset_counts: i32,
}

impl Mounting {
    /// Mounting of an encoder that counts up, from 0 at angle 0: no conversion.
    pub const UPRIGHT: Self = Self { is_reversed: false, offset_counts: 0 };

    /// Converts a count (`i32`) that was read to the count for a drive. A drive reads only the bits of its counter.
    #[inline(always)]
    #[must_use]
    pub fn upright<C: Count>(self, count: C) -> C {
        let offset = C::of(self.offset_counts);
        if self.is_reversed { offset.since(count) } else { count.since(offset) }
    }
}

/// Returns the fingerprint of a whole drive: law and monitors, mounting, controlled stop, fence and rest band.
///
/// `law` is the fingerprint of the law with its monitors ([`ControlLaw::fingerprint`]). `stop_ticks` is the duration of
/// a controlled stop after an alarm, or 0 for none. The result equals `law` if all encoders are upright and all other
/// parts are absent.
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
    /// Encoder in the form that a tick uses.
    pub(crate) struct Sensor<T> {
        /// One count, in the unit of the block's position.
        unit: T,
        /// Half the counter: the largest motion per tick.
        half_span: T,
        /// Quarter of the counter or of the base, whichever is less.
        quarter: T,
        /// Edge at 9/16 of the base: there the base moves, and noise does not move it back.
        edge: T,
        /// Number of high bits of a sample that are not read.
        unread: u32,
        /// States of a counter that does not wrap at a power of two, else 0.
        states: i32,
        /// Number of high bits that no count relative to the base needs, except for its sign.
        beyond: u32,
        base_counts: i32,
        base_turns: i32,
        quarter_counts: i32,
    }
}

/// Largest number of shaft revolutions in a base.
const MOST_TURNS: u32 = 1000;
/// Largest number of states of a counter whose difference has a sign.
const MOST_STATES: u32 = i32::MAX as u32;

impl<T: Real> Sensor<T> {
    /// Returns the motion of the count: the difference of two samples, reduced to within half a counter.
    #[inline(always)]
    pub(crate) fn moved(&self, difference: T::Count) -> T::Count {
        // A positive divisor avoids the check for the one quotient that overflows.
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
    /// Returns true if a count has one meaning for both encoders.
    pub(crate) const fn counts_alike(&self, other: &Self) -> bool {
        self.unread == other.unread
            && self.states == other.states
            && self.base_counts == other.base_counts
            && self.base_turns == other.base_turns
    }
}

impl Sensor<f64> {
    /// Returns the sensor with its position in another unit.
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
        // 37 : 10 with 4096 counts: 15155.2 counts per revolution of the shaft, 75776 in five.
        let encoder = Encoder::absolute(12).geared(37, 10);
        assert_eq!(encoder.base(), (5, 75_776));
        assert!((encoder.unit_rad() * 75_776.0 - 5.0 * TAU).abs() < 1e-12);
        // A harmonic drive needs one revolution, an encoder without a gear too.
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

    /// Checks gears with large numbers: the tick uses only the base, which may still be small.
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
            // A tick cannot distinguish it from an encoder with the counts and revolutions of the base.
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
