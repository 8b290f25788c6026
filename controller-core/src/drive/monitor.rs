//! Monitors around a drive: is what it sees still what its design supposes?
//!
//! The gate of the law (a count that moves as no shaft can is not believed) sees a sensor that jumps, or sticks in
//! motion. A count that sticks at a turning point moves as a shaft at rest does: the observer takes what u does to the
//! real shaft for a disturbance that cancels it, and the loop runs away. That is what these are for; they are not
//! optional where a runaway does harm.
//!
//! * *Disturbance*: |d| over what load, friction and errors of the model can be.
//! * *Sliding variable*: unsaturated and with innovations of at most $\bar e_i$ it cannot leave
//!   $|\sigma^*| \le \lambda_2 = \sum_i |\Gamma_i| \bar e_i / \min(k_l T, 1)$, where $\Gamma_i$ is what a unit of
//!   innovation adds to σ ([`EncoderForm::sigma_star_bound`]). Masked while u is at a limit.
//! * *Stuck at a limit*: u at a limit for so many ticks while |σ| does not fall, with ten ticks within the limits for
//!   each that is forgotten: a loop that swings from limit to limit is seen too.
//! * *Lost*: more samples missing than the law bridges.
//! * *Wrong way*: for [`Bounds::wrong_way_ticks`] in a row u is at a limit and against the speed $v$, and yet $|v|$
//!   grows, with $\frac54 |b u| < |d| < \frac72 |b u|$: a reversed encoder, phase order or torque constant makes
//!   $d = -2 b u$. A bumper that throws the shaft back does so for less long. Of a joint also: $d$ of link and motor
//!   over their bounds with opposite signs, and that of the motor over $|b u|$, as of a spring whose twist is not what
//!   the two encoders say.
//! * *Oscillates*: $d$ over its bound with the other sign than when it was over it before. Each such change counts for
//!   as long as u may be stuck at a limit, 0.2 s, and more than two are an alarm: three within 0.1 s, or more than
//!   five a second for good. A load that alternates beyond the bound does it, and false counts may; typed steps and
//!   saturated moves do not. A late task, an undeclared delay, a wrong inertia or torque constant end in it.
//!
//! d and σ* are an alarm only after some milliseconds over their bounds ([`Bounds::patience_ticks`]): one missed
//! interrupt or one false count is none. A load that the loop holds is one as well: at rest a count that sticks looks
//! the same, and its u need not come to a limit before the shaft has run away.
//!
//! # What follows an alarm
//! It is told in [`Health`], and the caller may plan a joined [`stop`](super::stop) with the reference. That needs good
//! counts, and a motor that suffices. So a drive [stops](Monitored::stopping_at) by itself at the alarms of one's
//! choice, and one tick after the last two ([`RUNAWAY`]) always: the fallback that needs nothing goes out, which is the
//! safe u, and 0 where there is none, until it is reset. The last u is not held: it may be what raised the alarm.
//!
//! A drive that [brakes](Monitored::braking) does so first, as long as its counts can be believed:
//! $u = -(k_v v + \bar d) / b$ within the limits, with the estimate of the speed and without the target. $\bar d$ is
//! the d of a motor, so a load up to its bound is held. Once d is over 1.5 times its bound it may be a count that
//! sticks, and $\bar d$ is 0 from there on; of a joint it always is: the spring damps the link. A wrong b is another
//! $k_v$, which a plant much lighter than its design does not bear. The current is switched off at rest: after some
//! time constants $1/k_v$ in which u was within its limits and $|v|$ was small, or no longer fell. It is also off
//! where braking at the limit does not slow the shaft down for as long as u may be stuck there, or where the shaft
//! becomes faster than at the beginning; where the counts are lost for longer than an alarm takes; at a [`RUNAWAY`].

use core::mem::offset_of;

use super::chain::ChainModel;
use super::law::{DriveLaw, EncoderForm, StateOf};
use super::state::EncoderState;
use super::target::{Aim, Target};
use crate::controller::Output;
use crate::health::Health;
use crate::real::Real;
use crate::running::{ControlLaw, RetuneError, Running, Words, each_word, hash, next};

/// What the monitors of a drive with E encoders may see; by rule from a design ([`MotorDesign::bounds`],
/// [`JointDesign::bounds`]).
///
/// [`MotorDesign::bounds`]: super::MotorDesign::bounds
/// [`JointDesign::bounds`]: super::JointDesign::bounds
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Bounds<const E: usize> {
    /// Largest |d| of each shaft, rad/s².
    pub disturbance: [f64; E],
    /// Largest |σ*|; infinite for none.
    pub sigma_star: f64,
    /// Ticks that u may be at a limit while |σ| does not fall, and for which a change of the sign of d counts.
    pub stuck_ticks: u32,
    /// Ticks in a row in which the shaft speeds up against its current that are no alarm yet.
    pub wrong_way_ticks: u32,
    /// Ticks with d or σ* over its bound, or without a sample, that are no alarm yet; each tick without forgets one.
    pub patience_ticks: u32,
    /// A drive that brakes asks for so many 1/s times its speed.
    pub brake_per_s: f64,
    /// It is at rest after so many ticks within the limits of u in which |v| is small or does not fall.
    pub brake_ticks: u32,
}

