//! Drive in this process: encoder counts in, current out, along a reference trajectory.
//!
//! The controller is [`EncoderForm`](drive::EncoderForm) in f32, the same code as on a chip. Gain sets, delay, states
//! and control mode are types there and numbers here ([`Form`]). The sample is the counts of
//! [`Encoders`](crate::sensor::encoder::Encoders). [`Mounted`] removes sign and offset, like a program on the chip.
//!
//! A [`Motion`] waits at rest, moves for some ticks, and then follows its goal:
//!
//! ```text
//! r = from      tick < start
//! r = join      start <= tick < start + ticks       (drive::Joined: r and its derivatives are continuous)
//! r = goal      from there on
//! ```
//!
//! After an alarm of its monitors a drive goes on, stops, or makes a controlled stop ([`Reaction`]).
//!
//! The reference is computed in f32 for the controller and in f64 for the recorder. The estimates are the disturbance
//! of each shaft (rad/s²), in the channel of its speed.

use std::any::Any;
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

use controller_core::drive::{
    self, Bounds, DriveError, DriveLaw, Fence, FenceLimits, Joined, Monitored, Player, Reference, Rest, RestBand,
    RestLearning, Resting, Sample, Sine, Streamed, Target, Watched,
};
use controller_core::{ControlLaw as _, Health, MAX_R, Output, Real, Running};

use crate::MAX_ORDER;
use crate::port::{ControllerPort, PortError, Tick, numbers};
use crate::sensor::encoder::Mounted;

mod in_f64;
mod kind;

pub use kind::{AnyLaw, Bandwidths, DriveAtRest, DriveDesign, DriveOf, Thresholds};

/// Units of an angle in fixed point, per revolution.
const TWO_32: f64 = 4_294_967_296.0;

/// Goal of a motion.
#[derive(Clone, Debug, PartialEq)]
pub enum Goal {
    /// Rest at an angle.
    Rest {
        /// Angle of the goal, rad.
        angle_rad: f64,
    },
    /// Sine A sin ωt about angle 0, with phase 0 at tick 0.
    Sine {
        /// Amplitude A, rad.
        amplitude_rad: f64,
        /// Angular frequency ω, rad/s.
        omega_rad_s: f64,
    },
    /// Smooth curve through points at a constant interval, the first at the start. It lags by 3.5 intervals.
    Points {
        /// Angles of the points, rad.
        angles_rad: Vec<f64>,
        /// Interval between two points, ticks.
        every: u32,
    },
    /// Set-points at a constant interval, through a profile ([`drive::Profile`]), the first at the start.
    SetPoints {
        /// Set-points, rad.
        angles_rad: Vec<f64>,
        /// Interval between two set-points, ticks.
        every: u32,
        /// Limits of the profile.
        limits: drive::ProfileLimits,
        /// End of the computed path, ticks.
        until: u32,
    },
    /// Constant speed. The transition to it loses half of the angle that the speed would cover.
    Speed {
        /// Speed, rad/s.
        speed_rad_s: f64,
    },
}

/// Motion from rest to a goal.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Goal of the motion.
    pub goal: Goal,
    /// Angle at rest before the motion, rad.
    pub from_rad: f64,
    /// Tick at which the motion begins.
    pub start: u32,
    /// Length of the transition from rest to the goal, ticks.
    pub ticks: u32,
    /// Period of a tick, s.
    pub period_s: f64,
}

impl Motion {
    /// Returns a motion that rests at this angle for ever. Build other motions from it, as
    /// `Motion { goal, ..Motion::rest(0.3, 1e-3) }`.
    pub const fn rest(angle_rad: f64, period_s: f64) -> Self {
        Self { goal: Goal::Rest { angle_rad }, from_rad: angle_rad, start: 0, ticks: 1, period_s }
    }

    /// Returns the motion with the shortest transition to its goal that keeps the current `feed_forward` of the
    /// trajectory points within ±`u_max`. It takes from `fewest` to `most` ticks, and at least 20
    /// ([`drive::shortest`]). `None` if no transition does.
    #[must_use]
    pub fn shortest<const M: usize, const J: usize>(
        &self,
        [fewest, most]: [u32; 2],
        u_max: f64,
        feed_forward: impl Fn(&[f64; J]) -> f64,
    ) -> Option<Self> {
        let with = |ticks| Self { ticks, ..self.clone() };
        let plan = |ticks| with(ticks).plan::<f64, M>();
        drive::shortest(self.start, fewest, most, u_max, feed_forward, plan).map(with)
    }

