//! The two kinds of drives: what differs between a motor and a joint, once.
//!
//! [`DriveDesign`] is a drive of either kind before it runs. Whoever asks it needs no match: [`Kind`] has an
//! implementation per kind, and what the law's types are (aim, gain sets, delay, states) is chosen there from a
//! [`Form`].

use std::any::Any;

use controller_core::drive::{
    Aim, Bounds, ChainModel, CoupledDrive, DriveError, DriveLaw, Encoder, EncoderForm, Fence, JointBandwidths,
    JointDesign, JointDrive, Monitored, MotorBandwidths, MotorDesign, MotorDrive, RestBand, RestLearning, Resting,
    Sample, Slowing, Switching, Target, WatchTicks, Watched,
};
use controller_core::{Limits, Running, drives};

use super::in_f64::boxed;
use super::{Around, Drive, Follows, Form, Law, LivePort, Monitors, Motion, Reaction, Whole};
use crate::linear::{LawAtRest, Still};
use crate::port::ControllerPort;
use crate::sensor::encoder::Mounted;

/// What monitors compare with in every tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Thresholds {
    /// |d| in the unit of each block.
    pub disturbance: Vec<f32>,
    /// |σ*|.
    pub sigma_star: f32,
    /// Ticks that are counted to.
    pub ticks: WatchTicks<f32>,
    /// u per unit of the driven shaft's speed, in the unit of its block, while it brakes.
    pub brake: f32,
    /// Limits of u.
    pub limits: [f32; 2],
    /// What one unit of u adds to the acceleration of the driven shaft, in the unit of its block.
    pub gain: f32,
    /// 1 by that, as the law has it.
    pub per_gain: f32,
}

/// What is done with a law of any of the types that a drive may have.
trait Use<const E: usize, const N: usize> {
    type Out;
    /// Does the law leave no offset when it takes over?
    const AT_REST: bool = false;

    fn of<L>(self, law: L, bounds: &Bounds<E>) -> Self::Out
    where
        L: Watched<E> + DriveLaw<E, N> + Send + 'static,
        L::State: Send;
}

/// It is run in this process.
struct Run(Reaction, Around);

impl<const E: usize, const N: usize> Use<E, N> for Run {
    type Out = Box<dyn Law<E, N>>;

    fn of<L>(self, law: L, bounds: &Bounds<E>) -> Self::Out
    where
        L: Watched<E> + DriveLaw<E, N> + Send + 'static,
        L::State: Send,
    {
        let Self(reaction, around) = self;
        let running = Running::new(Monitored::new(law, bounds).stopping_at(reaction.stops_at()));
        Box::new(Whole { running, around, resting: Resting::START })
    }
}

/// It takes over from another.
struct Succeed<const AT_REST: bool>(Reaction, Around);

impl<const E: usize, const N: usize, const AT_REST: bool> Use<E, N> for Succeed<AT_REST> {
    type Out = Box<dyn Any + Send>;
    const AT_REST: bool = AT_REST;

    fn of<L>(self, law: L, bounds: &Bounds<E>) -> Self::Out
    where
        L: Watched<E> + DriveLaw<E, N> + Send + 'static,
        L::State: Send,
    {
        Box::new((Monitored::new(law, bounds).stopping_at(self.0.stops_at()), self.1))
    }
}

/// Only what its monitors may see is asked for: also as a tick in f32 compares it.
struct Watch;

impl<const E: usize, const N: usize> Use<E, N> for Watch {
    type Out = (Bounds<E>, Thresholds);

    fn of<L: Watched<E> + DriveLaw<E, N>>(self, law: L, bounds: &Bounds<E>) -> Self::Out {
        let (gain, per_gain, limits) = (law.gain(), law.per_gain(), law.nominal_limits());
        let (disturbance, [sigma_star, brake], ticks) = Monitored::new(law, bounds).thresholds();
        (*bounds, Thresholds { disturbance: disturbance.into(), sigma_star, ticks, brake, limits, gain, per_gain })
    }
}

/// Bandwidths of a drive of either kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Bandwidths {
    /// w_c of the error, rad/s.
    pub surface_rad_s: f64,
    /// Of the observer on each encoder, rad/s.
    pub observers_rad_s: Vec<f64>,
    /// k_l, 1/s.
    pub reaching_per_s: f64,
    /// α of the offset W, 1/s.
    pub offset_per_s: f64,
}

