//! What a call answers: 0 for good; above 0 it did its work with a remark; below 0 it refused and wrote nothing.
//!
//! The numbers are those of `edo_smc.h`. They never change; a new one gets a new number.

use controller_core::{Cause, RetuneError};

/// A status as C sees it.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(transparent)]
pub struct Status(i32);

impl Status {
    pub(crate) const OK: Self = Self(0);
    /// The sample was not finite, or asked for too much: the fallback goes out.
    pub(crate) const REJECTED: Self = Self(1);
    /// A goal of a profile lies beyond its range: it goes to the end.
    pub(crate) const PROFILE_END: Self = Self(2);
    pub(crate) const NULL: Self = Self(-1);
    pub(crate) const MISALIGNED: Self = Self(-2);
    pub(crate) const SIZE: Self = Self(-3);
    pub(crate) const VERSION: Self = Self(-4);
    pub(crate) const INSTANCE: Self = Self(-5);
    pub(crate) const NOT_FINITE: Self = Self(-6);
    /// The coefficients cannot come from a design.
    pub(crate) const COEFFICIENTS: Self = Self(-7);
    pub(crate) const OVERLAP: Self = Self(-8);
    /// The state was not made by `init` of this instance.
    pub(crate) const NOT_INITIALISED: Self = Self(-9);
    /// The state belongs to another design.
    pub(crate) const OTHER_DESIGN: Self = Self(-10);
    /// The state was overwritten.
    pub(crate) const DAMAGED: Self = Self(-11);
    /// No good sample yet, and so nothing to correct or to tell.
    pub(crate) const NOT_STARTED: Self = Self(-12);
    /// A plan takes 1 to 2^24 ticks.
    pub(crate) const TICKS: Self = Self(-17);
    /// A sine takes more than two ticks, and less than 2^32.
    pub(crate) const FREQUENCY: Self = Self(-18);
    /// The lower end of a profile's range lies above the upper one.
    pub(crate) const PROFILE_RANGE: Self = Self(-19);
    /// Neither of the two fallbacks.
    pub(crate) const FALLBACK: Self = Self(-20);
    /// A number of a drive; the refusal names it.
    pub(crate) const OUT_OF_RANGE: Self = Self(-41);
    /// More than a quarter of a turn per tick.
    pub(crate) const PROFILE_SPEED: Self = Self(-42);

    /// Why a design cannot take over.
    pub(crate) const fn of_retune(error: RetuneError) -> Self {
        Self(match error {
            RetuneError::Sample => -13,
            RetuneError::GainNearDecay => -14,
            RetuneError::OffsetOutOfRange => -15,
            RetuneError::OtherEncoder => -16,
            _ => -40,
        })
    }

    /// Why a configuration is refused.
    pub(crate) const fn of(cause: &Cause) -> Self {
        Self(match cause {
            Cause::NotFinite => -21,
            Cause::PeriodNotPositive { .. } => -22,
            Cause::InputGainZero => -23,
            Cause::SurfaceLead { .. } => -24,
            Cause::SurfaceNotHurwitz => -25,
            Cause::OffsetDecayNotPositive { .. } => -26,
            Cause::OffsetDecayTooSlow { .. } => -27,
            Cause::Negative => -28,
            Cause::BoundaryLayerEmpty { .. } => -29,
            Cause::LimitsTooWide { .. } => -30,
            Cause::LimitsReversed { .. } => -31,
            Cause::FallbackOutsideLimits { .. } => -32,
            Cause::ChannelMismatch { .. } => -33,
            Cause::ObserverOrder { .. } => -34,
            Cause::OrderTooLow { .. } => -35,
            Cause::ObserverNotFinite => -36,
            Cause::ObserverNotHurwitz => -37,
            Cause::ObserverTooFast { .. } => -38,
            Cause::CoefficientRange => -39,
            _ => -40,
        })
    }
}

/// Can something be read or written there? An address of 0 is NULL.
#[inline(always)]
pub(crate) fn is_place<P>(pointer: *const P) -> bool {
    !pointer.is_null() && pointer.is_aligned()
}

/// What is wrong with it, if something is.
pub(crate) fn place<P>(pointer: *const P) -> Result<(), Status> {
    if pointer.is_null() {
        Err(Status::NULL)
    } else if pointer.is_aligned() {
        Ok(())
    } else {
        Err(Status::MISALIGNED)
    }
}

/// The same where a size is given too.
pub(crate) fn sized_place<P>(pointer: *const P, size: usize) -> Result<(), Status> {
    if size == size_of::<P>() {
        place(pointer)
    } else {
        Err(if pointer.is_null() { Status::NULL } else { Status::SIZE })
    }
}

/// Do the two have a byte in common?
pub(crate) fn overlap<P, Q>(one: *const P, other: *const Q) -> bool {
    let (one, other) = (one.addr(), other.addr());
    if one <= other { other - one < size_of::<P>() } else { one - other < size_of::<Q>() }
}

/// A refusal as the status it is.
pub(crate) fn answer(result: Result<(), Status>) -> Status {
    match result {
        Ok(()) => Status::OK,
        Err(status) => status,
    }
}