    /// Returns the largest |values| of several functions of the trajectory points in ticks 0 to `last`. The path of
    /// set-points is computed once for all functions.
    pub fn peaks<const M: usize, const J: usize, const K: usize>(
        &self,
        last: u32,
        of: impl Fn(&[f64; J]) -> [f64; K],
    ) -> [f64; K] {
        let plan = self.plan::<f64, M>();
        (0..=last).fold([0.0; K], |most, tick| {
            let values = of(&Reference::<f64, J>::at(&plan, tick).jet);
            std::array::from_fn(|i| most[i].max(values[i].abs()))
        })
    }

    /// Returns the plan of a stop from `present` at this tick to rest, in this number of ticks or fewer.
    fn stopping<T: Real<Count = i32>, const M: usize>(
        &self,
        present: &Target<T, i32, M>,
        start: u32,
        ticks: u32,
    ) -> Plan<T, M> {
        let (goal, ticks) = drive::stop(present, ticks, self.period_s);
        let gap = drive::gap(present, &Reference::at(&goal, start));
        let after = Joined::new(Course::Rest(goal), gap, start, ticks, self.period_s);
        Plan { before: goal, start, after }
    }

    /// Returns a function of the tick that gives r, r', .. with whole revolutions included, for a custom controller. In
    /// the transition to the goal the first `M` of them are continuous: 4 for the drive of a joint, 3 for a motor.
    pub fn jets<const M: usize, const J: usize>(&self) -> impl Fn(u32) -> [f64; J] + Send + Sync + use<M, J> {
        let plan = self.plan::<f64, M>();
        move |tick| {
            let Target { turn, mut jet } = plan.at(tick);
            jet[0] += TAU * f64::from(turn);
            jet
        }
    }

    /// Returns a player of the motion from this tick on.
    fn played<T: Real<Count = i32>, const M: usize, const J: usize>(&self, tick: u32) -> Played<T, M, J> {
        Player::new(self.plan(), tick)
    }

    fn plan<T: Real<Count = i32>, const M: usize>(&self) -> Plan<T, M> {
        let Self { ref goal, from_rad, start, ticks, period_s } = *self;
        let rest = |angle_rad: f64| {
            let (turn, rest_rad) = turns_and_rest(angle_rad);
            Rest { turn, angle: T::from_f64(rest_rad) }
        };
        let course = match goal {
            Goal::Rest { angle_rad } => Course::Rest(rest(*angle_rad)),
            Goal::Sine { amplitude_rad, omega_rad_s } => {
                Course::Sine(Sine::new(*amplitude_rad, *omega_rad_s, period_s))
            }
            Goal::Points { angles_rad, every } => Course::Points(Points::new(angles_rad, *every, start, period_s)),
            Goal::SetPoints { angles_rad, every, limits, until } => {
                let path = match M {
                    3 => path::<T, 2, 3>(from_rad, angles_rad, *every, limits, period_s, *until),
                    _ => path::<T, 3, 4>(from_rad, angles_rad, *every, limits, period_s, *until),
                };
                Course::SetPoints(Path { targets: path.into(), start, per_s: T::from_f64(1.0 / period_s) })
            }
            Goal::Speed { speed_rad_s } => {
                let before = 0.5 * f64::from(ticks) * period_s * speed_rad_s;
                Course::Turning(Turning::new(from_rad - before, *speed_rad_s, start, period_s))
            }
        };
        let before = rest(from_rad);
        // The gap is computed in f64 for any precision of the plan, so that all plans agree.
        let mut present = Target { turn: before.turn, jet: [T::ZERO; M] };
        present.jet[0] = before.angle;
        let gap = drive::gap(&present, &course.at(start));
        Plan { before, start, after: Joined::new(course, gap, start, ticks, period_s) }
    }
}

/// Player of a motion: targets at both ends of each tick.
type Played<T, const M: usize, const J: usize> = Player<T, Plan<T, M>, J>;

/// Plan of a motion, ready to be played.
#[derive(Clone, Debug)]
struct Plan<T, const M: usize> {
    before: Rest<T>,
    start: u32,
    after: Joined<T, Course<T>, M>,
}

impl<T: Real<Count = i32>, const M: usize, const J: usize> Reference<T, J> for Plan<T, M> {
    fn at(&self, tick: u32) -> Target<T, i32, J> {
        if tick < self.start { self.before.at(tick) } else { self.after.at(tick) }
    }
}

#[derive(Clone, Debug)]
enum Course<T> {
    Rest(Rest<T>),
    Sine(Sine<T>),
    Points(Points<T>),
    SetPoints(Path<T>),
    Turning(Turning<T>),
}

