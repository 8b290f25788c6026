//! Monitors of a drive: alarms for a plant or sensor that does not behave as the design assumes.
//!
//! The innovation gate of the law rejects physically impossible counts. So it detects a sensor that jumps, or freezes
//! in motion. A count that freezes at a turning point looks like a shaft at rest. The observer then takes the effect of
//! u on the real shaft for a disturbance that cancels it, and the loop runs away. Only the monitors detect this fault.
//! They are not optional if a runaway does harm.
//!
//! * *Disturbance*: |d| exceeds the largest value that load, friction and model errors explain.
//! * *Sliding variable*: unsaturated and with innovations of at most $\bar e_i$, σ* stays within
//!   $|\sigma^*| \le \lambda_2 = \sum_i |\Gamma_i| \bar e_i / \min(k_l T, 1)$. Here $\Gamma_i$ is the effect of a unit
//!   of innovation on σ ([`EncoderForm::sigma_star_bound`]). The monitor is masked while u is at a limit.
//! * *Stuck at a limit*: u is at a limit for a number of ticks while |σ| does not fall. Ten ticks within the limits
//!   erase one counted tick. So a loop that swings from limit to limit is detected too.
//! * *Lost*: more samples are missing than the law bridges.
//! * *Wrong way*: for [`Bounds::wrong_way_ticks`] consecutive ticks u is at a limit and against the speed $v$, and yet
//!   $|v|$ grows, with $\frac54 |b u| < |d| < \frac72 |b u|$. A reversed encoder, phase order or torque constant causes
//!   $d = -2 b u$. A bumper that throws the shaft back does so for a shorter time. A joint has a second condition: $d$
//!   of link and motor exceed their bounds with opposite signs, and $d$ of the motor exceeds $|b u|$. The twist of the
//!   spring then contradicts the two encoders.
//! * *Oscillates*: $d$ exceeds its bound with the opposite sign of the last time. Each such change counts for as long
//!   as u may be stuck at a limit, 0.2 s, and more than two are an alarm. So three changes within 0.1 s, or more than
//!   five per second for a longer time, raise it. An alternating load beyond the bound causes it, and false counts may
//!   cause it. Typed steps and saturated moves do not. A late task, an undeclared delay, a wrong inertia or torque
//!   constant lead to it.
//!
//! d and σ* raise an alarm only after some milliseconds beyond their bounds ([`Bounds::patience_ticks`]). One missed
//! interrupt or one false count raises none. A load beyond the bound that the loop holds raises an alarm too. At rest a
//! frozen count looks the same, and its u need not reach a limit before the shaft has run away.
//!
//! # Reactions to an alarm
//! The alarm is reported in [`Health`], and the caller may plan a controlled [`stop`](super::stop) of the reference.
//! That needs valid counts and enough current. So a drive [stops](Monitored::stopping_at) by itself at selected alarms.
//! At the last two alarms ([`RUNAWAY`]) it always stops, after one tick. A stop outputs the safe u, or 0 if there is no
//! safe output, until the drive is reset. It does not hold the last u, which may be the cause of the alarm.
//!
//! A drive with [braking](Monitored::braking) brakes first, as long as its counts are accepted:
//! $u = -(k_v v + \bar d) / b$ within the limits, with the estimated speed and without the target. $\bar d$ is the d of
//! a motor, so a load up to its bound is held. Once d exceeds 1.5 times its bound, the count may be frozen, and
//! $\bar d$ is 0 from there on. For a joint it is always 0: the spring damps the link. A wrong b changes $k_v$, and a
//! plant much lighter than its design does not tolerate this.
//!
//! The current is switched off at rest: after some time constants $1/k_v$ with u within its limits and $|v|$ small or
//! no longer falling. It is also switched off in these cases:
//! * Braking at the limit does not slow the shaft down for as long as u may be stuck at a limit.
//! * The shaft becomes faster than at the start of braking.
//! * The counts are lost for longer than the time until an alarm.
//! * A [`RUNAWAY`] occurs.

use core::mem::offset_of;

