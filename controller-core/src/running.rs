//! A running controller: a design, what it remembers, and the guess it starts from, as one value.
//!
//! A [`ControlLaw`] is a design and never changes. [`Running`] ticks one: the first good sample starts it, until then
//! the fallback goes out. It lies in a `static` as it stands; the design behind a reference stays in flash.
//!
//! # Its two views
//! * [`words`](Running::words) are exact bits, with the hash of the design: what is stored and brought back ticks on as
//!   if nothing had happened, under the same design and no other.
//! * [`estimates`](Running::estimates) are in physical units and mean the same under any design: with them
//!   [`retune`](Running::retune) takes another design over in full motion.
//!
//! ```
//! use controller_core::*;
//!
//! type Motor = controller!(f32, Linear<f32, 2>, order 2, observers of order 1 in [2]);
//! const NOMINAL: Nominal<2> = Nominal { gradient: [0.0, -1.0], input_gain: 250.0 };
//! const fn motor(bandwidth_rad_s: f64) -> Motor {
//!     let config = Config {
//!         period_s: 1e-3,
//!         surface: Surface::from_bandwidth(bandwidth_rad_s, 5.0),
//!         observers: [None, Some(ObserverGains::from_bandwidth::<1>(60.0))],
//!         reaching: ReachingLaw { k_l: 80.0, k_s: 0.0, epsilon: 0.01 },
//!         nominal: NOMINAL,
//!         options: Options::NEUTRAL.with_limits(Limits::symmetric(10.0)),
//!     };
//!     Motor::linear(&config)
//! }
//! static SOFT: Motor = motor(10.0);
//! static FIRM: Motor = motor(20.0);
//!
//! let mut running = Running::new(&SOFT);
//! running.tick(&[0.1, 0.0]);
//! let unchanged = running.clone().tick(&[0.0999, -0.2]).u;
//! running.retune(&FIRM, &[0.0999, -0.2]).expect("a design that can take over");
//! assert!((running.tick(&[0.0999, -0.2]).u - unchanged).abs() < 1e-5); // no jump
//!
//! let saved: Vec<u32> = running.words().collect();
//! let mut again = Running::from_words(&FIRM, saved).expect("words of this design");
//! assert_eq!(again.tick(&[0.09, -0.1]), running.tick(&[0.09, -0.1]));
//! ```

use core::fmt;

use crate::real::Real;

/// A designed law that can run: what a tick computes, apart from what it remembers.
pub trait ControlLaw {
    /// Precision of its numbers.
    type Scalar: Real;
    /// What comes in once per tick.
    type Sample;
    /// What goes out once per tick.
    type Output;
    /// What it remembers between two ticks.
    type State: Clone + Words;
    /// What it may be told of the disturbances before the first tick.
    type Guess: Clone + Words;
    /// What it knows of the disturbances, in physical units.
    type Estimates;

    /// Nothing is known of the disturbances.
    const NO_GUESS: Self::Guess;

    /// The state before the first tick, with a guess of the disturbances; `None` if the sample is not good enough to
    /// start with.
    fn start_from(&self, sample: &Self::Sample, guess: &Self::Guess) -> Option<Self::State>;

    /// The state before the first tick, with nothing known of the disturbances.
    #[inline]
    fn start(&self, sample: &Self::Sample) -> Option<Self::State> {
        self.start_from(sample, &Self::NO_GUESS)
    }

    /// What goes out as long as there has been no good sample.
    fn not_started(&self) -> Self::Output;

    /// Makes a state that has just [started](Self::start) wait until its samples agree with each other, if the law has
    /// such a wait.
    #[inline]
    fn wait(&self, state: &mut Self::State) {
        let _ = state;
    }

    /// One tick: a sample in, an output out.
    fn tick(&self, state: &mut Self::State, sample: &Self::Sample) -> Self::Output;

    /// One tick whose sample never came: what [`tick`](Self::tick) does with one that it cannot take.
    fn lost(&self, state: &mut Self::State) -> Self::Output;

    /// So many periods have passed without a tick, u held all the while: a missed timer interrupt that its overflow
    /// flag or a time stamp tells of. To be called before the coming tick. A law that keeps no model of its plant has
    /// nothing to do.
    #[inline]
    fn missed(&self, state: &mut Self::State, periods: u32) {
        let _ = (state, periods);
    }

    /// Tells what the actuator really holds since the last tick, where that is another u; `false` if the value was not
    /// taken.
    fn report_applied(state: &mut Self::State, u: Self::Scalar) -> bool;