impl<T: Real<Count = i32>, const J: usize> Reference<T, J> for Course<T> {
    fn at(&self, tick: u32) -> Target<T, i32, J> {
        match self {
            Self::Rest(rest) => rest.at(tick),
            Self::Sine(sine) => sine.at(tick),
            Self::Points(points) => points.at(tick),
            Self::SetPoints(path) => path.at(tick),
            Self::Turning(turning) => turning.at(tick),
        }
    }
}

/// State of the stream of points after each point arrived.
#[derive(Clone, Debug)]
struct Points<T> {
    streams: Arc<[Streamed<T>]>,
    start: u32,
    every: u32,
}

impl<T: Real<Count = i32>> Points<T> {
    fn new(angles_rad: &[f64], every: u32, start: u32, period_s: f64) -> Self {
        let angle = |rad: &f64| Streamed::<T>::angle(*rad);
        let first = angles_rad.first().map_or(0, angle);
        let mut stream = Streamed::new(first, every, period_s);
        // The last point repeats until the curve rests there.
        let last = angles_rad.last().map_or(0, angle);
        let coming = angles_rad.iter().map(angle).chain([last; 6]);
        let streams = coming.enumerate().map(|(k, angle)| {
            stream.push(angle, start + k as u32 * every);
            stream
        });
        Self { streams: streams.collect(), start, every }
    }
}

impl<T: Real<Count = i32>, const J: usize> Reference<T, J> for Points<T> {
    fn at(&self, tick: u32) -> Target<T, i32, J> {
        let k = (tick.saturating_sub(self.start) / self.every) as usize;
        self.streams[k.min(self.streams.len() - 1)].at(tick)
    }
}

/// Splits an angle into revolutions and a remainder, so that f32 keeps its digits.
fn turns_and_rest(angle_rad: f64) -> (i32, f64) {
    let turn = libm::round(angle_rad / TAU);
    (turn as i32, angle_rad - turn * TAU)
}

/// Returns the target with this angle, rad, and its derivatives. Missing derivatives are 0.
pub fn target_at<const N: usize>(jet: &[f64]) -> Target<f32, i32, N> {
    let (turn, rest) = turns_and_rest(jet.first().copied().unwrap_or(0.0));
    let mut target = Target { turn, jet: std::array::from_fn(|j| jet.get(j).map_or(0.0, |&rate| rate as f32)) };
    target.jet[0] = rest as f32;
    target
}

/// Returns the targets of a profile from rest, one per tick from the start on. Goals that the profile refuses are
/// skipped.
fn path<T: Real<Count = i32>, const M: usize, const J: usize>(
    from_rad: f64,
    angles_rad: &[f64],
    every: u32,
    limits: &drive::ProfileLimits,
    period_s: f64,
    until: u32,
) -> Vec<Target<T, i32, 4>> {
    let (turn, rad) = turns_and_rest(from_rad);
    let mut jet = [T::ZERO; 4];
    jet[0] = T::from_f64(rad);
    let mut targets = vec![Target { turn, jet }];
    let Ok(mut profile) = drive::Profile::<T, M, 1024>::new(limits, period_s) else { return targets };
    profile.start(turn, rad, 0.0);
    for tick in 0..until {
        if let Some(&angle) = angles_rad.get((tick / every) as usize).filter(|_| tick.is_multiple_of(every)) {
            let (turn, rad) = turns_and_rest(angle);
            profile.go_to(turn, rad);
        }
        let Target { turn, jet } = profile.next_tick::<J>();
        targets.push(Target { turn, jet: std::array::from_fn(|j| jet.get(j).copied().unwrap_or(T::ZERO)) });
    }
    targets
}

/// Path computed by a profile.
#[derive(Clone, Debug)]
struct Path<T> {
    targets: Arc<[Target<T, i32, 4>]>,
    start: u32,
    per_s: T,
}

impl<T: Real<Count = i32>, const J: usize> Reference<T, J> for Path<T> {
    fn at(&self, tick: u32) -> Target<T, i32, J> {
        let last = self.targets.len() - 1;
        let k = (tick.saturating_sub(self.start) as usize).min(last);
        let Target { turn, jet } = self.targets[k];
        // The derivative above those of the path is constant within a tick, and equals the change to the next tick.
        let above = (self.targets[(k + 1).min(last)].jet[3] - jet[3]) * self.per_s;
        Target { turn, jet: std::array::from_fn(|j| jet.get(j).copied().unwrap_or(above)) }
    }
}