/// Time that u may be at a limit while |σ| does not fall, s.
const STUCK_S: f64 = 0.2;

/// Ticks of a bounce that look like the wrong way.
const BOUNCE_TICKS: f64 = 6.0;
/// Way at the largest acceleration, from rest, within which the wrong way is told, rad; and the longest time, s.
const WRONG_WAY_RAD: f64 = 6e-3;
const WRONG_WAY_S: f64 = 0.01;

/// Time over a bound that is no alarm yet, s, and the fewest ticks.
const PATIENCE_S: f64 = 0.008;
const PATIENCE_TICKS: f64 = 4.0;

/// Time constants of the brake below [`SLOW`] until the shaft is taken to be at rest: 1/3000 of the speed at which u
/// left its limit.
const BRAKE_CONSTANTS: f64 = 4.0;
/// Share of the most that a brake asks for below which $k_v v / b$ is small.
const SLOW: f64 = 1.0 / 128.0;
/// A brake asks for at most so much more than at its beginning, and half of the span of u: else the shaft is faster.
const FASTER: f64 = 1.25;

impl<const E: usize> Bounds<E> {
    /// For a law of this period with these gates: innovations of p/(1 - p) of them, which is how far an acceleration
    /// is off under a gain that is wrong by p. `fastest`: what the limit of u does to the driven shaft, rad/s²; of
    /// the brake the gain from its speed to its deceleration, 1/s, and the time constant of what it slows down, s.
    pub(crate) fn of<T, M, A, const N: usize, const S: usize, const FAST: usize, const LATE: usize>(
        law: &EncoderForm<T, M, A, E, N, S, FAST, LATE>,
        disturbance: [f64; E],
        gate_steps: [f64; E],
        uncertain: f64,
        fastest: f64,
        [brake_per_s, rest_s]: [f64; 2],
        period_s: f64,
    ) -> Self
    where
        T: Real,
        M: ChainModel<T, E, N>,
        A: Aim<T, N>,
    {
        let sigma_star = law.sigma_star_bound(gate_steps.map(|steps| steps * misjudged(uncertain)));
        let time_s = libm::sqrt(2.0 * WRONG_WAY_RAD / fastest).min(WRONG_WAY_S);
        let wrong_way_ticks = (time_s / period_s).max(BOUNCE_TICKS) as u32;
        Self {
            disturbance,
            sigma_star,
            stuck_ticks: (STUCK_S / period_s) as u32,
            wrong_way_ticks,
            patience_ticks: (PATIENCE_S / period_s).max(PATIENCE_TICKS) as u32,
            brake_per_s,
            brake_ticks: (BRAKE_CONSTANTS * rest_s / period_s) as u32,
        }
    }
}

/// p/(1 - p), for up to 90 %.
pub(crate) fn misjudged(uncertain: f64) -> f64 {
    let p = if uncertain < 0.9 { uncertain } else { 0.9 };
    p / (1.0 - p)
}

/// What the monitors raise an alarm with; the rest of [`Health`] is told and no alarm.
pub const ALARMS: Health = ANSWERED.union(BEYOND_CONTROL);

/// At any alarm: brake as long as the counts can be believed, then stop.
pub const BRAKING: Health = ALARMS.union(Health::BRAKES);

/// Alarms that a planned stop answers.
pub const ANSWERED: Health = Health::DISTURBANCE_OVER_BOUND.union(Health::SIGMA_STAR_OVER_BOUND);

/// Alarms that no planned stop answers: u is at its limit and does not suffice, or nothing is known. A count that
/// sticks ends in the first of them.
pub const BEYOND_CONTROL: Health = Health::STUCK_AT_LIMIT.union(Health::INPUT_REJECTED).union(RUNAWAY);

/// Alarms that stop every drive with monitors: under them the law makes it worse, and a planned stop is the law's.
pub const RUNAWAY: Health = Health::WRONG_WAY.union(Health::OSCILLATES);

/// A law whose disturbances can be watched.
pub trait Watched<const E: usize>: ControlLaw<Output = Output<<Self as ControlLaw>::Scalar>> {
    /// d of each block, in its own unit.
    fn disturbance(state: &Self::State) -> [Self::Scalar; E];

    /// v of the driven block, the last.
    fn speed(state: &Self::State) -> Self::Scalar;

    /// What one unit of u adds to its acceleration.
    fn gain(&self) -> Self::Scalar;

    /// 1 by that.
    fn per_gain(&self) -> Self::Scalar;

    /// The limits of u of the design, lower and upper.
    fn nominal_limits(&self) -> [Self::Scalar; 2];

