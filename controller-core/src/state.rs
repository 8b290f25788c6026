//! What a controller remembers between two ticks, and the same for many plants side by side.
//!
//! A [`State`] carries the shape of its controller in its type: that of another plant, precision or set of channels
//! does not compile. What the type cannot tell, two designs of one shape, is told by the hash that goes with its
//! [words](crate::Running::words).
//!
//! # Lanes
//! [`Lanes`] is the state of L loops as a structure of arrays. [`Controller::tick_lane`](crate::Controller::tick_lane)
//! in a loop over the lanes is *the* tick, L times, so every lane has its bits; a compiler that knows vectors computes
//! several lanes at once, since in that loop each branch of the tick is a select. Keep that loop innermost, with
//! nothing but the tick in it, and its arrays apart: a copy of the lanes or of the controller beside it costs half the
//! speed.

use core::marker::PhantomData;
use core::slice;

use crate::real::Real;
use crate::running::{Words, each_word, next};

/// What a [`Controller`](crate::Controller) of these parameters remembers between two ticks. The numbers are in units
/// of its design. In memory they are the fields in this order, for callers in C.
///
/// `B` is `bool`, and an array of them in [`Lanes`].
#[repr(C)]
pub struct State<T, M, const N: usize, const R: usize, const MASK: u8, const O: usize, B = bool> {
    /// A, B, C of each observed channel.
    pub(crate) z: [[T; R]; O],
    /// P of each observed channel; without u in channel n.
    pub(crate) past: [T; O],
    /// x of each observed channel at the last tick.
    pub(crate) x_prev: [T; O],
    /// W = σ(0) e^(-αt).
    pub(crate) offset: T,
    /// What the actuator holds.
    pub(crate) held: T,
    /// b(x)/b_0 at the last tick; not used if b is constant.
    pub(crate) gain_prev: T,
    /// No last tick to compare the next sample with: after the start, and after a lost sample. A `bool`, since an
    /// `Option<State>` then needs no tag of its own: 46 cycles in an interrupt that ticks one.
    pub(crate) resuming: B,
    pub(crate) of: PhantomData<fn() -> M>,
}

/// The states of `L` loops, lane by lane.
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

// By hand: a derive would ask the model for what only its name is needed for.
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
    /// Where in a state the one byte lies that must be 0 or 1; all others may be anything. Whoever gets states from
    /// memory that others can write to looks there first.
    pub const FLAG_AT: usize = core::mem::offset_of!(Self, resuming);

    /// A place that no tick reads which resumes: the first P, or where nothing is observed b(x) of the last tick.
    #[inline(always)]
    pub(crate) fn aside(&mut self) -> &mut T {
        self.past.first_mut().unwrap_or(&mut self.gain_prev)
    }

    /// A state of nothing but these, before a tick.
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
    /// `L` times the same state, lane by lane.
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

/// The flag, then every number in the order of the fields.
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

/// The flag and the numbers of these slices as words. Made once for each scalar, not for each shape.
fn words_of<T: Real>(flag: bool, parts: [&[T]; 6]) -> impl Iterator<Item = u32> {
    let numbers = parts.into_iter().flatten();
    [u32::from(flag)].into_iter().chain(numbers.flat_map(each_word))
}

/// Fills the slices with the numbers of the next words.
fn fill<T: Real>(parts: [&mut [T]; 6], words: &mut impl Iterator<Item = u32>) -> Option<()> {
    for number in parts.into_iter().flatten() {
        *number = next(words)?;
    }
    Some(())
}

impl<T: Copy, M, const N: usize, const R: usize, const MASK: u8, const O: usize, const L: usize>
    Lanes<T, M, N, R, MASK, O, L>
{
    /// The state in lane `l`, from 0.
    ///
    /// # Panics
    /// If there is no such lane.
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

    /// Puts a state into lane `l`, from 0.
    ///
    /// # Panics
    /// If there is no such lane.
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
