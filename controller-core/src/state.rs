//! Controller state between two ticks, for one plant and for a vectorised batch (SIMD).
//!
//! A [`State`] has the controller configuration in its type. The state of another plant order, precision or set of
//! channels does not compile. Two designs of one configuration share the type. The hash in the state snapshot
//! ([`words`](crate::Running::words)) distinguishes them.
//!
//! # Lanes
//! [`Lanes`] is the state of L loops as a structure of arrays. In a loop over the lanes,
//! [`Controller::tick_lane`](crate::Controller::tick_lane) computes the scalar tick L times, so every lane has the bits
//! of the scalar tick. Each branch of the tick becomes a select in that loop, so a vectorising compiler computes
//! several lanes at once. Keep the loop innermost, with only the tick in it, and keep its arrays separate. A copy of
//! the lanes or of the controller next to the loop halves the speed.

use core::marker::PhantomData;
use core::slice;

use crate::real::Real;
use crate::running::{Words, each_word, next};

/// State of a [`Controller`](crate::Controller) between two ticks.
///
/// The numbers are in units of the design. For callers in C, the fields lie in memory in this order. `B` is `bool`, or
/// an array of `bool` in [`Lanes`].
#[repr(C)]
pub struct State<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize, B = bool> {
    /// Observer states A, B, C of each observed channel.
    pub(crate) z: [[T; R]; O],
    /// Prediction P of each observed channel, without u in channel n.
    pub(crate) past: [T; O],
    /// State x of each observed channel at the last tick.
    pub(crate) x_prev: [T; O],
    /// Offset W = σ(0) e^(-αt).
    pub(crate) offset: T,
    /// Input u that the actuator holds.
    pub(crate) held: T,
    /// Ratio b(x)/b_0 at the last tick. Not used if b is constant.
    pub(crate) gain_prev: T,
    /// True after the start and after a lost sample: the next sample has no last tick to be compared with. A `bool`
    /// lets `Option<State>` do without its own tag, which costs 46 cycles in an interrupt that ticks one.
    pub(crate) resuming: B,
    pub(crate) of: PhantomData<fn() -> M>,
}

/// States of `L` loops, lane by lane.
///
/// ```
/// use controller_core::*;
/// # const NOMINAL: Nominal<2> = Nominal { gradient: [0.0, -1.0], input_gain: 2.0 };
/// # const GAINS: ObserverGains<1> = ObserverGains::from_bandwidth::<1>(30.0);
/// type Motor = controller!(f32, Linear<f32, 2>, order 2, observers of order 1 in [2]);
/// # const CONFIG: Config<2, 1> = Config {
/// #     period_s: 1e-3,
/// #     surface: Surface::from_bandwidth(10.0, 5.0),
/// #     observers: [None, Some(GAINS)],
/// #     reaching: ReachingLaw { k_l: 50.0, k_s: 0.0, epsilon: 0.01 },
/// #     nominal: NOMINAL,
/// #     options: Options::NEUTRAL,
/// # };
/// let controller = Motor::linear(&CONFIG);
/// let x = [[0.1, 0.0]; 8];
/// let state = controller.start(&x[0]).expect("a finite sample");
/// let mut lanes = state.lanes::<8>();
/// let mut u = [0.0; 8];
/// for l in 0..8 {
///     u[l] = controller.tick_lane(&mut lanes, l, &x[l]).u;
/// }
/// assert_eq!(u, [u[0]; 8]);
/// ```
pub type Lanes<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize, const L: usize> =
    State<[T; L], M, N, R, MASK, O, [bool; L]>;

// Written by hand: a derive would require bounds on the model, which is only a type name here.
impl<T: Copy, M, const N: usize, const R: usize, const MASK: u8, const O: usize, B: Copy> Clone
    for State<T, M, N, R, MASK, O, B>
{
    #[inline]
    fn clone(&self) -> Self {
        Self { ..*self }
    }
}

impl<T: PartialEq, M, const N: usize, const R: usize, const MASK: u8, const O: usize, B: PartialEq> PartialEq
    for State<T, M, N, R, MASK, O, B>
{
    fn eq(&self, other: &Self) -> bool {
        self.z == other.z
            && self.past == other.past
            && self.x_prev == other.x_prev
            && self.offset == other.offset
            && self.held == other.held
            && self.gain_prev == other.gain_prev
            && self.resuming == other.resuming
    }
}

impl<T: core::fmt::Debug, M, const N: usize, const R: usize, const MASK: u8, const O: usize, B: core::fmt::Debug>
    core::fmt::Debug for State<T, M, N, R, MASK, O, B>
{
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("State")
            .field("z", &self.z)
            .field("past", &self.past)
            .field("x_prev", &self.x_prev)
            .field("offset", &self.offset)
            .field("held", &self.held)
            .field("gain_prev", &self.gain_prev)
            .field("resuming", &self.resuming)
            .finish()
    }
}