    /// The present ones.
    fn range(&self, state: &Self::State) -> [Self::Scalar; 2];

    /// This goes out instead of what the law has put out, and the law begins anew from there.
    fn put_instead(state: &mut Self::State, u: Self::Scalar);

    /// How many of these units one rad/s² is.
    fn per_rad(&self, block: usize) -> Self::Scalar;
}

impl<T, M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize> Watched<E>
    for EncoderForm<T, M, A, E, N, S, FAST, LATE>
where
    T: Real,
    M: ChainModel<T, E, N>,
    A: Aim<T, N>,
{
    #[inline(always)]
    fn disturbance(state: &StateOf<Self>) -> [T; E] {
        core::array::from_fn(|i| state.x[i][2])
    }

    #[inline(always)]
    fn speed(state: &StateOf<Self>) -> T {
        state.x[E - 1][1]
    }

    fn gain(&self) -> T {
        self.model.input_gain()
    }

    fn per_gain(&self) -> T {
        self.row.per_b
    }

    fn nominal_limits(&self) -> [T; 2] {
        [self.row.u_min, self.row.u_max]
    }

    #[inline(always)]
    fn range(&self, state: &StateOf<Self>) -> [T; 2] {
        self.present_limits(state)
    }

    #[inline(always)]
    fn put_instead(state: &mut StateOf<Self>, u: T) {
        state.offset = T::ZERO;
        match state.queued.last_mut() {
            Some(queued) => *queued = u,
            None => state.held = u,
        }
    }

    fn per_rad(&self, block: usize) -> T {
        self.model.per_rad(block)
    }
}

impl<L: Watched<E>, const E: usize> Watched<E> for &L {
    #[inline(always)]
    fn disturbance(state: &L::State) -> [L::Scalar; E] {
        L::disturbance(state)
    }

    #[inline(always)]
    fn speed(state: &L::State) -> L::Scalar {
        L::speed(state)
    }

    fn gain(&self) -> L::Scalar {
        (**self).gain()
    }

    fn per_gain(&self) -> L::Scalar {
        (**self).per_gain()
    }

    fn nominal_limits(&self) -> [L::Scalar; 2] {
        (**self).nominal_limits()
    }

    #[inline(always)]
    fn range(&self, state: &L::State) -> [L::Scalar; 2] {
        (**self).range(state)
    }

    #[inline(always)]
    fn put_instead(state: &mut L::State, u: L::Scalar) {
        L::put_instead(state, u);
    }

    fn per_rad(&self, block: usize) -> L::Scalar {
        (**self).per_rad(block)
    }
}

/// A drive with its monitors.
///
/// ```
/// use controller_core::drive::{Encoder, Monitored, Motor, MotorDesign, MotorDrive, Position};
/// use controller_core::{Limits, Running};
///
/// const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
/// const DESIGN: MotorDesign = MotorDesign::by_rule(1e-3, MOTOR, Encoder::absolute(14), Limits::symmetric(10.0));
/// type Drive = MotorDrive<f32, Position>;
/// let law = Drive::design(&DESIGN);
/// // Thresholds for a data sheet that is good to 20 %.
/// let bounds = DESIGN.bounds(&law, 0.2);
/// let running = Running::new(Monitored::new(law, &bounds).stopping());
/// # assert!(running.estimates().is_none());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Monitored<L: ControlLaw, const E: usize> {
    law: L,
    disturbance: [L::Scalar; E],
    sigma_star: L::Scalar,
    ticks: WatchTicks<L::Scalar>,
    /// What u is per unit of speed while it brakes.
    brake: L::Scalar,
    /// What stops it beside a [`RUNAWAY`]; with [`Health::BRAKES`] it brakes first.
    stops_at: Health,
}

/// Ticks that monitors count to, as numbers that a tick compares; see [`Bounds`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WatchTicks<T> {
    /// At a limit of u.
    pub stuck: T,
    /// Of the wrong way.
    pub wrong_way: T,
    /// Over a bound.
    pub patience: T,
    /// Of braking within the limits without becoming slower.
    pub brake: T,
}

impl<L: Watched<E>, const E: usize> Monitored<L, E> {
    /// The same from numbers that are known already, for a `const`: |d| in the unit of each block, |σ*|, ticks, and u
    /// per unit of speed of a brake.
    pub const fn from_parts(
        law: L,
        disturbance: [L::Scalar; E],
        sigma_star: L::Scalar,
        ticks: WatchTicks<L::Scalar>,
        brake: L::Scalar,
    ) -> Self {
        Self { law, disturbance, sigma_star, ticks, brake, stops_at: Health::OK }
    }

