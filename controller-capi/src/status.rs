//! Status of a call: 0 for success, above 0 for success with a remark, below 0 for a rejected call that wrote nothing.
//!
//! `edo_smc.h` lists the numbers. A number never changes; a new status gets a new number.

use controller_core::{Cause, RetuneError};

/// Status of a call, `edo_smc_status_t`.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(transparent)]
pub struct Status(i32);

impl Status {
    pub(crate) const OK: Self = Self(0);
    /// The sample was not finite, or its demand was too large: the fallback is the output.
    pub(crate) const REJECTED: Self = Self(1);
    /// The goal of a profile is beyond the range and was set to the end of the range.
    pub(crate) const PROFILE_END: Self = Self(2);
    pub(crate) const NULL: Self = Self(-1);
    pub(crate) const MISALIGNED: Self = Self(-2);
    pub(crate) const SIZE: Self = Self(-3);
    pub(crate) const VERSION: Self = Self(-4);
    pub(crate) const INSTANCE: Self = Self(-5);
    pub(crate) const NOT_FINITE: Self = Self(-6);
    /// No design has these coefficients.
    pub(crate) const COEFFICIENTS: Self = Self(-7);
    pub(crate) const OVERLAP: Self = Self(-8);
    /// `init` of this instance did not make the state.
    pub(crate) const NOT_INITIALISED: Self = Self(-9);
    /// The state belongs to another design.
    pub(crate) const OTHER_DESIGN: Self = Self(-10);
    /// The state was overwritten.
    pub(crate) const DAMAGED: Self = Self(-11);
    /// There was no valid sample yet.
    pub(crate) const NOT_STARTED: Self = Self(-12);
    /// The duration of a plan is not 1 to 2^24 ticks.
    pub(crate) const TICKS: Self = Self(-17);
    /// The period of a sine is not more than two and at most 2^32 ticks.
    pub(crate) const FREQUENCY: Self = Self(-18);
    /// The lower end of a profile's range is above the upper end.
    pub(crate) const PROFILE_RANGE: Self = Self(-19);
    /// The fallback is neither of the two values.
    pub(crate) const FALLBACK: Self = Self(-20);
    /// A number of a drive is outside of its range; the refusal contains its name.
    pub(crate) const OUT_OF_RANGE: Self = Self(-41);
    /// The speed exceeds a quarter of a revolution per tick.
    pub(crate) const PROFILE_SPEED: Self = Self(-42);

    /// Returns the status for a design that cannot be switched in.
    pub(crate) const fn of_retune(error: RetuneError) -> Self {
        Self(match error {
            RetuneError::Sample => -13,
            RetuneError::GainNearDecay => -14,
            RetuneError::OffsetOutOfRange => -15,
            RetuneError::OtherEncoder => -16,
            _ => -40,
        })
    }

    /// Returns the status for a rejected configuration.
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

/// Returns whether the pointer is neither NULL nor misaligned. An address of 0 is NULL.
#[inline(always)]
pub(crate) fn is_place<P>(pointer: *const P) -> bool {
    !pointer.is_null() && pointer.is_aligned()
}

/// Checks a pointer.
///
/// # Errors
/// The pointer is NULL or misaligned.
pub(crate) fn place<P>(pointer: *const P) -> Result<(), Status> {
    if pointer.is_null() {
        Err(Status::NULL)
    } else if pointer.is_aligned() {
        Ok(())
    } else {
        Err(Status::MISALIGNED)
    }
}

/// Checks a pointer and the size that the caller gives.
///
/// # Errors
/// The pointer is NULL or misaligned, or the size differs from the size of the type.
pub(crate) fn sized_place<P>(pointer: *const P, size: usize) -> Result<(), Status> {
    if size == size_of::<P>() {
        place(pointer)
    } else {
        Err(if pointer.is_null() { Status::NULL } else { Status::SIZE })
    }
}

/// Returns whether two objects share a byte.
pub(crate) fn overlap<P, Q>(one: *const P, other: *const Q) -> bool {
    let (one, other) = (one.addr(), other.addr());
    if one <= other { other - one < size_of::<P>() } else { one - other < size_of::<Q>() }
}

/// Converts a result to a status.
pub(crate) fn answer(result: Result<(), Status>) -> Status {
    match result {
        Ok(()) => Status::OK,
        Err(status) => status,
    }
}