    /// From now on the power stage gives at most this |u|; `false` if the law has no such input, or takes no such
    /// number.
    #[inline]
    fn limit(state: &mut Self::State, u: Self::Scalar) -> bool {
        let _ = (state, u);
        false
    }

    /// Estimates at the instant of the last tick, in physical units.
    fn estimates(&self, state: &Self::State) -> Self::Estimates;

    /// The state with which this design goes on where `from` stands, with the sample of the coming tick.
    ///
    /// # Errors
    /// When the change cannot be made without a jump.
    fn take_over(&self, from: &Self, state: &Self::State, sample: &Self::Sample) -> Result<Self::State, RetuneError>;

    /// A hash that tells this design from another; what it cannot tell, the law says.
    fn fingerprint(&self) -> u32;
}

/// A law that is another one within: everything but the start goes on to it.
#[doc(hidden)]
#[macro_export]
macro_rules! as_within {
    ($within:ty: $this:ident => $law:expr, $other:ident => $other_law:expr) => {
        type Scalar = <$within as $crate::ControlLaw>::Scalar;
        type Sample = <$within as $crate::ControlLaw>::Sample;
        type Output = <$within as $crate::ControlLaw>::Output;
        type State = <$within as $crate::ControlLaw>::State;
        type Guess = <$within as $crate::ControlLaw>::Guess;
        type Estimates = <$within as $crate::ControlLaw>::Estimates;
        const NO_GUESS: Self::Guess = <$within as $crate::ControlLaw>::NO_GUESS;

        #[inline]
        fn start_from(&$this, sample: &Self::Sample, guess: &Self::Guess) -> ::core::option::Option<Self::State> {
            $law.start_from(sample, guess)
        }
        #[inline]
        fn not_started(&$this) -> Self::Output {
            $law.not_started()
        }
        #[inline]
        fn wait(&$this, state: &mut Self::State) {
            $law.wait(state);
        }
        #[inline]
        fn tick(&$this, state: &mut Self::State, sample: &Self::Sample) -> Self::Output {
            $law.tick(state, sample)
        }
        #[inline]
        fn lost(&$this, state: &mut Self::State) -> Self::Output {
            $law.lost(state)
        }
        #[inline]
        fn missed(&$this, state: &mut Self::State, periods: u32) {
            $law.missed(state, periods);
        }
        #[inline]
        fn report_applied(state: &mut Self::State, u: Self::Scalar) -> bool {
            <$within as $crate::ControlLaw>::report_applied(state, u)
        }
        #[inline]
        fn limit(state: &mut Self::State, u: Self::Scalar) -> bool {
            <$within as $crate::ControlLaw>::limit(state, u)
        }
        fn estimates(&$this, state: &Self::State) -> Self::Estimates {
            $law.estimates(state)
        }
        fn take_over(
            &$this,
            $other: &Self,
            state: &Self::State,
            sample: &Self::Sample,
        ) -> ::core::result::Result<Self::State, $crate::RetuneError> {
            $law.take_over($other_law, state, sample)
        }
    };
}

impl<C: ControlLaw> ControlLaw for &C {
    as_within!(C: self => (**self), from => from);

    #[inline]
    fn start(&self, sample: &C::Sample) -> Option<C::State> {
        (**self).start(sample)
    }
    fn fingerprint(&self) -> u32 {
        (**self).fingerprint()
    }
}

/// A law that starts from a guess of the disturbances. Without a guess there is nothing to keep, and it costs nothing.
#[derive(Clone, Copy, Debug)]
pub struct Guessing<C: ControlLaw> {
    law: C,
    guess: C::Guess,
}

impl<C: ControlLaw> Guessing<C> {
    /// The law, with this guess in physical units.
    pub const fn new(law: C, guess: C::Guess) -> Self {
        Self { law, guess }
    }
}

impl<C: ControlLaw> ControlLaw for Guessing<C> {
    as_within!(C: self => self.law, from => &from.law);

    #[inline]
    fn start(&self, sample: &C::Sample) -> Option<C::State> {
        self.law.start_from(sample, &self.guess)
    }
    fn fingerprint(&self) -> u32 {
        hash([self.law.fingerprint()].into_iter().chain(self.guess.words()))
    }
}