    /// A drive, and what may be seen of it.
    pub fn new(law: L, bounds: &Bounds<E>) -> Self {
        let disturbance = core::array::from_fn(|i| L::Scalar::from_f64(bounds.disturbance[i]) * law.per_rad(i));
        let sigma_star = if bounds.sigma_star < LARGEST { bounds.sigma_star } else { LARGEST };
        let number = |ticks: u32| L::Scalar::from_f64(f64::from(ticks));
        let ticks = WatchTicks {
            stuck: number(bounds.stuck_ticks),
            wrong_way: number(bounds.wrong_way_ticks),
            patience: number(bounds.patience_ticks),
            brake: number(bounds.brake_ticks),
        };
        let brake = L::Scalar::from_f64(bounds.brake_per_s) / law.gain();
        Self::from_parts(law, disturbance, L::Scalar::from_f64(sigma_star), ticks, brake)
    }

    /// |d| in the unit of each block, |σ*| and u per unit of speed of a brake, ticks: what a tick takes.
    #[allow(clippy::type_complexity, reason = "three things that a caller takes apart at once")]
    pub const fn thresholds(&self) -> ([L::Scalar; E], [L::Scalar; 2], WatchTicks<L::Scalar>) {
        (self.disturbance, [self.sigma_star, self.brake], self.ticks)
    }

    /// The same; an alarm stops the drive until it is [reset](crate::Running::reset).
    #[must_use]
    pub const fn stopping(self) -> Self {
        self.stopping_at(ALARMS)
    }

    /// The same for some of the alarms, such as [`BEYOND_CONTROL`] where others are answered by a planned stop; at a
    /// [`RUNAWAY`] it stops in any case.
    #[must_use]
    pub const fn stopping_at(mut self, alarms: Health) -> Self {
        self.stops_at = alarms;
        self
    }

    /// The same; at an alarm the drive brakes as long as it can believe its counts, and stops then.
    #[must_use]
    pub const fn braking(self) -> Self {
        self.stopping_at(BRAKING)
    }
}

impl<L: Watched<E>, const E: usize> Monitored<L, E> {
    /// Does what follows an alarm, from the next tick on: brakes, stops, or goes on where alarms are told only or
    /// answered by a planned stop. For what the drive cannot know: a switch, a door, a [`Fence`](super::Fence).
    #[inline]
    pub fn trip(&self, state: &mut MonitoredState<L::State, L::Scalar, E>) {
        let (zero, one) = (L::Scalar::ZERO, L::Scalar::from_f64(1.0));
        if !self.stops_at.contains(Health::BRAKES) {
            state.stopped |= self.stops_at.intersects(ANSWERED);
        } else if !self.is_braking(state) {
            (state.braking, state.stuck, state.over) = (one, zero, zero);
            // Not known before the first tick of it.
            state.most = zero;
            state.counted += one;
        }
    }
}

impl<L: Watched<E>, const E: usize> Running<Monitored<L, E>> {
    /// [`Monitored::trip`], of a drive that has started.
    pub fn trip(&mut self) {
        if let Some(state) = &mut self.state {
            self.design.trip(state);
        }
    }

    /// This goes out instead, within the present limits: the law begins anew from there. 0 before the start.
    pub(super) fn put_instead(&mut self, u: L::Scalar) -> L::Scalar {
        let Some(state) = &mut self.state else { return L::Scalar::ZERO };
        let [u_min, u_max] = self.design.law.range(&state.within);
        let u = u.limited(u_min, u_max);
        L::put_instead(&mut state.within, u);
        u
    }
}

impl<T, M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>
    Monitored<EncoderForm<T, M, A, E, N, S, FAST, LATE>, E>
where
    T: Real,
    M: ChainModel<T, E, N>,
    A: Aim<T, N>,
{
    /// Where the words begin that are no whole word, and which bits they have: the byte of the law that must be 0 or
    /// 1, and the alarms.
    #[doc(hidden)]
    pub const PARTS_AT: [(usize, u32); 2] = [
        (offset_of!(Self, law) + EncoderForm::<T, M, A, E, N, S, FAST, LATE>::FLAG_AT, 0xff),
        (offset_of!(Self, stops_at), 0xffff),
    ];
    /// Where in a state the bytes lie that must be 0 or 1.
    #[doc(hidden)]
    pub const FLAGS_AT: [usize; 2] = [
        offset_of!(MonitoredState<EncoderState<T, M, E, N, S, FAST, LATE>, T, E>, within)
            + EncoderState::<T, M, E, N, S, FAST, LATE>::FLAG_AT,
        offset_of!(MonitoredState<EncoderState<T, M, E, N, S, FAST, LATE>, T, E>, stopped),
    ];
}

/// For no bound, in f32 too.
pub(super) const LARGEST: f64 = 1e30;

/// State of a [`Monitored`] drive. In this order: more numbers in a row that are all 0 at a start would be set by a
/// call with a loop in it, which has no bound.
#[derive(Debug, PartialEq)]
#[repr(C)]
pub struct MonitoredState<S, T, const E: usize> {
    /// How much is counted below; while it is 0 a tick within its bounds is not looked into.
    counted: T,
    /// Ticks at a limit without |σ| falling, and the last |σ| there.
    stuck: T,
    last: T,
    /// Ticks for which the changes of the sign of d still count, and d of each block when it was last over its bound.
    swings: T,
    side: [T; E],
    /// Ticks in a row of the wrong way, and the speed in the last tick at a limit.
    against: T,
    speed: T,
    within: S,
    /// Ticks over a bound, less those within.
    over: T,
    /// 1 and the ticks of braking within the limits without becoming slower.
    braking: T,
    /// The most that a brake asks for; 0 before its first tick, below 0 where it does not hold against d.
    most: T,
    stopped: bool,
}