use super::chain::ChainModel;
use super::law::{DriveLaw, EncoderForm, StateOf};
use super::state::EncoderState;
use super::target::{Aim, Target};
use crate::controller::Output;
use crate::health::Health;
use crate::real::Real;
use crate::running::{ControlLaw, RetuneError, Running, Words, each_word, hash, next};

/// Alarm thresholds of the monitors for E encoders, by rule from a design ([`MotorDesign::bounds`],
/// [`JointDesign::bounds`]).
///
/// [`MotorDesign::bounds`]: super::MotorDesign::bounds
/// [`JointDesign::bounds`]: super::JointDesign::bounds
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Bounds<const E: usize> {
    /// Largest |d| of each shaft, rad/s².
    pub disturbance: [f64; E],
    /// Largest |σ*|. Infinite for no bound.
    pub sigma_star: f64,
    /// Ticks for which u may be at a limit while |σ| does not fall, and for which a sign change of d counts.
    pub stuck_ticks: u32,
    /// Consecutive ticks without an alarm in which the shaft accelerates against its current.
    pub wrong_way_ticks: u32,
    /// Ticks without an alarm in which d or σ* exceeds its bound, or a sample is missing. Each normal tick erases one
    /// of them.
    pub patience_ticks: u32,
    /// Brake gain k_v, 1/s: the ratio of deceleration to speed while the drive brakes.
    pub brake_per_s: f64,
    /// Ticks until a braking shaft counts as at rest: u is within its limits, and |v| is small or does not fall.
    pub brake_ticks: u32,
}

/// Longest time of u at a limit while |σ| does not fall, s.
const STUCK_S: f64 = 0.2;

/// Ticks in which a bounce looks like the wrong way.
const BOUNCE_TICKS: f64 = 6.0;
/// Travel from rest at the largest acceleration within which the wrong way is detected, rad, and its longest time, s.
const WRONG_WAY_RAD: f64 = 6e-3;
const WRONG_WAY_S: f64 = 0.01;

/// Time beyond a bound without an alarm, s, and its fewest ticks.
const PATIENCE_S: f64 = 0.008;
const PATIENCE_TICKS: f64 = 4.0;

/// Time constants of the brake below [`SLOW`] until the shaft counts as at rest. Its speed is then 1/3000 of the speed
/// at which u left its limit.
const BRAKE_CONSTANTS: f64 = 4.0;
/// Share of the largest brake command below which $k_v v / b$ is small.
const SLOW: f64 = 1.0 / 128.0;
/// Largest brake command relative to the first one. Half of the span of u is added. Beyond it the shaft has become
/// faster.
const FASTER: f64 = 1.25;

impl<const E: usize> Bounds<E> {
    /// Computes the thresholds for a law with these innovation gates: innovations up to p/(1 - p) of them.
    ///
    /// p/(1 - p) is the relative error of an acceleration under a gain with a relative error p. `fastest` is the
    /// acceleration of the driven shaft at the limit of u, rad/s². The brake arguments are its gain from speed to
    /// deceleration, 1/s, and the time constant of the slowed motion, s.
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

/// Returns p/(1 - p), for p up to 0.9.
pub(crate) fn misjudged(uncertain: f64) -> f64 {
    let p = if uncertain < 0.9 { uncertain } else { 0.9 };
    p / (1.0 - p)
}

/// Flags that raise an alarm. The other flags of [`Health`] are only reported.
pub const ALARMS: Health = ANSWERED.union(BEYOND_CONTROL);

/// Reaction to any alarm: brake as long as the counts are accepted, then stop.
pub const BRAKING: Health = ALARMS.union(Health::BRAKES);

/// Alarms to which a planned stop is an answer.
pub const ANSWERED: Health = Health::DISTURBANCE_OVER_BOUND.union(Health::SIGMA_STAR_OVER_BOUND);

/// Alarms to which a planned stop is no answer: u at its limit does not suffice, or there is no valid sample. A frozen
/// count leads to the first of them.
pub const BEYOND_CONTROL: Health = Health::STUCK_AT_LIMIT.union(Health::INPUT_REJECTED).union(RUNAWAY);

/// Alarms that stop every drive with monitors. The law makes these faults worse, and a planned stop uses the law.
pub const RUNAWAY: Health = Health::WRONG_WAY.union(Health::OSCILLATES);

/// Controller with disturbance estimates that monitors can watch.
pub trait Watched<const E: usize>: ControlLaw<Output = Output<<Self as ControlLaw>::Scalar>> {
    /// Returns d of each block, in its own unit.
    fn disturbance(state: &Self::State) -> [Self::Scalar; E];