impl Bandwidths {
    /// The same with α by rule: half of the slowest of surface and observers.
    #[must_use]
    pub fn with_offset(self) -> Self {
        let slowest = self.observers_rad_s.iter().copied().fold(self.surface_rad_s, f64::min);
        Self { offset_per_s: 0.5 * slowest, ..self }
    }
}

/// Names of a kind of drive, the state that each encoder sees, and the keys of [`Kind::KEYS`].
type Words = ([&'static str; 2], &'static [usize], (&'static [&'static str], &'static str));

/// What a kind of drive is: `E` encoders, `N` states, plans that are continuous in `P` derivatives, r included.
trait Kind<const E: usize, const N: usize, const P: usize>: Copy {
    /// Its table in a scenario file, and what it is.
    const NAMES: [&'static str; 2];
    /// The state that each encoder sees, from 0.
    const SEEN: [usize; E];
    /// Keys of the bandwidths of its observers, and of how many times as fast those of its fast gain set are.
    const KEYS: (&'static [&'static str], &'static str);

    fn period_s(&mut self) -> &mut f64;
    fn limits(&self) -> Limits;
    /// K_t.
    fn torque_n_m_per_a(&self) -> f64;
    fn gate_steps(&self) -> [f64; E];
    fn bandwidths(&self) -> Bandwidths;
    fn set_bandwidths(&mut self, to: &Bandwidths);
    /// These bandwidths, and all that goes with them by rule.
    fn redesigned(self, to: &Bandwidths, load_n_m: f64) -> Self;
    fn fast_ratios(&mut self) -> &mut [f64];
    /// Behind encoders with so many times as many counts: thresholds mean the same angles.
    fn finer(self, encoders: [Encoder; E], times: f64) -> Self;
    fn numbers(&self) -> Vec<f64>;
    /// How it slows down, so many ticks late.
    fn slowing(&self, delay_ticks: usize) -> Slowing;
    /// Its band at rest, if this kind of drive has one.
    fn rest_band(&self, learning: RestLearning) -> Option<RestBand>;

    /// Its law with its monitors, handed to whoever uses it. More than one gain set are as two; more than three ticks
    /// of delay are refused.
    fn law<U: Use<E, N>>(&self, form: Form, monitors: &Monitors<E>, user: U) -> Result<U::Out, DriveError>;
    fn at_rest(&self, form: Form) -> Result<DriveAtRest, DriveError>;
    fn in_f64(&self, of: (Form, [Mounted; E]), motion: &Motion) -> Result<Box<dyn ControllerPort>, DriveError>;
}

/// Hands a law and the bounds of its monitors to `$user`.
macro_rules! used {
    ($drive:ident, $design:ident, $monitors:ident, $user:ident, [$($load:expr)?], $($of:tt)*) => {{
        let law = $drive::<f32, $($of)*>::try_design($design)?;
        let law = if U::AT_REST { law.at_rest() } else { law };
        let bounds = $monitors.bounds(&$design.bounds(&law, $($load,)? $monitors.uncertain));
        Ok($user.of(law, &bounds))
    }};
}

impl Kind<1, 2, 3> for MotorDesign {
    const NAMES: [&'static str; 2] = ["motor", "a motor with one encoder"];
    const SEEN: [usize; 1] = [0];
    const KEYS: (&'static [&'static str], &'static str) = (&["observer_rad_s"], "fast_ratio");

    fn period_s(&mut self) -> &mut f64 {
        &mut self.period_s
    }

    fn limits(&self) -> Limits {
        self.limits
    }

    fn torque_n_m_per_a(&self) -> f64 {
        self.motor.torque_n_m_per_a
    }

    fn gate_steps(&self) -> [f64; 1] {
        [self.gate_steps]
    }

    fn bandwidths(&self) -> Bandwidths {
        let MotorBandwidths { surface_rad_s, observer_rad_s, reaching_per_s, offset_per_s } = self.bandwidths;
        Bandwidths { surface_rad_s, observers_rad_s: vec![observer_rad_s], reaching_per_s, offset_per_s }
    }

    fn set_bandwidths(&mut self, to: &Bandwidths) {
        let Bandwidths { surface_rad_s, ref observers_rad_s, reaching_per_s, offset_per_s } = *to;
        let observer_rad_s = observers_rad_s[0];
        self.bandwidths = MotorBandwidths { surface_rad_s, observer_rad_s, reaching_per_s, offset_per_s };
    }

    fn redesigned(mut self, to: &Bandwidths, _: f64) -> Self {
        self.set_bandwidths(to);
        self.with_bandwidths(self.bandwidths)
    }

    fn fast_ratios(&mut self) -> &mut [f64] {
        std::slice::from_mut(&mut self.fast_ratio)
    }

    fn finer(self, [encoder]: [Encoder; 1], times: f64) -> Self {
        let (switching, gate_steps) = (finer_switching(self.switching, times), self.gate_steps * times);
        Self { encoder, switching, gate_steps, ..self }
    }

    fn numbers(&self) -> Vec<f64> {
        self.to_numbers().into()
    }

    fn slowing(&self, delay_ticks: usize) -> Slowing {
        Self::slowing(self, delay_ticks)
    }

    fn rest_band(&self, learning: RestLearning) -> Option<RestBand> {
        Some(Self::rest_band(self, learning))
    }

    fn law<U: Use<1, 2>>(&self, form: Form, monitors: &Monitors<1>, user: U) -> Result<U::Out, DriveError> {
        self.validate(form.delay_ticks, form.observer_states)?;
        drives!(motor form.types() => used!(MotorDrive, self, monitors, user, [],))
    }

    fn at_rest(&self, form: Form) -> Result<DriveAtRest, DriveError> {
        self.validate(form.delay_ticks, form.observer_states)?;
        let design = Self { encoder: finest(self.encoder), gate_steps: f64::INFINITY, ..*self };
        macro_rules! law {
            ($($of:tt)*) => { Ok(at_rest(MotorDrive::<f64, $($of)*>::try_design(&design)?, [self.encoder])) };
        }
        drives!(quiet motor form.types() => law!())
    }

    fn in_f64(&self, of: (Form, [Mounted; 1]), motion: &Motion) -> Result<Box<dyn ControllerPort>, DriveError> {
        let (form, mounted) = of;
        self.validate(form.delay_ticks, form.observer_states)?;
        macro_rules! law {
            ($($of:tt)*) => {
                Ok(boxed::<_, _, 1, 2, _, _, 3>(MotorDrive::<f64, $($of)*>::try_design(self)?, mounted, motion))
            };
        }
        drives!(quiet motor form.types() => law!())
    }
}

/// It follows the position of its link with four states per encoder.
impl Kind<2, 4, 4> for JointDesign {
    const NAMES: [&'static str; 2] = ["joint", "a flexible joint with two encoders"];
    const SEEN: [usize; 2] = [0, 2];
    const KEYS: (&'static [&'static str], &'static str) = (&["link_rad_s", "motor_rad_s"], "fast_ratios");

    fn period_s(&mut self) -> &mut f64 {
        &mut self.period_s
    }

    fn limits(&self) -> Limits {
        self.limits
    }

    fn torque_n_m_per_a(&self) -> f64 {
        self.joint.torque_n_m_per_a
    }

    fn gate_steps(&self) -> [f64; 2] {
        self.gate_steps
    }

    fn bandwidths(&self) -> Bandwidths {
        let JointBandwidths { surface_rad_s, link_rad_s, motor_rad_s, reaching_per_s, offset_per_s } = self.bandwidths;
        Bandwidths { surface_rad_s, observers_rad_s: vec![link_rad_s, motor_rad_s], reaching_per_s, offset_per_s }
    }

    fn set_bandwidths(&mut self, to: &Bandwidths) {
        let Bandwidths { surface_rad_s, ref observers_rad_s, reaching_per_s, offset_per_s } = *to;
        let (link_rad_s, motor_rad_s) = (observers_rad_s[0], observers_rad_s[1]);
        self.bandwidths = JointBandwidths { surface_rad_s, link_rad_s, motor_rad_s, reaching_per_s, offset_per_s };
    }

    fn redesigned(mut self, to: &Bandwidths, load_n_m: f64) -> Self {
        self.set_bandwidths(to);
        self.with_bandwidths(self.bandwidths, load_n_m)
    }

    fn fast_ratios(&mut self) -> &mut [f64] {
        &mut self.fast_ratios
    }

    fn finer(self, encoders: [Encoder; 2], times: f64) -> Self {
        let (switching, gates) = (finer_switching(self.switching, times), self.gate_steps.map(|steps| steps * times));
        Self { encoders, switching, gate_steps: gates, ..self }
    }

    fn numbers(&self) -> Vec<f64> {
        self.to_coupled_numbers().map_or_else(|| self.to_numbers().into(), Into::into)
    }

    fn slowing(&self, delay_ticks: usize) -> Slowing {
        Self::slowing(self, delay_ticks)
    }

    fn rest_band(&self, _: RestLearning) -> Option<RestBand> {
        None
    }

    fn law<U: Use<2, 4>>(&self, form: Form, monitors: &Monitors<2>, user: U) -> Result<U::Out, DriveError> {
        self.validate(form.delay_ticks)?;
        if self.coupled.is_some() {
            let load = monitors.sudden_load_n_m;
            return drives!(joint form.types() => used!(CoupledDrive, self, monitors, user, [load],));
        }
        drives!(joint form.types() => used!(JointDrive, self, monitors, user, [monitors.sudden_load_n_m],))
    }

    fn at_rest(&self, form: Form) -> Result<DriveAtRest, DriveError> {
        self.validate(form.delay_ticks)?;
        let encoders = self.encoders.map(finest);
        let design = Self { encoders, gate_steps: [f64::INFINITY; 2], ..*self };
        macro_rules! coupled {
            ($($of:tt)*) => { Ok(at_rest(CoupledDrive::<f64, $($of)*>::try_design(&design)?, self.encoders)) };
        }
        if self.coupled.is_some() {
            return drives!(quiet joint form.types() => coupled!());
        }
        macro_rules! law {
            ($($of:tt)*) => { Ok(at_rest(JointDrive::<f64, $($of)*>::try_design(&design)?, self.encoders)) };
        }
        drives!(quiet joint form.types() => law!())
    }

    fn in_f64(&self, of: (Form, [Mounted; 2]), motion: &Motion) -> Result<Box<dyn ControllerPort>, DriveError> {
        let (form, mounted) = of;
        self.validate(form.delay_ticks)?;
        macro_rules! coupled {
            ($($of:tt)*) => {
                Ok(boxed::<_, _, 2, 4, _, _, 4>(CoupledDrive::<f64, $($of)*>::try_design(self)?, mounted, motion))
            };
        }
        if self.coupled.is_some() {
            return drives!(quiet joint form.types() => coupled!());
        }
        macro_rules! law {
            ($($of:tt)*) => {
                Ok(boxed::<_, _, 2, 4, _, _, 4>(JointDrive::<f64, $($of)*>::try_design(self)?, mounted, motion))
            };
        }
        drives!(quiet joint form.types() => law!())
    }
}

fn finer_switching(Switching { calm_steps, alert_steps, smoothing_s, keep_s }: Switching, times: f64) -> Switching {
    Switching { calm_steps: calm_steps * times, alert_steps: alert_steps * times, smoothing_s, keep_s }
}

/// A drive of one kind before it runs: numbers, types and encoders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveOf<D, const E: usize> {
    /// Its numbers.
    pub design: D,
    /// Its types.
    pub form: Form,
    /// Its encoders; of a joint those of link and motor.
    pub mounted: [Mounted; E],
    /// What is watched.
    pub monitors: Monitors<E>,
}

impl<D, const E: usize> DriveOf<D, E> {
    fn live<const N: usize, const P: usize>(&self, motion: &Motion) -> Result<Box<dyn LivePort>, DriveError>
    where
        D: Kind<E, N, P>,
    {
        let reaction = self.monitors.reaction;
        let around = self.around();
        let law = self.design.law(self.form, &self.monitors, Run(reaction, around))?;
        Ok(Box::new(Drive::<E, N, P>::new(law, (self.mounted, around), self.form, reaction, motion)))
    }

    fn fence<const N: usize, const P: usize>(&self) -> Option<Fence>
    where
        D: Kind<E, N, P>,
    {
        self.monitors.fence.map(|limits| Fence::new(&limits, self.design.slowing(self.form.delay_ticks)))
    }

    fn around<const N: usize, const P: usize>(&self) -> Around
    where
        D: Kind<E, N, P>,
    {
        Around { fence: self.fence(), rest_band: self.rest_band() }
    }

    fn rest_band<const N: usize, const P: usize>(&self) -> Option<RestBand>
    where
        D: Kind<E, N, P>,
    {
        let learning = self.monitors.rest_band.filter(|_| self.form.follows == Follows::Position);
        learning.and_then(|learning| self.design.rest_band(learning))
    }

    fn successor<const N: usize, const P: usize>(&self, at_rest: bool) -> Result<Box<dyn Any + Send>, DriveError>
    where
        D: Kind<E, N, P>,
    {
        let Self { design, form, monitors, .. } = self;
        if at_rest {
            design.law(*form, monitors, Succeed::<true>(monitors.reaction, self.around()))
        } else {
            design.law(*form, monitors, Succeed::<false>(monitors.reaction, self.around()))
        }
    }

    fn port_to<'a, const N: usize, const P: usize>(
        &self,
        law: impl Law<E, N> + 'a,
        motion: &Motion,
    ) -> Box<dyn ControllerPort + 'a>
    where
        D: Kind<E, N, P>,
    {
        let of = (self.mounted, self.around());
        Box::new(Drive::<E, N, P>::new(Box::new(law), of, self.form, self.monitors.reaction, motion))
    }

    fn watched<const N: usize, const P: usize>(&self) -> Result<(Vec<f64>, Thresholds), DriveError>
    where
        D: Kind<E, N, P>,
    {
        let (bounds, thresholds) = self.design.law(self.form, &self.monitors, Watch)?;
        Ok((bounds.to_numbers().collect(), thresholds))
    }

    fn finer<const N: usize, const P: usize>(self, encoder: impl Fn(Encoder) -> Encoder, times: f64) -> Self
    where
        D: Kind<E, N, P>,
    {
        let mounted = self.mounted.map(|mounted| Mounted::new(encoder(mounted.encoder)));
        let design = self.design.finer(mounted.map(|mounted| mounted.encoder), times);
        Self { design, mounted, ..self }
    }
}

/// Of the kind of this drive.
const fn words<D, const E: usize, const N: usize, const P: usize>(_: &DriveOf<D, E>) -> Words
where
    D: Kind<E, N, P>,
{
    (D::NAMES, &D::SEEN, D::KEYS)
}

/// As the plan of a drive of this kind has them.
fn jets<D, const E: usize, const N: usize, const P: usize>(
    _: &DriveOf<D, E>,
    motion: &Motion,
) -> Box<dyn Fn(u32) -> [f64; 4] + Send + Sync>
where
    D: Kind<E, N, P>,
{
    Box::new(motion.jets::<P, 4>())
}

/// A drive of either kind before it runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveDesign {
    /// Of a motor.
    Motor(DriveOf<MotorDesign, 1>),
    /// Of a joint.
    Joint(DriveOf<JointDesign, 2>),
}

/// The same expression for a drive of either kind.
macro_rules! each {
    ($drive:expr, $of:ident => $answer:expr) => {
        match $drive {
            DriveDesign::Motor($of) => $answer,
            DriveDesign::Joint($of) => $answer,
        }
    };
}

impl DriveDesign {
    /// `motor` or `joint`, its table in a scenario file.
    pub const fn name(&self) -> &'static str {
        each!(self, drive => words(drive).0[0])
    }

    /// `a motor with one encoder` or `a flexible joint with two encoders`.
    pub const fn title(&self) -> &'static str {
        each!(self, drive => words(drive).0[1])
    }

    /// Is it a joint that is designed as a whole?
    pub const fn is_whole(&self) -> bool {
        matches!(self, Self::Joint(DriveOf { design: JointDesign { coupled: Some(_), .. }, .. }))
    }

    /// Keys of the bandwidths of its observers in a scenario file.
    pub const fn observer_keys(&self) -> &'static [&'static str] {
        each!(self, drive => words(drive).2.0)
    }

    /// Key of how many times as fast the observers of its fast gain set are.
    pub const fn fast_key(&self) -> &'static str {
        each!(self, drive => words(drive).2.1)
    }

    /// Of each encoder the state that it sees, from 0, and how it is mounted.
    pub fn encoders(&self) -> Vec<(usize, Mounted)> {
        each!(self, drive => words(drive).1.iter().copied().zip(drive.mounted).collect())
    }

    /// Its types.
    pub const fn form(&self) -> Form {
        each!(self, drive => drive.form)
    }

    /// Its types, to be changed.
    pub const fn form_mut(&mut self) -> &mut Form {
        each!(self, drive => &mut drive.form)
    }

    /// The same; alarms are told and no more, for whoever asks what its law does with any load.
    #[must_use]
    pub const fn telling(mut self) -> Self {
        match &mut self {
            Self::Motor(drive) => drive.monitors.reaction = Reaction::GoOn,
            Self::Joint(drive) => drive.monitors.reaction = Reaction::GoOn,
        }
        self
    }

    /// The same without a band at rest.
    #[must_use]
    pub const fn without_rest_band(mut self) -> Self {
        if let Self::Motor(drive) = &mut self {
            drive.monitors.rest_band = None;
        }
        self
    }

    /// What follows an alarm.
    pub const fn reaction(&self) -> Reaction {
        each!(self, drive => drive.monitors.reaction)
    }

    /// The fence around it.
    pub fn fence(&self) -> Option<Fence> {
        each!(self, drive => drive.fence())
    }

    /// The band within which it is let be at rest.
    pub fn rest_band(&self) -> Option<RestBand> {
        each!(self, drive => drive.rest_band())
    }

    /// The largest load that comes at once, N m.
    pub const fn sudden_load_n_m(&self) -> f64 {
        each!(self, drive => drive.monitors.sudden_load_n_m)
    }

    /// T, s.
    pub fn period_s(&self) -> f64 {
        let mut copy = *self;
        *copy.period_mut_s()
    }

    /// T, s, to be changed.
    pub fn period_mut_s(&mut self) -> &mut f64 {
        each!(self, drive => drive.design.period_s())
    }

    /// Largest current of either sign, A.
    pub fn max_current_a(&self) -> f64 {
        let limits = self.limits();
        limits.max.min(-limits.min)
    }

    /// Between what its current stays, A.
    pub fn limits(&self) -> Limits {
        each!(self, drive => drive.design.limits())
    }

    /// K_t, N m per A.
    pub fn torque_n_m_per_a(&self) -> f64 {
        each!(self, drive => drive.design.torque_n_m_per_a())
    }

    /// How many steps of its encoder a count may be off, of each encoder.
    pub fn gate_steps(&self) -> Vec<f64> {
        each!(self, drive => drive.design.gate_steps().to_vec())
    }

    /// Its bandwidths.
    pub fn bandwidths(&self) -> Bandwidths {
        each!(self, drive => drive.design.bandwidths())
    }

    /// These bandwidths, and nothing else: gates and switching stay.
    pub fn set_bandwidths(&mut self, to: &Bandwidths) {
        each!(self, drive => drive.design.set_bandwidths(to));
    }

    /// These bandwidths, and all that goes with them by rule; of a joint for this sudden load.
    #[must_use]
    pub fn redesigned(mut self, to: &Bandwidths, load_n_m: f64) -> Self {
        each!(&mut self, drive => drive.design = drive.design.redesigned(to, load_n_m));
        self
    }

    /// How many times as fast its observers are in the fast gain set; to be changed.
    pub fn fast_ratios(&mut self) -> &mut [f64] {
        each!(self, drive => drive.design.fast_ratios())
    }

    /// The same behind other encoders with so many times as many counts: thresholds mean the same angles.
    #[must_use]
    pub(in crate::port) fn finer(self, encoder: impl Fn(Encoder) -> Encoder, times: f64) -> Self {
        match self {
            Self::Motor(drive) => Self::Motor(drive.finer(encoder, times)),
            Self::Joint(drive) => Self::Joint(drive.finer(encoder, times)),
        }
    }

    /// r, r', .. of a motion at any tick, whole turns included, as the plan of this drive has it.
    pub fn jets(&self, motion: &Motion) -> Box<dyn Fn(u32) -> [f64; 4] + Send + Sync> {
        each!(self, drive => jets(drive, motion))
    }

    /// The drive along a reference, in this process.
    ///
    /// # Errors
    /// Those of the design.
    pub fn port(&self, motion: &Motion) -> Result<Box<dyn ControllerPort>, DriveError> {
        Ok(self.live(motion)?)
    }

    /// The same, to be moved and re-tuned while it runs.
    ///
    /// # Errors
    /// Those of the design.
    pub fn live(&self, motion: &Motion) -> Result<Box<dyn LivePort>, DriveError> {
        each!(self, drive => drive.live(motion))
    }

    /// The law alone, to take over from one of the same form.
    /// What stands around its law.
    pub(super) fn around(&self) -> Around {
        each!(self, drive => drive.around())
    }

    pub(super) fn successor(&self, at_rest: bool) -> Result<Box<dyn Any + Send>, DriveError> {
        each!(self, drive => drive.successor(at_rest))
    }

    /// The same with a law that runs elsewhere.
    pub fn port_to<'a, X>(&self, law: X, motion: &Motion) -> Box<dyn ControllerPort + 'a>
    where
        X: Law<1, 2> + Law<2, 4> + 'a,
    {
        each!(self, drive => drive.port_to(law, motion))
    }

    /// The same along its reference in f64, with the quiet gain set alone and without monitors.
    ///
    /// # Errors
    /// Those of the design.
    pub fn in_f64(&self, motion: &Motion) -> Result<Box<dyn ControllerPort>, DriveError> {
        each!(self, drive => drive.design.in_f64((drive.form, drive.mounted), motion))
    }

    /// The law in f64 that stands still at angle 0 with its quiet gains; the link of a joint hangs down.
    ///
    /// # Errors
    /// Those of the design.
    pub fn at_rest(&self) -> Result<DriveAtRest, DriveError> {
        each!(self, drive => drive.design.at_rest(drive.form))
    }

    /// What it is designed from, what its monitors may see, and the bits of the alarms at which it stops, as the
    /// numbers of [`drive::LAYOUT`](controller_core::drive::LAYOUT).
    ///
    /// # Errors
    /// Those of the design.
    pub fn numbers(&self) -> Result<Vec<f64>, DriveError> {
        let stops_at = f64::from(self.reaction().stops_at().bits());
        let (bounds, _) = self.thresholds()?;
        Ok(each!(self, drive => drive.design.numbers()).into_iter().chain(bounds).chain([stops_at]).collect())
    }

    /// What its monitors compare with in every tick, and the same in the units of people: |d| of each shaft in rad/s²,
    /// |σ*|, ticks at a limit.
    ///
    /// # Errors
    /// Those of the design.
    pub fn thresholds(&self) -> Result<(Vec<f64>, Thresholds), DriveError> {
        each!(self, drive => drive.watched())
    }
}