// Inlined in any case: a call of it would return the whole state, which an interrupt would copy in a loop.
impl<S: Clone, T: Copy, const E: usize> Clone for MonitoredState<S, T, E> {
    #[inline(always)]
    fn clone(&self) -> Self {
        Self { within: self.within.clone(), ..*self }
    }
}

impl<S: Words, T: Real, const E: usize> Words for MonitoredState<S, T, E> {
    fn words(&self) -> impl Iterator<Item = u32> {
        let Self { within, counted, stuck, last, swings, side, against, speed, over, braking, most, stopped } = self;
        let numbers = [counted, stuck, last, swings, against, speed, over, braking, most].into_iter().chain(side);
        let numbers = numbers.flat_map(each_word);
        [u32::from(*stopped)].into_iter().chain(numbers).chain(within.words())
    }

    fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self> {
        let stopped = match words.next()? {
            0 => false,
            1 => true,
            _ => return None,
        };
        let (counted, stuck, last) = (next(words)?, next(words)?, next(words)?);
        let (swings, against, speed) = (next(words)?, next(words)?, next(words)?);
        let (over, braking, most) = (next(words)?, next(words)?, next(words)?);
        let mut side = [T::ZERO; E];
        for d in &mut side {
            *d = next(words)?;
        }
        let within = S::from_words(words)?;
        Some(Self { counted, stuck, last, swings, side, against, speed, within, over, braking, most, stopped })
    }
}

impl<L: Watched<E>, const E: usize> Monitored<L, E> {
    /// What goes out of a drive that has stopped.
    #[inline(always)]
    fn stopped(&self, state: &MonitoredState<L::State, L::Scalar, E>) -> Option<Output<L::Scalar>> {
        state.stopped.then(|| {
            let output = self.law.not_started();
            Output { health: Health::INPUT_REJECTED.union(Health::STOPPED), ..output }
        })
    }

    /// The output of a tick with what the monitors say of it.
    #[inline(always)]
    fn judged(
        &self,
        state: &mut MonitoredState<L::State, L::Scalar, E>,
        output: Output<L::Scalar>,
    ) -> Output<L::Scalar> {
        if self.is_calm(state, &output) {
            return output;
        }
        self.looked_into(state, output)
    }

    /// Is there nothing to look into? A tick is within its bounds, and nothing is counted.
    #[doc(hidden)]
    #[inline(always)]
    pub fn is_calm(&self, state: &MonitoredState<L::State, L::Scalar, E>, output: &Output<L::Scalar>) -> bool {
        let d = L::disturbance(&state.within);
        let mut calm = output.sigma_star.abs() <= self.sigma_star;
        for i in 0..E {
            calm &= d[i].abs() <= self.disturbance[i];
        }
        calm && state.counted == L::Scalar::ZERO && !output.health.intersects(Self::LOOKED_INTO)
    }

    const LOOKED_INTO: Health = Health::SATURATED.union(Health::INPUT_REJECTED);

    /// Which of them it was, and what follows.
    #[cold]
    #[inline(never)]
    fn looked_into(
        &self,
        state: &mut MonitoredState<L::State, L::Scalar, E>,
        output: Output<L::Scalar>,
    ) -> Output<L::Scalar> {
        if output.health.contains(Health::WAITS) {
            return self.wait_for_counts(state, output);
        }
        if self.is_braking(state) {
            return self.brake(state, output);
        }
        let over = self.watch(state, &output);
        self.answer(state, output, over)
    }

    /// Nothing is estimated yet, and nothing flows. With a sample lost it is what was believed that was given up.
    #[doc(hidden)]
    #[inline(always)]
    pub fn wait_for_counts(
        &self,
        state: &mut MonitoredState<L::State, L::Scalar, E>,
        output: Output<L::Scalar>,
    ) -> Output<L::Scalar> {
        let is_alarm = output.health.contains(Health::SAMPLE_LOST) && self.stops_at.contains(Health::INPUT_REJECTED);
        if is_alarm { self.stop(state, output) } else { output }
    }

    /// A tick of a drive that brakes.
    #[cold]
    #[inline(never)]
    fn brake(
        &self,
        state: &mut MonitoredState<L::State, L::Scalar, E>,
        output: Output<L::Scalar>,
    ) -> Output<L::Scalar> {
        let slowing = self.slowing(state);
        if Self::is_first(state) {
            self.begin_brake(state);
        } else {
            self.watch_brake(state, &output, slowing);
        }
        self.slow_down(state, output, slowing)
    }