/// Rotation at constant speed. The angle is an integer that wraps with the revolutions, so it never drifts.
#[derive(Clone, Copy, Debug)]
struct Turning<T> {
    /// Angle at the start, in 2^-32 revolutions.
    begin: i64,
    per_tick: i64,
    start: u32,
    speed: T,
}

impl<T: Real<Count = i32>> Turning<T> {
    fn new(from_rad: f64, speed_rad_s: f64, start: u32, period_s: f64) -> Self {
        let per_tick = libm::round(speed_rad_s * period_s / TAU * TWO_32);
        let speed = T::from_f64(per_tick / TWO_32 * TAU / period_s);
        Self { begin: libm::round(from_rad / TAU * TWO_32) as i64, per_tick: per_tick as i64, start, speed }
    }
}

impl<T: Real<Count = i32>, const J: usize> Reference<T, J> for Turning<T> {
    fn at(&self, tick: u32) -> Target<T, i32, J> {
        let angle = self.begin.wrapping_add(self.per_tick.wrapping_mul(i64::from(tick) - i64::from(self.start)));
        let turn = angle.wrapping_add(1 << 31) >> 32;
        let mut jet = [T::ZERO; J];
        jet[0] = T::from_f64(angle.wrapping_sub(turn << 32) as f64 * (TAU / TWO_32));
        if let Some(speed) = jet.get_mut(1) {
            *speed = self.speed;
        }
        Target { turn: turn as i32, jet }
    }
}

/// Control mode of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Follows {
    /// Position control.
    Position,
    /// Speed control.
    Speed,
}

/// Type parameters of a drive as numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Form {
    /// Control mode.
    pub follows: Follows,
    /// Number of gain sets: 1, or 2 with high gains.
    pub gain_sets: usize,
    /// Delay from the computation of u until it is held, 0 to 3 ticks.
    pub delay_ticks: usize,
    /// Number of states of a motor's observer, 3 or 4. A joint has 4.
    pub observer_states: usize,
}

impl Form {
    /// Returns three flags and the ticks of delay, for [`drives!`](controller_core::drives). The flags are speed
    /// control, two gain sets, and observers with four states.
    #[inline]
    pub const fn types(self) -> ([bool; 3], usize) {
        let Self { follows, gain_sets, delay_ticks, observer_states } = self;
        ([matches!(follows, Follows::Speed), gain_sets > 1, observer_states > 3], delay_ticks)
    }
}

/// Returns the ticks of delay of the type for this delay. A small program has the types for at most one tick.
pub const fn typed(delay_ticks: usize) -> usize {
    if cfg!(feature = "drives-only") && delay_ticks > 1 { 1 } else { delay_ticks }
}

/// Control mode of the type for a control mode.
pub type Typed<A> = <A as Mode>::Typed;

/// Control mode with a type. A small program has the type for position control alone.
pub trait Mode {
    /// Control mode of the type.
    type Typed;
}

impl Mode for drive::Position {
    type Typed = Self;
}

impl Mode for drive::Speed {
    #[cfg(not(feature = "drives-only"))]
    type Typed = Self;
    #[cfg(feature = "drives-only")]
    type Typed = drive::Position;
}

/// Limits of the monitors of a drive, and its reaction to an alarm. The controller adds the limits that are not set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monitors<const E: usize> {
    /// Relative uncertainty of the data sheet, for the thresholds by rule.
    pub uncertain: f64,
    /// Largest |d| of each shaft, rad/s². `None` by rule.
    pub disturbance: [Option<f64>; E],
    /// Largest |σ*|. `None` by rule.
    pub sigma_star: Option<f64>,
    /// Largest number of ticks with u at a limit while |σ| does not fall. `None` by rule.
    pub stuck_ticks: Option<u32>,
    /// Largest sudden load, N m. It enters the thresholds by rule of a joint, but not of a motor.
    pub sudden_load_n_m: f64,
    /// Reaction to an alarm.
    pub reaction: Reaction,
    /// Limits of position, speed and tracking error. A violation is an alarm. `None` for no limits.
    pub fence: Option<FenceLimits>,
    /// Rest band of a motor in position control, within which the motor is left at rest. `None` for none.
    pub rest_band: Option<RestLearning>,
}

impl<const E: usize> Monitors<E> {
    fn bounds(&self, by_rule: &Bounds<E>) -> Bounds<E> {
        Bounds {
            disturbance: std::array::from_fn(|i| self.disturbance[i].unwrap_or(by_rule.disturbance[i])),
            sigma_star: self.sigma_star.unwrap_or(by_rule.sigma_star),
            stuck_ticks: self.stuck_ticks.unwrap_or(by_rule.stuck_ticks),
            ..*by_rule
        }
    }
}