impl<T: Real, M, const N: usize, const R: usize, const MASK: u8, const O: usize> State<T, M, N, R, MASK, O> {
    /// Byte offset of the one byte in a state that must be 0 or 1. All other bytes may have any value. Check this byte
    /// of any state from memory that other code can write.
    pub const FLAG_AT: usize = core::mem::offset_of!(Self, resuming);

    /// Returns a number that no resuming tick reads: the first P, or the last b(x) ratio if no channel is observed.
    #[inline(always)]
    pub(crate) fn aside(&mut self) -> &mut T {
        self.past.first_mut().unwrap_or(&mut self.gain_prev)
    }

    /// Returns the state before a tick with these numbers. All other numbers are 0.
    pub(crate) const fn resuming(z: [[T; R]; O], offset: T, held: T) -> Self {
        Self {
            z,
            past: [T::ZERO; O],
            x_prev: [T::ZERO; O],
            offset,
            held,
            gain_prev: T::ZERO,
            resuming: true,
            of: PhantomData,
        }
    }
}

impl<T: Copy, M, const N: usize, const R: usize, const MASK: u8, const O: usize> State<T, M, N, R, MASK, O> {
    /// Copies the state into `L` lanes.
    pub fn lanes<const L: usize>(&self) -> Lanes<T, M, N, R, MASK, O, L> {
        State {
            z: self.z.map(|channel| channel.map(|value| [value; L])),
            past: self.past.map(|value| [value; L]),
            x_prev: self.x_prev.map(|value| [value; L]),
            offset: [self.offset; L],
            held: [self.held; L],
            gain_prev: [self.gain_prev; L],
            resuming: [self.resuming; L],
            of: PhantomData,
        }
    }
}

/// State snapshot: the flag, then every number in the order of the fields.
impl<T: Real, M, const N: usize, const R: usize, const MASK: u8, const O: usize> Words for State<T, M, N, R, MASK, O> {
    fn words(&self) -> impl Iterator<Item = u32> {
        let Self { z, past, x_prev, offset, held, gain_prev, resuming, of: _ } = self;
        let one = slice::from_ref;
        words_of(*resuming, [z.as_flattened(), past, x_prev, one(offset), one(held), one(gain_prev)])
    }

    fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self> {
        let resuming = match words.next()? {
            0 => false,
            1 => true,
            _ => return None,
        };
        let mut state = Self { resuming, ..Self::resuming([[T::ZERO; R]; O], T::ZERO, T::ZERO) };
        let Self { z, past, x_prev, offset, held, gain_prev, .. } = &mut state;
        let one = slice::from_mut;
        fill([z.as_flattened_mut(), past, x_prev, one(offset), one(held), one(gain_prev)], words)?;
        Some(state)
    }
}

/// Returns the flag and the numbers of these slices as words. Compiled once per scalar, not per configuration.
fn words_of<T: Real>(flag: bool, parts: [&[T]; 6]) -> impl Iterator<Item = u32> {
    let numbers = parts.into_iter().flatten();
    [u32::from(flag)].into_iter().chain(numbers.flat_map(each_word))
}

/// Fills the slices with the numbers of the next words. Returns `None` if there are too few.
fn fill<T: Real>(parts: [&mut [T]; 6], words: &mut impl Iterator<Item = u32>) -> Option<()> {
    for number in parts.into_iter().flatten() {
        *number = next(words)?;
    }
    Some(())
}

impl<T: Copy, M, const N: usize, const R: usize, const MASK: u8, const O: usize, const L: usize>
    Lanes<T, M, N, R, MASK, O, L>
{
    /// Returns the state in lane `l`, from 0.
    ///
    /// # Panics
    /// If `l >= L`.
    #[inline(always)]
    pub fn lane(&self, l: usize) -> State<T, M, N, R, MASK, O> {
        State {
            z: core::array::from_fn(|s| core::array::from_fn(|m| self.z[s][m][l])),
            past: core::array::from_fn(|s| self.past[s][l]),
            x_prev: core::array::from_fn(|s| self.x_prev[s][l]),
            offset: self.offset[l],
            held: self.held[l],
            gain_prev: self.gain_prev[l],
            resuming: self.resuming[l],
            of: PhantomData,
        }
    }

    /// Stores a state in lane `l`, from 0.
    ///
    /// # Panics
    /// If `l >= L`.
    #[inline(always)]
    pub fn set(&mut self, l: usize, state: &State<T, M, N, R, MASK, O>) {
        for s in 0..O {
            for m in 0..R {
                self.z[s][m][l] = state.z[s][m];
            }
            self.past[s][l] = state.past[s];
            self.x_prev[s][l] = state.x_prev[s];
        }
        self.offset[l] = state.offset;
        self.held[l] = state.held;
        self.gain_prev[l] = state.gain_prev;
        self.resuming[l] = state.resuming;
    }
}
