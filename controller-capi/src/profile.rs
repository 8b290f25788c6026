//! Set-points that come at any time: what C holds of a profile, how it is made, and its target of every tick.
//!
//! All arithmetic is that of [`Profile`]. A tag stands before it, as before a state, and the period, so that limits
//! that change in motion are counted in the ticks of the first ones.

use controller_core::drive::{FARTHEST_RAD, Profile, ProfileLimits, Target};

use crate::drive::{CRefusal, CTarget, tell};
use crate::instance::waiting;
use crate::status::{Status, answer, overlap, place, sized_place};

/// Ticks of each average that a profile of the archive has memory for: `EDO_SMC_PROFILE_WINDOW`.
pub(crate) const WINDOW: usize = 128;

/// A profile of M averages with its steps: `edo_smc_profile_*_t`. Any bit pattern is one; what is used as a divisor or
/// an index is looked at.
#[repr(C)]
pub struct CProfile<const M: usize, const LEN: usize> {
    tag: u32,
    /// Bits of the period in s, the lower ones first: a number of 64 bits would have another alignment.
    period: [u32; 2],
    profile: Profile<f32, M, LEN>,
}

impl<const M: usize, const LEN: usize> CProfile<M, LEN> {
    /// Words of a profile.
    pub(crate) const WORDS: usize = {
        assert!(align_of::<Self>() == 4 && size_of::<Self>() == 12 + size_of::<Profile<f32, M, LEN>>());
        size_of::<Self>() / 4
    };
    /// The 2 tells it from a chain and a drive.
    const TAG: u32 = waiting(u32::from_le_bytes([M as u8, 0, 0, 2]));

    fn period_s(&self) -> f64 {
        f64::from_bits(u64::from(self.period[1]) << 32 | u64::from(self.period[0]))
    }

    /// Has `new` of this version made it, and can it be used?
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

/// # Safety
/// A pointer that is not NULL points to memory of its type, which nobody else uses for as long as the answer lives.
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

/// A place for a refusal, which may be NULL, apart from the profile.
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

/// At rest at angle 0.
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

/// Other limits, in motion too.
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
    // SAFETY: as the caller promises.
    let held = match unsafe { held(profile) } {
        Ok(held) => held,
        Err(status) => return status,
    };
    // The window stays.
    let limits = ProfileLimits { speed_rad_s, acceleration_rad_s2, window: 1 };
    let (period_s, profile) = (held.period_s(), &mut held.profile);
    // SAFETY: NULL, or aligned.
    unsafe { tell(refusal, profile.limit(&limits, period_s)) }
}

fn are_near(angles_rad: &[f64]) -> Result<(), Status> {
    if angles_rad.iter().all(|rad| rad.abs() <= FARTHEST_RAD) { Ok(()) } else { Err(Status::NOT_FINITE) }
}

/// Keeps goals between two angles.
///
/// # Safety
/// A pointer that is not NULL points to memory of its type.
pub(crate) unsafe fn keep_within<const M: usize, const LEN: usize>(
    profile: *mut CProfile<M, LEN>,
    low: (i32, f64),
    high: (i32, f64),
) -> Status {
    let kept = || {
        // SAFETY: as the caller promises.
        let held = unsafe { held(profile) }?;
        are_near(&[low.1, high.1])?;
        if held.profile.keep_within(low, high) { Ok(()) } else { Err(Status::PROFILE_RANGE) }
    };
    answer(kept())
}

/// To an angle, from where it is.
///
/// # Safety
/// A pointer that is not NULL points to memory of its type.
pub(crate) unsafe fn go_to<const M: usize, const LEN: usize>(
    profile: *mut CProfile<M, LEN>,
    turn: i32,
    rad: f64,
) -> Status {
    let goes = || {
        // SAFETY: as the caller promises.
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

/// To rest as soon as it may.
///
/// # Safety
/// A pointer that is not NULL points to memory of its type.
pub(crate) unsafe fn stop<const M: usize, const LEN: usize>(profile: *mut CProfile<M, LEN>) -> Status {
    // SAFETY: as the caller promises.
    answer(unsafe { held(profile) }.map(|held| held.profile.stop()))
}

/// Anew at an angle with a speed, and to rest from there.
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
        // SAFETY: as the caller promises.
        let held = unsafe { held(profile) }?;
        are_near(&[rad, speed_rad_s])?;
        if held.profile.start(turn, rad, speed_rad_s) { Ok(()) } else { Err(Status::PROFILE_SPEED) }
    };
    answer(started())
}

/// Is it at rest at its goal? What is no profile is not.
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

/// The target at the end of the next tick.
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
    // SAFETY: as the caller promises.
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