    /// Is this the first tick of a brake?
    #[doc(hidden)]
    #[inline(always)]
    pub fn is_first(state: &MonitoredState<L::State, L::Scalar, E>) -> bool {
        state.most == L::Scalar::ZERO
    }

    /// In its first tick: the most that it may ask for, and whether it may hold against the load from now on.
    #[doc(hidden)]
    #[inline(always)]
    pub fn begin_brake(&self, state: &mut MonitoredState<L::State, L::Scalar, E>) {
        let ([u_min, u_max], asks) = (self.law.nominal_limits(), self.brake * L::speed(&state.within));
        let most = L::Scalar::from_f64(FASTER) * asks.abs() + L::Scalar::HALF * (u_max - u_min);
        state.most = if E == 1 && self.may_hold(state) { most } else { -most };
    }

    /// Is d a load that may be held against? An inertia that is another makes d too.
    #[inline(always)]
    fn may_hold(&self, state: &MonitoredState<L::State, L::Scalar, E>) -> bool {
        L::disturbance(&state.within)[0].abs() <= L::Scalar::from_f64(1.5) * self.disturbance[0]
    }

    #[doc(hidden)]
    #[inline(always)]
    pub fn is_braking(&self, state: &MonitoredState<L::State, L::Scalar, E>) -> bool {
        self.stops_at.contains(Health::BRAKES) && state.braking > L::Scalar::ZERO
    }

    /// What slows the shaft down, and whether the limits leave less of it than is asked for.
    #[doc(hidden)]
    #[inline(always)]
    pub fn slowing(&self, state: &MonitoredState<L::State, L::Scalar, E>) -> (L::Scalar, bool) {
        let [u_min, u_max] = self.law.range(&state.within);
        let mut asked = -(self.brake * L::speed(&state.within));
        if E == 1 {
            let load = if state.most > L::Scalar::ZERO { L::disturbance(&state.within)[0] } else { L::Scalar::ZERO };
            asked -= self.law.per_gain() * load;
        }
        // Of a speed that is no number nothing is asked.
        let asked = if asked.abs() <= L::Scalar::from_f64(LARGEST) { asked } else { L::Scalar::ZERO };
        let u = asked.limited(u_min, u_max);
        (u, u != asked)
    }

    /// Counts what a tick shows; whether a disturbance is over its bound, and σ*.
    #[doc(hidden)]
    #[inline(always)]
    pub fn watch(&self, state: &mut MonitoredState<L::State, L::Scalar, E>, output: &Output<L::Scalar>) -> [bool; 2] {
        let over = self.sides(state);
        let is_any_over = over.contains(&true);
        let mut is_star_over = false;
        if output.health.contains(Health::SATURATED) {
            let is_lost = output.health.contains(Health::SAMPLE_LOST);
            self.at_limit(state, &over, [output.sigma.abs(), output.u], is_lost);
        } else {
            Self::within_limits(state);
            let within = output.sigma_star.abs() <= self.sigma_star;
            is_star_over = !within;
        }
        let is_over = is_any_over || is_star_over || output.health.contains(Health::INPUT_REJECTED);
        Self::count_over(state, is_over);
        [is_any_over, is_star_over]
    }

    /// The same of a drive that brakes: its speed is what must fall at a limit.
    #[doc(hidden)]
    #[inline(always)]
    pub fn watch_brake(
        &self,
        state: &mut MonitoredState<L::State, L::Scalar, E>,
        output: &Output<L::Scalar>,
        (slowing, is_short): (L::Scalar, bool),
    ) {
        let over = self.sides(state);
        let most = state.most.abs();
        if E == 1 && !self.may_hold(state) {
            state.most = -most;
        }
        let speed = L::speed(&state.within).abs();
        let asks = (self.brake * speed).abs();
        if is_short {
            self.at_limit(state, &over, [speed, slowing], false);
            if asks > most {
                state.stuck = self.ticks.stuck + L::Scalar::from_f64(1.0);
            }
        } else {
            Self::within_limits(state);
            let slows_down = speed < state.last && asks > L::Scalar::from_f64(SLOW) * most;
            if !slows_down {
                state.braking += L::Scalar::from_f64(1.0);
            }
            state.last = speed;
        }
        let is_blind = output.health.contains(Health::SAMPLE_LOST) && output.health.contains(Health::INPUT_REJECTED);
        Self::count_over(state, is_blind);
    }

    /// Which disturbances are over their bounds; a change of side counts.
    #[inline(always)]
    fn sides(&self, state: &mut MonitoredState<L::State, L::Scalar, E>) -> [bool; E] {
        let d = L::disturbance(&state.within);
        let (mut over, mut has_changed) = ([false; E], false);
        for i in 0..E {
            // No number is over any bound.
            let within = d[i].abs() <= self.disturbance[i];
            over[i] = !within;
            if over[i] {
                has_changed |= d[i] * state.side[i] < L::Scalar::ZERO;
                state.side[i] = d[i];
            }
        }
        if has_changed {
            state.swings += self.ticks.stuck;
        }
        over
    }