/// Reaction of a drive to an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// The alarm is reported only. A [`RUNAWAY`](drive::RUNAWAY) stops the drive, as with the other reactions.
    GoOn,
    /// The drive brakes as long as its counts are valid. Then the output is the safe output.
    Brake,
    /// The output is the safe output from then on.
    Fallback,
    /// Controlled stop: the reference comes to rest in this number of ticks. After an alarm of
    /// [`BEYOND_CONTROL`](drive::BEYOND_CONTROL) the output is the safe output instead: u stuck at a limit, rejected
    /// counts, or a runaway. With a frozen count no controlled stop is possible.
    JoinedStop {
        /// Length of the stop, from the end of the tick with the alarm, ticks.
        ticks: u32,
    },
}

impl Reaction {
    /// Returns the alarms that stop the drive immediately, in addition to the alarms that stop any drive.
    pub const fn stops_at(self) -> Health {
        match self {
            Self::GoOn => Health::OK,
            Self::Brake => drive::BRAKING,
            Self::Fallback => drive::ALARMS,
            Self::JoinedStop { .. } => drive::BEYOND_CONTROL,
        }
    }
}

/// Running controller of a drive with its monitors, in this process or on a target.
pub trait Law<const E: usize, const N: usize>: Send {
    /// Runs one tick and returns its output and estimates. In speed control only r' is used.
    ///
    /// # Errors
    /// Fails if the controller cannot be reached.
    fn tick(&mut self, sample: &Sample<i32, Target<f32, i32, N>, E>) -> Result<Ticked<E>, PortError>;

    /// Reports the value that the actuator has held since the last tick.
    fn report_applied(&mut self, u: f32);

    /// Reports that `periods` periods have passed without a tick.
    fn missed(&mut self, periods: u32) {
        let _ = periods;
    }

    /// Clears the state. The next counts start the controller again.
    ///
    /// # Errors
    /// Fails if the controller cannot be reached.
    fn reset(&mut self) -> Result<(), PortError>;