/// A design in flash that is a type of its own, so that a [`Running`] of it keeps no address and the compiler puts the
/// constants of the design into the tick (on the joint's drive 4 bytes and some 20 cycles less than by reference). It
/// is never changed for another: where [`Running::retune`] is wanted, or an attribute that places the design in a
/// section, a plain `static` by reference is the way. Attributes other than docs are refused.
///
/// ```
/// use controller_core::*;
///
/// # const NOMINAL: Nominal<2> = Nominal { gradient: [0.0, -1.0], input_gain: 250.0 };
/// # const CONFIG: Config<2, 1> = Config {
/// #     period_s: 1e-3,
/// #     surface: Surface::from_bandwidth(20.0, 10.0),
/// #     observers: [None, Some(ObserverGains::from_bandwidth::<1>(60.0))],
/// #     reaching: ReachingLaw { k_l: 80.0, k_s: 0.0, epsilon: 0.01 },
/// #     nominal: NOMINAL,
/// #     options: Options::NEUTRAL,
/// # };
/// type Motor = controller!(f32, Linear<f32, 2>, order 2, observers of order 1 in [2]);
/// design! {
///     /// Designed by the compiler.
///     static MOTOR: Motor = Motor::linear(&CONFIG);
/// }
/// let mut running: Running<MOTOR> = Running::new(MOTOR);
/// assert_eq!(size_of_val(&running), size_of::<<Motor as ControlLaw>::State>());
/// assert_eq!(running.tick(&[0.1, 0.0]), Running::new(&*MOTOR).tick(&[0.1, 0.0]));
/// ```
#[macro_export]
macro_rules! design {
    ($(#[doc = $doc:expr])* $visibility:vis static $name:ident: $law:ty = $design:expr;) => {
        $(#[doc = $doc])*
        #[allow(non_camel_case_types)]
        #[derive(::core::clone::Clone, ::core::marker::Copy, ::core::fmt::Debug)]
        $visibility struct $name;

        impl ::core::ops::Deref for $name {
            type Target = $law;
            #[inline(always)]
            fn deref(&self) -> &$law {
                static DESIGN: $law = $design;
                &DESIGN
            }
        }

        impl $crate::ControlLaw for $name {
            $crate::as_within!($law: self => (**self), from => from);

            #[inline]
            fn start(&self, sample: &Self::Sample) -> ::core::option::Option<Self::State> {
                (**self).start(sample)
            }
            fn fingerprint(&self) -> u32 {
                (**self).fingerprint()
            }
        }
    };
}

/// A value as 32-bit words, to the bit.
pub trait Words: Sized {
    /// The value as its words.
    fn words(&self) -> impl Iterator<Item = u32>;

    /// The value of the next words; `None` if they end too soon or are of no such value.
    fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self>;
}

/// A function, no closure: iterators over words are then compiled once for each scalar, not for each shape.
pub(crate) fn each_word<T: Real>(number: &T) -> impl Iterator<Item = u32> + use<T> {
    number.to_words().into_iter().take(T::WORDS)
}

impl<T: Real, const L: usize> Words for [T; L] {
    fn words(&self) -> impl Iterator<Item = u32> {
        self.iter().flat_map(each_word)
    }

    fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self> {
        let mut row = [T::ZERO; L];
        for value in &mut row {
            *value = next(words)?;
        }
        Some(row)
    }
}

/// Nothing.
impl Words for () {
    fn words(&self) -> impl Iterator<Item = u32> {
        core::iter::empty()
    }

    fn from_words(_: &mut impl Iterator<Item = u32>) -> Option<Self> {
        Some(())
    }
}

/// The next number; `None` if it is not finite.
pub(crate) fn next<T: Real>(words: &mut impl Iterator<Item = u32>) -> Option<T> {
    let low = words.next()?;
    let high = if T::WORDS == 2 { words.next()? } else { 0 };
    let value = T::from_words([low, high]);
    // Zero times what is not finite is NaN.
    (value * T::ZERO == T::ZERO).then_some(value)
}

/// A design, what it remembers, and, with [`guessing`](Self::guessing), the guess of the disturbances it starts from.
///
/// `D` is a design, or a reference to one: `Running<&'static Drive>` leaves it in flash.
#[derive(Clone, Debug)]
pub struct Running<D: ControlLaw> {
    pub(crate) design: D,
    pub(crate) state: Option<D::State>,
}

impl<D: ControlLaw> Running<Guessing<D>> {
    /// Waits for its first good sample, and starts with this guess of the disturbances in their physical units, as
    /// [`Options::initial_estimates`](crate::Options::initial_estimates) has it.
    pub const fn guessing(design: D, guess: D::Guess) -> Self {
        Self::new(Guessing::new(design, guess))
    }
}

impl<D: ControlLaw> Running<D> {
    /// Waits for its first good sample, and starts with all estimates at 0, whatever
    /// [`Options::initial_estimates`](crate::Options::initial_estimates) says: for those take
    /// [`guessing`](Self::guessing).
    pub const fn new(design: D) -> Self {
        Self { design, state: None }
    }

    /// Goes on from a state of such a law, whatever design it was under; what is to be the same bits needs the same.
    pub const fn from_state(design: D, state: Option<D::State>) -> Self {
        Self { design, state }
    }

    /// The design that ticks.
    pub const fn design(&self) -> &D {
        &self.design
    }

    /// One tick. The first good sample starts the controller; until then the fallback goes out (0, as far as the
    /// limits allow it, if there is nothing to hold), and of a drive until its counts agree
    /// ([`Health::WAITS`](crate::Health::WAITS)).
    #[inline]
    pub fn tick(&mut self, sample: &D::Sample) -> D::Output {
        if self.state.is_none() {
            self.state = self.design.start(sample);
            if let Some(state) = &mut self.state {
                self.design.wait(state);
            }
        }
        self.go_on(sample)
    }

    /// Starts with a sample that somebody vouches for, without the wait of a drive for counts that agree: a simulation,
    /// a test. On a real encoder the first counts may be anything, zeros before its bus is up for one, and a current
    /// would follow from each. Give the next tick the same sample. Nothing happens if it has started.
    #[inline]
    pub fn start_at_once(&mut self, sample: &D::Sample) {
        if self.state.is_none() {
            self.state = self.design.start(sample);
        }
    }

    /// Has a good sample started it?
    pub const fn is_started(&self) -> bool {
        self.state.is_some()
    }

    /// The same, but for a start, which takes longer and is left to a caller that has the time: until then the fallback
    /// goes out.
    #[inline(always)]
    pub fn go_on(&mut self, sample: &D::Sample) -> D::Output {
        match &mut self.state {
            Some(state) => self.design.tick(state, sample),
            None => self.design.not_started(),
        }
    }

    /// One tick whose sample never came: a bus that is silent, a checksum that is wrong. A sample of NaN says the same.
    #[inline]
    pub fn lost(&mut self) -> D::Output {
        match &mut self.state {
            Some(state) => self.design.lost(state),
            None => self.design.not_started(),
        }
    }

    /// So many periods have passed without a tick, u held all the while: a missed timer interrupt that its overflow
    /// flag or a time stamp tells of. Call it before the coming tick. A drive that is not told finds out from the count
    /// ([`Health::POSITION_STEPPED`](crate::Health::POSITION_STEPPED)).
    #[inline]
    pub fn missed(&mut self, periods: u32) {
        if let Some(state) = &mut self.state {
            self.design.missed(state, periods);
        }
    }

    /// Tells what the actuator really holds since the last tick, where that is another u than the tick returned: one
    /// cut by a limit, say. A u that is right and only acts later is better not reported. Call it before the next tick.
    /// The answer is `false` for a value that is not finite (or beyond [`INPUT_LIMIT`](crate::INPUT_LIMIT)), which is
    /// not taken, and before the start.
    #[inline]
    pub fn report_applied(&mut self, u: D::Scalar) -> bool {
        match &mut self.state {
            Some(state) => D::report_applied(state, u),
            None => false,
        }
    }

    /// From now on the power stage gives at most this |u|: it is hot, its supply is low, its brake resistor is full.
    /// The law keeps to it and slows a far motion down by it. `u` over the limits of the design: no other limit than
    /// those. The answer is `false` for a number below 0 or NaN, before the start, and of laws without such a limit. A
    /// start forgets it, so call it before each tick.
    #[inline]
    pub fn limit(&mut self, u: D::Scalar) -> bool {
        match &mut self.state {
            Some(state) => D::limit(state, u),
            None => false,
        }
    }

    /// Estimates at the instant of the last tick, in physical units; `None` before the start.
    pub fn estimates(&self) -> Option<D::Estimates> {
        self.state.as_ref().map(|state| self.design.estimates(state))
    }

    /// Forgets all but the design and the guess: the next good sample starts again.
    pub fn reset(&mut self) {
        self.state = None;
    }

    /// Changes to another design between two ticks, without a jump of u: first
    /// [`report_applied`](Self::report_applied), if there is something to report, then this with the sample of the
    /// coming tick, then tick with the same sample. The estimates go on in their physical units, and the offset W is
    /// chosen so that u is what it would have been, as far as the new limits allow it. W decays with the new α as ever,
    /// and u moves with it: where the designs are unlike, W is large, and σ* tells nothing until it has decayed. Give a
    /// sample that can be trusted. Before the start the design is changed and no more.
    ///
    /// # Errors
    /// Why the other design cannot take over here; then nothing is changed.
    pub fn retune(&mut self, other: D, sample: &D::Sample) -> Result<(), RetuneError> {
        if let Some(state) = &self.state {
            self.state = Some(other.take_over(&self.design, state, sample)?);
        }
        self.design = other;
        Ok(())
    }

    /// All that it remembers as 32-bit words, to the bit: hash of the design (and of the guess), has it started, state,
    /// and a checksum of these.
    pub fn words(&self) -> impl Iterator<Item = u32> {
        let head = [self.design.fingerprint(), u32::from(self.state.is_some())];
        let words = || head.into_iter().chain(self.state.iter().flat_map(Words::words));
        words().chain([hash(words())])
    }

    /// What these words are, with the design that they belong to.
    ///
    /// # Errors
    /// When they belong to another design, are cut short or too many, or are none that [`words`](Self::words) gives.
    pub fn from_words(design: D, words: impl IntoIterator<Item = u32>) -> Result<Self, WordsError> {
        let (mut sum, mut words) = (START, words.into_iter());
        let state = {
            let mut summed = core::iter::from_fn(|| words.next().inspect(|&word| sum = mixed(sum, word)));
            let found = summed.next().ok_or(WordsError::Damaged)?;
            let expected = design.fingerprint();
            if found != expected {
                return Err(WordsError::OtherDesign { expected, found });
            }
            match summed.next() {
                Some(0) => None,
                Some(1) => Some(D::State::from_words(&mut summed).ok_or(WordsError::Damaged)?),
                _ => return Err(WordsError::Damaged),
            }
        };
        if words.next() == Some(sum) && words.next().is_none() {
            Ok(Self { design, state })
        } else {
            Err(WordsError::Damaged)
        }
    }
}

/// Why [`Running::from_words`] refuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum WordsError {
    /// They belong to another design (or another version of this crate).
    OtherDesign {
        /// Hash of the design given.
        expected: u32,
        /// Hash in the words.
        found: u32,
    },
    /// Too few, too many, others than were given: their checksum says so.
    Damaged,
}

impl fmt::Display for WordsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OtherDesign { expected, found } => write!(
                f,
                "the words belong to design {found:#010x}, this is {expected:#010x}: give the design that they were \
                 made with"
            ),
            Self::Damaged => {
                f.write_str("these are not the words of a running controller: take them as they were given")
            }
        }
    }
}

