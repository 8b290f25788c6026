//! Plans of a drive: what C holds of one, how it is made, and where it is at a tick.
//!
//! A plan is a way of so many ticks onto a goal ([`Joined`]), which is rest at an angle or a sine. It is made of the
//! one that is played, in 64 bits, outside of the interrupt; the interrupt asks for targets, in f32.

use controller_core::INPUT_LIMIT;
use controller_core::drive::{FARTHEST_RAD, Joined, Reference, Rest, Sine, Target, gap, powers_of_join, stop};

use crate::drive::CTarget;
use crate::status::{Status, overlap, place};

/// Where a plan leads. Any bit pattern is one, zeros are rest at angle 0.
#[repr(C)]
#[derive(Clone, Copy)]
struct Goal {
    rest: Rest<f32>,
    sine: Sine<f32>,
    is_sine: u32,
}

impl<const J: usize> Reference<f32, J> for Goal {
    fn at(&self, tick: u32) -> Target<f32, i32, J> {
        if self.is_sine == 0 { self.rest.at(tick) } else { self.sine.at(tick) }
    }
}

impl Goal {
    fn rest(rest: Rest<f32>) -> Self {
        Self { rest, sine: Sine::new(0.0, 0.0, 1.0), is_sine: 0 }
    }
}

/// A plan that takes over M derivatives, r included: `edo_smc_plan_*_t`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Plan<const M: usize>(Joined<f32, Goal, M>);

impl<const M: usize> Plan<M> {
    /// Words of a plan.
    pub(crate) const WORDS: usize = {
        assert!(align_of::<Self>() == 4);
        size_of::<Self>() / 4
    };
}

/// When a plan begins and how long it takes.
#[derive(Clone, Copy)]
pub(crate) struct Span {
    pub(crate) start: u32,
    pub(crate) ticks: u32,
    pub(crate) period_s: f64,
}

impl Span {
    fn check(&self) -> Result<(), Status> {
        if !(1..=1 << 24).contains(&self.ticks) {
            return Err(Status::TICKS);
        }
        if is_number(self.period_s) && self.period_s > 0.0 { Ok(()) } else { Err(Status::NOT_FINITE) }
    }
}

fn is_number(number: f64) -> bool {
    number.abs() <= INPUT_LIMIT
}

/// Rest at this angle, always.
///
/// # Safety
/// A pointer that is not NULL points to memory of its type.
pub(crate) unsafe fn rest<const M: usize>(plan: *mut Plan<M>, rest: Rest<f32>) -> Status {
    if let Err(status) = place(plan) {
        return status;
    }
    if !is_number(rest.angle.into()) {
        return Status::NOT_FINITE;
    }
    let mut way = Joined::new(Goal::rest(rest), [0.0; M], 0, 1, 1.0);
    // It is over, at any tick.
    Reference::<f32, 1>::settle(&mut way, 1);
    // SAFETY: not NULL, aligned.
    unsafe { plan.write(Plan(way)) };
    Status::OK
}

/// Onto the goal that is made of what is present, in the ticks that it says.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
unsafe fn onto<const M: usize>(
    plan: *mut Plan<M>,
    from: *const Plan<M>,
    span: Span,
    goal: impl FnOnce(&Target<f32, i32, M>) -> Result<(Goal, u32), Status>,
) -> Status {
    let made = || {
        place(plan)?;
        place(from)?;
        if overlap(plan, from) {
            return Err(Status::OVERLAP);
        }
        span.check()?;
        let Span { start, period_s, .. } = span;
        // SAFETY: not NULL, aligned; any bit pattern is a plan.
        let present = unsafe { &(*from).0 }.at(start);
        let (goal, ticks) = goal(&present)?;
        let gap = gap(&present, &goal.at(start));
        let powers = powers_of_join(gap, f64::from(ticks) * period_s);
        let near = |rad: &f64| rad.abs() <= FARTHEST_RAD;
        if !gap.iter().all(|&number| is_number(number)) || !powers.as_flattened().as_flattened().iter().all(near) {
            return Err(Status::NOT_FINITE);
        }
        Ok(Plan(Joined::new(goal, gap, start, ticks, period_s)))
    };
    match made() {
        Ok(made) => {
            // SAFETY: not NULL, aligned.
            unsafe { plan.write(made) };
            Status::OK
        }
        Err(status) => status,
    }
}

