//! A drive in this process: counts in, current out, along a reference that it plays.
//!
//! The law is [`EncoderForm`](drive::EncoderForm), the very one that runs on a chip, in f32; gain sets, delay, states
//! and aim are types there and numbers here ([`Form`]). The sample is the counts of
//! [`Encoders`](crate::sensor::encoder::Encoders), from which [`Mounted`] takes sign and offset, as a program on the
//! chip would.
//!
//! A [`Motion`] waits at rest where it begins, is on its way for some ticks, and then on its goal:
//!
//! ```text
//! r = from      tick < start
//! r = join      start <= tick < start + ticks       (drive::Joined: r and its derivatives are continuous)
//! r = goal      from there on
//! ```
//!
//! After an alarm of its monitors a drive goes on, stops, or follows a joined stop from there on ([`Reaction`]).
//!
//! It is played in f32 for the law and in f64 for whoever records the run. Estimates are the disturbance of each shaft
//! (rad/s²), in the channel of its speed.

use std::any::Any;
use std::f64::consts::TAU;
use std::sync::Arc;

use controller_core::drive::{
    self, Bounds, DriveError, DriveLaw, Fence, FenceLimits, Joined, Monitored, Player, Reference, Rest, RestBand,
    RestLearning, Resting, Sample, Sine, Streamed, Target, Watched,
};
use controller_core::{ControlLaw as _, Health, MAX_R, Output, Real, Running};

use crate::MAX_ORDER;
use crate::port::{ControllerPort, PortError, Tick};
use crate::sensor::encoder::Mounted;

mod in_f64;
mod kind;

pub use kind::{Bandwidths, DriveAtRest, DriveDesign, DriveOf, Thresholds};

/// Units of an angle that is kept as a whole number, per turn.
const TWO_32: f64 = 4_294_967_296.0;

/// Where a motion leads.
#[derive(Clone, Debug, PartialEq)]
pub enum Goal {
    /// Rest at this angle.
    Rest {
        /// Rad.
        angle_rad: f64,
    },
    /// A sin ωt about angle 0, with phase 0 at tick 0.
    Sine {
        /// A, rad.
        amplitude_rad: f64,
        /// ω, rad/s.
        omega_rad_s: f64,
    },
    /// A smooth curve through points that come evenly, the first at the start; late by 3.5 of them.
    Points {
        /// Rad.
        angles_rad: Vec<f64>,
        /// Ticks from one to the next.
        every: u32,
    },
    /// Set-points that come at any time, through a profile ([`drive::Profile`]); the first at the start.
    SetPoints {
        /// Rad.
        angles_rad: Vec<f64>,
        /// Ticks from one to the next.
        every: u32,
        /// What the profile keeps to.
        limits: drive::ProfileLimits,
        /// Ticks for which the path is made; it ends there.
        until: u32,
    },
    /// Even turning; the way there loses half the angle that it would have made.
    Speed {
        /// Rad/s.
        speed_rad_s: f64,
    },
}

/// From rest onto a goal.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Where it leads.
    pub goal: Goal,
    /// Angle at rest before, rad.
    pub from_rad: f64,
    /// The tick at which it begins.
    pub start: u32,
    /// Ticks from rest onto the goal.
    pub ticks: u32,
    /// Period of a tick, s.
    pub period_s: f64,
}

impl Motion {
    /// At rest at this angle for ever. Other motions are this with what differs, as `Motion { goal, ..Motion::rest(0.3,
    /// 1e-3) }`.
    pub const fn rest(angle_rad: f64, period_s: f64) -> Self {
        Self { goal: Goal::Rest { angle_rad }, from_rad: angle_rad, start: 0, ticks: 1, period_s }
    }

    /// The same, as short as it may be: at least `fewest` ticks from rest onto the goal (and 20, as [`drive::shortest`]
    /// has it), at most `most`, and as many as it takes for the current `feed_forward` of the jets on the way to stay
    /// within ±`u_max`. `None` if no way does.
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

    /// Returns the largest |values| of several functions of the jets in ticks 0 to `last`. The path of set-points is
    /// computed once for all of them.
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

    /// From where `present` is at this tick to rest, in so many ticks or fewer.
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

    /// r, r', .. at any tick, whole turns included, for a controller of one's own. The way onto the goal is continuous
    /// in `M` of them; that of a joint's drive in 4, that of a motor's in 3.
    pub fn jets<const M: usize, const J: usize>(&self) -> impl Fn(u32) -> [f64; J] + Send + Sync + use<M, J> {
        let plan = self.plan::<f64, M>();
        move |tick| {
            let Target { turn, mut jet } = plan.at(tick);
            jet[0] += TAU * f64::from(turn);
            jet
        }
    }

