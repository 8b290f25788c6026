//! Running controller: a design, its state, and its initial guess, as one value.
//!
//! A [`ControlLaw`] is a design and never changes. [`Running`] ticks a design. The first valid sample starts it, and
//! until then the fallback is the output. A [`Running`] can lie in a `static`, and a design behind a reference stays in
//! flash.
//!
//! # Two views of the state
//! * [`words`](Running::words) returns the state snapshot (32-bit words) with the hash of the design. A restored
//!   snapshot continues bit for bit, under the same design only.
//! * [`estimates`](Running::estimates) returns physical units, which do not depend on the design. From them
//!   [`retune`](Running::retune) switches to another design in motion (bumpless transfer).
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

/// Designed controller that can run: the computation of a tick, separate from its state.
pub trait ControlLaw {
    /// Precision of the numbers.
    type Scalar: Real;
    /// Input of one tick.
    type Sample;
    /// Output of one tick.
    type Output;
    /// State between two ticks.
    type State: Clone + Words;
    /// Initial guess of the disturbances before the first tick.
    type Guess: Clone + Words;
    /// Estimates of the disturbances, in physical units.
    type Estimates;

    /// Initial guess for unknown disturbances.
    const NO_GUESS: Self::Guess;

    /// Returns the state before the first tick, with a guess of the disturbances. `None` if the sample is not valid for
    /// a start.
    fn start_from(&self, sample: &Self::Sample, guess: &Self::Guess) -> Option<Self::State>;

    /// Returns the state before the first tick, without a guess of the disturbances.
    #[inline]
    fn start(&self, sample: &Self::Sample) -> Option<Self::State> {
        self.start_from(sample, &Self::NO_GUESS)
    }

    /// Returns the output before the first valid sample.
    fn not_started(&self) -> Self::Output;

    /// Makes a state that has just [started](Self::start) wait until its samples are consistent, if the controller has
    /// such a wait.
    #[inline]
    fn wait(&self, state: &mut Self::State) {
        let _ = state;
    }

    /// Computes one tick: a sample in, an output out.
    fn tick(&self, state: &mut Self::State, sample: &Self::Sample) -> Self::Output;

    /// Computes one tick without a sample, as [`tick`](Self::tick) does for a sample that it rejects.
    fn lost(&self, state: &mut Self::State) -> Self::Output;

    /// Reports that `periods` periods have passed without a tick while u was held. An overflow flag or a time stamp
    /// detects such a missed timer interrupt.
    ///
    /// Call it before the coming tick. A controller without a plant model has nothing to do.
    #[inline]
    fn missed(&self, state: &mut Self::State, periods: u32) {
        let _ = (state, periods);
    }

    /// Reports the u that the actuator holds since the last tick, if it differs from the output. Returns `false` if the
    /// value was rejected.
    fn report_applied(state: &mut Self::State, u: Self::Scalar) -> bool;

    /// Sets the largest |u| of the power stage from now on. Returns `false` if the controller has no such input, or
    /// rejects the number.
    #[inline]
    fn limit(state: &mut Self::State, u: Self::Scalar) -> bool {
        let _ = (state, u);
        false
    }

    /// Returns the estimates at the instant of the last tick, in physical units.
    fn estimates(&self, state: &Self::State) -> Self::Estimates;

    /// Returns the state with which this design continues from the state of `from`, given the sample of the coming
    /// tick.
    ///
    /// # Errors
    /// If a bumpless transfer is not possible.
    fn take_over(&self, from: &Self, state: &Self::State, sample: &Self::Sample) -> Result<Self::State, RetuneError>;

    /// Returns a hash that distinguishes designs. The implementation documents the differences that it does not detect.
    fn fingerprint(&self) -> u32;
}

/// Implements a control law by an inner one: all functions except the start are forwarded.
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

/// Controller that starts from a guess of the disturbances. Without a guess this type is not needed, and costs nothing.
#[derive(Clone, Copy, Debug)]
pub struct Guessing<C: ControlLaw> {
    law: C,
    guess: C::Guess,
}

impl<C: ControlLaw> Guessing<C> {
    /// Returns the controller with this guess, in physical units.
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

/// Defines a design in flash as a type of its own.
///
/// A [`Running`] of it stores no address, and the compiler puts the constants of the design into the tick. For the
/// joint's drive this saves 4 bytes and about 20 cycles compared with a reference. The design can never be exchanged.
/// For [`Running::retune`], or for an attribute that places the design in a section, use a plain `static` by reference.
/// Attributes other than docs are rejected.
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

/// Value as a state snapshot of 32-bit words, exact to the bit.
pub trait Words: Sized {
    /// Returns the words of the value.
    fn words(&self) -> impl Iterator<Item = u32>;