    /// Returns the speed v of the driven block, the last one.
    fn speed(state: &Self::State) -> Self::Scalar;

    /// Returns the effect of one unit of u on its acceleration.
    fn gain(&self) -> Self::Scalar;

    /// Returns the reciprocal of this gain.
    fn per_gain(&self) -> Self::Scalar;

    /// Returns the limits of u in the design, lower and upper.
    fn nominal_limits(&self) -> [Self::Scalar; 2];

    /// Returns the present limits of u.
    fn range(&self, state: &Self::State) -> [Self::Scalar; 2];

    /// Replaces the output of the law by u. The law restarts from there.
    fn put_instead(state: &mut Self::State, u: Self::Scalar);

    /// Returns the units of this block per rad/s².
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

/// Drive with its monitors.
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
    /// Brake command u per unit of speed.
    brake: L::Scalar,
    /// Alarms that stop the drive in addition to a [`RUNAWAY`]. With [`Health::BRAKES`] the drive brakes first.
    stops_at: Health,
}

/// Tick limits of the monitors, as numbers that a tick compares (see [`Bounds`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WatchTicks<T> {
    /// Ticks of u at a limit.
    pub stuck: T,
    /// Ticks of the wrong way.
    pub wrong_way: T,
    /// Ticks beyond a bound.
    pub patience: T,
    /// Ticks of braking within the limits without a decrease of speed.
    pub brake: T,
}

impl<L: Watched<E>, const E: usize> Monitored<L, E> {
    /// Returns a monitored drive from known thresholds, for a `const`.
    ///
    /// They are |d| in the unit of each block, |σ*|, ticks, and brake command u per unit of speed.
    pub const fn from_parts(
        law: L,
        disturbance: [L::Scalar; E],
        sigma_star: L::Scalar,
        ticks: WatchTicks<L::Scalar>,
        brake: L::Scalar,
    ) -> Self {
        Self { law, disturbance, sigma_star, ticks, brake, stops_at: Health::OK }
    }

    /// Returns a drive with monitors for these bounds.
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

    /// Returns the thresholds of a tick: |d| in the unit of each block, |σ*| and brake command u per unit of speed,
    /// ticks.
    #[allow(clippy::type_complexity, reason = "three things that a caller takes apart at once")]
    pub const fn thresholds(&self) -> ([L::Scalar; E], [L::Scalar; 2], WatchTicks<L::Scalar>) {
        (self.disturbance, [self.sigma_star, self.brake], self.ticks)
    }

    /// Returns the drive with stops: every alarm stops the drive until it is [reset](crate::Running::reset).
    #[must_use]
    pub const fn stopping(self) -> Self {
        self.stopping_at(ALARMS)
    }

    /// Returns the drive with stops at selected alarms, for example [`BEYOND_CONTROL`] if a planned stop handles the
    /// others. A [`RUNAWAY`] always stops it.
    #[must_use]
    pub const fn stopping_at(mut self, alarms: Health) -> Self {
        self.stops_at = alarms;
        self
    }

    /// Returns the drive with braking: at an alarm it brakes as long as it accepts its counts, then it stops.
    #[must_use]
    pub const fn braking(self) -> Self {
        self.stopping_at(BRAKING)
    }
}

