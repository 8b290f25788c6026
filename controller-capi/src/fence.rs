//! Limits of position, speed and following error for C: the types of a fence, its construction, and the check of a
//! tick.
//!
//! [`Fence`] contains all arithmetic. The fence is made from the configuration of a drive, outside of the interrupt.
//! The interrupt checks it after a tick, with the sample and the output of this tick.

use controller_core::Output;
use controller_core::drive::{Fence, FenceLimits};

use crate::drive::{CConfig, CRefusal, CSample, Design, Form, designed, tell};
use crate::instance::{CState, between};
use crate::status::{Status, overlap, place, sized_place};

/// Limits of a shaft in rad and rad/s, `edo_smc_fence_limits_t`. Infinite for no limit.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct CLimits {
    low_rad: f64,
    high_rad: f64,
    max_speed_rad_s: f64,
    following_rad: f64,
}

/// Limits in the form that a tick compares, `edo_smc_fence_t`. Every bit pattern is valid; every motion violates zeros.
#[repr(transparent)]
pub struct CFence(Fence);

/// Number of words of a fence.
pub(crate) const WORDS: usize = {
    assert!(align_of::<CFence>() == 4);
    size_of::<CFence>() / 4
};

impl CLimits {
    /// Returns the limits for the core.
    ///
    /// # Errors
    /// A limit is NaN, a speed or distance is negative, or the upper end is below the lower end.
    fn check(&self) -> Result<FenceLimits, CRefusal> {
        let Self { low_rad, high_rad, max_speed_rad_s, following_rad } = *self;
        let ranges = [
            ("low_rad", low_rad, f64::NEG_INFINITY),
            ("high_rad", high_rad, low_rad),
            ("max_speed_rad_s", max_speed_rad_s, 0.0),
            ("following_rad", following_rad, 0.0),
        ];
        for (field, given, low) in ranges {
            if !(given >= low && given <= f64::INFINITY) {
                return Err(CRefusal::of(field, given, low, f64::INFINITY));
            }
        }
        Ok(FenceLimits { low_rad, high_rad, max_speed_rad_s, following_rad })
    }
}

/// Makes the fence of a configuration. `refusal` receives the rejected number.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type, `config` and `fence` to memory of the sizes given.
pub(crate) unsafe fn fence<L: Form<E, N, NUMBERS>, const E: usize, const N: usize, const NUMBERS: usize>(
    config: *const CConfig<NUMBERS>,
    config_size: usize,
    limits: *const CLimits,
    fence: *mut CFence,
    fence_size: usize,
    refusal: *mut CRefusal,
) -> Status {
    let places = || {
        sized_place(config, config_size)?;
        place(limits)?;
        sized_place(fence, fence_size)?;
        if !refusal.is_null() {
            place(refusal)?;
        }
        let read = overlap(fence, config) || overlap(fence, limits) || overlap(refusal, config);
        if read || overlap(refusal, limits) || overlap(refusal, fence) { Err(Status::OVERLAP) } else { Ok(()) }
    };
    if let Err(status) = places() {
        return status;
    }
    // SAFETY: not NULL, aligned, of the right size; any bit pattern is a configuration, or limits.
    let (config, limits) = unsafe { (&*config, &*limits) };
    // An invalid configuration has no deceleration, so it is rejected first.
    let made = designed::<L, E, N, NUMBERS>(config).and_then(|_| limits.check()).map(|limits| {
        // SAFETY: not NULL, aligned, of the right size.
        unsafe { fence.write(CFence(Fence::new(&limits, L::slowing(config)))) };
    });
    // SAFETY: NULL, or aligned.
    unsafe { tell(refusal, made) }
}

/// Checks the estimates against the fence after a tick; a violation sets its flag and trips the drive.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
#[inline(always)]
pub(crate) unsafe fn guard<L: Form<E, N, NUMBERS>, const E: usize, const N: usize, const NUMBERS: usize>(
    design: *const Design<L, E, N, NUMBERS>,
    state: *mut CState<Design<L, E, N, NUMBERS>>,
    fence: *const CFence,
    sample: *const CSample<E, N>,
    output: *mut Output<f32>,
) -> Status {
    let places = || {
        place(state)?;
        place(fence)?;
        place(sample)?;
        place(output)?;
        let of_the_state = overlap(state, fence) || overlap(state, sample) || overlap(state, output);
        let of_the_output = overlap(output, fence) || overlap(output, sample) || overlap(output, design);
        if of_the_state || of_the_output { Err(Status::OVERLAP) } else { Ok(()) }
    };
    if let Err(status) = places() {
        return status;
    }
    // SAFETY: not NULL, aligned, without overlap; any bit pattern is valid.
    let (fence, target, output) = unsafe { (&(*fence).0, (*sample).begin.target(), &mut *output) };
    // SAFETY: guaranteed by the caller.
    unsafe { between(design, state, |law, state| law.guard(fence, state, output, &target)) }
}
