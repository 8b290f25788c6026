//! Plans of a drive for C: their type, their construction, and their target at a tick.
//!
//! A plan is a polynomial transition ([`Joined`]) to a goal in a number of ticks. The goal is rest at an angle, or a
//! sine. A new plan continues the plan that is played. It is computed in f64 outside of the interrupt; the interrupt
//! computes targets in f32.

use controller_core::INPUT_LIMIT;
use controller_core::drive::{FARTHEST_RAD, Joined, Reference, Rest, Sine, Target, gap, powers_of_join, stop};

use crate::drive::CTarget;
use crate::status::{Status, overlap, place};

/// Goal of a plan. Every bit pattern is valid; zeros are rest at angle 0.
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

/// Plan that continues M derivatives, r included, `edo_smc_plan_*_t`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Plan<const M: usize>(Joined<f32, Goal, M>);

impl<const M: usize> Plan<M> {
    /// Number of words of a plan.
    pub(crate) const WORDS: usize = {
        assert!(align_of::<Self>() == 4);
        size_of::<Self>() / 4
    };
}

/// First tick and duration of a plan, in ticks of `period_s`.
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

/// Makes a permanent rest at an angle.
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
    // SAFETY: not NULL, aligned.
    unsafe { plan.write(Plan(Joined::met(Goal::rest(rest)))) };
    Status::OK
}

/// Makes the transition to a goal. `goal` returns the goal and the duration for the present target.
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

/// Makes a move to rest at an angle.
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
    // SAFETY: guaranteed by the caller.
    unsafe { onto(plan, from, span, goal) }
}

/// Makes a stop in at most `span.ticks` ticks that never moves back.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
pub(crate) unsafe fn to_stop<const M: usize>(plan: *mut Plan<M>, from: *const Plan<M>, span: Span) -> Status {
    let goal = |present: &_| {
        let (rest, ticks) = stop(present, span.ticks, span.period_s);
        at_rest(rest, ticks)
    };
    // SAFETY: guaranteed by the caller.
    unsafe { onto(plan, from, span, goal) }
}

/// Makes a transition to $A \sin \omega t$.
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
        // Rounded to 2^-32 revolutions per tick: at least one, less than half a revolution.
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
    // SAFETY: guaranteed by the caller.
    unsafe { onto(plan, from, span, goal) }
}

/// Writes the target at a tick.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
#[inline(always)]
pub(crate) unsafe fn at<const M: usize, const N: usize>(
    plan: *const Plan<M>,
    tick: u32,
    target: *mut CTarget<N>,
) -> Status {
    // SAFETY: guaranteed by the caller; any bit pattern is a plan.
    unsafe { told(plan, target, || (*plan).0.at(tick)) }
}

/// Writes the target at a tick and marks a completed plan, which then stays completed when the ticks wrap.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type.
#[inline(always)]
pub(crate) unsafe fn play<const M: usize, const N: usize>(
    plan: *mut Plan<M>,
    tick: u32,
    target: *mut CTarget<N>,
) -> Status {
    // SAFETY: guaranteed by the caller; any bit pattern is a plan.
    unsafe {
        told(plan, target, || {
            Reference::<f32, N>::settle(&mut (*plan).0, tick);
            (*plan).0.at(tick)
        })
    }
}

/// Writes the target that `ask` returns.
///
/// # Safety
/// Pointers that are not NULL point to memory of their type; `ask` may read the plan.
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