impl<L: Watched<E>, const E: usize> Monitored<L, E> {
    /// Triggers the reaction to an alarm from the next tick on, for events outside the drive: a switch, a door, a
    /// [`Fence`](super::Fence).
    ///
    /// The drive brakes or stops. It continues if its alarms are only reported, or handled by a planned stop.
    #[inline]
    pub fn trip(&self, state: &mut MonitoredState<L::State, L::Scalar, E>) {
        let (zero, one) = (L::Scalar::ZERO, L::Scalar::from_f64(1.0));
        if !self.stops_at.contains(Health::BRAKES) {
            state.stopped |= self.stops_at.intersects(ANSWERED);
        } else if !self.is_braking(state) {
            (state.braking, state.stuck, state.over) = (one, zero, zero);
            // Unknown before the first tick of braking.
            state.most = zero;
            state.counted += one;
        }
    }
}

impl<L: Watched<E>, const E: usize> Running<Monitored<L, E>> {
    /// Triggers [`Monitored::trip`] of a drive that has started.
    pub fn trip(&mut self) {
        if let Some(state) = &mut self.state {
            self.design.trip(state);
        }
    }

    /// Replaces the output by u within the present limits, and returns it. The law restarts from there. 0 before the
    /// start.
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
    /// Offsets and bit masks of the words that are not whole words: the byte of the law that must be 0 or 1, and the
    /// alarms.
    #[doc(hidden)]
    pub const PARTS_AT: [(usize, u32); 2] = [
        (offset_of!(Self, law) + EncoderForm::<T, M, A, E, N, S, FAST, LATE>::FLAG_AT, 0xff),
        (offset_of!(Self, stops_at), 0xffff),
    ];
    /// Byte offsets in a state of the bytes that must be 0 or 1.
    #[doc(hidden)]
    pub const FLAGS_AT: [usize; 2] = [
        offset_of!(MonitoredState<EncoderState<T, M, E, N, S, FAST, LATE>, T, E>, within)
            + EncoderState::<T, M, E, N, S, FAST, LATE>::FLAG_AT,
        offset_of!(MonitoredState<EncoderState<T, M, E, N, S, FAST, LATE>, T, E>, stopped),
    ];
}

/// Value for no bound, valid in f32 too.
pub(super) const LARGEST: f64 = 1e30;

/// State of a [`Monitored`] drive.
///
/// The order of fields matters. A longer row of numbers that are all 0 at a start would be set by a library call with a
/// loop, which has no WCET bound.
#[derive(Debug, PartialEq)]
#[repr(C)]
pub struct MonitoredState<S, T, const E: usize> {
    /// Sum of the counters below. While it is 0, a tick within its bounds is not examined.
    counted: T,
    /// Ticks at a limit without a decrease of |σ|, and the last |σ| there.
    stuck: T,
    last: T,
    /// Ticks for which the sign changes of d still count, and d of each block when it last exceeded its bound.
    swings: T,
    side: [T; E],
    /// Consecutive ticks of the wrong way, and the speed in the last tick at a limit.
    against: T,
    speed: T,
    within: S,
    /// Ticks beyond a bound, minus ticks within.
    over: T,
    /// Zero without braking, else 1 plus the ticks of braking within the limits without a decrease of speed.
    braking: T,
    /// Largest brake command. 0 before its first tick, below 0 if the brake does not hold against d.
    most: T,
    stopped: bool,
}