    /// A tick at a limit, and of what must fall there.
    #[inline(always)]
    fn at_limit(
        &self,
        state: &mut MonitoredState<L::State, L::Scalar, E>,
        over: &[bool; E],
        [falling, u]: [L::Scalar; 2],
        is_lost: bool,
    ) {
        let one = L::Scalar::from_f64(1.0);
        if state.stuck == L::Scalar::ZERO || falling >= state.last {
            state.stuck += one;
        }
        state.last = falling;
        let d = L::disturbance(&state.within);
        if self.is_wrong_way(state, &d, over, u) {
            state.against += one;
        } else if is_lost {
            // At full current nobody sees what it does.
            state.against += L::Scalar::HALF;
        } else {
            state.against = L::Scalar::ZERO;
        }
        state.speed = L::speed(&state.within).abs();
    }

    #[inline(always)]
    fn within_limits(state: &mut MonitoredState<L::State, L::Scalar, E>) {
        state.against = L::Scalar::ZERO;
        state.stuck = lessened(state.stuck, L::Scalar::from_f64(0.1));
    }

    #[inline(always)]
    fn count_over(state: &mut MonitoredState<L::State, L::Scalar, E>, is_over: bool) {
        let one = L::Scalar::from_f64(1.0);
        state.over = if is_over { state.over + one } else { lessened(state.over, one) };
    }

    /// What is told of what was counted, and what follows.
    #[doc(hidden)]
    #[inline(always)]
    pub fn answer(
        &self,
        state: &mut MonitoredState<L::State, L::Scalar, E>,
        mut output: Output<L::Scalar>,
        [is_any_over, is_star_over]: [bool; 2],
    ) -> Output<L::Scalar> {
        let zero = L::Scalar::ZERO;
        let (is_rejected, is_late) = (output.health.contains(Health::INPUT_REJECTED), state.over > self.ticks.patience);
        let mut alarms = Health::STUCK_AT_LIMIT.when(state.stuck > self.ticks.stuck);
        alarms = alarms.union(Health::DISTURBANCE_OVER_BOUND.when(is_late && is_any_over));
        alarms = alarms.union(Health::SIGMA_STAR_OVER_BOUND.when(is_late && is_star_over));
        let asked = alarms.union(Health::INPUT_REJECTED.when(is_rejected && is_late));
        let is_blind = is_rejected && output.health.contains(Health::SAMPLE_LOST);
        output.health = output.health.union(alarms);
        if asked.intersects(self.stops_at) {
            if is_blind || !self.stops_at.contains(Health::BRAKES) {
                output = self.stop(state, output);
            } else if state.against == zero {
                // To brake makes it worse if the shaft goes the wrong way: that is known in a few ticks.
                self.trip(state);
            }
        }
        let output = self.runaway(state, output);
        state.counted = state.stuck + state.swings + state.against + state.over + state.braking;
        output
    }

    /// The current of a drive that brakes, or none any more.
    #[doc(hidden)]
    #[inline(always)]
    pub fn slow_down(
        &self,
        state: &mut MonitoredState<L::State, L::Scalar, E>,
        mut output: Output<L::Scalar>,
        (slowing, is_short): (L::Scalar, bool),
    ) -> Output<L::Scalar> {
        let is_stuck = state.stuck > self.ticks.stuck;
        output.health = output.health.union(Health::STUCK_AT_LIMIT.when(is_stuck));
        if is_stuck || state.over > self.ticks.patience || state.braking > self.ticks.brake {
            output = self.stop(state, output);
        } else {
            L::put_instead(&mut state.within, slowing);
            output.u = slowing;
            let limited = Health::SATURATED.when(is_short).union(Health::BRAKES);
            output.health = output.health.without(Health::SATURATED).union(limited);
        }
        // Until it is reset.
        state.counted = state.braking;
        self.runaway(state, output)
    }

    /// The alarms that stop any drive, from the next tick on: this u is the law's.
    #[inline(always)]
    fn runaway(
        &self,
        state: &mut MonitoredState<L::State, L::Scalar, E>,
        mut output: Output<L::Scalar>,
    ) -> Output<L::Scalar> {
        let wrong_way = state.against > self.ticks.wrong_way;
        let oscillates = state.swings > self.ticks.stuck + self.ticks.stuck;
        state.swings = lessened(state.swings, L::Scalar::from_f64(1.0));
        state.stopped |= wrong_way | oscillates;
        output.health = output.health.union(Health::WRONG_WAY.when(wrong_way));
        output.health = output.health.union(Health::OSCILLATES.when(oscillates));
        output
    }

    /// The fallback goes out from now on.
    #[inline(always)]
    fn stop(&self, state: &mut MonitoredState<L::State, L::Scalar, E>, output: Output<L::Scalar>) -> Output<L::Scalar> {
        state.stopped = true;
        Output { u: self.law.not_started().u, health: output.health.union(Health::STOPPED), ..output }
    }
}