    /// From this tick on.
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
        // Gaps are taken in f64 whatever the plan is played in: all of them are the same plan.
        let mut present = Target { turn: before.turn, jet: [T::ZERO; M] };
        present.jet[0] = before.angle;
        let gap = drive::gap(&present, &course.at(start));
        Plan { before, start, after: Joined::new(course, gap, start, ticks, period_s) }
    }
}

/// A motion as it is played: targets at both ends of each tick.
type Played<T, const M: usize, const J: usize> = Player<T, Plan<T, M>, J>;

/// A motion, ready to be played.
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

/// What the stream of points was after each of them had come.
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
        // The last one comes again until the curve rests there.
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

/// An angle far out as turns and a rest: f32 keeps its digits.
fn turns_and_rest(angle_rad: f64) -> (i32, f64) {
    let turn = libm::round(angle_rad / TAU);
    (turn as i32, angle_rad - turn * TAU)
}

/// Targets of a profile from rest, one per tick from the start on. Goals that it refuses stay away.
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

/// What a profile made.
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
        // The derivative above those of the path is constant within a tick: what it is in the next.
        let above = (self.targets[(k + 1).min(last)].jet[3] - jet[3]) * self.per_s;
        Target { turn, jet: std::array::from_fn(|j| jet.get(j).copied().unwrap_or(above)) }
    }
}

/// Even turning. The angle is a whole number that wraps with the turns: it never drifts.
#[derive(Clone, Copy, Debug)]
struct Turning<T> {
    /// At the start, in 2^-32 turns.
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

/// What a drive follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Follows {
    /// The angle.
    Position,
    /// The speed alone.
    Speed,
}

/// The types of a drive, as numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Form {
    /// What it follows.
    pub follows: Follows,
    /// 1, or 2: fast gains too.
    pub gain_sets: usize,
    /// Ticks from the computation of u until it is held, 0 to 3.
    pub delay_ticks: usize,
    /// States of a motor's observer: 3, or 4. A joint has 4.
    pub observer_states: usize,
}

impl Form {
    /// Does it follow a speed, has it two gain sets, have its observers four states; and its ticks of delay. For
    /// [`drives!`](controller_core::drives).
    pub const fn types(self) -> ([bool; 3], usize) {
        let Self { follows, gain_sets, delay_ticks, observer_states } = self;
        ([matches!(follows, Follows::Speed), gain_sets > 1, observer_states > 3], delay_ticks)
    }
}

/// What the monitors of a drive may see of it (as far as they are known: the law adds the rest), and what follows an
/// alarm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monitors<const E: usize> {
    /// How well the data sheet is known, as a share: the thresholds by rule are for this.
    pub uncertain: f64,
    /// Largest |d| of each shaft, rad/s²; `None` by rule.
    pub disturbance: [Option<f64>; E],
    /// Largest |σ*|; `None` by rule.
    pub sigma_star: Option<f64>,
    /// Ticks that u may be at a limit while |σ| does not fall; `None` by rule.
    pub stuck_ticks: Option<u32>,
    /// Largest load that comes at once, N m: part of a joint's thresholds by rule. A motor's do not depend on it.
    pub sudden_load_n_m: f64,
    /// What follows an alarm.
    pub reaction: Reaction,
    /// Where the shaft may be, how fast, and how far from its target; to break it is an alarm. `None` for no limits.
    pub fence: Option<FenceLimits>,
    /// The band of a motor that follows a position, within which it is let be at rest. `None` for none.
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

/// What follows an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// It is told, and no more; a [`RUNAWAY`](drive::RUNAWAY) stops the drive, as it does under the others.
    GoOn,
    /// It brakes as long as its counts can be believed, then the fallback goes out.
    Brake,
    /// The fallback goes out from then on.
    Fallback,
    /// The reference comes to rest in so many ticks. Where the current does not suffice, or nothing is known, the
    /// fallback goes out: a count that sticks lets nothing come to rest.
    JoinedStop {
        /// From the end of the tick with the alarm.
        ticks: u32,
    },
}

impl Reaction {
    /// The alarms that stop the drive by itself, beside those that stop any.
    pub const fn stops_at(self) -> Health {
        match self {
            Self::GoOn => Health::OK,
            Self::Brake => drive::BRAKING,
            Self::Fallback => drive::ALARMS,
            Self::JoinedStop { .. } => drive::BEYOND_CONTROL,
        }
    }
}

/// The law of a drive that runs, with its monitors: in this process, or at the end of a wire.
pub trait Law<const E: usize, const N: usize>: Send {
    /// One tick, and what is known after it. A drive that follows a speed reads r' alone.
    ///
    /// # Errors
    /// When it could not be reached.
    fn tick(&mut self, sample: &Sample<i32, Target<f32, i32, N>, E>) -> Result<Ticked<E>, PortError>;

    /// What the actuator really holds since the last tick.
    fn report_applied(&mut self, u: f32);

