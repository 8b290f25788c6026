//! Profiles for C, for set-points at arbitrary times: their type, their construction, and the target of every tick.
//!
//! [`Profile`] contains all arithmetic. A tag precedes it, as in a state, and the period, so that new limits in motion
//! use the period of the first ones.

use controller_core::drive::{FARTHEST_RAD, Profile, ProfileLimits, Target};

use crate::drive::{CRefusal, CTarget, tell};
use crate::instance::waiting;
use crate::status::{Status, answer, overlap, place, sized_place};

/// Largest window of an average in ticks, `EDO_SMC_PROFILE_WINDOW`.
pub(crate) const WINDOW: usize = 128;

/// Profile of M averages, `edo_smc_profile_*_t`. Every bit pattern is valid; divisors and indices are checked before
/// use.
#[repr(C)]
pub struct CProfile<const M: usize, const LEN: usize> {
    tag: u32,
    /// Bits of the period in s, the lower word first: an f64 would have another alignment.
    period: [u32; 2],
    profile: Profile<f32, M, LEN>,
}

impl<const M: usize, const LEN: usize> CProfile<M, LEN> {
    /// Number of words of a profile.
    pub(crate) const WORDS: usize = {
        assert!(align_of::<Self>() == 4 && size_of::<Self>() == 12 + size_of::<Profile<f32, M, LEN>>());
        size_of::<Self>() / 4
    };
    /// Tag of a profile. The 2 distinguishes it from a chain and a drive.
    const TAG: u32 = waiting(u32::from_le_bytes([M as u8, 0, 0, 2]));

    fn period_s(&self) -> f64 {
        f64::from_bits(u64::from(self.period[1]) << 32 | u64::from(self.period[0]))
    }

    /// Checks that `new` of this version made the profile, and that its divisors and indices are valid.
    #[inline(always)]
    fn check(&self) -> Result<(), Status> {
        if self.tag != Self::TAG {
            Err(Status::NOT_INITIALISED)
        } else if self.profile.is_sound() {
            Ok(())
        } else {
            Err(Status::DAMAGED)
        }
    }
}

/// Returns the profile after a check.
///
/// # Safety
/// A pointer that is not NULL points to memory of its type, without another user during the lifetime of the result.
#[inline(always)]
unsafe fn held<'a, const M: usize, const LEN: usize>(
    profile: *mut CProfile<M, LEN>,
) -> Result<&'a mut CProfile<M, LEN>, Status> {
    place(profile)?;
    // SAFETY: not NULL, aligned; any bit pattern is a profile.
    let held = unsafe { &mut *profile };
    held.check()?;
    Ok(held)
}

/// Checks that `refusal` is NULL, or aligned and outside of the profile.
fn apart<const M: usize, const LEN: usize>(
    profile: *mut CProfile<M, LEN>,
    refusal: *mut CRefusal,
) -> Result<(), Status> {
    if refusal.is_null() {
        return Ok(());
    }
    place(refusal)?;
    if overlap(refusal, profile) { Err(Status::OVERLAP) } else { Ok(()) }
}

/// Makes a profile at rest at angle 0.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type, `profile` to memory of the size given.
pub(crate) unsafe fn new<const M: usize, const LEN: usize>(
    profile: *mut CProfile<M, LEN>,
    profile_size: usize,
    limits: &ProfileLimits,
    period_s: f64,
    refusal: *mut CRefusal,
) -> Status {
    if let Err(status) = sized_place(profile, profile_size).and_then(|()| apart(profile, refusal)) {
        return status;
    }
    let made = Profile::new(limits, period_s).map(|made| {
        let period = period_s.to_bits();
        let held =
            CProfile { tag: CProfile::<M, LEN>::TAG, period: [period as u32, (period >> 32) as u32], profile: made };
        // SAFETY: not NULL, aligned, of the right size.
        unsafe { profile.write(held) };
    });
    // SAFETY: NULL, or aligned.
    unsafe { tell(refusal, made) }
}