fn at_rest(rest: Rest<f32>, ticks: u32) -> Result<(Goal, u32), Status> {
    if is_number(rest.angle.into()) { Ok((Goal::rest(rest), ticks)) } else { Err(Status::NOT_FINITE) }
}

/// To rest at this angle.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
pub(crate) unsafe fn to_rest<const M: usize>(
    plan: *mut Plan<M>,
    from: *const Plan<M>,
    span: Span,
    rest: Rest<f32>,
) -> Status {
    let goal = |_: &_| at_rest(rest, span.ticks);
    // SAFETY: as the caller promises.
    unsafe { onto(plan, from, span, goal) }
}

/// To rest, in so many ticks or fewer, and never back.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
pub(crate) unsafe fn to_stop<const M: usize>(plan: *mut Plan<M>, from: *const Plan<M>, span: Span) -> Status {
    let goal = |present: &_| {
        let (rest, ticks) = stop(present, span.ticks, span.period_s);
        at_rest(rest, ticks)
    };
    // SAFETY: as the caller promises.
    unsafe { onto(plan, from, span, goal) }
}

/// Onto A sin ωt.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
pub(crate) unsafe fn to_sine<const M: usize>(
    plan: *mut Plan<M>,
    from: *const Plan<M>,
    span: Span,
    amplitude_rad: f64,
    omega_rad_s: f64,
) -> Status {
    let goal = |_: &_| {
        // As it is rounded, in 2^-32 turns per tick: one at least, and less than half a turn.
        let phase = omega_rad_s * span.period_s / core::f64::consts::TAU * 4_294_967_296.0 + 0.5;
        if !is_number(amplitude_rad) {
            return Err(Status::NOT_FINITE);
        }
        if !(1.0..2_147_483_648.0).contains(&phase) {
            return Err(Status::FREQUENCY);
        }
        let sine = Sine::new(amplitude_rad, omega_rad_s, span.period_s);
        Ok((Goal { rest: Rest { turn: 0, angle: 0.0 }, sine, is_sine: 1 }, span.ticks))
    };
    // SAFETY: as the caller promises.
    unsafe { onto(plan, from, span, goal) }
}

/// The target at a tick.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
#[inline(always)]
pub(crate) unsafe fn at<const M: usize, const N: usize>(
    plan: *const Plan<M>,
    tick: u32,
    target: *mut CTarget<N>,
) -> Status {
    // SAFETY: as the caller promises; any bit pattern is a plan.
    unsafe { told(plan, target, || (*plan).0.at(tick)) }
}

/// The same of a plan that is gone along.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
#[inline(always)]
pub(crate) unsafe fn play<const M: usize, const N: usize>(
    plan: *mut Plan<M>,
    tick: u32,
    target: *mut CTarget<N>,
) -> Status {
    // SAFETY: as the caller promises; any bit pattern is a plan.
    unsafe {
        told(plan, target, || {
            Reference::<f32, N>::settle(&mut (*plan).0, tick);
            (*plan).0.at(tick)
        })
    }
}

/// # Safety
/// Pointers that are not NULL point to memory of their type; the plan is one for `ask`.
#[inline(always)]
unsafe fn told<const M: usize, const N: usize>(
    plan: *const Plan<M>,
    target: *mut CTarget<N>,
    ask: impl FnOnce() -> Target<f32, i32, N>,
) -> Status {
    if let Err(status) = place(plan).and_then(|()| place(target)) {
        return status;
    }
    if overlap(plan, target) {
        return Status::OVERLAP;
    }
    let Target { turn, jet } = ask();
    // SAFETY: not NULL, aligned.
    unsafe { target.write(CTarget { turn, jet }) };
    Status::OK
}