    /// Returns the state as numbers, exact to the bit and of one length. Empty for a controller that does not show it.
    fn state(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Restores a [`state`](Self::state). Returns `false` for numbers that are not a state of this controller.
    fn set_state(&mut self, numbers: &[f64]) -> bool {
        numbers.is_empty()
    }

    /// Returns the fingerprint of the design, or `None` if it is not available.
    fn fingerprint(&self) -> Option<u32>;

    /// Switches to another controller of the same type, before the tick with this sample.
    ///
    /// # Errors
    /// Fails if the controller is of another type or cannot take over. The present controller then goes on.
    fn take(&mut self, _: Box<dyn Any>, _: &Sample<i32, Target<f32, i32, N>, E>) -> Result<(), PortError> {
        Err(PortError::Refused("this controller runs on a target: change its design there".into()))
    }
}

/// Output of a tick, and the disturbance of each shaft, rad/s² (0 before the start).
pub type Ticked<const E: usize> = (Output<f32>, [f32; E]);

/// Functions around a controller within its monitors: the rest band before a tick and the fence after it.
#[derive(Clone, Copy, Debug)]
struct Around {
    fence: Option<Fence>,
    rest_band: Option<RestBand>,
}

impl Around {
    /// Returns the targets of a tick after the rest band.
    fn placed<L, const E: usize, const N: usize>(
        &self,
        resting: &mut Resting,
        running: &Running<Monitored<L, E>>,
        sample: &Sample<i32, Target<f32, i32, N>, E>,
    ) -> (L::Sample, Health)
    where
        L: Watched<E> + DriveLaw<E, N>,
    {
        let Sample { counts, mut begin, mut end } = *sample;
        let hunts = self
            .rest_band
            .map_or(Health::OK, |band| band.place(resting, running.estimates().as_ref(), &mut begin, &mut end));
        (L::sample(counts, &begin, &end), hunts)
    }
}

/// Returns the words of the state of a drive that are integers: two flags, and the counts of `encoders` encoders.
fn whole_words(encoders: usize) -> [Range<usize>; 2] {
    let fresh = 10 + encoders;
    [0..1, fresh..fresh + 2 + 2 * encoders]
}

/// Words of the state of a rest band that are integers: the revolution, the lower set and its returns.
const WHOLE_OF_REST: &[Range<usize>] = &[6..7, 11..12, 13..14];

/// Drive in this process.
struct Whole<L: Watched<E>, const E: usize> {
    running: Running<Monitored<L, E>>,
    around: Around,
    resting: Resting,
}

impl<L, const E: usize, const N: usize> Law<E, N> for Whole<L, E>
where
    L: Watched<E> + DriveLaw<E, N> + Send + 'static,
    L::State: Send,
{
    fn tick(&mut self, sample: &Sample<i32, Target<f32, i32, N>, E>) -> Result<Ticked<E>, PortError> {
        let begin = &sample.begin;
        let (sample, hunts) = self.around.placed(&mut self.resting, &self.running, sample);
        self.running.start_at_once(&sample);
        let mut output = self.running.tick(&sample);
        if !output.health.intersects(Health::STOPPED.union(Health::BRAKES)) {
            output.health |= hunts;
        }
        if let Some(band) = &self.around.rest_band {
            band.calm(&mut self.resting, &mut self.running, &mut output);
        }
        if let Some(fence) = &self.around.fence {
            fence.guard(&mut self.running, &mut output, begin);
        }
        let known = self.running.estimates();
        Ok((output, known.map_or([0.0; E], |known| known.disturbance)))
    }

    fn report_applied(&mut self, u: f32) {
        self.running.report_applied(u);
    }

    fn missed(&mut self, periods: u32) {
        self.running.missed(periods);
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.running.reset();
        Ok(())
    }

    fn state(&self) -> Vec<f64> {
        let at_zero = Target { turn: 0, jet: [0.0; N] };
        let still = L::sample([Some(0); E], &at_zero, &at_zero);
        let mut state = numbers::of(&self.running, &whole_words(E), &still);
        state.extend(numbers::numbers::<f32>(&self.resting.words().collect::<Vec<_>>(), WHOLE_OF_REST));
        state
    }

    fn set_state(&mut self, state: &[f64]) -> bool {
        let of_rest = Resting::START.words().count();
        let Some((law, rest)) = state.len().checked_sub(of_rest).and_then(|at| state.split_at_checked(at)) else {
            return false;
        };
        let resting = Resting::from_words(&mut numbers::words::<f32>(rest, WHOLE_OF_REST).into_iter());
        let Some(resting) = resting.filter(|_| numbers::restore(&mut self.running, &whole_words(E), law)) else {
            return false;
        };
        self.resting = resting;
        true
    }

    fn fingerprint(&self) -> Option<u32> {
        Some(self.running.design().fingerprint())
    }

    fn take(&mut self, other: Box<dyn Any>, sample: &Sample<i32, Target<f32, i32, N>, E>) -> Result<(), PortError> {
        let other = other.downcast::<(Monitored<L, E>, Around)>().map_err(|_| {
            PortError::Refused(
                "the other design has a different drive, gain sets, delay, states or control mode".into(),
            )
        })?;
        let (law, around) = *other;
        // The switch uses the targets of the coming tick. That tick moves the rest band itself, so this is a copy.
        let (sample, _) = around.placed(&mut { self.resting }, &self.running, sample);
        self.running.retune(law, &sample).map_err(|error| PortError::Refused(error.to_string()))?;
        self.around = around;
        Ok(())
    }
}

/// Drive that accepts motions and designs while it runs.
pub trait LivePort: ControllerPort {
    /// Starts another motion with the coming tick. The motion waits where the present one rests.
    fn play(&mut self, motion: &Motion);

    /// Switches to another design of the same form before the coming tick, without a jump of u. With `at_rest` the
    /// offset W is 0 instead ([`at_rest`](drive::EncoderForm::at_rest)). If the switch is impossible, that tick returns
    /// the error.
    ///
    /// # Errors
    /// Fails with the error of the design.
    fn retune(&mut self, to: &DriveDesign, at_rest: bool) -> Result<(), DriveError>;
}

/// Flags that start a controlled stop.
const ANSWERS: Health = drive::ANSWERED.union(drive::FENCED);

/// Controller with its encoders and its reference. The plan is continuous in `P` derivatives, r included.
struct Drive<'a, const E: usize, const N: usize, const P: usize> {
    law: Box<dyn Law<E, N> + 'a>,
    mounted: [Mounted; E],
    /// Rest band and fence, for the fingerprint.
    around: Around,
    follows: Follows,
    /// Delay from the computation of u until it is held, ticks.
    late: u32,
    player: Played<f32, P, N>,
    motion: Motion,
    exact: Plan<f64, P>,
    /// Length of a controlled stop after an alarm, ticks, and the stop in progress.
    stop_ticks: Option<u32>,
    stopping: Option<Plan<f64, P>>,
    /// Controller that takes over with the coming tick.
    successor: Option<Box<dyn Any + Send>>,
    tick: u32,
    r: f64,
}