/// Sets the limits, also in motion.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
pub(crate) unsafe fn limit<const M: usize, const LEN: usize>(
    profile: *mut CProfile<M, LEN>,
    [speed_rad_s, acceleration_rad_s2]: [f64; 2],
    refusal: *mut CRefusal,
) -> Status {
    if let Err(status) = place(profile).and_then(|()| apart(profile, refusal)) {
        return status;
    }
    // SAFETY: guaranteed by the caller.
    let held = match unsafe { held(profile) } {
        Ok(held) => held,
        Err(status) => return status,
    };
    // The window does not change.
    let limits = ProfileLimits { speed_rad_s, acceleration_rad_s2, window: 1 };
    let (period_s, profile) = (held.period_s(), &mut held.profile);
    // SAFETY: NULL, or aligned.
    unsafe { tell(refusal, profile.limit(&limits, period_s)) }
}

fn are_near(angles_rad: &[f64]) -> Result<(), Status> {
    if angles_rad.iter().all(|rad| rad.abs() <= FARTHEST_RAD) { Ok(()) } else { Err(Status::NOT_FINITE) }
}

/// Limits all goals to the range between two angles.
///
/// # Safety
/// A pointer that is not NULL points to memory of its type.
pub(crate) unsafe fn keep_within<const M: usize, const LEN: usize>(
    profile: *mut CProfile<M, LEN>,
    low: (i32, f64),
    high: (i32, f64),
) -> Status {
    let kept = || {
        // SAFETY: guaranteed by the caller.
        let held = unsafe { held(profile) }?;
        are_near(&[low.1, high.1])?;
        if held.profile.keep_within(low, high) { Ok(()) } else { Err(Status::PROFILE_RANGE) }
    };
    answer(kept())
}

/// Sets the goal.
///
/// # Safety
/// A pointer that is not NULL points to memory of its type.
pub(crate) unsafe fn go_to<const M: usize, const LEN: usize>(
    profile: *mut CProfile<M, LEN>,
    turn: i32,
    rad: f64,
) -> Status {
    let goes = || {
        // SAFETY: guaranteed by the caller.
        let held = unsafe { held(profile) }?;
        are_near(&[rad])?;
        Ok(held.profile.go_to(turn, rad))
    };
    match goes() {
        Ok(true) => Status::OK,
        Ok(false) => Status::PROFILE_END,
        Err(status) => status,
    }
}

/// Stops as soon as the acceleration permits.
///
/// # Safety
/// A pointer that is not NULL points to memory of its type.
pub(crate) unsafe fn stop<const M: usize, const LEN: usize>(profile: *mut CProfile<M, LEN>) -> Status {
    // SAFETY: guaranteed by the caller.
    answer(unsafe { held(profile) }.map(|held| held.profile.stop()))
}

/// Restarts at an angle with a speed, and brakes to rest.
///
/// # Safety
/// A pointer that is not NULL points to memory of its type.
pub(crate) unsafe fn start<const M: usize, const LEN: usize>(
    profile: *mut CProfile<M, LEN>,
    turn: i32,
    rad: f64,
    speed_rad_s: f64,
) -> Status {
    let started = || {
        // SAFETY: guaranteed by the caller.
        let held = unsafe { held(profile) }?;
        are_near(&[rad, speed_rad_s])?;
        if held.profile.start(turn, rad, speed_rad_s) { Ok(()) } else { Err(Status::PROFILE_SPEED) }
    };
    answer(started())
}

/// Returns whether the path rests at its goal; false for memory without a profile.
///
/// # Safety
/// A pointer that is not NULL points to memory of its type.
pub(crate) unsafe fn has_arrived<const M: usize, const LEN: usize>(profile: *const CProfile<M, LEN>) -> bool {
    if place(profile).is_err() {
        return false;
    }
    // SAFETY: not NULL, aligned; any bit pattern is a profile.
    let held = unsafe { &*profile };
    held.check().is_ok() && held.profile.has_arrived()
}

/// Writes the target at the end of the next tick.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
#[inline(always)]
pub(crate) unsafe fn next<const M: usize, const LEN: usize, const N: usize>(
    profile: *mut CProfile<M, LEN>,
    target: *mut CTarget<N>,
) -> Status {
    if let Err(status) = place(profile).and_then(|()| place(target)) {
        return status;
    }
    if overlap(profile, target) {
        return Status::OVERLAP;
    }
    // SAFETY: guaranteed by the caller.
    match unsafe { held(profile) } {
        Ok(held) => {
            let Target { turn, jet } = held.profile.next_tick();
            // SAFETY: not NULL, aligned.
            unsafe { target.write(CTarget { turn, jet }) };
            Status::OK
        }
        Err(status) => status,
    }
}