    /// The next counts start it anew.
    ///
    /// # Errors
    /// When it could not be reached.
    fn reset(&mut self) -> Result<(), PortError>;

    /// Tells one design from another; none if that is not known here.
    fn fingerprint(&self) -> Option<u32>;

    /// Another law of the same type takes over, before the tick with this sample.
    ///
    /// # Errors
    /// When it is of another type or cannot take over; the old one goes on then.
    fn take(&mut self, _: Box<dyn Any>, _: &Sample<i32, Target<f32, i32, N>, E>) -> Result<(), PortError> {
        Err(PortError::Refused("this law runs elsewhere: it is re-tuned there".into()))
    }
}

/// Output of a tick, and the disturbance of each shaft, rad/s² (0 before the start).
pub type Ticked<const E: usize> = (Output<f32>, [f32; E]);

/// What stands around a law within its monitors: before a tick the band at rest, after it the fence.
#[derive(Clone, Copy, Debug)]
struct Around {
    fence: Option<Fence>,
    rest_band: Option<RestBand>,
}

impl Around {
    /// The targets of a tick, as its law is to have them.
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

/// A drive in this process.
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

    fn reset(&mut self) -> Result<(), PortError> {
        self.running.reset();
        Ok(())
    }

    fn fingerprint(&self) -> Option<u32> {
        Some(self.running.design().fingerprint())
    }

    fn take(&mut self, other: Box<dyn Any>, sample: &Sample<i32, Target<f32, i32, N>, E>) -> Result<(), PortError> {
        let other = other.downcast::<(Monitored<L, E>, Around)>().map_err(|_| {
            PortError::Refused("the other design is of another form: drive, gain sets, delay, states, aim".into())
        })?;
        let (law, around) = *other;
        // The targets of the tick that comes, which moves them itself.
        let (sample, _) = around.placed(&mut { self.resting }, &self.running, sample);
        self.running.retune(law, &sample).map_err(|error| PortError::Refused(error.to_string()))?;
        self.around = around;
        Ok(())
    }
}

/// A drive that is moved and re-tuned while it runs.
pub trait LivePort: ControllerPort {
    /// Another motion, from the coming tick on: it waits where this one rests.
    fn play(&mut self, motion: &Motion);

    /// Before the coming tick another design of the same form takes over, without a jump of u; or, `at_rest`, without
    /// an offset W ([`at_rest`](drive::EncoderForm::at_rest)). Where that cannot be, that tick says so.
    ///
    /// # Errors
    /// Those of the design.
    fn retune(&mut self, to: &DriveDesign, at_rest: bool) -> Result<(), DriveError>;
}

/// What a planned stop answers.
const ANSWERS: Health = drive::ANSWERED.union(drive::FENCED);

/// The law with its encoders and its reference. The plan takes over `P` derivatives, r included.
struct Drive<'a, const E: usize, const N: usize, const P: usize> {
    law: Box<dyn Law<E, N> + 'a>,
    mounted: [Mounted; E],
    /// What stands around the law, for its identity.
    around: Around,
    follows: Follows,
    /// Ticks from the computation of u until it is held.
    late: u32,
    player: Played<f32, P, N>,
    motion: Motion,
    exact: Plan<f64, P>,
    /// Ticks of a joined stop after an alarm, and the one that is under way.
    stop_ticks: Option<u32>,
    stopping: Option<Plan<f64, P>>,
    /// What takes over with the coming tick.
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

    /// After an alarm: from where the reference now is, to rest.
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
                // r' is the slope of r, and r'' that of r' but for its jumps: the trapezoid errs by T²/12 r'''.
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
        // A point every 10 ms, 35 ms late; the fourth order of a sine of 10 rad/s in steps of 0.1 rad.
        for (k, [r, ..]) in points.iter().enumerate().skip(150).take(150) {
            let expected = 0.5 * (10.0 * (1e-3 * (k as f64 - 50.0) - 0.035)).sin();
            assert!((r - expected).abs() < 2e-5, "tick {k}: {r} {expected}");
        }
        assert_eq!(points[450], points[599]);
        // Half of 0.1 s at 300 rad/s is lost on the way, and 2^-32 turns per tick by rounding.
        assert!((speed[150][0] - 0.3 - 15.0).abs() < 1e-6 && (speed[599][1] - 300.0).abs() < 1e-5, "{:?}", speed[150]);
        assert!(speed[50..150].windows(2).all(|pair| pair[1][1] > pair[0][1]), "a ramp goes up");
    }

    #[test]
    fn f32_plays_the_same_motion() {
        for goal in goals() {
            let motion = motion(goal);
            let pairs = jets::<f64>(&motion, 600).into_iter().zip(jets::<f32>(&motion, 600));
            let off = pairs.map(|(a, b)| (a[0] - b[0]).abs()).fold(0.0, f64::max);
            // 4e-7 of the way to go.
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