impl<'a, const E: usize, const N: usize, const P: usize> Drive<'a, E, N, P> {
    fn new(
        law: Box<dyn Law<E, N> + 'a>,
        (mounted, around): ([Mounted; E], Around),
        form: Form,
        reaction: Reaction,
        motion: &Motion,
    ) -> Self {
        let late = form.delay_ticks as u32;
        Self {
            law,
            mounted,
            around,
            follows: form.follows,
            late,
            player: motion.played(late),
            motion: motion.clone(),
            exact: motion.plan(),
            stop_ticks: if let Reaction::JoinedStop { ticks } = reaction { Some(ticks) } else { None },
            stopping: None,
            successor: None,
            tick: 0,
            r: 0.0,
        }
    }

    /// Begins a controlled stop from the present reference.
    fn begin_to_stop(&mut self, ticks: u32) {
        let start = self.player.tick();
        let present: Target<f32, i32, P> = self.player.reference_mut().at(start);
        self.player.play(self.motion.stopping(&present, start, ticks));
        let present: Target<f64, i32, P> = self.exact.at(start);
        self.stopping = Some(self.motion.stopping(&present, start, ticks));
    }
}

impl<const E: usize, const N: usize, const P: usize> ControllerPort for Drive<'_, E, N, P> {
    fn tick(&mut self, sample: &[f64]) -> Result<Tick, PortError> {
        let count = |i: usize| sample.get(i).and_then(|&count| self.mounted[i].upright(count));
        let counts = std::array::from_fn(count);
        let [begin, end] = self.player.next_tick();
        let sample = Sample { counts, begin, end };
        if let Some(successor) = self.successor.take() {
            self.law.take(successor, &sample)?;
        }
        let (output, disturbance) = self.law.tick(&sample)?;
        let Output { u, sigma, sigma_star, health } = output;
        let plan = self.stopping.as_ref().filter(|plan| self.tick >= plan.start).unwrap_or(&self.exact);
        let target: Target<f64, i32, 2> = plan.at(self.tick);
        self.r = match self.follows {
            Follows::Position => TAU * f64::from(target.turn) + target.jet[0],
            Follows::Speed => target.jet[1],
        };
        if let Some(ticks) = self.stop_ticks.filter(|_| self.stopping.is_none() && health.intersects(ANSWERS)) {
            self.begin_to_stop(ticks);
        }
        self.tick += 1;
        let mut estimates = [[0.0; MAX_R]; MAX_ORDER];
        for (i, d) in disturbance.into_iter().enumerate() {
            estimates[2 * i + 1][0] = f64::from(d);
        }
        let [u, sigma, sigma_star] = [u, sigma, sigma_star].map(f64::from);
        Ok(Tick { u, sigma, sigma_star, estimates, health })
    }

    fn report_applied(&mut self, u: f64) {
        self.law.report_applied(u as f32);
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.player = self.motion.played(self.late);
        (self.stopping, self.tick, self.r) = (None, 0, 0.0);
        self.law.reset()
    }

    fn observed(&self) -> &[usize] {
        &[1, 3][..E]
    }

    fn follows(&self) -> Option<usize> {
        Some(usize::from(self.follows == Follows::Speed))
    }

    fn reference(&self) -> f64 {
        self.r
    }

    fn fingerprint(&self) -> Option<u32> {
        let mounting = self.mounted.map(|mounted| mounted.mounting);
        let Around { fence, rest_band } = &self.around;
        let (stop_ticks, fence, rest_band) = (self.stop_ticks.unwrap_or(0), fence.as_ref(), rest_band.as_ref());
        self.law.fingerprint().map(|law| drive::fingerprint(law, &mounting, stop_ticks, fence, rest_band))
    }
}