    /// Returns the value of the next words, or `None` if there are too few or they are not valid.
    fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self>;
}

/// Returns the words of one number. A function instead of a closure is compiled once per scalar, not per configuration.
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

/// Empty snapshot.
impl Words for () {
    fn words(&self) -> impl Iterator<Item = u32> {
        core::iter::empty()
    }

    fn from_words(_: &mut impl Iterator<Item = u32>) -> Option<Self> {
        Some(())
    }
}

/// Returns the next number, or `None` if it is not finite.
pub(crate) fn next<T: Real>(words: &mut impl Iterator<Item = u32>) -> Option<T> {
    let low = words.next()?;
    let high = if T::WORDS == 2 { words.next()? } else { 0 };
    let value = T::from_words([low, high]);
    // Zero times a number that is not finite is NaN.
    (value * T::ZERO == T::ZERO).then_some(value)
}

/// Design with its state and, with [`guessing`](Self::guessing), its initial guess of the disturbances.
///
/// `D` is a design, or a reference to one: `Running<&'static Drive>` leaves the design in flash.
#[derive(Clone, Debug)]
pub struct Running<D: ControlLaw> {
    pub(crate) design: D,
    pub(crate) state: Option<D::State>,
}

impl<D: ControlLaw> Running<Guessing<D>> {
    /// Returns a controller that waits for its first valid sample and starts with this guess of the disturbances.
    ///
    /// The guess is in physical units, as in [`Options::initial_estimates`](crate::Options::initial_estimates).
    pub const fn guessing(design: D, guess: D::Guess) -> Self {
        Self::new(Guessing::new(design, guess))
    }
}

impl<D: ControlLaw> Running<D> {
    /// Returns a controller that waits for its first valid sample and starts with all estimates at 0.
    ///
    /// It ignores [`Options::initial_estimates`](crate::Options::initial_estimates). To use them, call
    /// [`guessing`](Self::guessing).
    pub const fn new(design: D) -> Self {
        Self { design, state: None }
    }

    /// Continues from a state of such a controller, under any design. Bit-identical results need the original design.
    pub const fn from_state(design: D, state: Option<D::State>) -> Self {
        Self { design, state }
    }

    /// Returns the design.
    pub const fn design(&self) -> &D {
        &self.design
    }

    /// Computes one tick. The first valid sample starts the controller.
    ///
    /// Until then the fallback is the output. If there is no u to hold, it is 0, as far as the limits allow. A drive
    /// outputs its fallback until its counts are consistent ([`Health::WAITS`](crate::Health::WAITS)).
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

    /// Starts with a trusted sample, without the wait of a drive for consistent counts. Use it in a simulation or a
    /// test.
    ///
    /// On a real encoder the first counts may be anything, for example zeros before its bus is up. Each would cause a
    /// current. Give the next tick the same sample. A started controller is not changed.
    #[inline]
    pub fn start_at_once(&mut self, sample: &D::Sample) {
        if self.state.is_none() {
            self.state = self.design.start(sample);
        }
    }

    /// Returns the state, or `None` before the start.
    pub const fn state(&self) -> Option<&D::State> {
        self.state.as_ref()
    }

    /// Replaces the state by a state of such a controller. `None` is the state before the start.
    pub fn set_state(&mut self, state: Option<D::State>) {
        self.state = state;
    }

    /// Returns true if a valid sample has started the controller.
    pub const fn is_started(&self) -> bool {
        self.state.is_some()
    }

    /// Computes one tick but never starts the controller. A start takes longer and is left to a caller with enough
    /// time. Until then the fallback is the output.
    #[inline(always)]
    pub fn go_on(&mut self, sample: &D::Sample) -> D::Output {
        match &mut self.state {
            Some(state) => self.design.tick(state, sample),
            None => self.design.not_started(),
        }
    }

    /// Computes one tick without a sample: a silent bus, a wrong checksum. A sample of NaN has the same effect.
    #[inline]
    pub fn lost(&mut self) -> D::Output {
        match &mut self.state {
            Some(state) => self.design.lost(state),
            None => self.design.not_started(),
        }
    }

    /// Reports that `periods` periods have passed without a tick while u was held. An overflow flag or a time stamp
    /// detects such a missed timer interrupt.
    ///
    /// Call it before the coming tick. Without this call a drive detects the gap from the count
    /// ([`Health::POSITION_STEPPED`](crate::Health::POSITION_STEPPED)).
    #[inline]
    pub fn missed(&mut self, periods: u32) {
        if let Some(state) = &mut self.state {
            self.design.missed(state, periods);
        }
    }