impl core::error::Error for WordsError {}

/// Why [`Running::retune`] refuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RetuneError {
    /// The sample is one that a tick would reject: try with the next.
    Sample,
    /// In the new design 1 - e^(-α T) lies within a tenth of k_l T (or of 1, if that is smaller): there the offset has
    /// no say in u, and cannot be chosen so that u does not jump.
    GainNearDecay,
    /// No offset, or none within ±[`INPUT_LIMIT`](crate::INPUT_LIMIT), makes the new law ask for the old u.
    OffsetOutOfRange,
    /// The new design counts by another encoder or gear: what was counted means nothing to it.
    OtherEncoder,
}

impl fmt::Display for RetuneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sample => "a tick would reject this sample: retune with the next good one",
            Self::GainNearDecay => {
                "1 - e^(-alpha T) lies within a tenth of k_l T: the offset has no say in u; move alpha or k_l"
            }
            Self::OffsetOutOfRange => {
                "no offset makes the new law ask for the old u: take a design that is nearer, or start anew with \
                 `reset`"
            }
            Self::OtherEncoder => "the new design counts by another encoder or gear: start anew with `reset`",
        })
    }
}

impl core::error::Error for RetuneError {}

/// Fingerprint of a law together with what its program does beside it, as words. Returns the law's own where there are
/// none.
pub fn fingerprint_with(law: u32, beside: impl IntoIterator<Item = u32>) -> u32 {
    let mut beside = beside.into_iter().peekable();
    if beside.peek().is_none() { law } else { hash([law].into_iter().chain(beside)) }
}

/// FNV-1a over words: tells designs apart and damage from none, and is no defence against anyone who means it.
pub(crate) fn hash(words: impl IntoIterator<Item = u32>) -> u32 {
    words.into_iter().fold(START, mixed)
}

/// Goes on with a hash over these numbers. Which NaN a number is makes no difference.
pub(crate) fn hashed<T: Real>(hash: u32, numbers: impl IntoIterator<Item = T>) -> u32 {
    numbers.into_iter().fold(hash, |hash, number| {
        let words = if number.abs() >= T::ZERO { number.to_words() } else { [u32::MAX; 2] };
        words.into_iter().fold(hash, mixed)
    })
}

const START: u32 = 0x811c_9dc5;

fn mixed(hash: u32, word: u32) -> u32 {
    word.to_le_bytes().into_iter().fold(hash, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
}