impl<const E: usize, const N: usize, const P: usize> LivePort for Drive<'_, E, N, P> {
    fn play(&mut self, motion: &Motion) {
        self.player.play(motion.plan());
        (self.motion, self.exact, self.stopping) = (motion.clone(), motion.plan(), None);
    }

    fn retune(&mut self, to: &DriveDesign, at_rest: bool) -> Result<(), DriveError> {
        self.successor = Some(to.successor(at_rest)?);
        self.around = to.around();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(goal: Goal) -> Motion {
        Motion { goal, start: 50, ticks: 100, ..Motion::rest(0.3, 1e-3) }
    }

    fn jets<T: Real<Count = i32>>(motion: &Motion, ticks: u32) -> Vec<[f64; 3]> {
        let plan = motion.plan::<T, 3>();
        let jet = |tick| {
            let Target { turn, jet } = Reference::<T, 3>::at(&plan, tick);
            let [r, v, a] = jet.map(T::to_f64);
            [TAU * f64::from(turn) + r, v, a]
        };
        (0..ticks).map(jet).collect()
    }

    fn goals() -> [Goal; 4] {
        let angles_rad = (0..30).map(|k| 0.5 * (0.1 * f64::from(k)).sin()).collect();
        [
            Goal::Rest { angle_rad: -40.0 },
            Goal::Sine { amplitude_rad: 1.0, omega_rad_s: 6.0 },
            Goal::Points { angles_rad, every: 10 },
            Goal::Speed { speed_rad_s: 300.0 },
        ]
    }

    #[test]
    fn every_motion_waits_and_is_then_as_smooth_as_its_speed_says() {
        for goal in goals() {
            let motion = motion(goal);
            let jets = jets::<f64>(&motion, 600);
            assert!(jets[..50].iter().all(|jet| (jet[0] - 0.3).abs() < 1e-9 && jet[1] == 0.0), "{motion:?}");
            for (k, pair) in jets.windows(3).enumerate() {
                // r' is the slope of r. r'' is the slope of r' except at its jumps: the trapezoid rule errs by T²/12
                // r'''.
                let moved = pair[1][0] - pair[0][0];
                let off = (moved - 0.5e-3 * (pair[0][1] + pair[1][1])).abs();
                let bend = (pair[1][2] - pair[0][2]).abs() * 1e-6 + 1e-8;
                assert!(off <= bend, "{:?}, tick {k}: {off:e} of {moved:e}", motion.goal);
            }
        }
    }

    #[test]
    fn every_motion_is_on_its_goal_in_time() {
        let [rest, sine, points, speed] = goals().map(|goal| jets::<f64>(&motion(goal), 600));
        assert_eq!(rest[150], rest[599]);
        assert!((rest[150][0] + 40.0).abs() < 1e-12 && rest[149][0] > -40.0);
        for (k, [r, v, _]) in sine.iter().enumerate().skip(150) {
            let phase = 6e-3 * k as f64;
            assert!((r - phase.sin()).abs() < 1e-6 && (v - 6.0 * phase.cos()).abs() < 1e-5, "tick {k}: {r} {v}");
        }
        // A point every 10 ms, with a lag of 35 ms: the fourth-order error of a sine of 10 rad/s in steps of 0.1 rad.
        for (k, [r, ..]) in points.iter().enumerate().skip(150).take(150) {
            let expected = 0.5 * (10.0 * (1e-3 * (k as f64 - 50.0) - 0.035)).sin();
            assert!((r - expected).abs() < 2e-5, "tick {k}: {r} {expected}");
        }
        assert_eq!(points[450], points[599]);
        // Half of 0.1 s at 300 rad/s is lost in the transition, and 2^-32 revolutions per tick by rounding.
        assert!((speed[150][0] - 0.3 - 15.0).abs() < 1e-6 && (speed[599][1] - 300.0).abs() < 1e-5, "{:?}", speed[150]);
        assert!(speed[50..150].windows(2).all(|pair| pair[1][1] > pair[0][1]), "a ramp goes up");
    }

    #[test]
    fn f32_plays_the_same_motion() {
        for goal in goals() {
            let motion = motion(goal);
            let pairs = jets::<f64>(&motion, 600).into_iter().zip(jets::<f32>(&motion, 600));
            let off = pairs.map(|(a, b)| (a[0] - b[0]).abs()).fold(0.0, f64::max);
            // Error of 4e-7 of the travel.
            assert!(off <= 4e-7 * 41.0, "{:?}: {off:e}", motion.goal);
        }
    }

    /// The largest acceleration of degree 5 is 10/√3 D/τ².
    #[test]
    fn the_shortest_motion_asks_for_the_limit_and_no_more() {
        let wanted = Motion { ticks: 1, ..motion(Goal::Rest { angle_rad: 1.3 }) };
        let found = wanted.shortest::<3, 3>([1, 10_000], 1000.0, |jet| jet[2]).expect("a way");
        let tau = (10.0 / 3.0_f64.sqrt() / 1000.0).sqrt();
        assert!((f64::from(found.ticks) * 1e-3 - tau).abs() < 2e-3, "{found:?}");
        let [peak] = found.peaks::<3, 3, 1>(400, |jet| [jet[2]]);
        assert!((930.0..=1000.0).contains(&peak), "{peak}");
        assert_eq!(wanted.shortest::<3, 3>([1, 10_000], 1e-3, |jet| jet[2]), None);
    }
}