    /// Reports the u that the actuator holds since the last tick, if it differs from the output, for example after a
    /// clamp.
    ///
    /// Do not report a u that is correct but only acts later. Call it before the next tick. Returns `false` before the
    /// start, and for a value that is not finite or beyond [`INPUT_LIMIT`](crate::INPUT_LIMIT). Such a value is
    /// rejected.
    #[inline]
    pub fn report_applied(&mut self, u: D::Scalar) -> bool {
        match &mut self.state {
            Some(state) => D::report_applied(state, u),
            None => false,
        }
    }

    /// Sets the largest |u| of the power stage from now on, for a hot stage, a low supply or a full brake resistor.
    ///
    /// The controller keeps to this limit and slows down a long move accordingly. A value above the limits of the
    /// design leaves those limits in force. Returns `false` for a negative number or NaN, before the start, and for
    /// controllers without such a limit. A start erases the limit, so call this before each tick.
    #[inline]
    pub fn limit(&mut self, u: D::Scalar) -> bool {
        match &mut self.state {
            Some(state) => D::limit(state, u),
            None => false,
        }
    }

    /// Returns the estimates at the instant of the last tick, in physical units. `None` before the start.
    pub fn estimates(&self) -> Option<D::Estimates> {
        self.state.as_ref().map(|state| self.design.estimates(state))
    }

    /// Erases everything except the design and the guess. The next valid sample starts the controller again.
    pub fn reset(&mut self) {
        self.state = None;
    }

    /// Switches to another design between two ticks without a jump of u (bumpless transfer).
    ///
    /// First call [`report_applied`](Self::report_applied) if needed. Then call this function with the sample of the
    /// coming tick, and tick with the same sample. The estimates continue in physical units. The offset W is chosen so
    /// that u is unchanged, as far as the new limits allow it. W then decays with the new α, and u moves with it. If
    /// the designs differ much, W is large, and σ* has no meaning until W has decayed. Give a sample that can be
    /// trusted. Before the start, only the design changes.
    ///
    /// # Errors
    /// Returns the reason why the other design cannot take over. Nothing is changed in this case.
    pub fn retune(&mut self, other: D, sample: &D::Sample) -> Result<(), RetuneError> {
        if let Some(state) = &self.state {
            self.state = Some(other.take_over(&self.design, state, sample)?);
        }
        self.design = other;
        Ok(())
    }

    /// Returns the state snapshot as 32-bit words: hash of the design (and of the guess), start flag, state, checksum.
    pub fn words(&self) -> impl Iterator<Item = u32> {
        let head = [self.design.fingerprint(), u32::from(self.state.is_some())];
        let words = || head.into_iter().chain(self.state.iter().flat_map(Words::words));
        words().chain([hash(words())])
    }

    /// Restores a controller from a state snapshot and the design that it belongs to.
    ///
    /// # Errors
    /// If the words belong to another design, are too few or too many, or do not come from [`words`](Self::words).
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

/// Error of [`Running::from_words`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum WordsError {
    /// The words belong to another design, or to another version of this crate.
    OtherDesign {
        /// Hash of the given design.
        expected: u32,
        /// Hash in the words.
        found: u32,
    },
    /// The words are too few, too many, or changed: the checksum does not match.
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

/// Error of [`Running::retune`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RetuneError {
    /// A tick would reject the sample: try the next one.
    Sample,
    /// The offset has almost no effect on u in the new design, so it cannot be chosen to avoid a jump of u. There 1 -
    /// e^(-α T) is within a tenth of k_l T (or of 1, if that is smaller).
    GainNearDecay,
    /// No offset within ±[`INPUT_LIMIT`](crate::INPUT_LIMIT) makes the new controller return the old u.
    OffsetOutOfRange,
    /// The new design has another encoder or gear, so the accumulated count is not valid for it.
    OtherEncoder,
}

impl fmt::Display for RetuneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sample => "a tick would reject this sample: retune with the next good one",
            Self::GainNearDecay => {
                "1 - e^(-alpha T) is within a tenth of k_l T: the offset has no effect on u; change alpha or k_l"
            }
            Self::OffsetOutOfRange => {
                "no offset gives the new design the present u: change the design in smaller steps, or start it at rest"
            }
            Self::OtherEncoder => "the new design has another encoder or gear: start it as a new controller, at rest",
        })
    }
}

impl core::error::Error for RetuneError {}

/// Returns the fingerprint of a controller combined with words about the program around it. Without words it is the
/// fingerprint of the controller.
pub fn fingerprint_with(law: u32, beside: impl IntoIterator<Item = u32>) -> u32 {
    let mut beside = beside.into_iter().peekable();
    if beside.peek().is_none() { law } else { hash([law].into_iter().chain(beside)) }
}

/// Returns FNV-1a over words. It detects different designs and damage, and does not protect against deliberate changes.
pub(crate) fn hash(words: impl IntoIterator<Item = u32>) -> u32 {
    words.into_iter().fold(START, mixed)
}

/// Continues a hash over these numbers. All NaN values count as equal.
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