/// A drive that stands still at angle 0 with its quiet gains, in f64.
pub struct DriveAtRest {
    /// Its law. The encoders are only finer, so that a step of them is a small change.
    pub law: Box<dyn LawAtRest>,
    /// λ_2, what |σ*| stays below as long as every innovation is at most one step of its encoder, in the unit of x_n.
    pub sigma_star_bound: f64,
}

fn at_rest<M, A, const E: usize, const N: usize, const S: usize, const LATE: usize>(
    law: EncoderForm<f64, M, A, E, N, S, 0, LATE>,
    coarse: [Encoder; E],
) -> DriveAtRest
where
    M: ChainModel<f64, E, N> + Send + 'static,
    A: Aim<f64, N, Target: Send> + Send,
{
    let target = A::told(&Target { turn: 0, jet: [0.0; N] });
    let sample = move |counts: &[f64]| Sample {
        counts: std::array::from_fn(|i| Some(counts[i] as i32)),
        begin: target,
        end: target,
    };
    let units_rad = coarse.map(|encoder| finest(encoder).unit_rad());
    let steps = std::array::from_fn(|i| coarse[i].unit_rad() / units_rad[i]);
    let sigma_star_bound = law.sigma_star_bound(steps);
    // The channels of the angles have no disturbance.
    let still = Still::new(law, E, units_rad.into(), sample, |known| known.disturbance.map(|d| [0.0, d]).concat());
    let Some(still) = still else { unreachable!("a drive starts at angle 0") };
    DriveAtRest { law: Box::new(still), sigma_star_bound }
}

/// The same encoder with as many counts as a drive may have.
fn finest(encoder: Encoder) -> Encoder {
    let counts = u64::from(encoder.counts_per_turn) * u64::from(encoder.gear_num);
    let k = (0..24).rev().find(|&k| counts <= (1 << 24) >> k).unwrap_or(0);
    Encoder { bits: 32, states: 0, counts_per_turn: encoder.counts_per_turn << k, ..encoder }
}
