//! Scalar of the tick: `f32` on the target, `f64` in the design and in the test oracles.
//!
//! The tick uses only `+ - * /`, comparison and `abs`. IEEE 754 defines each result to the last bit, and Rust never
//! contracts `a * b + c` into a fused operation. So one source gives one result on every machine that computes in the
//! precision of the type: x86-64 (SSE2), ARM with or without an FPU, RISC-V. The x87 unit of 32-bit x86 without SSE2
//! (targets `i586`) is excluded, because it keeps more digits between two operations. For this reason there is no
//! `mul_add` (3 cycles on a Cortex-M4F, against 1 + 1) and no function of the platform's libm.

use core::fmt::{Debug, Display};
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Encoder count that wraps at 32 bits, like an encoder timer.
#[doc(hidden)]
pub trait Count: Copy + Debug + PartialEq + Send + Sync + 'static {
    /// Returns the counter for a known count.
    fn of(count: i32) -> Self;
    /// Returns the change in counts since `earlier`, with wrap-around.
    #[must_use]
    fn since(self, earlier: Self) -> Self;
    /// Returns the count advanced by `moved`, with wrap-around.
    #[must_use]
    fn plus(self, moved: Self) -> Self;
    /// Returns the value without its upper 0..=31 bits, sign-extended: the change of a shorter counter.
    #[must_use]
    fn signed(self, unread: u32) -> Self;
    /// Returns `each` times the number of whole `of` (above 0) in the count, with its sign. -7.whole(3, 100) is -200.
    #[must_use]
    fn whole(self, of: i32, each: i32) -> Self;
    /// Returns the count as 32 bits.
    fn to_word(self) -> u32;
    /// Returns the count with these bits.
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

/// Prevents other implementations of [`Real`]: bit-identical results are stated for `f32` and `f64` only. Within the
/// workspace a scalar that records operations implements it too. The tick is written once and exported to other
/// languages through that scalar.
#[doc(hidden)]
pub trait Sealed: Sized {
    /// Type of the encoder counts.
    type Count: Count;

    /// Returns the number nearest to a signed count.
    fn from_count(count: Self::Count) -> Self;

    /// Labels a value of the tick with its name in the formulas and its channel (from 1, or 0 for none). The label is
    /// for readers of the operation trace. It costs nothing.
    #[inline(always)]
    #[must_use]
    fn called(self, name: &'static str, channel: usize) -> Self {
        let _ = (name, channel);
        self
    }

    /// Labels the following operations with this encoder or channel, from 1, at no cost. It separates the iterations of
    /// a loop.
    #[inline(always)]
    fn channel(channel: usize) {
        let _ = channel;
    }

    /// Marks the start of a group of equations, at no cost.
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

/// Scalar `f32` or `f64`. The trait is sealed: bit-identical results are stated for these two types.
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
    /// The number 0.
    const ZERO: Self;
    /// The number 1/2: the weight of both ends of a tick in its mean.
    const HALF: Self;
    /// Number of 32-bit words that a number takes.
    const WORDS: usize;
    /// Returns the bits, low word first. The second word is 0 for a one-word number.
    fn to_words(self) -> [u32; 2];
    /// Returns the number with these bits.
    fn from_words(words: [u32; 2]) -> Self;
    /// Returns the value of this precision nearest to an f64.
    fn from_f64(value: f64) -> Self;
    /// Converts to f64. The conversion is exact for `f32` and the identity for `f64`.
    fn to_f64(self) -> f64;
    /// Returns |self|.
    #[must_use]
    fn abs(self) -> Self;

    /// Clamps self to [min, max] by two compare-and-selects. It takes constant time, without the library call of
    /// `f32::max` on thumb. A NaN stays a NaN, so that the guard of the tick detects it. The switching term is clamped
    /// before the guard, and u after it.
    #[inline(always)]
    #[must_use]
    fn limited(self, min: Self, max: Self) -> Self {
        let below = if self > max { max } else { self };
        if below < min { min } else { below }
    }

    /// Returns the smaller of self and `most` by one compare-and-select, without a second code path. A NaN stays a NaN.
    #[inline(always)]
    #[must_use]
    fn at_most(self, most: Self) -> Self {
        if self > most { most } else { self }
    }

    /// Returns `yes` if self is below the bound, else `no`, by one compare-and-select.
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

/// Rounds every entry to the nearest f32.
pub(crate) const fn row_f32<const L: usize>(row: &[f64; L]) -> [f32; L] {
    let mut out = [0.0; L];
    let mut i = 0;
    while i < L {
        out[i] = row[i] as f32;
        i += 1;
    }
    out
}
