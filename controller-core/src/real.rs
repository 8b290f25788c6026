//! The scalar of the tick: `f32` on the chip, `f64` where the design and the oracles live.
//!
//! Only `+ - * /`, comparison and `abs` are used. IEEE 754 defines the result of each to the last bit and Rust never
//! contracts `a * b + c` into a fused operation, so one source gives one answer on every machine that computes in the
//! precision of the type: x86-64 (SSE2), ARM with or without an FPU, RISC-V. Excluded is the x87 of 32-bit x86 without
//! SSE2 (targets `i586`), which keeps more digits between two operations. That is also why there is no `mul_add` here
//! (a Cortex-M4F would need 3 cycles for it against 1 + 1) and no function of the platform's libm.

use core::fmt::{Debug, Display};
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A count that wraps at 32 bits, as an encoder's timer has it.
#[doc(hidden)]
pub trait Count: Copy + Debug + PartialEq + Send + Sync + 'static {
    /// A count that is known.
    fn of(count: i32) -> Self;
    /// How far it has moved since `earlier`.
    #[must_use]
    fn since(self, earlier: Self) -> Self;
    /// The count that has moved on by another.
    #[must_use]
    fn plus(self, moved: Self) -> Self;
    /// Without its 0..=31 high bits, with the sign of what is left: what a shorter counter has moved.
    #[must_use]
    fn signed(self, unread: u32) -> Self;
    /// So many `each` as there are whole `of` (more than 0) in it, with its sign: of -7, whole(3, 100) is -200.
    #[must_use]
    fn whole(self, of: i32, each: i32) -> Self;
    /// The count as 32 bits.
    fn to_word(self) -> u32;
    /// The counter of these bits.
    fn from_word(word: u32) -> Self;
}

impl Count for i32 {
    #[inline(always)]
    fn of(count: i32) -> Self {
        count
    }
    #[inline(always)]
    fn since(self, earlier: Self) -> Self {
        self.wrapping_sub(earlier)
    }
    #[inline(always)]
    fn plus(self, moved: Self) -> Self {
        self.wrapping_add(moved)
    }
    #[inline(always)]
    fn signed(self, unread: u32) -> Self {
        self << unread >> unread
    }
    #[inline(always)]
    fn whole(self, of: i32, each: i32) -> Self {
        self.checked_div(of).unwrap_or(0).wrapping_mul(each)
    }
    #[inline(always)]
    fn to_word(self) -> u32 {
        self as u32
    }
    #[inline(always)]
    fn from_word(word: u32) -> Self {
        word as i32
    }
}

/// Not for implementing elsewhere: the bit-for-bit promise is stated for `f32` and `f64`. Within the workspace a scalar
/// that records operations has it too, which is how the tick gets into other languages without being written twice.
#[doc(hidden)]
pub trait Sealed: Sized {
    /// What counts come in as.
    type Count: Count;

    /// The nearest number to a count with its sign.
    fn from_count(count: Self::Count) -> Self;

    /// A value of the tick by its name in the formulas, with the channel from 1 or 0 for none: for whoever reads the
    /// record. It costs nothing.
    #[inline(always)]
    #[must_use]
    fn called(self, name: &'static str, channel: usize) -> Self {
        let _ = (name, channel);
        self
    }

    /// What follows belongs to this encoder or channel, from 1, likewise: a loop's next turn is told from this one.
    #[inline(always)]
    fn channel(channel: usize) {
        let _ = channel;
    }

    /// Here a group of equations begins, likewise.
    #[inline(always)]
    fn section(title: &'static str) {
        let _ = title;
    }
}

macro_rules! sealed {
    ($($t:ty)*) => {$(
        impl Sealed for $t {
            type Count = i32;
            #[inline(always)]
            fn from_count(count: i32) -> Self {
                count as $t
            }
        }
    )*};
}
sealed!(f32 f64);

/// `f32` or `f64`. Sealed: the bit-for-bit promise is stated for these two.
pub trait Real:
    Sealed
    + Copy
    + Debug
    + Display
    + Default
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + Send
    + Sync
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// 1/2: the weight of both ends of a tick in its mean.
    const HALF: Self;
    /// Words of 32 bits that a number takes.
    const WORDS: usize;
    /// The bits, low word first; the second is 0 where there is one word.
    fn to_words(self) -> [u32; 2];
    /// The number of these bits.
    fn from_words(words: [u32; 2]) -> Self;
    /// The nearest value of this precision.
    fn from_f64(value: f64) -> Self;
    /// Exact for `f32`, the identity for `f64`.
    fn to_f64(self) -> f64;
    /// |self|.
    #[must_use]
    fn abs(self) -> Self;

    /// self limited to [min, max] by two compare-and-selects: constant time, and no library call as `f32::max` is on
    /// thumb. A NaN stays a NaN, for the tick's guard to find: the switching term is limited before it, u behind it.
    #[inline(always)]
    #[must_use]
    fn limited(self, min: Self, max: Self) -> Self {
        let below = if self > max { max } else { self };
        if below < min { min } else { below }
    }

    /// self, or most if that is less, by one compare-and-select: no second way through a tick. A NaN stays a NaN.
    #[inline(always)]
    #[must_use]
    fn at_most(self, most: Self) -> Self {
        if self > most { most } else { self }
    }

    /// One number or the other, by one compare-and-select as well: is self below the bound?
    #[inline(always)]
    #[must_use]
    fn if_below(self, bound: Self, yes: Self, no: Self) -> Self {
        if self < bound { yes } else { no }
    }
}

macro_rules! real {
    ($($t:ty, $bits:ty;)*) => {$(
        impl Real for $t {
            const ZERO: Self = 0.0;
            const HALF: Self = 0.5;
            const WORDS: usize = size_of::<$t>() / 4;
            fn to_words(self) -> [u32; 2] {
                let bits = u64::from(self.to_bits());
                [bits as u32, (bits >> 32) as u32]
            }
            fn from_words([low, high]: [u32; 2]) -> Self {
                <$t>::from_bits((u64::from(high) << 32 | u64::from(low)) as $bits)
            }
            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as $t
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$t>::abs(self)
            }
        }
    )*};
}
real!(f32, u32; f64, u64;);

/// Every entry rounded to the nearest f32.
pub(crate) const fn row_f32<const L: usize>(row: &[f64; L]) -> [f32; L] {
    let mut out = [0.0; L];
    let mut i = 0;
    while i < L {
        out[i] = row[i] as f32;
        i += 1;
    }
    out
}