// Always inlined: a call would return the whole state, which an interrupt would copy in a loop.
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
    /// Returns the output of a drive that has stopped, or `None`.
    #[inline(always)]
    fn stopped(&self, state: &MonitoredState<L::State, L::Scalar, E>) -> Option<Output<L::Scalar>> {
        state.stopped.then(|| {
            let output = self.law.not_started();
            Output { health: Health::INPUT_REJECTED.union(Health::STOPPED), ..output }
        })
    }

    /// Returns the output of a tick with the flags of the monitors.
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

    /// Returns true if the tick is within its bounds and no counter is active.
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

    /// Sets the alarm bits in the output, and brakes or stops the drive as configured.
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

    /// Resets the counters of a drive without estimates and without current. With a lost sample, the drive has given up
    /// its position.
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

    /// Computes a tick of a drive that brakes.
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

    /// Returns true in the first tick of braking.
    #[doc(hidden)]
    #[inline(always)]
    pub fn is_first(state: &MonitoredState<L::State, L::Scalar, E>) -> bool {
        state.most == L::Scalar::ZERO
    }

    /// Sets the largest brake command in the first tick of braking, and whether the brake may hold against the load.
    #[doc(hidden)]
    #[inline(always)]
    pub fn begin_brake(&self, state: &mut MonitoredState<L::State, L::Scalar, E>) {
        let ([u_min, u_max], asks) = (self.law.nominal_limits(), self.brake * L::speed(&state.within));
        let most = L::Scalar::from_f64(FASTER) * asks.abs() + L::Scalar::HALF * (u_max - u_min);
        state.most = if E == 1 && self.may_hold(state) { most } else { -most };
    }

    /// Returns true if d is a load that the brake may hold. A wrong inertia causes d too.
    #[inline(always)]
    fn may_hold(&self, state: &MonitoredState<L::State, L::Scalar, E>) -> bool {
        L::disturbance(&state.within)[0].abs() <= L::Scalar::from_f64(1.5) * self.disturbance[0]
    }

    #[doc(hidden)]
    #[inline(always)]
    pub fn is_braking(&self, state: &MonitoredState<L::State, L::Scalar, E>) -> bool {
        self.stops_at.contains(Health::BRAKES) && state.braking > L::Scalar::ZERO
    }

    /// Returns the brake command, and true if the limits cut it.
    #[doc(hidden)]
    #[inline(always)]
    pub fn slowing(&self, state: &MonitoredState<L::State, L::Scalar, E>) -> (L::Scalar, bool) {
        let [u_min, u_max] = self.law.range(&state.within);
        let mut asked = -(self.brake * L::speed(&state.within));
        if E == 1 {
            let load = if state.most > L::Scalar::ZERO { L::disturbance(&state.within)[0] } else { L::Scalar::ZERO };
            asked -= self.law.per_gain() * load;
        }
        // A speed that is not a number gives a command of 0.
        let asked = if asked.abs() <= L::Scalar::from_f64(LARGEST) { asked } else { L::Scalar::ZERO };
        let u = asked.limited(u_min, u_max);
        (u, u != asked)
    }

    /// Updates the counters for a tick. Returns true for a disturbance, and for σ*, beyond its bound.
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

    /// Updates the counters of a drive that brakes, whose speed must fall at a limit.
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

    /// Returns the disturbances beyond their bounds. A sign change counts.
    #[inline(always)]
    fn sides(&self, state: &mut MonitoredState<L::State, L::Scalar, E>) -> [bool; E] {
        let d = L::disturbance(&state.within);
        let (mut over, mut has_changed) = ([false; E], false);
        for i in 0..E {
            // NaN counts as beyond any bound.
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

    /// Counts a tick at a limit, and checks the quantity that must fall there.
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
            // At full current without a valid count the direction is unknown.
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

    /// Sets the flags for the counters, and starts the reaction.
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
                // Braking makes it worse if the shaft moves the wrong way. A few ticks decide this.
                self.trip(state);
            }
        }
        let output = self.runaway(state, output);
        state.counted = state.stuck + state.swings + state.against + state.over + state.braking;
        output
    }

    /// Returns the output of a drive that brakes, or switches the current off.
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
        // Keeps the count until the drive is reset.
        state.counted = state.braking;
        self.runaway(state, output)
    }

    /// Handles the alarms that stop any drive, from the next tick on. The present u still comes from the law.
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

    /// Stops the drive: the fallback is the output from now on.
    #[inline(always)]
    fn stop(&self, state: &mut MonitoredState<L::State, L::Scalar, E>, output: Output<L::Scalar>) -> Output<L::Scalar> {
        state.stopped = true;
        Output { u: self.law.not_started().u, health: output.health.union(Health::STOPPED), ..output }
    }
}

impl<L: Watched<E>, const E: usize> Monitored<L, E> {
    /// Returns true if the driven shaft at a limit of u accelerates against u, by the effect of u with reversed sign.
    /// Also true if the shafts of a joint contradict its spring.
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

/// Returns the number minus `by`, but at least 0. Returns 0 for NaN.
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
        // A closure might become a call.
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

    /// Keeps a stopped drive stopped.
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