impl<L: Watched<E>, const E: usize> Monitored<L, E> {
    /// At a limit of u: does the driven shaft speed up against it, by what u alone would do the other way round, or do
    /// the shafts of a joint disagree about its spring?
    #[inline(always)]
    fn is_wrong_way(
        &self,
        state: &MonitoredState<L::State, L::Scalar, E>,
        d: &[L::Scalar; E],
        over: &[bool; E],
        u: L::Scalar,
    ) -> bool {
        let (zero, last) = (L::Scalar::ZERO, E - 1);
        if !over[last] {
            return false;
        }
        let (v, wanted, found) = (L::speed(&state.within), self.law.gain() * u, d[last].abs());
        let asked = wanted.abs();
        for i in 0..last {
            if over[i] && d[i] * d[last] < zero && found > asked {
                return true;
            }
        }
        v * wanted < zero
            && d[last] * wanted < zero
            && v.abs() > state.speed
            && found > L::Scalar::from_f64(1.25) * asked
            && found < L::Scalar::from_f64(3.5) * asked
    }
}

/// So much less, but not below 0; 0 if it is no number.
#[inline(always)]
pub(super) fn lessened<T: Real>(number: T, by: T) -> T {
    let less = number - by;
    if less > T::ZERO { less } else { T::ZERO }
}

impl<L: Watched<E> + DriveLaw<E, N>, const E: usize, const N: usize> DriveLaw<E, N> for Monitored<L, E> {
    const LATE: usize = L::LATE;
    const POSITION: bool = L::POSITION;

    #[inline(always)]
    fn sample(counts: [Option<i32>; E], begin: &Target<f32, i32, N>, end: &Target<f32, i32, N>) -> L::Sample {
        L::sample(counts, begin, end)
    }
}

impl<L: Watched<E>, const E: usize> ControlLaw for Monitored<L, E> {
    type Scalar = L::Scalar;
    type Sample = L::Sample;
    type Output = Output<L::Scalar>;
    type State = MonitoredState<L::State, L::Scalar, E>;
    type Guess = L::Guess;
    type Estimates = L::Estimates;
    const NO_GUESS: L::Guess = L::NO_GUESS;

    fn start_from(&self, sample: &L::Sample, guess: &L::Guess) -> Option<Self::State> {
        let (within, zero) = (self.law.start_from(sample, guess)?, L::Scalar::ZERO);
        let [counted, stuck, last, swings, against, speed, over, braking, most] = [zero; 9];
        let (side, stopped) = ([zero; E], false);
        Some(MonitoredState {
            counted,
            stuck,
            last,
            swings,
            side,
            against,
            speed,
            within,
            over,
            braking,
            most,
            stopped,
        })
    }

    #[inline]
    fn not_started(&self) -> Self::Output {
        self.law.not_started()
    }

    #[inline]
    fn wait(&self, state: &mut Self::State) {
        self.law.wait(&mut state.within);
    }

    #[inline(always)]
    fn tick(&self, state: &mut Self::State, sample: &L::Sample) -> Self::Output {
        // A closure might be a call.
        if let Some(output) = self.stopped(state) {
            return output;
        }
        let output = self.law.tick(&mut state.within, sample);
        self.judged(state, output)
    }

    #[inline]
    fn lost(&self, state: &mut Self::State) -> Self::Output {
        if let Some(output) = self.stopped(state) {
            return output;
        }
        let output = self.law.lost(&mut state.within);
        self.judged(state, output)
    }

    #[inline]
    fn missed(&self, state: &mut Self::State, periods: u32) {
        self.law.missed(&mut state.within, periods);
    }

    #[inline]
    fn report_applied(state: &mut Self::State, u: L::Scalar) -> bool {
        L::report_applied(&mut state.within, u)
    }

    #[inline]
    fn limit(state: &mut Self::State, u: L::Scalar) -> bool {
        L::limit(&mut state.within, u)
    }

    fn estimates(&self, state: &Self::State) -> L::Estimates {
        self.law.estimates(&state.within)
    }

    /// A drive that has stopped stays so.
    fn take_over(&self, from: &Self, state: &Self::State, sample: &L::Sample) -> Result<Self::State, RetuneError> {
        let within = self.law.take_over(&from.law, &state.within, sample)?;
        Ok(MonitoredState { within, ..*state })
    }

    fn fingerprint(&self) -> u32 {
        let WatchTicks { stuck, wrong_way, patience, brake } = self.ticks;
        let ticks = [self.sigma_star, stuck, wrong_way, patience, brake, self.brake];
        let bounds = self.disturbance.into_iter().chain(ticks);
        let head = [self.law.fingerprint(), u32::from(self.stops_at.bits())];
        hash(head.into_iter().chain(bounds.flat_map(Real::to_words)))
    }
}
